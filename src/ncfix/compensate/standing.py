"""Where the machine stands before and after each motion when some motions are corrected and others are not.

A motion that is kept moves the axes that it names to where it says, and leaves the others where the corrected motions
before it have left them; a kept increment starts from there. So what matters is the displacement of each axis from
where the program believes it to be, and which motions take it away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate.plan.arrays import Array, Mask, distinct, every
from ncfix.compensate.plan.intent import stays
from ncfix.compensate.plan.kinematics import commands_from_joints, reached_joints
from ncfix.control.moves import Kind, Moves
from ncfix.machine import Machine


@dataclass(frozen=True, slots=True)
class Standing:
    """Commands at which each motion really starts and ends, (n, n_axes) mm and rad, before rounding; NaN if unknown."""

    start: Array
    end: Array


def standing(
    machine: Machine,
    moves: Moves,
    wanted: Array,
    kept: Mask,
    before: Array | None = None,
    approaches: Array | None = None,
) -> Standing:
    """Where each motion starts and ends if motions that are not `kept` (n,) end at `wanted` (n, n_axes).

    Axes that must get no word stay where they stand.

    before      (n_axes,) how far off the axes stand at the start of the first motion; not at all if not given
    approaches  (n, n_axes) where canned cycles feed from, and may return to; NaN, or not given: as programmed
    """
    shift = _known(wanted - moves.end)
    shift[kept] = 0.0
    decides = ~stays(moves, kept, shift, before)
    if kept.any():
        decides[kept] &= (moves.moved & ~moves.increments)[kept]
    if _goes_on(moves):
        first = np.zeros((1, shift.shape[1])) if before is None else before[None]
        left = _carried(shift, decides, first)
        return Standing(moves.start + left[:-1], moves.end + left[1:])
    back = _gone_back(moves)
    restarts = _restarts(moves, back)
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
    return Standing(moves.start + at_start, moves.end + at_end)


def _goes_on(moves: Moves) -> bool:
    """Whether every motion begins where the one before ended, and commands mean the same all along."""
    joined = bool((moves.start[1:] == moves.end[:-1]).all()) and not (moves.kind == Kind.CYCLE).any()
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


def _gone_back(moves: Moves) -> Mask:
    """Axes along which a canned cycle returns to where it started, (n, n_axes)."""
    back = np.zeros(moves.start.shape, dtype=bool)
    back[:-1] = (moves.start[1:] == moves.start[:-1]) & (moves.end[:-1] != moves.start[:-1])
    back &= (moves.kind == Kind.CYCLE)[:, None]
    return back


def _risen(moves: Moves, approaches: Array | None) -> tuple[Array, Mask]:
    """Where motions start at the level from which the cycle before them fed, and how far that is off, (n, n_axes)."""
    off, risen = np.zeros(moves.start.shape), np.zeros(moves.start.shape, dtype=bool)
    if moves.approach is not None and approaches is not None:
        at_level = (moves.start[1:] == moves.approach[:-1]) & (moves.start[1:] != moves.end[:-1])
        risen[1:] = at_level & np.isfinite(approaches[:-1])
        off[1:][risen[1:]] = (approaches - moves.approach)[:-1][risen[1:]]
    return off, risen


def _restarts(moves: Moves, back: Mask) -> Mask:
    """Axes that do not start where the motion before left them: the control has taken them elsewhere itself."""
    restarts = np.zeros(moves.start.shape, dtype=bool)
    same: Mask = (moves.start[1:] == moves.end[:-1]) | (np.isnan(moves.start[1:]) & np.isnan(moves.end[:-1]))
    restarts[1:] = ~same & ~back[:-1]
    return restarts


def _runs(moves: Moves) -> list[slice]:
    """Stretches over which commands mean the same: no change of tool-centre-point control or of its tool length."""
    length = np.where(moves.tcp, moves.tool_length, 0.0)
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
    q, reached = reached_joints(machine, ends, moves.tcp[pair[0]], moves.tool_length[pair[0]])
    if not reached.all():
        return np.zeros_like(shift)
    commands = commands_from_joints(machine, q, moves.tcp[pair[1]], moves.tool_length[pair[1]])
    result: Array = commands[1] - commands[0]
    return result


def _known(values: Array) -> Array:
    return np.where(np.isfinite(values), values, 0.0)
