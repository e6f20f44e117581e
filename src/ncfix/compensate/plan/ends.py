"""The corrected ends of motions: where each motion really starts and ends, and which cannot be corrected, and why.

An unchanged motion moves the axes that it names to their programmed place. The other axes keep the displacement that
earlier corrected motions gave them, and an unchanged increment starts from it. So for each axis the displacement from
its programmed position is followed from motion to motion.

A canned cycle has one place in its plane, that of the bottom of the hole. The level from which it feeds, and to which
it may return (R), has only a height of its own; this is corrected, too.

Some rotary axes stay as programmed although the strategy would correct them:

- an axis that must get no word stays where it stands;
- in a plane that was swivelled without tool-centre-point control, the control moves the linear axes as if the rotary
  axes stood still; a rotary correction would move the tip;
- an axis whose angles a control may count from 0 to 360 degrees stays within them if the program does. On such a
  control -0.001 means 359.999, which leads it round or is an alarm, and the sign may even give the sense of the turn.
  Source: Siemens, "SINUMERIK 840D sl, axes and spindles", R2, MD30455; Fanuc 30i parameter manual, No. 1008.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ncfix.arrays import Array, Index, Mask, chosen, distinct, every, finite, picked, put, slices, stacked
from ncfix.compensate.plan import arcs
from ncfix.compensate.plan.findings import Finding
from ncfix.compensate.plan.intent import Intent, stays
from ncfix.compensate.plan.kinematics import Correction, commands_from_joints, reached_joints, steer
from ncfix.compensate.plan.strategies import PoseSequence, Strategy
from ncfix.control.moves import MotionKind, Moves
from ncfix.machine import Machine
from ncfix.values import frozen
from ncfix.writer.target import FrameMap


@frozen
class EndCommands:
    """The commands at which motions really start and end, (n, n_axes) mm and rad, before rounding; NaN if unknown."""

    start: Array
    end: Array


def standing(
    machine: Machine,
    moves: Moves,
    wanted: Array,
    unchanged: Mask,
    before: Array | None = None,
    approaches: Array | None = None,
) -> EndCommands:
    """The commands at which each motion really starts and ends. Axes that must get no word stay where they stand.

    wanted      (n, n_axes) corrected commands at the ends of the motions
    unchanged   (n,) motions that are left as they are, whatever `wanted` says
    before      (n_axes,) displacement of the axes at the start of the first motion; None: zero
    approaches  (n, n_axes) corrected commands at the level R of canned cycles; NaN, or None: as programmed
    """
    shift = wanted - moves.end
    shift[~np.isfinite(shift)] = 0.0
    shift[unchanged] = 0.0
    decides = ~stays(moves, unchanged, shift, before)
    if unchanged.any():
        decides[unchanged] &= (moves.moved & ~moves.increments)[unchanged]
    if _goes_on(moves):
        first = np.zeros((1, shift.shape[1])) if before is None else before[None]
        displacement = _carried(shift, decides, first)
        return EndCommands(moves.start + displacement[:-1], moves.end + displacement[1:])
    back, restarts = (np.zeros(moves.start.shape, dtype=bool) for _ in range(2))
    back[:-1] = (moves.start[1:] == moves.start[:-1]) & (moves.end[:-1] != moves.start[:-1])
    back &= (moves.kind == MotionKind.CYCLE)[:, None]  # a canned cycle has returned to where it started
    same: Mask = (moves.start[1:] == moves.end[:-1]) | (np.isnan(moves.start[1:]) & np.isnan(moves.end[:-1]))
    restarts[1:] = ~same & ~back[:-1]  # the control itself has moved an axis in between
    jumps, risen = _risen(moves, approaches)
    back[:-1] &= ~risen[1:]
    restarts |= risen
    at_start, at_end = np.zeros_like(shift), np.zeros_like(shift)
    carried = np.zeros(shift.shape[1:]) if before is None else before
    for run in _runs(moves):
        if run.start:
            carried = _translated(machine, moves, run.start, carried)
            restarts[run.start] = False
        part = shift[run], decides[run], back[run], jumps[run], restarts[run]
        at_start[run], at_end[run], carried = _filled(*part, carried)
    return EndCommands(moves.start + at_start, moves.end + at_end)


def _goes_on(moves: Moves) -> bool:
    """Whether every motion begins where the one before ended, and TCP and its tool length never change."""
    joined = bool((moves.start[1:] == moves.end[:-1]).all()) and not (moves.kind == MotionKind.CYCLE).any()
    return joined and len(_runs(moves)) == 1


def _carried(shift: Array, decides: Mask, first: Array) -> Array:
    """(n + 1, n_axes) displacements before the first motion (`first`) and behind each of n consecutive motions.

    If a motion does not decide the displacement of an axis, the axis keeps that of the motion before.
    """
    displacement = np.concatenate([first, shift])
    open_ = np.flatnonzero(~every(decides))
    near = distinct(np.concatenate([open_, open_ + 1]))
    decided = np.concatenate([np.ones_like(decides[:1]), decides])[near]
    last = np.maximum.accumulate(np.where(decided, np.arange(len(near))[:, None], 0), axis=0)
    displacement[near] = np.take_along_axis(displacement[near], last, axis=0)
    return displacement


def _filled(
    shift: Array, decides: Mask, back: Mask, jumps: Array, restarts: Mask, before: Array
) -> tuple[Array, Array, Array]:
    """Displacements at the starts and at the ends of a run of motions (n, n_axes), and that carried on behind it.

    Starts and ends are put in one sequence; each takes the last value that was decided before it.

    shift     (n, n_axes) displacements at the ends of motions that decide them
    decides   (n, n_axes) the motion decides the displacement of the axis
    back      (n, n_axes) the axis returns to the start of the motion, so its displacement is not carried on
    jumps     (n, n_axes) displacements at the starts where `restarts`
    before    (n_axes,) displacement before the run
    """
    n, n_axes = shift.shape
    values = np.zeros((2 * n + 1, n_axes))
    decided = np.zeros((2 * n + 1, n_axes), dtype=bool)
    values[0], decided[0] = before, True
    values[1::2], decided[1::2] = jumps, restarts
    values[2::2], decided[2::2] = shift, decides & ~back
    last = np.maximum.accumulate(np.where(decided, np.arange(2 * n + 1)[:, None], 0), axis=0)
    filled = np.take_along_axis(values, last, axis=0)
    at_end = np.where(decides, shift, filled[2::2])
    return filled[1::2], at_end, filled[-1]


def _risen(moves: Moves, approaches: Array | None) -> tuple[Array, Mask]:
    """(n, n_axes) displacement of level R of the cycle before a motion, and whether the motion starts at that level."""
    off, risen = np.zeros(moves.start.shape), np.zeros(moves.start.shape, dtype=bool)
    if approaches is not None:
        at_level = (moves.start[1:] == moves.approach[:-1]) & (moves.start[1:] != moves.end[:-1])
        risen[1:] = at_level & np.isfinite(approaches[:-1])
        off[1:][risen[1:]] = (approaches - moves.approach)[:-1][risen[1:]]
    return off, risen


def _runs(moves: Moves) -> list[slice]:
    """Stretches of motions in which neither tool-centre-point control nor its tool length changes."""
    length = np.where(moves.tcp, moves.length_under_tcp, 0.0)
    changes = np.flatnonzero((np.diff(moves.tcp.astype(np.int8)) != 0) | (np.diff(length) != 0)) + 1
    ends = [*changes.tolist(), len(moves)]
    return [slice(start, stop) for start, stop in zip([0, *changes.tolist()], ends, strict=True) if stop > start]


def _translated(machine: Machine, moves: Moves, row: int, shift: Array) -> Array:
    """The displacement (n_axes,) behind motion row - 1, in terms of the commands of motion `row`.

    The two differ if tool-centre-point control or its tool length changes between them.
    """
    here, there = np.array([row]), np.array([row - 1])
    if not np.any(shift) or not np.isfinite(moves.end[there]).all() or not np.isfinite(moves.start[here]).all():
        return shift
    ends = np.concatenate([moves.end[there], moves.end[there] + shift])
    pair = np.repeat(there, 2), np.repeat(here, 2)
    q, reached = reached_joints(machine, ends, moves.tcp[pair[0]], moves.length_under_tcp[pair[0]])
    if not reached.all():
        return np.zeros_like(shift)
    commands = commands_from_joints(machine, q, moves.tcp[pair[1]], moves.length_under_tcp[pair[1]])
    return commands[1] - commands[0]


def corrected_approaches(intent: Intent, wanted: Array, unchanged: Mask) -> Array | None:
    """(n, n_axes) corrected commands at the level R from which canned cycles feed; None if no motion is a cycle.

    wanted     (n, n_axes) corrected commands at the bottoms of the holes
    unchanged  (n,) motions that are not corrected

    NaN for motions without such a level, and where it cannot be corrected.
    """
    moves = intent.moves
    if np.isnan(moves.approach).all():
        return None
    rows = np.flatnonzero(~unchanged & np.isfinite(moves.approach).all(axis=1) & np.isfinite(wanted).all(axis=1))
    result = np.full(moves.approach.shape, np.nan)
    commands, arrived = _steered(intent, rows, moves.approach[rows], wanted[rows])
    result[rows[arrived]] = _over_the_hole(moves, rows[arrived], commands[arrived], wanted[rows[arrived]])
    return result


def _steered(intent: Intent, rows: Index, nominal: Array, wanted: Array) -> tuple[Array, Mask]:
    """Commands that bring the tip of the real machine to level R, rotary axes as at the bottom, and which arrived."""
    moves, machine = intent.moves, intent.machine
    meant = intent.joints(rows, nominal)
    q = np.where(machine.rotary, intent.joints(rows, wanted), meant)
    fit: Mask = np.asarray(np.isfinite(q).all(axis=1))
    good = rows[fit]
    arrived, commands = fit.copy(), nominal.copy()
    target = machine.tip(meant[fit], intent.lengths(good))
    solved, arrived[fit] = steer(machine, q[fit], target, intent.states(good, np.ones(len(good))))
    commands[fit] = commands_from_joints(machine, solved, moves.tcp[good], moves.length_under_tcp[good])
    return commands, arrived


def _over_the_hole(moves: Moves, rows: Index, commands: Array, wanted: Array) -> Array:
    """Commands (k, n_axes) moved over the bottom of their hole; only their height in the program's frame is kept."""
    result = commands.copy()
    for number in sorted(set(moves.frame[rows].tolist())):
        part = np.flatnonzero(moves.frame[rows] == number)
        frame = FrameMap(moves.frames[number], moves.axes, moves.rotary)
        own = rows[part]
        depth = np.abs(frame.program(moves.end[own].copy()) - frame.program(moves.approach[own].copy()))
        across = depth == depth.max(axis=1, keepdims=True)
        over = np.where(across, frame.program(commands[part].copy()), frame.program(wanted[part].copy()))
        result[part] = frame.command(over)
    return result


FULL = 2 * math.pi
NO_ANGLE = 1e-9
"""Angle, rad, that counts as none."""


def with_rotary_held(
    intent: Intent, strategy: Strategy, move: Index, fraction: Array, q: Array, correction: Correction
) -> Correction:
    """The `correction` of poses q (k, n_axes) of motions `move` (k,), with held rotary axes as programmed.

    X Y Z are solved again for poses in which a rotary axis is held; see `held_axes` and `on_their_side`.
    """
    if not strategy.corrects_orientation:
        return correction
    held = on_their_side(intent, move, q, np.where(held_axes(intent, move), q, correction.q))
    rows = np.flatnonzero((held != correction.q)[:, intent.machine.rotary].any(axis=1))
    if not rows.size:
        return correction
    target = intent.machine.tip(q[rows], intent.lengths(move[rows]))
    corrected, converged, oriented = correction.q.copy(), correction.converged.copy(), correction.oriented.copy()
    corrected[rows], arrived = steer(intent.machine, held[rows], target, intent.states(move[rows], fraction[rows]))
    converged[rows] &= arrived
    oriented[rows] = False
    return Correction(corrected, converged, oriented)


def on_their_side(intent: Intent, move: Index, q: Array, corrected: Array) -> Array:
    """Corrected positions (k, n_axes), clipped to 0 to 360 degrees for each rotary axis that never leaves them.

    Nothing is clipped if the program gives tool directions as vectors: then the control chooses the angles.
    """
    moves = intent.moves
    if moves.angles is None or moves.pointing is not None:
        return corrected
    least, most = moves.angles.T
    zero = np.array([frame.offset for frame in moves.frames])[moves.frame[move]]
    low = np.where(least >= -NO_ANGLE, zero, -np.inf)
    high = np.where(most < FULL - NO_ANGLE, zero + FULL - intent.machine.least_increment[1], np.inf)
    return np.asarray(np.clip(corrected, np.minimum(low, q), np.maximum(high, q)))


def held_axes(intent: Intent, move: Index) -> Mask:
    """(k, n_axes) rotary axes that must stay as programmed in motions `move` (k,)."""
    held: Mask = intent.moves.rotary_as_programmed[move][:, None] & intent.machine.rotary
    if intent.idle is not None:
        held |= intent.idle[move] & intent.machine.rotary
    return held


BATCH = 32_768
"""Number of ends corrected at a time."""


@frozen
class Ends:
    """The corrected ends of motions.

    wanted    (n, n_axes) commands; the programmed ones for motions that are not corrected
    failed    (n,) motions that should be corrected and cannot be
    oriented  (n,) the tool direction is corrected too, without damping or limits
    findings  why motions failed
    before    (n,) tip error without a correction, mm; NaN if not known
    """

    wanted: Array
    failed: Mask
    oriented: Mask
    findings: tuple[Finding, ...]
    before: Array


def corrected(intent: Intent, strategy: Strategy, rows: Index) -> Ends:
    """The corrected ends of motions `rows` (k,)."""
    moves = intent.moves
    ones = np.ones(len(rows))
    q = intent.joints_at(rows, ones)
    lengths = np.broadcast_to(intent.lengths(rows), len(rows))
    named = finite(picked(moves.end, rows))
    fit = finite(q) & np.isfinite(lengths)
    good, q = rows[fit], chosen(q, fit)
    result = _solved(intent, strategy, good, q)
    wanted = moves.end.copy()
    put(wanted, good, as_commands(intent, good, picked(moves.end, good), q, result.q))
    failed, oriented = np.zeros(len(moves), dtype=bool), np.zeros(len(moves), dtype=bool)
    failed[rows[~fit]] = failed[good[~result.converged]] = True
    oriented[good] = result.oriented
    before = np.full(len(moves), np.nan)
    if result.before is not None:
        before[good[result.converged]] = result.before[result.converged]
    wanted[failed] = moves.end[failed]
    troubles = (
        Finding.of("NCF408", rows[~named], "the end of this motion is not known in all axes"),
        Finding.of("NCF414", rows[named & ~np.isfinite(lengths)], "the length of the tool is not known here"),
        Finding.of(
            "NCF402",
            rows[named & np.isfinite(lengths) & ~fit],
            "with the rotary axes at these angles the linear axes cannot move the tool tip there",
        ),
        Finding.of(
            "NCF403", good[~result.converged], "no command was found that moves the tool tip to its intended position"
        ),
    )
    return Ends(wanted, failed, oriented, tuple(trouble for trouble in troubles if len(trouble)), before)


def with_rotary_as_it_stands(intent: Intent, ends: Ends, unchanged: Mask, before: Array | None) -> Ends:
    """The ends with X Y Z solved again for rotary axes that get no word, and so stand where corrections left them."""
    if intent.idle is None:
        return ends
    stands = standing(intent.machine, intent.moves, ends.wanted, unchanged, before).end
    off = intent.idle & intent.machine.rotary & (stands != ends.wanted) & ~unchanged[:, None]
    rows = np.flatnonzero(off.any(axis=1))
    if not rows.size:
        return ends
    commands = np.where(off[rows], stands[rows], ends.wanted[rows])
    aimed, arrived = intent.aimed(rows, np.ones(len(rows)), commands)
    wanted = ends.wanted.copy()
    wanted[rows[arrived]] = aimed[arrived]
    return replace(ends, wanted=wanted)


def _solved(intent: Intent, strategy: Strategy, rows: Index, q: Array) -> Correction:
    """The correction of ends q (k, n_axes) of motions `rows` (k,), in batches if no end depends on another."""
    ones = np.ones(len(rows))
    if strategy.corrects_orientation:
        found = strategy.solve(intent.machine, q, intent.states(rows, ones), along(intent, rows, ones))
        return with_rotary_held(intent, strategy, rows, ones, q, found)
    if not strategy.follows_path:
        return strategy.solve(intent.machine, q, intent.states(rows, ones))
    return stacked(
        [
            strategy.solve(intent.machine, q[part], intent.states(rows[part], ones[part]))
            for part in slices(len(rows), BATCH)
        ]
    )


def as_commands(intent: Intent, rows: Index, programmed: Array, nominal: Array, corrected: Array) -> Array:
    """The commands of corrected axis positions (k, n_axes); exactly the programmed ones where nothing is corrected.

    programmed  (k, n_axes) programmed commands
    nominal     (k, n_axes) programmed axis positions
    """
    tcp, lengths = intent.moves.tcp[rows], intent.moves.length_under_tcp[rows]
    if not tcp.any():
        return corrected
    return commands_of_positions(intent.machine, programmed, (nominal, corrected), tcp, lengths)


def commands_of_positions(
    machine: Machine, programmed: Array, positions: tuple[Array, Array], tcp: Mask, lengths: ArrayLike
) -> Array:
    """Like `as_commands`, for `positions` (programmed, corrected), with `tcp` (k,) and tool lengths, mm, given."""
    nominal, corrected = positions
    before, after = (commands_from_joints(machine, q, tcp, lengths) for q in positions)
    still = every(nominal == corrected)[:, None]
    return programmed + np.where(still, 0.0, after - before)


def along(intent: Intent, rows: Index, fraction: Array) -> PoseSequence:
    """The ends of motions `rows` as a path, for limits on rates; behind omitted motions a new stretch begins."""
    q = intent.joints_at(rows, fraction)
    tips = intent.machine.tip(q, intent.lengths(rows))
    begins = np.ones(len(rows), dtype=bool)
    begins[1:] = np.diff(rows) != 1
    return path_of(intent, q, tips, begins, np.zeros(len(rows), dtype=bool), q)


def path_of(intent: Intent, q: Array, tips: Array, begins: Mask, pinned: Mask, decided: Array) -> PoseSequence:
    """The `PoseSequence` of poses q (k, n_axes) with tips (k, 3), mm; `decided` (k, n_axes): those of pinned poses."""
    rotary = intent.machine.rotary
    travel_mm, travel_rad = np.zeros(len(q)), np.zeros(len(q))
    travel_mm[1:] = np.linalg.norm(np.diff(tips, axis=0), axis=1)
    travel_rad[1:] = np.abs(np.diff(q[:, rotary], axis=0)).sum(axis=1)
    return PoseSequence(travel_mm, travel_rad, begins, pinned, decided[:, rotary])


def with_closed_circles(
    intent: Intent,
    wanted: Array,
    unchanged: Mask,
    within: float,
    before: Array | None = None,
    approaches: Array | None = None,
) -> Array:
    """The wanted ends, with full circles that end, within their plane, exactly where they really start.

    An end is moved by at most `within` mm, else it stays. Consecutive circles all end where the first one starts.
    """
    moves, columns = intent.moves, intent.columns
    rows = np.flatnonzero(intent.segments.arc & ~unchanged)
    rows = rows[arcs.full_circles(intent, rows)]
    if not rows.size:
        return wanted
    chained = np.zeros(len(rows), dtype=bool)
    same = (moves.normal[rows[1:]] == moves.normal[rows[:-1]]).all(axis=1)
    joined = (moves.start[rows[1:]] == moves.end[rows[:-1]]).all(axis=1)
    chained[1:] = (np.diff(rows) == 1) & same & joined
    first = rows[np.maximum.accumulate(np.where(chained, 0, np.arange(len(rows))))]
    where = standing(intent.machine, moves, wanted, unchanged, before, approaches)
    shift = (where.start - moves.start)[first[:, None], columns]
    own = (wanted - moves.end)[rows[:, None], columns]
    off = arcs.across(shift - own, moves.normal[rows])
    near = np.linalg.norm(off, axis=1) <= within
    result = wanted.copy()
    result[rows[near, None], columns] += off[near]
    return result
