"""Poses to measure next, that tell apart names which the data leave ambiguous (T-optimal, Atkinson and Fedorov 1975).

Each name in turn is taken as true, and the others are refitted to old and new rows together. The chosen poses are those
after which, most likely, only one name is left, whichever is true. They are exchanged one at a time within a full set,
since the first pose with a new tool tells nothing by itself. If a rival imitates a name at all poses on offer, no
measurement of this kind tells them apart, and the proposal says so.

Poses on offer lie within the travels and tools used so far, or beyond them if that is needed, which is reported.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ncfix.arrays import Array, Mask
from ncfix.diagnosis.discrimination import Hypothesis, HypothesisPairs, chance, exchanged, seen_at, worst
from ncfix.diagnosis.effect_form import EffectForm
from ncfix.diagnosis.evidence import Comparison, Evidence, Members
from ncfix.diagnosis.preposterior import prospect
from ncfix.diagnosis.residual_data import ResidualData
from ncfix.diagnosis.selection import Selected, aliases
from ncfix.machine import Machine
from ncfix.machine.state import SUM
from ncfix.measure.candidates import Room, candidates
from ncfix.measure.measurement import STATES, Measurement
from ncfix.values import frozen

NEAR_LOG_ODDS = 10.0
"""Log odds within which a rival is worth poses that tell it apart."""
RIVALS_MOST = 3
FORMS = 3
"""Number of forms of a name that may imitate another."""
SURE_SQUARES = 21.0
"""Squared difference, in units of the noise, at which a rival is told apart in 19 of 20 measurements."""
SURE_CHANCE = 0.95
"""The chance that corresponds to `SURE_SQUARES`."""
FEWER = 0.8
"""Poses that need more travel or tools must reduce the probability of an undecided result to this share."""
MIN_CHANCE_GAIN = 0.05
"""Smallest increase of the chance that a single name is left, for which poses are proposed."""
SAME_PATTERN = "at all positions of these axes and with other tools, they give nearly the same pattern"
ALIGNED = "the part was aligned, so no poses distinguish them; measure a square, or both diagonals with a ball-bar"
"""Reasons why no poses are proposed."""
OFFERED = 320
"""Number of poses on offer."""
DRAWN, FEW = 10, 60
"""Poses drawn for each one on offer, to find some whose tool tip stays in the measured space; and the smallest number
of such poses: with fewer, all poses are used."""
SPARE_LENGTHS_MM = (100.0, 300.0)
"""Lengths of a short tool and of a test mandrel; the one that differs most from the used tools is proposed."""
OTHER_LENGTH_MM = 50.0
"""Smallest difference in length at which a further tool is worth using."""
ROUNDING = 1e-3
"""Tolerance of a travel limit, mm or degree, for rounded positions."""
Span = tuple[float, float]


@frozen(repr=False, slots=False)
class Proposal:
    """Poses proposed for the next measurement.

    name     the name to be told from its rivals
    plan     rows of kind tcp without values; None if no pose helps
    before   squared distance of the worst rival now, in units of the noise
    after    the same with the new poses
    chance   probability that a single name is left afterwards, 20 to 1 likelier than the others
    reason   why the data so far do not tell them apart
    alternatives  the rivals that the poses tell apart; without a plan: those that cannot be told apart
    alike    further rivals that no pose on offer tells from `name`
    stuck    names that, if true, would still have a rival however often these poses were measured
    beyond   axes that go beyond the travels measured so far
    tools    lengths of tools that were not used so far, mm
    strays   whether the tool tip leaves the space measured so far, in the workpiece frame
    """

    name: str
    plan: Measurement | None
    before: float
    after: float
    chance: float
    reason: str
    alternatives: tuple[str, ...]
    alike: tuple[str, ...] = ()
    stuck: tuple[str, ...] = ()
    beyond: tuple[str, ...] = ()
    tools: tuple[float, ...] = ()
    strays: bool = False

    @property
    def times(self) -> int | None:
        """How often each pose must be measured for a nearly sure result (squared distances add up); None if never."""
        gained = self.after - self.before
        return max(1, int(np.ceil((SURE_SQUARES - self.before) / gained))) if gained > 0 and not self.stuck else None


def proposed(scale: Comparison, selected: Selected, sigma: float) -> Proposal | None:
    """Poses that tell the first ambiguous name (else the first name) from its nearest rivals; None if it has none."""
    name = next((each for each in selected.named if aliases(selected, each)), selected.named[0])
    evidence = scale.evidence
    runners_up = selected.runners_up[name]
    ordered = sorted(runners_up, key=lambda n: -runners_up[n])
    owners = {group.owner.name: group.owner for group in evidence.groups}
    near = [n for n in ordered if runners_up[n] > selected.odds[name] - NEAR_LOG_ODDS and not owners[n].kept_out]
    near = [n for n in aliases(selected, name) if n in near] or near
    if not near or owners[name].kept_out:
        return None
    others = {key: member for key, member in selected.members.items() if key != name}
    sides = [_side(scale, others, each) for each in (name, *near[:RIVALS_MOST])]
    found = propose(evidence, sides, sigma)
    if found.plan is None:
        return found if aliases(selected, name) else None
    new = seen_at(evidence.background.data, found.plan)
    return replace(found, chance=prospect(scale, selected, (name, *near), new, sigma).chance)


def _side(scale: Comparison, others: Members, name: str) -> Hypothesis:
    """A name as a hypothesis, fitted together with the members `others`."""
    evidence = scale.evidence
    members = scale.candidate_odds(others).likeliest(evidence.forms[name], FORMS)
    everyone = [*others.values(), members[0]]
    forms = tuple((evidence.groups[member.group], member.size) for member in members)
    return Hypothesis(forms[0][0], evidence.numbers(everyone, evidence.share(everyone))[-1], forms)


def propose(evidence: Evidence, sides: Sequence[Hypothesis], sigma: float) -> Proposal:
    """The poses that tell the hypotheses `sides` apart, whichever is true; the first is the selected one.

    The measured travels with two tools suffice if they give a sure result. Otherwise one more tool, any tip position of
    the shorter tools, and finally the full travels of the machine are tried, and the proposal says so. Axes on which an
    effect depends keep their measured travel, since the effect is unknown beyond.
    """
    data = evidence.background.data
    spans, tools = data.measured.spans, tuple(sorted(set(np.round(data.column("tool_length"), 4).tolist())))
    more, travels = one_tool_more(tools), travels_of(data.machine, spans, _signals(sides))
    easy = (False, False, tools if len(tools) > 1 else more)
    ways = dict.fromkeys([easy, (False, False, more), (False, True, more), (travels != spans, True, more)])
    best: Proposal | None = None
    for far, roaming, lengths in ways:
        offered = poses_on_offer(data, travels if far else spans, lengths, roaming)
        found = _best_of(evidence, sides, sigma, offered)
        if best is None or 1 - found.chance < FEWER * (1 - best.chance):
            best = found
        if best.chance >= SURE_CHANCE:
            break
    assert best is not None
    return best


def _best_of(evidence: Evidence, sides: Sequence[Hypothesis], sigma: float, offered: Measurement) -> Proposal:
    """The proposal of the best poses among those on offer; without a plan if none helps."""
    rounds, everything = HypothesisPairs.of(evidence, sides, offered, sigma), list(range(len(offered)))
    index = exchanged(rounds.useful, len(offered)) if rounds.useful else everything
    chances = [float(np.mean(chance(worst(rounds.contests, rows)))) for rows in ([], index)]
    before, after = (min(worst(rounds.useful or rounds.contests, rows)) for rows in ([], index))
    name, *others = rounds.names
    if not rounds.useful or chances[1] < chances[0] + MIN_CHANCE_GAIN:
        why = ALIGNED if offered.header("setup") == "rigid" else SAME_PATTERN
        return Proposal(name, None, before, after, chances[0], why, tuple(others))
    told = rounds.told_from_first
    alike = tuple(each for each in others if each not in told)
    reason = _reason(evidence, [side.group for side in sides])
    found = Proposal(name, None, before, after, chances[1], reason, told, alike, rounds.stuck)
    return _with_plan(found, offered.rows(index), evidence.background.data)


def _with_plan(proposal: Proposal, plan: Measurement, data: ResidualData) -> Proposal:
    """The proposal with its poses and what is new about them: travels, tools, tip positions."""
    beyond, tools = axes_beyond(plan, data.measured.spans), new_tools(plan, data.column("tool_length"))
    strays = not stays_where_it_was(data, plan).all()
    return replace(proposal, plan=marked(plan, beyond, tools, strays), beyond=beyond, tools=tools, strays=strays)


def _signals(sides: Sequence[Hypothesis]) -> frozenset[str]:
    """Names of the axes and inputs on which the effects depend."""
    effects = [effect for side in sides for group, _ in side.forms for effect in group.owner.effects]
    named = (name for effect in effects for name in (effect.signal, effect.times) if name is not None)
    return frozenset(name for signal in named for name in signal.split(SUM))


def _reason(evidence: Evidence, groups: Sequence[EffectForm]) -> str:
    """Why the data so far do not tell the first form from the others."""
    data = evidence.background.data
    turning = {any(effect.rotational for effect in group.owner.effects[:1]) for group in groups}
    if len(set(np.round(data.column("tool_length"), 3).tolist())) == 1 and len(turning) == 2:
        return "one tool length only: with the same lever at all poses, a displacement and a tilt look alike"
    own = groups[0].owner.axis
    if own and f"dir_{own}" not in data.measured.columns:
        return f"{own} was approached from one side only, so errors that depend on its direction do not show"
    return "at these poses they give nearly the same pattern"


def as_objects(plan: Measurement) -> list[dict[str, float]]:
    """The rows of a plan as objects for JSON: axis positions in mm and degree, directions, tool length, load."""
    names = [name for name in plan.columns if not name.startswith("temp_") and name != "time_s"]
    return [{name: float(plan.columns[name][row]) for name in names} for row in range(len(plan))]


def one_tool_more(tools: tuple[float, ...]) -> tuple[float, ...]:
    """The lengths of the tools, mm, with one more if a clearly different one exists among `SPARE_LENGTHS_MM`."""
    if tools == (0.0,):
        return (0.0, SPARE_LENGTHS_MM[0])
    other = max(SPARE_LENGTHS_MM, key=lambda length: min(abs(length - own) for own in tools))
    apart = min(abs(other - own) for own in tools)
    return (*tools, other) if apart >= OTHER_LENGTH_MM else tools


def travels_of(machine: Machine, spans: Mapping[str, Span], kept: Collection[str] = ()) -> dict[str, Span]:
    """Range of each axis, mm or degree: its travel limits, or the measured span if it has none or is in `kept`."""
    found = {}
    for axis in machine.axes:
        low, high = (limit / axis.unit for limit in axis.range)
        first, last = spans[axis.name]
        bounded = np.isfinite([low, high]).all() and axis.name not in kept
        found[axis.name] = (min(low, first), max(high, last)) if bounded else (first, last)
    return found


def poses_on_offer(
    data: ResidualData, ranges: Mapping[str, Span], lengths: Sequence[float], roaming: bool = False
) -> Measurement:
    """Poses within these ranges and with these tools, if possible with the tool tip in the space measured so far.

    roaming  tools shorter than the longest used one may leave that space
    """
    loads = data.column("load_kg")
    inputs = {"load_kg": (float(loads.min()), float(loads.max()))} if "load_kg" in data.measured.columns else {}
    room = Room(ranges=ranges, tool_lengths=lengths, inputs=inputs)
    drawn = candidates(data.machine, "tcp", DRAWN * OFFERED, room)
    inside = stays_where_it_was(data, drawn)
    if roaming:
        inside |= drawn.column("tool_length") < data.column("tool_length").max() - ROUNDING
    kept = drawn.rows(inside) if inside.sum() >= FEW else drawn
    plan = kept.rows(range(min(OFFERED, len(kept))))
    known = {name for each in data.measurements for name in each.columns if STATES.fullmatch(name)}
    held = {name: np.full(len(plan), data.column(name)[-1]) for name in known if name not in plan.columns}
    sets = tuple(f"tool {length:g}" for length in plan.column("tool_length"))
    return with_headers(replace(plan, columns={**plan.columns, **held}, labels={"set": sets}), data)


def with_headers(plan: Measurement, data: ResidualData) -> Measurement:
    """The plan with the headers `setup` and `frame` of the first data file of kind tcp or tcp6, if there is one."""
    like = next((each for each in data.measurements if each.kind in ("tcp", "tcp6")), None)
    for name in ("setup", "frame") if like is not None else ():
        if like is not None and like.header(name) != plan.header(name):
            plan = plan.with_header(name, str(like.header(name)))
    return plan


def stays_where_it_was(data: ResidualData, plan: Measurement) -> Mask:
    """Mask of the rows whose tool tip is within the bounding box of the measured tips, in the workpiece frame."""
    been = data.machine.tip(data.q, data.column("tool_length"))
    tip = data.machine.tip(plan.positions(data.machine), plan.column("tool_length"))
    inside: Mask = ((tip >= been.min(axis=0) - ROUNDING) & (tip <= been.max(axis=0) + ROUNDING)).all(axis=1)
    return inside


def axes_beyond(plan: Measurement, spans: Mapping[str, Span]) -> tuple[str, ...]:
    """The axes that some poses move beyond the measured spans."""
    return tuple(
        name
        for name, (low, high) in spans.items()
        if plan.column(name).min() < low - ROUNDING or plan.column(name).max() > high + ROUNDING
    )


def new_tools(plan: Measurement, used: Array) -> tuple[float, ...]:
    """Tool lengths of the plan that were not used so far, mm."""
    lengths = set(plan.column("tool_length").tolist())
    return tuple(sorted(each for each in lengths if np.abs(used - each).min() > ROUNDING))


def marked(plan: Measurement, beyond: Sequence[str], tools: Sequence[float] = (), strays: bool = False) -> Measurement:
    """The plan with a `note` header that warns of travels beyond the measured ones and of new tools."""
    far = [*beyond, *(["the tool tip"] if strays else [])]
    said = [f"{', '.join(far)} beyond the travels measured so far: check the clearance"] if far else []
    lengths = " and ".join(f"{each:g} mm" for each in tools)
    said += [f"tool of {lengths}: or another one that differs as much, with its length in the file"] if tools else []
    return plan.with_header("note", "; ".join(said)) if said else plan
