"""Selection of the effects that the data support, their aliases, and the size from which an effect would be found.

Selection. The set of effects with the largest weight (evidence.py), found by adding, exchanging and dropping one at a
time. Constants that the machine file lacks (location errors, gains) are free while other effects are sought, since
every machine has them and almost any curve looks like one in part. Which of them are there is decided afterwards.

Aliases. Two names act alike in these data if one can imitate the other: growth of a spindle and drift of a frame along
a tool that never turns differ only in their assumed course in time, sag of a bed and of a ram only in the power of a
curve. Odds between such names rest on assumptions, and count less.

Findable sizes. An effect of size s has coefficients of variance s^2. With d the squared signal-to-noise ratio of each
of its independent parts at size one, its log odds are on average 1/2 sum(s^2 d - ln(1 + s^2 d)). It would be found if
these exceed its price; a diagnosis that finds nothing excludes no smaller effects.
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
"""Smallest share of a member's effect on the data that another name must be able to show, to be its alias."""
TOLD_APART = 6.0
"""Squared effect, in units of the noise, of a member that another name cannot show, from which data tell them apart."""
NOISE_SIGMAS = 3.0
"""Standard deviations, above its mean, of the squared effect that noise alone causes; only the excess counts."""
MAX_EFFECTS = 5
"""Largest number of effects in a set."""
TRIED = 5
"""Number of effects, the likeliest, that are tried as additions; of unnamed alternatives half as many."""
FORMS = 2
"""Number of forms of another name that are tried in a member's place."""
ALIAS_LOG_ODDS = 3.0
"""Log odds (20 to 1) within which another name explains the same data as well."""
ASSUMED = 3.0
"""Factor on `ALIAS_LOG_ODDS` for names that act alike, whose odds rest on assumed courses and shapes."""
MAX_ALIAS_LAG = ASSUMED * ALIAS_LOG_ODDS + TOLD_APART / 2
"""Log odds within which a name is looked at as an alias; see `lead_needed`."""
NO_BETTER = 1.0
"""Log odds within which a name made of fewer errors is preferred."""
TRIED_JOINTLY = 3
"""Number of names that are added together if none helps by itself."""
WORTH_CLIMBING = 20.0
"""Log odds below the best set within which such a joint set is improved further, with unnamed alternatives."""
WEIGHED = 5
"""Number of changes, the best at first sight, whose weight is computed exactly."""
MIN_GAIN = 0.1
"""Log odds that a change of the set must gain."""
CONSTANT_UM = 300.0
"""Standard deviation of the lacking constants while they are free, um at the tool tip, for a machining centre."""
FEW_SHOWN = 0.5
"""If less than this share of the visible names is findable at the largest size, the data show hardly anything."""


def lead_needed(told: float) -> float:
    """Log odds by which a name must lead another to leave it out, if `told` squared noise units of the data tell them
    apart: these are told / 2 of the lead. What is beyond rests on assumed courses and shapes.
    """
    return ALIAS_LOG_ODDS if told >= TOLD_APART else max(told, 0.0) / 2 + ASSUMED * ALIAS_LOG_ODDS


def untold(scale: Comparison, selected: Selected, name: str, other: str) -> float:
    """Squared effect of member `name` that the best form of `other` cannot imitate, in units of the noise.

    Less what noise alone may cause; zero if both are the same within the noise.
    """
    return _untold(scale.evidence, scale.all(selected.members), selected.members[name], other)


def _untold(evidence: Evidence, members: Sequence[Member], own: Member, other: str) -> float:
    """As `untold`. The numbers of all members are z = P K'y with P = (1 + K'K)^-1; noise alone gives them the
    covariance P K'K P. A member with many numbers thus shows a little of each by noise, which does not distinguish it.
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
        usual = np.trace(by_noise) + NOISE_SIGMAS * np.sqrt(2 * np.trace(by_noise @ by_noise))
        beyond.append(float(numbers @ left @ numbers) / noise - float(usual))
    return max(min(beyond), 0.0)


def _overlap(evidence: Evidence, members: Sequence[Member], own: Member, other: str) -> bool:
    """Whether name `other` can imitate at least a share `OVERLAP` of the effect of the member `own`."""
    share = evidence.share(members)
    shown = _white(evidence, own.group, share) @ evidence.numbers(members, share)[list(members).index(own)]
    by = (_white(evidence, form, share) for form in evidence.forms[other])
    return max(_shared(shown[:, None], columns) for columns in by) > OVERLAP


def _white(evidence: Evidence, group: int, share: float) -> Array:
    """The columns (n, p) of a form, whitened by noise and background."""
    return evidence.own(group) / np.sqrt(evidence.background.variance(share))[:, None]


def _leading(evidence: Evidence, group: int, share: float) -> Array:
    """Like `_white`, for the leading effects of a form only, each column scaled to 1 um at the tool tip.

    Accompanying effects, such as the constant of a play, cannot take the place of a name.
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
    """Inner products (k, k) of the part of columns (n, k) that columns `sized` (n, p) cannot show.

    The coefficients of `sized` have unit variance, else a combination that hardly shows could imitate anything.
    """
    seen = sized.T @ shown
    return shown.T @ shown - seen.T @ np.linalg.solve(np.eye(sized.shape[1]) + sized.T @ sized, seen)


def _shared(columns: Array, by: Array) -> float:
    """Share of the squares of `columns` that lies in the span of `by`."""
    return 1.0 - float((without(orthonormal(by), columns) ** 2).sum() / (columns**2).sum())


@frozen(slots=False)
class Selected:
    """The selected effects, likeliest first, and what could stand in their place.

    members   name -> form and size
    odds      name -> log odds that it is there, given the others, less the price of choosing it
    runners_up  name -> {other name: log odds of the other in its place}
    alternatives  keys of all unnamed alternatives
    acting_alike  name -> those of its runners-up that act alike in these data
    """

    members: dict[str, Member]
    odds: dict[str, float]
    runners_up: dict[str, dict[str, float]]
    alternatives: frozenset[str] = frozenset()
    acting_alike: dict[str, frozenset[str]] = field(default_factory=dict)

    @property
    def named(self) -> list[str]:
        """The named members."""
        return [name for name in self.members if name not in self.alternatives]

    @property
    def unnamed(self) -> list[str]:
        """The unnamed members."""
        return [name for name in self.members if name in self.alternatives]

    def p_value(self, name: str) -> float:
        """Upper bound of the probability that noise alone gives any name such odds."""
        return float(np.exp(-max(self.odds[name], 0.0)))


def select(scale: Comparison, offered: Sequence[str], start: Members | None = None) -> dict[str, Member]:
    """The set of members with the largest weight; those of `start` stay.

    When no change helps any more, each member is excluded in turn and the search repeated without it, since two others
    may do better than the one that came first. Before an unnamed alternative is accepted, several names that help only
    together are tried.
    """
    fixed = dict(start or {})
    members = _climbed(scale, offered, fixed, fixed)
    for out in [name for name in members if name not in fixed]:
        others = _less(members, out)
        without_it = _climbed(scale, [name for name in offered if name != out], others, fixed)
        members = _better(scale, members, without_it)
    if any(name in scale.evidence.alternatives for name in members if name not in fixed):
        named = _climbed(scale, names_of(scale, offered), _together(scale, offered, fixed), fixed)
        if scale.weight(named) > scale.weight(members) - WORTH_CLIMBING:
            members = _better(scale, members, _climbed(scale, offered, named, fixed))
    return members


def _better(scale: Comparison, members: dict[str, Member], trial: dict[str, Member]) -> dict[str, Member]:
    return trial if scale.weight(trial) > scale.weight(members) + MIN_GAIN else members


def _together(scale: Comparison, offered: Sequence[str], members: Members) -> dict[str, Member]:
    """Members plus `TRIED_JOINTLY` names, the likeliest one after another, whether they help or not."""
    names, found = names_of(scale, offered), dict(members)
    for _ in range(TRIED_JOINTLY):
        tried = [{**found, name: each} for name, each in likeliest(scale, names, found).items()]
        found = max(tried, key=scale.weight, default=found)
    return found


def names_of(scale: Comparison, offered: Sequence[str]) -> list[str]:
    """The named effects among `offered`."""
    return [name for name in offered if name in scale.evidence.names]


def _climbed(scale: Comparison, offered: Sequence[str], members: Members, fixed: Members) -> dict[str, Member]:
    """Members improved by the best change, repeatedly, until no change helps."""
    while True:
        best = max(_promising(scale, _changes(scale, offered, members, fixed), members), key=scale.weight)
        if scale.weight(best) <= scale.weight(members) + MIN_GAIN:
            return dict(members)
        members = best


def _promising(scale: Comparison, changes: list[dict[str, Member]], members: Members) -> list[dict[str, Member]]:
    """All changes that only drop effects, and the best of the others at first sight."""
    fewer = [each for each in changes if len(each) <= len(members) and set(each) <= set(members)]
    other = [each for each in changes if each not in fewer]
    return fewer + sorted(other, key=scale.sketched, reverse=True)[:WEIGHED]


def _changes(scale: Comparison, offered: Sequence[str], members: Members, fixed: Members) -> list[dict[str, Member]]:
    """All sets with one effect added, exchanged or dropped."""
    found = [dict(members)]
    if len(members) < MAX_EFFECTS:
        found += [{**members, name: each} for name, each in likeliest(scale, offered, members).items()]
    for out in members:
        if out not in fixed:
            others = _less(members, out)
            found += [others, *({**others, name: each} for name, each in likeliest(scale, offered, others).items())]
    return found


def likeliest(scale: Comparison, offered: Sequence[str], members: Members, beside: str = "") -> dict[str, Member]:
    """The effects with the best odds given some members, each in its likeliest form and size; all names that come near
    the one `beside`.
    """
    odds, evidence = scale.candidate_odds(members), scale.evidence
    free = {name: odds.of(evidence.forms[name]) for name in offered if name not in members}
    order = sorted(free, key=lambda name: -free[name])
    near = odds.of(evidence.forms[beside]) - MAX_ALIAS_LAG if beside else np.inf
    named = [name for name in order if name in evidence.names]
    named = [name for place, name in enumerate(named) if place < TRIED or free[name] > near]
    nameless = [name for name in order if name in evidence.alternatives][: TRIED // 2]
    return {name: odds.likeliest(evidence.forms[name])[0] for name in (*named, *nameless)}


def with_alternatives(scale: Comparison, members: Members) -> Selected:
    """The members with their odds, and with the other names that could stand in each one's place."""
    evidence, members = scale.evidence, _formed(scale, members)
    odds: dict[str, float] = {}
    runners_up: dict[str, dict[str, float]] = {}
    acting_alike: dict[str, frozenset[str]] = {}
    for name in members:
        others = _less(members, name)
        sort = [each for each in _sort(evidence, name) if each not in others]
        tried = {
            each: scale.candidate_odds(others).likeliest(evidence.forms[each], FORMS)
            for each in likeliest(scale, sort, others, beside=name)
        }
        tried[name] = [members[name]]
        heaviest = {each: max(scale.weight({**others, each: own}) for own in forms) for each, forms in tried.items()}
        gained = {each: weight - scale.weight(others) for each, weight in heaviest.items()}
        paid = entry_price(len(members)) - entry_price(len(others))
        odds[name] = gained.pop(name) + paid
        runners_up[name] = {each: value + paid for each, value in gained.items()}
        near = [each for each, value in runners_up[name].items() if value > odds[name] - MAX_ALIAS_LAG]
        there = scale.all(members)
        for other in [each for each in near if not _overlap(evidence, there, members[name], each)]:
            del runners_up[name][other]
        acting_alike[name] = frozenset(
            each
            for each in near
            if each in runners_up[name]
            and (told := _untold(evidence, there, members[name], each)) < TOLD_APART
            and runners_up[name][each] > odds[name] - lead_needed(told)
        )
    ranked = {name: members[name] for name in sorted(members, key=lambda name: -odds[name])}
    return Selected(ranked, odds, runners_up, frozenset(evidence.alternatives), acting_alike)


def plainest(scale: Comparison, selected: Selected) -> Selected:
    """Replace names by aliases that claim less, if these explain the data about as well.

    An alias of fewer errors is preferred: a backlash to an angular play with a single lever. An alias is also preferred
    to a name that includes errors which the data do not show at all: a measured straightness alone does not show a sag.
    """
    evidence = scale.evidence
    for name in selected.named:
        others, alike = _less(selected.members, name), selected.acting_alike[name]
        claims = _claims(evidence, selected.members[name].group)
        least = selected.odds[name] - ASSUMED * (ALIAS_LOG_ODDS if claims else NO_BETTER)
        fewer = {
            each: selected.runners_up[name][each]
            for each in sorted(alike)
            if selected.runners_up[name][each] > least
            and (
                not _claims(evidence, evidence.forms[each][0])
                if claims
                else _errors(evidence, each) < _errors(evidence, name)
            )
        }
        if fewer:
            plain = max(fewer, key=lambda each: fewer[each])
            forms = scale.candidate_odds(others).likeliest(evidence.forms[plain], FORMS)
            plainer = ({**others, plain: form} for form in forms)
            selected = with_alternatives(scale, max(plainer, key=scale.weight))
    return selected


def _errors(evidence: Evidence, name: str) -> set[str]:
    """ISO 230-1 names of the errors that an effect consists of."""
    return {effect.name for effect in evidence.groups[evidence.forms[name][0]].owner.effects}


def _claims(evidence: Evidence, group: int) -> bool:
    """Whether the leading effects of a form include errors that the data do not show at all."""
    form, data = evidence.groups[group], evidence.background.data
    effects = () if form.owner.grows else form.owner.effects[: form.owner.lead or None]
    starts = np.cumsum([0, *(effect.basis.size for effect in effects)])
    own = [e for e, start in zip(effects, starts, strict=False) if form.loading[start : start + e.basis.size].any()]
    return any(not data.design([effect]).any() for effect in own)


def _formed(scale: Comparison, members: Members) -> dict[str, Member]:
    """Each member in the form of the largest weight, as its rivals are weighed.

    It was chosen with the form that was likeliest while the background still had to explain part of it.
    """
    found = dict(members)
    for name in members:
        forms = scale.candidate_odds(_less(found, name)).likeliest(scale.evidence.forms[name], FORMS)
        found = max([found, *({**found, name: form} for form in forms)], key=scale.weight)
    return found


def _sort(evidence: Evidence, name: str) -> Sequence[str]:
    """The names that could stand in its place: unnamed alternatives, constants or other effects, as it is itself."""
    if name not in evidence.names:
        return evidence.alternatives
    return [each for each in evidence.names if evidence.constant(each) == evidence.constant(name)]


def _less(members: Members, out: str) -> dict[str, Member]:
    return {name: member for name, member in members.items() if name != out}


def aliases(selected: Selected, name: str) -> list[str]:
    """Names that explain a member's data nearly as well, likeliest first; more tolerant for names that act alike."""
    rest, acting_alike = selected.runners_up[name], selected.acting_alike.get(name, frozenset())
    found = [key for key in rest if key in acting_alike or rest[key] > selected.odds[name] - ALIAS_LOG_ODDS]
    return sorted(found, key=lambda key: -rest[key])


def with_constants_free(evidence: Evidence) -> Comparison:
    """A comparison in which the constants that the file lacks are free, like those that it has."""
    free_um = CONSTANT_UM * evidence.background.data.large
    return Comparison(
        evidence,
        tuple(Member(evidence.forms[name][0], free_um) for name in evidence.names if evidence.constant(name)),
    )


def with_constants(scale: Comparison, members: Members) -> dict[str, Member]:
    """The members together with the lacking constants that the data support.

    Constants are sought beside the unnamed members only, before other names take their part. Beside all members they
    are dropped only if the data speak against them.
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
    """For each name the smallest of the considered sizes, um rms, at which it would be found; inf if at none."""
    share = scale.evidence.share([])
    return {name: _smallest(scale.evidence, name, share, scale.price(name) + entry_price(1)) for name in scale.names}


def _smallest(evidence: Evidence, name: str, share: float, needed: float) -> float:
    """The smallest size, um rms, at which the best visible form of a name has mean log odds `needed`; inf if none."""
    strengths = [evidence.strength(group, share) for group in evidence.forms[name]]
    enough = (
        size
        for size in evidence.background.data.sizes
        if max(mean_odds(size**2 * each) for each in strengths) >= needed
    )
    return next(enough, float("inf"))


def mean_odds(shown: Array) -> float:
    """Mean log odds of an effect with squared signal-to-noise ratios `shown` (k,), s^2 d of its independent parts."""
    return 0.5 * float((shown - np.log1p(shown)).sum())


def shows_hardly_anything(findable: Mapping[str, float], sizes: Sequence[float]) -> bool:
    """Whether few of the visible names would be found. (A laser sees one error, but finds it.)"""
    return sum(size <= sizes[-1] for size in findable.values()) < FEW_SHOWN * max(len(findable), 1)


def findable_in_words(findable: Mapping[str, float], count: int, sizes: Sequence[float]) -> str:
    """A sentence that tells how many of `count` names would have been found at each of the sizes, um rms."""
    found = [(size, sum(own <= size for own in findable.values())) for size in sizes]
    steps = [(size, number) for k, (size, number) in enumerate(found) if number > (found[k - 1][1] if k else 0)]
    if not steps:
        return f"none of {count} effects would have been found, even with {sizes[-1]:g} um rms"
    first, *others = [f"from {size:g} um rms on {number}" for size, number in steps]
    return f"these data would have shown: {', '.join([f'{first} of {count} effects', *others])}"
