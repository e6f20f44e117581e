"""A result in a report: what a verb printed with `--json`, as tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ncfix.report.document import Part, Section, Table, Text

Result = Mapping[str, Any]

MOST = 500
"""Rows of a table that are shown."""

HEADINGS = {
    "verdict": "Diagnosis",
    "parameters": "Calibration",
    "control": "Compensation tables",
    "within": "Verification",
    "error_um": "Simulation",
    "files": "Programs",
}
"""What a result is about, by a key that only it has."""

FIX = {
    "path": "program",
    "output": "written to",
    "compensated": "corrected",
    "passed": "passed",
    "inserted_blocks": "inserted",
    "max_correction_um": "largest, um",
}
"""Columns of what `fix` did."""

FIGURES = {"error_before_um": "before", "error_after_um": "after"}


def sections(result: Result, path: str) -> list[Section]:
    """What there is to say of a result."""
    about = next((heading for key, heading in HEADINGS.items() if key in result), "Result")
    parts = list(_parts(result))
    return [Section(f"{about}: {path}", parts or [Text("Nothing.")])]


def _parts(result: Result) -> Iterator[Part]:
    rest = {key: value for key, value in result.items() if key != "schema"}
    if _is_fix(rest.get("files")):
        yield from _programs(rest.pop("files"))
    plain = [
        (_words(key), _cell(value)) for key, value in rest.items() if not _is_rows(value) and value not in (None, [])
    ]
    if plain:
        yield Table((), plain)
    for key, value in rest.items():
        if _is_rows(value):
            yield Text(f"{_words(key).capitalize()}:")
            yield from _rows(value)


def _is_fix(files: Any) -> bool:
    return _is_rows(files) and any("error_after_um" in each for each in files)


def _programs(files: Sequence[Result]) -> Iterator[Part]:
    columns = [*FIX.values(), "refused", *(f"tip error {name}, um max (rms)" for name in FIGURES.values())]
    yield Table(columns, [_program(each) for each in files])
    refused = [
        (each["path"], str(it["line"]), it["code"], it["reason"]) for each in files for it in each.get("refused", ())
    ]
    if refused:
        yield Text("Motions that were refused:")
        yield from _limited(("program", "line", "code", "reason"), refused)
    for kind in ("warnings", "errors"):
        said = [(each["path"], *_message(it)) for each in files for it in each.get(kind, ())]
        if said:
            yield Text(f"{kind.capitalize()}:")
            yield from _limited(("program", "line", "code", "text"), said)


def _program(entry: Result) -> list[str]:
    cells = [_cell(entry.get(key)) for key in FIX]
    return [*cells, str(len(entry.get("refused", ()))), *(_figures(entry.get(key)) for key in FIGURES)]


def _figures(error: Result | None) -> str:
    return f"{error['max']:.2f} ({error['rms']:.2f})" if error and error["max"] is not None else ""


def _message(message: Result) -> tuple[str, str, str]:
    return _cell(message.get("line")), _cell(message.get("code")), _cell(message.get("text"))


def _is_rows(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(each, Mapping) for each in value)


def _rows(rows: Sequence[Result]) -> Iterator[Part]:
    header = list(dict.fromkeys(key for row in rows for key in row))
    yield from _limited([_words(key) for key in header], [[_cell(row.get(key)) for key in header] for row in rows])


def _limited(header: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[Part]:
    yield Table(header, rows[:MOST])
    if len(rows) > MOST:
        yield Text(f"And {len(rows) - MOST} more.")


def _words(key: str) -> str:
    """A key as people would say it: `gap_um` is "gap, um"."""
    name, unit = (key[:-3], ", um") if key.endswith("_um") else (key, "")
    return name.replace("_", " ") + unit


def _cell(value: Any) -> str:
    """A value in a few words; of long lists, how many there are."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.5g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{_words(str(key))} {_cell(item)}" for key, item in value.items())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ", ".join(map(_cell, value)) if len(value) <= 12 else f"{len(value)} values"
    return str(value)
