"""Which effects are there: one after another, exchanged while that helps, stopped where noise could do as well."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ncfix.diagnose.background import SHARES
from ncfix.diagnose.evidence import Court, Evidence, Member, log_odds
from ncfix.measure.measurement import Array

MOST = 5
"""Effects that are named at most."""
RARE = float(np.log(10))
"""Log odds against each further effect that is missing at the same time."""
TRIALS = 300
FALSE_ALARM = 0.01
"""How often noise alone may name anything."""
DENIED = -1.0
"""Log odds below which a constant of the machine is taken not to be there after all. All machines have all of them."""
LEAST = 3.0
"""Log odds (20 to 1) that a name must have at least."""


@dataclass(frozen=True)
class Null:
    """What the largest log odds of all names are when there is nothing but noise: a Gumbel distribution."""

    place: float
    scale: float

    @property
    def threshold(self) -> float:
        """Log odds that noise alone exceeds in one of a hundred measurements."""
        quantile = self.place - self.scale * np.log(-np.log1p(-FALSE_ALARM))
        return float(max(LEAST, quantile))

    def p_value(self, odds: float) -> float:
        """The probability that noise alone gives such odds for any name."""
        return float(-np.expm1(-np.exp(-(odds - self.place) / self.scale)))


@dataclass(frozen=True)
class Selected:
    """The names that are there, likeliest first, with what was considered.

    members   name -> form and size
    odds      name -> log odds given the other members
    runners   name -> {other name: log odds of that one in its place}
    first     log odds of all names before anything was named
    null      what noise alone does
    steps     names as they came in, with their odds then
    rivals    the names of what has none
    """

    members: dict[str, Member]
    odds: dict[str, float]
    runners: dict[str, dict[str, float]]
    first: dict[str, float]
    null: Null
    steps: list[tuple[str, float]] = field(default_factory=list)
    rivals: frozenset[str] = frozenset()

    @property
    def named(self) -> list[str]:
        """The members that have a name."""
        return [name for name in self.members if name not in self.rivals]

    def without(self, name: str, court: Court) -> Selected:
        """The same with one member fewer."""
        members = {key: value for key, value in self.members.items() if key != name}
        return judged(court, members, self.first, self.null, self.steps)

    @property
    def unnamed(self) -> list[str]:
        """The members that have none."""
        return [name for name in self.members if name in self.rivals]


def select(court: Court, null: Null | None = None, start: Sequence[str] = ()) -> Selected:
    """Add the likeliest effect as long as noise could not have made it, exchanging members on the way.

    `start` are rivals without a name that are there from the beginning, and stay.
    """
    empty = court.heard([])
    first = {name: empty.of(court.forms[name]) for name in court.names}
    null = noise_alone(court, empty) if null is None else null
    steps: list[tuple[str, float]] = []
    members = _grown(court, null, _started(court, start), steps)
    if len(members) > 1 and not start:
        members = _regrown(court, null, members)
    return judged(court, members, first, null, steps)


def _grown(
    court: Court, null: Null, members: dict[str, Member], steps: list[tuple[str, float]], barred: str = ""
) -> dict[str, Member]:
    """Members with all that can be added one after another; `steps` tells in which order."""
    most = MOST + sum(name in court.rivals for name in members)
    while len(members) < most:
        evidence = court.heard(list(members.values()))
        offered = [name for name in court.names if name not in members and name != barred]
        odds = {name: evidence.of(court.forms[name]) for name in offered}
        name = max(odds, key=lambda each: odds[each], default=None)
        if name is None or odds[name] < asked(court, null, members):
            break
        steps.append((name, odds[name]))
        members = {**members, name: evidence.best(court.forms[name])}
        if len(members) > 1:
            members = _exchanged(court, members, int(evidence.null.argmax()))
    return members


def _regrown(court: Court, null: Null, members: dict[str, Member]) -> dict[str, Member]:
    """Every member in turn taken away and others looked for: two may stand for the one that came in first."""
    best, most = members, likelihood(court, members)
    for out in members:
        others = {name: member for name, member in members.items() if name != out}
        found = _grown(court, null, others, [], barred=out)
        value = likelihood(court, found)
        if value > most + 1.0:
            best, most = found, value
    return best


def likelihood(court: Court, members: Mapping[str, Member], beside: Array | None = None) -> float:
    """Log likelihood of a whole, the names that it was chosen from counted against it, and how rare several are."""
    named = sum(name in court.names for name in members)
    chosen = named * np.log(len(court.names)) + max(named - 1, 0) * RARE
    nameless = (len(members) - named) * np.log(max(len(court.rivals), 1))
    return court.likelihood(list(members.values()), beside) - float(chosen + nameless)


def asked(court: Court, null: Null, members: Mapping[str, Member]) -> float:
    """Log odds that a name must have. Beside something unknown noise is not all that could have made it: then the
    odds are counted against all the names that there are."""
    beside = any(name in court.rivals for name in members)
    return max(null.threshold, LEAST + float(np.log(len(court.names)))) if beside else null.threshold


def _started(court: Court, start: Sequence[str]) -> dict[str, Member]:
    evidence = court.heard([], among=court.unnamed)
    return {name: evidence.best(court.forms[name]) for name in start}


def _exchanged(court: Court, members: dict[str, Member], share: int) -> dict[str, Member]:
    """Every member replaced by whatever explains its part better, sizes and forms anew; rivals by themselves only."""
    for name in list(members):
        others = {key: value for key, value in members.items() if key != name}
        named = name in court.names
        evidence = court.heard(list(others.values()), [share], None if named else court.unnamed)
        offered = [key for key in court.names if key not in others] if named else [name]
        odds = {key: evidence.of(court.forms[key]) for key in offered}
        best = max(odds, key=lambda key: odds[key])
        chosen = best if odds[best] > odds[name] + 1.0 else name
        members = {key if key != name else chosen: value for key, value in members.items()}
        members[chosen] = evidence.best(court.forms[chosen])
    return members


def judged(
    court: Court, members: dict[str, Member], first: dict[str, float], null: Null, steps: list[tuple[str, float]]
) -> Selected:
    """Members that the others have made superfluous leave; what else could stand in each one's place."""
    odds: dict[str, float] = {}
    runners: dict[str, dict[str, float]] = {}
    # constants last: they leave only where what is left of the others denies them
    for name in sorted(members, key=lambda key: court.constant(key)):
        others = [value for key, value in members.items() if key != name]
        evidence = court.heard(others, among=None if name in court.names else court.unnamed)
        here = {key: evidence.of(court.forms[key]) for key in _alike(court, name) if key == name or key not in members}
        if here[name] < _needed(court, null, members, name):
            members = {key: value for key, value in members.items() if key != name}
            continue
        odds[name], runners[name] = here[name], {k: v for k, v in here.items() if k != name}
    ranked = dict(sorted(members.items(), key=lambda item: -odds[item[0]]))
    return Selected(ranked, odds, runners, first, null, steps, frozenset(court.rivals))


def _alike(court: Court, name: str) -> Sequence[str]:
    """What could stand in its place: rivals for a rival, constants for a constant."""
    if name not in court.names:
        return court.rivals
    return [each for each in court.names if court.constant(each) == court.constant(name)]


def _needed(court: Court, null: Null, members: Mapping[str, Member], name: str) -> float:
    """Log odds with which a member stays."""
    if name not in court.names:
        return LEAST
    beside = any(each in court.names and not court.constant(each) for each in members)
    return DENIED if court.constant(name) and beside else asked(court, null, members)


def noise_alone(court: Court, evidence: Evidence, seed: int = 0) -> Null:
    """Simulate residuals of this design without any effect and see which odds the best name has."""
    share = SHARES[int(evidence.null.argmax())]
    _, columns = court.whitened(share, [])
    noise = np.random.default_rng(seed).normal(size=(TRIALS, columns.shape[0]))
    total, freedom = (noise**2).sum(axis=1) + court.background.freedom, columns.shape[0] + court.background.freedom
    projected = noise @ columns
    best = np.full(TRIALS, -np.inf)
    for forms in (court.forms[name] for name in court.names):
        parts = [_trial_odds(columns[:, court.part(k)], projected[:, court.part(k)], total, freedom) for k in forms]
        best = np.maximum(best, np.log(np.exp(np.clip(np.stack(parts), -50, 50)).mean(axis=(0, 2))))
    scale = float(np.std(best)) * np.sqrt(6) / np.pi
    return Null(float(np.mean(best)) - 0.5772 * scale, scale)


def _trial_odds(columns: Array, projected: Array, total: Array, freedom: float) -> Array:
    eigen, vectors = np.linalg.eigh(columns.T @ columns)
    return log_odds(np.broadcast_to(np.maximum(eigen, 0), projected.shape), (projected @ vectors) ** 2, total, freedom)


def aliases(selected: Selected, name: str, within: float = 3.0) -> list[str]:
    """Names that explain a member's part nearly as well: odds of less than 20 to 1 against them."""
    rest = selected.runners[name]
    found = [key for key, value in rest.items() if value > selected.odds[name] - within]
    return sorted(found, key=lambda key: -rest[key])


__all__ = ["Null", "Selected", "aliases", "judged", "likelihood", "noise_alone", "select"]
