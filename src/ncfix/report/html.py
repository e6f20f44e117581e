"""A report as one HTML page: plots are inline SVG, nothing is loaded from elsewhere."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape
from itertools import cycle

from ncfix.report.document import Document, Dots, Line, Part, Plot, Section, Table, Text
from ncfix.report.frame import Frame

COLOURS = ("#2c6fb5", "#b5452c", "#3f8f3f", "#7a4fa0")
NUMBER = re.compile(r"[-+]?[\d.]+(e[-+]?\d+)?")
"""Cells that stand to the right under their header."""
STYLE = (
    "body{font:15px/1.45 sans-serif;max-width:74em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;margin:.6em 0}td,th{padding:.2em .8em;border-bottom:1px solid #ccc;text-align:left}"
    "td.n{text-align:right}svg{background:#fafafa}figure{display:inline-block;margin:.4em 1em .6em 0}"
    "figcaption{font-size:13px;color:#444}"
    "@media print{section{break-inside:avoid}}"
)


def rendered(document: Document) -> bytes:
    """The page, UTF-8."""
    title = escape(document.title)
    body = "\n".join(_section(section) for section in document.sections)
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>{STYLE}</style>'
        f"</head>\n<body><h1>{title}</h1>\n{body}\n</body></html>\n"
    ).encode()


def _section(section: Section) -> str:
    parts = "\n".join(_part(part) for part in section.parts)
    return f"<section><h2>{escape(section.heading)}</h2>\n{parts}</section>"


def _part(part: Part) -> str:
    match part:
        case Text(words):
            return f"<p>{escape(words)}</p>"
        case Table():
            return _table(part)
        case Plot():
            return _plot(part)


def _table(table: Table) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in table.header)
    rows = "".join(f"<tr>{''.join(_cell(cell, bool(head)) for cell in row)}</tr>" for row in table.rows)
    return f"<table>{f'<tr>{head}</tr>' if head else ''}{rows}</table>"


def _cell(text: str, aligned: bool) -> str:
    opened = '<td class="n">' if aligned and NUMBER.fullmatch(text) else "<td>"
    return f"{opened}{escape(text)}</td>"


def _plot(plot: Plot) -> str:
    frame = Frame.around(plot.drawn)
    inside = "".join(_drawn(frame, each, colour) for each, colour in zip(plot.drawn, cycle(COLOURS), strict=False))
    caption = f"<figcaption>{escape(plot.caption)}{_legend(plot.drawn)}</figcaption>"
    return f"<figure>{frame.around_it(inside)}{caption}</figure>"


def _drawn(frame: Frame, what: Line | Dots, colour: str) -> str:
    if isinstance(what, Dots):
        places = (place.split(",") for place in frame.points(what.x, what.y).split())
        return "".join(f'<circle cx="{a}" cy="{b}" r="1.5" fill="{colour}" opacity=".5"/>' for a, b in places)
    curve = f'<polyline points="{frame.points(what.x, what.y)}" fill="none" stroke="{colour}"/>'
    if what.spread is None:
        return curve
    upper, lower = frame.points(what.x, what.y + what.spread), frame.points(what.x[::-1], (what.y - what.spread)[::-1])
    return f'<polygon points="{upper} {lower}" fill="{colour}" opacity=".2"/>{curve}'


def _legend(drawn: Sequence[Line | Dots]) -> str:
    named = [
        f'<span style="color:{colour}">{escape(each.label)}</span>'
        for each, colour in zip(drawn, cycle(COLOURS), strict=False)
        if each.label
    ]
    return f" ({', '.join(named)})" if named else ""
