"""The forms that are known: what lines each kind of file has, and what must hold between them."""

from __future__ import annotations

from itertools import pairwise

from ncfix.tables.form import GAP, Check, Document, Form, N, read
from ncfix.tables.lines import Remarks

__all__ = ["BY_NAME", "FORMS", "read", "recognised"]


def _ascending(kind: str) -> Check:
    def check(document: Document, remarks: Remarks) -> None:
        rows = [(n, line.numbers) for n, line in enumerate(document.lines, 1) if line.kind == kind and line.numbers]
        for (_, before), (number, after) in pairwise(rows):
            if after[0] <= before[0]:
                remarks.refuse(number, "the positions must ascend")

    return check


def _elmo(document: Document, remarks: Remarks) -> None:
    if not any(line.kind == "mark" for line in document.lines):
        remarks.refuse(0, "no [header] and no [table]")
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
    names = 0
    for number, line in enumerate(document.lines, 1):
        count = len(line.written().split("//", 1)[0].split())
        if line.kind == "head":
            names = count
        elif line.kind == "row" and count != names:
            remarks.refuse(number, f"{count} numbers under {names} names")


BLANK = r"[ \t]*"
NOTES = {"comment": rf"{BLANK}(?:;|//|#).*", "blank": BLANK}
"""Lines that say nothing, where a form may have them."""
ASIDE = r"(?:#.*|/\*.*\*/[ \t]*)?"
LIST = {"entry": rf"[\w.\[\]]+{GAP}{N}{BLANK}{ASIDE}", "word": rf"[\w.\[\]]+{GAP}\S+{BLANK}{ASIDE}"}
FORMS = (
    Form("comp", "LinuxCNC's .comp", {"row": rf"{BLANK}{N}{GAP}{N}{GAP}{N}{BLANK}"}, _ascending("row"), ("row",)),
    Form(
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
    Form(
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
    ),
    Form(
        "g10",
        "programmable parameter input",
        {
            "begin": rf"(?i:G10 *L5[02]);?{BLANK}",
            "record": rf"(?i:N){N}(?: *(?i:P){N})? *(?i:R){N};?{BLANK}",
            "end": rf"(?i:G11);?{BLANK}",
            "comment": rf"{BLANK}(?:;.*|\(.*\)|%)",
            "blank": BLANK,
        },
        _framed("begin", "end"),
    ),
    Form(
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
    Form(
        "isg-list",
        "an ISG list",
        {**LIST, "comment": rf"{BLANK}(?:#.*|/\*.*\*/{BLANK})", "blank": BLANK},
        needs=("entry",),
    ),
    Form(
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
            "row": rf"{BLANK}{N}" + rf"(?:[ \t]+{N})?" * 60 + BLANK,
            "blank": BLANK,
        },
        _elmo,
    ),
    Form(
        "pmac",
        "PMAC",
        {
            "comment": r";.*",
            "define": rf"{BLANK}(?i:DEFINE +COMP) *\d+(?:\.\d+)*(?: *, *#\d+[dD]?)+(?: *, *\d+)+{BLANK}(?:;.*)?",
            "row": rf"{BLANK}{N}" + rf"(?:{GAP}{N})?" * 24 + rf"{BLANK}(?:;.*)?",
            "blank": BLANK,
        },
        _defined,
    ),
    Form(
        "weihong",
        "NcStudio's axeserr.dat",
        {
            "unit": rf"unit *= *(?:mm|inch){BLANK}",
            "axis": rf"\[\w\]{BLANK}",
            "row": rf"{BLANK}{N} *, *{N} *, *{N}{BLANK}",
            **NOTES,
        },
        _united,
    ),
    Form(
        "hexagon",
        "COMP.ERR",
        {
            "start": rf"START[A-Z]{BLANK}",
            "row": rf"{BLANK}{N} *= *{N}{BLANK}",
            "end": rf"END[A-Z]?{BLANK}",
            "blank": BLANK,
        },
        _framed("start", "end"),
    ),
    Form("centroid", "Centroid's .tab", {"row": BLANK + GAP.join([N] * 5) + BLANK, "blank": BLANK}, needs=("row",)),
    Form(
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
