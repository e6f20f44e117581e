"""Table files of controls that ncfix makes no tables for: read line by line, and written again to the byte.

A form is a list of the lines that it may have. A line is kept as its words and its numbers; a number keeps its
decimals, its sign and its place, so that it may be changed and the file written again as its control likes it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from decimal import Decimal
from itertools import pairwise

from ncfix.tables.lines import Remarks

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
N = f"({NUMBER})"
GAP = r"[ \t]+"
END = re.compile(rb"\r\n|\n")


@dataclass(frozen=True, slots=True)
class Line:
    """A line: what it is, its text with a slot for every number, and the numbers with the width of their slots."""

    kind: str
    text: str
    numbers: tuple[Decimal, ...] = ()
    plus: tuple[bool, ...] = ()

    def written(self) -> str:
        """The line."""
        words = (f"{'+' if plus else ''}{number}" for number, plus in zip(self.numbers, self.plus, strict=True))
        return "".join(part for pair in zip(self.text.split("\0"), [*words, ""], strict=True) for part in pair)


@dataclass(frozen=True, slots=True)
class Document:
    """A file of a known form. `eol` after each line; `last` whether also after the last."""

    form: str
    lines: tuple[Line, ...]
    eol: str = "\n"
    last: bool = True

    def content(self) -> bytes:
        """The file."""
        text = self.eol.join(line.written() for line in self.lines)
        return (text + (self.eol if self.last else "")).encode("latin-1")

    def rows(self, kind: str) -> list[tuple[float, ...]]:
        """The numbers of all lines of a kind."""
        return [tuple(map(float, line.numbers)) for line in self.lines if line.kind == kind]

    def sections(self, kind: str) -> dict[str, list[tuple[float, ...]]]:
        """The numbers of the lines after each line of a kind, `[X]`, under what that has between its brackets."""
        found: dict[str, list[tuple[float, ...]]] = {}
        rows: list[tuple[float, ...]] = []
        for line in self.lines:
            if line.kind == kind:
                rows = found.setdefault(line.text.strip("[]"), [])
            elif line.numbers:
                rows.append(tuple(map(float, line.numbers)))
        return found

    def with_numbers(self, index: int, *numbers: Decimal) -> Document:
        """With other numbers in one line."""
        line = replace(self.lines[index], numbers=numbers)
        return replace(self, lines=(*self.lines[:index], line, *self.lines[index + 1 :]))


Check = Callable[[Document, Remarks], None]


@dataclass(frozen=True, slots=True)
class Form:
    """What lines a kind of file has: name -> pattern, whose groups are numbers; and what must hold between them."""

    name: str
    title: str
    kinds: Mapping[str, str]
    check: Check = lambda document, remarks: None


def read(form: Form, path: str, content: bytes) -> tuple[Document, Remarks]:
    """A file of a form, with remarks on lines that the form does not have."""
    remarks = Remarks.of(path, content)
    eol = "\r\n" if b"\r\n" in content else "\n"
    lines = [_line(form, remarks, number, row) for number, row in enumerate(remarks.rows, 1)]
    document = Document(form.name, tuple(lines), eol, bool(END.search(content[-2:])))
    if not lines:
        remarks.refuse(0, "is empty")
    if not remarks.wrong:
        form.check(document, remarks)
    return document, remarks


def _line(form: Form, remarks: Remarks, number: int, row: str) -> Line:
    for kind, pattern in form.kinds.items():
        match = re.fullmatch(pattern, row)
        if match:
            return _slotted(kind, row, match)
    comma = re.search(r"\d,\d", row)
    remarks.refuse(number, "a decimal comma" if comma else f"is no line of {form.title}", "see docs/controllers.md")
    return Line("?", row)


def _slotted(kind: str, row: str, match: re.Match[str]) -> Line:
    spans = [match.span(group) for group in range(1, match.re.groups + 1) if match[group] is not None]
    text, at = "", 0
    for start, stop in spans:
        text += row[at:start] + "\0"
        at = stop
    words = [row[start:stop] for start, stop in spans]
    numbers = tuple(Decimal(word) for word in words)
    if any(str(value) != word.lstrip("+") for value, word in zip(numbers, words, strict=True)):
        return Line(kind, row)  # a way of writing that a number does not keep: such a line stays as it is
    return Line(kind, text + row[at:], numbers, tuple(word.startswith("+") for word in words))


def _ascending(kind: str) -> Check:
    def check(document: Document, remarks: Remarks) -> None:
        rows = [(n, line.numbers) for n, line in enumerate(document.lines, 1) if line.kind == kind and line.numbers]
        for (_, before), (number, after) in pairwise(rows):
            if after[0] <= before[0]:
                remarks.refuse(number, "the positions must ascend")

    return check


def _elmo(document: Document, remarks: Remarks) -> None:
    sizes = document.rows("dimensions")
    shape = tuple(map(int, sizes[0])) if sizes else ()
    rows = document.rows("row")
    if len(shape) == 2 and (len(rows) != shape[0] or any(len(row) != shape[1] for row in rows)):
        remarks.refuse(0, f"{len(rows)} rows, and Table dimensions says {shape[0]} of {shape[1]}")
    declared = document.rows("size")
    if declared and len(shape) == 2 and declared[0][0] != shape[0] * shape[1]:
        remarks.refuse(0, f"Table size {declared[0][0]:g} is not {shape[0]} x {shape[1]}")


def _framed(first: str, last: str) -> Check:
    def check(document: Document, remarks: Remarks) -> None:
        kinds = [line.kind for line in document.lines if line.kind not in ("blank", "comment")]
        if not kinds or kinds[0] != first or kinds[-1] != last:
            remarks.refuse(0, f"should begin with the line of {first} and end with that of {last}")

    return check


def _runs(document: Document, remarks: Remarks) -> None:
    targets, runs = document.rows("target-count"), document.rows("run-count")
    starts = [index for index, line in enumerate(document.lines) if line.text.startswith("Run Target Data")]
    if targets and runs and starts:
        found = sum(line.kind == "numbers" for line in document.lines[starts[0] :])
        expected = int(targets[0][0] * runs[0][0])
        if found != expected:
            remarks.refuse(0, f"{found} deviations, {expected} expected of targets and runs")


def _united(document: Document, remarks: Remarks) -> None:
    if [line.kind for line in document.lines].count("unit") != 1 or document.lines[0].kind != "unit":
        remarks.refuse(0, "should begin with the line of the unit")
    for axis, rows in document.sections("axis").items():
        if len(rows) < 2 or any(after[0] <= before[0] for before, after in pairwise(rows)):
            remarks.refuse(0, f"axis {axis} needs two positions or more, and they must ascend")


def _defined(document: Document, remarks: Remarks) -> None:
    if not any(line.kind == "define" for line in document.lines):
        remarks.refuse(0, "no line DEFINE COMP")


def _headed(document: Document, remarks: Remarks) -> None:
    lines = [line for line in document.lines if line.kind not in ("blank", "comment")]
    if not lines or lines[0].kind != "head":
        remarks.refuse(0, "should begin with a line of names")
        return
    for number, line in enumerate(document.lines, 1):
        if line.kind == "row" and len(line.numbers) != len(lines[0].text.split()):
            remarks.refuse(number, f"{len(line.numbers)} numbers under {len(lines[0].text.split())} names")


BLANK = r"[ \t]*"
LIST = {"entry": rf"[\w.\[\]]+{GAP}{N}{BLANK}(?:#.*)?", "word": rf"[\w.\[\]]+{GAP}\S+{BLANK}(?:#.*)?"}
FORMS = (
    Form("comp", "LinuxCNC's .comp", {"row": rf"{BLANK}{N}{GAP}{N}{GAP}{N}{BLANK}"}, _ascending("row")),
    Form(
        "ini",
        "an ini file",
        {
            "section": r"\[\w+\]",
            "entry": rf"\w+ *= *{N}",
            "word": r"\w+ *= *\S.*",
            "comment": r"[#;].*",
            "blank": BLANK,
        },
    ),
    Form(
        "tnc306",
        "the TNC 306",
        {
            "rule": r"[XYZ] = F\([XYZ]\)",
            "datum": rf"DATUM POINT +{N}",
            "setup": rf"SETUP +{N}",
            "row": rf"{N} +[XYZ]{N} +[XYZ]{N}",
        },
        _framed("rule", "row"),
    ),
    Form(
        "g10",
        "programmable parameter input",
        {"begin": r"G10 ?L5[02]", "record": rf"N{N}(?: P{N})? R{N}", "end": "G11", "comment": r";.*", "blank": BLANK},
        _framed("begin", "end"),
    ),
    Form(
        "isg-csv",
        "ISG_CSV",
        {
            "comment": r"//.*",
            "head": r"[XYZABC](?:[ \t]+[A-Z]\w*)+",
            "row": rf"{N}" + rf"(?:{GAP}{N})?" * 23,
            "blank": BLANK,
        },
        _headed,
    ),
    Form("isg-list", "an ISG list", {**LIST, "comment": r"#.*", "blank": BLANK}),
    Form(
        "etalon",
        "the Etalon exchange format",
        {
            "comment": r"//.*",
            "section": r"\[\w+\]",
            "value": rf"VALUE = {N}",
            "open": r"Gridpoints = \{",
            "point": rf" *{N} {N}",
            "close": r"\} *(?://.*)?",
            "blank": BLANK,
        },
    ),
    Form(
        "elmo",
        "the Elmo Maestro",
        {
            "mark": r"\[(?:header|header/|table|table/)\]",
            "size": rf"Table size\t{N}",
            "dimension": rf"Error table dimension\t{N}",
            "axes": r"(?:Target axis|Reference axes)(?:\t\w+)+",
            "start": rf"Start position(?:\t{N})(?:\t{N})?(?:\t{N})?",
            "grid": rf"Axis grid size(?:\t{N})(?:\t{N})?(?:\t{N})?",
            "dimensions": rf"Table dimensions(?:\t{N})(?:\t{N})?(?:\t{N})?",
            "block": r"Table #\d+ (?:Start|End) Data",
            "row": rf"{N}" + rf"(?:\t{N})?" * 24,
        },
        _elmo,
    ),
    Form(
        "pmac",
        "PMAC",
        {
            "comment": r";.*",
            "define": r"DEFINE COMP \d+(?:\.\d+)*(?:, ?#\d+D?)+(?:, ?\d+)+",
            "row": rf"{N}" + rf"(?:{GAP}{N})?" * 24,
        },
        _defined,
    ),
    Form(
        "weihong",
        "NcStudio's axeserr.dat",
        {"unit": r"unit = (?:mm|inch)", "axis": r"\[\w\]", "row": rf"{N}, {N}, {N}"},
        _united,
    ),
    Form(
        "hexagon",
        "COMP.ERR",
        {"start": "START[A-Z]", "row": rf"{N}={N}", "end": "END"},
        _framed("start", "end"),
    ),
    Form("centroid", "Centroid's .tab", {"row": rf"{N} {N} {N} {N} {N}"}),
    Form(
        "rtl",
        "Renishaw's .rtl",
        {
            "section": r"[A-Z -]+::",
            "target-count": rf"Target-count: {N}",
            "run-count": rf"Run-count: {N}",
            "entry": r"[\w -]+:.*",
            "numbers": rf"{N}" + rf"(?: {N})?" * 24,
            "blank": BLANK,
        },
        _runs,
    ),
)
BY_NAME = {form.name: form for form in FORMS}


def recognised(path: str, content: bytes) -> Document | None:
    """The file as the first form that has all of its lines; None if there is none."""
    for form in FORMS:
        document, remarks = read(form, path, content)
        if not remarks.wrong:
            return document
    return None
