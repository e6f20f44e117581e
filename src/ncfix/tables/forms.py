"""Linting of table files from elsewhere: the control or format is recognised by the content.

Controls for which ncfix makes no tables have known file forms: patterns of lines, and conditions between lines. A file
is read line by line and can be written again unchanged to the byte. A line is kept as text and numbers; a number keeps
its decimals, its sign and its column, so that it can be changed without changing the layout.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from decimal import Decimal
from itertools import pairwise

from ncfix.diagnostics import Message, Place
from ncfix.plugins import called
from ncfix.tables.control import Control, Files, controls, get_control
from ncfix.tables.export import SHEET, SIDE_FILE, linted, read_manifest
from ncfix.tables.table_files import AGAIN, BYTE_ORDER, NUMBER, Remarks
from ncfix.values import frozen

N = f"({NUMBER})"
GAP = r"[ \t]+"
END = re.compile(rb"\r\n|\n")
BLANK = r"[ \t]*"
NOTES = {"comment": rf"{BLANK}(?:;|//|#).*", "blank": BLANK}
"""Kinds of comment and blank lines, for forms that allow them."""
ASIDE = r"(?:#.*|/\*.*\*/[ \t]*)?"
LIST = {"entry": rf"[\w.\[\]]+{GAP}{N}{BLANK}{ASIDE}", "word": rf"[\w.\[\]]+{GAP}\S+{BLANK}{ASIDE}"}


@frozen
class FileLine:
    """A line of a file: its kind, its text with a slot (NUL) for every number, and the numbers.

    plus      for each number, whether it is written with a plus sign
    verbatim  the whole line, if `Decimal` does not keep the form of its numbers: `5.`, `.5`, `007`
    """

    kind: str
    text: str
    numbers: tuple[Decimal, ...] = ()
    plus: tuple[bool, ...] = ()
    verbatim: str = ""

    def written(self) -> str:
        """The text of the line."""
        if self.verbatim:
            return self.verbatim
        words = (f"{'+' if plus else ''}{number}" for number, plus in zip(self.numbers, self.plus, strict=True))
        return "".join(part for pair in zip(self.text.split("\0"), [*words, ""], strict=True) for part in pair)


@frozen
class TableFile:
    """A file of a known form.

    eol    the line end; last: whether the last line has one
    start  a byte order mark, or ""
    """

    form: str
    lines: tuple[FileLine, ...]
    eol: str = "\n"
    last: bool = True
    start: str = ""

    def content(self) -> bytes:
        """The bytes of the file."""
        text = self.eol.join(line.written() for line in self.lines)
        return (self.start + text + (self.eol if self.last else "")).encode("latin-1")

    def rows(self, kind: str) -> list[tuple[float, ...]]:
        """The numbers of all lines of a kind."""
        return [tuple(map(float, line.numbers)) for line in self.lines if line.kind == kind]

    def sections(self, kind: str) -> dict[str, list[tuple[float, ...]]]:
        """Name in brackets of each line of a kind, such as `[X]` -> numbers of the lines that follow it."""
        found: dict[str, list[tuple[float, ...]]] = {}
        rows: list[tuple[float, ...]] = []
        for line in self.lines:
            if line.kind == kind:
                name = re.search(r"\[(.*?)\]", line.text)
                rows = found.setdefault(name[1] if name else line.text.strip(), [])
            elif line.numbers:
                rows.append(tuple(map(float, line.numbers)))
        return found

    def with_numbers(self, index: int, *numbers: Decimal) -> TableFile:
        """The file with the numbers of one line replaced."""
        line = replace(self.lines[index], numbers=numbers, verbatim="")
        return replace(self, lines=(*self.lines[:index], line, *self.lines[index + 1 :]))


PMAC_MOTOR, PMAC_END = r"(?:#\d+ *)?", rf"{BLANK}(?:;.*)?"

Check = Callable[[TableFile, Remarks], None]


@frozen
class FileForm:
    """The form of a kind of file.

    kinds  kind of line -> pattern, whose groups are numbers
    check  a check of conditions between lines
    needs  kinds of lines of which every file of this form has at least one
    tells  kinds of lines that no other form has: a file with one is of this form, even if it has faults
    free   pattern of the start of comments, in which non-ASCII letters are only doubtful; "" if no control reads the
           file, so that they may be anywhere
    """

    name: str
    title: str
    kinds: Mapping[str, str]
    check: Check = lambda document, remarks: None
    needs: tuple[str, ...] = ()
    tells: tuple[str, ...] = ()
    free: str = r";|//|#|\(|/\*"


def read_form(form: FileForm, path: str, content: bytes) -> tuple[TableFile, Remarks]:
    """Read a file as a form, with remarks on lines and conditions that do not fit."""
    remarks = Remarks.of(path, content, form.free)
    if not form.free:
        remarks.wrong.clear()
    eol = "\r\n" if b"\r\n" in content else "\n"
    lines = [_line(form, remarks, number, row) for number, row in enumerate(remarks.rows, 1)]
    start = BYTE_ORDER if content.startswith(BYTE_ORDER.encode("latin-1")) else ""
    document = TableFile(form.name, tuple(lines), eol, bool(END.search(content[-2:])), start)
    if not lines:
        remarks.refuse(0, "is empty")
    for kind in {*form.needs} - {line.kind for line in lines}:
        remarks.refuse(0, f"the file has no line of the kind {kind!r}")
    if not remarks.wrong:
        form.check(document, remarks)
    return document, remarks


def _line(form: FileForm, remarks: Remarks, number: int, row: str) -> FileLine:
    for kind, pattern in form.kinds.items():
        match = re.fullmatch(pattern, row)
        if match:
            return _slotted(kind, row, match)
    comma = re.search(r"\d,\d", row)
    hint = "see docs/controllers.md" if BY_NAME.get(form.name) is form else f"possible lines: {', '.join(form.kinds)}"
    remarks.refuse(number, "a decimal comma" if comma else f"is not a line of {form.title}", hint)
    return FileLine("?", row)


def _slotted(kind: str, row: str, match: re.Match[str]) -> FileLine:
    spans = [match.span(group) for group in range(1, match.re.groups + 1) if match[group] is not None]
    text, at = "", 0
    for start, stop in spans:
        text += row[at:start] + "\0"
        at = stop
    words = [row[start:stop] for start, stop in spans]
    numbers = tuple(Decimal(word) for word in words)
    as_written = all(str(value) == word.lstrip("+") for value, word in zip(numbers, words, strict=True))
    plus = tuple(word.startswith("+") for word in words)
    return FileLine(kind, text + row[at:], numbers, plus, "" if as_written else row)


def _ascending(document: TableFile, remarks: Remarks) -> None:
    rows = [(n, line.numbers) for n, line in enumerate(document.lines, 1) if line.kind == "row" and line.numbers]
    for (_, before), (number, after) in pairwise(rows):
        if after[0] <= before[0]:
            remarks.refuse(number, "the positions must ascend")


def _elmo(document: TableFile, remarks: Remarks) -> None:
    if not any(line.kind == "mark" for line in document.lines):
        remarks.refuse(0, "no [header] and no [table]")
    sizes = document.rows("dimensions")
    shape = tuple(map(int, sizes[0])) if sizes else ()
    rows = document.rows("row")
    if len(shape) == 2 and (len(rows) != shape[0] or any(len(row) != shape[1] for row in rows)):
        remarks.refuse(0, f"{len(rows)} rows, but Table dimensions states {shape[0]} of {shape[1]}")
    declared = document.rows("size")
    if declared and len(shape) == 2 and declared[0][0] != shape[0] * shape[1]:
        remarks.refuse(0, f"Table size {declared[0][0]:g} is not {shape[0]} x {shape[1]}")


def _framed(first: str, last: str) -> Check:
    def check(document: TableFile, remarks: Remarks) -> None:
        kinds = [line.kind for line in document.lines if line.kind not in ("blank", "comment", "around")]
        if not kinds or kinds[0] != first or kinds[-1] != last:
            remarks.refuse(0, f"should begin with the line of {first} and end with that of {last}")

    return check


def _runs(document: TableFile, remarks: Remarks) -> None:
    targets, runs = document.rows("target-count"), document.rows("run-count")
    starts = [index for index, line in enumerate(document.lines) if line.text.startswith("Run Target Data")]
    if targets and runs and starts:
        found = sum(line.kind == "numbers" for line in document.lines[starts[0] :])
        expected = int(targets[0][0] * runs[0][0])
        if found != expected:
            remarks.refuse(0, f"{found} deviations, {expected} expected of targets and runs")


def _united(document: TableFile, remarks: Remarks) -> None:
    kinds = [line.kind for line in document.lines if line.kind not in NOTES]
    if kinds.count("unit") != 1 or kinds[0] != "unit":
        remarks.refuse(0, "should begin with the line of the unit")
    for axis, rows in document.sections("axis").items():
        if len(rows) < 2 or any(after[0] <= before[0] for before, after in pairwise(rows)):
            remarks.refuse(0, f"axis {axis} needs at least two positions, and they must ascend")


def _defined(document: TableFile, remarks: Remarks) -> None:
    """Check of PMAC tables: entries are whole, as many as the head line states, and the last one, at zero, is 0."""
    lines = [(n, line) for n, line in enumerate(document.lines, 1) if line.kind in ("define", "row")]
    starts = [k for k, (_, line) in enumerate(lines) if line.kind == "define"]
    if not starts:
        remarks.refuse(0, "no line DEFINE COMP")
    for start, stop in pairwise([*starts, len(lines)]):
        number, head = lines[start]
        entries = [value for _, line in lines[start + 1 : stop] for value in line.numbers]
        if any(value != int(value) for value in entries):
            remarks.refuse(number, "entries are whole numbers, sixteenths of a count")
        said = re.search(r"(?i)COMP *(\d+)(?=[ ,])", head.text)
        if said is None:
            continue
        if len(entries) != int(said[1]):
            remarks.refuse(number, f"{len(entries)} entries follow, but the line states {said[1]}")
        elif entries[-1]:
            remarks.doubt(number, f"the last entry is {entries[-1]}, but must be 0: there the table starts again")


def _headed(document: TableFile, remarks: Remarks) -> None:
    lines = [line for line in document.lines if line.kind not in ("blank", "comment")]
    if not lines or lines[0].kind != "head":
        remarks.refuse(0, "should begin with a line of names")
        return
    names = 0
    for number, line in enumerate(document.lines, 1):
        count = len(line.written().split("//", 1)[0].split())
        if line.kind == "head":
            names = count
        elif line.kind == "row" and count != names:
            remarks.refuse(number, f"{count} numbers under {names} names")


FORMS = (
    FileForm("comp", "LinuxCNC's .comp", {"row": rf"{BLANK}{N}{GAP}{N}{GAP}{N}{BLANK}"}, _ascending, ("row",)),
    FileForm(
        "ini",
        "an ini file",
        {
            "section": r"\[\w+\]",
            "entry": rf"\w+ *= *{N}",
            "word": r"\w+ *=.*",
            "comment": rf"{BLANK}[#;].*",
            "blank": BLANK,
        },
        needs=("section",),
    ),
    FileForm(
        "tnc306",
        "the TNC 306",
        {
            "rule": rf"[XYZ] *= *F\([XYZ]\){BLANK}",
            "datum": rf"DATUM POINT +{N}{BLANK}",
            "setup": rf"SETUP +{N}{BLANK}",
            "row": rf"{BLANK}{N} +[XYZ]{N} +[XYZ]{N}{BLANK}",
            "blank": BLANK,
        },
        _framed("rule", "row"),
        tells=("rule",),
    ),
    FileForm(
        "g10",
        "programmable parameter input",
        {
            "begin": rf"(?i:(?:G90 *)?G10 *L5[02]);?{BLANK}",
            "around": rf"(?i:[O:]\d+.*|G90|M0?2|M30|M99);?{BLANK}",
            "record": rf"(?i:N){N}(?: *(?i:P){N})? *(?i:R){N};?{BLANK}",
            "end": rf"(?i:G11);?{BLANK}",
            "comment": rf"{BLANK}(?:;.*|\(.*\)|%)",
            "blank": BLANK,
        },
        _framed("begin", "end"),
        tells=("begin",),
    ),
    FileForm(
        "isg-csv",
        "ISG_CSV",
        {
            "comment": r"//.*",
            "head": rf"{BLANK}[XYZABC](?:[ \t]+[A-Z]\w*)+{BLANK}(?://.*)?",
            "row": rf"{BLANK}{N}" + rf"(?:{GAP}{N})?" * 23 + rf"{BLANK}(?://.*)?",
            "next": r"#.*",
            "blank": BLANK,
        },
        _headed,
    ),
    FileForm(
        "isg-list",
        "an ISG list",
        {**LIST, "comment": rf"{BLANK}(?:#.*|/\*.*\*/{BLANK})", "blank": BLANK},
        needs=("entry",),
    ),
    FileForm(
        "etalon",
        "the Etalon exchange format",
        {
            "comment": r"//.*",
            "section": r"\[\w+\]",
            "value": rf"{BLANK}VALUE *= *{N}{BLANK}(?://.*)?",
            "open": rf"{BLANK}Gridpoints *= *\{{{BLANK}",
            "point": rf"{BLANK}{N}{GAP}{N}{BLANK}(?://.*)?",
            "close": rf"{BLANK}\}}{BLANK}(?://.*)?",
            "blank": BLANK,
        },
        needs=("section",),
        tells=("open",),
    ),
    FileForm(
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
            "row": rf"{BLANK}{N}" + rf"(?:[ \t]+{N})?" * 60 + BLANK,
            "blank": BLANK,
        },
        _elmo,
        tells=("mark",),
    ),
    FileForm(
        "pmac",
        "PMAC",
        {
            "comment": r";.*",
            "define": rf"{BLANK}{PMAC_MOTOR}(?i:DEFINE +COMP) *\d+(?:\.\d+)*"
            rf"(?: *, *#\d+[dD]?)*(?:(?: *, *| +)\d+)+{PMAC_END}",
            "around": rf"{BLANK}(?i:[IPM]\d+ *= *\S+|{PMAC_MOTOR}DEL(?:ETE)? +COMP|#\d+|&\d+){PMAC_END}",
            "row": rf"{BLANK}{N}" + rf"(?:{GAP}{N})?" * 24 + rf"{BLANK}(?:;.*)?",
            "blank": BLANK,
        },
        _defined,
        tells=("define",),
    ),
    FileForm(
        "weihong",
        "NcStudio's axeserr.dat",
        {
            "unit": rf"unit *= *(?:mm|inch){BLANK}",
            "axis": rf"\[\w\]{BLANK}",
            "row": rf"{BLANK}{N} *, *{N} *, *{N}{BLANK}",
            **NOTES,
        },
        _united,
        tells=("unit",),
    ),
    FileForm(
        "hexagon",
        "COMP.ERR",
        {
            "start": rf"START[A-Z]{BLANK}",
            "row": rf"{BLANK}{N} *= *{N}{BLANK}",
            "end": rf"END[A-Z]?{BLANK}",
            "blank": BLANK,
        },
        _framed("start", "end"),
        tells=("start",),
    ),
    FileForm("centroid", "Centroid's .tab", {"row": BLANK + GAP.join([N] * 5) + BLANK, "blank": BLANK}, needs=("row",)),
    FileForm(
        "rtl",
        "Renishaw's .rtl",
        {
            "section": r"[A-Z -]+::",
            "target-count": rf"Target-count: *{N}{BLANK}",
            "run-count": rf"Run-count: *{N}{BLANK}",
            "entry": r"[\w -]+:.*",
            "numbers": rf"{BLANK}{N}" + rf"(?:{GAP}{N})?" * 60 + BLANK,
            "blank": BLANK,
        },
        _runs,
        ("section",),
        ("section",),
        free="",
    ),
)


BY_NAME = {form.name: form for form in FORMS}


def form_named(name: str) -> FileForm:
    """The form `name`; raises KeyError if there is none."""
    return BY_NAME[name]


def recognised(path: str, content: bytes) -> TableFile | None:
    """The file, read as the first form that fits all of its lines; None if there is none."""
    for form in FORMS:
        document, remarks = read_form(form, path, content)
        if not remarks.wrong:
            return document
    return None


@frozen
class Linted:
    """The result of linting one file.

    owner     name of the control or form; "" if the file is unknown
    title     the same for people
    messages  messages on faults and doubtful contents
    """

    owner: str
    title: str
    messages: tuple[Message, ...]


def lint_files(files: Files, control: str = "") -> Mapping[str, Linted]:
    """Lint the files of a folder: file name -> result. Files of one control are examined together.

    The side file of a folder that `export` wrote names the control; it and the hand-over sheet are not linted.
    control  the control of all files, if known
    Raises `UsageError` NCF480.
    """
    tables = {
        name: content for name, content in files.items() if name != SIDE_FILE and not name.startswith(f"{SHEET}.")
    }
    made = read_manifest(files[SIDE_FILE], SIDE_FILE) if SIDE_FILE in files else None
    if control or made is not None:
        chosen = get_control(control or (made.control if made is not None else ""))
        return _shared(chosen, tables, linted(chosen, tables) if made is not None else _look(chosen, tables))
    found: dict[str, Linted] = {}
    known = controls()
    owners: dict[str, dict[str, bytes]] = {}
    for name, content in tables.items():
        whose = (who for who, it in known.items() if called("controls", it.name, it.knows, name, content, gives=bool))
        owners.setdefault(next(whose, ""), {})[name] = content
    for who, chosen in known.items():
        if own := owners.get(who):
            found |= _shared(chosen, own, _look(chosen, own))
    return {name: found[name] if name in found else _of_form(name, tables[name]) for name in tables}


def _look(control: Control, files: Files) -> tuple[Message, ...]:
    return _from_elsewhere(called("controls", control.name, control.look, files, gives=tuple))


def _from_elsewhere(messages: tuple[Message, ...]) -> tuple[Message, ...]:
    """The messages without the hint `AGAIN`, which is for files that ncfix has written."""
    return tuple(replace(message, hint="") if message.hint == AGAIN else message for message in messages)


def _shared(control: Control, files: Files, messages: Iterable[Message]) -> dict[str, Linted]:
    """The results by file; a message on a missing file belongs to the first file."""
    parts: dict[str, list[Message]] = {name: [] for name in files}
    first = next(iter(files))
    for message in messages:
        path = message.place.path if message.place is not None else ""
        parts[path if path in parts else first].append(message)
    return {name: Linted(control.name, control.title, tuple(part)) for name, part in parts.items()}


def _of_form(name: str, content: bytes) -> Linted:
    """The result for a file that no plugin's control knows: by the form that fits all lines, or that a line tells."""
    read = [(form, *read_form(form, name, content)) for form in FORMS]
    whole = [(form, remarks) for form, _, remarks in read if not remarks.wrong]
    told = [(form, remarks) for form, found, remarks in read if any(line.kind in form.tells for line in found.lines)]
    for form, remarks in (whole or told)[:1]:
        return Linted(form.name, form.title, _from_elsewhere(remarks.messages))
    hint = (
        "docs/controllers.md, Tables from elsewhere, lists the forms; for a damaged file, name its control with "
        "--control NAME"
    )
    return Linted(
        "", "", (Message("NCF509", "is not a table in a form that ncfix or a plugin knows", Place(name), hint),)
    )
