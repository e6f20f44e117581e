"""`.COM` files: values over the positions of one axis, a column for every axis that they move.

Two forms: that of the NCK controls (TNC 640, 620, 320, MANUALplus), with the position in a column of its own, and that
of the iTNC 530, with datum and distance in the BEGIN line and columns named by axis numbers, `1=F()`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ncfix.tables.grid import Array
from ncfix.tables.table_files import Remarks
from ncfix_heidenhain.table_text import Column, TextTable, number, read_table

BACKLASH = "BACKLASH"
POSITION = "AXISPOS"
NCK_BEGIN = re.compile(r"(\S+) (MM|INCH)\s*")
OLD_BEGIN = re.compile(r"(\S+)\s+DATUM:([-+]?\d+\.?\d*)\s+DISTANCE:([-+]?\d+\.?\d*)\s*")
FUNCTION = re.compile(r"(\d+)=F\(\)")
COMPONENT = re.compile(r"C[1-6]")
LARGE = 1.0
"""mm or degree: no machine is that wrong; most likely the unit is."""
STEEP = 1 / 64
"""Change of a value per distance that the older controls allow."""


@dataclass(frozen=True, slots=True)
class Com:
    """A table as it is in the file, mm and degree.

    nodes     positions of the axis, (n,)
    columns   letter of an axis, number of an axis, or C1 to C6 -> values, (n,)
    backlash  of the axis itself in negative travel, (n,); None where there is no such column
    """

    nodes: Array
    columns: Mapping[str, Array]
    backlash: Array | None = None


def nck_text(name: str, com: Com, decimals: int) -> bytes:
    """The form of the NCK controls."""
    heads = [POSITION, *([BACKLASH] if com.backlash is not None else []), *com.columns]
    values = [com.nodes, *([com.backlash] if com.backlash is not None else []), *com.columns.values()]
    return _text(f"{name} MM", [(head, 14) for head in heads], values, decimals, True)


def old_text(name: str, com: Com, decimals: int) -> bytes:
    """The form of the iTNC 530; the nodes must be evenly spaced."""
    backlash = np.zeros_like(com.nodes) if com.backlash is None else com.backlash
    step = (com.nodes[-1] - com.nodes[0]) / (len(com.nodes) - 1)
    begin = f"{name}  DATUM:{com.nodes[0]:+.4f} DISTANCE:{step:+.4f}"
    heads = [(head if COMPONENT.fullmatch(head) else f"{head}=F()", 14) for head in com.columns]
    return _text(begin, [(BACKLASH, 14), *heads], [backlash, *com.columns.values()], decimals, False)


def _text(begin: str, heads: Sequence[tuple[str, int]], values: Sequence[Array], decimals: int, ended: bool) -> bytes:
    columns = (Column("NR", 5), *(Column(*head) for head in heads))
    table = np.stack([np.round(column, decimals) + 0.0 for column in values], axis=1)
    rows = tuple((str(n), *(f"{value:+.{decimals}f}" for value in row)) for n, row in enumerate(table.tolist()))
    return TextTable(begin, columns, rows, ended=ended).text()


def read_com(path: str, content: bytes) -> tuple[Com | None, Remarks]:
    """A table of either form, with remarks."""
    remarks = Remarks.of(path, content)
    table = read_table(remarks, content)
    if table is None:
        return None, remarks
    names = [column.name for column in table.columns]
    _check_numbers(remarks, table)
    nodes = _positions(remarks, table, path)
    held = [name for name in names if name not in ("NR", POSITION, BACKLASH)]
    for name in held:
        if not (FUNCTION.fullmatch(name) or COMPONENT.fullmatch(name) or (len(name) == 1 and name in "XYZABCUVW")):
            remarks.refuse(0, f"the column {name} is no axis", "letters of axes, 1=F(), or C1 to C6")
        if names.count(name) > 1:
            remarks.refuse(0, f"the column {name} is there twice")
    if not held:
        remarks.refuse(0, "no column of values")
    columns = {_short(name): _values(remarks, table, name) for name in held}
    backlash = _values(remarks, table, BACKLASH) if BACKLASH in names else None
    if remarks.wrong:
        return None, remarks
    _look(remarks, table, nodes, columns)
    return Com(nodes, columns, backlash), remarks


def _short(name: str) -> str:
    match = FUNCTION.fullmatch(name)
    return match[1] if match else name


def _check_numbers(remarks: Remarks, table: TextTable) -> None:
    for expected, (line, cell) in enumerate(zip(table.lines, table.cells("NR"), strict=True)):
        if cell != str(expected):
            remarks.refuse(line, f"row {cell or 'without a number'} where {expected} should be")
            return


def _positions(remarks: Remarks, table: TextTable, path: str) -> Array:
    if len(table.rows) < 2:
        remarks.refuse(0, f"{len(table.rows)} points")
    if POSITION in [column.name for column in table.columns]:
        match = NCK_BEGIN.fullmatch(table.begin)
        if match and match[2] != "MM":
            remarks.refuse(1, f"the unit is {match[2]}", "ncfix reads MM")
        if not table.ended:
            remarks.refuse(len(remarks.rows), "[END] is missing: the file may have been cut short")
        nodes = _values(remarks, table, POSITION)
    else:
        match = OLD_BEGIN.fullmatch(table.begin)
        step = float(match[3]) if match else 0.0
        nodes = (float(match[2]) if match else 0.0) + step * np.arange(len(table.rows), dtype=np.float64)
        if match and step <= 0:
            remarks.refuse(1, f"DISTANCE:{match[3]}", "a distance above zero")
    if not match:
        remarks.refuse(1, "BEGIN should be followed by NAME MM, or NAME DATUM:... DISTANCE:...")
    elif match[1].upper() != path.upper():
        remarks.doubt(1, f"says that it is {match[1]}")
    for row in np.flatnonzero(np.diff(nodes) <= 0):
        remarks.refuse(table.lines[row + 1], "the positions must ascend")
    return nodes


def _values(remarks: Remarks, table: TextTable, name: str) -> Array:
    cells = zip(table.lines, table.cells(name), strict=True)
    return np.array([number(remarks, line, cell, name) for line, cell in cells], dtype=np.float64)


def _look(remarks: Remarks, table: TextTable, nodes: Array, columns: Mapping[str, Array]) -> None:
    """Values that are too large, and those that change faster than any axis errs."""
    for name, values in columns.items():
        for row in np.flatnonzero(np.abs(values) > LARGE)[:1]:
            remarks.refuse(table.lines[row], f"{values[row]:g} under {name}, which no machine needs", "mm, not um")
        slopes = np.abs(np.diff(values)) / np.diff(nodes)
        for row in np.flatnonzero(slopes > STEEP)[:1]:
            text = f"{name} changes by {slopes[row]:.3g} per unit from the row before; older controls allow {STEEP:.3g}"
            remarks.doubt(table.lines[row + 1], text, "a slip of the digits?")
