"""Names that act in the same way in these data: what the one shows, the other can show, whatever else it might.

A spindle that grows and a frame that drifts along a tool that never turns differ in the course that is assumed of them,
a bed and a ram that sag in the power of their curve. Odds between such names are odds of what is assumed.

Which effects are there: the set that weighs most, found by adding, exchanging and dropping one at a time.

Constants of the machine that its file lacks: where axes lie, gains. They go before all that is not one.

Every machine has them, and almost any curve or sag looks like one in part. So names of other effects are looked for
with all of them free; which constants are there is asked afterwards, beside what was found.

What these data would have shown: how large an effect has to be so that it is found. Silence means no more than that.

The numbers behind an effect of size s have variance s^2. With d the squares that each of its independent parts shows at
a size of one, over the variance of noise and background, its log odds are 1/2 sum(s^2 d - ln(1 + s^2 d)) on average.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnosis.evidence import Comparison, Evidence, Member, Members, entry_price
from ncfix.measure.least_squares import orthonormal, without
from ncfix.values import frozen

OVERLAP = 0.25
"""Share of what a name shows that another must be able to show to be an alias, however likely it is in its place."""
TOLD_APART = 6.0
"""Squared noise units of what the first shows that the second cannot, from which on data tell them apart."""
DOUBT = 3.0
"""Standard deviations of what noise shows, on top of its mean, that are no such squares."""
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
NO_BETTER = 1.0
"""Log odds within which a name is no better than one that consists of a part of its errors only."""
TOGETHER = 3
"""Names that are tried as a whole where none helps by itself."""
NEARLY = 20.0
"""Log odds within which these must come to what is there, before they are helped by what has no name."""
WEIGHED = 5
"""Of all changes so many, the best at first sight, are weighed with all care."""
HELPS = 0.1
"""Log odds by which a change must help."""
CONSTANT_UM = 300.0
"""How far they may be off while they are free, on a machining centre."""
FEW_SHOWN = 0.5
"""Share of the names that these poses can show which must be found at the largest size: else it is hardly anything."""


def untold(scale: Comparison, selected: Selected, name: str, other: str) -> float:
    """Squared noise units of what a member shows that another name cannot, with its best form, beyond what noise may
    bring; zero where the errors of both, as fitted to these data, are the same but for noise.
    """
    return _untold(scale.evidence, scale.all(selected.members), selected.members[name], other)


def _untold(evidence: Evidence, members: Sequence[Member], own: Member, other: str) -> float:
    """With numbers z = P K'y behind all members K, P = (1 + K'K)^-1, of which noise alone has the covariance P K'K P:
    a member of many numbers shows a little of each by noise, and none of that tells it from a name of fewer.
    """
    share, place = evidence.share(members), list(members).index(own)
    parts = [member.size * _white(evidence, member.group, share) for member in members]
    columns = np.concatenate(parts, axis=1)
    inner = columns.T @ columns
    solved, start = np.linalg.inv(np.eye(len(inner)) + inner), sum(part.shape[1] for part in parts[:place])
    mine = slice(start, start + parts[place].shape[1])
    numbers = (solved @ (columns.T @ (evidence.y / np.sqrt(evidence.background.variance(share)))))[mine]
    spread, noise = (solved @ inner @ solved)[mine, mine], evidence.noise(members, share)
    beyond = []
    for form in evidence.forms[other]:
        left = _unexplained(parts[place], evidence.background.data.sizes[-1] * _leading(evidence, form, share))
        by_noise = left @ spread
        usual = np.trace(by_noise) + DOUBT * np.sqrt(2 * np.trace(by_noise @ by_noise))
        beyond.append(float(numbers @ left @ numbers) / noise - float(usual))
    return max(min(beyond), 0.0)


def _overlap(evidence: Evidence, members: Sequence[Member], own: Member, other: str) -> bool:
    """Whether a name can show some of what `own`, one of the members, shows: else it acts in other directions."""
    share = evidence.share(members)
    shown = _white(evidence, own.group, share) @ evidence.numbers(members, share)[list(members).index(own)]
    by = (_white(evidence, form, share) for form in evidence.forms[other])
    return max(_shared(shown[:, None], columns) for columns in by) > OVERLAP


def _white(evidence: Evidence, group: int, share: float) -> Array:
    """The columns of a form in units of noise and background, (n, p)."""
    return evidence.own(group) / np.sqrt(evidence.background.variance(share))[:, None]


def _leading(evidence: Evidence, group: int, share: float) -> Array:
    """As `_white`, of the effect itself, each column 1 um at the tool tip.

    Its shape in the catalogue does not count, nor what only comes with it, as a constant with a play, which stands in
    no name's place.
    """
    form, background = evidence.groups[group], evidence.background
    sizes, effects = np.sqrt((form.columns**2).sum(axis=0)), form.owner.effects[: form.owner.lead]
    columns = form.columns
    if effects:
        own = form.loading[: sum(effect.basis.size for effect in effects)]
        there = (form.single != 0).any(axis=1)  # of two dates those of the later one only
        columns = np.where(there[:, None], background.data.design(effects) @ own, 0.0)
    scaled = columns * np.sqrt(background.data.count) / np.where(sizes > 0, sizes, 1.0)
    return background.seen(scaled) / np.sqrt(background.variance(share))[:, None]


def _unexplained(shown: Array, sized: Array) -> Array:
    """Inner products (k, k) of what of some columns (n, k) others of the largest size cannot show, and of the numbers
    behind those. Without the latter a combination that hardly shows could stand for anything.
    """
    seen = sized.T @ shown
    return shown.T @ shown - seen.T @ np.linalg.solve(np.eye(sized.shape[1]) + sized.T @ sized, seen)


def _shared(columns: Array, by: Array) -> float:
    """Share of the squares of some columns that others can show."""
    return 1.0 - float((without(orthonormal(by), columns) ** 2).sum() / (columns**2).sum())


@frozen(slots=False)
class Selected:
    """The effects that are there, likeliest first, with what was considered.

    members   name -> form and size
    odds      name -> log odds that it is there, the others given; what it was chosen from is counted
    runners_up  name -> {other name: log odds of that one in its place}
    alternatives  the keys of members that have no name
    acting_alike  name -> those of its runners-up that act in the same way in these data
    """

    members: dict[str, Member]
    odds: dict[str, float]
    runners_up: dict[str, dict[str, float]]
    alternatives: frozenset[str] = frozenset()
    acting_alike: dict[str, frozenset[str]] = field(default_factory=dict)

    @property
    def named(self) -> list[str]:
        """The members that have a name."""
        return [name for name in self.members if name not in self.alternatives]

    @property
    def unnamed(self) -> list[str]:
        """The members that have none."""
        return [name for name in self.members if name in self.alternatives]

    def p_value(self, name: str) -> float:
        """A bound on the probability that noise alone gives any name such odds."""
        return float(np.exp(-max(self.odds[name], 0.0)))


def select(scale: Comparison, offered: Sequence[str], start: Members | None = None) -> dict[str, Member]:
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
    if any(name in scale.evidence.alternatives for name in members if name not in fixed):
        found = _climbed(scale, names_of(scale, offered), _together(scale, offered, fixed), fixed)
        if scale.weight(found) > scale.weight(members) - NEARLY:
            members = _better(scale, members, _climbed(scale, offered, found, fixed))
    return members


def _better(scale: Comparison, members: dict[str, Member], trial: dict[str, Member]) -> dict[str, Member]:
    return trial if scale.weight(trial) > scale.weight(members) + HELPS else members


def _together(scale: Comparison, offered: Sequence[str], members: Members) -> dict[str, Member]:
    """Some names more, the likeliest one after another, whether they help or not."""
    names, found = names_of(scale, offered), dict(members)
    for _ in range(TOGETHER):
        tried = [{**found, name: each} for name, each in likeliest(scale, names, found).items()]
        found = max(tried, key=scale.weight, default=found)
    return found


def names_of(scale: Comparison, offered: Sequence[str]) -> list[str]:
    """Those on offer that have a name."""
    return [name for name in offered if name in scale.evidence.names]


def _climbed(scale: Comparison, offered: Sequence[str], members: Members, fixed: Members) -> dict[str, Member]:
    """The best of all changes, again and again until none helps."""
    while True:
        best = max(_promising(scale, _changes(scale, offered, members, fixed), members), key=scale.weight)
        if scale.weight(best) <= scale.weight(members) + HELPS:
            return dict(members)
        members = best


def _promising(scale: Comparison, changes: list[dict[str, Member]], members: Members) -> list[dict[str, Member]]:
    """All changes that only leave effects away, and the best of the others at first sight."""
    fewer = [each for each in changes if len(each) <= len(members) and set(each) <= set(members)]
    other = [each for each in changes if each not in fewer]
    return fewer + sorted(other, key=scale.sketched, reverse=True)[:WEIGHED]


def _changes(scale: Comparison, offered: Sequence[str], members: Members, fixed: Members) -> list[dict[str, Member]]:
    """One effect more, another in the place of one, or one less."""
    found = [dict(members)]
    if len(members) < MOST:
        found += [{**members, name: each} for name, each in likeliest(scale, offered, members).items()]
    for out in members:
        if out not in fixed:
            others = _less(members, out)
            found += [others, *({**others, name: each} for name, each in likeliest(scale, offered, others).items())]
    return found


def likeliest(scale: Comparison, offered: Sequence[str], members: Members) -> dict[str, Member]:
    """The effects that have the best odds beside some members, in their likeliest form and size."""
    odds, evidence = scale.candidate_odds(members), scale.evidence
    free = {name: odds.of(evidence.forms[name]) for name in offered if name not in members}
    order = sorted(free, key=lambda name: -free[name])
    named = [name for name in order if name in evidence.names][:TRIED]
    nameless = [name for name in order if name in evidence.alternatives][: TRIED // 2]
    return {name: odds.likeliest(evidence.forms[name])[0] for name in (*named, *nameless)}


def with_alternatives(scale: Comparison, members: Members) -> Selected:
    """What else could stand in each member's place."""
    evidence, members = scale.evidence, _formed(scale, members)
    odds: dict[str, float] = {}
    runners_up: dict[str, dict[str, float]] = {}
    acting_alike: dict[str, frozenset[str]] = {}
    for name in members:
        others = _less(members, name)
        sort = [each for each in _sort(evidence, name) if each not in others]
        tried = {
            each: scale.candidate_odds(others).likeliest(evidence.forms[each], FORMS)
            for each in likeliest(scale, sort, others)
        }
        tried[name] = [members[name]]
        heaviest = {each: max(scale.weight({**others, each: own}) for own in forms) for each, forms in tried.items()}
        gained = {each: weight - scale.weight(others) for each, weight in heaviest.items()}
        paid = entry_price(len(members)) - entry_price(len(others))
        odds[name] = gained.pop(name) + paid
        runners_up[name] = {each: value + paid for each, value in gained.items()}
        near = [each for each, value in runners_up[name].items() if value > odds[name] - ASSUMED * ALIKE]
        there = scale.all(members)
        for other in [each for each in near if not _overlap(evidence, there, members[name], each)]:
            del runners_up[name][other]
        acting_alike[name] = frozenset(
            each
            for each in near
            if each in runners_up[name] and _untold(evidence, there, members[name], each) < TOLD_APART
        )
    ranked = {name: members[name] for name in sorted(members, key=lambda name: -odds[name])}
    return Selected(ranked, odds, runners_up, frozenset(evidence.alternatives), acting_alike)


def plainest(scale: Comparison, selected: Selected) -> Selected:
    """With names that consist of fewer errors where they say as much: a backlash in the place of an angular play with
    one lever, which brings a backlash; and in the place of one that claims what no data show, any alias that does not:
    of a straightness alone nobody can say that a sag brings it.
    """
    evidence = scale.evidence
    for name in selected.named:
        others, alike = _less(selected.members, name), selected.acting_alike[name]
        claims = _claims(evidence, selected.members[name].group)
        fewer = {
            each: selected.runners_up[name][each]
            for each in sorted(alike)
            if selected.runners_up[name][each] > selected.odds[name] - ASSUMED * (ALIKE if claims else NO_BETTER)
            and (
                not _claims(evidence, evidence.forms[each][0])
                if claims
                else _errors(evidence, each) < _errors(evidence, name)
            )
        }
        if fewer:
            plain = max(fewer, key=lambda each: fewer[each])
            forms = scale.candidate_odds(others).likeliest(evidence.forms[plain], FORMS)
            found = ({**others, plain: form} for form in forms)
            selected = with_alternatives(scale, max(found, key=scale.weight))
    return selected


def _errors(evidence: Evidence, name: str) -> set[str]:
    """The errors that a name consists of."""
    return {effect.name for effect in evidence.groups[evidence.forms[name][0]].owner.effects}


def _claims(evidence: Evidence, group: int) -> bool:
    """Whether an effect itself, in this form, consists of errors of which the data show some and others not at all."""
    form, data = evidence.groups[group], evidence.background.data
    effects = () if form.owner.grows else form.owner.effects[: form.owner.lead or None]
    starts = np.cumsum([0, *(effect.basis.size for effect in effects)])
    own = [e for e, start in zip(effects, starts, strict=False) if form.loading[start : start + e.basis.size].any()]
    return any(not data.design([effect]).any() for effect in own)


def _formed(scale: Comparison, members: Members) -> dict[str, Member]:
    """Each member in the heaviest of its likeliest forms, as others are weighed in its place.

    It came in with the form that was likeliest while the background had to explain it, too.
    """
    found = dict(members)
    for name in members:
        forms = scale.candidate_odds(_less(found, name)).likeliest(scale.evidence.forms[name], FORMS)
        found = max([found, *({**found, name: form} for form in forms)], key=scale.weight)
    return found


def _sort(evidence: Evidence, name: str) -> Sequence[str]:
    """What could stand in its place: rivals for a rival, constants for a constant."""
    if name not in evidence.names:
        return evidence.alternatives
    return [each for each in evidence.names if evidence.constant(each) == evidence.constant(name)]


def _less(members: Members, out: str) -> dict[str, Member]:
    return {name: member for name, member in members.items() if name != out}


def aliases(selected: Selected, name: str) -> list[str]:
    """Names that explain a member's part nearly as well, or act in the same way."""
    rest, acting_alike = selected.runners_up[name], selected.acting_alike.get(name, frozenset())
    found = [key for key in rest if rest[key] > selected.odds[name] - ALIKE * (ASSUMED if key in acting_alike else 1.0)]
    return sorted(found, key=lambda key: -rest[key])


def with_constants_free(evidence: Evidence) -> Comparison:
    """A scale on which the lacking constants are as free as those that the file has."""
    free_um = CONSTANT_UM * evidence.background.data.large
    return Comparison(
        evidence,
        tuple(Member(evidence.forms[name][0], free_um) for name in evidence.names if evidence.constant(name)),
    )


def with_constants(scale: Comparison, members: Members) -> dict[str, Member]:
    """The members and the constants that are there.

    Constants are looked for beside what has no name, before other names have taken their part; with those they leave
    only where the data speak against them.
    """
    evidence = scale.evidence
    offered = [name for name in evidence.names if evidence.constant(name)]
    if not offered:
        return dict(members)
    nameless = {name: member for name, member in members.items() if name in evidence.alternatives}
    found = {**select(scale, offered, nameless), **members}
    for name in offered:
        less = {key: member for key, member in found.items() if key != name}
        if name in found and scale.weight(less) - scale.price(name) > scale.weight(found):
            found = less
    return found


def findable_sizes(scale: Comparison) -> dict[str, float]:
    """The smallest of the sizes, um rms, at which an effect of each name would be found; inf where it is at none."""
    share = scale.evidence.share([])
    return {name: _smallest(scale.evidence, name, share, scale.price(name) + entry_price(1)) for name in scale.names}


def _smallest(evidence: Evidence, name: str, share: float, needed: float) -> float:
    """Of the form that shows best."""
    strengths = [evidence.strength(group, share) for group in evidence.forms[name]]
    enough = (
        size
        for size in evidence.background.data.sizes
        if max(mean_odds(size**2 * each) for each in strengths) >= needed
    )
    return next(enough, float("inf"))


def mean_odds(shown: Array) -> float:
    """The log odds that an effect has on average, by the variances (k,) that it shows over those of noise: s^2 d."""
    return 0.5 * float((shown - np.log1p(shown)).sum())


def shows_hardly_anything(findable: Mapping[str, float], sizes: Sequence[float]) -> bool:
    """Whether few of the names that the poses can show would be found. A laser shows one error, but that one well."""
    return sum(size <= sizes[-1] for size in findable.values()) < FEW_SHOWN * max(len(findable), 1)


def findable_in_words(findable: Mapping[str, float], count: int, sizes: Sequence[float]) -> str:
    """How many of so many names would have been found, at which size."""
    found = [(size, sum(own <= size for own in findable.values())) for size in sizes]
    steps = [(size, number) for k, (size, number) in enumerate(found) if number > (found[k - 1][1] if k else 0)]
    if not steps:
        return f"none of {count} effects would have been found, were it {sizes[-1]:g} um rms"
    first, *others = [f"from {size:g} um rms on {number}" for size, number in steps]
    return f"what would have been found: {', '.join([f'{first} of {count} effects', *others])}"
