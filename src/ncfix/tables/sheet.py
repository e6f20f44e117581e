"""The hand-over sheet: what whoever loads the tables must know, on a page. Markdown, and the same as HTML."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from html import escape

from ncfix.tables.control import Control, Request, Written
from ncfix.tables.neutral import Tables
from ncfix.tables.residual import Residual, residual

CLASSES = {
    "L-POS": "how far each linear axis goes, along itself.",
    "L-STR": "straightness of the linear axes.",
    "L-SQR": "squareness of the linear axes.",
    "L-ANG": "what the angular errors of linear axes do to the tip.",
    "L-VOL": "the position of the tip over all linear axes together.",
    "L-VOL+": "the same, and the direction of the tool.",
    "R-VOL": "the position of the tip over linear and rotary axes together.",
    "R-VOL+": "the same, and the direction of the tool.",
}
"""What ISO/TR 16907 means by them: what of the machine's errors is corrected."""
LONGER = 50.0
"""mm: the tool with which it is shown what another length leaves."""


def as_markdown(control: Control, request: Request, tables: Tables, left: Residual, written: Written) -> str:
    """The sheet."""
    return "\n".join(_lines(control, request, tables, left, written)) + "\n"


def _lines(control: Control, request: Request, tables: Tables, left: Residual, written: Written) -> Iterator[str]:
    machine, figures = request.machine, left.figures()
    before, after = figures["before"], figures["after"]
    yield f"# {control.title}: compensation tables for {machine.name}"
    yield ""
    yield f"- Machine file: {machine.hash}; the tables hold for these errors only."
    yield f"- Tip error: max {before['max']:.2f} um, rms {before['rms']:.2f} um without the tables;"
    yield f"  max {after['max']:.2f} um, rms {after['rms']:.2f} um with them, most at {_pose(after['at'])}."
    yield f"- Class (ISO/TR 16907): {control.reaches}. Tables: {len(tables.grids)}, points: {tables.points}."
    yield from (f"- {name}: {meaning}" for name, meaning in CLASSES.items() if name in _words(control.reaches))
    if control.any_tool:
        yield f"- They hold for tools of any length; the figures are those of {request.tool_length:g} mm."
    else:
        yield f"- They hold for a tool of {request.tool_length:g} mm, gauge line to tip{_length_note(request, tables)}."
    if not control.rewrites:
        yield "- Programs that ncfix fix has corrected must not run with them: they would be corrected twice."
    yield "- Not checked: collisions, and whether the control has the options that the tables need."
    yield from _list("Largest corrections", _corrections(left))
    yield from _list("Range covered; beyond it: " + control.properties.extrapolation, _ranges(request))
    yield from _list("Settings", (f"{name} = {value}" for name, value in request.settings.items() if value))
    yield from _list("What to do, in this order", control.steps, numbered=True)
    yield from _list("How to switch it off", [control.switch_off])
    yield from _list("Files", sorted(written.files))
    yield from _list("Remarks", written.notes)
    assumed = [f"{each.id}: {each.text} Check: {each.verify} Source: {each.source}." for each in control.assumptions]
    yield from _list("Assumed, since no public text settles it", assumed)


def _list(title: str, items: Iterable[str], numbered: bool = False) -> Iterator[str]:
    found = list(items)
    if found:
        yield from ("", f"## {title}", "")
        yield from (f"{number}. {item}" if numbered else f"- {item}" for number, item in enumerate(found, 1))


def _pose(at: dict[str, float]) -> str:
    return " ".join(f"{name}{value:g}" for name, value in at.items())


def _words(reaches: str) -> list[str]:
    return reaches.replace(",", " ").split()


def _length_note(request: Request, tables: Tables) -> str:
    if request.machine.depends_on_tool_length:
        other = residual(request.machine, tables, request.space, request.tool_length + LONGER).figures()["after"]
        left = f"max {other['max']:.2f} um, rms {other['rms']:.2f} um"
        return f"; the error depends on that length: with a tool {LONGER:g} mm longer {left} are left"
    return "; the error of this machine does not depend on that length"


def _corrections(left: Residual) -> Iterator[str]:
    for name, value, rotary in zip(left.names, left.largest, left.rotary, strict=True):
        yield f"{name}: {1e6 * value:.1f} urad" if rotary else f"{name}: {1e3 * value:.1f} um"


def _ranges(request: Request) -> Iterator[str]:
    for axis, (low, high) in zip(request.machine.axes, request.space, strict=True):
        unit = "degree" if axis.rotary else "mm"
        yield f"{axis.name}: {low / axis.unit:g} to {high / axis.unit:g} {unit}"


def as_html(markdown: str) -> str:
    """The sheet as a page of its own: headings, lists and paragraphs are all that it has."""
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
    head = f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title></head><body>'
    return "\n".join([head, *body, "</body></html>"]) + "\n"


def _kind(line: str) -> tuple[str, str]:
    """The element that a line of the sheet makes, and its text."""
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
