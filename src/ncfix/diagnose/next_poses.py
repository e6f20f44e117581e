"""What to measure next, so that names which these data leave alike come apart (T-optimal, Atkinson and Fedorov 1975).

Each name in turn is taken for the true one, and the others are refitted to old and new rows together. The poses are
those after which one name most likely stands alone, whichever is true: exchanged one at a time, all in place from the
start, since the first pose with a new stylus tells nothing by itself. Where a rival imitates a name at all of the poses
on offer, no measurement of this kind tells it from that name, and that is said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ncfix.diagnose.contest import chance, exchanged, worst
from ncfix.diagnose.evidence import Court
from ncfix.diagnose.groups import Group
from ncfix.diagnose.offer import (
    axes_beyond,
    marked,
    new_tools,
    one_tool_more,
    poses_on_offer,
    stays_where_it_was,
    travels_of,
)
from ncfix.diagnose.rounds import Rounds, Side
from ncfix.diagnose.selection import Selected, aliases
from ncfix.diagnose.view import View
from ncfix.diagnose.weighing import Members, Scale
from ncfix.measure.measurement import Measurement

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
"""Why no poses are proposed."""


@dataclass(frozen=True, repr=False)
class Proposal:
    """Poses to be measured.

    name     the name that is to be told from its rivals
    plan     rows of kind tcp without values; None if no pose helps
    before   how well the worst rival can be told from the true name, squared noise units; after with the new poses
    chance   how often one name stands alone afterwards, 20 to 1 likelier than the others, each as likely to be true
    reason   why the data so far do not tell them apart
    rivals   the names that are told apart; where there is no plan, those that cannot be
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
    rivals: tuple[str, ...]
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


def proposed(scale: Scale, selected: Selected, sigma: float) -> Proposal | None:
    """Poses that tell the first ambiguous name, or else the first, from those that come near; None where none does."""
    name = next((each for each in selected.named if aliases(selected, each)), selected.named[0])
    court = scale.court
    runners = selected.runners[name]
    ordered = sorted(runners, key=lambda n: -runners[n])
    near = aliases(selected, name) or [n for n in ordered if runners[n] > selected.odds[name] - NEAR]
    owners = {group.owner.name: group.owner for group in court.groups}
    near = [n for n in near if not owners[n].grows][:RIVALS_MOST]
    if not near or owners[name].grows:
        return None
    others = {key: member for key, member in selected.members.items() if key != name}
    sides = [_side(scale, others, each) for each in (name, *near)]
    return propose(court, sides, sigma)


def _side(scale: Scale, others: Members, name: str) -> Side:
    """A name as it would be beside the others."""
    court = scale.court
    members = scale.heard(others).likeliest(court.forms[name], FORMS)
    everyone = [*others.values(), members[0]]
    forms = tuple((court.groups[member.group], member.size) for member in members)
    return Side(forms[0][0], court.numbers(everyone, court.share(everyone))[-1], forms)


def propose(court: Court, sides: Sequence[Side], sigma: float) -> Proposal:
    """The poses that tell these names apart, whichever of them is true; the first is the one that was chosen.

    What is easy is enough if it tells them surely: the travels measured, and two tools. Else another tool more, the
    tips of shorter tools wherever these travels lead, and the travels of the machine; and that is said. But nobody
    knows how an effect goes on along its own axis where that was not measured: what would come of it tells no names
    apart.
    """
    view = court.background.view
    spans, tools = view.reach.spans, tuple(sorted(set(np.round(view.column("tool_length"), 4).tolist())))
    more, travels = one_tool_more(tools), travels_of(view.machine, spans, _signals(sides))
    easy = (False, False, tools if len(tools) > 1 else more)
    ways = dict.fromkeys([easy, (False, False, more), (False, True, more), (travels != spans, True, more)])
    best: Proposal | None = None
    for far, roaming, lengths in ways:
        offered = poses_on_offer(view, travels if far else spans, lengths, roaming)
        found = _best_of(court, sides, sigma, offered)
        if best is None or 1 - found.chance < FEWER * (1 - best.chance):
            best = found
        if best.chance >= SURE:
            break
    assert best is not None
    return best


def _best_of(court: Court, sides: Sequence[Side], sigma: float, offered: Measurement) -> Proposal:
    """The best of the poses on offer."""
    rounds, everything = Rounds.of(court, sides, offered, sigma), list(range(len(offered)))
    index = exchanged(rounds.useful, len(offered)) if rounds.useful else everything
    chances = [float(np.mean(chance(worst(rounds.contests, rows)))) for rows in ([], index)]
    before, after = (min(worst(rounds.useful or rounds.contests, rows)) for rows in ([], index))
    name, *others = rounds.names
    if not rounds.useful or chances[1] < chances[0] + HELPS:
        return Proposal(name, None, before, after, chances[0], ALIKE, tuple(others))
    told = rounds.told_from_first
    alike = tuple(each for each in others if each not in told)
    reason = _reason(court, [side.group for side in sides])
    found = Proposal(name, None, before, after, chances[1], reason, told, alike, rounds.stuck)
    return _with_plan(found, offered.rows(index), court.background.view)


def _with_plan(proposal: Proposal, plan: Measurement, view: View) -> Proposal:
    """A proposal with its poses, and with what is new about them."""
    beyond, tools = axes_beyond(plan, view.reach.spans), new_tools(plan, view.column("tool_length"))
    strays = not stays_where_it_was(view, plan).all()
    return replace(proposal, plan=marked(plan, beyond, tools, strays), beyond=beyond, tools=tools, strays=strays)


def _signals(sides: Sequence[Side]) -> frozenset[str]:
    """What the effects go with."""
    effects = [effect for side in sides for group, _ in side.forms for effect in group.owner.effects]
    return frozenset(name for effect in effects for name in (effect.signal, effect.times) if name is not None)


def _reason(court: Court, groups: Sequence[Group]) -> str:
    """Why the data so far leave the first of them and the others alike."""
    view = court.background.view
    turning = {any(effect.rotational for effect in group.owner.effects[:1]) for group in groups}
    if len(set(np.round(view.column("tool_length"), 3).tolist())) == 1 and len(turning) == 2:
        return "one tool length: a shift and a tilt look alike where the lever is always the same"
    own = groups[0].owner.axis
    if own and f"dir_{own}" not in view.reach.columns:
        return f"{own} came from one side only, so nothing shows what depends on its direction"
    return "at these poses they show nearly the same pattern"


def as_objects(plan: Measurement) -> list[dict[str, float]]:
    """The rows as objects: axis letters in mm and degree, direction of approach, tool length, load."""
    names = [name for name in plan.columns if not name.startswith("temp_") and name != "time_s"]
    return [{name: float(plan.columns[name][row]) for name in names} for row in range(len(plan))]
