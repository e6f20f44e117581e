"""Heidenhain's free tables, and the axis compensation files that have this form: `.COM` and `.CMA`.

A free table has a BEGIN line, a line of column names, rows in fixed columns, and [END]. A column begins where its name
begins, and ends where the next name begins. A table that was read can be written again byte for byte.

A `.COM` file holds values for positions of one axis, with one column per axis that they move. It has two forms:

- NCK controls (TNC 640, 620, 320, MANUALplus): the positions stand in a column of their own.
- iTNC 530: first position and distance stand in the BEGIN line, and columns are named by axis numbers, `1=F()`.

`config.cma` has one column per axis, with the name of the `.COM` file in which the axis is looked up; its active line
is marked with `*`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ncfix.arrays import Array
from ncfix.tables.control import Files
from ncfix.tables.table_files import ORDER, Remarks, as_number
from ncfix.values import frozen

END = "[END]"
NAME = re.compile(r"\S+")
ACTIVE = "ACTIVE"
CONFIG = "config.cma"
BACKLASH = "BACKLASH"
POSITION = "AXISPOS"
NCK_BEGIN = re.compile(r"(\S+) (MM|INCH)(?: +(?i:VERSION): *'[^']*')?(?: +U)?\s*")
OLD_BEGIN = re.compile(r"(\S+)\s+DATUM:([-+]?\d+\.?\d*)\s+DISTANCE:([-+]?\d+\.?\d*)\s*")
FUNCTION = re.compile(r"(\d+)=F\(\)")
COMPONENT = re.compile(r"C[1-6]")
MAX_CREDIBLE = 1.0
"""The largest value that is believed, mm or degree; no machine has such an error, so most likely the unit is wrong."""
MAX_SLOPE = 1 / 64
"""The largest change of a value per distance that the older controls allow."""


@frozen
class TableColumn:
    """A column of a table: its name, and its width in characters."""

    name: str
    width: int


@frozen
class TextTable:
    """A free table as it stands in its file.

    begin    what follows BEGIN in the first line, blanks included; "" without such a line
    columns  the columns, in their order
    rows     the cells of each row, one per column
    lines    the line number of each row in the file
    ended    the table ends with [END]
    padded   blanks fill the last column to its width
    eol      line end
    """

    begin: str
    columns: tuple[TableColumn, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...] = ()
    ended: bool = True
    padded: bool = True
    eol: str = "\n"

    def text(self) -> bytes:
        """The content of the file."""
        return "".join(f"{line}{self.eol}" for line in self._lines()).encode("ascii")

    def cells(self, name: str) -> list[str]:
        """The cells of the column of that name; "" in each row if there is no such column."""
        names = [column.name for column in self.columns]
        return [row[names.index(name)] if name in names else "" for row in self.rows]

    def _lines(self) -> Iterator[str]:
        if self.begin:
            yield f"BEGIN {self.begin}"
        yield self._row([column.name for column in self.columns])
        for row in self.rows:
            yield self._row(row)
        if self.ended:
            yield END

    def _row(self, cells: Sequence[str]) -> str:
        line = "".join(f"{cell:<{column.width}}" for cell, column in zip(cells, self.columns, strict=True))
        return line if self.padded else line.rstrip()


def read_table(remarks: Remarks, content: bytes) -> TextTable | None:
    """The table in a file; None, with a remark, if the file holds no table."""
    lines = [line for line in enumerate(remarks.rows, 1) if line[1].strip()]
    if not lines:
        remarks.refuse(0, "is empty")
        return None
    begin = lines.pop(0)[1][len("BEGIN ") :] if lines[0][1].upper().startswith("BEGIN ") else ""
    ended = bool(lines) and lines[-1][1].strip().upper() == END
    body = lines[: len(lines) - ended]
    if not body or not body[0][1].startswith("NR"):
        remarks.refuse(body[0][0] if body else 0, "no line of column names, which begins with NR")
        return None
    head = body.pop(0)[1]
    columns = _columns(head)
    if tabbed := next((number for number, row in enumerate(remarks.rows, 1) if "\t" in row), 0):
        remarks.refuse(tabbed, "a tab: columns are counted in characters")
    rows = tuple(_cells(remarks, cell_number, line, columns) for cell_number, line in body)
    eol = "\r\n" if b"\r\n" in content else "\n"
    return TextTable(begin, columns, rows, tuple(n for n, _ in body), ended, head.endswith(" "), eol)


def _columns(head: str) -> tuple[TableColumn, ...]:
    found = list(NAME.finditer(head))
    ends = [*(match.start() for match in found[1:]), len(head)]
    return tuple(TableColumn(match[0], end - match.start()) for match, end in zip(found, ends, strict=True))


def _cells(remarks: Remarks, cell_number: int, line: str, columns: Sequence[TableColumn]) -> tuple[str, ...]:
    cells, start = [], 0
    for index, column in enumerate(columns):
        stop = start + column.width if index + 1 < len(columns) else len(line)
        cell = line[start:stop]
        if index + 1 < len(columns) and len(cell) == column.width and not cell.endswith(" ") and cell.strip():
            remarks.refuse(cell_number, f"the value under {column.name} extends into the next column")
        if cell.startswith(" ") and cell.strip():
            remarks.doubt(cell_number, f"the value under {column.name} does not begin where the column begins")
        cells.append(cell.strip())
        start = stop
    if len(cells[-1].split()) > 1:
        remarks.refuse(cell_number, "more cells than there are columns")
    return tuple(cells)


def cell_number(remarks: Remarks, line: int, cell: str, name: str) -> float:
    """The number in a cell; NaN, with a remark, if it is no number."""
    found = as_number(cell)
    if found is not None:
        return found
    what = "a decimal comma" if "," in cell else f"{cell!r} is not a number" if cell else "nothing"
    remarks.refuse(line, f"{what} under {name}")
    return float("nan")


def cma_text(axes: Sequence[str], tables: Mapping[str, str]) -> bytes:
    """The text of `config.cma`: one line, marked active, with the file of every axis that has one."""
    width = max(13, *(len(name) + 2 for name in tables.values())) if tables else 13
    columns = (TableColumn("NR", 5), TableColumn(ACTIVE, 7), *(TableColumn(axis, width) for axis in axes))
    row = ("0", "*", *(tables.get(axis, "") for axis in axes))
    return TextTable(f"{CONFIG} MM", columns, (row,)).text()


def read_cma(files: Files) -> tuple[tuple[str, ...], dict[str, str], Remarks]:
    """All axes of the `.cma` in their order, the file of each axis in the active line, and remarks."""
    names = [name for name in files if name.lower().endswith(".cma")]
    if len(names) != 1:
        remarks = Remarks.of(CONFIG, b"")
        remarks.refuse(0, f"{len(names)} .cma files instead of one")
        return (), {}, remarks
    remarks = Remarks.of(names[0], files[names[0]])
    table = read_table(remarks, files[names[0]])
    if table is None:
        return (), {}, remarks
    axes = tuple(column.name for column in table.columns if column.name not in ("NR", ACTIVE))
    for axis in axes:
        if len(axis) != 1 or axis not in ORDER or axes.count(axis) > 1:
            remarks.refuse(0, f"the column {axis} is not an axis, or appears twice")
    marked = [row for row, cell in enumerate(table.cells(ACTIVE)) if cell == "*"]
    if len(marked) != 1:
        remarks.refuse(0, f"{len(marked)} lines are marked with *", "exactly one line is active")
        return axes, {}, remarks
    row = marked[0]
    named = {axis: name for axis in axes if (name := table.cells(axis)[row])}
    for axis, name in named.items():
        if name not in files:
            remarks.refuse(table.lines[row], f"the file {name} of axis {axis} is missing")
    return axes, {axis: name for axis, name in named.items() if name in files}, remarks


@frozen
class ComTable:
    """The content of a `.COM` file, in mm and degree.

    nodes     (n,) positions of the axis
    columns   letter of an axis, number of an axis, or C1 to C6 -> values (n,)
    backlash  (n,) values of the axis itself in negative travel; None without such a column
    """

    nodes: Array
    columns: Mapping[str, Array]
    backlash: Array | None = None


def nck_text(name: str, com: ComTable, decimals: int) -> bytes:
    """The text of a `.COM` file in the form of the NCK controls."""
    heads = [POSITION, *([BACKLASH] if com.backlash is not None else []), *com.columns]
    values = [com.nodes, *([com.backlash] if com.backlash is not None else []), *com.columns.values()]
    return _com_text(f"{name} MM", [(head, 14) for head in heads], values, decimals, True)


def old_text(name: str, com: ComTable, decimals: int) -> bytes:
    """The text of a `.COM` file in the form of the iTNC 530; the nodes must be evenly spaced."""
    backlash = np.zeros_like(com.nodes) if com.backlash is None else com.backlash
    step = (com.nodes[-1] - com.nodes[0]) / (len(com.nodes) - 1)
    begin = f"{name}  DATUM:{com.nodes[0]:+.4f} DISTANCE:{step:+.4f}"
    heads = [(head if COMPONENT.fullmatch(head) else f"{head}=F()", 14) for head in com.columns]
    return _com_text(begin, [(BACKLASH, 14), *heads], [backlash, *com.columns.values()], decimals, False)


def _com_text(
    begin: str, heads: Sequence[tuple[str, int]], values: Sequence[Array], decimals: int, ended: bool
) -> bytes:
    columns = (TableColumn("NR", 5), *(TableColumn(*head) for head in heads))
    table = np.stack([np.round(column, decimals) + 0.0 for column in values], axis=1)
    rows = tuple((str(n), *(f"{value:+.{decimals}f}" for value in row)) for n, row in enumerate(table.tolist()))
    return TextTable(begin, columns, rows, ended=ended).text()


def read_com(path: str, content: bytes) -> tuple[ComTable | None, Remarks]:
    """The content of a `.COM` file of either form, and remarks; None if something in it is wrong."""
    remarks = Remarks.of(path, content)
    table = read_table(remarks, content)
    if table is None:
        return None, remarks
    names = [column.name for column in table.columns]
    numbered = enumerate(zip(table.lines, table.cells("NR"), strict=True))
    for expected, line, cell in [(n, line, cell) for n, (line, cell) in numbered if cell != str(n)][:1]:
        remarks.refuse(line, f"row {cell or 'without a number'} instead of row {expected}")
    nodes = _positions(remarks, table, path)
    held = [name for name in names if name not in ("NR", POSITION, BACKLASH)]
    for name in held:
        if not (FUNCTION.fullmatch(name) or COMPONENT.fullmatch(name) or (len(name) == 1 and name in "XYZABCUVW")):
            remarks.refuse(0, f"the column {name} is not an axis", "letters of axes, 1=F(), or C1 to C6")
        if names.count(name) > 1:
            remarks.refuse(0, f"the column {name} appears twice")
    if not held:
        remarks.refuse(0, "no column of values")
    short = {name: match[1] if (match := FUNCTION.fullmatch(name)) else name for name in held}
    columns = {short[name]: _com_values(remarks, table, name) for name in held}
    backlash = _com_values(remarks, table, BACKLASH) if BACKLASH in names else None
    if remarks.wrong:
        return None, remarks
    _look(remarks, table, nodes, columns)
    return ComTable(nodes, columns, backlash), remarks


def _positions(remarks: Remarks, table: TextTable, path: str) -> Array:
    if len(table.rows) < 2:
        remarks.refuse(0, f"{len(table.rows)} points")
    if POSITION in [column.name for column in table.columns]:
        match = NCK_BEGIN.fullmatch(table.begin)
        if match and match[2] != "MM":
            remarks.refuse(1, f"the unit is {match[2]}", "ncfix reads MM")
        if not table.ended:
            remarks.refuse(len(remarks.rows), "[END] is missing: the file may have been cut short")
        nodes = _com_values(remarks, table, POSITION)
    else:
        remarks.doubt_end()
        match = OLD_BEGIN.fullmatch(table.begin)
        step = float(match[3]) if match else 0.0
        nodes = (float(match[2]) if match else 0.0) + step * np.arange(len(table.rows), dtype=np.float64)
        if match and step <= 0:
            remarks.refuse(1, f"DISTANCE:{match[3]}", "a distance above zero")
    if not match:
        remarks.refuse(1, "BEGIN should be followed by NAME MM, or NAME DATUM:... DISTANCE:...")
    elif match[1].upper() != path.upper():
        remarks.doubt(1, f"has the name {match[1]} inside")
    for row in np.flatnonzero(np.diff(nodes) <= 0):
        remarks.refuse(table.lines[row + 1], "the positions must ascend")
    return nodes


def _com_values(remarks: Remarks, table: TextTable, name: str) -> Array:
    cells = zip(table.lines, table.cells(name), strict=True)
    return np.array([cell_number(remarks, line, cell, name) for line, cell in cells], dtype=np.float64)


def _look(remarks: Remarks, table: TextTable, nodes: Array, columns: Mapping[str, Array]) -> None:
    """Remark on values that are too large, and on values that change faster than the error of any axis does."""
    for name, values in columns.items():
        for row in np.flatnonzero(np.abs(values) > MAX_CREDIBLE)[:1]:
            remarks.refuse(
                table.lines[row],
                f"{values[row]:g} under {name}, which is larger than any machine needs",
                "values are in mm, not um",
            )
        slopes = np.abs(np.diff(values)) / np.diff(nodes)
        for row in np.flatnonzero(slopes > MAX_SLOPE)[:1]:
            slope, limit = f"{slopes[row]:.3g}", f"{MAX_SLOPE:.3g}"
            text = f"{name} changes by {slope} per unit from the row before; older controls allow {limit}"
            remarks.doubt(table.lines[row + 1], text, "check this value for a typing error")
