"""What to measure next, so that names which these data leave alike come apart (T-optimal, Atkinson and Fedorov 1975).

Each name in turn is taken for the true one, and the others are refitted to old and new rows together. The poses are
those after which one name most likely stands alone, whichever is true: exchanged one at a time, all in place from the
start, since the first pose with a new stylus tells nothing by itself. Where a rival imitates a name at all of the poses
on offer, no measurement of this kind tells it from that name, and that is said.

Poses on offer for a further measurement, where axes and tool have been or may go, and what is new about them.
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

NEAR = 10.0
"""Log odds within which another name is near enough to ask for poses that tell them apart."""
RIVALS_MOST = 3
FORMS = 3
"""Forms of a name that may imitate."""
SURELY = 21.0
"""Squared noise units from which on a rival is told apart in nineteen of twenty measurements."""
SURE = 0.95
"""The chance that belongs to that."""
FEWER = 0.8
"""Poses that ask for more must leave so much fewer cases open, as a share."""
HELPS = 0.05
"""And any must raise the chance that one name stands alone by so much."""
ALIKE = "wherever these axes go, and with other tools, they show nearly the same pattern"
ALIGNED = "the part was aligned: no poses tell them apart then; measure a square, or both diagonals with a ball-bar"
"""Why no poses are proposed."""
OFFERED = 320
"""Poses among which those to be measured are chosen."""
DRAWN, FEW = 10, 60
"""Times as many are drawn to find those whose tip stays where it was; if these are fewer than so many, others, too."""
LENGTHS = (100.0, 300.0)
"""mm: a short tool, and one as long as a test mandrel; of these one more is used, that which differs most from any."""
OTHER = 50.0
"""mm: a tool that differs by less from one that is there adds nothing."""
ROUNDED = 1e-3
"""mm, degree: by which a pose may be rounded beyond a travel."""
Span = tuple[float, float]


@frozen(repr=False, slots=False)
class Proposal:
    """Poses to be measured.

    name     the name that is to be told from its rivals
    plan     rows of kind tcp without values; None if no pose helps
    before   how well the worst rival can be told from the true name, squared noise units; after with the new poses
    chance   how often one name stands alone afterwards, 20 to 1 likelier than the others, each as likely to be true
    reason   why the data so far do not tell them apart
    alternatives  the names that are told apart; where there is no plan, those that cannot be
    alike    names that cannot be told from it by any of the poses, besides
    stuck    names beside which another would stay, were they true, however often this is measured
    beyond   axes that have to go beyond the travels measured so far
    tools    mm: lengths of tools that were not used so far
    strays   whether the tool tip goes where it has not been so far, seen from the workpiece
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
        """How often each pose has to be measured so that this is nearly sure: what tells apart adds up; None if no
        number would do.
        """
        gained = self.after - self.before
        return max(1, int(np.ceil((SURELY - self.before) / gained))) if gained > 0 and not self.stuck else None


def proposed(scale: Comparison, selected: Selected, sigma: float) -> Proposal | None:
    """Poses that tell the first ambiguous name, or else the first, from those that come near; None where none does."""
    name = next((each for each in selected.named if aliases(selected, each)), selected.named[0])
    evidence = scale.evidence
    runners_up = selected.runners_up[name]
    ordered = sorted(runners_up, key=lambda n: -runners_up[n])
    owners = {group.owner.name: group.owner for group in evidence.groups}
    near = [n for n in ordered if runners_up[n] > selected.odds[name] - NEAR and not owners[n].kept_out]
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
    """A name as it would be beside the others."""
    evidence = scale.evidence
    members = scale.candidate_odds(others).likeliest(evidence.forms[name], FORMS)
    everyone = [*others.values(), members[0]]
    forms = tuple((evidence.groups[member.group], member.size) for member in members)
    return Hypothesis(forms[0][0], evidence.numbers(everyone, evidence.share(everyone))[-1], forms)


def propose(evidence: Evidence, sides: Sequence[Hypothesis], sigma: float) -> Proposal:
    """The poses that tell these names apart, whichever of them is true; the first is the one that was chosen.

    What is easy is enough if it tells them surely: the travels measured, and two tools. Else another tool more, the
    tips of shorter tools wherever these travels lead, and the travels of the machine; and that is said. But nobody
    knows how an effect goes on along its own axis where that was not measured: what would come of it tells no names
    apart.
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
        if best.chance >= SURE:
            break
    assert best is not None
    return best


def _best_of(evidence: Evidence, sides: Sequence[Hypothesis], sigma: float, offered: Measurement) -> Proposal:
    """The best of the poses on offer."""
    rounds, everything = HypothesisPairs.of(evidence, sides, offered, sigma), list(range(len(offered)))
    index = exchanged(rounds.useful, len(offered)) if rounds.useful else everything
    chances = [float(np.mean(chance(worst(rounds.contests, rows)))) for rows in ([], index)]
    before, after = (min(worst(rounds.useful or rounds.contests, rows)) for rows in ([], index))
    name, *others = rounds.names
    if not rounds.useful or chances[1] < chances[0] + HELPS:
        why = ALIGNED if offered.header("setup") == "rigid" else ALIKE
        return Proposal(name, None, before, after, chances[0], why, tuple(others))
    told = rounds.told_from_first
    alike = tuple(each for each in others if each not in told)
    reason = _reason(evidence, [side.group for side in sides])
    found = Proposal(name, None, before, after, chances[1], reason, told, alike, rounds.stuck)
    return _with_plan(found, offered.rows(index), evidence.background.data)


def _with_plan(proposal: Proposal, plan: Measurement, data: ResidualData) -> Proposal:
    """A proposal with its poses, and with what is new about them."""
    beyond, tools = axes_beyond(plan, data.measured.spans), new_tools(plan, data.column("tool_length"))
    strays = not stays_where_it_was(data, plan).all()
    return replace(proposal, plan=marked(plan, beyond, tools, strays), beyond=beyond, tools=tools, strays=strays)


def _signals(sides: Sequence[Hypothesis]) -> frozenset[str]:
    """What the effects go with."""
    effects = [effect for side in sides for group, _ in side.forms for effect in group.owner.effects]
    named = (name for effect in effects for name in (effect.signal, effect.times) if name is not None)
    return frozenset(name for signal in named for name in signal.split(SUM))


def _reason(evidence: Evidence, groups: Sequence[EffectForm]) -> str:
    """Why the data so far leave the first of them and the others alike."""
    data = evidence.background.data
    turning = {any(effect.rotational for effect in group.owner.effects[:1]) for group in groups}
    if len(set(np.round(data.column("tool_length"), 3).tolist())) == 1 and len(turning) == 2:
        return "one tool length: a shift and a tilt look alike where the lever is always the same"
    own = groups[0].owner.axis
    if own and f"dir_{own}" not in data.measured.columns:
        return f"{own} came from one side only, so nothing shows what depends on its direction"
    return "at these poses they show nearly the same pattern"


def as_objects(plan: Measurement) -> list[dict[str, float]]:
    """The rows as objects: axis letters in mm and degree, direction of approach, tool length, load."""
    names = [name for name in plan.columns if not name.startswith("temp_") and name != "time_s"]
    return [{name: float(plan.columns[name][row]) for name in names} for row in range(len(plan))]


def one_tool_more(tools: tuple[float, ...]) -> tuple[float, ...]:
    """The lengths of the tools, mm, and of one that differs as much as tools do."""
    if tools == (0.0,):
        return (0.0, LENGTHS[0])
    other = max(LENGTHS, key=lambda length: min(abs(length - own) for own in tools))
    apart = min(abs(other - own) for own in tools)
    return (*tools, other) if apart >= OTHER else tools


def travels_of(machine: Machine, spans: Mapping[str, Span], kept: Collection[str] = ()) -> dict[str, Span]:
    """The ranges of the machine where it has them, else what was measured; the latter also of axes that are kept."""
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
    """Poses within these ranges, with these tools, whose tip stays where it has been if there are such.

    Of tools that are shorter than one that was used it may also be elsewhere where they are `roaming`.
    """
    loads = data.column("load_kg")
    inputs = {"load_kg": (float(loads.min()), float(loads.max()))} if "load_kg" in data.measured.columns else {}
    room = Room(ranges=ranges, tool_lengths=lengths, inputs=inputs)
    drawn = candidates(data.machine, "tcp", DRAWN * OFFERED, room)
    inside = stays_where_it_was(data, drawn)
    if roaming:
        inside |= drawn.column("tool_length") < data.column("tool_length").max() - ROUNDED
    kept = drawn.rows(inside) if inside.sum() >= FEW else drawn
    plan = kept.rows(range(min(OFFERED, len(kept))))
    known = {name for each in data.measurements for name in each.columns if STATES.fullmatch(name)}
    held = {name: np.full(len(plan), data.column(name)[-1]) for name in known if name not in plan.columns}
    sets = tuple(f"tool {length:g}" for length in plan.column("tool_length"))
    return with_headers(replace(plan, columns={**plan.columns, **held}, labels={"set": sets}), data)


def with_headers(plan: Measurement, data: ResidualData) -> Measurement:
    """Poses with the set-up and the frame of the data, where these are of tips as well."""
    like = next((each for each in data.measurements if each.kind in ("tcp", "tcp6")), None)
    for name in ("setup", "frame") if like is not None else ():
        if like is not None and like.header(name) != plan.header(name):
            plan = plan.with_header(name, str(like.header(name)))
    return plan


def stays_where_it_was(data: ResidualData, plan: Measurement) -> Mask:
    """The rows whose tool tip is within the block that it has been in so far, seen from the workpiece."""
    been = data.machine.tip(data.q, data.column("tool_length"))
    tip = data.machine.tip(plan.positions(data.machine), plan.column("tool_length"))
    inside: Mask = ((tip >= been.min(axis=0) - ROUNDED) & (tip <= been.max(axis=0) + ROUNDED)).all(axis=1)
    return inside


def axes_beyond(plan: Measurement, spans: Mapping[str, Span]) -> tuple[str, ...]:
    """The axes along which some of the poses lie beyond what was measured."""
    return tuple(
        name
        for name, (low, high) in spans.items()
        if plan.column(name).min() < low - ROUNDED or plan.column(name).max() > high + ROUNDED
    )


def new_tools(plan: Measurement, used: Array) -> tuple[float, ...]:
    """Lengths of tools that were not used so far, mm."""
    lengths = set(plan.column("tool_length").tolist())
    return tuple(sorted(each for each in lengths if np.abs(used - each).min() > ROUNDED))


def marked(plan: Measurement, beyond: Sequence[str], tools: Sequence[float] = (), strays: bool = False) -> Measurement:
    """Poses with lines in the file that say what goes further than before, and which tools are new."""
    far = [*beyond, *(["the tool tip"] if strays else [])]
    said = [f"{', '.join(far)} beyond the travels measured so far, mind the clearance"] if far else []
    lengths = " and ".join(f"{each:g} mm" for each in tools)
    said += [f"tool of {lengths}: or one that differs as much, with its own length in the file"] if tools else []
    return plan.with_header("note", "; ".join(said)) if said else plan
