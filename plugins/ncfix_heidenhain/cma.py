"""`config.cma`: which `.COM` file an axis looks up, a column for every axis, the active line marked with `*`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ncfix.tables.control import Files
from ncfix.tables.table_files import ORDER, Remarks
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
    if len(names) != 1:
        remarks = Remarks.of(CONFIG, b"")
        remarks.refuse(0, f"{len(names)} .cma files instead of one")
        return (), {}, remarks
    remarks = Remarks.of(names[0], files[names[0]])
    table = read_table(remarks, files[names[0]])
    if table is None:
        return (), {}, remarks
    axes = _axes(table, remarks)
    return axes, _active(table, axes, files, remarks), remarks


def _axes(table: TextTable, remarks: Remarks) -> tuple[str, ...]:
    """The axes that have a column, each of which should be there once."""
    axes = tuple(column.name for column in table.columns if column.name not in ("NR", ACTIVE))
    for axis in axes:
        if len(axis) != 1 or axis not in ORDER or axes.count(axis) > 1:
            remarks.refuse(0, f"the column {axis} is no axis, or is there twice")
    return axes


def _active(table: TextTable, axes: Sequence[str], files: Files, remarks: Remarks) -> dict[str, str]:
    """Axis -> its file, of those that the active line names and that are there."""
    marked = [row for row, cell in enumerate(table.cells(ACTIVE)) if cell == "*"]
    if len(marked) != 1:
        remarks.refuse(0, f"{len(marked)} lines are marked with *", "exactly one line is active")
        return {}
    row = marked[0]
    named = {axis: name for axis in axes if (name := table.cells(axis)[row])}
    for axis, name in named.items():
        if name not in files:
            remarks.refuse(table.lines[row], f"the file {name} of axis {axis} is missing")
    return {axis: name for axis, name in named.items() if name in files}
