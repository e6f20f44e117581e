"""A compensation table of SINUMERIK, and writers and readers of its files (CEC and EEC) with remarks on faults.

CEC, `%_N_NC_CEC_INI`: any axis over any axis. EEC (LEC), `%_N_AX1_EEC_INI`: an encoder over its own axis; its values
are errors.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from ncfix.arrays import Array
from ncfix.tables.grid import Grid
from ncfix.tables.table_files import Remarks
from ncfix.values import frozen
from ncfix_siemens.assignments import ArrayAssignment, Assigned, FileRow, assignments

DIGITS = 7
"""Decimals of values: 0.1 nm, so that factors of products keep theirs."""
PLACES = 4
"""Decimals of positions."""
BOTH = 0
CEC_FIELDS = ("INPUT_AXIS", "OUTPUT_AXIS", "STEP", "MIN", "MAX", "DIRECTION", "MULT_BY_TABLE", "IS_MODULO")
NEEDED = CEC_FIELDS[:5]
LINKS = ("INPUT_NCU", "OUTPUT_NCU")
CEC_VALUE = "AN_CEC"
STEEP = 0.01
"""Largest plausible slope of a table, mm per mm."""
CLEARLY = 1.001
"""Ratio of the largest negative to the largest positive value from which a multiplier gets a remark."""
BOTH_WAYS = 0
FLIPPED = "ncfix writes it positive; a sign that is turned in both factors of a pair turns nothing"
LARGE = 1.0
"""Largest plausible value, mm or degree; larger ones are probably in another unit."""
EEC_FIELDS = ("STEP", "MIN", "MAX", "IS_MODULO")
EEC_VALUE = "AA_ENC_COMP"


@frozen
class CecTable:
    """A table: values at evenly spaced positions of an axis.

    index      index of the table (CEC), or of the encoder (EEC)
    input      machine axis that is looked up, e.g. AX1
    output     machine axis that is corrected
    low, step  first position and spacing, mm or degree
    values     (k + 1,) mm or degree; without unit for a multiplier
    direction  0: always active; 1, -1: only while the input axis moves in this direction
    multiply   number (index + 1) of the table by which it is multiplied; 0: none
    modulo     whether the values repeat
    """

    index: int
    input: str
    output: str
    low: float
    step: float
    values: Array
    direction: int = BOTH
    multiply: int = 0
    modulo: bool = False

    @property
    def high(self) -> float:
        """The last position."""
        return round(self.low + self.step * (len(self.values) - 1), PLACES)

    @property
    def positions(self) -> Array:
        """All positions, (k + 1,)."""
        return self.low + self.step * np.arange(len(self.values), dtype=np.float64)

    def grid(self, input_name: str, output_name: str, factor: float, input_unit: float) -> Grid:
        """The table with its values times a factor, over positions in mm or rad."""
        nodes: Array = self.positions * input_unit
        values: Array = (self.values * factor)[:, None]
        return Grid((input_name,), (nodes,), (output_name,), values, (self.modulo,))


def number(value: float, digits: int = DIGITS) -> str:
    """A number as short text with at most `digits` decimals, always with a decimal point."""
    text = f"{round(value, digits) + 0.0:.{digits}f}".rstrip("0")
    return f"{text}0" if text.endswith(".") else text


@frozen
class CecStyle:
    """Optional forms of a CEC file: axis names in brackets, a METRIC line, a path line."""

    brackets: bool = True
    metric: bool = False
    path: str = ""


def cec_text(tables: Iterable[CecTable], heads: Iterable[str], titles: Mapping[int, str], style: CecStyle) -> bytes:
    """The CEC file; heads: comments at the top; titles: index of a table -> comment before it."""
    lines = ["%_N_NC_CEC_INI"]
    lines += [f";$PATH={style.path}"] if style.path else []
    lines += ["METRIC"] if style.metric else []
    lines += ["CHANDATA(1)", *(f"; {head}" for head in heads)]
    for table in tables:
        lines += [f"; {titles[table.index]}"] if table.index in titles else []
        lines += _assigned(table, style)
    return "".join(f"{line}\n" for line in [*lines, "M17"]).encode()


def _assigned(table: CecTable, style: CecStyle) -> Iterator[str]:
    for place, value in enumerate(table.values.tolist()):
        yield f"$AN_CEC[{table.index},{place}]={number(value)}"
    names = (f"({name})" if style.brackets else name for name in (table.input, table.output))
    sizes = (number(value, PLACES) for value in (table.step, table.low, table.high))
    whole = (str(value) for value in (table.direction, table.multiply, int(table.modulo)))
    for field, value in zip(CEC_FIELDS, (*names, *sizes, *whole), strict=True):
        yield f"$AN_CEC_{field}[{table.index}]={value}"


def read_cec(lines: Iterable[FileRow], remarks: Remarks) -> list[CecTable]:
    """The CEC tables of a file, by index, with remarks; incomplete tables are skipped."""
    found: dict[int, Assigned] = {}
    for assignment in assignments(lines, remarks):
        name = assignment.name.upper()
        field = name.removeprefix(f"{CEC_VALUE}_")
        wanted = 2 if name == CEC_VALUE else 1
        if field in LINKS:
            remarks.doubt(assignment.line, f"${assignment.name}: axes of other control units are not followed")
        elif name != CEC_VALUE and field not in CEC_FIELDS:
            remarks.refuse(assignment.line, f"${assignment.name} is not a variable of these tables")
        elif len(assignment.indices) != wanted or not all(each.strip().isdecimal() for each in assignment.indices):
            text = f"${assignment.name} takes {wanted} whole number{'s' * (wanted > 1)} in its brackets"
            remarks.refuse(assignment.line, text)
        else:
            index, *number = (int(text) for text in assignment.indices)
            place, names = f"$AN_CEC[{index},{{}}]", f"$AN_CEC_{{}}[{index}]"
            table = found.setdefault(index, Assigned(f"table {index + 1}", place, names, remarks))
            table.put(number[0] if number else field, assignment)
    tables = [_cec_table(index, found[index], remarks) for index in sorted(found)]
    good = [table for table in tables if table is not None]
    _look_at_products(good, found, remarks)
    return good


def _cec_table(index: int, table: Assigned, remarks: Remarks) -> CecTable | None:
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
    return CecTable(index, source, output, low, step, values, direction, multiply, modulo)


def _axis(assignment: ArrayAssignment, remarks: Remarks) -> str:
    name = assignment.value.strip().removeprefix("(").removesuffix(")").strip()
    if not name.replace("_", "").isalnum():
        remarks.refuse(assignment.line, f"{assignment.value!r} is not the name of an axis")
    return name.upper()


def _look_at_products(tables: Iterable[CecTable], found: Mapping[int, Assigned], remarks: Remarks) -> None:
    by_number = {table.index + 1: table for table in tables}
    pointed = {table.multiply for table in by_number.values() if table.multiply}
    for own, table in by_number.items():
        if table.multiply:
            line = found[table.index].fields["MULT_BY_TABLE"].line
            _look_at_pair(table, by_number.get(table.multiply), line, remarks)
        if not (table.multiply or own in pointed):
            _look_at_sizes(table, found[table.index], remarks)


def _look_at_pair(table: CecTable, other: CecTable | None, line: int, remarks: Remarks) -> None:
    if other is None:
        text = f"table {table.index + 1} is multiplied by table {table.multiply}, which does not exist"
        remarks.refuse(line, text, "the number of a table is its index + 1")
        return
    if other.output != table.output:
        text = f"table {table.index + 1} is for {table.output}, the table that it is multiplied by for {other.output}"
        remarks.refuse(line, text, "both factors have the same output axis")
    if other.direction != BOTH_WAYS:
        remarks.refuse(
            line,
            f"table {table.multiply} multiplies others and acts in one direction only; what the "
            "control does then is not published",
        )
    if other.multiply:
        remarks.doubt(
            line, f"table {table.multiply} is itself multiplied by another; what the control does then is not published"
        )
    if other is not table and -other.values.min() > CLEARLY * other.values.max():
        remarks.doubt(line, f"the largest value of the multiplier, table {table.multiply}, is negative", FLIPPED)


def _look_at_sizes(table: CecTable, found: Assigned, remarks: Remarks) -> None:
    """Note implausibly large values and jumps in a table that is added."""
    largest = int(np.argmax(np.abs(table.values)))
    if abs(table.values[largest]) > LARGE:
        text = f"a value of {table.values[largest]:g}, which is larger than any machine needs"
        remarks.doubt(found.values[largest].line, text, "values are in mm and degree, not um")
    slopes = np.abs(np.diff(table.values)) / table.step
    place = int(np.argmax(slopes))
    if slopes[place] > STEEP:
        text = f"the value changes by {slopes[place]:.3g} per unit of length from the one before"
        remarks.doubt(found.values[place + 1].line, text, "check this value for a typing error")


def eec_text(table: CecTable, heads: Iterable[str]) -> bytes:
    """The EEC file of one encoder."""
    axis, encoder = table.output, table.index
    lines = [f"%_N_{axis}_EEC_INI", "CHANDATA(1)", *(f"; {head}" for head in heads)]
    lines += [f"$AA_ENC_COMP[{encoder},{n},{axis}]={number(value)}" for n, value in enumerate(table.values.tolist())]
    sizes = [number(value, PLACES) for value in (table.step, table.low, table.high)]
    for field, value in zip(EEC_FIELDS, (*sizes, str(int(table.modulo))), strict=True):
        lines.append(f"$AA_ENC_COMP_{field}[{encoder},{axis}]={value}")
    return "".join(f"{line}\n" for line in [*lines, "M17"]).encode()


def read_eec(lines: Iterable[FileRow], remarks: Remarks) -> list[CecTable]:
    """The EEC tables of a file, with remarks; incomplete tables are skipped."""
    found: dict[tuple[int, str], Assigned] = {}
    for assignment in assignments(lines, remarks):
        name = assignment.name.upper()
        field = name.removeprefix(f"{EEC_VALUE}_")
        *numbers, axis = assignment.indices
        wanted = 2 if name == EEC_VALUE else 1
        if name != EEC_VALUE and field not in EEC_FIELDS:
            remarks.refuse(assignment.line, f"${assignment.name} is not a variable of these tables")
        elif len(numbers) != wanted or not all(each.strip().isdecimal() for each in numbers):
            inside = "encoder, number and axis" if wanted == 2 else "encoder and axis"
            remarks.refuse(assignment.line, f"${assignment.name} takes {inside} in its brackets")
        else:
            encoder, axis = int(numbers[0]), axis.strip().upper()
            place, names = f"$AA_ENC_COMP[{encoder},{{}},{axis}]", f"$AA_ENC_COMP_{{}}[{encoder},{axis}]"
            table = found.setdefault((encoder, axis), Assigned(axis, place, names, remarks))
            table.put(int(numbers[1]) if wanted == 2 else field, assignment)
    tables = [_eec_table(*key, found[key], remarks) for key in sorted(found)]
    return [table for table in tables if table is not None]


def _eec_table(encoder: int, axis: str, table: Assigned, remarks: Remarks) -> CecTable | None:
    before = len(remarks.wrong)
    if table.lacks(EEC_FIELDS[:3]):
        return None
    modulo = bool(table.choice("IS_MODULO", (0, 1)))
    values = table.curve(modulo)
    if values is None or len(remarks.wrong) > before:
        return None
    return CecTable(encoder, axis, axis, table.number("MIN"), table.number("STEP"), values, modulo=modulo)
