"""Reader of measurement files: text to `Measurement`, with all faults of the file reported at once.

The text has a head (lines `# key: value`), a line of column names, and rows of cells. Well-formed but implausible
contents are checked afterwards, in `ncfix.measure.checks`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import field, replace

import numpy as np

from ncfix import files
from ncfix.arrays import Array
from ncfix.cells import MARKS, Cell, SeparatedText, other_form, plain_text
from ncfix.diagnostics import ConfigError, Message, Place
from ncfix.machine import Machine
from ncfix.measure import checks, foreign
from ncfix.measure.measurement import CENTRE, CHOICES, COMMON, ENDS, KINDS, STATES, Measurement, MeasurementKind
from ncfix.toml_text import MAX_NUMBER, did_you_mean
from ncfix.values import mutable

SHOWN = 25
"""Largest number of faults that are reported one by one."""
VERSION = 1
NUMBERS = {"noise_um": 1, "noise_urad": 1, "point": 3}
"""Header key -> number of numbers in its value."""
ONCE = ("ncfix-measurement", "kind", "noise_um", "noise_urad", "point", "frame", "setup", "sense", "carried_by")
"""Header keys that may occur only once."""
NAMED = {"distance": (2, 2), "target": (1, 3)}
"""Header key -> numbers of names and of numbers in its value, such as `distance: 1 2 304.6686 0.0012`."""
COMMA = re.compile(r"[-+]?\d+,\d+")
QUOTED = re.compile(r'^"(#[^"]*)"')
"""A header line as spreadsheets write it that quote every text."""
NOT_READ = "leave out the row if this was not read"
UNITS = r"mm|cm|m|in|inch|deg|degrees?|\u00b0|m?rad|[u\u00b5\u03bc](?:m|rad)|arcsec|as|\"|''|s|sec"
"""As units are written; the micro sign has two characters."""
ODD_CELLS = (
    (re.compile(r"-+|\.+|\?+|[nN][/.]?[aA]\.?|#.*|(?i:[-+]?nan|null|none|missing|error|inf)"), NOT_READ),
    (re.compile(rf"[\[(]?({UNITS})[\])]?"), "remove the line with units: lengths are in mm, angles of axes in degrees"),
    (
        re.compile(rf"[-+]?[\d.,]+\s*({UNITS})"),
        "write the number without a unit: lengths are in mm, angles of axes in degrees",
    ),
    (re.compile(r"[-+]?\d{1,3}(?:[.,'\s\u2019]\d{3})+(?:[.,]\d*)?"), "write it without thousands separators"),
    (re.compile(r"[\u2010-\u2015\u2212][\d.,]+"), "write a minus sign as -"),
)
"""Cells that are no numbers, as instruments and people write them, and what helps."""
NAME_AND_UNIT = re.compile(rf"(\w+?)[\s_/]*[\[(]?\s*({UNITS})\s*[\])]?")
LABELS = ("set", "repeat")
"""Columns of labels that every kind may have."""


def read(path: str, machine: Machine, plan: bool = False) -> Measurement:
    """The measurement in a file; see `reads`. Raises `SourceError` NCF002 if it cannot be read."""
    return reads(files.read_bytes(path), machine, path, plan)


def reads(source: bytes, machine: Machine, path: str = "<measurement>", plan: bool = False) -> Measurement:
    """The measurement in a text, for this machine.

    plan  the file is a plan to be filled in: measured columns may be missing or empty. Empty ones are dropped, except
          for kinds with a choice of measured columns: there they are NaN, and state which will be filled in.

    Raises `ConfigError` with NCF600 ... NCF616, all faults at once. Formats of instruments are recognised by their
    content, see `ncfix.measure.foreign`.
    """
    text = plain_text(source)
    found = foreign.recognised(text, machine, path) if text is not None and not text.startswith("#") else None
    if found is not None:
        return found
    what, hint = other_form(source)
    if text is None or what:
        said = f"{what}, not a measurement file" if what else "not a text file"
        raise ConfigError.of("NCF600", said, Place(path), hint or "save it as CSV")
    rows = [QUOTED.sub(r"\1", line) for line in text.splitlines()]
    lines = MeasurementLines(path, rows, not text.endswith(("\n", "\r")))
    measurement = _measurement(lines, machine, plan)
    checked = checks.checked(measurement, machine, lines.lines)
    return _sensed(checked, machine) if measurement.kind == "axis" else checked


def _sensed(measurement: Measurement, machine: Machine) -> Measurement:
    """The measurement with positioning errors converted to the sense of the body (header `sense`); with a remark if a
    table axis is affected and the header does not state the sense.
    """
    if "value" not in measurement.columns:
        return measurement.with_header("sense", "body")  # a plan, which is filled in so
    if measurement.header("sense") == "axis":
        return foreign.of_bodies(measurement, machine).with_header("sense", "body")
    if any(key == "sense" for key, _ in measurement.headers):
        return measurement
    remarks = foreign.backwards(measurement, machine, "NCF626", "add a line `# sense: axis` or `# sense: body`")
    return replace(measurement, remarks=(*measurement.remarks, *remarks))


def _measurement(text: MeasurementLines, machine: Machine, plan: bool) -> Measurement:
    pairs = _header_lines(text)
    kind = _kind_of(text, pairs)
    text.stop()
    form = KINDS[kind]
    _check_header(text, pairs, kind)
    start = next((i for i, line in enumerate(text.lines) if line.strip() and not line.startswith("#")), None)
    if start is None:
        text.note("NCF609", "the file has no columns and no rows", len(text.lines))
        text.stop()
    assert start is not None
    _note_stray(text, start, kind)
    text.separated = SeparatedText.of(text.lines[start])
    names = text.separated.cells(text.lines[start], start + 1)
    _check_names(text, names, form, machine, plan)
    rows = _rows(text, names, start)
    text.stop()
    columns, labels = _columns(text, [name.text for name in names], rows, form, plan)
    text.stop()
    found = np.array([row[0].line for row in rows], dtype=np.int64)
    notes = tuple((key.text, value.text) for key, value in pairs)
    return Measurement(kind, notes, columns, labels, found, text.path, _open_end(text, [row[-1] for row in rows]))


def _open_end(text: MeasurementLines, last: list[Cell]) -> tuple[Message, ...]:
    """Remark NCF619 if the file may be cut off: no line end, and fewer decimals in the last number than above it."""
    decimals = [len(re.sub(r"^[^.,]*[.,]?", "", cell.text)) for cell in last]
    if not text.open_end or len(last) < 2 or decimals[-1] >= min(decimals[:-1]):
        return ()
    place = Place(text.path, last[-1].line, last[-1].column, text.lines[last[-1].line - 1])
    said = (
        f"the file ends within a line, and its last number, {last[-1].text!r}, has fewer decimals than the numbers "
        "above it"
    )
    return (Message("NCF619", said, place, "check whether the file was cut off; if not, add a line end"),)


@mutable
class MeasurementLines:
    """The lines of a file and the faults noted so far; open_end: the last line has no line end."""

    path: str
    lines: list[str]
    open_end: bool = False
    messages: list[Message] = field(default_factory=list)
    separated: SeparatedText = field(default_factory=lambda: SeparatedText(","))

    def note(self, code: str, text: str, line: int = 0, column: int = 0, hint: str = "") -> None:
        """Note a fault at a line and column, counted from 1."""
        source = self.lines[line - 1] if line else ""
        self.messages.append(Message(code, text, Place(self.path, line, column, source), hint))

    def mark(self, cell: Cell, code: str, text: str, hint: str = "") -> None:
        """Note a fault at a cell."""
        self.note(code, text, cell.line, cell.column, hint)

    def stop(self) -> None:
        """Raise `ConfigError` with all noted faults, if there are any."""
        if self.messages:
            self.messages.sort(key=lambda each: (each.place.line, each.place.column) if each.place else (0, 0))
            more = len(self.messages) - SHOWN
            rest = [Message(self.messages[0].code, f"{more} more faults", Place(self.path))] if more > 0 else []
            raise ConfigError.collected([*self.messages[:SHOWN], *rest])


# -- the head ----------------------------------------------------------------------------------------------------------


def _header_lines(text: MeasurementLines) -> list[tuple[Cell, Cell]]:
    """Key and value cells of the header lines above the columns; comments without a colon are skipped."""
    pairs = []
    for number, line in enumerate(text.lines, 1):
        if line.strip() and not line.startswith("#"):
            break
        key, colon, value = line.rstrip(MARKS).removeprefix("#").partition(":")
        if colon:
            at = line.index(":") + 2 + len(value) - len(value.lstrip())
            pairs.append((Cell(key.strip(), number, line.index(key.strip()) + 1), Cell(value.strip(), number, at)))
    return pairs


def _note_stray(text: MeasurementLines, start: int, kind: str) -> None:
    """Note header lines below the first `start` lines, where they would be ignored as comments."""
    for number, line in enumerate(text.lines[start:], start + 1):
        key, colon, _ = line.removeprefix("#").partition(":")
        if line.startswith("#") and colon and key.strip() in (*COMMON, *KINDS[kind].headers):
            hint = "move it above the line of columns"
            text.note("NCF602", f"header line {key.strip()!r} is below the columns", number, 1, hint)


def _kind_of(text: MeasurementLines, pairs: list[tuple[Cell, Cell]]) -> str:
    """The kind of the measurement; faults of version and kind are noted."""
    found = {key.text: value for key, value in pairs}
    version = found.get("ncfix-measurement")
    if version is None:
        kinds = _kinds_by_columns(text)
        hint = (
            "to use the table of an instrument, add it above the columns, with `# kind: ...`: docs/guide/calibrate.md"
        )
        if kinds:
            hint = f"add it above the columns, with `# kind: {kinds}`; lengths are in mm, angles of axes in degrees"
        text.note("NCF600", "there is no line `# ncfix-measurement: 1`", 1 if text.lines else 0, 0, hint)
    elif version.text != str(VERSION):
        text.mark(
            version, "NCF600", f"version {version.text!r} of the measurement file; this ncfix reads version {VERSION}"
        )
    kind = found.get("kind")
    if kind is None:
        text.note("NCF601", "there is no line `# kind: ...`", 1 if text.lines else 0, 0, f"one of {', '.join(KINDS)}")
        return ""
    if kind.text not in KINDS:
        hint = did_you_mean(kind.text, KINDS) or f"one of {', '.join(KINDS)}"
        text.mark(kind, "NCF601", f"there is no kind {kind.text!r}", hint)
    return kind.text


def _kinds_by_columns(text: MeasurementLines) -> str:
    """The kind that a table seems to have by its column names; "" if none."""
    line = next((line for line in text.lines if line.strip() and not line.startswith("#")), "")
    names = {cell.text for cell in SeparatedText.of(line).cells(line, 1)}
    fits = [form for form in KINDS.values() if names & {*form.measured} and names >= {*form.required}]
    return max(fits, key=lambda form: len(names & {*form.columns})).name if fits else ""


def _check_header(text: MeasurementLines, pairs: list[tuple[Cell, Cell]], kind: str) -> None:
    """Note unknown keys and invalid values of header lines."""
    known = (*COMMON, *KINDS[kind].headers)
    said: set[str] = set()
    for key, value in pairs:
        if key.text in said and key.text in ONCE:
            text.mark(key, "NCF602", f"header line {key.text!r} appears twice")
        said.add(key.text)
        if key.text not in known:
            hint = did_you_mean(key.text, known) or f"free notes belong under {', '.join(COMMON[4:])}"
            text.mark(key, "NCF602", f"unknown header line {key.text!r}", hint)
        elif key.text in NUMBERS:
            _header_numbers(text, value, key.text, NUMBERS[key.text])
        elif key.text in NAMED:
            _named(text, value, key.text, *NAMED[key.text])
        elif kind in CHOICES.get(key.text, {}) and value.text not in CHOICES[key.text][kind]:
            one = " or ".join(CHOICES[key.text][kind])
            text.mark(value, "NCF603", f"{key.text} must be {one}, not {value.text!r}")


def _header_numbers(text: MeasurementLines, value: Cell, key: str, count: int) -> None:
    found = [_finite(part) for part in value.text.split()]
    if len(found) != count or any(number is None for number in found):
        wanted = "a number" if count == 1 else f"{count} numbers"
        hint = "write numbers with a decimal point, not a comma" if COMMA.search(value.text) else ""
        text.mark(value, "NCF603", f"{key} must be {wanted}, not {value.text!r}", hint)
    elif key.startswith("noise") and (found[0] or 0.0) <= 0:
        text.mark(value, "NCF603", f"{key} must be above zero, not {value.text}")


def _named(text: MeasurementLines, value: Cell, key: str, names: int, numbers: int) -> None:
    parts = value.text.split()
    if len(parts) != names + numbers or any(_finite(part) is None for part in parts[names:]):
        wanted = f"{names} names and {numbers} numbers"
        text.mark(value, "NCF603", f"{key} must be {wanted}, not {value.text!r}")
    elif key == "distance" and min(float(part) for part in parts[names:]) <= 0:
        text.mark(value, "NCF603", "a distance and its uncertainty must be above zero")


def _finite(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


# -- columns and rows --------------------------------------------------------------------------------------------------


def _check_names(
    text: MeasurementLines, names: list[Cell], form: MeasurementKind, machine: Machine, plan: bool
) -> None:
    """Note columns that are unknown, repeated, or missing; a plan may lack the measured ones."""
    known = {*machine.axis_names, *form.columns, *form.labels, *LABELS, *machine.inputs, "tool_length", "time_s"}
    known |= {f"dir_{axis}" for axis in machine.axis_names}
    seen: set[str] = set()
    for name in names:
        if name.text in seen:
            text.mark(name, "NCF604", f"column {name.text!r} appears twice")
        seen.add(name.text)
        if name.text not in known and not STATES.fullmatch(name.text):
            _unknown_name(text, name, known, form, machine)
    if form.name == "length":
        _check_length_form(text, seen, names[0].line)
    if form.name == "probe" or (form.name == "length" and "ax" in seen):
        instead = "mx, my, mz" if form.name == "probe" else "ax, ay, az and bx, by, bz"
        for name in (name for name in names if name.text in ("X", "Y", "Z")):
            text.mark(
                name, "NCF604", f"column {name.text!r} is not possible together with {instead}, which give the same"
            )
    _check_missing(text, seen, form, names[0].line, plan)


def _check_missing(text: MeasurementLines, seen: set[str], form: MeasurementKind, line: int, plan: bool) -> None:
    wanted = form.required if plan or form.any_of else (*form.required, *form.measured)
    for missing in [each for each in wanted if each not in seen]:
        text.note("NCF605", f"kind {form.name} needs a column {missing!r}", line)
    if form.any_of and not plan and not seen & set(form.measured):
        one = ", ".join(form.measured)
        text.note("NCF605", f"kind {form.name} needs at least one of {one}", line)


def _unknown_name(text: MeasurementLines, name: Cell, known: set[str], form: MeasurementKind, machine: Machine) -> None:
    axis = name.text.removeprefix("dir_")
    if len(axis) == 1 and axis.isalpha() and axis.isupper():
        has = " ".join(machine.axis_names)
        text.mark(name, "NCF610", f"the machine has no axis {axis}, only {has}")
        return
    if not name.text:
        text.mark(name, "NCF604", "a column without a name", "remove a separator at the end of the line")
        return
    hint = did_you_mean(name.text, known) or f"kind {form.name} has {', '.join(form.columns)}"
    if (unit := NAME_AND_UNIT.fullmatch(name.text)) and unit[1] in known:
        hint = (
            f"name it {unit[1]}, without a unit: lengths are in mm, angles of axes in degrees, measured angles in rad"
        )
    text.mark(name, "NCF604", f"unknown column {name.text!r}", hint)


def _check_length_form(text: MeasurementLines, seen: set[str], line: int) -> None:
    gauge, bar = set(ENDS), {*CENTRE, "radius"}
    if not (gauge <= seen and not bar & seen) and not (bar <= seen and not gauge & seen):
        forms = "ax,ay,az,bx,by,bz,length[,nominal] or cx,cy,cz,radius,length"
        text.note("NCF605", f"kind length needs the columns {forms}", line)


def _rows(text: MeasurementLines, names: list[Cell], start: int) -> list[list[Cell]]:
    rows = []
    for number, line in enumerate(text.lines[start + 1 :], start + 2):
        if not line.strip() or line.startswith("#"):
            continue
        cells = text.separated.cells(line, number)
        if len(cells) != len(names):
            hint = (
                "write numbers with a decimal point, not a comma"
                if COMMA.search(line) and len(cells) > len(names)
                else ""
            )
            text.note("NCF606", f"{len(cells)} cells, but {len(names)} columns", number, 0, hint)
        rows.append(cells)
    if not rows:
        text.note("NCF609", "the file has columns but no rows", start + 1)
    return rows


def _columns(
    text: MeasurementLines, names: list[str], rows: list[list[Cell]], form: MeasurementKind, plan: bool
) -> tuple[dict[str, Array], dict[str, tuple[str, ...]]]:
    columns: dict[str, Array] = {}
    labels: dict[str, tuple[str, ...]] = {}
    for index, name in enumerate(names):
        cells = [row[index] for row in rows]
        if name in form.measured and not any(cell.text for cell in cells):
            if not plan:
                said = f"column {name!r} is empty in all rows"
                text.mark(cells[0], "NCF607", said, "fill it in, or remove it if it was not measured")
            columns |= {name: np.full(len(cells), math.nan)} if form.any_of or not plan else {}
            continue
        if name in (*LABELS, *form.labels):
            labels[name] = tuple(_label(text, cell, name) for cell in cells)
        else:
            columns[name] = _numbers(text, cells, name)
    return columns, labels


def _label(text: MeasurementLines, cell: Cell, name: str) -> str:
    if not cell.text:
        text.mark(cell, "NCF607", f"column {name!r} is empty in this row")
    return cell.text


def _numbers(text: MeasurementLines, cells: Iterable[Cell], name: str) -> Array:
    return np.array([_number(text, cell, name) for cell in cells])


def _number(text: MeasurementLines, cell: Cell, name: str) -> float:
    if not cell.text:
        text.mark(cell, "NCF607", f"column {name!r} is empty in this row", NOT_READ)
        return math.nan
    try:
        plain = text.separated.plain(cell.text)
    except ValueError as error:
        text.mark(cell, "NCF608", f"column {name!r}: {cell.text}: {error}")
        return math.nan
    try:
        value = float(plain.replace("_", "?"))
    except ValueError:
        hint = next((said for odd, said in ODD_CELLS if odd.fullmatch(cell.text)), "")
        if name == "direction" or name.startswith("dir_"):
            hint = "1 towards plus, -1 towards minus, 0 not known"
        elif cell.text == name:
            hint = "remove this line: the columns are named once"
        text.mark(cell, "NCF608", f"column {name!r}: {cell.text!r} is not a number", hint)
        return math.nan
    if not math.isfinite(value):
        text.mark(cell, "NCF608", f"column {name!r}: {cell.text} is not a finite number", NOT_READ)
    elif abs(value) > MAX_NUMBER:
        text.mark(cell, "NCF608", f"column {name!r}: {cell.text} is larger than any measured value")
    return value
