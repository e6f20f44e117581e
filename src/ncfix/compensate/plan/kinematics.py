"""Commands and axis positions with tool-centre-point control (TCP), and axis positions that bring the tip to a point.

Without TCP a command is the axis positions. With it, X Y Z of a command define the place of the tool tip in the
workpiece: the tip would be there if the linear axes had these values, the rotary axes stood at zero, and the tool had
no length. (So with all rotary axes at zero, X Y Z mean the same with and without TCP.) The control finds the linear
axis positions that bring the tip there with the rotary axes at their commanded positions. While nothing else moves, the
tip is a linear function of X Y Z, so three linear equations are solved. On a machine with errors, `steer` finds the
positions by Newton's method on the exact model.

Directions of motion are those of the program on a perfect machine: the sign of each axis's motion or, for an axis at
rest, its last direction. Corrections move axes to and fro by micrometres; an axis that rests in the program is assumed
to stay on the same side of its play.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ncfix.arrays import Array, Index, Mask, Signs
from ncfix.compensate.plan.findings import pose_error
from ncfix.diagnostics import RefusedError
from ncfix.machine import Machine, State
from ncfix.machine.aim import FLAT
from ncfix.machine.steps import dot, volume
from ncfix.values import frozen

REST = 1e-9
"""Motion, mm or rad, below which an axis counts as at rest."""


def matters(machine: Machine) -> bool:
    """Whether any error depends on the direction of motion."""
    return machine.depends_on_direction


def signs(motion: Array, rest: float = REST) -> Signs:
    """(n, n_axes) the direction of motions (n, n_axes), mm and rad: -1, 1, or 0 if below `rest` or not known."""
    known = np.where(np.isfinite(motion), motion, 0.0)
    return np.where(np.abs(known) < rest, 0, np.sign(known)).astype(np.int8)


def carried(directions: Signs, lost: Mask | None = None) -> Signs:
    """(n, n_axes) the last non-zero direction of each axis up to each row; 0 before its first motion.

    lost  (n, n_axes) rows from which on a direction is not known any more: 0 until the next motion
    """
    rows, moved = np.arange(len(directions))[:, None], directions != 0
    last = np.maximum.accumulate(np.where(moved if lost is None else moved | lost, rows, 0), axis=0)
    return np.take_along_axis(directions, last, axis=0)


SPATIAL = ("X", "Y", "Z")


def linear_columns(machine: Machine) -> Index:
    """The columns of X, Y and Z, in this order. Raises `RefusedError` NCF401 if one of them is not a linear axis."""
    names, rotary = machine.axis_names, machine.rotary
    columns = [names.index(name) for name in SPATIAL if name in names and not rotary[names.index(name)]]
    if len(columns) != len(SPATIAL):
        raise RefusedError.of(
            "NCF401",
            f"machine {machine.name!r} does not have the three linear axes X, Y and Z, so its tool tip cannot be "
            "corrected",
            hint=f"its axes are {', '.join(names)}",
        )
    return np.array(columns, dtype=np.intp)


def affine_tip(machine: Machine, q: Array, tool_length: ArrayLike = 0.0) -> tuple[Array, Array]:
    """The tip as a function of X Y Z, with all other axes as in q (n, n_axes): tip = map @ xyz + offset.

    Returns map (n or 1, 3, 3), mm per mm, and offset (n or 1, 3), mm, in the workpiece frame. One row is valid for all
    if all poses agree in everything but X Y Z.
    """
    columns = linear_columns(machine)
    still = q.copy()
    still[:, columns] = 0.0
    length = np.asarray(tool_length, dtype=np.float64)
    if len(q) > 1 and length.ndim == 0 and (still == still[0]).all():
        still = still[:1]
    return tip_maps(machine, still), machine.tip(still, length)


def tip_maps(machine: Machine, q: Array) -> Array:
    """(n, 3, 3) derivative of the tip by X Y Z at axis positions (n, n_axes), mm per mm, workpiece frame."""
    return machine.follows(q, tuple(linear_columns(machine).tolist()))


def solve(maps: Array, tips: Array) -> Array:
    """(n, 3) the motion of X, Y and Z that moves the tip by `tips` (n, 3), mm; `maps` (n or 1, 3, 3) of `tip_maps`."""
    with np.errstate(all="ignore"):
        whole, *normals = volume(*np.moveaxis(maps, 0, -1).swapaxes(0, 1))
        share = 1 / whole
        return np.stack([dot(normal, tips.T) * share for normal in normals], axis=-1)


def regular(maps: Array) -> tuple[Array, Mask]:
    """The maps, with singular ones replaced by the identity, and (n or 1,) which were invertible."""
    with np.errstate(invalid="ignore"):
        fine = np.asarray(~(np.abs(volume(*np.moveaxis(maps, 0, -1).swapaxes(0, 1))[0]) < FLAT))
    usable: Array = maps if fine.all() else np.where(fine[:, None, None], maps, np.eye(3))
    return usable, fine


def joints_from_commands(machine: Machine, commands: Array, tcp: Mask, tool_length: ArrayLike) -> Array:
    """(n, n_axes) the axis positions to which the control of a perfect machine moves by these commands.

    commands     (n, n_axes) mm and rad
    tcp          (n,) whether X Y Z are tool-tip coordinates in the workpiece
    tool_length  (n,) or () mm, spindle reference to tip

    Raises `PoseError` NCF402 if the linear axes cannot bring the tip to a point.
    """
    q, reached = reached_joints(machine, commands, tcp, tool_length)
    if not reached.all():
        text = "with the rotary axes at these angles the linear axes cannot move the tool tip to the commanded point"
        raise pose_error("NCF402", text, ~reached, "two linear axes are parallel in the workpiece at this pose")
    return q


def reached_joints(machine: Machine, commands: Array, tcp: Mask, tool_length: ArrayLike) -> tuple[Array, Mask]:
    """Like `joints_from_commands`, but returns a mask (n,) of the rows that can be reached instead of raising."""
    reached = np.ones(len(commands), dtype=bool)
    if not tcp.any():
        return commands, reached
    q, columns = commands.copy(), linear_columns(machine)
    rows = np.flatnonzero(tcp)
    chosen = commands if len(rows) == len(commands) else commands[rows]
    wanted, length = programmed_tip(machine, chosen), _of_rows(tool_length, rows)
    if moves_as_one(machine):
        x, y, z = columns.tolist()
        q[rows[:, None], columns] = machine.xyz_for_tip(chosen, (x, y, z), wanted, length)
        return q, reached
    maps, offset = affine_tip(machine, chosen, length)
    maps, fine = regular(maps)
    q[rows[:, None], columns] = solve(maps, wanted - offset)
    reached[rows] = fine
    return q, reached


def moves_as_one(machine: Machine) -> bool:
    """Whether rotary axes carry all of X, Y and Z together or none, so that they reach every point in every pose."""
    ways = machine.linear_ways
    return ways is not None and not abs(volume(*ways.T)[0]) < FLAT


def commands_from_joints(machine: Machine, q: Array, tcp: Mask, tool_length: ArrayLike) -> Array:
    """(n, n_axes) the commands that lead to axis positions q (n, n_axes): the inverse of `joints_from_commands`."""
    if not tcp.any():
        return q
    commands, columns = q.copy(), linear_columns(machine)
    rows = np.flatnonzero(tcp)
    chosen = q if len(rows) == len(q) else q[rows]
    tip = machine.tip(chosen, _of_rows(tool_length, rows))
    if moves_as_one(machine):
        others = ~machine.rotary
        others[columns] = False
        tip_of_others = _tip_by_linear_axes(machine, chosen, np.flatnonzero(others))
        maps, offset = machine.at_zero[1][None, columns].swapaxes(1, 2), tip_of_others
    else:
        maps, offset = affine_tip(machine, _rotary_at_zero(machine, chosen))
    commands[rows[:, None], columns] = solve(regular(maps)[0], tip - offset)
    return commands


def programmed_tip(machine: Machine, commands: Array) -> Array:
    """(n, 3) the tip in the workpiece that commands (n, n_axes) with tool-centre-point control mean, mm."""
    if moves_as_one(machine):
        return _tip_by_linear_axes(machine, commands, np.flatnonzero(~machine.rotary))
    maps, offset = affine_tip(machine, _rotary_at_zero(machine, commands))
    return (maps @ commands[:, linear_columns(machine), None])[..., 0] + offset


def _tip_by_linear_axes(machine: Machine, q: Array, axes: Index) -> Array:
    """(n, 3) the tip with linear axes `axes` at q (n, n_axes) and all other axes at zero, mm; summed axis by axis."""
    offset, ways = machine.at_zero
    tip = np.empty((3, len(q)))
    tip[:] = offset[:, None]
    for axis in axes.tolist():
        for row, way in zip(tip, ways[axis].tolist(), strict=True):
            if way:
                row += way * q[:, axis]
    return np.ascontiguousarray(tip.T)


def _rotary_at_zero(machine: Machine, q: Array) -> Array:
    return np.where(machine.rotary, 0.0, q)


def _of_rows(tool_length: ArrayLike, rows: Index) -> Array:
    length = np.asarray(tool_length, dtype=np.float64)
    if length.ndim == 0:
        return length
    return common(length[rows])


def common(values: Array) -> Array:
    """One value, shape (), for values (k,) that are all equal, so that it is used once; else the values unchanged."""
    if len(values) and (values == values[0]).all():
        return np.asarray(values[0])
    return values


@frozen
class Correction:
    """Corrected axis positions.

    q          (n, n_axes) the positions to command, mm and rad
    converged  (n,) the tip is where it should be, to 1 nm
    oriented   (n,) the tool orientation is corrected too, without damping or limits
    before     (n,) tip error without a correction, mm; None if not computed
    """

    q: Array
    converged: Mask
    oriented: Mask
    before: Array | None = None


def rows_of(state: State, rows: Index | slice) -> State:
    """The state of rows `rows`. Values that are common to all rows are kept."""
    inputs = {name: _rows(np.asarray(values), rows, 0) for name, values in state.inputs.items()}
    length = _rows(np.asarray(state.tool_length, dtype=np.float64), rows, 0)
    return State(length, _rows(np.asarray(state.direction), rows, 1), inputs)


def _rows(values: Array, rows: Index | slice, trailing: int) -> Array:
    return values[rows] if values.ndim > trailing else values


def moved(q: Array, columns: Index, step: Array) -> Array:
    """Axis positions (n, n_axes) with `step` (n, 3), mm, added to X Y Z."""
    result = q.copy()
    result[:, columns] += step
    return result


def steer(machine: Machine, q: Array, target: Array | None, state: State) -> tuple[Array, Mask]:
    """Axis positions at which the tip of the erroneous machine is at `target`; only X Y Z are changed.

    q       (n, n_axes) positions to begin with
    target  (n, 3) tool tip in the workpiece frame, mm; None: that of a perfect machine at q

    Also (n,) which have arrived, within 1 nm. See `Machine.aim`.
    """
    found = steered(machine, q, target, state)
    return found.q, found.converged


def steered(machine: Machine, q: Array, target: Array | None, state: State) -> Correction:
    """Like `steer`, as a `Correction`: `before` is the tip error at q, that of the program if q is its pose."""
    columns = linear_columns(machine)
    x, y, z = columns.tolist()
    aim = machine.aim(q, (x, y, z), state, target)
    result = q.copy()
    result[:, columns] = aim.place
    return Correction(result, aim.arrived, np.zeros(len(q), dtype=bool), aim.off)
