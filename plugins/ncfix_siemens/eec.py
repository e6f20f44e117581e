"""EEC (LEC) files, `%_N_AX1_EEC_INI`: what is wrong with an axis over its own position. Values are errors."""

from __future__ import annotations

from collections.abc import Iterable

from ncfix.tables.table_files import Remarks
from ncfix_siemens.assigned import Assigned
from ncfix_siemens.syntax import Assignment, Line, assignments
from ncfix_siemens.table import PLACES, Table, number

FIELDS = ("STEP", "MIN", "MAX", "IS_MODULO")
VALUE = "AA_ENC_COMP"


def eec_text(table: Table, heads: Iterable[str]) -> bytes:
    """The file of one encoder."""
    axis, encoder = table.output, table.index
    lines = [f"%_N_{axis}_EEC_INI", "CHANDATA(1)", *(f"; {head}" for head in heads)]
    lines += [f"$AA_ENC_COMP[{encoder},{n},{axis}]={number(value)}" for n, value in enumerate(table.values.tolist())]
    sizes = [number(value, PLACES) for value in (table.step, table.low, table.high)]
    for field, value in zip(FIELDS, (*sizes, str(int(table.modulo))), strict=True):
        lines.append(f"$AA_ENC_COMP_{field}[{encoder},{axis}]={value}")
    return "".join(f"{line}\n" for line in [*lines, "M17"]).encode()


def read_eec(lines: Iterable[Line], remarks: Remarks) -> list[Table]:
    """The tables of a file, with remarks; one that is not complete is left out."""
    found: dict[tuple[int, str], Assigned] = {}
    for each in assignments(lines, remarks):
        _sort(each, found, remarks)
    tables = [_table(*key, found[key], remarks) for key in sorted(found)]
    return [table for table in tables if table is not None]


def _sort(assignment: Assignment, tables: dict[tuple[int, str], Assigned], remarks: Remarks) -> None:
    name = assignment.name.upper()
    field = name.removeprefix(f"{VALUE}_")
    wanted = 3 if name == VALUE else 2
    if name != VALUE and field not in FIELDS:
        remarks.refuse(assignment.line, f"${assignment.name} is not a variable of these tables")
        return
    if len(assignment.indices) != wanted or not all(index.strip().isdecimal() for index in assignment.indices[:-1]):
        inside = "encoder, number and axis" if wanted == 3 else "encoder and axis"
        remarks.refuse(assignment.line, f"${assignment.name} takes {inside} in its brackets")
        return
    encoder, axis = int(assignment.indices[0]), assignment.indices[-1].strip().upper()
    place, names = f"$AA_ENC_COMP[{encoder},{{}},{axis}]", f"$AA_ENC_COMP_{{}}[{encoder},{axis}]"
    table = tables.setdefault((encoder, axis), Assigned(axis, place, names, remarks))
    if wanted == 3:
        table.put_value(int(assignment.indices[1]), assignment)
    else:
        table.put_field(field, assignment)


def _table(encoder: int, axis: str, table: Assigned, remarks: Remarks) -> Table | None:
    before = len(remarks.wrong)
    if table.lacks(FIELDS[:3]):
        return None
    modulo = bool(table.choice("IS_MODULO", (0, 1)))
    values = table.curve(modulo)
    if values is None or len(remarks.wrong) > before:
        return None
    return Table(encoder, axis, axis, table.number("MIN"), table.number("STEP"), values, modulo=modulo)
