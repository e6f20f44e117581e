"""The kinematics table of the iTNC 530 with KinematicsComp: made of a machine, read, and followed as a control does.

Rows `Trans` shift or turn by COORD, and by an error under COMPTAB: a number, or a column of the axis table of an axis,
as in `A..C2`. Rows `MachAxis` move. The chain runs from the machine base along the head to the gauge line, then, after
`MachBase`, from the base along the table to the workpiece (KINE-1); errors stand before the axis that they belong to.

The six errors of an axis over its position, location errors included, are given at a point of the axis that stays where
it is, since they stand before the axis in the chain: what was measured at a point that rides along gets the lever that
it has gained.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ncfix.arrays import Array
from ncfix.machine import Axis, Machine, State
from ncfix.tables.axis_tables import nodes_needed
from ncfix.tables.compensation import Compensation, Term
from ncfix.tables.correction import even_poses, poses_along
from ncfix.tables.grid import Grid, projector
from ncfix.tables.table_files import DEGREE, TURNING, Remarks, unit_of
from ncfix.values import frozen
from ncfix_heidenhain.table_files import TableColumn, TextTable, cell_number, read_table

KEYS = ("Trans", "MachAxis", "MachBase")
COLUMNS = (("NR", 3), ("DOC", 4), ("KEY", 9), ("AXIS", 5), ("COORD", 16), ("COMPTAB", 7))
MOST_ROWS = 50
"""Trans and MachAxis together."""
MOST_COORDS = 50
MOST_ERRORS = 100
"""Less the number of MachAxis."""
LETTERS = "XYZABC"
FINE = 361
OTHERS = 16
"""Poses of the other axes that are averaged over, for errors that depend on them."""
REACH = 1000.0
"""mm: the lever with which an angle may act."""
NOTHING = 1e-9


@frozen
class ChainRow:
    """A row: key, letter, COORD in mm or degree (None where empty), and under COMPTAB a number or (axis, column)."""

    key: str
    axis: str = ""
    coord: float | None = None
    error: float | tuple[str, str] | None = None


@frozen
class ErrorChain:
    """What the control works out of a kinematics table and the axis tables that it names.

    rows        of the table
    sense       1 if errors under COMPTAB say how the machine is, -1 if they say what to do about it
    angle       rad per unit of an angle under COMPTAB
    components  (axis, column) -> the values over that axis, mm or the unit of `angle`
    own         tables of axes over themselves: corrections
    length      of the tool, mm
    """

    rows: tuple[ChainRow, ...]
    sense: float
    angle: float
    components: Mapping[tuple[str, str], Grid]
    own: tuple[Term, ...]
    length: float = 0.0

    def for_tool(self, length: float) -> ErrorChain:
        """With a tool of this length: the control knows which one is in the spindle."""
        return ErrorChain(self.rows, self.sense, self.angle, self.components, self.own, length)

    @property
    def grids(self) -> tuple[Grid, ...]:
        """Every table."""
        return (*self.components.values(), *Compensation(self.own).grids)

    @property
    def axes(self) -> frozenset[str]:
        """Every axis of the chain."""
        return frozenset(row.axis for row in self.rows if row.key == "MachAxis")

    @property
    def points(self) -> int:
        """The rows of all axis tables."""
        return sum(grid.points for grid in self.grids)

    def at(self, names: Sequence[str], q: Array, direction: Array | None = None) -> Array:
        """See `Tables.at`: each axis by its own table, linear ones also so that the tip is where it is meant."""
        correction = Compensation(self.own).at(names, q, direction)
        linear = [index for index, name in enumerate(names) if name in "XYZ" and name in self.axes]
        nominal = self.tip(names, q, False)
        jacobian = np.stack([self.tip(names, q + np.eye(q.shape[1])[i], False) - nominal for i in linear], axis=-1)
        moved = q.copy()
        for _ in range(2):
            gap = nominal - self.tip(names, moved, True)
            moved[:, linear] += np.linalg.solve(jacobian, gap[..., None])[..., 0]
        correction[:, linear] += (moved - q)[:, linear]
        return correction

    def tip(self, names: Sequence[str], q: Array, wrong: bool) -> Array:
        """The tip as seen from the workpiece, with or without the errors, (n, 3) mm."""
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
    """Points shifted along, or turned about, a coordinate axis."""
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
    """The table as a file."""
    table = []
    for n, row in enumerate(rows):
        coord = "" if row.coord is None else f"{round(row.coord, 9) + 0.0:.9g}"
        error = "" if row.error is None else row.error if isinstance(row.error, tuple) else (f"{row.error:.7f}",)
        table.append((str(n), "", row.key, row.axis, coord, "..".join(error)))
    return TextTable("", tuple(TableColumn(*each) for each in COLUMNS), tuple(table), padded=False).text()


def over_limits(rows: Sequence[ChainRow]) -> Iterator[str]:
    """In words, each limit of the control that a table breaks."""
    axes = sum(row.key == "MachAxis" for row in rows)
    chain = axes + sum(row.key == "Trans" for row in rows)
    coords = sum(row.coord is not None for row in rows)
    errors = sum(row.error is not None for row in rows)
    if chain > MOST_ROWS:
        yield f"{chain} rows Trans and MachAxis, and the control takes {MOST_ROWS}"
    if coords > MOST_COORDS:
        yield f"{coords} entries under COORD, and the control takes {MOST_COORDS}"
    if errors > MOST_ERRORS - axes:
        yield f"{errors} entries under COMPTAB, and the control takes {MOST_ERRORS - axes} with {axes} axes"


def read_rows(remarks: Remarks, content: bytes) -> tuple[ChainRow, ...]:
    """The rows of a kinematics table, with remarks."""
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
        remarks.refuse(0, "an axis is there twice")
    return rows


def _row(remarks: Remarks, expected: int, line: int, nr: str, key: str, axis: str, coord: str, error: str) -> ChainRow:
    if nr != str(expected):
        remarks.refuse(line, f"row {nr or 'without a number'} where {expected} should be")
    if key not in KEYS:
        remarks.refuse(line, f"{key!r} is no key", ", ".join(KEYS))
    if key != "MachBase" and (len(axis) != 1 or axis not in LETTERS):
        remarks.refuse(line, f"{axis!r} is no axis")
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
    return np.eye(3) + sine * cross + (1 - cosine) * cross @ cross


def angles(frame: Array) -> tuple[float, float, float]:
    """A frame as turns about X, then the new Y, then the new Z, degree."""
    b = float(np.arcsin(np.clip(frame[0, 2], -1.0, 1.0)))
    a = float(np.arctan2(-frame[1, 2], frame[2, 2]))
    c = float(np.arctan2(-frame[0, 1], frame[0, 0]))
    return a / DEGREE, b / DEGREE, c / DEGREE


def axis_errors(
    machine: Machine, space: Array, axis: int, most: int, target: float, play: bool
) -> tuple[AxisErrors, bool]:
    """The errors of one axis, and whether other axes matter to them, over which is averaged; `play`: ways apart."""
    described = machine.axes[axis]
    low, high = space[axis].tolist()
    fine = np.linspace(low, high, FINE)
    q = poses_along(axis, fine, even_poses(space, OTHERS))
    ways = [np.eye(len(space))[axis] * way for way in (1.0, -1.0)]
    both = [machine.joint_errors(q, State(direction=way))[..., axis, :].reshape(FINE, OTHERS, 6) for way in ways]
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
    return AxisErrors(described.name, nodes, fit @ curve, fit @ (turned + own), fit @ (turned - own)), depends


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
    return np.concatenate([velocity @ frame, turned @ frame], axis=1)


def chain_rows(machine: Machine, components: Sequence[AxisErrors], angle: float, sense: float) -> tuple[ChainRow, ...]:
    """The kinematics table: the head, the gauge line with the errors of the spindle, `MachBase`, the table.

    angle is rad per unit of an angle under COMPTAB, sense what errors are multiplied by there.
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
    fixed = [value if abs(value) > NOTHING else None for value in (*twist[:3].tolist(), *(twist[3:] / angle).tolist())]
    yield from _trans("XYZ", way.tolist(), fixed[:3])
    yield from _trans("ABC", [0.0] * 3, fixed[3:])
    tool = Axis("Z", False, False, machine.tool.direction)
    yield from _trans("ABC", angles(tilt(tool)), [None] * 3)


def _trans(
    letters: str, coords: Sequence[float], errors: Sequence[float | tuple[str, str] | None]
) -> Iterator[ChainRow]:
    for letter, coord, error in zip(letters, coords, errors, strict=True):
        some = abs(coord) > NOTHING
        if some or error is not None:
            yield ChainRow("Trans", letter, coord if some else None, error)
