"""The intended path: the tip of a perfect machine that follows the program, and the gap of a real one to it.

A control interpolates commands: X Y Z and the rotary axes linearly with the fraction of the block, arcs on their
circles. With tool-centre-point control the linear axes follow from that at every instant. The intended path is that of
the tool tip of a perfect machine in the workpiece.

Actual and intended tip are compared at the same fraction of the block, because tool direction and feed there belong to
that point of the workpiece. The distance is never less than that to the nearest point of the intended path.

Some axes must get no word, because only the machine knows where they stand. Such an axis stays there, and its
correction is not made until the program names it. All other corrections are those of the exact solution, so the error
left at the tip lies along the axes without words, except for second-order terms. Deviations are taken without that
part, because no splitting and no other word could remove it.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ncfix.arrays import Array, Index, Mask, Signs, every, picked, put, some
from ncfix.compensate.plan.kinematics import (
    REST,
    carried,
    commands_from_joints,
    common,
    linear_columns,
    matters,
    programmed_tip,
    reached_joints,
    regular,
    rows_of,
    signs,
    solve,
    steer,
    tip_maps,
)
from ncfix.compensate.plan.segments import Segments
from ncfix.control.moves import MotionKind, Moves, Rule
from ncfix.machine import Machine, State
from ncfix.values import frozen

INSTANT, WHILE = 1e-4, 1e-3
"""Fractions of a motion over which the direction of its axes is taken: around an instant, and before it."""
NOISE = 1e-11
"""Largest difference, mm or rad, of axis positions by rounding of the arithmetic."""


@frozen(slots=False)
class Intent:
    """The motions of a program on a machine, and the intended path that follows from them.

    state  `inputs`: further quantities on which errors depend, each a number or one number per motion; `direction`:
           direction in which the axes came to the start of the first motion. The tool length comes from the motions.
    """

    machine: Machine
    moves: Moves
    state: State

    def __post_init__(self) -> None:
        if tuple(self.moves.axes) != tuple(self.machine.axis_names):
            raise ValueError(f"motions of axes {self.moves.axes} on a machine with axes {self.machine.axis_names}")

    @cached_property
    def columns(self) -> Index:
        """(3,) the columns of X, Y and Z."""
        return linear_columns(self.machine)

    @cached_property
    def segments(self) -> Segments:
        """The programmed motions as lines and arcs of commands."""
        return Segments.of_moves(self.moves, self.columns)

    @cached_property
    def curved(self) -> Mask:
        """(n,) motions whose axes do not move linearly with the fraction: arcs, and motions under TCP."""
        return np.asarray((self.moves.kind == MotionKind.ARC) | self.moves.tcp, dtype=bool)

    def moving(self, rows: Index) -> Mask:
        """(k,) whether motions `rows` move an axis as programmed; others only take up a displacement at their start."""
        way = np.abs(picked(self.moves.end, rows) - picked(self.moves.start, rows))
        return some((way >= REST) & (way < np.inf)) | (self.moves.kind[rows] == MotionKind.ARC)

    @cached_property
    def wordless(self) -> Mask | None:
        """(n, n_axes) axes that must get no word in a motion, see `Moves.wordless`; None if there are none."""
        wordless = self.moves.wordless
        return wordless if wordless.any() else None

    @cached_property
    def idle(self) -> Mask | None:
        """(n, n_axes) axes that a correction leaves where they stand, see `Moves.idle`; None if there are none."""
        idle = self.moves.idle
        return idle if idle.any() else None

    @cached_property
    def mute(self) -> Mask | None:
        """(n, 3) which of X, Y and Z must get no word, see `wordless`; None if there are none."""
        mute = None if self.wordless is None else self.wordless[:, self.columns]
        return mute if mute is not None and mute.any() else None

    @cached_property
    def kinks(self) -> list[tuple[int, Array]]:
        """The axes (columns) with kinks or jumps of the error model, and their positions, ascending, mm and rad."""
        return list(self.machine.kinks)

    def joints(self, rows: Index, commands: Array) -> Array:
        """(k, n_axes) axis positions of commands (k, n_axes) of motions `rows` (k,); NaN if they cannot be reached."""
        moves = self.moves
        q, reached = reached_joints(self.machine, commands, moves.tcp[rows], moves.length_under_tcp[rows])
        return q if reached.all() else np.where(reached[:, None], q, np.nan)

    def joints_at(self, rows: Index, fraction: Array) -> Array:
        """(k, n_axes) programmed axis positions at fractions (k,) of motions `rows` (k,)."""
        if self._tcp and len(rows):
            if (fraction == 1).all():
                return picked(self.ends[1], rows)
            if (fraction == 0).all():
                return picked(self.ends[0], rows)
        return self.joints(rows, self.segments.at(rows, fraction))

    @cached_property
    def _tcp(self) -> bool:
        return bool(self.moves.tcp.any())

    @cached_property
    def ends(self) -> tuple[Array, Array]:
        """(n, n_axes) programmed axis positions at the starts, and at the ends, of motions."""
        return self.ends_of(np.arange(len(self.moves)), self.segments)

    def ends_of(self, rows: Index, segments: Segments) -> tuple[Array, Array]:
        """(k, n_axes) axis positions at the starts, and at the ends, of segments (k,); `rows` (k,): their motions."""
        with np.errstate(invalid="ignore"):
            start = segments.at(np.arange(len(rows)), np.zeros(len(rows)))
        return self.joints_of(rows, start, segments.end)

    def joints_of(self, rows: Index, start: Array, end: Array) -> tuple[Array, Array]:
        """(k, n_axes) axis positions at the starts, and at the ends, of motions `rows` (k,) or of pieces of them.

        start, end  (k, n_axes) commands. If a start equals the end before it, it is computed once only.
        """
        at_end = self.joints(rows, end)
        if not self.moves.tcp[rows].any():
            return start, at_end
        tcp, length = self.moves.tcp[rows], self.moves.length_under_tcp[rows]
        anew = np.ones(len(rows), dtype=bool)
        anew[1:] = ~(every(start[1:] == end[:-1]) & (tcp[1:] == tcp[:-1]) & (length[1:] == length[:-1]))
        others = np.flatnonzero(anew)
        at_start = np.empty_like(at_end)
        at_start[1:] = at_end[:-1]
        put(at_start, others, self.joints(rows[others], picked(start, others)))
        return at_start, at_end

    def tip(self, rows: Index, fraction: Array) -> Array:
        """(k, 3) the intended tool tip in the workpiece at fractions (k,) of motions `rows` (k,), mm."""
        return self.meant(rows, self.segments.at(rows, fraction))

    def meant(self, rows: Index, commands: Array) -> Array:
        """(k, 3) tip of a perfect machine in the workpiece under commands (k, n_axes) of motions `rows` (k,), mm."""
        tcp, beside = self.moves.tcp[rows], np.flatnonzero(self.moves.beside_tip[rows])
        if tcp.all() and not beside.size:
            return programmed_tip(self.machine, commands)
        tip: Array = self.machine.tip(commands, self.lengths(rows))
        if tcp.any():
            tip[tcp] = programmed_tip(self.machine, commands[tcp])
        if beside.size:
            on = rows[beside]
            tip[beside] = self.machine.tip(self.joints(on, commands[beside]), self.lengths(on))
        return tip

    def lengths(self, rows: Index) -> Array:
        """(k,) tool lengths of motions `rows`, mm; () if all are equal."""
        return common(self._lengths[rows])

    @cached_property
    def _lengths(self) -> Array:
        """(n,) tool lengths, mm; 0 for an unknown length on which no error depends."""
        lengths = self.moves.tool_length
        if self.machine.depends_on_tool_length:
            return lengths
        return np.where(np.isnan(lengths) & ~self.moves.tcp, 0.0, lengths)

    # -- direction of motion, and state -------------------------------------------------------------------------------

    @property
    def came(self) -> Signs | None:
        """(n, n_axes) direction in which each axis comes to the start of each motion; None as in `arrival`."""
        return None if self._directions is None else self._directions[0]

    @property
    def arrival(self) -> Signs | None:
        """(n, n_axes) direction in which each axis ends each motion; None if no error depends on it."""
        return None if self._directions is None else self._directions[1]

    @cached_property
    def _directions(self) -> tuple[Signs, Signs] | None:
        """(n, n_axes) the directions at the starts, and at the ends, of motions; None if no error depends on them."""
        if not matters(self.machine):
            return None
        lost = ~np.isfinite(self.moves.end - self.moves.start)
        ways = signs(self.moves.end - self.moves.start)
        bent = np.flatnonzero(self.curved)
        ways[bent] = self.heading(bent, np.ones(bent.size))
        between, holes = np.zeros_like(ways), np.flatnonzero(self.moves.kind == MotionKind.CYCLE)
        if holes.size:
            into, out_of = self._drilling(holes)
            ways[holes] = np.where(into != 0, into, ways[holes])
            between[holes] = out_of
        came = np.broadcast_to(np.asarray(self.state.direction, dtype=np.int8), ways.shape[1:])
        steps = np.stack((ways, between), axis=1).reshape(-1, ways.shape[1])
        unknown = np.stack((lost, np.zeros_like(lost)), axis=1).reshape(steps.shape)
        directions = carried(np.vstack((came[None], steps)), np.vstack((np.zeros_like(lost[:1]), unknown)))
        return directions[:-1:2], directions[1::2]

    def _drilling(self, holes: Index) -> tuple[Signs, Signs]:
        """(k, n_axes) direction of axes into holes (k,), and out of them again; 0 if not known."""
        moves, start, end = self.moves, *self.ends
        after = np.minimum(holes + 1, len(moves) - 1)
        same = (moves.tcp[after] == moves.tcp[holes]) & (moves.length_under_tcp[after] == moves.length_under_tcp[holes])
        back = np.where((same & (after > holes))[:, None], signs(start[after] - end[holes]), 0)
        level = self.joints(holes, moves.approach[holes])
        return np.where(np.isfinite(level), signs(end[holes] - level), -back).astype(np.int8), back

    def heading(self, rows: Index, fraction: Array) -> Signs:
        """(k, n_axes) direction of axes at fractions (k,) of curved motions; at a turning point, that before it.

        0 if an axis has not moved for a thousandth of the motion.
        """
        after = self.joints_at(rows, np.minimum(fraction + INSTANT / 2, 1.0))
        now = signs(after - self.joints_at(rows, np.maximum(fraction - INSTANT / 2, 0.0)), NOISE)
        lately = signs(after - self.joints_at(rows, np.maximum(fraction - WHILE, 0.0)), NOISE)
        return np.where(now != 0, now, lately)

    def direction(self, rows: Index, fraction: Array) -> Signs:
        """(k, n_axes) direction of each axis at fractions of motions; zeros (n_axes,) if no error depends on it."""
        if self._directions is None:
            return np.zeros(len(self.machine.axes), dtype=np.int8)
        came, arrival = self._directions
        result = arrival[rows]
        inside = np.flatnonzero(self.curved[rows] & (fraction < 1))
        if inside.size:
            now = self.heading(rows[inside], fraction[inside])
            result[inside] = np.where(now != 0, now, came[rows[inside]])
        return result

    def states(self, rows: Index, fraction: Array) -> State:
        """The state at fractions (k,) of motions `rows` (k,)."""
        inputs = rows_of(State(inputs=self.state.inputs), rows).inputs
        return State(self.lengths(rows), self.direction(rows, fraction), inputs)

    # -- the real machine ---------------------------------------------------------------------------------------------

    def gap(self, rows: Index, fraction: Array, commands: Array) -> Array:
        """(k, 3) actual tip of the real machine under `commands` minus intended tip at the fractions, mm."""
        q, programmed = self.joints(rows, commands), self.segments.at(rows, fraction)
        return self.gaps(rows, programmed, [q], self.states(rows, fraction))[0]

    def gaps(self, rows: Index, programmed: Array, done: Sequence[Array], states: State) -> list[Array]:
        """For each of `done`: (k, 3) actual tip with the axes there minus intended tip, mm.

        programmed  (k, n_axes) programmed commands of motions `rows` (k,), for the intended tip
        done        (k, n_axes) axis positions each
        """
        tip = self.meant(rows, programmed) if self.moves.tcp[rows].any() else None
        return self.machine.gaps(programmed, done, states, tip)

    def follows(self, rows: Index, commands: Array) -> Array:
        """(k or 1, 3, 3) derivative of the tip by X Y Z of commands (k, n_axes) of motions `rows`, mm per mm.

        One matrix is valid for all if the rotary axes stand alike, or have no effect on it.
        """
        turning = commands.copy()
        turning[:, self.columns] = 0.0
        turning[self.moves.tcp[rows]] = 0.0
        alike = len(rows) > 0 and bool((turning == turning[0]).all())
        return regular(tip_maps(self.machine, turning[:1] if alike else turning))[0]

    def aimed(self, rows: Index, fraction: Array, commands: Array) -> tuple[Array, Mask]:
        """Commands (k, n_axes) that bring the tip of the real machine to the intended one at the fractions (k,).

        Only X Y Z of `commands` are changed. Also (k,) whether the tip has arrived there.
        """
        moves = self.moves
        begin, target = self.joints(rows, commands), self.tip(rows, fraction)
        q, arrived = steer(self.machine, begin, target, self.states(rows, fraction))
        return commands_from_joints(self.machine, q, moves.tcp[rows], moves.length_under_tcp[rows]), arrived

    def guessed(self, real: Segments, rows: Index, fraction: Array) -> Array:
        """(k, n_axes) nearly corrected commands at fractions of motions, see `improved`; rotary axes as in `real`."""
        return self.improved(rows, fraction, self.segments.at(rows, fraction), real.linearly(rows, fraction))

    def improved(self, rows: Index, fraction: Array, programmed: Array, commands: Array) -> Array:
        """(k, n_axes) nearly corrected commands at fractions of motions, where the program commands `programmed`.

        X Y Z are found by one Newton step from those of the program, rotary axes are those of `commands`. The result is
        accurate to the errors times their gradient, some tens of nanometres. X Y Z of `commands` are overwritten.
        """
        commands[:, self.columns] = programmed[:, self.columns]
        gap = self.gaps(rows, programmed, [self.joints(rows, commands)], self.states(rows, fraction))[0]
        commands[:, self.columns] -= solve(self.follows(rows, commands), gap)
        return commands


SQUARE = 1 - 1e-9
"""Least component of a unit normal along an axis that is square to the plane."""


def stays(moves: Moves, unchanged: Mask, shift: Array, before: Array | None) -> Mask:
    """(n, n_axes) idle axes of corrected motions, which stay where they stand although a correction would move them.

    shift   (n, n_axes) wanted corrections, mm and rad
    before  (n_axes,) displacement of the axes at the start of the first motion; None: zero
    """
    moving = (shift != 0).any(axis=0)
    if before is not None:
        moving |= before != 0
    return moves.idle & ~unchanged[:, None] & moving


def left_in_cuts(moves: Moves) -> dict[str, Index]:
    """Letter of a linear axis -> the motions that cut and are corrected, but not along this axis (it gets no word)."""
    lacking = moves.wordless & (moves.cutting & (moves.rule == Rule.CORRECT))[:, None]
    columns = np.flatnonzero(lacking.any(axis=0) & ~moves.rotary)
    return {moves.axes[column]: np.flatnonzero(lacking[:, column]) for column in columns}


def crooked(intent: Intent) -> Mask:
    """(n,) arcs with an axis in their plane that must get no word, so that they cannot be split."""
    arcs = intent.segments.arc
    if intent.mute is None or not arcs.any():
        return np.zeros(len(arcs), dtype=bool)
    in_plane = np.abs(intent.moves.normal) < SQUARE
    return arcs & (in_plane & intent.mute).any(axis=1)


def lacking(intent: Intent, rows: Index) -> Index:
    """(j,) the indices in `rows` (k,) of motions in which X, Y or Z must get no word."""
    return np.flatnonzero(intent.mute[rows].any(axis=1)) if intent.mute is not None else np.zeros(0, dtype=np.intp)


def correctable(intent: Intent, rows: Index, commands: Array, gap: Array) -> Array:
    """(k, 3) the part of a gap between tips, mm, that can be corrected: without that along axes that get no word.

    rows, commands  (k,) the motions, and (k, n_axes) their commands at the gap
    """
    on = lacking(intent, rows)
    if not on.size:
        return gap
    assert intent.mute is not None
    follows = intent.follows(rows[on], commands[on])
    ways = solve(follows, gap[on])
    result = gap.copy()
    result[on] = np.einsum("kij,kj->ki", follows, np.where(intent.mute[rows[on]], 0.0, ways))
    return result
