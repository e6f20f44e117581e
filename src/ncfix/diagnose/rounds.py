"""Each name in turn taken for the true one, and every other refitted to old and new rows together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import compress

import numpy as np

from ncfix.diagnose.contest import Contest
from ncfix.diagnose.evidence import Court
from ncfix.diagnose.groups import Group
from ncfix.measure.measurement import Array, Measurement
from ncfix.measure.observation import Observation
from ncfix.measure.observe import observe

TOLD = 6.0
"""Squared noise units from which on a rival may be told apart: then the odds are 20 to 1 in one of two measurements."""
WEAK = 1e-6
"""Prior on what is free, so that unseen combinations do no harm."""


@dataclass(frozen=True, repr=False)
class Side:
    """A name with what it would be: its likeliest form, the numbers behind it, and all forms with their sizes in um."""

    group: Group
    numbers: Array
    forms: tuple[tuple[Group, float], ...]


@dataclass(frozen=True, repr=False)
class Rounds:
    """All contests between some names, over poses on offer.

    names     the first is the one that was chosen
    contests  for each name, were it true, one against each of the others in their order
    count     poses on offer
    """

    names: tuple[str, ...]
    contests: list[list[Contest]]
    count: int

    @staticmethod
    def of(court: Court, sides: Sequence[Side], offered: Measurement, sigma: float) -> Rounds:
        """Those between the sides; `sigma` is the noise of a value, um."""
        new = observe(offered, court.background.view.machine)
        pairs = [[(true, other) for other in sides if other is not true] for true in sides]
        contests = [[_contest(court, new, *pair, sigma) for pair in own] for own in pairs]
        return Rounds(tuple(side.group.owner.name for side in sides), contests, len(offered))

    @cached_property
    def able(self) -> list[list[bool]]:
        """Whether all poses together would tell the other from the true one, for each contest."""
        return [[each.told(range(self.count)) > TOLD for each in own] for own in self.contests]

    @cached_property
    def useful(self) -> list[list[Contest]]:
        """The contests that poses can decide, of the names that have any."""
        kept = [list(compress(own, can)) for own, can in zip(self.contests, self.able, strict=True)]
        return [own for own in kept if own]

    @property
    def told_from_first(self) -> tuple[str, ...]:
        """The others that can be told from the first name, or it from them."""
        ways = zip(self.names[1:], self.able[0], self.able[1:], strict=True)
        return tuple(name for name, there, back in ways if there or back[0])

    @property
    def stuck(self) -> tuple[str, ...]:
        """The names that some other would imitate at all poses, were they true."""
        return tuple(name for name, can in zip(self.names, self.able, strict=True) if not all(can))


def _contest(court: Court, new: Observation, true: Side, other: Side, sigma: float) -> Contest:
    """Columns: set-up of the old rows, of the new ones, constants of the machine, the forms of the other."""
    view = court.background.view
    constants = view.problem.design.shape[1]
    used = view.base.shape[1] - constants
    setup = 1e3 * new.unknown_design(new.unknowns.start)
    fresh, weight = setup.shape[1], 1 / (sigma * view.relative)
    imitating = [size * group.columns for group, size in other.forms]
    old = np.concatenate([view.base[:, :used], np.zeros((len(view.y), fresh)), view.base[:, used:], *imitating], axis=1)
    imitating = [size * _shown(new, group) for group, size in other.forms]
    kinematic = 1e3 * new.design(view.problem.selection.estimated)
    rows = np.concatenate([np.zeros((len(setup), used)), setup, kinematic, *imitating], axis=1)
    free = used + fresh + constants
    scale = np.ones(old.shape[1])
    scale[:free] = np.sqrt((old[:, :free] ** 2).mean(axis=0) + (rows[:, :free] ** 2).mean(axis=0))
    scale = np.where(scale > 0, scale, 1.0)
    prior = np.concatenate([np.full(free, WEAK), np.ones(old.shape[1] - free)])
    old, rows = old / scale * weight[:, None], rows / scale / sigma
    signal = (true.group.columns @ true.numbers) * weight
    count = len(new.measurement)
    return Contest(
        old.T @ old + np.diag(prior), old.T @ signal, float(signal @ signal),
        rows.reshape(count, -1, rows.shape[1]), (_shown(new, true.group) @ true.numbers / sigma).reshape(count, -1),
    )  # fmt: skip


def _shown(new: Observation, group: Group) -> Array:
    """What the numbers of a form show in the poses on offer, um."""
    used = group.loading.any(axis=1)
    shown: Array = 1e3 * new.design(group.owner.effects)[:, used] @ group.loading[used]
    return shown
