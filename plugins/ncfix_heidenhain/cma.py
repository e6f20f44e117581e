"""`config.cma`: which `.COM` file an axis looks up, a column for every axis, the active line marked with `*`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ncfix.tables.axes import ORDER
from ncfix.tables.control import Files
from ncfix.tables.lines import Remarks
from ncfix_heidenhain.table_text import Column, TextTable, read_table

ACTIVE = "ACTIVE"
CONFIG = "config.cma"


def cma_text(axes: Sequence[str], tables: Mapping[str, str]) -> bytes:
    """One line, active: the file of every axis that has one."""
    width = max(13, *(len(name) + 2 for name in tables.values())) if tables else 13
    columns = (Column("NR", 5), Column(ACTIVE, 7), *(Column(axis, width) for axis in axes))
    row = ("0", "*", *(tables.get(axis, "") for axis in axes))
    return TextTable(f"{CONFIG} MM", columns, (row,)).text()


def read_cma(files: Files) -> tuple[tuple[str, ...], dict[str, str], Remarks]:
    """All axes in their order, and the file of each in the active line; with remarks."""
    names = [name for name in files if name.lower().endswith(".cma")]
    path = names[0] if len(names) == 1 else CONFIG
    remarks = Remarks.of(path, files[path] if len(names) == 1 else b"")
    if len(names) != 1:
        remarks.refuse(0, f"{len(names)} .cma files instead of one")
        return (), {}, remarks
    table = read_table(remarks, files[path])
    if table is None:
        return (), {}, remarks
    axes = tuple(column.name for column in table.columns if column.name not in ("NR", ACTIVE))
    for axis in axes:
        if len(axis) != 1 or axis not in ORDER or axes.count(axis) > 1:
            remarks.refuse(0, f"the column {axis} is no axis, or is there twice")
    marked = [row for row, cell in enumerate(table.cells(ACTIVE)) if cell == "*"]
    if len(marked) != 1:
        remarks.refuse(0, f"{len(marked)} lines are marked with *", "exactly one line is active")
        return axes, {}, remarks
    row = marked[0]
    found = {axis: table.cells(axis)[row] for axis in axes if table.cells(axis)[row]}
    for axis, name in found.items():
        if name not in files:
            remarks.refuse(table.lines[row], f"the file {name} of axis {axis} is missing")
    return axes, {axis: name for axis, name in found.items() if name in files}, remarks
