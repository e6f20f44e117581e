"""The hand-over sheet: one page with all that a person who loads the tables must know, as Markdown and HTML."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from html import escape

import numpy as np

from ncfix.tables.compensation import Tables
from ncfix.tables.control import Control, Request, Written
from ncfix.tables.correction import Residual, corners, residual
from ncfix.version import __version__

CLASSES = {
    "L-POS": "positioning of the linear axes.",
    "L-STR": "straightness of the linear axes.",
    "L-SQR": "squareness of the linear axes.",
    "L-ANG": "displacement of the tip by angular errors of the linear axes.",
    "L-VOL": "position of the tip, over all linear axes together.",
    "L-VOL+": "the same, and the direction of the tool.",
    "R-RAX": "positioning of the rotary axes.",
    "R-VOL": "position of the tip, over linear and rotary axes together.",
    "R-VOL+": "the same, and the direction of the tool.",
}
"""Class of ISO/TR 16907 -> the errors that it corrects, in words."""
BEFORE = (
    "Save all parameters and compensation data of the control, so that they can be loaded again.",
    "Keep every compensation active that was active while the machine was measured: these tables are in addition to "
    "it. Where they would replace values other than zero, load the sum of both, or do not load them.",
    "Remove the workpiece, use no tool or a short one, move to the middle of the travel, turn the overrides down, "
    "and keep a hand at the emergency stop: if a sign or a unit is wrong, the axes jump when the tables become "
    "active.",
    "Before the machine cuts again, measure as in the last step, and run one program above the part.",
)
"""Steps before loading tables, the same for every control."""
JUMP = 1.5
"""Factor on the largest correction: no axis may move further when the tables come on."""
STYLE = "body{font:15px/1.45 sans-serif;max-width:60em;margin:2em auto;padding:0 1em;color:#222}li{margin:.2em 0}"
LONGER = 50.0
"""Additional tool length, mm, for which the error is also stated."""


def as_markdown(control: Control, request: Request, tables: Tables, left: Residual, written: Written) -> str:
    """The sheet as Markdown."""
    return "\n".join(_lines(control, request, tables, left, written)) + "\n"


def _lines(control: Control, request: Request, tables: Tables, left: Residual, written: Written) -> Iterator[str]:
    machine, figures = request.machine, left.figures()
    before, after = figures["before"], figures["after"]
    pose = " ".join(f"{name}{value:g}" for name, value in after["at"].items())
    yield f"# {control.title}: compensation tables for {machine.name}"
    yield ""
    yield f"- Machine file: {machine.hash}; the tables hold for these errors only. Made by ncfix {__version__}."
    yield f"- Tip error: max {before['max']:.2f} um, rms {before['rms']:.2f} um without the tables;"
    yield f"  max {after['max']:.2f} um, rms {after['rms']:.2f} um with them, most at {pose}."
    reached = control.reached(machine, tables)
    yield f"- Class (ISO/TR 16907): {reached}. Tables: {len(tables.grids)}, points: {tables.points}."
    words = reached.replace(",", " ").split()
    yield from (f"- {name}: {meaning}" for name, meaning in CLASSES.items() if name in words)
    if control.any_tool:
        yield f"- The tables hold for tools of any length; the figures are for {request.tool_length:g} mm."
    else:
        yield (
            f"- The tables hold for a tool of {request.tool_length:g} mm, gauge line to "
            f"tip{_length_note(request, tables)}."
        )
    yield f"- Positions count from: {control.properties.position_frame}; looked up: {control.properties.input_signal}."
    if not control.rewrites:
        yield "- Programs that ncfix fix has corrected must not run with them: they would be corrected twice."
    yield "- Not checked: collisions, and whether the control has the options that the tables need."
    largest = list(zip(left.names, left.largest, left.rotary, strict=True))
    yield from _list("Largest corrections", (f"{name}: {_moved(value, rotary)}" for name, value, rotary in largest))
    ranges = (
        f"{axis.name}: {low / axis.unit:g} to {high / axis.unit:g} {'degree' if axis.rotary else 'mm'}"
        for axis, (low, high) in zip(machine.axes, request.space, strict=True)
    )
    yield from _list("Range covered; beyond it: " + control.properties.extrapolation, ranges)
    yield from _list("Settings", (f"{name} = {value}" for name, value in request.settings.items() if value))
    if not control.rewrites:
        moved = ", ".join(f"{name} {_moved(JUMP * value, rotary)}" for name, value, rotary in largest if value)
        jump = f"No axis may move by more than this when the tables become active: {moved}."
        yield from _list("Before you begin", (*BEFORE, jump) if moved else BEFORE)
    yield from _list("What to do, in this order", control.steps, numbered=True)
    if not control.rewrites:
        title = (
            "What the control must then add (mean of both directions of motion); make sure that the axes are free to "
            "move"
        )
        yield from _list(title, _checks(request, tables))
    yield from _list("How to switch the tables off", [control.switch_off])
    yield from _list("Files", sorted(written.files))
    yield from _list("Remarks", written.notes)
    assumed = [f"{each.id}: {each.text} Check: {each.verify} Source: {each.source}." for each in control.assumptions]
    yield from _list("Assumed, because no public document states it", assumed)


def _list(title: str, items: Iterable[str], numbered: bool = False) -> Iterator[str]:
    found = list(items)
    if found:
        yield from ("", f"## {title}", "")
        yield from (f"{number}. {item}" if numbered else f"- {item}" for number, item in enumerate(found, 1))


def _length_note(request: Request, tables: Tables) -> str:
    if request.machine.depends_on_tool_length:
        other = residual(request.machine, tables, request.space, request.tool_length + LONGER).figures()["after"]
        left = f"max {other['max']:.2f} um, rms {other['rms']:.2f} um"
        return f"; the error depends on that length: with a tool {LONGER:g} mm longer, {left} remain"
    return "; the error of this machine does not depend on that length"


def _checks(request: Request, tables: Tables) -> Iterator[str]:
    """Poses with corrections, to check the control: the middle of the travel, and for each axis the pose of its largest
    correction among those half-way to the corners.
    """
    names, units = request.machine.axis_names, np.array([axis.unit for axis in request.machine.axes])
    space = request.space.mean(axis=1)[:, None] + (request.space - request.space.mean(axis=1)[:, None]) / 2
    q = np.concatenate([space.mean(axis=1)[None], corners(space)])
    q = np.unique(np.round(q / units, 3), axis=0) * units
    found = tables.for_tool(request.tool_length).at(names, q)
    middle = int(np.argmin(np.abs(q - space.mean(axis=1)).sum(axis=1)))
    rows = [middle, *np.argmax(np.abs(found), axis=0)[np.abs(found).max(axis=0) > 0].tolist()]
    for row in dict.fromkeys(rows):
        pose = " ".join(f"{name}{value:g}" for name, value in zip(names, q[row] / units, strict=True))
        added = ", ".join(
            f"{name} {_moved(value, axis.rotary, '+')}"
            for name, value, axis in zip(names, found[row], request.machine.axes, strict=True)
        )
        yield f"{pose}: {added}"


def _moved(value: float, rotary: bool, sign: str = "") -> str:
    return f"{np.degrees(value) + 0.0:{sign}.5f} degree" if rotary else f"{1e3 * value + 0.0:{sign}.1f} um"


def as_html(markdown: str) -> str:
    """The sheet as an HTML page; it consists of headings, lists and paragraphs only."""
    body: list[str] = []
    opened = ""
    for line in markdown.splitlines():
        kind, text = _kind(line)
        if opened and kind not in (opened, "more"):
            body.append(f"</{opened}>")
            opened = ""
        if kind in ("ul", "ol") and not opened:
            body.append(f"<{kind}>")
            opened = kind
        if kind in ("ul", "ol"):
            body.append(f"<li>{escape(text)}</li>")
        elif kind == "more":
            body[-1] = f"{body[-1].removesuffix('</li>')} {escape(text)}</li>"
        elif text:
            body.append(f"<{kind}>{escape(text)}</{kind}>")
    if opened:
        body.append(f"</{opened}>")
    title = escape(markdown.splitlines()[0].removeprefix("# "))
    head = f'<meta charset="utf-8"><title>{title}</title><style>{STYLE}</style>'
    head = f'<!doctype html>\n<html lang="en"><head>{head}</head><body>'
    return "\n".join([head, *body, "</body></html>"]) + "\n"


def _kind(line: str) -> tuple[str, str]:
    """The HTML element of a line of the sheet, and its text."""
    if line.startswith("## "):
        return "h2", line[3:]
    if line.startswith("# "):
        return "h1", line[2:]
    if line.startswith("- "):
        return "ul", line[2:]
    if line.startswith("  "):
        return "more", line.strip()
    number, dot, text = line.partition(". ")
    return ("ol", text) if dot and number.isdigit() else ("p", line)
