"""The lines of a compensation file, and their assignments to the variables of a table, checked as the control would.

Function Manual Extended Functions, chapter K3: assignments to system variables, executed like a part program. Lines are
kept without loss, so that the file can be written back unchanged to the byte.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import field, replace

import numpy as np

from ncfix.arrays import Array
from ncfix.tables.table_files import Remarks
from ncfix.values import frozen, mutable

NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][xX]?[-+]?[0-9]+)?")
ASSIGNMENT = re.compile(
    r"(\s*)\$(\w+\s*)\[([^\]]*)\](\s*=\s*)((?:\([^)]*\)|[^;$(]|\b(?i:SET|REP)\([^)]*\))*?)(?=\s*(?:[;$]|$))"
)
BLOCK = re.compile(r"\s*(?:/[0-9]?\s*)?(?:N[0-9]+)?", re.IGNORECASE)
COMMENT = re.compile(r"\s*(?:;.*)?")
HEADER = re.compile(r"%_N_(\w+)_(?:INI|SPF|MPF)\s*", re.IGNORECASE)
ENDS = re.compile(r"\s*(?:N\d+\s*)?(?:M(?:17|0?2|30)|RET)\s*(?:;.*)?", re.IGNORECASE)
HARMLESS = re.compile(
    r"\s*(?:N\d+)?\s*(?:METRIC|CHANDATA\s*\(\s*\d+\s*\)|M0?[01]|G710?|STOPRE|MSG\s*\(.*\))?\s*(?:;.*)?", re.IGNORECASE
)
INCH = re.compile(r"\s*(?:N\d+\s*)?(?:INCH|G700?)\s*(?:;.*)?", re.IGNORECASE)
VALUE_FILES = {"eec": b"$AA_ENC_COMP"}
"""Kind of file -> text that only files of this kind contain; others are CEC files."""
LIST = re.compile(r"SET\s*\(([^()]*)\)", re.IGNORECASE)
SETTINGS = re.compile(r"\s*;\s*ncfix:\s*(.*)")
WHOLE = 1e-6
"""Largest deviation of (MAX - MIN) / STEP from a whole number."""
MAX_POINTS = 100_000
"""More points of a table than any control has."""
BOOLS = ("FALSE", "TRUE")
"""Words for 0 and 1."""
KEEPS = "the control keeps what it had"


@frozen
class ArrayAssignment:
    """An assignment `$NAME[index, ...]=value`, with the text before it in its line (lead) and after it (tail)."""

    line: int
    name: str
    indices: tuple[str, ...]
    value: str
    lead: str = ""
    equals: str = "="
    tail: str = ""
    gap: str = ""

    @property
    def text(self) -> str:
        """The text of the assignment with its surroundings."""
        return f"{self.lead}${self.name}{self.gap}[{','.join(self.indices)}]{self.equals}{self.value}{self.tail}"

    @property
    def number(self) -> float | None:
        """The value as a finite number, with exponent EX or E; None if it is none."""
        found = float(self.value.upper().replace("EX", "E")) if NUMBER.fullmatch(self.value) else math.inf
        return found if math.isfinite(found) else None

    def listed(self) -> Iterator[ArrayAssignment]:
        """The assignment itself; SET(a, b, ...) gives one for each value, with increasing last index."""
        match = LIST.fullmatch(self.value)
        if match is None or not self.indices[-1].strip().isdecimal():
            yield self
            return
        for place, value in enumerate(match[1].split(","), int(self.indices[-1])):
            yield replace(self, indices=(*self.indices[:-1], str(place)), value=value.strip())


@frozen
class OtherRow:
    """Any other line, unchanged."""

    line: int
    text: str


FileRow = ArrayAssignment | OtherRow


def parsed(text: str) -> list[FileRow]:
    """The lines of a file, parsed; a line may hold several assignments."""
    return [line for number, row in enumerate(text.split("\n"), 1) for line in _lines(number, row)]


def written(lines: Iterable[FileRow]) -> str:
    """The text of a file with these lines."""
    found, last = "", 1
    for line in lines:
        found += "\n" * (line.line - last) + line.text
        last = line.line
    return found


def _lines(number: int, row: str) -> list[FileRow]:
    """The assignments of a line if it holds nothing else; otherwise the line as `OtherRow`."""
    body = row.removesuffix("\r")
    block = BLOCK.match(body)
    at = block.end() if block else 0
    found: list[FileRow] = []
    lead = body[:at]
    while match := ASSIGNMENT.match(body, at):
        before, name, indices, equals, value = match.groups()
        word = name.rstrip()
        found.append(
            ArrayAssignment(
                number, word, tuple(indices.split(",")), value, lead + before, equals, gap=name[len(word) :]
            )
        )
        at, lead = match.end(), ""
    if not found or not COMMENT.fullmatch(body, at):
        return [OtherRow(number, row)]
    assert isinstance(found[-1], ArrayAssignment)
    return [*found[:-1], replace(found[-1], tail=row[at:])]


def assignments(lines: Iterable[FileRow], remarks: Remarks) -> Iterator[ArrayAssignment]:
    """The assignments that the control executes, with remarks on lines at which it would stop."""
    found = list(lines)
    first = next((place for place, line in enumerate(found) if not COMMENT.fullmatch(line.text)), 0)
    if found and HEADER.fullmatch(found[first].text.strip()):
        rest = iter(found[first + 1 :])
    else:
        hint = "%_N_NC_CEC_INI or %_N_AX1_EEC_INI, as the control archives it"
        remarks.doubt(1, "the first line does not name the file", hint)
        rest = iter(found)
    ended = False
    for line in rest:
        if ended:
            if line.text.strip() and not line.text.lstrip().startswith(";"):
                remarks.refuse(line.line, "stands after the end of the file", "M17 goes last")
        elif isinstance(line, ArrayAssignment):
            if line.lead.lstrip().startswith("/"):
                remarks.doubt(line.line, "a line with /: the control leaves it out while block skip is on")
            yield from line.listed()
        elif ENDS.fullmatch(line.text):
            ended = True
        elif not HARMLESS.fullmatch(line.text):
            _stumbled(line, remarks)
    if not ended:
        remarks.refuse(0, "does not end with M17", "a file that was cut off?")


def _stumbled(line: FileRow, remarks: Remarks) -> None:
    if INCH.fullmatch(line.text):
        remarks.refuse(line.line, "INCH: ncfix writes and reads millimetres", "products change with the unit, too")
    elif "$" in line.text:
        remarks.refuse(line.line, "is not an assignment $NAME[index]=value")
    else:
        remarks.refuse(line.line, "is not understood", "assignments, comments, CHANDATA(1), METRIC, M17")


def settings(lines: Iterable[FileRow]) -> dict[str, str]:
    """The pairs of comments `; ncfix: key=value ...`."""
    found: dict[str, str] = {}
    for line in lines:
        if match := SETTINGS.fullmatch(line.text.removesuffix("\r")):
            pairs = (word.partition("=") for word in match[1].split() if "=" in word)
            found.update({key: value for key, _, value in pairs})
    return found


@mutable
class Assigned:
    """The assignments of one table.

    title   for messages, e.g. "table 3" or "AX1"
    place   the text of the n-th value's variable, with {} for n
    names   the text of a field's variable, with {} for the field
    """

    title: str
    place: str
    names: str
    remarks: Remarks
    fields: dict[str, ArrayAssignment] = field(default_factory=dict)
    values: dict[int, ArrayAssignment] = field(default_factory=dict)

    def put(self, which: int | str, assignment: ArrayAssignment) -> None:
        """Store a value by its index, or a field by its name; a repeated one replaces the earlier one."""
        if which in self.values or which in self.fields:
            self.remarks.doubt(assignment.line, "is assigned twice: the control keeps the last", "a slip?")
        if isinstance(which, int):
            self.values[which] = assignment
        else:
            self.fields[which] = assignment

    def lacks(self, needed: Iterable[str]) -> bool:
        """Whether any needed field is missing, which is also noted."""
        gone = [name for name in needed if name not in self.fields]
        if gone:
            first = next(iter([*self.values.values(), *self.fields.values()]))
            names = ", ".join(self.names.replace("{}", name, 1) for name in gone)
            self.remarks.refuse(first.line, f"{self.title} has no {names}: {KEEPS}")
        return bool(gone)

    def number(self, name: str) -> float:
        """A field as a number; if it is none, 0, and a fault is noted."""
        return self._number(self.fields[name])

    def _number(self, assignment: ArrayAssignment) -> float:
        if assignment.number is None:
            what = "a decimal comma" if "," in assignment.value else f"{assignment.value!r} is not a number"
            self.remarks.refuse(assignment.line, what, "a decimal point")
        return assignment.number or 0.0

    def choice(self, name: str, allowed: Sequence[int] | None = None) -> int:
        """A field that is a whole number, one of `allowed`; 0 if it is missing. Others are noted as faults."""
        if name not in self.fields:
            return 0
        said = self.fields[name].value.upper()
        value = float(BOOLS.index(said)) if said in BOOLS and allowed == (0, 1) else self.number(name)
        if value != int(value) or (allowed is not None and int(value) not in allowed):
            wanted = "a whole number" if allowed is None else f"one of {', '.join(map(str, allowed))}"
            self.remarks.refuse(self.fields[name].line, f"{name} is {value:g}, not {wanted}")
        return int(value)

    def curve(self, modulo: bool) -> Array | None:
        """The values from MIN to MAX, (k + 1,); None if they have a fault, which is noted."""
        before = len(self.remarks.wrong)
        last = self._last()
        if last:
            self._look_at_places(last)
        found = {number: self._number(each) for number, each in self.values.items()}
        if len(self.remarks.wrong) > before:
            return None
        values = np.array([found[number] for number in range(last + 1)])
        if modulo and abs(values[0] - values[-1]) > WHOLE:
            text = f"{self.title} repeats, but ends on another value than it begins"
            self.remarks.doubt(self.values[last].line, text)
        turns = (self.number("MAX") - self.number("MIN")) / 360
        if modulo and (turns < 0.5 or abs(turns - round(turns)) > WHOLE):
            text = f"{self.title} repeats every {360 * turns:g} degree, which are no whole turns"
            self.remarks.doubt(self.fields["MAX"].line, text)
        return values

    def _last(self) -> int:
        """The last index k = (MAX - MIN) / STEP; if it is not a positive whole number, 0, and a fault is noted."""
        step, low, high = (self.number(name) for name in ("STEP", "MIN", "MAX"))
        line = self.fields["STEP"].line
        if step <= 0 or high <= low:
            self.remarks.refuse(line, f"a step of {step:g} from {low:g} to {high:g}")
            return 0
        steps = (high - low) / step
        if steps > MAX_POINTS:
            self.remarks.refuse(line, f"(MAX - MIN) / STEP is {steps:.6g}: no control has so many points")
            return 0
        if abs(steps - round(steps)) > WHOLE:
            text = f"(MAX - MIN) / STEP is {steps:.6g}, not a whole number: the control would move the end"
            self.remarks.refuse(line, text)
            return 0
        return round(steps)

    def _look_at_places(self, last: int) -> None:
        for number in sorted(number for number in self.values if number > last)[:1]:
            text = f"{self.title} has values 0 to {last} by its MIN, MAX and STEP; this one is ignored"
            self.remarks.refuse(self.values[number].line, text, "one value too many, or MAX too small")
        gone = [number for number in range(last + 1) if number not in self.values]
        if gone:
            first = self.place.replace("{}", str(gone[0]), 1)
            text = f"{len(gone)} of {last + 1} values of {self.title} are missing, first {first}"
            self.remarks.refuse(self.fields["STEP"].line, f"{text}: {KEEPS} there")
