"""Report content for machines (errors with their curves) and for results (their tables)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ncfix.machine import Axis, Effect, Machine
from ncfix.machine.effects import (
    depends_on,
    effect_curves,
    extent,
    facts,
    rest_of,
    tip_curves,
    title_of,
    travel_of,
    vector,
    with_unit,
)
from ncfix.reports.document import Line, Paragraph, Part, Plot, ReportSection, Table

WAYS = {1: "upwards", -1: "downwards", 0: ""}
Result = Mapping[str, Any]
MAX_TABLE_ROWS = 500
"""Largest number of rows of a table that are shown."""
HEADINGS = {
    "verdict": "Diagnosis",
    "parameters": "Calibration",
    "control": "Compensation tables",
    "within": "Verification",
    "error_um": "Simulation",
    "files": "Programs",
}
"""Headings of results, by a key that only such a result has."""
FIX = {
    "path": "program",
    "output": "written to",
    "compensated": "corrected",
    "passed": "passed",
    "inserted_blocks": "inserted",
    "max_correction_um": "largest, um",
}
"""Columns of the results of `fix`."""
TERMS = {"freedom": "degrees of freedom", "chi_square": "reduced chi-square", "condition": "condition number"}
"""Readable forms of some keys."""
FIGURES = {"error_before_um": "before", "error_after_um": "after"}


def machine_sections(machine: Machine, path: str) -> list[ReportSection]:
    """Sections on a machine: its axes, its errors with their curves, and the resulting errors of the tool tip."""
    chain = Table(("axis", "kind", "carries", "direction", "through", "travel"), [_axis(axis) for axis in machine.axes])
    about = Table((), [("file", path), ("hash", machine.hash), *facts(machine).items()])
    head = ReportSection(machine.name, [about, chain])
    if machine.is_perfect:
        return [head, ReportSection("Errors", [Paragraph("None.")])]
    words = (
        "Actual minus nominal position of the tool tip in the workpiece frame, as one axis moves and the others are "
        "in the middle of their travel; tool length zero, approached from below"
    )
    rest = ", ".join(f"{name} at {value:g}" for name, value in rest_of(machine).items())
    words += f"; {rest}." if rest else "."
    tip = ReportSection("Error of the tool tip", [Paragraph(words), *_tip_plots(machine)])
    rows = [
        (effect.name, title_of(machine, effect), depends_on(effect), _size(machine, effect))
        for effect in machine.effects
    ]
    errors = ReportSection("Errors", [Table(("effect", "what it is", "depends on", "size"), rows)])
    joints = {joint: list(_curve_plots(machine, joint)) for joint in (*machine.axis_names, "S")}
    return [
        head, tip, errors, *(ReportSection(f"Errors of {joint}", plots) for joint, plots in joints.items() if plots),
    ]  # fmt: skip


def _axis(axis: Axis) -> Sequence[str]:
    carries = "workpiece" if axis.workpiece_side else "tool"
    through = vector(axis.point) if axis.rotary else ""
    return axis.name, "rotary" if axis.rotary else "linear", carries, vector(axis.direction), through, travel_of(axis)


def _tip_plots(machine: Machine) -> Iterator[Plot]:
    for curve in tip_curves(machine):
        named = zip("xyz", curve.error.T, strict=True)
        lines = [Line(curve.x, 1e3 * values, label=f"d{name}") for name, values in named]
        yield Plot(f"um over {with_unit(machine, curve.axis)}", lines)


def _size(machine: Machine, effect: Effect) -> str:
    factor, unit = _unit(effect)
    found = extent(machine, effect)
    if found is None:
        return "not known: depends on an input or an axis without range"
    low, high = (factor * value for value in found)
    sigma = ""
    if effect.covariance is not None and len(effect.coefficients) == 1:
        sigma = f" (1 sigma {factor * float(np.sqrt(max(effect.covariance[0][0], 0.0))):.2g})"
    return f"{low:+.3g}{sigma} {unit}" if low == high else f"{low:+.3g} ... {high:+.3g} {unit}"


def _unit(effect: Effect) -> tuple[float, str]:
    return (1e6, "urad") if effect.rotational else (1e3, "um")


def _curve_plots(machine: Machine, joint: str) -> Iterator[Plot]:
    """The effects of a joint over the axis that each depends on; one curve for each direction of motion."""
    for effect in machine.effects:
        found = effect_curves(machine, effect) if effect.joint == joint else []
        if found:
            factor, unit = _unit(effect)
            band = "; band: two standard deviations" if found[0].sigma is not None else ""
            caption = f"{effect.name} ({effect.basis.name}), {unit} over {with_unit(machine, found[0].axis)}{band}"
            lines = []
            for curve in found:
                spread = None if curve.sigma is None else 2 * factor * curve.sigma
                lines.append(Line(curve.x, factor * curve.value, spread, WAYS[curve.direction]))
            yield Plot(caption, lines)


def result_sections(result: Result, path: str) -> list[ReportSection]:
    """The section on a result."""
    about = next((heading for key, heading in HEADINGS.items() if key in result), "Result")
    return [ReportSection(f"{about}: {path}", list(_parts(result)) or [Paragraph("Nothing.")])]


def _parts(result: Result) -> Iterator[Part]:
    rest = {key: value for key, value in result.items() if key != "schema"}
    files: Any = rest.get("files")
    if _is_rows(files) and any("error_after_um" in each for each in files) and all(map(is_of_fix, files)):
        yield from _programs(rest.pop("files"))
    if _is_of_calibration(rest):
        yield from _calibration(rest.pop("parameters"))
        rest.pop("covariance", None)
    plain = [
        (_words(key), _cell(value)) for key, value in rest.items() if not _is_rows(value) and value not in (None, [])
    ]
    if plain:
        yield Table((), plain)
    for key, value in rest.items():
        if _is_rows(value):
            yield Paragraph(f"{_words(key).capitalize()}:")
            header = list(dict.fromkeys(name for row in value for name in row))
            cells = [[_cell(row.get(name)) for name in header] for row in value]
            yield from _limited([_words(name) for name in header], cells)


def _is_of_calibration(result: Result) -> bool:
    """Whether each coefficient has a name, a value, and a standard deviation or None (held)."""
    rows = result.get("parameters")
    return _is_rows(rows) and all(
        isinstance(row.get("name"), str)
        and row.get("value") is not None
        and _is_figure(row["value"])
        and _is_figure(row.get("sigma"))
        for row in rows or ()
    )


def _calibration(rows: Sequence[Result]) -> Iterator[Part]:
    """The coefficients with their uncertainties, um and urad."""
    cells = []
    for row in rows:
        factor, unit = (1e6, "urad") if row["name"][1:2] in ("A", "B", "C") else (1e3, "um")
        sigma = row.get("sigma")
        known = ("held", "") if sigma is None else (f"{factor * sigma:.3g}", f"{2 * factor * sigma:.3g}")
        cells.append((row["name"], f"{factor * row['value']:.4g}", *known, unit))
    yield from _limited(("coefficient", "value", "u (k = 1)", "U (k = 2)", "unit"), cells)
    yield Paragraph(
        "u is the standard uncertainty, U the expanded uncertainty. They contain the noise and the fit only, not the "
        "calibration of the instrument or its environment. A coefficient that multiplies a temperature, a load or a "
        "time is per K, kg or s."
    )


def is_of_fix(entry: Any) -> bool:
    """Whether `entry` has the form of a program in `ncfix fix --json`; a file edited by people may be anything."""
    if not isinstance(entry, Mapping) or not isinstance(entry.get("path"), str) or "output" not in entry:
        return False
    rows = (("refused", "reason"), ("warnings", "text"), ("errors", "text"))
    return (
        all(isinstance(entry[key], str | None) for key in ("output", "page") if key in entry)
        and ("errors" in entry or {"changed", "refused", "warnings"} <= entry.keys())
        and all(_is_said(entry[key], text) for key, text in rows if key in entry)
        and bool(entry.get("errors", True))
        and (entry["output"] is not None or bool(entry.get("refused") or entry.get("errors")))
        and isinstance(entry.get("compensated", 0), int)
        and _is_figure(entry.get("max_correction_um"))
        and all(
            error is None
            or (isinstance(error, Mapping) and all(_is_figure(error.get(name, "")) for name in ("max", "rms")))
            for error in map(entry.get, FIGURES)
        )
    )


def _is_said(rows: Any, text: str) -> bool:
    """Whether `rows` are messages, each with a code and a text."""
    return isinstance(rows, list) and all(
        isinstance(row, Mapping)
        and isinstance(row.get("code"), str)
        and isinstance(row.get(text), str)
        and bool(row[text])
        for row in rows
    )


def _is_figure(value: Any) -> bool:
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _programs(files: Sequence[Result]) -> Iterator[Part]:
    columns = [*FIX.values(), "refused", *(f"tip error {name}, um max (rms)" for name in FIGURES.values())]
    yield Table(columns, [_program(each) for each in files])
    refused = [
        (each["path"], _cell(it.get("line")), it["code"], it["reason"])
        for each in files
        for it in each.get("refused", ())
    ]
    if refused:
        yield Paragraph("Motions that were refused:")
        yield from _limited(("program", "line", "code", "reason"), refused)
    for kind in ("warnings", "errors"):
        said = [
            (each["path"], *(_cell(it.get(key)) for key in ("line", "code", "text")))
            for each in files
            for it in each.get(kind, ())
        ]
        if said:
            yield Paragraph(f"{kind.capitalize()}:")
            yield from _limited(("program", "line", "code", "text"), said)


def _program(entry: Result) -> list[str]:
    figures = [
        f"{error['max']:.2f} ({error['rms']:.2f})" if (error := entry.get(key)) and error["max"] is not None else ""
        for key in FIGURES
    ]
    return [*(_cell(entry.get(key)) for key in FIX), str(len(entry.get("refused", ()))), *figures]


def _is_rows(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(each, Mapping) for each in value)


def _limited(header: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[Part]:
    yield Table(header, rows[:MAX_TABLE_ROWS])
    if len(rows) > MAX_TABLE_ROWS:
        yield Paragraph(f"And {len(rows) - MAX_TABLE_ROWS} more.")


def _words(key: str) -> str:
    """A key in readable form: `gap_um` is "gap, um"."""
    if key in TERMS:
        return TERMS[key]
    name, unit = (key[:-3], ", um") if key.endswith("_um") else (key, "")
    return name.replace("_", " ") + unit


def _cell(value: Any) -> str:
    """A value in a few words; of a long list, its length."""
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
