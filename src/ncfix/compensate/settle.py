"""Plan and text brought into agreement: what cannot be written is kept, and then the rest is planned anew.

A block that is executed from several states may need another correction each time; a refused arc must begin where it
began. Both show only when the text is written, and both change what the other motions have to do. So plan and emitter
take turns until nothing more has to be kept; motions are only ever added to those that are, so this ends.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from ncfix.compensate.account import Reason
from ncfix.compensate.before import Before, Round
from ncfix.compensate.coverage import at_measured_places
from ncfix.compensate.following import kinematics_of
from ncfix.compensate.options import FixOptions
from ncfix.compensate.plan.arcs import Closure
from ncfix.compensate.plan.arrays import Array, Index, Mask, picked
from ncfix.compensate.plan.findings import Finding
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.limits import findings, led_astray
from ncfix.compensate.plan.path import Plan, plan
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.compensate.plan.written import on_digits, rounding, without_idle
from ncfix.control.moves import Kind, Moves, Rule
from ncfix.machine import Machine, State
from ncfix.text.dialect import Dialect
from ncfix.text.language import language_of
from ncfix.text.tree import Program
from ncfix.writer.emit import Emission, emit
from ncfix.writer.pinning import LED, PINNED, closure_of_refusals
from ncfix.writer.second_reading import SecondReading

RELATIVE_CYCLE = "the depth of a canned cycle with incremental words (G91) counts from where the cycle before ended"
NONE: Mapping[int, Reason] = MappingProxyType({})
CODE_OF_RULE = "NCF432"
CODE_OF_TEXT = "NCF433"


@dataclass(frozen=True, slots=True)
class Settled:
    """A plan that can be written, and its text.

    moves     the motions as programmed
    kept      (n,) those left as they were
    reasons   block -> why it was refused
    unmoored  a refusal needs something before the first motion as it was
    rounds    what the last motion was in each round that plan and emitter took
    """

    moves: Moves
    plan: Plan
    emission: Emission
    kept: Mask
    reasons: dict[int, Reason]
    unmoored: bool
    rounds: tuple[Round, ...] = ()

    def shown(self, rapids: bool) -> Mask:
        """(n,) motions that figures are of: corrected ones that cut, and `rapids` if the tolerance holds along them.

        Not those to a place that the machine measures itself: what it finds has its error in it.
        """
        wanted = self.moves.cuts | (self.moves.kind == Kind.RAPID) if rapids else self.moves.cuts
        shown: Mask = wanted & ~self.kept & ~at_measured_places(self.moves)
        return shown

    @property
    def shift(self) -> Array:
        """(n, n_axes) by how much the command at the end of each motion is changed, as written, mm and rad."""
        last = np.searchsorted(self.plan.pieces.move, np.arange(len(self.moves)), side="right") - 1
        change: Array = picked(self.emission.end, last) - self.moves.end
        return change


@dataclass(frozen=True, slots=True)
class Agreed:
    """A plan that nothing speaks against but, perhaps, its text.

    kept      (n,) motions left as they were
    reasons   block -> why it was refused
    unmoored  a refusal needs something before the first motion as it was
    trail     in each plan on the way here, whether the last motion was left as it was, and how far off its start was
    """

    plan: Plan
    kept: Mask
    reasons: dict[int, Reason]
    unmoored: bool
    trail: tuple[tuple[bool, Array], ...]

    def round(self, position: Array) -> Round:
        """What the last motion was, the end of which was written as a command `position` (n_axes,)."""
        kept, shift = zip(*self.trail, strict=True)
        return Round(np.array(kept), np.array(shift), position.copy())


def settle(
    program: Program,
    moves: Moves,
    machine: Machine,
    options: FixOptions,
    reading: SecondReading | None = None,
    before: Before | None = None,
    first: Agreed | None = None,
    refused: Mapping[int, Reason] = NONE,
) -> Settled:
    """Plan and write until both agree.

    reading  what the control made of an earlier attempt
    before   what an earlier part of the program left, where this is a part: its last motion is the first one here
    first    the plan to begin with, from `agree`, if that has been made already
    refused  blocks that are refused whatever the plan is, and why
    """
    agreed = first or agree(moves, machine, program.dialect, options, before, refused=refused)
    kinematics, rounds = kinematics_of(machine), list[Round]()
    while True:
        done = None if before is None else before.in_round(len(rounds)).position
        emission = emit(program, moves, agreed.plan.pieces, increments(machine), reading, done, kinematics)
        moving = without_idle(moves, agreed.plan.pieces, emission, 0 if done is None else 1)
        if moving is not agreed.plan.pieces:
            agreed = replace(agreed, plan=replace(agreed.plan, pieces=moving))
            continue
        if len(moves):
            rounds.append(agreed.round(emission.end[-1]))
        if not emission.conflicts and (before is None or len(rounds) >= len(before.rounds)):
            return Settled(moves, agreed.plan, emission, agreed.kept, agreed.reasons, agreed.unmoored, tuple(rounds))
        if emission.conflicts and emission.conflicts.keys() <= agreed.reasons.keys():
            raise AssertionError(f"blocks {sorted(emission.conflicts)} are kept and yet in conflict")
        for block, why in emission.conflicts.items():
            _explain(agreed.reasons, [block], CODE_OF_TEXT, why)
        agreed = agree(moves, machine, program.dialect, options, before, agreed, len(rounds))


def agree(
    moves: Moves,
    machine: Machine,
    dialect: Dialect,
    options: FixOptions,
    before: Before | None = None,
    earlier: Agreed | None = None,
    number: int = 0,
    refused: Mapping[int, Reason] = NONE,
) -> Agreed:
    """Plan until nothing speaks against it; `earlier` says what is kept already, and why, in round `number`.

    refused  blocks that are refused in any case, where there is no `earlier` plan
    """
    kept = np.asarray((moves.rule != Rule.CORRECT) | (moves.kind == Kind.DWELL)) if earlier is None else earlier.kept
    reasons = {**refused, **_by_rule(moves)} if earlier is None else earlier.reasons
    head = None if before is None else before.in_round(number)
    state, trail = State() if before is None else State(direction=before.direction), list[tuple[bool, Array]]()
    bound = np.zeros(len(moves), dtype=bool)
    while True:
        shift = None
        if head is not None:
            at = min(len(trail), len(head.kept) - 1)
            kept[0] |= head.kept[at]
            shift = head.shift[at]
        kept, unmoored = _with_what_they_need(moves, kept, bound, reasons)
        planned = _planned(dialect, moves, machine, options, kept, state, shift)
        if len(moves):
            trail.append(_last_of(planned, moves))
        planned = replace(planned, pieces=on_digits(Intent(machine, moves, state), planned.pieces))
        against = findings(machine, moves, planned.pieces, planned.start, state)
        stays = planned.pieces.kept[_first_rows(planned, len(moves))] & ~kept
        for finding in against:
            stays[finding.moves] = True
        astray = led_astray(machine, moves, planned.pieces, planned.start, state)
        waiting = head is not None and len(trail) < len(head.kept)
        if not (stays.any() or (~bound[astray]).any() or waiting):
            return Agreed(planned, kept, reasons, unmoored, tuple(trail))
        _explain_findings(reasons, (*against, *planned.findings), moves, stays)
        kept |= stays
        bound[astray] = True


def _with_what_they_need(moves: Moves, kept: Mask, bound: Mask, reasons: dict[int, Reason]) -> tuple[Mask, bool]:
    """All motions (n,) that have to be left as they were: those of refused blocks, and those that such ones begin from.

    bound  (n,) other motions that must begin where they began

    Also whether something before the first motion would have to be left, too. What is added goes into `reasons`.
    """
    while True:
        kept = kept | (np.isin(moves.block, list(reasons)) & (moves.rule != Rule.PASS))
        closure, count = closure_of_refusals(moves, kept, bound), len(reasons)
        for row, cause in closure.added.items():
            why = LED if bound[cause] else PINNED
            reasons.setdefault(int(moves.block[row]), Reason(CODE_OF_TEXT, why, int(moves.block[cause])))
        kept = closure.kept
        if len(reasons) == count:
            return kept, closure.unmoored


def increments(machine: Machine) -> Array:
    """(n_axes,) what the control can resolve, mm and rad."""
    linear, rotary = machine.least_increment
    return np.where(machine.rotary, rotary, linear)


def _planned(
    dialect: Dialect,
    moves: Moves,
    machine: Machine,
    options: FixOptions,
    kept: Mask,
    state: State,
    before: Array | None,
) -> Plan:
    return plan(
        machine,
        moves,
        get_strategy(options.strategy),
        options.tolerance_mm,
        Closure(dialect.closure_mm, dialect.closure_relative),
        kept,
        rounding_mm=rounding(machine),
        split_rapids=options.split_rapids,
        state=state,
        before=before,
        arc_pieces=language_of(dialect).arc_pieces,
    )


def _last_of(planned: Plan, moves: Moves) -> tuple[bool, Array]:
    """Whether the last motion is left as it was, and how far off the axes stand at its start, (n_axes,) mm and rad."""
    shift = planned.start[-1] - moves.start[-1]
    return bool(planned.pieces.kept[-1]), np.where(np.isfinite(shift), shift, 0.0)


def _first_rows(planned: Plan, n: int) -> Index:
    return np.searchsorted(planned.pieces.move, np.arange(n))


def _by_rule(moves: Moves) -> dict[int, Reason]:
    reasons: dict[int, Reason] = {}
    relative = (moves.kind == Kind.CYCLE) & moves.incremental & (moves.rule == Rule.CORRECT)
    relative &= True if moves.call is None else moves.call < 0
    _explain(reasons, moves.block[relative].tolist(), CODE_OF_RULE, RELATIVE_CYCLE)
    for row in np.flatnonzero(moves.rule == Rule.REFUSE):
        _explain(reasons, [int(moves.block[row])], CODE_OF_RULE, moves.reasons[moves.reason[row]])
    return reasons


def _explain(reasons: dict[int, Reason], blocks: list[int], code: str, text: str) -> None:
    for block in blocks:
        reasons.setdefault(block, Reason(code, text))


def _explain_findings(reasons: dict[int, Reason], found: tuple[Finding, ...], moves: Moves, refused: Mask) -> None:
    for finding in found:
        for k, row in enumerate(finding.moves.tolist()):
            if refused[row]:
                _explain(reasons, [int(moves.block[row])], finding.code, finding.sentence(k))
    for row in np.flatnonzero(refused):
        _explain(reasons, [int(moves.block[row])], CODE_OF_RULE, "no correction was found for it")
