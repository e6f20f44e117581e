"""EEC (LEC) files, `%_N_AX1_EEC_INI`: what is wrong with an axis over its own position. Values are errors."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ncfix.tables.lines import Remarks
from ncfix_siemens.syntax import Assignment, Line, assignments
from ncfix_siemens.table import PLACES, Table, number

FIELDS = ("STEP", "MIN", "MAX", "IS_MODULO")
VALUE = "AA_ENC_COMP"
WHOLE = 1e-6
MOST = 100_000


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
    values: dict[tuple[int, str], dict[int, Assignment]] = {}
    fields: dict[tuple[int, str], dict[str, Assignment]] = {}
    for each in assignments(lines, remarks):
        name = each.name.upper()
        field = name.removeprefix(f"{VALUE}_")
        wanted = 3 if name == VALUE else 2
        if name != VALUE and field not in FIELDS:
            remarks.refuse(each.line, f"${each.name} is not a variable of these tables")
        elif len(each.indices) != wanted or not all(index.strip().isdecimal() for index in each.indices[:-1]):
            inside = "encoder, number and axis" if wanted == 3 else "encoder and axis"
            remarks.refuse(each.line, f"${each.name} takes {inside} in its brackets")
        else:
            key = int(each.indices[0]), each.indices[-1].strip().upper()
            if name == VALUE:
                values.setdefault(key, {})[int(each.indices[1])] = each
            else:
                fields.setdefault(key, {})[field] = each
    keys = sorted({*values, *fields})
    tables = [_table(key, values.get(key, {}), fields.get(key, {}), remarks) for key in keys]
    return [table for table in tables if table is not None]


def _table(
    key: tuple[int, str], values: dict[int, Assignment], fields: dict[str, Assignment], remarks: Remarks
) -> Table | None:
    encoder, axis = key
    before = len(remarks.wrong)
    gone = [field for field in FIELDS[:3] if field not in fields]
    if gone:
        names = ", ".join(f"$AA_ENC_COMP_{field}" for field in gone)
        remarks.refuse(0, f"{axis} has no {names}: the control keeps what it had")
        return None
    for each in [*values.values(), *fields.values()]:
        if each.number is None:
            comma = "a decimal comma" if "," in each.value else f"{each.value!r} is not a number"
            remarks.refuse(each.line, comma, "a decimal point")
    if len(remarks.wrong) > before:
        return None
    step, low, high = (float(fields[field].value) for field in FIELDS[:3])
    line = fields["STEP"].line
    steps = (high - low) / step if step > 0 else 0.0
    if not 0 < steps < MOST or abs(steps - round(steps)) > WHOLE:
        remarks.refuse(line, f"(MAX - MIN) / STEP is {steps:.6g}, not a whole number above zero")
        return None
    last = round(steps)
    for place in sorted(place for place in values if place > last)[:1]:
        remarks.refuse(values[place].line, f"{axis} ends with value {last}; this one is ignored", "one value too many")
    missing = [place for place in range(last + 1) if place not in values]
    if missing:
        first = f"$AA_ENC_COMP[{encoder},{missing[0]},{axis}]"
        remarks.refuse(line, f"{len(missing)} of {last + 1} values of {axis} are missing, first {first}")
    if len(remarks.wrong) > before:
        return None
    modulo = "IS_MODULO" in fields and float(fields["IS_MODULO"].value) == 1
    found = np.array([float(values[place].value) for place in range(last + 1)])
    if modulo and abs(found[0] - found[-1]) > 1e-6:
        remarks.doubt(values[last].line, f"{axis} repeats, but ends on another value than it begins")
    return Table(encoder, axis, axis, low, step, found, modulo=modulo)
