"""The kinematics table of the iTNC 530 with KinematicsComp, and what a control that follows it does with the tool tip.

Rows `Trans` shift or turn by COORD, and by an error under COMPTAB: a number, or a column of the axis table of an axis,
as in `A..C2`. Rows `MachAxis` move. The chain runs from the machine base along the head to the gauge line, then, after
`MachBase`, from the base along the table to the workpiece (KINE-1); errors stand before the axis that they belong to.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ncfix.tables.compensation import Compensation, Term
from ncfix.tables.grid import Array, Grid
from ncfix.tables.table_files import TURNING, Remarks, unit_of
from ncfix_heidenhain.table_text import Column, TextTable, number, read_table

KEYS = ("Trans", "MachAxis", "MachBase")
COLUMNS = (("NR", 3), ("DOC", 4), ("KEY", 9), ("AXIS", 5), ("COORD", 16), ("COMPTAB", 7))
MOST_ROWS = 50
"""Trans and MachAxis together."""
MOST_COORDS = 50
MOST_ERRORS = 100
"""Less the number of MachAxis."""
LETTERS = "XYZABC"


@dataclass(frozen=True, slots=True)
class Row:
    """A row: key, letter, COORD in mm or degree (None where empty), and under COMPTAB a number or (axis, column)."""

    key: str
    axis: str = ""
    coord: float | None = None
    error: float | tuple[str, str] | None = None


@dataclass(frozen=True, slots=True)
class Kinematics:
    """What the control works out of a kinematics table and the axis tables that it names.

    rows        of the table
    sense       1 if errors under COMPTAB say how the machine is, -1 if they say what to do about it
    angle       rad per unit of an angle under COMPTAB
    components  (axis, column) -> the values over that axis, mm or the unit of `angle`
    own         tables of axes over themselves: corrections
    length      of the tool, mm
    """

    rows: tuple[Row, ...]
    sense: float
    angle: float
    components: Mapping[tuple[str, str], Grid]
    own: tuple[Term, ...]
    length: float = 0.0

    def for_tool(self, length: float) -> Kinematics:
        """With a tool of this length: the control knows which one is in the spindle."""
        return Kinematics(self.rows, self.sense, self.angle, self.components, self.own, length)

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

    def _value(self, row: Row, names: Sequence[str], q: Array, wrong: bool, way: float) -> Array:
        if row.key == "MachAxis":
            return way * q[:, names.index(row.axis)]
        value: Array = np.full(len(q), (row.coord or 0.0) * unit_of(row.axis))
        if not wrong or row.error is None:
            return value
        unit = self.sense * (self.angle if row.axis in TURNING else 1.0)
        if not isinstance(row.error, tuple):
            return value + unit * row.error
        grid = self.components[row.error]
        found: Array = value + unit * grid.at(q[:, [names.index(grid.inputs[0])]])[:, 0]
        return found


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


def kinematics_text(rows: Sequence[Row]) -> bytes:
    """The table as a file."""
    table = tuple((str(n), "", row.key, row.axis, _coord(row), _error(row)) for n, row in enumerate(rows))
    return TextTable("", tuple(Column(*each) for each in COLUMNS), table, padded=False).text()


def _coord(row: Row) -> str:
    return "" if row.coord is None else f"{round(row.coord, 9) + 0.0:.9g}"


def _error(row: Row) -> str:
    if row.error is None:
        return ""
    return "..".join(row.error) if isinstance(row.error, tuple) else f"{row.error:.7f}"


def over_limits(rows: Sequence[Row]) -> Iterator[str]:
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


def read_rows(remarks: Remarks, content: bytes) -> tuple[Row, ...]:
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


def _row(remarks: Remarks, expected: int, line: int, nr: str, key: str, axis: str, coord: str, error: str) -> Row:
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
        found = number(remarks, line, error, "COMPTAB")
    return Row(key, axis, number(remarks, line, coord, "COORD") if coord else None, found)
