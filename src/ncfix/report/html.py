"""A report as one HTML page: plots are inline SVG, nothing is loaded from elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from itertools import cycle

import numpy as np

from ncfix.machine.se3 import Array
from ncfix.report.document import Document, Dots, Line, Part, Plot, Section, Table, Text

WIDTH, HEIGHT, EDGE = 560, 170, 34
COLOURS = ("#2c6fb5", "#b5452c", "#3f8f3f", "#7a4fa0")
STYLE = (
    "body{font:15px/1.45 sans-serif;max-width:70em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;margin:.6em 0}td,th{padding:.2em .8em;border-bottom:1px solid #ccc;text-align:left}"
    "svg{background:#fafafa;margin:.3em 0}figure{margin:.8em 0}figcaption{font-size:13px;color:#444}"
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
    rows = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in table.rows)
    return f"<table>{f'<tr>{head}</tr>' if head else ''}{rows}</table>"


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


class Frame:
    """A plot's axes: from data to places on the page."""

    def __init__(self, across: tuple[float, float], up: tuple[float, float]) -> None:
        self.across, self.up = across, up

    @classmethod
    def around(cls, drawn: Sequence[Line | Dots]) -> Frame:
        """Axes that hold everything, lines with their bands, and zero."""
        x = np.concatenate([each.x for each in drawn])
        edges = np.concatenate([edge for each in drawn for edge in _edges(each)])
        up = min(0.0, float(edges.min())), max(0.0, float(edges.max()))
        return cls((float(x.min()), float(x.max())), up)

    def points(self, x: Array, y: Array) -> str:
        """Places as SVG has them."""
        (left, right), (low, high) = self.across, self.up
        px = EDGE + (WIDTH - 2 * EDGE) * (x - left) / max(right - left, 1e-12)
        py = HEIGHT - EDGE - (HEIGHT - 2 * EDGE) * (y - low) / max(high - low, 1e-12)
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(px.tolist(), py.tolist(), strict=True))

    def around_it(self, inside: str) -> str:
        """The figure with its scale and its zero line."""
        zero = self.points(np.array(self.across), np.zeros(2))
        labels = (
            (2, EDGE, f"{self.up[1]:.3g}"),
            (2, HEIGHT - EDGE, f"{self.up[0]:.3g}"),
            (EDGE, HEIGHT - 12, f"{self.across[0]:.4g}"),
            (WIDTH - 2 * EDGE, HEIGHT - 12, f"{self.across[1]:.4g}"),
        )
        texts = "".join(f'<text x="{x}" y="{y}" font-size="11">{text}</text>' for x, y, text in labels)
        line = f'<polyline points="{zero}" stroke="#999" stroke-dasharray="3"/>'
        box = f'viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}"'
        return f'<svg {box} role="img">{line}{inside}{texts}</svg>'


def _edges(what: Line | Dots) -> tuple[Array, ...]:
    if isinstance(what, Dots) or what.spread is None:
        return (what.y,)
    return what.y - what.spread, what.y + what.spread
