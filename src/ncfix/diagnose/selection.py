"""Which effects are there: the set that weighs most, found by adding, exchanging and dropping one at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ncfix.diagnose.evidence import Court, Member
from ncfix.diagnose.twins import acts_alike
from ncfix.diagnose.weighing import Members, Scale, margin

MOST = 5
"""Effects that are taken to be there at most."""
TRIED = 5
"""Of all effects that may be added so many, the likeliest, are weighed; of those without a name, half as many."""
FORMS = 2
"""Forms of another name that are weighed in a member's place."""
ALIKE = 3.0
"""Log odds (20 to 1) within which another name explains a member's part as well."""
ASSUMED = 3.0
"""So much less count odds between names that act in the same way: they rest on courses and shapes that are assumed."""
TOGETHER = 3
"""Names that are tried as a whole where none helps by itself."""
NEARLY = 20.0
"""Log odds within which these must come to what is there, before they are helped by what has no name."""
WEIGHED = 5
"""Of all changes so many, the best at first sight, are weighed with all care."""
HELPS = 0.1
"""Log odds by which a change must help."""


@dataclass(frozen=True)
class Selected:
    """The effects that are there, likeliest first, with what was considered.

    members   name -> form and size
    odds      name -> log odds that it is there, the others given; what it was chosen from is counted
    runners   name -> {other name: log odds of that one in its place}
    rivals    the names of what has none
    twins     name -> those of its runners that act in the same way in these data
    """

    members: dict[str, Member]
    odds: dict[str, float]
    runners: dict[str, dict[str, float]]
    rivals: frozenset[str] = frozenset()
    twins: dict[str, frozenset[str]] = field(default_factory=dict)

    @property
    def named(self) -> list[str]:
        """The members that have a name."""
        return [name for name in self.members if name not in self.rivals]

    @property
    def unnamed(self) -> list[str]:
        """The members that have none."""
        return [name for name in self.members if name in self.rivals]

    def p_value(self, name: str) -> float:
        """A bound on the probability that noise alone gives any name such odds."""
        return float(np.exp(-max(self.odds[name], 0.0)))


def select(scale: Scale, offered: Sequence[str], start: Members | None = None) -> dict[str, Member]:
    """The members that weigh most together; those of `start` stay.

    When nothing helps any more each member is taken away in turn and may not come back, and it is looked whether
    others do better: two may stand where one came in first. And before something is said to have no name, several names
    are tried that do it only together.
    """
    fixed = dict(start or {})
    members = _climbed(scale, offered, fixed, fixed)
    for out in [name for name in members if name not in fixed]:
        others = _less(members, out)
        found = _climbed(scale, [name for name in offered if name != out], others, fixed)
        members = _better(scale, members, found)
    if any(name in scale.court.rivals for name in members if name not in fixed):
        found = _climbed(scale, names_of(scale, offered), _together(scale, offered, fixed), fixed)
        if scale.weight(found) > scale.weight(members) - NEARLY:
            members = _better(scale, members, _climbed(scale, offered, found, fixed))
    return members


def _better(scale: Scale, members: dict[str, Member], trial: dict[str, Member]) -> dict[str, Member]:
    return trial if scale.weight(trial) > scale.weight(members) + HELPS else members


def _together(scale: Scale, offered: Sequence[str], members: Members) -> dict[str, Member]:
    """Some names more, the likeliest one after another, whether they help or not."""
    names, found = names_of(scale, offered), dict(members)
    for _ in range(TOGETHER):
        tried = [{**found, name: each} for name, each in likeliest(scale, names, found).items()]
        found = max(tried, key=scale.weight, default=found)
    return found


def names_of(scale: Scale, offered: Sequence[str]) -> list[str]:
    """Those on offer that have a name."""
    return [name for name in offered if name in scale.court.names]


def _climbed(scale: Scale, offered: Sequence[str], members: Members, fixed: Members) -> dict[str, Member]:
    """The best of all changes, again and again until none helps."""
    while True:
        best = max(_promising(scale, _changes(scale, offered, members, fixed), members), key=scale.weight)
        if scale.weight(best) <= scale.weight(members) + HELPS:
            return dict(members)
        members = best


def _promising(scale: Scale, changes: list[dict[str, Member]], members: Members) -> list[dict[str, Member]]:
    """Those that leave effects away, and of the others the best at first sight."""
    fewer = [each for each in changes if len(each) <= len(members) and set(each) <= set(members)]
    other = [each for each in changes if each not in fewer]
    return fewer + sorted(other, key=scale.sketched, reverse=True)[:WEIGHED]


def _changes(scale: Scale, offered: Sequence[str], members: Members, fixed: Members) -> list[dict[str, Member]]:
    """One effect more, another in the place of one, or one less."""
    found = [dict(members)]
    if len(members) < MOST:
        found += [{**members, name: each} for name, each in likeliest(scale, offered, members).items()]
    for out in members:
        if out not in fixed:
            others = _less(members, out)
            found += [others, *({**others, name: each} for name, each in likeliest(scale, offered, others).items())]
    return found


def likeliest(scale: Scale, offered: Sequence[str], members: Members) -> dict[str, Member]:
    """The effects that have the best odds beside some members, in their likeliest form and size."""
    heard, court = scale.heard(members), scale.court
    free = {name: heard.of(court.forms[name]) for name in offered if name not in members}
    order = sorted(free, key=lambda name: -free[name])
    named = [name for name in order if name in court.names][:TRIED]
    nameless = [name for name in order if name in court.rivals][: TRIED // 2]
    return {name: heard.likeliest(court.forms[name])[0] for name in (*named, *nameless)}


def judged(scale: Scale, members: Members) -> Selected:
    """What else could stand in each member's place."""
    court, members = scale.court, _formed(scale, members)
    odds: dict[str, float] = {}
    runners: dict[str, dict[str, float]] = {}
    twins: dict[str, frozenset[str]] = {}
    for name in members:
        others = _less(members, name)
        sort = [each for each in _sort(court, name) if each not in others]
        tried = {
            each: scale.heard(others).likeliest(court.forms[each], FORMS) for each in likeliest(scale, sort, others)
        }
        tried[name] = [members[name]]
        heaviest = {each: max(scale.weight({**others, each: own}) for own in forms) for each, forms in tried.items()}
        gained = {each: weight - scale.weight(others) for each, weight in heaviest.items()}
        paid = margin(len(members)) - margin(len(others))
        odds[name] = gained.pop(name) + paid
        runners[name] = {each: value + paid for each, value in gained.items()}
        near = [each for each, value in runners[name].items() if value > odds[name] - ASSUMED * ALIKE]
        twins[name] = frozenset(each for each in near if acts_alike(court, scale.all(members), members[name], each))
    ranked = {name: members[name] for name in sorted(members, key=lambda name: -odds[name])}
    return Selected(ranked, odds, runners, frozenset(court.rivals), twins)


def _formed(scale: Scale, members: Members) -> dict[str, Member]:
    """Each member in the heaviest of its likeliest forms, as others are weighed in its place.

    It came in with the form that was likeliest while the background had to explain it, too.
    """
    found = dict(members)
    for name in members:
        forms = scale.heard(_less(found, name)).likeliest(scale.court.forms[name], FORMS)
        found = max([found, *({**found, name: form} for form in forms)], key=scale.weight)
    return found


def _sort(court: Court, name: str) -> Sequence[str]:
    """What could stand in its place: rivals for a rival, constants for a constant."""
    if name not in court.names:
        return court.rivals
    return [each for each in court.names if court.constant(each) == court.constant(name)]


def _less(members: Members, out: str) -> dict[str, Member]:
    return {name: member for name, member in members.items() if name != out}


def aliases(selected: Selected, name: str) -> list[str]:
    """Names that explain a member's part nearly as well, or act in the same way."""
    rest, twins = selected.runners[name], selected.twins.get(name, frozenset())
    found = [key for key in rest if rest[key] > selected.odds[name] - ALIKE * (ASSUMED if key in twins else 1.0)]
    return sorted(found, key=lambda key: -rest[key])
