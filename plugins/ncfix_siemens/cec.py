"""CEC files, `%_N_NC_CEC_INI`: text from tables, and tables from text with remarks on what is wrong in it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from ncfix.tables.lines import Remarks
from ncfix_siemens.syntax import Assignment, Line, assignments
from ncfix_siemens.table import PLACES, Table, number

FIELDS = ("INPUT_AXIS", "OUTPUT_AXIS", "STEP", "MIN", "MAX", "DIRECTION", "MULT_BY_TABLE", "IS_MODULO")
NEEDED = FIELDS[:5]
VALUE = "AN_CEC"
WHOLE = 1e-6
"""How far from a whole number (MAX - MIN) / STEP may be."""
STEEP = 0.01
"""mm per mm: no machine errs that fast."""
MOST = 100_000
"""Points of a table, beyond any control's."""
CLEARLY = 1.001
"""How much larger than the largest positive value the largest negative one must be to be remarked on."""
BOTH_WAYS = 0
Key = TypeVar("Key", int, str)
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


@dataclass(slots=True)
class _Found:
    """The assignments of one table."""

    fields: dict[str, Assignment]
    values: dict[int, Assignment]


def read_cec(lines: Iterable[Line], remarks: Remarks) -> list[Table]:
    """The tables of a file, by index, with remarks; a table that is not complete is left out."""
    found: dict[int, _Found] = {}
    for each in assignments(lines, remarks):
        _sort(each, found, remarks)
    tables = [_table(index, found[index], remarks) for index in sorted(found)]
    good = [table for table in tables if table is not None]
    _look_at_products(good, found, remarks)
    return good


def _sort(each: Assignment, found: dict[int, _Found], remarks: Remarks) -> None:
    name = each.name.upper()
    field = name.removeprefix(f"{VALUE}_")
    wanted = 2 if name == VALUE else 1
    if name != VALUE and field not in FIELDS:
        remarks.refuse(each.line, f"${each.name} is not a variable of these tables")
        return
    if len(each.indices) != wanted or not all(index.strip().isdecimal() for index in each.indices):
        remarks.refuse(each.line, f"${each.name} takes {wanted} whole number{'s' * (wanted > 1)} in its brackets")
        return
    numbers = [int(index) for index in each.indices]
    table = found.setdefault(numbers[0], _Found({}, {}))
    if name == VALUE:
        _put(table.values, numbers[1], each, remarks)
    else:
        _put(table.fields, field, each, remarks)


def _put(place: dict[Key, Assignment], key: Key, each: Assignment, remarks: Remarks) -> None:
    if key in place:
        remarks.doubt(each.line, "is assigned twice: the control keeps the last", "a slip?")
    place[key] = each


def _table(index: int, found: _Found, remarks: Remarks) -> Table | None:
    before = len(remarks.wrong)
    gone = [field for field in NEEDED if field not in found.fields]
    if gone:
        first = next(iter([*found.values.values(), *found.fields.values()]))
        names = ", ".join(f"$AN_CEC_{field}[{index}]" for field in gone)
        remarks.refuse(first.line, f"table {index + 1} has no {names}: the control keeps what it had")
        return None
    axes = [_axis(found.fields[field], remarks) for field in ("INPUT_AXIS", "OUTPUT_AXIS")]
    step, low, high = (_number(found.fields[field], remarks) for field in ("STEP", "MIN", "MAX"))
    direction, multiply, modulo = (_whole(found.fields.get(field), remarks) for field in FIELDS[5:])
    if len(remarks.wrong) == before:
        last = _last(found, low, high, step, remarks)
        values = _values(index, found, last, remarks) if last else {}
        _look_at_switches(found, direction, modulo, remarks)
    if len(remarks.wrong) > before:
        return None
    table = Table(index, axes[0], axes[1], low, step, np.array([values[n] for n in range(last + 1)]))
    table = Table(index, axes[0], axes[1], low, step, table.values, direction, multiply, bool(modulo))
    if modulo and abs(table.values[0] - table.values[-1]) > 1e-6:
        remarks.doubt(found.values[last].line, f"table {index + 1} repeats, but ends on another value than it begins")
    return table


def _axis(each: Assignment, remarks: Remarks) -> str:
    name = each.value.strip().removeprefix("(").removesuffix(")").strip()
    if not name.replace("_", "").isalnum():
        remarks.refuse(each.line, f"{each.value!r} is not the name of an axis")
    return name.upper()


def _number(each: Assignment, remarks: Remarks) -> float:
    if each.number is None:
        comma = "a decimal comma" if "," in each.value else f"{each.value!r} is not a number"
        remarks.refuse(each.line, comma, "a decimal point")
        return 0.0
    return each.number


def _whole(each: Assignment | None, remarks: Remarks) -> int:
    value = 0.0 if each is None else _number(each, remarks)
    if each is not None and value != int(value):
        remarks.refuse(each.line, f"{each.value} is not a whole number")
    return int(value)


def _last(found: _Found, low: float, high: float, step: float, remarks: Remarks) -> int:
    """k = (MAX - MIN) / STEP, 0 if there is none."""
    if step <= 0 or high <= low:
        remarks.refuse(found.fields["STEP"].line, f"a step of {step:g} from {low:g} to {high:g}")
        return 0
    steps = (high - low) / step
    if steps > MOST:
        remarks.refuse(found.fields["STEP"].line, f"(MAX - MIN) / STEP is {steps:.6g}: no control has so many points")
        return 0
    if abs(steps - round(steps)) > WHOLE:
        text = f"(MAX - MIN) / STEP is {steps:.6g}, not a whole number: the control would move the end"
        remarks.refuse(found.fields["STEP"].line, text)
        return 0
    return round(steps)


def _values(index: int, found: _Found, last: int, remarks: Remarks) -> dict[int, float]:
    beyond = [each for place, each in sorted(found.values.items()) if place > last]
    if beyond:
        text = f"table {index + 1} has values 0 to {last} by its MIN, MAX and STEP; this one is ignored"
        remarks.refuse(beyond[0].line, text, "one value too many, or MAX too small")
    gone = [place for place in range(last + 1) if place not in found.values]
    if gone:
        line = found.fields["STEP"].line
        text = f"{len(gone)} of {last + 1} values of table {index + 1} are missing, first $AN_CEC[{index},{gone[0]}]"
        remarks.refuse(line, f"{text}: the control keeps what it had there")
    return {place: _number(each, remarks) for place, each in found.values.items()}


def _look_at_switches(found: _Found, direction: int, modulo: int, remarks: Remarks) -> None:
    if direction not in (-1, 0, 1):
        remarks.refuse(found.fields["DIRECTION"].line, f"direction {direction}", "0 both, 1 positive, -1 negative")
    if modulo not in (0, 1):
        remarks.refuse(found.fields["IS_MODULO"].line, f"modulo {modulo}", "0 or 1")


def _look_at_products(tables: Iterable[Table], found: Mapping[int, _Found], remarks: Remarks) -> None:
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


def _look_at_sizes(table: Table, found: _Found, remarks: Remarks) -> None:
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
