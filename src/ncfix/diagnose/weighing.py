"""One account of evidence: how well a set of effects explains the data, less what each of them must pay.

The weight of a set is the log likelihood of the data with these effects there (evidence.py), less a price for each:

    ln(names)         it was chosen from all names of the catalogue
    ln(forms sizes)   and its form and size from those that it may have
    SURE, FURTHER     ln 100 for the first, ln 20 for every further one
    UNNAMED           ln 20 more for a rival without a name: of twenty effects that are missing one is in no catalogue

The first two make the weights of all sets probabilities of one mixture, whose mean under noise alone is 1. So by
Markov's inequality noise weighs more than an empty set in at most one of a hundred measurements, and more with a name
too many than with the true set in at most one of twenty, of whatever design (e-values: Vovk and Wang 2021).

An effect is never quite what the catalogue says: the true one may differ in shape by a smooth share (`MISSHAPEN`) of
what it shows. What such a change explains is no reason for another name, nor for a rival.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ncfix.diagnose.background import SHARES
from ncfix.diagnose.evidence import SIZES, Court, Heard, Member
from ncfix.diagnose.fields import slow
from ncfix.measure.measurement import Array

Members = Mapping[str, Member]

FALSE_ALARM = 0.01
"""How often noise alone may name anything."""
COMPANION = 0.05
"""How often noise alone may bring a further name."""
SURE, FURTHER = float(-np.log(FALSE_ALARM)), float(-np.log(COMPANION))
UNNAMED = float(np.log(20.0))
"""Log odds beforehand against what is in no catalogue."""
MISSHAPEN = 0.2
"""How much the shape of an effect may differ from that of the catalogue, as a share of what it shows."""
USUAL = SHARES[2]
"""The share of the background at which it is asked what the members show."""


def margin(count: int) -> float:
    """What so many effects pay for being there."""
    return SURE + (count - 1) * FURTHER if count else 0.0


@dataclass(frozen=True, repr=False)
class Scale:
    """Weighs sets of effects; remembers what it has weighed.

    free  what is there besides in any case, and no names to be found: constants that the machine file lacks
    """

    court: Court
    free: tuple[Member, ...] = ()
    weights: dict[frozenset[Member], float] = field(default_factory=dict)
    sketches: dict[frozenset[Member], float] = field(default_factory=dict)
    asked: dict[frozenset[Member], Heard] = field(default_factory=dict)
    allowed: dict[frozenset[Member], Array | None] = field(default_factory=dict)

    def weight(self, members: Members) -> float:
        """Log likelihood of the data with these members, less their prices."""
        key = frozenset(members.values())
        if key not in self.weights:
            self.weights[key] = self._likelihood(members) - self._paid(members)
        return self.weights[key]

    def sketched(self, members: Members) -> float:
        """The same at first sight: of effects that are shaped as in the catalogue."""
        return self._plain(members) - self._paid(members)

    def _paid(self, members: Members) -> float:
        return sum(map(self.price, members)) + margin(len(members))

    def _plain(self, members: Members) -> float:
        key = frozenset(members.values())
        if key not in self.sketches:
            self.sketches[key] = self.court.likelihood(self.all(members))
        return self.sketches[key]

    def _likelihood(self, members: Members) -> float:
        """Of effects shaped as in the catalogue, or a little otherwise: either in half of all machines."""
        plain, allowance = self._plain(members), self.allowance(members)
        if allowance is None:
            return plain
        misshapen = self.court.likelihood(self.all(members), allowance)
        return float(np.logaddexp(plain, misshapen) - np.log(2))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names to be found."""
        free = {member.group for member in self.free}
        return tuple(name for name in self.court.names if self.court.forms[name][0] not in free)

    def all(self, members: Members) -> list[Member]:
        """The members and what is free."""
        return [*members.values(), *self.free]

    def price(self, name: str) -> float:
        """What an effect pays for what it was chosen from."""
        chosen = np.log(len(self.court.forms[name]) * len(SIZES))
        rivals = self.court.rivals
        return float(chosen + (np.log(len(rivals)) + UNNAMED if name in rivals else np.log(len(self.names))))

    def heard(self, members: Members) -> Heard:
        """The odds of everything beside these members."""
        key = frozenset(members.values())
        if key not in self.asked:
            self.asked[key] = self.court.heard(self.all(members), self.allowance(members))
        return self.asked[key]

    def allowance(self, members: Members) -> Array | None:
        """What the named members would show besides if their shapes differed a little, in the coordinates, (n, k)."""
        key = frozenset(members.values())
        if key not in self.allowed:
            self.allowed[key] = self._allowance(members)
        return self.allowed[key]

    def _allowance(self, members: Members) -> Array | None:
        court = self.court
        named = [each for name, each in members.items() if name in court.names and not court.constant(name)]
        if not named:
            return None
        every = self.all(members)
        shown = court.shown(every, USUAL)
        whole = np.sum([each for member, each in zip(every, shown, strict=True) if member in named], axis=0)
        return court.background.seen(MISSHAPEN * whole[:, None] * self._slow)

    @cached_property
    def _slow(self) -> Array:
        """How a shape may differ, (m, k)."""
        return slow(self.court.background.view)
