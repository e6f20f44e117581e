"""A machine as Heidenhain's KinematicsComp describes it: rows of the kinematics table, and tables of each axis.

The six errors of an axis over its position, location errors included, are given at a point of the axis that stays where
it is, since they stand before the axis in the chain: what was measured at a point that rides along gets the lever that
it has gained.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ncfix.machine import Axis, Machine, State
from ncfix.tables.axis_tables import nodes_needed
from ncfix.tables.correction import even_poses
from ncfix.tables.grid import Array, projector
from ncfix.tables.table_files import DEGREE
from ncfix_heidenhain.chain import LETTERS, Row

FINE = 361
OTHERS = 16
"""Poses of the other axes that are averaged over, for errors that depend on them."""
REACH = 1000.0
"""mm: the lever with which an angle may act."""
NOTHING = 1e-9


@dataclass(frozen=True, slots=True)
class Component:
    """The errors of an axis in its own frame: what stands before it in the chain, and what is looked up by itself.

    nodes   (n,) mm or rad
    values  (n, 6) mm and rad, without a rotary axis's own angle
    own     (n,) a rotary axis's own angle; of a linear axis, what its way changes: both while it moves towards plus
    back    (n,) the same while it moves towards minus
    """

    axis: str
    nodes: Array
    values: Array
    own: Array
    back: Array

    def used(self, column: int) -> bool:
        """Whether there is anything in a column."""
        return bool(np.abs(self.values[:, column]).max() > NOTHING)


def sides(machine: Machine) -> tuple[tuple[Axis, ...], tuple[Axis, ...]]:
    """The axes of the head from the base to the tool, and those of the table from the base to the workpiece."""
    table = [axis for axis in machine.axes if axis.workpiece_side]
    return tuple(axis for axis in machine.axes if not axis.workpiece_side), tuple(reversed(table))


def tilt(axis: Axis) -> Array:
    """Columns: the frame in which the axis is the coordinate axis of its letter, right way round, (3, 3)."""
    wanted = np.asarray(axis.direction) * (-1.0 if axis.workpiece_side else 1.0)
    index = LETTERS.index(axis.name) % 3
    letter = np.eye(3)[index]
    if np.allclose(wanted, letter, atol=1e-12):
        return np.eye(3)
    about = np.cross(letter, wanted)
    sine, cosine = float(np.linalg.norm(about)), float(letter @ wanted)
    if sine < 1e-12:
        return np.diag([1.0 if i == (index + 1) % 3 else -1.0 for i in range(3)])
    x, y, z = about / sine
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    found: Array = np.eye(3) + sine * cross + (1 - cosine) * cross @ cross
    return found


def angles(frame: Array) -> tuple[float, float, float]:
    """A frame as turns about X, then the new Y, then the new Z, degree."""
    b = float(np.arcsin(np.clip(frame[0, 2], -1.0, 1.0)))
    a = float(np.arctan2(-frame[1, 2], frame[2, 2]))
    c = float(np.arctan2(-frame[0, 1], frame[0, 0]))
    return a / DEGREE, b / DEGREE, c / DEGREE


def component(
    machine: Machine, space: Array, axis: int, most: int, target: float, play: bool
) -> tuple[Component, bool]:
    """The errors of one axis, and whether other axes matter to them, over which is averaged; `play`: ways apart."""
    described = machine.axes[axis]
    low, high = space[axis].tolist()
    fine = np.linspace(low, high, FINE)
    q = np.repeat(even_poses(space, OTHERS)[None], FINE, axis=0)
    q[:, :, axis] = fine[:, None]
    flat = q.reshape(-1, len(space))
    ways = [np.eye(len(space))[axis] * way for way in (1.0, -1.0)]
    both = [machine.joint_errors(flat, State(direction=way))[..., axis, :].reshape(FINE, OTHERS, 6) for way in ways]
    depends = bool(max(np.ptp(twist, axis=1).max() for twist in both) > NOTHING)
    ahead, back = (_in_frame(described, fine, twist.mean(axis=1)) for twist in both)
    curve = (ahead + back) / 2
    index = LETTERS.index(described.name)
    sense = -1.0 if described.workpiece_side else 1.0
    own = sense * (ahead - back)[:, index] / 2 if play else np.zeros(FINE)
    turned = np.zeros(FINE)
    if described.rotary:
        turned, curve[:, index] = sense * curve[:, index], 0.0
    lever = np.array([1.0] * 3 + [REACH] * 3) * 8
    parts = np.concatenate([curve * lever, np.stack([turned + own, turned - own], axis=1) * lever[index]], axis=1)
    count = max(nodes_needed(fine, part, most, target) for part in parts.T)
    step = round((high - low) / described.unit / (count - 1), 4)
    nodes = (round(low / described.unit, 4) + step * np.arange(count)) * described.unit
    fit = projector(fine, nodes)
    return Component(described.name, nodes, fit @ curve, fit @ (turned + own), fit @ (turned - own)), depends


def _in_frame(axis: Axis, positions: Array, twist: Array) -> Array:
    """The twist at the point of the axis, in the frame in which it is a coordinate axis, (n, 6)."""
    motion = axis.motion(positions)
    triad = np.asarray(axis.error_axes)
    velocity, turned = twist[:, :3] @ triad, twist[:, 3:] @ triad
    if axis.moving_frame:
        velocity, turned = (np.einsum("nij,nj->ni", motion[:, :3, :3], part) for part in (velocity, turned))
    point = np.asarray(axis.reference)
    carried = motion[:, :3, :3] @ point + motion[:, :3, 3]
    velocity = velocity + np.cross(turned, point - carried)
    frame = tilt(axis)
    found: Array = np.concatenate([velocity @ frame, turned @ frame], axis=1)
    return found


def rows(machine: Machine, components: Sequence[Component], angle: float, sense: float) -> tuple[Row, ...]:
    """The kinematics table: the head, the gauge line with the errors of the spindle, `MachBase`, the table.

    angle is rad per unit of an angle under COMPTAB, sense what errors are multiplied by there.
    """
    by_axis = {each.axis: each for each in components}
    head, table = sides(machine)
    place = np.zeros(3)
    found: list[Row] = []
    for axis in head:
        found += _joint(axis, by_axis[axis.name], np.asarray(axis.reference) - place)
        place = np.asarray(axis.reference)
    found += _spindle(machine, np.asarray(machine.tool.point) - place, angle, sense)
    found.append(Row("MachBase"))
    place = np.zeros(3)
    for axis in table:
        found += _joint(axis, by_axis[axis.name], np.asarray(axis.reference) - place)
        place = np.asarray(axis.reference)
    return tuple(found)


def _joint(axis: Axis, errors: Component, way: Array) -> Iterator[Row]:
    frame = tilt(axis)
    straight = np.allclose(frame, np.eye(3))
    names = [(axis.name, f"C{i + 1}") if errors.used(i) else None for i in range(6)]
    if straight:
        yield from _trans("XYZ", way.tolist(), names[:3])
    else:
        yield from _trans("XYZ", way.tolist(), [None] * 3)
        yield from _trans("ABC", angles(frame), [None] * 3)
        yield from _trans("XYZ", [0.0] * 3, names[:3])
    yield from _trans("ABC", [0.0] * 3, names[3:])
    yield Row("MachAxis", axis.name)
    if not straight:
        yield from _trans("ABC", angles(frame.T), [None] * 3)


def _spindle(machine: Machine, way: Array, angle: float, sense: float) -> Iterator[Row]:
    zero = np.zeros(len(machine.axes))
    twist = sense * machine.joint_errors(zero, State())[-1]
    fixed = [value if abs(value) > NOTHING else None for value in (*twist[:3].tolist(), *(twist[3:] / angle).tolist())]
    yield from _trans("XYZ", way.tolist(), fixed[:3])
    yield from _trans("ABC", [0.0] * 3, fixed[3:])
    tool = Axis("Z", False, False, machine.tool.direction)
    yield from _trans("ABC", angles(tilt(tool)), [None] * 3)


def _trans(letters: str, coords: Sequence[float], errors: Sequence[float | tuple[str, str] | None]) -> Iterator[Row]:
    for letter, coord, error in zip(letters, coords, errors, strict=True):
        some = abs(coord) > NOTHING
        if some or error is not None:
            yield Row("Trans", letter, coord if some else None, error)
