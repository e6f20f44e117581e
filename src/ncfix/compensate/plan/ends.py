"""The corrected ends of motions, in bulk: where each really starts and ends, and what cannot be corrected and why.

An unchanged motion moves the axes that it names to where it says, and leaves the others where the corrected motions
before it have left them; an unchanged increment starts from there. So what matters is the displacement of each axis
from where the program believes it to be, and which motions take it away.

A canned cycle has one place in its plane, that of the bottom of the hole. Of the level from which it feeds, and to
which it may return (R), only the height is its own; that is corrected, too.

Some rotary axes stay as programmed, though the strategy would correct them. One that must get no word stays where it
stands. And in a plane that was swivelled without tool-centre-point control the control moves linear axes as if the
rotary axes stood still for good: turned by a correction, they would take the tip along. An axis whose angles a control
may count from 0 to 360 degrees stays within them where the program does: on such a control -0.001 is 359.999, and leads
it round, or is an alarm, and the sign of a word may even be the sense of the turn. Source: Siemens, "SINUMERIK 840D sl,
axes and spindles", R2, MD30455; Fanuc 30i parameter manual, No. 1008.
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
    """Commands at which each motion really starts and ends, (n, n_axes) mm and rad, before rounding; NaN if unknown."""

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
    """Where each motion starts and ends if all that are not `unchanged` (n,) end at `wanted` (n, n_axes).

    Axes that must get no word stay where they stand.

    before      (n_axes,) how far off the axes stand at the start of the first motion; not at all if not given
    approaches  (n, n_axes) where canned cycles feed from, and may return to; NaN, or not given: as programmed
    """
    shift = wanted - moves.end
    shift[~np.isfinite(shift)] = 0.0
    shift[unchanged] = 0.0
    decides = ~stays(moves, unchanged, shift, before)
    if unchanged.any():
        decides[unchanged] &= (moves.moved & ~moves.increments)[unchanged]
    if _goes_on(moves):
        first = np.zeros((1, shift.shape[1])) if before is None else before[None]
        left = _carried(shift, decides, first)
        return EndCommands(moves.start + left[:-1], moves.end + left[1:])
    back, restarts = (np.zeros(moves.start.shape, dtype=bool) for _ in range(2))
    back[:-1] = (moves.start[1:] == moves.start[:-1]) & (moves.end[:-1] != moves.start[:-1])
    back &= (moves.kind == MotionKind.CYCLE)[:, None]  # a canned cycle has returned to where it started
    same: Mask = (moves.start[1:] == moves.end[:-1]) | (np.isnan(moves.start[1:]) & np.isnan(moves.end[:-1]))
    restarts[1:] = ~same & ~back[:-1]  # the control has taken an axis elsewhere itself
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
    """Whether every motion begins where the one before ended, and commands mean the same all along."""
    joined = bool((moves.start[1:] == moves.end[:-1]).all()) and not (moves.kind == MotionKind.CYCLE).any()
    return joined and len(_runs(moves)) == 1


def _carried(shift: Array, decides: Mask, first: Array) -> Array:
    """Displacements before and behind motions that go on from each other, (n + 1, n_axes): `first`, then as decided.

    Where a motion does not decide, it is that of the motion before.
    """
    found = np.concatenate([first, shift])
    open_ = np.flatnonzero(~every(decides))
    near = distinct(np.concatenate([open_, open_ + 1]))
    decided = np.concatenate([np.ones_like(decides[:1]), decides])[near]
    last = np.maximum.accumulate(np.where(decided, np.arange(len(near))[:, None], 0), axis=0)
    found[near] = np.take_along_axis(found[near], last, axis=0)
    return found


def _filled(
    shift: Array, decides: Mask, back: Mask, jumps: Array, restarts: Mask, before: Array
) -> tuple[Array, Array, Array]:
    """Displacements at the starts and ends of a run of motions, and what is carried on behind it.

    Starts and ends are put in one sequence; each takes the last value that was decided before it. Where a motion
    restarts, the displacement is that of `jumps`.
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
    """Where motions start at the level from which the cycle before them fed, and how far that is off, (n, n_axes)."""
    off, risen = np.zeros(moves.start.shape), np.zeros(moves.start.shape, dtype=bool)
    if moves.approach is not None and approaches is not None:
        at_level = (moves.start[1:] == moves.approach[:-1]) & (moves.start[1:] != moves.end[:-1])
        risen[1:] = at_level & np.isfinite(approaches[:-1])
        off[1:][risen[1:]] = (approaches - moves.approach)[:-1][risen[1:]]
    return off, risen


def _runs(moves: Moves) -> list[slice]:
    """Stretches over which commands mean the same: no change of tool-centre-point control or of its tool length."""
    length = np.where(moves.tcp, moves.length_under_tcp, 0.0)
    changes = np.flatnonzero((np.diff(moves.tcp.astype(np.int8)) != 0) | (np.diff(length) != 0)) + 1
    ends = [*changes.tolist(), len(moves)]
    return [slice(start, stop) for start, stop in zip([0, *changes.tolist()], ends, strict=True) if stop > start]


def _translated(machine: Machine, moves: Moves, row: int, shift: Array) -> Array:
    """The displacement behind motion row - 1 in the commands of motion row, where they mean something else."""
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
    """(n, n_axes) where cycles that are not `unchanged` (n,) shall feed from, if they end at `wanted` (n, n_axes).

    NaN where there is no such level, or it cannot be corrected; None if there is none at all.
    """
    moves = intent.moves
    if moves.approach is None:
        return None
    rows = np.flatnonzero(~unchanged & np.isfinite(moves.approach).all(axis=1) & np.isfinite(wanted).all(axis=1))
    result = np.full(moves.approach.shape, np.nan)
    commands, arrived = _steered(intent, rows, moves.approach[rows], wanted[rows])
    result[rows[arrived]] = _over_the_hole(moves, rows[arrived], commands[arrived], wanted[rows[arrived]])
    return result


def _steered(intent: Intent, rows: Index, nominal: Array, wanted: Array) -> tuple[Array, Mask]:
    """Commands that bring the tip of the real machine to the level, rotary axes as at the bottom of the hole."""
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
    """Commands (k, n_axes) moved over the bottom of their hole, in the frame of the program."""
    assert moves.approach is not None
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
"""rad"""


def with_rotary_held(
    intent: Intent, strategy: Strategy, move: Index, fraction: Array, q: Array, correction: Correction
) -> Correction:
    """The `correction` of poses q (k, n_axes) of motions `move`, but for rotary axes that are held."""
    if not strategy.corrects_orientation:
        return correction
    there = on_their_side(intent, move, q, np.where(held_axes(intent, move), q, correction.q))
    rows = np.flatnonzero((there != correction.q)[:, intent.machine.rotary].any(axis=1))
    if not rows.size:
        return correction
    target = intent.machine.tip(q[rows], intent.lengths(move[rows]))
    corrected, converged, oriented = correction.q.copy(), correction.converged.copy(), correction.oriented.copy()
    corrected[rows], arrived = steer(intent.machine, there[rows], target, intent.states(move[rows], fraction[rows]))
    converged[rows] &= arrived
    oriented[rows] = False
    return Correction(corrected, converged, oriented)


def on_their_side(intent: Intent, move: Index, q: Array, corrected: Array) -> Array:
    """Corrected positions (k, n_axes); not below zero or past a full turn where the program never is.

    Directions that are given as vectors lead the axes as the control thinks best.
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
    """(k, n_axes) rotary axes that motions must not turn but as programmed."""
    held = np.zeros((len(move), len(intent.machine.axes)), dtype=bool)
    if intent.moves.rotary_as_programmed is not None:
        held |= intent.moves.rotary_as_programmed[move][:, None] & intent.machine.rotary
    if intent.idle is not None:
        held |= intent.idle[move] & intent.machine.rotary
    return held


BATCH = 32_768
"""Ends corrected at a time."""


@frozen
class Ends:
    """Where motions shall end.

    wanted    (n, n_axes) commands; those of the program where nothing is corrected
    failed    (n,) motions that should be corrected and cannot
    oriented  (n,) the tool direction is corrected too, without damping or limits
    findings  why they cannot
    before    (n,) mm: how far the tip is off without a correction; NaN where that is not known
    """

    wanted: Array
    failed: Mask
    oriented: Mask
    findings: tuple[Finding, ...]
    before: Array


def corrected(intent: Intent, strategy: Strategy, rows: Index) -> Ends:
    """Correct the ends of motions `rows`."""
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
            "the linear axes cannot bring the tool tip there with the rotary axes where they are",
        ),
        Finding.of("NCF403", good[~result.converged], "no command found that brings the tool tip where it should be"),
    )
    return Ends(wanted, failed, oriented, tuple(trouble for trouble in troubles if len(trouble)), before)


def with_rotary_as_it_stands(intent: Intent, ends: Ends, unchanged: Mask, before: Array | None) -> Ends:
    """The ends with X Y Z for rotary axes that get no word, where corrections before have left these."""
    if intent.idle is None:
        return ends
    stands = standing(intent.machine, intent.moves, ends.wanted, unchanged, before).end
    off = intent.idle & intent.machine.rotary & (stands != ends.wanted) & ~unchanged[:, None]
    rows = np.flatnonzero(off.any(axis=1))
    if not rows.size:
        return ends
    commands = np.where(off[rows], stands[rows], ends.wanted[rows])
    found, arrived = intent.aimed(rows, np.ones(len(rows)), commands)
    wanted = ends.wanted.copy()
    wanted[rows[arrived]] = found[arrived]
    return replace(ends, wanted=wanted)


def _solved(intent: Intent, strategy: Strategy, rows: Index, q: Array) -> Correction:
    """The correction of ends q (k, n_axes) of motions; where one depends on others, of all of them at once."""
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
    """Commands of corrected axis positions (k, n_axes); where nothing is corrected exactly those of the program.

    programmed  (k, n_axes) commands of the program
    nominal     (k, n_axes) axis positions of the program
    """
    tcp, lengths = intent.moves.tcp[rows], intent.moves.length_under_tcp[rows]
    if not tcp.any():
        return corrected
    return commands_of_positions(intent.machine, programmed, (nominal, corrected), tcp, lengths)


def commands_of_positions(
    machine: Machine, programmed: Array, positions: tuple[Array, Array], tcp: Mask, lengths: ArrayLike
) -> Array:
    """As `as_commands`; `positions` are those of the program and the corrected ones, `tcp` and lengths as there."""
    nominal, corrected = positions
    here, there = (commands_from_joints(machine, q, tcp, lengths) for q in positions)
    still = every(nominal == corrected)[:, None]
    return programmed + np.where(still, 0.0, there - here)


def along(intent: Intent, rows: Index, fraction: Array) -> PoseSequence:
    """How the ends of motions follow each other, for limits on rates; an unchanged motion begins a new stretch."""
    q = intent.joints_at(rows, fraction)
    tips = intent.machine.tip(q, intent.lengths(rows))
    begins = np.ones(len(rows), dtype=bool)
    begins[1:] = np.diff(rows) != 1
    return path_of(intent, q, tips, begins, np.zeros(len(rows), dtype=bool), q)


def path_of(intent: Intent, q: Array, tips: Array, begins: Mask, pinned: Mask, decided: Array) -> PoseSequence:
    """The `PoseSequence` of poses q (k, n_axes) with tips (k, 3); `decided` (k, n_axes) corrections of pinned poses."""
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
    """Full circles made to end, within their plane, exactly where they really start.

    Only where that moves their end by no more than `within` mm. Of circles one after another all end where the first
    one starts.
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
