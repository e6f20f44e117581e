"""CEC files, `%_N_NC_CEC_INI`: text from tables, and tables from text with remarks on what is wrong in it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ncfix.tables.table_files import Remarks
from ncfix_siemens.assigned import Assigned
from ncfix_siemens.syntax import Assignment, Line, assignments
from ncfix_siemens.table import PLACES, Table, number

FIELDS = ("INPUT_AXIS", "OUTPUT_AXIS", "STEP", "MIN", "MAX", "DIRECTION", "MULT_BY_TABLE", "IS_MODULO")
NEEDED = FIELDS[:5]
LINKS = ("INPUT_NCU", "OUTPUT_NCU")
VALUE = "AN_CEC"
STEEP = 0.01
"""mm per mm: no machine errs that fast."""
CLEARLY = 1.001
"""How much larger than the largest positive value the largest negative one must be to be remarked on."""
BOTH_WAYS = 0
FLIPPED = "ncfix writes it positive; a sign that is turned in both factors of a pair turns nothing"
LARGE = 1.0
"""mm or degree: no machine is that wrong; most likely the unit is."""


@dataclass(frozen=True, slots=True)
class Style:
    """What is left open: axis names in brackets, a METRIC line, a path line."""

    brackets: bool = True
    metric: bool = False
    path: str = ""


def cec_text(tables: Iterable[Table], heads: Iterable[str], titles: Mapping[int, str], style: Style) -> bytes:
    """The file; `heads` are comments for its top, `titles` one for each table."""
    lines = ["%_N_NC_CEC_INI"]
    lines += [f";$PATH={style.path}"] if style.path else []
    lines += ["METRIC"] if style.metric else []
    lines += ["CHANDATA(1)", *(f"; {head}" for head in heads)]
    for table in tables:
        lines += [f"; {titles[table.index]}"] if table.index in titles else []
        lines += _assigned(table, style)
    return "".join(f"{line}\n" for line in [*lines, "M17"]).encode()


def _assigned(table: Table, style: Style) -> Iterator[str]:
    for place, value in enumerate(table.values.tolist()):
        yield f"$AN_CEC[{table.index},{place}]={number(value)}"
    names = (f"({name})" if style.brackets else name for name in (table.input, table.output))
    sizes = (number(value, PLACES) for value in (table.step, table.low, table.high))
    whole = (str(value) for value in (table.direction, table.multiply, int(table.modulo)))
    for field, value in zip(FIELDS, (*names, *sizes, *whole), strict=True):
        yield f"$AN_CEC_{field}[{table.index}]={value}"


def read_cec(lines: Iterable[Line], remarks: Remarks) -> list[Table]:
    """The tables of a file, by index, with remarks; a table that is not complete is left out."""
    found: dict[int, Assigned] = {}
    for each in assignments(lines, remarks):
        _sort(each, found, remarks)
    tables = [_table(index, found[index], remarks) for index in sorted(found)]
    good = [table for table in tables if table is not None]
    _look_at_products(good, found, remarks)
    return good


def _sort(assignment: Assignment, tables: dict[int, Assigned], remarks: Remarks) -> None:
    name = assignment.name.upper()
    field = name.removeprefix(f"{VALUE}_")
    if field in LINKS:
        remarks.doubt(assignment.line, f"${assignment.name}: axes of other control units are not followed")
        return
    wanted = 2 if name == VALUE else 1
    if name != VALUE and field not in FIELDS:
        remarks.refuse(assignment.line, f"${assignment.name} is not a variable of these tables")
        return
    if len(assignment.indices) != wanted or not all(index.strip().isdecimal() for index in assignment.indices):
        remarks.refuse(
            assignment.line, f"${assignment.name} takes {wanted} whole number{'s' * (wanted > 1)} in its brackets"
        )
        return
    index, *number = (int(text) for text in assignment.indices)
    place, names = f"$AN_CEC[{index},{{}}]", f"$AN_CEC_{{}}[{index}]"
    table = tables.setdefault(index, Assigned(f"table {index + 1}", place, names, remarks))
    if number:
        table.put_value(number[0], assignment)
    else:
        table.put_field(field, assignment)


def _table(index: int, table: Assigned, remarks: Remarks) -> Table | None:
    before = len(remarks.wrong)
    if table.lacks(NEEDED):
        return None
    source, output = (_axis(table.fields[field], remarks) for field in NEEDED[:2])
    direction = table.choice("DIRECTION", (0, 1, -1))
    multiply = table.choice("MULT_BY_TABLE")
    modulo = bool(table.choice("IS_MODULO", (0, 1)))
    values = table.curve(modulo)
    if values is None or len(remarks.wrong) > before:
        return None
    low, step = table.number("MIN"), table.number("STEP")
    return Table(index, source, output, low, step, values, direction, multiply, modulo)


def _axis(assignment: Assignment, remarks: Remarks) -> str:
    name = assignment.value.strip().removeprefix("(").removesuffix(")").strip()
    if not name.replace("_", "").isalnum():
        remarks.refuse(assignment.line, f"{assignment.value!r} is not the name of an axis")
    return name.upper()


def _look_at_products(tables: Iterable[Table], found: Mapping[int, Assigned], remarks: Remarks) -> None:
    by_number = {table.index + 1: table for table in tables}
    pointed = {table.multiply for table in by_number.values() if table.multiply}
    for own, table in by_number.items():
        if table.multiply:
            line = found[table.index].fields["MULT_BY_TABLE"].line
            _look_at_pair(table, by_number.get(table.multiply), line, remarks)
        if not (table.multiply or own in pointed):
            _look_at_sizes(table, found[table.index], remarks)


def _look_at_pair(table: Table, other: Table | None, line: int, remarks: Remarks) -> None:
    if other is None:
        text = f"table {table.index + 1} is multiplied by table {table.multiply}, which is not there"
        remarks.refuse(line, text, "the number of a table is its index + 1")
        return
    if other.output != table.output:
        text = f"table {table.index + 1} is for {table.output}, the table that it is multiplied by for {other.output}"
        remarks.refuse(line, text, "both factors have the same output axis")
    if other.direction != BOTH_WAYS:
        remarks.refuse(line, f"table {table.multiply} multiplies others and acts one way only: what then is not public")
    if other.multiply:
        remarks.doubt(line, f"table {table.multiply} is itself multiplied by another: what then is not public")
    if other is not table and -other.values.min() > CLEARLY * other.values.max():
        remarks.doubt(line, f"the largest value of the multiplier, table {table.multiply}, is negative", FLIPPED)


def _look_at_sizes(table: Table, found: Assigned, remarks: Remarks) -> None:
    """A value that no machine needs, or a jump from one to the next; of tables that are added."""
    largest = int(np.argmax(np.abs(table.values)))
    if abs(table.values[largest]) > LARGE:
        text = f"a value of {table.values[largest]:g}, which no machine needs"
        remarks.doubt(found.values[largest].line, text, "values are in mm and degree, not um")
    slopes = np.abs(np.diff(table.values)) / table.step
    place = int(np.argmax(slopes))
    if slopes[place] > STEEP:
        text = f"the value changes by {slopes[place]:.3g} per unit of length from the one before"
        remarks.doubt(found.values[place + 1].line, text, "a slip of the digits?")
