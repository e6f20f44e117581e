"""Plan and text made consistent: what cannot be written stays as it was, and then the rest is planned anew.

A block that is executed from several states may need another correction each time; a refused arc must begin where it
began. Both show only when the text is written, and both change what the other motions have to do. So plan and emitter
take turns until no further motion has to stay unchanged. Motions are only ever added to those that do, so this ends: a
fixed point.

A part of a program goes through the same rounds as the part before it, with what that one left in each
(`PrecedingMotion`): what has to be left shows by and by, and motions behind it are planned before that, too. So a part
refuses what the whole program would, and no less.

What was written is read again. The new text must say what the plan meant (`differences`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from types import MappingProxyType

import numpy as np

from ncfix.arrays import Array, Index, Mask, Signs, every, picked
from ncfix.compensate import FixOptions
from ncfix.compensate.account import Lacking, Reason, at_measured_places
from ncfix.compensate.following import kinematics_of
from ncfix.compensate.plan.arcs import Closure, across
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.limits import findings, increments_beyond_travel
from ncfix.compensate.plan.path import PathTolerance, Plan, Requirements, plan
from ncfix.compensate.plan.strategies import Strategy, get_strategy
from ncfix.compensate.plan.written import HeldAngle, WrittenPieces, on_digits, rounding, without_idle
from ncfix.control.coordinates import INCH
from ncfix.control.moves import MotionKind, Moves, Rule
from ncfix.machine import Machine, State
from ncfix.text.dialect import Dialect
from ncfix.text.language import language_of
from ncfix.text.tree import Program
from ncfix.values import frozen
from ncfix.writer.emit import Emission, emit
from ncfix.writer.language import WrittenLanguage
from ncfix.writer.pieces import BEYOND_TRAVEL, PINNED, SecondReading, closure_of_refusals


@frozen
class Round:
    """The last motion of a part in one round: the plans that are made until nothing speaks against one, and its text.

    unchanged  (k,) in each plan, whether that motion is left as it was
    shift      (k, n_axes) how far off the axes stand at its start then, mm and rad
    position   (n_axes,) the command at its end, as written
    """

    unchanged: Mask
    shift: Array
    position: Array

    def shortened(self) -> Round:
        """Without plans that only repeat the one before."""
        changes = (self.unchanged[1:] != self.unchanged[:-1]) | (self.shift[1:] != self.shift[:-1]).any(axis=1)
        count = int(np.flatnonzero(np.append(True, changes))[-1]) + 1
        return Round(self.unchanged[:count], self.shift[:count], self.position)

    def is_repeated_by(self, other: Round) -> bool:
        """Whether another round, behind this one, only repeats its end."""
        return (
            len(other.unchanged) == 1
            and np.array_equal(other.unchanged, self.unchanged[-1:])
            and np.array_equal(other.shift, self.shift[-1:])
            and np.array_equal(other.position, self.position, equal_nan=True)
        )


def same_rounds(one: tuple[Round, ...], other: tuple[Round, ...]) -> bool:
    """Whether a motion was the same in all rounds, to the last bit."""
    first, second = (
        [(each.unchanged.tobytes(), each.shift.tobytes(), each.position.tobytes()) for each in rounds]
        for rounds in (one, other)
    )
    return first == second


@frozen
class PrecedingMotion:
    """The last motion of the part before, with which a part begins once more.

    rounds     in each round, see there; behind the last it stays as it is
    direction  (n_axes,) in which the axes came to its start
    """

    rounds: tuple[Round, ...]
    direction: Signs

    @classmethod
    def steady(cls, shift: Array, direction: Signs, position: Array) -> PrecedingMotion:
        """It was never left as it was; arrays (n_axes,) as in `Round`."""
        return cls((Round(np.zeros(1, dtype=bool), shift[None], position),), direction)

    @classmethod
    def of(cls, rounds: tuple[Round, ...], direction: Signs) -> PrecedingMotion:
        """From all rounds of a part."""
        found: list[Round] = []
        for each in map(Round.shortened, rounds):
            if not found or not found[-1].is_repeated_by(each):
                found.append(each)
        return cls(tuple(found), direction)

    def in_round(self, number: int) -> Round:
        """What it was in a round, counted from 0."""
        return self.rounds[min(number, len(self.rounds) - 1)]

    @property
    def unchanged(self) -> bool:
        """Whether it was left as it was in the end."""
        return bool(self.rounds[-1].unchanged[-1])

    @property
    def position(self) -> Array:
        """(n_axes,) the command at its end, as written."""
        return self.rounds[-1].position


RELATIVE_CYCLE = (
    "the depth of a canned cycle with incremental words (G91) counts from where the cycle before ended; --flatten"
    " writes it absolutely"
)
NONE: Mapping[int, Reason] = MappingProxyType({})
CODE_OF_RULE = "NCF432"
CODE_OF_TEXT = "NCF433"


class SelfCheckError(Exception):
    """The text that was written does not mean what was planned: a fault of ncfix. Nothing may be written."""


@frozen
class WrittenPlan:
    """A plan that can be written, and its text.

    intent     the motions on the machine
    unchanged  (n,) those left as they were
    reasons    block -> why it was refused
    reaches_back  a refusal needs something before the first motion as it was
    rounds     what the last motion was in each round that plan and emitter took
    """

    intent: Intent
    plan: Plan
    emission: Emission
    unchanged: Mask
    reasons: Mapping[int, Reason]
    reaches_back: bool
    rounds: tuple[Round, ...] = ()

    @property
    def moves(self) -> Moves:
        """The motions as programmed."""
        return self.intent.moves

    @property
    def written(self) -> WrittenPieces:
        """The pieces, with the numbers as the control will understand them."""
        emission = self.emission
        pieces = replace(self.plan.pieces, end=emission.end, centre=emission.centre)
        return WrittenPieces(self.intent, pieces, emission.start)

    def shown(self, rapids: bool) -> Mask:
        """(n,) motions that figures are of: corrected ones that cut, and `rapids` if the tolerance holds along them.

        Not those to a place that the machine measures itself: what it finds has its error in it.
        """
        wanted = self.moves.cutting | (self.moves.kind == MotionKind.RAPID) if rapids else self.moves.cutting
        return wanted & ~self.unchanged & ~at_measured_places(self.moves)

    @property
    def shift(self) -> Array:
        """(n, n_axes) by how much the command at the end of each motion is changed, as written, mm and rad."""
        return picked(self.emission.end, self.plan.pieces.last) - self.moves.end

    def lacking(self, steps: Array, own: Mask | None = None) -> Lacking | None:
        """The axes that were left, of motions `own` (n,) if given; `steps` (n_axes,) what the control resolves.

        None if there are none.
        """
        moves, known = self.moves, self.plan.known
        wordless = moves.wordless
        if known is None or not wordless.any():
            return None
        off = np.abs(known.end - moves.end - self.shift)
        if known.beside is not None:
            off = np.maximum(off, known.beside)
        lacking = wordless & (off >= steps / 2) & ~self.unchanged[:, None]
        if own is not None:
            lacking &= own[:, None]
        return Lacking(lacking, off)


@frozen
class AcceptedPlan:
    """A plan that nothing speaks against but, perhaps, its text.

    planning   what it was made with
    unchanged  (n,) motions left as they were
    reasons    block -> why it was refused
    reaches_back  a refusal needs something before the first motion as it was
    history    in each plan on the way here, whether the last motion was left as it was, and how far off its start was
    """

    planning: Planning
    plan: Plan
    unchanged: Mask
    reasons: Mapping[int, Reason]
    reaches_back: bool
    history: tuple[tuple[bool, Array], ...]

    def round(self, position: Array) -> Round:
        """What the last motion was, the end of which was written as a command `position` (n_axes,)."""
        unchanged, shift = zip(*self.history, strict=True)
        return Round(np.array(unchanged), np.array(shift), position.copy())

    def anew(self, conflicts: Mapping[int, str], before: PrecedingMotion | None, number: int) -> AcceptedPlan:
        """Plan anew, in a round with this number: what stays unchanged here does, and blocks whose text is in conflict.

        conflicts  block -> why it cannot be written
        """
        if conflicts and conflicts.keys() <= self.reasons.keys():
            raise AssertionError(f"blocks {sorted(conflicts)} are unchanged and yet in conflict")
        head = None if before is None else before.in_round(number)
        new = {block: Reason(CODE_OF_TEXT, why) for block, why in conflicts.items() if block not in self.reasons}
        return self.planning.settled(self.unchanged, {**self.reasons, **new}, head)


@frozen
class Planning:
    """What the motions of a part are planned with, the same however often they are planned.

    intent    the motions on the machine
    strategy  finds the corrected commands
    required   tolerance, and what the control accepts as an arc
    held      the angle that the control may be told, see `WrittenLanguage.held_angle`; None: any
    """

    intent: Intent
    strategy: Strategy
    required: Requirements
    held: HeldAngle | None

    @classmethod
    def of(
        cls,
        moves: Moves,
        machine: Machine,
        dialect: Dialect,
        options: FixOptions,
        before: PrecedingMotion | None = None,
        source: bytes = b"",
    ) -> Planning:
        """For motions of a program.

        before  what an earlier part left: in which direction the axes have come to the start
        source  the text of the program, for a strategy that corrects rotary axes
        """
        language = language_of(dialect, WrittenLanguage)
        tolerance = PathTolerance(options.tolerance_mm, rounding(machine))
        return cls(
            Intent(machine, moves, State() if before is None else State(direction=before.direction)),
            get_strategy(options.strategy),
            Requirements(tolerance, closure_of(dialect, moves), options.split_rapids, language.arc_pieces),
            None if language.held_angle is None else partial(language.held_angle, source),
        )

    def accepted(self, before: PrecedingMotion | None = None, refused: Mapping[int, Reason] = NONE) -> AcceptedPlan:
        """Plan until nothing speaks against it.

        before   the last motion of the part before, where it is the first one here
        refused  blocks that are refused in any case, and why
        """
        moves, head = self.intent.moves, None if before is None else before.in_round(0)
        unchanged = np.asarray((moves.rule != Rule.CORRECT) | (moves.kind == MotionKind.DWELL))
        return self.settled(unchanged, {**refused, **_by_rule(moves)}, head)

    def settled(self, unchanged: Mask, reasons: Mapping[int, Reason], head: Round | None) -> AcceptedPlan:
        """Plan until nothing speaks against it, where these motions (n,) and blocks stay unchanged from the beginning.

        `head` is what the first motion was, where it is the last one of the part before. Motions, and the `reasons` of
        blocks, that have to stay besides are added.
        """
        moves, history, bound = self.intent.moves, list[tuple[bool, Array]](), np.zeros(len(unchanged), dtype=bool)
        unchanged, reasons = unchanged.copy(), dict(reasons)
        while True:
            shift = None
            if head is not None:
                at = min(len(history), len(head.unchanged) - 1)
                unchanged[0] |= head.unchanged[at]
                shift = head.shift[at]
            unchanged, reaches_back = _with_what_they_need(moves, unchanged, bound, reasons)
            planned = plan(self.intent, self.strategy, self.required, unchanged, shift)
            if len(moves):  # of the last one
                off = planned.start[-1] - moves.start[-1]
                history.append((bool(planned.pieces.unchanged[-1]), np.where(np.isfinite(off), off, 0.0)))
            planned = replace(planned, pieces=on_digits(self.intent, planned.pieces, held=self.held))
            written = WrittenPieces(self.intent, planned.pieces, planned.start)
            against = findings(written)
            stays = planned.pieces.unchanged[planned.pieces.first] & ~unchanged
            for finding in against:
                stays[finding.moves] = True
            beyond = increments_beyond_travel(written)
            waiting = head is not None and len(history) < len(head.unchanged)
            if not (stays.any() or (~bound[beyond]).any() or waiting):
                return AcceptedPlan(self, planned, unchanged, reasons, reaches_back, tuple(history))
            for finding in (*against, *planned.findings):
                for k, row in enumerate(finding.moves.tolist()):
                    if stays[row]:
                        _explain(reasons, [int(moves.block[row])], finding.code, finding.sentence(k))
            _explain(reasons, moves.block[stays].tolist(), CODE_OF_RULE, "no correction was found for it")
            unchanged |= stays
            bound[beyond] = True


def closure_of(dialect: Dialect, moves: Moves) -> Closure:
    """What the control accepts as an arc; where 0.001 mm is 0.0001 inch its tolerance in inches goes by tenths, too."""
    frames = np.unique(moves.frame[moves.kind == MotionKind.ARC]).tolist() if dialect.decimal_inches else []
    inches = bool(frames) and all(moves.frames[frame].unit > 1.0 for frame in frames)
    return Closure(dialect.closure_mm * (INCH / 10 if inches else 1.0), dialect.closure_relative)


def plan_and_write(
    program: Program,
    moves: Moves,
    machine: Machine,
    options: FixOptions,
    reading: SecondReading | None = None,
    before: PrecedingMotion | None = None,
    first: AcceptedPlan | None = None,
    refused: Mapping[int, Reason] = NONE,
) -> WrittenPlan:
    """Plan and write until both agree.

    reading  what the control made of an earlier attempt
    before   what an earlier part of the program left, where this is a part: its last motion is the first one here
    first    the plan to begin with, if that has been made already
    refused  blocks that are refused whatever the plan is, and why
    """
    if first is None:
        planning = Planning.of(moves, machine, program.dialect, options, before, program.source)
        first = planning.accepted(before, refused)
    accepted, kinematics, rounds = first, kinematics_of(machine), list[Round]()
    while True:
        done = None if before is None else before.in_round(len(rounds)).position
        emission = emit(program, moves, accepted.plan.pieces, increments(machine), reading, done, kinematics)
        moving = without_idle(moves, accepted.plan.pieces, emission, 0 if done is None else 1)
        if moving is not accepted.plan.pieces:
            accepted = replace(accepted, plan=replace(accepted.plan, pieces=moving))
            continue
        if len(moves):
            rounds.append(accepted.round(emission.end[-1]))
        if not emission.conflicts and (before is None or len(rounds) >= len(before.rounds)):
            return WrittenPlan(
                accepted.planning.intent,
                accepted.plan,
                emission,
                accepted.unchanged,
                accepted.reasons,
                accepted.reaches_back,
                tuple(rounds),
            )
        accepted = accepted.anew(emission.conflicts, before, len(rounds))


def _with_what_they_need(moves: Moves, unchanged: Mask, bound: Mask, reasons: dict[int, Reason]) -> tuple[Mask, bool]:
    """All motions (n,) that have to be left as they were: those of refused blocks, and those that such ones begin from.

    bound  (n,) other motions that must begin where they began

    Also whether something before the first motion would have to be left, too. What is added goes into `reasons`.
    """
    while True:
        unchanged = unchanged | (np.isin(moves.block, list(reasons)) & (moves.rule != Rule.PASS))
        closure, count = closure_of_refusals(moves, unchanged, bound), len(reasons)
        for row, cause in closure.added.items():
            why = BEYOND_TRAVEL if bound[cause] else PINNED
            reasons.setdefault(int(moves.block[row]), Reason(CODE_OF_TEXT, why, int(moves.block[cause])))
        unchanged = closure.unchanged
        if len(reasons) == count:
            return unchanged, closure.reaches_back


def increments(machine: Machine) -> Array:
    """(n_axes,) what the control can resolve, mm and rad."""
    linear, rotary = machine.least_increment
    return np.where(machine.rotary, rotary, linear)


def _by_rule(moves: Moves) -> dict[int, Reason]:
    reasons: dict[int, Reason] = {}
    relative = (moves.kind == MotionKind.CYCLE) & moves.incremental & (moves.rule == Rule.CORRECT)
    relative &= True if moves.call is None else moves.call < 0
    _explain(reasons, moves.block[relative].tolist(), CODE_OF_RULE, RELATIVE_CYCLE)
    for row in np.flatnonzero(moves.rule == Rule.REFUSE):
        _explain(reasons, [int(moves.block[row])], CODE_OF_RULE, moves.reasons[moves.reason[row]])
    return reasons


def _explain(reasons: dict[int, Reason], blocks: list[int], code: str, text: str) -> None:
    for block in blocks:
        reasons.setdefault(block, Reason(code, text))


SAME = 1e-6
"""mm and rad; the emitter's book and a second reading differ by floating-point noise only."""
STRAY = 1.0
"""mm and rad; more than earlier corrections can shift an unchanged motion (or `STRAYS` times the largest of them)."""
STRAYS = 10.0
TURN = 1.0
"""rad; a corrected arc turns by what it did but for little, or else by a full turn more or less."""


def differences(solution: WrittenPlan, again: Moves, own: Mask | None = None) -> Mask:
    """Pieces that the control would understand otherwise than they were meant.

    own  (m,) pieces that stand in the text that was read; all if not given

    Raises `SelfCheckError` if their number differs.
    """
    emission, pieces = solution.emission, solution.plan.pieces
    rows = np.arange(len(pieces)) if own is None else np.flatnonzero(own)
    if len(again) != len(rows):
        raise SelfCheckError(f"the corrected program has {len(again)} motions, {len(rows)} were written")
    meant = emission.end if own is None else picked(emission.end, rows)
    differs: Mask = differ(again.end, meant) | _strayed(solution, again, rows)
    if not pieces.arc.any():
        return differs
    arcs = np.flatnonzero((pieces.arc & ~pieces.unchanged)[rows])
    if not arcs.size:
        return differs
    off = again.centre[arcs] - emission.centre[rows[arcs]]
    off[np.isnan(again.centre[arcs]) & np.isnan(emission.centre[rows[arcs]])] = 0.0
    off = across(off, again.normal[arcs])  # the height of a centre means nothing
    differs[arcs[differ(off, np.zeros_like(off))]] = True
    sweeps = solution.moves.sweep[pieces.move] * (pieces.fraction - pieces.begun)  # its share of what its motion does
    differs[arcs] |= np.abs(again.sweep[arcs] - sweeps[rows[arcs]]) > TURN
    return differs


def _strayed(solution: WrittenPlan, again: Moves, rows: Index) -> Mask:
    """Unchanged motions that the new text leads elsewhere, because what they rely on has changed."""
    pieces, ends = solution.plan.pieces, solution.moves.end
    if not pieces.unchanged.any():
        return np.zeros(len(rows), dtype=bool)
    strayed = pieces.unchanged[rows]
    own = np.flatnonzero(strayed)
    off = np.abs(again.end[own] - ends[pieces.move[rows[own]]])
    if not (off > STRAY).any():
        return np.zeros_like(strayed)
    last = np.flatnonzero(pieces.fraction == 1)
    shifts = np.abs(picked(pieces.end, last) - picked(ends, pieces.move[last]))
    most = max(STRAY, STRAYS * float(np.max(shifts[np.isfinite(shifts)], initial=0.0)))
    strayed[own] = (off > most).any(axis=1)
    return strayed


def differ(found: Array, meant: Array) -> Mask:
    """Rows of commands (m, n_axes) that are not the same but for noise."""
    with np.errstate(invalid="ignore"):
        off = found - meant
        same = np.asarray(np.abs(off, out=off) <= SAME)
    if not same.all():
        same = same | (found == meant) | (np.isnan(found) & np.isnan(meant))
    return ~every(same)
