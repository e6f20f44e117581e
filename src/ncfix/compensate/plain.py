"""The fast plan for parts of plain straight motions, of which long programs consist.

It is the plan of `path` and `solve` without the cases that such a part does not have: it has no cycles, no axes without
words and no refusals, tool-centre-point control (TCP) is on in all of it or nowhere, and each motion begins where the
one before ended. A part that needs more, or comes near a limit, is planned by the full plan. Both plans write the same
bytes; tests check this.

Under TCP, X Y Z of a command are those of the tip, and the linear axes do not move straight. A bound of their deviation
from a straight line tells whether they may leave their travel on the way.

Most of the few arcs, dwells and turns of rotary axes among plain motions are planned together with these: arcs that
stay arcs, dwells where the axes stand as planned, turns. The others are planned by the full plan, each as a short
program with the motion before it and the motion behind it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ncfix import core
from ncfix.arrays import Array, Index, Mask, distinct, lengths, offsets, owners, picked, ranges, some
from ncfix.compensate import FixOptions
from ncfix.compensate.parts import ContinuedPart, Part
from ncfix.compensate.plan.arcs import Closure, fitted, full_circles
from ncfix.compensate.plan.deviation import CORNER, SURE, looked_at, tcp_bounds
from ncfix.compensate.plan.ends import commands_of_positions
from ncfix.compensate.plan.findings import Finding
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.kinematics import REST, matters, moves_as_one, reached_joints
from ncfix.compensate.plan.limits import FUZZ, JUMP, excess
from ncfix.compensate.plan.path import PathTolerance, Plan, Requirements, in_pieces, not_split
from ncfix.compensate.plan.sampling import passed
from ncfix.compensate.plan.segments import Segments, accelerations, arcs_within, skew, stays_within
from ncfix.compensate.plan.splitting import Split
from ncfix.compensate.plan.strategies import Strategy, get_strategy
from ncfix.compensate.plan.written import on_digits, rounding
from ncfix.compensate.solve import Planning, WrittenPlan, closure_of
from ncfix.control.moves import FeedMode, MotionKind, Moves, Rule
from ncfix.control.trace import motions_at
from ncfix.control.turns import turns_alone
from ncfix.machine import Machine, State
from ncfix.machine.aim import CLOSE
from ncfix.machine.error_model import MORE
from ncfix.text.dialect import Dialect
from ncfix.values import frozen
from ncfix.writer.emit import Emission
from ncfix.writer.pieces import Pieces


@frozen
class MotionEnds:
    """Axis positions and commands at the ends of n consecutive motions.

    machine      the machine with the workpiece at its place
    tool_length  mm
    tcp          whether tool-centre-point control is on
    commands     (n + 1, n_axes) programmed commands
    meant        (n + 1, n_axes) programmed axis positions
    """

    machine: Machine
    tool_length: float
    tcp: bool
    commands: Array
    meant: Array

    @classmethod
    def of(cls, machine: Machine, tool_length: float, commands: Array, tcp: bool) -> MotionEnds | None:
        """From programmed commands; None if, under TCP, a point may be out of reach or the path has no known bound."""
        if tcp and not (moves_as_one(machine) and skew(machine) is not None):
            return None
        ends = cls(machine, tool_length, tcp, commands, commands)
        return replace(ends, meant=ends.joints(commands)) if tcp else ends

    def joints(self, commands: Array) -> Array:
        """(k, n_axes) axis positions that follow from commands (k, n_axes)."""
        return reached_joints(self.machine, commands, np.full(len(commands), self.tcp), self.tool_length)[0]

    def corrected(self, done: Array) -> Array:
        """(n + 1, n_axes) commands that lead to the corrected axis positions `done` (n + 1, n_axes)."""
        if not self.tcp:
            return done
        tcp = np.ones(len(done), dtype=bool)
        return commands_of_positions(self.machine, self.commands, (self.meant, done), tcp, self.tool_length)

    def accelerations(self, segments: Segments, begin: Array, end: Array) -> Array:
        """(k,) bound of the acceleration of any linear axis along motions under TCP, mm per motion squared.

        begin, end  (k, n_axes) axis positions at the ends of the motions
        """
        way = lengths((segments.end - segments.start) @ self.machine.at_zero[1])
        found = accelerations(self.machine, begin, end, self.tool_length, way)
        assert found is not None
        return found

    def leave_travel(self, segments: Segments, begin: Array, end: Array, acceleration: Array) -> bool:
        """Whether an axis leaves its travel along motions under TCP; motions that the bound leaves open are sampled."""
        rows = np.flatnonzero(~stays_within(self.machine, begin, end, acceleration))

        def joints(rows: Index, fraction: Array) -> Array:
            return self.joints(segments.at(rows, fraction))

        return bool((excess(self.machine, joints, rows, np.ones(len(rows), dtype=bool)) > FUZZ).any())


MIN_MOTIONS_PER_ODD = 16
"""Least number of motions for each one that is not plain; with fewer, the part is planned by the full plan."""


@frozen
class MorePieces:
    """The pieces of motions that are split.

    rows    (k,) the motions, in order
    counts  (k,) number of pieces of each motion
    pieces  the pieces of all of them
    """

    rows: Index
    counts: Index
    pieces: Pieces


def arcs_and_dwells(
    intent: Intent, real: Segments, plain: Mask, dialect: Dialect, rounding: float
) -> tuple[Segments, MorePieces] | None:
    """The corrected segments with the fitted circles of their arcs, and the pieces of the arcs and dwells.

    real      the corrected starts and ends of the motions
    plain     (n,) straight motions; turns of rotary axes are treated like them
    rounding  largest shift of a point by rounding to the control's digits, mm

    None if there are many arcs, or some that may not stay arcs within the travels.
    """
    moves, arc = intent.moves, intent.segments.arc
    dwell, turn = moves.kind == MotionKind.DWELL, (moves.kind == MotionKind.FEED) & (moves.modal == 10)
    arcs, dwells = np.flatnonzero(arc), np.flatnonzero(dwell)
    if MIN_MOTIONS_PER_ODD * len(arcs) > len(plain) or not (plain | arc | dwell | turn).all():
        return None
    if (real.start[dwells] != real.end[dwells]).any() or full_circles(intent, arcs).any():
        return None
    if arcs.size:
        fit = fitted(intent, real, arcs, closure_of(dialect, moves), rounding)
        centre, sweep = real.centre.copy(), real.sweep.copy()
        centre[arcs], sweep[arcs] = fit.centre, fit.sweep
        real = replace(real, centre=centre, sweep=sweep)
        within = (arcs_within(intent.machine, each.rows(arcs)).all() for each in (intent.segments, real))
        if not (fit.sound.all() and all(within)):
            return None
    rows = np.flatnonzero(arc | dwell)
    ones = np.ones(len(rows), dtype=np.intp)
    centre = np.where(arc[rows, None], real.centre[rows], np.nan)
    return real, MorePieces(rows, ones, Pieces(rows, ones.astype(float), real.end[rows], arc[rows], centre, ~arc[rows]))


def by_the_long_way(
    machine: Machine, dialect: Dialect, options: FixOptions, moves: Moves, plain: Mask
) -> MorePieces | None:
    """The pieces of the motions that are not `plain` (n,), and of the motion behind each, by the full plan.

    None if there are many, or if one is refused or has a finding: then the whole part needs the full plan.
    """
    odd = np.flatnonzero(~plain)
    if MIN_MOTIONS_PER_ODD * len(odd) > len(moves) or odd[0] == 0 or odd[-1] + 2 >= len(moves):
        return None
    near = distinct(np.concatenate([odd - 1, odd, odd + 1]))
    few = motions_at(moves, near)
    accepted = Planning.of(few, machine, dialect, options).accepted()
    if accepted.reasons or accepted.plan.findings or (accepted.unchanged != (few.kind == MotionKind.DWELL)).any():
        return None
    pieces = accepted.plan.pieces
    own = ~(plain[near] & plain[near - 1])
    counts = np.bincount(pieces.move, minlength=len(near))[own]
    chosen = pieces.rows(np.flatnonzero(own[pieces.move]))
    return MorePieces(near[own], counts, replace(chosen, move=near[chosen.move]))


SplitChoice = tuple[Index, Split | None, tuple[Finding, ...]]
"""Motions that must be split, their pieces, and findings; see `Planner._split`."""
NEARLY = 1 - 1e-6
"""Fraction of a limit above which the full plan has to judge."""


@frozen
class PlainPlan:
    """The plan of a part of plain motions.

    part          its text and motions
    plain         (n,) straight motions that are corrected; the few others are arcs and dwells
    intent        the motions on the machine
    real          corrected starts and ends, before rounding; with them, the tip is right to 1 nm
    pieces        the pieces to be written
    first         (n + 1,) number of the first piece of each motion, and at last the number of pieces
    before        (n,) tip error at the end of each motion without a correction, mm
    findings      remarks about motions
    behind_rapid  whether the motion before the part is a rapid
    """

    part: Part
    plain: Mask
    intent: Intent
    real: Segments
    pieces: Pieces
    first: Index
    before: Array
    findings: tuple[Finding, ...]
    behind_rapid: bool

    @property
    def single(self) -> bool:
        """Whether every motion is one piece."""
        return len(self.pieces) == len(self.first) - 1

    @property
    def check_start(self) -> Mask:
        """(n,) motions whose start is not the end of a motion with a figure: as `deviation.starts_to_check`."""
        kind = self.part.moves.kind[:-1]
        return np.append(self.behind_rapid, (kind == MotionKind.DWELL) | (kind == MotionKind.RAPID))

    def written_plan(self, emission: Emission) -> WrittenPlan:
        """The plan and its text in the form of the full plan."""
        moves = self.part.moves
        untold = np.zeros(len(moves)), np.ones(len(moves), dtype=bool)
        plan = Plan(self.pieces, self.real.start, *untold, self.findings)
        return WrittenPlan(self.intent, plan, emission, moves.kind == MotionKind.DWELL, {}, reaches_back=False)

    def last(self, of_pieces: Array) -> Array:
        """(n, k) of values (m, k) of all pieces, those of the last piece of each motion."""
        return of_pieces if self.single else picked(of_pieces, self.first[1:] - 1)


@frozen
class Planner:
    """Plans parts of plain motions.

    machine  the machine with the workpiece at its place
    """

    machine: Machine
    options: FixOptions
    strategy: Strategy
    required: Requirements

    @classmethod
    def of(cls, machine: Machine, options: FixOptions) -> Planner | None:
        """The planner for a machine and options; None if these need the full plan, or the core is not compiled."""
        strategy = get_strategy(options.strategy)
        budget = PathTolerance(options.tolerance_mm, rounding(machine))
        able = strategy.follows_path and not strategy.corrects_orientation and budget.fine
        if (
            not core.engaged()
            or not able
            or matters(machine)
            or machine.inputs
            or machine.bow is None
            or machine.linear_ways is None
        ):
            return None
        required = Requirements(budget, Closure(), options.split_rapids, arc_pieces=False)
        return cls(machine, options, strategy, required)

    def plan(self, continued: ContinuedPart) -> PlainPlan | None:
        """The plan of a part; None if the part needs the full plan."""
        part, moves = continued.part, continued.part.moves
        plain = None if continued.head is None else plain_ones(continued.head.moves, moves)
        if continued.head is None or plain is None or moves.beside.any():
            return None
        commands, tcp = np.concatenate([continued.head.moves.end, moves.end]), bool(moves.tcp[0])
        poses = MotionEnds.of(self.machine, float(moves.tool_length[0]), commands, tcp)
        if poses is None:
            return None
        solved = self.strategy.solve(self.machine, poses.meant, State(poses.tool_length))
        if solved.before is None or not solved.converged.all() or not self._within_limits(poses.meant, solved.q):
            return None
        intent, corrected = Intent(self.machine, moves, State()), poses.corrected(solved.q)
        real = replace(intent.segments, start=corrected[:-1], end=corrected[1:])
        bound = self._bounds_of(poses, intent, real, solved.q)
        if bound is None:
            return None
        others, alone, looked = None, plain, None
        if not plain.all():
            others, looked = self._in_one_look(continued, intent, real, bound, plain)
            others = others or by_the_long_way(self.machine, part.program.dialect, self.options, moves, plain)
            if others is None:
                return None
            alone = np.ones_like(plain)
            alone[others.rows] = False
        over, parts, findings = looked or self._split(intent, real, bound, alone)
        if over.size and parts is None:
            return None
        pieces, first = pieces_of(real, over, parts, others)
        inner = np.flatnonzero((pieces.fraction < 1) & alone[pieces.move])
        if inner.size:
            pieces = on_digits(intent, pieces, inner)
            if not self._fine_inside(poses, real, pieces, inner, solved.q):
                return None
        behind_rapid = bool(continued.head.moves.kind[-1] == MotionKind.RAPID)
        return PlainPlan(part, plain, intent, real, pieces, first, solved.before[1:], findings, behind_rapid)

    def _bounds_of(self, poses: MotionEnds, intent: Intent, real: Segments, done: Array) -> Array | None:
        """(n,) bound of the deviation of the tip along motions, mm; None if, under TCP, one leaves a travel on its way.

        done  (n + 1, n_axes) corrected axis positions
        """
        begin, end = done[:-1], done[1:]
        if not poses.tcp:
            bound = self._bounds(poses.meant, done, np.asarray(poses.tool_length))
            bound[passed(intent, begin, end)[0]] = np.inf
            return bound
        assert self.machine.bow is not None
        programmed, meant = intent.segments, (poses.meant[:-1], poses.meant[1:])
        acceleration = poses.accelerations(real, begin, end)
        if poses.leave_travel(programmed, *meant, poses.accelerations(programmed, *meant)):
            return None
        if poses.leave_travel(real, begin, end, acceleration):
            return None
        return tcp_bounds(intent, self.machine.bow, begin, end, acceleration, poses.tool_length)

    def _in_one_look(
        self, continued: ContinuedPart, intent: Intent, real: Segments, bound: Array, plain: Mask
    ) -> tuple[MorePieces, SplitChoice] | tuple[None, None]:
        """The pieces of arcs and dwells, and the motions that must be split, all examined together as in `_split`.

        plain  (n,) the straight motions. (None, None) if the arcs or dwells need the full plan.
        """
        moves, found = intent.moves, None
        if not moves.tcp[0]:
            found = arcs_and_dwells(intent, real, plain, continued.part.program.dialect, self.required.budget.rounding)
        if found is None or moves.kind[-1] == MotionKind.DWELL:
            return None, None
        turned, others = found
        check_start = np.append(False, moves.kind[:-1] == MotionKind.DWELL)
        unknown = np.where(check_start | turned.arc, np.inf, bound)
        over, parts, _ = looked = self._split(intent, turned, unknown, moves.kind != MotionKind.DWELL, check_start)
        return (None, None) if over.size and parts is None else (others, looked)

    def _split(
        self, intent: Intent, real: Segments, bound: Array, among: Mask, check_start: Mask | None = None
    ) -> SplitChoice:
        """The motions that must be split, their pieces, and findings about motions that must not be split.

        bound        (n,) bound of their deviation, mm
        among        (n,) the motions to examine
        check_start  (n,) motions that are examined at their start, too

        Motions without pieces (None) need the full plan; so does an arc that would have to be split.
        """
        moves, limit = intent.moves, self.required.budget.path
        rows = np.flatnonzero(~(bound <= SURE * limit) & among)
        moving = some(np.abs(picked(moves.end, rows) - picked(moves.start, rows)) >= REST)
        rows = rows[moving if self.required.split_rapids else moving & (moves.kind[rows] != MotionKind.RAPID)]
        if not rows.size:
            return rows, None, ()
        checked = np.zeros(len(moves), dtype=bool) if check_start is None else check_start
        worst = looked_at(intent, real, rows, checked, limit)
        if np.isinf(worst).any() or (real.arc[rows] & (worst > limit)).any():
            return rows, None, ()
        whole = (worst > limit) & moves.whole[rows]
        findings = (not_split(rows[whole], worst[whole]),) if whole.any() else ()
        over = (worst > limit) & ~whole
        rows, deviation = rows[over], worst[over]
        if not rows.size:
            return rows, None, findings
        parts = in_pieces(intent, real, rows, deviation, self.strategy, self.required)
        return rows, parts if np.isfinite(parts.worst).all() else None, findings

    def _bounds(self, meant: Array, done: Array, tool_length: Array) -> Array:
        """(n,) bound of the deviation of the tip along motions from pose to pose, mm.

        meant, done  (n + 1, n_axes) programmed and corrected axis positions
        """
        from ncfix.core import motions

        bow, linear = self.machine.bow, ~self.machine.rotary
        assert bow is not None

        constants = bow.shift, bow.turn, bow.arm(np.zeros(len(linear)), float(tool_length), ~linear), MORE, CORNER
        bound = np.empty(len(done) - 1)
        motions.bounds(meant, done, self._linear, bow.slopes, bow.curvatures, *constants, CLOSE, bound)
        return bound

    @property
    def _linear(self) -> Array:
        """(n_axes,) 1.0 for linear axes, 0.0 for rotary ones: the compiled loops multiply by it."""
        return np.where(self.machine.rotary, 0.0, 1.0)

    def _within_limits(self, meant: Array, done: Array) -> bool:
        """Whether programmed and corrected poses keep clear of all limits of `limits`. Arrays as in `_bounds`."""
        from ncfix.core import motions

        low, high = self.machine.ranges.T
        linear, rotary = (NEARLY * most for most in self.machine.max_correction)
        axes = low.copy(), high.copy(), np.where(self.machine.rotary, rotary, np.inf), self._linear
        return bool(motions.within_limits(meant, done, *axes, linear, NEARLY * JUMP, FUZZ))

    def _fine_inside(self, poses: MotionEnds, real: Segments, pieces: Pieces, inner: Index, done: Array) -> bool:
        """Whether pieces `inner` (k,), which end inside motions, keep clear of all limits.

        done  (n + 1, n_axes) corrected axis positions at the ends of the motions
        """
        near = distinct(np.concatenate([inner, inner + 1]))
        own, ends, fraction = pieces.move[near], pieces.end[near], pieces.fraction[near]
        at_start = pieces.move[np.maximum(near - 1, 0)] != own
        at_start[:1] |= near[:1] == 0
        programmed = replace(real, start=poses.commands[:-1], end=poses.commands[1:])
        positions = poses.joints(ends)
        change = positions - poses.joints(programmed.at(own, fraction))
        before = np.concatenate([np.zeros_like(change[:1]), change[:-1]])
        before[at_start] = done[own[at_start]] - poses.meant[own[at_start]]
        low, high = self.machine.ranges.T
        within = bool((low - positions <= FUZZ).all() and (positions - high <= FUZZ).all())
        if within and poses.tcp:
            start = np.concatenate([ends[:1], ends[:-1]])
            start[at_start] = real.start[own[at_start]]
            along, begin = replace(real.rows(own), start=start, end=ends), poses.joints(start)
            within = not poses.leave_travel(along, begin, positions, poses.accelerations(along, begin, positions))
        if not within or not self._small(change):
            return False
        return bool(lengths((change - before)[:, ~self.machine.rotary]).max(initial=0.0) <= NEARLY * JUMP)

    def _small(self, shift: Array) -> bool:
        """Whether all corrections (k, n_axes) are smaller than the machine allows."""
        linear, rotary = self.machine.max_correction
        turns = np.abs(shift[:, self.machine.rotary]).max(initial=0.0) <= NEARLY * rotary
        return bool(turns and lengths(shift[:, ~self.machine.rotary]).max(initial=0.0) <= NEARLY * linear)


def plain_ones(head: Moves, moves: Moves) -> Mask | None:
    """(n,) which motions are plain: straight, in one frame, with one tool, to absolute targets.

    None unless each motion starts where the one before it ended (`head` before the first), and all may be planned here.
    """
    tool, frame, tcp = moves.tool_length[0], moves.frame[0], moves.tcp[0]
    alike = (
        (moves.tcp == tcp).all()
        and head.tcp[0] == tcp
        and (moves.frame == frame).all()
        and (moves.tool_length == tool).all()
        and head.tool_length[0] == tool
    )
    joined = (head.end[0] == moves.start[0]).all() and (moves.start[1:] == moves.end[:-1]).all()
    rising = (moves.block[1:] > moves.block[:-1]).all()
    able = _may_be_planned(head) and _may_be_planned(moves) and _are_straight(head).all()
    return _are_straight(moves) if alike and joined and rising and able else None


def _may_be_planned(moves: Moves) -> bool:
    """Whether all motions are dwells, or are corrected from a known start to an absolute target."""
    rule = (moves.rule != Rule.CORRECT) & (moves.kind != MotionKind.DWELL)
    special = moves.incremental | rule | (moves.kind == MotionKind.CYCLE) | moves.beside_tip
    if special.any() or moves.counted.any() or moves.resting.any():
        return False
    return bool(moves.placed.all() and (moves.feed_mode != FeedMode.INVERSE_TIME).all())


def _are_straight(moves: Moves) -> Mask:
    """(n,) straight motions, except feeds that turn rotary axes only."""
    rapid = (moves.kind == MotionKind.RAPID) & (moves.modal == 0)
    cut = (moves.kind == MotionKind.FEED) & (moves.modal == 10)
    straight: Mask = rapid | (cut & ~turns_alone(moves))
    return straight


def pieces_of(real: Segments, over: Index, parts: Split | None, others: MorePieces | None) -> tuple[Pieces, Index]:
    """The pieces of all motions, and (n + 1,) the number of the first piece of each, at last the number of pieces.

    real    corrected segments; a motion that is in none of the others is one piece
    over    motions that are split into `parts`
    others  the pieces of motions that are not plain
    """
    counts = np.ones(len(real), dtype=np.intp)
    if parts is not None:
        counts[over] = parts.counts
    if others is not None:
        counts[others.rows] = others.counts
    first, move, m = offsets(counts), owners(counts), int(counts.sum())
    fraction, end = np.ones(m), picked(real.end, move)
    if parts is not None:
        at = ranges(first[over], parts.counts)
        fraction[at], end[at] = parts.fraction, parts.end
    none, nowhere = np.broadcast_to(False, m), np.broadcast_to(np.nan, (m, 3))
    if others is None:
        return Pieces(move, fraction, end, none, nowhere, none), first
    at, own = ranges(first[others.rows], others.counts), others.pieces
    arc, centre, unchanged = none.copy(), nowhere.copy(), none.copy()
    fraction[at], end[at] = own.fraction, own.end
    arc[at], centre[at], unchanged[at] = own.arc, own.centre, own.unchanged
    return Pieces(move, fraction, end, arc, centre, unchanged), first
