"""Measurement files: text to `Measurement`, with every fault of the file named at once.

The text is split into a head (comment lines), the names of the columns, and rows of cells; each is read with its
faults noted. What is well formed but odd is looked at afterwards, in `ncfix.measure.checks`.
"""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Iterable

import numpy as np

from ncfix import files
from ncfix.diagnostics import ConfigError, Place
from ncfix.machine import Machine
from ncfix.machine.fields import LARGEST, did_you_mean
from ncfix.measure import checks, headers
from ncfix.measure.kinds import KINDS, STATES, Kind
from ncfix.measure.lines import Cell, Text
from ncfix.measure.measurement import Array, Measurement

SEPARATED = "cells are separated by commas, numbers have a decimal point"
COMMA = re.compile(r"[-+]?\d+,\d+")
LABELS = ("set", "repeat")
"""Columns of labels that any kind may have."""


def read(path: str, machine: Machine, plan: bool = False) -> Measurement:
    """The measurement in a file; see `reads`. Raises `SourceError` NCF002 if it cannot be read."""
    return reads(files.read_bytes(path), machine, path, plan)


def reads(source: bytes, machine: Machine, path: str = "<measurement>", plan: bool = False) -> Measurement:
    """The measurement in a text, of this machine.

    plan  the file is a plan to be filled in: measured columns may be missing or empty. Empty ones are left out; where a
          kind has some of its columns or others, they are NaN, since they say which of them will be filled in.

    Raises `ConfigError` with NCF600 ... NCF616, all faults at once. Instruments' own formats are recognised by what
    they look like, see `ncfix.measure.foreign`.
    """
    from ncfix.measure import foreign

    text = _decoded(source, path)
    if not text.startswith("#"):
        found = foreign.recognised(text, machine, path)
        if found is not None:
            return found
    lines = Text(path, text.splitlines())
    measurement = _measurement(lines, machine, plan)
    return checks.checked(measurement, machine, lines.lines)


def _decoded(source: bytes, path: str) -> str:
    if source.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise ConfigError.of("NCF600", "the text is in UTF-16", Place(path), "save it as UTF-8")
    if b"\0" in source:
        raise ConfigError.of("NCF600", "not a text file", Place(path), "a measurement file is comma-separated text")
    try:
        return source.decode("utf-8-sig")
    except UnicodeDecodeError:
        return source.decode("latin-1")


def _measurement(text: Text, machine: Machine, plan: bool) -> Measurement:
    pairs = headers.read(text)
    kind = headers.kind_of(text, pairs)
    text.stop()
    form = KINDS[kind]
    headers.check(text, pairs, kind)
    start = next((i for i, line in enumerate(text.lines) if line.strip() and not line.startswith("#")), None)
    if start is None:
        text.note("NCF609", "there are no columns and no rows", len(text.lines))
        text.stop()
    assert start is not None
    headers.stray(text, start, kind)
    names = _cells(text.lines[start], start + 1)
    if _separated_otherwise(names):
        text.note("NCF604", "the columns are not separated by commas", start + 1, 0, SEPARATED)
        text.stop()
    _check_names(text, names, form, machine, plan)
    rows = _rows(text, names, start)
    text.stop()
    columns, labels = _columns(text, [name.text for name in names], rows, form, plan)
    text.stop()
    found = np.array([row[0].line for row in rows], dtype=np.int64)
    notes = tuple((key.text, value.text) for key, value in pairs)
    return Measurement(kind, notes, columns, labels, found, text.path)


def _cells(line: str, number: int) -> list[Cell]:
    """The cells of a line with their columns; a spreadsheet's quotes round a cell are taken off."""
    cells, column = [], 1
    for part in line.split(","):
        text, at = part.strip(), column + len(part) - len(part.lstrip())
        quoted = len(text) > 1 and text[0] == text[-1] == '"'
        cells.append(Cell(text[1:-1].strip(), number, at + 1) if quoted else Cell(text, number, at))
        column += len(part) + 1
    return cells


def _check_names(text: Text, names: list[Cell], form: Kind, machine: Machine, plan: bool) -> None:
    """Note columns that are unknown, there twice, or missing; a plan lacks what will be measured."""
    known = {*machine.axis_names, *form.columns, *form.labels, *LABELS, *machine.inputs, "tool_length", "time_s"}
    known |= {f"dir_{axis}" for axis in machine.axis_names}
    seen: set[str] = set()
    for name in names:
        if name.text in seen:
            text.note("NCF604", f"column {name.text!r} is there twice", name.line, name.column)
        seen.add(name.text)
        if name.text not in known and not STATES.fullmatch(name.text):
            _unknown_name(text, name, known, form, machine)
    if form.name == "length":
        _check_length_form(text, seen, names[0].line)
    if form.name == "probe" or (form.name == "length" and "ax" in seen):
        _check_named_once(text, names, form)
    _check_missing(text, seen, form, names[0].line, plan)


def _check_missing(text: Text, seen: set[str], form: Kind, line: int, plan: bool) -> None:
    wanted = form.required if plan or form.any_of else (*form.required, *form.measured)
    for missing in [each for each in wanted if each not in seen]:
        text.note("NCF605", f"kind {form.name} has a column {missing!r}", line)
    if form.any_of and not plan and not seen & set(form.measured):
        one = ", ".join(form.measured)
        text.note("NCF605", f"kind {form.name} has at least one of {one}", line)


def _unknown_name(text: Text, name: Cell, known: set[str], form: Kind, machine: Machine) -> None:
    axis = name.text.removeprefix("dir_")
    if len(axis) == 1 and axis.isalpha() and axis.isupper():
        has = " ".join(machine.axis_names)
        text.note("NCF610", f"the machine has no axis {axis}, only {has}", name.line, name.column)
        return
    if not name.text:
        text.note("NCF604", "a column without a name", name.line, name.column, "is there a comma too many?")
        return
    hint = did_you_mean(name.text, known) or f"kind {form.name} has {', '.join(form.columns)}"
    text.note("NCF604", f"unknown column {name.text!r}", name.line, name.column, hint)


def _separated_otherwise(names: list[Cell]) -> bool:
    """Whether columns are separated by something else than commas."""
    return len(names) == 1 and any(mark in names[0].text for mark in ";\t")


def _check_length_form(text: Text, seen: set[str], line: int) -> None:
    gauge, bar = {"ax", "ay", "az", "bx", "by", "bz"}, {"cx", "cy", "cz", "radius"}
    if gauge <= seen and not bar & seen:
        return
    if bar <= seen and not gauge & seen:
        return
    forms = "ax,ay,az,bx,by,bz,length[,nominal] or cx,cy,cz,radius,length"
    text.note("NCF605", f"kind length has the columns {forms}", line)


def _check_named_once(text: Text, names: list[Cell], form: Kind) -> None:
    """Note columns of linear axes where other columns say how these stand."""
    instead = "mx, my, mz" if form.name == "probe" else "ax, ay, az and bx, by, bz"
    for name in names:
        if name.text in ("X", "Y", "Z"):
            text.note("NCF604", f"column {name.text!r} beside {instead}, which say it", name.line, name.column)


def _rows(text: Text, names: list[Cell], start: int) -> list[list[Cell]]:
    rows = []
    for number, line in enumerate(text.lines[start + 1 :], start + 2):
        if not line.strip() or line.startswith("#"):
            continue
        cells = _cells(line, number)
        if len(cells) != len(names):
            hint = "a number has a decimal point, not a comma" if COMMA.search(line) and len(cells) > len(names) else ""
            text.note("NCF606", f"{len(cells)} cells, there are {len(names)} columns", number, 0, hint)
        rows.append(cells)
    if not rows:
        text.note("NCF609", "there are columns but no rows", start + 1)
    return rows


def _columns(
    text: Text, names: list[str], rows: list[list[Cell]], form: Kind, plan: bool
) -> tuple[dict[str, Array], dict[str, tuple[str, ...]]]:
    columns: dict[str, Array] = {}
    labels: dict[str, tuple[str, ...]] = {}
    for index, name in enumerate(names):
        cells = [row[index] for row in rows]
        if name in form.measured and not any(cell.text for cell in cells):
            if not plan:
                said = f"column {name!r} is empty in all rows"
                text.note(
                    "NCF607", said, cells[0].line, cells[0].column, "fill it in, or leave it out if it was not measured"
                )
            columns |= {name: np.full(len(cells), math.nan)} if form.any_of or not plan else {}
            continue
        if name in (*LABELS, *form.labels):
            labels[name] = tuple(_label(text, cell, name) for cell in cells)
        else:
            columns[name] = _numbers(text, cells, name)
    return columns, labels


def _label(text: Text, cell: Cell, name: str) -> str:
    if not cell.text:
        text.note("NCF607", f"column {name!r} is empty in this row", cell.line, cell.column)
    return cell.text


def _numbers(text: Text, cells: Iterable[Cell], name: str) -> Array:
    return np.array([_number(text, cell, name) for cell in cells])


def _number(text: Text, cell: Cell, name: str) -> float:
    if not cell.text:
        text.note("NCF607", f"column {name!r} is empty in this row", cell.line, cell.column)
        return math.nan
    try:
        value = float(cell.text.replace("_", "?"))
    except ValueError:
        text.note("NCF608", f"column {name!r}: {cell.text!r} is not a number", cell.line, cell.column)
        return math.nan
    if not math.isfinite(value):
        text.note("NCF608", f"column {name!r}: {cell.text} is not a finite number", cell.line, cell.column)
    elif abs(value) > LARGEST:
        text.note(
            "NCF608", f"column {name!r}: {cell.text} is more than anything that is measured", cell.line, cell.column
        )
    return value
