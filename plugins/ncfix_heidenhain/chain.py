"""The kinematics table of the iTNC 530 with KinematicsComp: written for a machine, read, and evaluated as by a control.

A row `Trans` shifts or turns by COORD plus an error under COMPTAB. The error is a number, or a column of an axis table:
`A..C2` is column C2 in the table of axis A. A row `MachAxis` moves by the position of its axis. The chain runs from the
machine base along the head to the gauge line, then, after `MachBase`, from the base along the table to the workpiece
(KINE-1). The errors of an axis stand before the axis.

The table takes the six errors of an axis, its location errors included, as functions of its position. Because they
stand before the axis in the chain, they count at a fixed point of the axis. The machine gives them at a point that
moves with the axis, so each angular error, times the way which that point has moved, is added to the position errors.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ncfix.arrays import Array
from ncfix.machine import Axis, Machine, State
from ncfix.tables.axis_tables import nodes_needed
from ncfix.tables.compensation import Compensation, Term
from ncfix.tables.correction import even_poses, poses_along, steps_towards
from ncfix.tables.grid import Grid, projector
from ncfix.tables.table_files import DEGREE, TURNING, Remarks, unit_of
from ncfix.values import frozen
from ncfix_heidenhain.table_files import TableColumn, TextTable, cell_number, read_table

KEYS = ("Trans", "MachAxis", "MachBase")
COLUMNS = (("NR", 3), ("DOC", 4), ("KEY", 9), ("AXIS", 5), ("COORD", 16), ("COMPTAB", 7))
MAX_ROWS = 50
"""The most rows Trans and MachAxis together."""
MAX_COORDS = 50
"""The most entries under COORD."""

MAX_ERRORS = 100
"""The most entries under COMPTAB and rows MachAxis together."""

LETTERS = "XYZABC"
SAMPLES = 361
"""Positions along an axis at which its errors are evaluated before nodes are chosen."""

OTHER_POSES = 16
"""Poses of the other axes over which errors that depend on them are averaged."""

MAX_LEVER_MM = 1000.0
"""The lever with which an angular error is taken to act when nodes are chosen for a target in mm."""

NEGLIGIBLE = 1e-9
"""Errors, shifts and turns up to this (mm, rad or degree) are not written."""


@frozen
class ChainRow:
    """A row of the kinematics table.

    key    `Trans`, `MachAxis` or `MachBase`
    axis   letter of the axis that moves, or along or about which `Trans` acts
    coord  COORD, mm or degree; None where the cell is empty
    error  COMPTAB: a number, or (axis, column) of an axis table; None where the cell is empty
    """

    key: str
    axis: str = ""
    coord: float | None = None
    error: float | tuple[str, str] | None = None


@frozen
class ErrorChain:
    """The corrections that the control works out from a kinematics table and the axis tables that it names.

    rows        the rows of the kinematics table
    sense       1 if entries under COMPTAB are errors of the machine, -1 if they are corrections
    angle       rad per unit of an angle under COMPTAB
    components  (axis, column) -> the values by the position of that axis, mm or units of angle
    own         corrections of axes by their own positions
    length      length of the tool, mm
    """

    rows: tuple[ChainRow, ...]
    sense: float
    angle: float
    components: Mapping[tuple[str, str], Grid]
    own: tuple[Term, ...]
    length: float = 0.0

    def for_tool(self, length: float) -> ErrorChain:
        """The chain with a tool of this length; the control knows the length of the tool in the spindle."""
        return ErrorChain(self.rows, self.sense, self.angle, self.components, self.own, length)

    @property
    def grids(self) -> tuple[Grid, ...]:
        """All grids: those of the error components, and those of the axes' own corrections."""
        return (*self.components.values(), *Compensation(self.own).grids)

    @property
    def axes(self) -> frozenset[str]:
        """The axes that the chain moves."""
        return frozenset(row.axis for row in self.rows if row.key == "MachAxis")

    @property
    def points(self) -> int:
        """The number of points of all grids together."""
        return sum(grid.points for grid in self.grids)

    def at(self, names: Sequence[str], q: Array, direction: Array | None = None) -> Array:
        """See `Tables.at`: own corrections for all axes; linear axes also move the tip to its nominal place."""
        correction = Compensation(self.own).at(names, q, direction)
        linear = [index for index, name in enumerate(names) if name in "XYZ" and name in self.axes]
        nominal = self.tip(names, q, False)
        jacobian = np.stack([self.tip(names, q + np.eye(q.shape[1])[i], False) - nominal for i in linear], axis=-1)
        moved = q.copy()
        for _ in range(2):
            gap = nominal - self.tip(names, moved, True)
            moved[:, linear] += steps_towards(gap, jacobian)
        correction[:, linear] += (moved - q)[:, linear]
        return correction

    def tip(self, names: Sequence[str], q: Array, wrong: bool) -> Array:
        """The tip in the workpiece's coordinates, (n, 3) mm; `wrong`: with the errors of the machine."""
        points = np.tile([0.0, 0.0, -self.length], (len(q), 1))
        base = next((i for i, row in enumerate(self.rows) if row.key == "MachBase"), len(self.rows))
        for row in reversed(self.rows[:base]):
            points = _acted(points, row.axis, self._value(row, names, q, wrong, 1.0))
        for row in self.rows[base + 1 :]:
            points = _acted(points, row.axis, -self._value(row, names, q, wrong, -1.0))
        return points

    def _value(self, row: ChainRow, names: Sequence[str], q: Array, wrong: bool, way: float) -> Array:
        if row.key == "MachAxis":
            return way * q[:, names.index(row.axis)]
        value: Array = np.full(len(q), (row.coord or 0.0) * unit_of(row.axis))
        if not wrong or row.error is None:
            return value
        unit = self.sense * (self.angle if row.axis in TURNING else 1.0)
        if not isinstance(row.error, tuple):
            return value + unit * row.error
        grid = self.components[row.error]
        return value + unit * grid.at(q[:, [names.index(grid.inputs[0])]])[:, 0]


def _acted(points: Array, axis: str, value: Array) -> Array:
    """Points shifted along X, Y or Z by a value in mm, or turned about A, B or C by one in rad."""
    moved = points.copy()
    index = LETTERS.index(axis)
    if index < 3:
        moved[:, index] += value
        return moved
    i, j = (index - 2) % 3, (index - 1) % 3
    cosine, sine = np.cos(value), np.sin(value)
    moved[:, i] = cosine * points[:, i] - sine * points[:, j]
    moved[:, j] = sine * points[:, i] + cosine * points[:, j]
    return moved


def kinematics_text(rows: Sequence[ChainRow]) -> bytes:
    """The text of the kinematics table."""
    table = []
    for n, row in enumerate(rows):
        coord = "" if row.coord is None else f"{round(row.coord, 9) + 0.0:.9g}"
        error = "" if row.error is None else row.error if isinstance(row.error, tuple) else (f"{row.error:.7f}",)
        table.append((str(n), "", row.key, row.axis, coord, "..".join(error)))
    return TextTable("", tuple(TableColumn(*each) for each in COLUMNS), tuple(table), padded=False).text()


def over_limits(rows: Sequence[ChainRow]) -> Iterator[str]:
    """One phrase for each limit of the control that a kinematics table exceeds."""
    axes = sum(row.key == "MachAxis" for row in rows)
    chain = axes + sum(row.key == "Trans" for row in rows)
    coords = sum(row.coord is not None for row in rows)
    errors = sum(row.error is not None for row in rows)
    if chain > MAX_ROWS:
        yield f"{chain} rows Trans and MachAxis, but the control takes {MAX_ROWS}"
    if coords > MAX_COORDS:
        yield f"{coords} entries under COORD, but the control takes {MAX_COORDS}"
    if errors > MAX_ERRORS - axes:
        yield f"{errors} entries under COMPTAB, but the control takes {MAX_ERRORS - axes} with {axes} axes"


def read_rows(remarks: Remarks, content: bytes) -> tuple[ChainRow, ...]:
    """The rows of a kinematics table; faults become remarks. Empty if the file is no such table."""
    table = read_table(remarks, content)
    if table is None:
        return ()
    names = [column.name for column in table.columns]
    missing = [name for name, _ in COLUMNS if name not in names]
    if missing:
        remarks.refuse(1, f"the columns {', '.join(missing)} are missing")
        return ()
    if not table.ended:
        remarks.refuse(len(remarks.rows), "[END] is missing: the file may have been cut short")
    cells = (table.cells(name) for name in ("NR", "KEY", "AXIS", "COORD", "COMPTAB"))
    rows = tuple(_row(remarks, n, line, *each) for n, (line, *each) in enumerate(zip(table.lines, *cells, strict=True)))
    for text in over_limits(rows):
        remarks.refuse(0, text)
    if sum(row.key == "MachBase" for row in rows) != 1:
        remarks.refuse(0, "exactly one row MachBase is needed")
    moved = [row.axis for row in rows if row.key == "MachAxis"]
    if len(set(moved)) != len(moved):
        remarks.refuse(0, "an axis appears twice")
    return rows


def _row(remarks: Remarks, expected: int, line: int, nr: str, key: str, axis: str, coord: str, error: str) -> ChainRow:
    if nr != str(expected):
        remarks.refuse(line, f"row {nr or 'without a number'} instead of row {expected}")
    if key not in KEYS:
        remarks.refuse(line, f"{key!r} is not a key", ", ".join(KEYS))
    if key != "MachBase" and (len(axis) != 1 or axis not in LETTERS):
        remarks.refuse(line, f"{axis!r} is not an axis")
        axis = "X"
    if key != "Trans" and (coord or error):
        remarks.refuse(line, f"{key} takes neither COORD nor COMPTAB")
    found: float | tuple[str, str] | None = None
    if ".." in error:
        name, _, column = error.partition("..")
        found = (name, column)
    elif error:
        found = cell_number(remarks, line, error, "COMPTAB")
    return ChainRow(key, axis, cell_number(remarks, line, coord, "COORD") if coord else None, found)


@frozen
class AxisErrors:
    """The errors of an axis in its own frame: six components before it in the chain, and its own error.

    The own error is the positioning error of a rotary axis, plus, for any axis, the half of its play.

    nodes   (n,) positions of the axis, mm or rad
    values  (n, 6) components C1 to C6, mm and rad; a rotary axis's positioning error is zero here
    own     (n,) the own error while the axis moves towards plus, mm or rad
    back    (n,) the own error while the axis moves towards minus, mm or rad
    """

    axis: str
    nodes: Array
    values: Array
    own: Array
    back: Array

    def used(self, column: int) -> bool:
        """Whether a component (0 to 5) is other than zero anywhere."""
        return bool(np.abs(self.values[:, column]).max() > NEGLIGIBLE)


def sides(machine: Machine) -> tuple[tuple[Axis, ...], tuple[Axis, ...]]:
    """The axes of the head, from the base to the tool, and those of the table, from the base to the workpiece."""
    table = [axis for axis in machine.axes if axis.workpiece_side]
    return tuple(axis for axis in machine.axes if not axis.workpiece_side), tuple(reversed(table))


def tilt(axis: Axis) -> Array:
    """A frame (3, 3) in which the axis points along the coordinate axis of its letter; its columns are the directions.

    A table axis moves the workpiece, so its direction is reversed first.
    """
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
    return np.eye(3) + sine * cross + (1 - cosine) * cross @ cross


def angles(frame: Array) -> tuple[float, float, float]:
    """The turns about X, then the new Y, then the new Z that make a frame, degree."""
    b = float(np.arcsin(np.clip(frame[0, 2], -1.0, 1.0)))
    a = float(np.arctan2(-frame[1, 2], frame[2, 2]))
    c = float(np.arctan2(-frame[0, 1], frame[0, 0]))
    return a / DEGREE, b / DEGREE, c / DEGREE


def axis_errors(
    machine: Machine, space: Array, axis: int, most: int, target: float, play: bool
) -> tuple[AxisErrors, bool]:
    """The errors of one axis at its nodes, and whether they depend on other axes, over whose poses they are averaged.

    axis    index of the axis
    most    the most nodes
    target  the error that may be left, mm
    play    write a value for each direction of travel, not the mean of both
    """
    described = machine.axes[axis]
    low, high = space[axis].tolist()
    fine = np.linspace(low, high, SAMPLES)
    q = poses_along(axis, fine, even_poses(space, OTHER_POSES))
    ways = [np.eye(len(space))[axis] * way for way in (1.0, -1.0)]
    shape = SAMPLES, OTHER_POSES, 6
    both = [machine.joint_errors(q, State(direction=way))[..., axis, :].reshape(shape) for way in ways]
    depends = bool(max(np.ptp(twist, axis=1).max() for twist in both) > NEGLIGIBLE)
    ahead, back = (_in_frame(described, fine, twist.mean(axis=1)) for twist in both)
    curve = (ahead + back) / 2
    index = LETTERS.index(described.name)
    sense = -1.0 if described.workpiece_side else 1.0
    own = sense * (ahead - back)[:, index] / 2 if play else np.zeros(SAMPLES)
    turned = np.zeros(SAMPLES)
    if described.rotary:
        turned, curve[:, index] = sense * curve[:, index], 0.0
    lever = np.array([1.0] * 3 + [MAX_LEVER_MM] * 3)
    parts = np.concatenate([curve * lever, np.stack([turned + own, turned - own], axis=1) * lever[index]], axis=1)
    share = target / parts.shape[1]  # so that all parts together leave no more than the target
    count = max(nodes_needed(fine, part, most, share) for part in parts.T)
    step = round((high - low) / described.unit / (count - 1), 4)
    nodes = (round(low / described.unit, 4) + step * np.arange(count)) * described.unit
    fit = projector(fine, nodes)
    return AxisErrors(described.name, nodes, fit @ curve, fit @ (turned + own), fit @ (turned - own)), depends


def _in_frame(axis: Axis, positions: Array, twist: Array) -> Array:
    """The errors (n, 6) at the fixed point of the axis, along the frame of `tilt`."""
    motion = axis.motion(positions)
    triad = np.asarray(axis.error_axes)
    velocity, turned = twist[:, :3] @ triad, twist[:, 3:] @ triad
    if axis.moving_frame:
        velocity, turned = (np.einsum("nij,nj->ni", motion[:, :3, :3], part) for part in (velocity, turned))
    point = np.asarray(axis.reference)
    carried = motion[:, :3, :3] @ point + motion[:, :3, 3]
    velocity = velocity + np.cross(turned, point - carried)
    frame = tilt(axis)
    return np.concatenate([velocity @ frame, turned @ frame], axis=1)


def chain_rows(machine: Machine, components: Sequence[AxisErrors], angle: float, sense: float) -> tuple[ChainRow, ...]:
    """The rows of the kinematics table: the head, the spindle with its errors, `MachBase`, the table.

    angle  rad per unit of an angle under COMPTAB
    sense  factor of the errors that are entered there
    """
    by_axis = {each.axis: each for each in components}
    head, table = sides(machine)
    place = np.zeros(3)
    found: list[ChainRow] = []
    for axis in head:
        found += _joint(axis, by_axis[axis.name], np.asarray(axis.reference) - place)
        place = np.asarray(axis.reference)
    found += _spindle(machine, np.asarray(machine.tool.point) - place, angle, sense)
    found.append(ChainRow("MachBase"))
    place = np.zeros(3)
    for axis in table:
        found += _joint(axis, by_axis[axis.name], np.asarray(axis.reference) - place)
        place = np.asarray(axis.reference)
    return tuple(found)


def _joint(axis: Axis, errors: AxisErrors, way: Array) -> Iterator[ChainRow]:
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
    yield ChainRow("MachAxis", axis.name)
    if not straight:
        yield from _trans("ABC", angles(frame.T), [None] * 3)


def _spindle(machine: Machine, way: Array, angle: float, sense: float) -> Iterator[ChainRow]:
    zero = np.zeros(len(machine.axes))
    twist = sense * machine.joint_errors(zero, State())[-1]
    values = *twist[:3].tolist(), *(twist[3:] / angle).tolist()
    fixed = [value if abs(value) > NEGLIGIBLE else None for value in values]
    yield from _trans("XYZ", way.tolist(), fixed[:3])
    yield from _trans("ABC", [0.0] * 3, fixed[3:])
    tool = Axis("Z", False, False, machine.tool.direction)
    yield from _trans("ABC", angles(tilt(tool)), [None] * 3)


def _trans(
    letters: str, coords: Sequence[float], errors: Sequence[float | tuple[str, str] | None]
) -> Iterator[ChainRow]:
    for letter, coord, error in zip(letters, coords, errors, strict=True):
        some = abs(coord) > NEGLIGIBLE
        if some or error is not None:
            yield ChainRow("Trans", letter, coord if some else None, error)
