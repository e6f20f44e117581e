"""Plan and text made consistent: a motion that cannot be written stays unchanged, and the rest is planned anew.

A block that is executed from several states may need a different correction each time; a refused arc must begin where
it began. Both show only when the text is written, and both change what the other motions have to do. So plan and
emitter take turns until no further motion has to stay unchanged. The set of unchanged motions only grows, so this ends
at a fixed point.

A part of a program goes through the same rounds as the part before it, each with the state of the preceding motion in
that round (`PrecedingMotion`). So a part refuses exactly the motions that would be refused in the whole program.

The text that was written is read again, and must say what the plan meant (`differences`).
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
from ncfix.compensate.plan.findings import FindingKind
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
    """The last motion of a part in one round: k plans until one satisfies all limits, and then the text.

    unchanged  (k,) whether the motion is left unchanged in each plan
    shift      (k, n_axes) offset of the axes from their programmed position at its start in each plan, mm and rad
    position   (n_axes,) the command at its end, as written
    """

    unchanged: Mask
    shift: Array
    position: Array

    def shortened(self) -> Round:
        """The round without the plans at its end that repeat the one before."""
        changes = (self.unchanged[1:] != self.unchanged[:-1]) | (self.shift[1:] != self.shift[:-1]).any(axis=1)
        count = int(np.flatnonzero(np.append(True, changes))[-1]) + 1
        return Round(self.unchanged[:count], self.shift[:count], self.position)

    def is_repeated_by(self, other: Round) -> bool:
        """Whether the next round, `other`, only repeats the end of this one."""
        return (
            len(other.unchanged) == 1
            and np.array_equal(other.unchanged, self.unchanged[-1:])
            and np.array_equal(other.shift, self.shift[-1:])
            and np.array_equal(other.position, self.position, equal_nan=True)
        )


def same_rounds(one: tuple[Round, ...], other: tuple[Round, ...]) -> bool:
    """Whether two sequences of rounds are equal, to the last bit."""
    first, second = (
        [(each.unchanged.tobytes(), each.shift.tobytes(), each.position.tobytes()) for each in rounds]
        for rounds in (one, other)
    )
    return first == second


@frozen
class PrecedingMotion:
    """The last motion of the part before, which is also the first motion of a part.

    rounds     its state in each round; in all later rounds it is as in the last one
    direction  (n_axes,) the direction in which each axis came to its start
    """

    rounds: tuple[Round, ...]
    direction: Signs

    @classmethod
    def steady(cls, shift: Array, direction: Signs, position: Array) -> PrecedingMotion:
        """A motion that is corrected in the same way in all rounds; arrays (n_axes,) as in `Round`."""
        return cls((Round(np.zeros(1, dtype=bool), shift[None], position),), direction)

    @classmethod
    def of(cls, rounds: tuple[Round, ...], direction: Signs) -> PrecedingMotion:
        """From all rounds of the part that it ends, without repetitions."""
        found: list[Round] = []
        for each in map(Round.shortened, rounds):
            if not found or not found[-1].is_repeated_by(each):
                found.append(each)
        return cls(tuple(found), direction)

    def in_round(self, number: int) -> Round:
        """Its state in round `number`, counted from 0."""
        return self.rounds[min(number, len(self.rounds) - 1)]

    @property
    def unchanged(self) -> bool:
        """Whether it was left unchanged in the end."""
        return bool(self.rounds[-1].unchanged[-1])

    @property
    def position(self) -> Array:
        """(n_axes,) the command at its end, as written."""
        return self.rounds[-1].position


RELATIVE_CYCLE = (
    "the depth of a canned cycle with incremental words (G91) counts from the end of the cycle before it; --flatten "
    "writes it as an absolute value"
)
NONE: Mapping[int, Reason] = MappingProxyType({})
CODE_OF_RULE = "NCF432"
CODE_OF_TEXT = "NCF433"


class SelfCheckError(Exception):
    """The text that was written does not mean what was planned: a fault of ncfix. Nothing may be written."""


@frozen
class WrittenPlan:
    """A plan that can be written, and its text.

    intent        the motions on the machine
    unchanged     (n,) motions left as they were
    reasons       block -> why it was refused
    reaches_back  a refused motion requires that a motion before the first one stays unchanged, too
    rounds        state of the last motion in each round of plan and emitter
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
        """The pieces, with ends and centres as the control will understand them."""
        emission = self.emission
        pieces = replace(self.plan.pieces, end=emission.end, centre=emission.centre)
        return WrittenPieces(self.intent, pieces, emission.start)

    def shown(self, rapids: bool) -> Mask:
        """(n,) motions that the figures include: corrected motions that cut and, with `rapids`, corrected rapids.

        Motions to a place that the machine has measured itself are left out, because that place contains its errors.
        """
        wanted = self.moves.cutting | (self.moves.kind == MotionKind.RAPID) if rapids else self.moves.cutting
        return wanted & ~self.unchanged & ~at_measured_places(self.moves)

    @property
    def shift(self) -> Array:
        """(n, n_axes) written minus programmed command at the end of each motion, mm and rad."""
        return picked(self.emission.end, self.plan.pieces.last) - self.moves.end

    def lacking(self, steps: Array, own: Mask | None = None) -> Lacking | None:
        """The axes that were left where they stand because they must get no word; None if no motion has such an axis.

        steps  (n_axes,) least increments of the control, mm and rad; half of one is no displacement
        own    (n,) the motions to report; None: all
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
    """A plan that satisfies all limits. Writing it may still fail.

    planning      the task from which it was made
    unchanged     (n,) motions left as they were
    reasons       block -> why it was refused
    reaches_back  a refused motion requires that a motion before the first one stays unchanged, too
    history       for each plan that led to this one: whether the last motion was left unchanged, and (n_axes,) the
                  offset of the axes at its start, mm and rad
    """

    planning: Planning
    plan: Plan
    unchanged: Mask
    reasons: Mapping[int, Reason]
    reaches_back: bool
    history: tuple[tuple[bool, Array], ...]

    def round(self, position: Array) -> Round:
        """The state of the last motion in this round; `position` (n_axes,): the command written for its end."""
        unchanged, shift = zip(*self.history, strict=True)
        return Round(np.array(unchanged), np.array(shift), position.copy())

    def anew(self, conflicts: Mapping[int, str], before: PrecedingMotion | None, number: int) -> AcceptedPlan:
        """The plan of round `number`, in which blocks in conflict stay unchanged besides those that do so here.

        conflicts  block -> why it cannot be written
        before     the last motion of the part before, if there is one
        """
        if conflicts and conflicts.keys() <= self.reasons.keys():
            raise AssertionError(f"blocks {sorted(conflicts)} are unchanged and yet in conflict")
        head = None if before is None else before.in_round(number)
        new = {block: Reason(CODE_OF_TEXT, why) for block, why in conflicts.items() if block not in self.reasons}
        return self.planning.settled(self.unchanged, {**self.reasons, **new}, head)


@frozen
class Planning:
    """The task of planning the motions of a part. It is the same in all rounds.

    intent    the motions on the machine
    strategy  finds the corrected commands
    required  tolerances, and the arcs that the control accepts
    held      rounds an angle to one that the program can state, see `WrittenLanguage.held_angle`; None: any angle
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
        """The task for the motions of a program.

        before  the last motion of the part before, of which only `direction` is used
        source  the text of the program, which a strategy that corrects rotary axes needs
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
        """Plan until a plan satisfies all limits.

        before   the last motion of the part before, if it is the first one here
        refused  block -> why it is refused in any case
        """
        moves, head = self.intent.moves, None if before is None else before.in_round(0)
        unchanged = np.asarray((moves.rule != Rule.CORRECT) | (moves.kind == MotionKind.DWELL))
        return self.settled(unchanged, {**refused, **_by_rule(moves)}, head)

    def settled(self, unchanged: Mask, reasons: Mapping[int, Reason], head: Round | None) -> AcceptedPlan:
        """Plan until a plan satisfies all limits; motions that violate one stay unchanged in the next plan.

        unchanged  (n,) motions that stay unchanged from the beginning
        reasons    block -> why it is refused, from the beginning
        head       state of the first motion, if it is the last one of the part before
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
            if len(moves):  # keep the state of the last motion
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
            problems = (each for each in (*against, *planned.findings) if each.kind is FindingKind.PROBLEM)
            for finding in problems:
                for k, row in enumerate(finding.moves.tolist()):
                    if stays[row]:
                        _explain(reasons, [int(moves.block[row])], finding.code, finding.sentence(k))
            _explain(reasons, moves.block[stays].tolist(), CODE_OF_RULE, "no correction was found for this block")
            unchanged |= stays
            bound[beyond] = True


def closure_of(dialect: Dialect, moves: Moves) -> Closure:
    """The difference of start and end radius that the control accepts for an arc.

    If the control's least increment of 0.001 mm becomes 0.0001 inch in inch programs, so does this tolerance in arcs
    that are all in inches.
    """
    frames = set(moves.frame[moves.kind == MotionKind.ARC].tolist()) if dialect.decimal_inches else set()
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
    """Plan and write in turns until a plan can be written.

    reading  the control's reading of an earlier attempt; None at the first
    before   the last motion of the part before, which is the first one here; None for a whole program
    first    the first plan, if it has been made already
    refused  block -> why it is refused, whatever the plan is
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
    """(n,) all motions that have to stay unchanged, and whether a motion before the first one would have to, too.

    These are `unchanged`, the motions of refused blocks, and the motions that lead to the start of one of them.

    bound    (n,) further motions that must begin where they are programmed to begin
    reasons  block -> why it is refused; blocks of motions that are added here are added to it
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
    """(n_axes,) the least increments of the control, mm and rad."""
    linear, rotary = machine.least_increment
    return np.where(machine.rotary, rotary, linear)


def _by_rule(moves: Moves) -> dict[int, Reason]:
    reasons: dict[int, Reason] = {}
    relative = (moves.kind == MotionKind.CYCLE) & moves.incremental & (moves.rule == Rule.CORRECT)
    relative &= moves.call < 0
    _explain(reasons, moves.block[relative].tolist(), CODE_OF_RULE, RELATIVE_CYCLE)
    for row in np.flatnonzero(moves.rule == Rule.REFUSE):
        _explain(reasons, [int(moves.block[row])], CODE_OF_RULE, moves.reasons[moves.reason[row]])
    return reasons


def _explain(reasons: dict[int, Reason], blocks: list[int], code: str, text: str) -> None:
    for block in blocks:
        reasons.setdefault(block, Reason(code, text))


SAME = 1e-6
"""Largest difference, mm or rad, between a written command and its second reading: floating-point noise only."""
STRAY = 1.0
"""Largest distance, mm or rad, by which earlier corrections may displace an unchanged motion; or `STRAYS` times the
largest correction, if that is more."""
STRAYS = 10.0
TURN = 1.0
"""Largest change, rad, of the sweep of an arc. A correction changes it a little; a misread arc, by a full turn."""


def differences(solution: WrittenPlan, again: Moves, own: Mask | None = None) -> Mask:
    """(m,) whether the control would understand a piece otherwise than planned, of the pieces in the text.

    again  the motions of the text that was written
    own    (of all pieces) those that stand in this text; None: all

    Raises `SelfCheckError` if the text has another number of motions.
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
    off = across(off, again.normal[arcs])  # along the normal, a centre has no meaning
    differs[arcs[differ(off, np.zeros_like(off))]] = True
    sweeps = solution.moves.sweep[pieces.move] * (pieces.fraction - pieces.begun)  # the piece's share of its motion
    differs[arcs] |= np.abs(again.sweep[arcs] - sweeps[rows[arcs]]) > TURN
    return differs


def _strayed(solution: WrittenPlan, again: Moves, rows: Index) -> Mask:
    """Unchanged pieces that end far from where they were programmed to, because a state they rely on has changed."""
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
    """(m,) whether two rows of commands (m, n_axes) differ by more than noise; NaN equals NaN."""
    with np.errstate(invalid="ignore"):
        off = found - meant
        same = np.asarray(np.abs(off, out=off) <= SAME)
    if not same.all():
        same = same | (found == meant) | (np.isnan(found) & np.isnan(meant))
    return ~every(same)
