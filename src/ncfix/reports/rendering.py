"""Renders a report as a file: one HTML page with SVG plots that loads nothing else, or Markdown.

The suffix of the file selects the form; plugins can add forms.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from html import escape
from itertools import cycle

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnostics import Place, UsageError
from ncfix.plugins import called, registry
from ncfix.reports.document import ArrowMap, Bars, Document, Dots, Line, Paragraph, Part, Plot, Table

WIDTH, HEIGHT = 520, 190
LEFT, RIGHT, TOP, BOTTOM = 52, 12, 10, 24
"""Margins around the axes, pixels, for the numbers."""
NAMES, VALUES, BAR = 150, 60, 24
"""Pixels for names and for values of bars, and from bar to bar."""
PANEL, EDGE, LONGEST = 300, 44, 40.0
"""Pixels: size of an arrow map, of its margin, and of the longest arrow."""
ACROSS, UP = 7, 5
"""Approximate numbers of ticks."""
ROUND = (1.0, 2.0, 5.0, 10.0)
COLOURS = ("#2c6fb5", "#b5452c", "#3f8f3f", "#7a4fa0")
NUMBER = re.compile(r"[-+]?[\d.]+(e[-+]?\d+)?")
"""Cells that are aligned to the right under their header."""
STYLE = (
    "body{font:15px/1.45 sans-serif;max-width:74em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;margin:.6em 0}td,th{padding:.2em .8em;border-bottom:1px solid #ccc;text-align:left}"
    "td.n{text-align:right}svg{background:#fafafa}figure{display:inline-block;margin:.4em 1em .6em 0}"
    "figcaption{font-size:13px;color:#444}"
    "@media(prefers-color-scheme:dark){body{background:#16181c;color:#ddd}svg{background:#1e2126}"
    "figcaption{color:#aaa}td,th{border-color:#3a3d42}svg text{fill:#aaa}"
    "svg .grid{stroke:#33373d}svg .zero{stroke:#888}}"
    "@media print{section{break-inside:avoid}}"
)
Rendering = Callable[[Document], bytes]
"""Renders a report as the content of a file."""


def form_of(path: str) -> Rendering:
    """The form for the suffix of a file (without suffix: HTML); raises `UsageError` NCF018."""
    suffix = os.path.splitext(path)[1].lower() or ".html"
    known: dict[str, Rendering] = registry("reporters", {".html": html, ".md": markdown})
    if suffix not in known:
        raise UsageError.of("NCF018", f"a report cannot be a {suffix} file", Place(path), f"one of {' '.join(known)}")
    return partial(called, "reporters", suffix, known[suffix], gives=bytes)


def html(document: Document) -> bytes:
    """The report as an HTML page, UTF-8."""
    title = escape(document.title)
    body = "\n".join(
        f"<section><h2>{escape(section.heading)}</h2>\n" + "\n".join(map(_html_part, section.parts)) + "</section>"
        for section in document.sections
    )
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>{STYLE}</style>'
        f"</head>\n<body><h1>{title}</h1>\n{body}\n</body></html>\n"
    ).encode()


def _html_part(part: Part) -> str:
    match part:
        case Paragraph(words):
            return f"<p>{escape(words)}</p>"
        case Table():
            return _html_table(part)
        case Plot():
            return html_plot(part)
        case Bars():
            return _html_bars(part)
        case ArrowMap():
            return _html_arrows(part)


def _html_table(table: Table) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in table.header)
    rows = "".join(f"<tr>{''.join(_html_cell(cell, bool(head)) for cell in row)}</tr>" for row in table.rows)
    return f"<table>{f'<tr>{head}</tr>' if head else ''}{rows}</table>"


def _html_cell(text: str, aligned: bool) -> str:
    opened = '<td class="n">' if aligned and NUMBER.fullmatch(text) else "<td>"
    return f"{opened}{escape(text)}</td>"


def html_plot(plot: Plot) -> str:
    """The plot as a figure with its caption."""
    frame = PlotAxes.around(plot.drawn)
    inside = "".join(_drawn(frame, each, colour) for each, colour in zip(plot.drawn, cycle(COLOURS), strict=False))
    caption = f"<figcaption>{escape(plot.caption)}{_legend(plot.drawn)}</figcaption>"
    return f"<figure>{frame.around_it(inside)}{caption}</figure>"


def _html_bars(bars: Bars) -> str:
    """Horizontal bars below each other, with names on the left and values on the right."""
    longest = max([0.0, *bars.values]) or 1.0
    room = WIDTH - NAMES - VALUES
    drawn = []
    for k, (name, value) in enumerate(zip(bars.names, bars.values, strict=True)):
        top, wide = BAR * k, max(room * value / longest, 1.0)
        drawn.append(
            f'<text x="{NAMES - 6}" y="{top + BAR - 7}" text-anchor="end">{escape(name)}</text>'
            f'<rect x="{NAMES}" y="{top + 3}" width="{wide:.1f}" height="{BAR - 6}" fill="{COLOURS[0]}"/>'
            f'<text x="{NAMES + wide + 5:.1f}" y="{top + BAR - 7}">{value:.2f}</text>'
        )
    height = BAR * len(bars.names)
    picture = f'<svg width="{WIDTH}" height="{height}" font-size="12" role="img">{"".join(drawn)}</svg>'
    return f"<figure>{picture}<figcaption>{escape(bars.caption)}</figcaption></figure>"


def _html_arrows(part: ArrowMap) -> str:
    """A square panel for each title; the longest arrow of all has `LONGEST` pixels."""
    inner, scale = PANEL - 2 * EDGE, LONGEST / (max(map(_longest, part.shifts.values())) or 1.0)
    wide = max(float(np.ptp(part.x)), float(np.ptp(part.y))) or 1.0
    x = EDGE + inner / 2 + inner * (part.x - (part.x.max() + part.x.min()) / 2) / wide
    y = PANEL - EDGE - inner / 2 - inner * (part.y - (part.y.max() + part.y.min()) / 2) / wide
    drawn = []
    for k, ((title, shifts), colour) in enumerate(zip(part.shifts.items(), cycle(COLOURS), strict=False)):
        left, ends = PANEL * k, np.stack([x, y], axis=1) + shifts * [scale, -scale]
        drawn.append(f'<text x="{left + PANEL / 2}" y="14" text-anchor="middle">{escape(title)}</text>')
        for a, b, (c, d) in zip(x.tolist(), y.tolist(), ends.tolist(), strict=True):
            drawn.append(
                f'<line x1="{left + a:.1f}" y1="{b:.1f}" x2="{left + c:.1f}" y2="{d:.1f}" stroke="{colour}"/>'
                f'<circle cx="{left + a:.1f}" cy="{b:.1f}" r="1.2" fill="{colour}"/>'
            )
        drawn.append(
            f'<text x="{left + PANEL / 2}" y="{PANEL - 4}" text-anchor="middle">{escape(part.across)}</text>'
            f'<text x="{left + 12}" y="{PANEL / 2}" text-anchor="middle" '
            f'transform="rotate(-90 {left + 12} {PANEL / 2})">{escape(part.up)}</text>'
        )
    size = f'width="{PANEL * len(part.shifts)}" height="{PANEL}"'
    said = f"{part.caption} The longest arrow is {LONGEST / scale:.1f} {part.unit}; all panels have one scale."
    picture = f'<svg {size} font-size="11" fill="#555" role="img">{"".join(drawn)}</svg>'
    return f"<figure>{picture}<figcaption>{escape(said)}</figcaption></figure>"


def _longest(shifts: Array) -> float:
    return float(np.linalg.norm(shifts, axis=1).max(initial=0.0))


def _drawn(frame: PlotAxes, what: Line | Dots, colour: str) -> str:
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


def markdown(document: Document) -> bytes:
    """The report as Markdown text, UTF-8; of plots only the extremes."""
    lines = [f"# {_escaped(document.title)}"]
    for section in document.sections:
        lines += [f"\n## {_escaped(section.heading)}\n", *(f"{_markdown_part(part)}\n" for part in section.parts)]
    return "\n".join(lines).encode()


def _markdown_part(part: Part) -> str:
    match part:
        case Paragraph(words):
            return _escaped(words)
        case Table(header, rows):
            width = max([len(header), *map(len, rows)])
            cells = [list(header) or [""] * width, ["---"] * width, *rows]
            return "\n".join(f"| {' | '.join(map(_escaped, row))} |" for row in cells)
        case Plot(caption, drawn):
            return f"{_escaped(caption)}: {'; '.join(map(_extremes, drawn))}"
        case ArrowMap(caption, shifts=shifts, unit=unit):
            sizes = (f"{_escaped(title)} up to {_longest(each):.1f} {unit}" for title, each in shifts.items())
            return f"{_escaped(caption)}: {'; '.join(sizes)}"
        case Bars(caption, names, values):
            listed = "; ".join(f"{_escaped(name)} {value:.2f}" for name, value in zip(names, values, strict=True))
            return f"{_escaped(caption)}: {listed}"


def _extremes(what: Line | Dots) -> str:
    label = f"{_escaped(what.label)} " if what.label else ""
    return f"{label}{what.y.min():+.3g} to {what.y.max():+.3g}"


def _escaped(text: str) -> str:
    """Text with the special characters of Markdown escaped."""
    for mark in "\\`*_[]<>|#":
        text = text.replace(mark, f"\\{mark}")
    return text


class PlotAxes:
    """The axes of a plot: ranges across and up."""

    def __init__(self, across: tuple[float, float], up: tuple[float, float]) -> None:
        self.across, self.up = across, up

    @classmethod
    def around(cls, drawn: Sequence[Line | Dots]) -> PlotAxes:
        """Axes that include all data with their bands, and zero."""
        x = np.concatenate([each.x for each in drawn])
        edges = np.concatenate([edge for each in drawn for edge in _edges(each)])
        up = min(0.0, float(edges.min())), max(0.0, float(edges.max()))
        return cls((float(x.min()), float(x.max())), up)

    def points(self, x: Array, y: Array) -> str:
        """Points in the form of SVG."""
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(self._x(x).tolist(), self._y(y).tolist(), strict=True))

    def _x(self, x: Array) -> Array:
        left, right = self.across
        return LEFT + (WIDTH - LEFT - RIGHT) * (x - left) / max(right - left, 1e-12)

    def _y(self, y: Array) -> Array:
        low, high = self.up
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (y - low) / max(high - low, 1e-12)

    def around_it(self, inside: str) -> str:
        """The figure with its scales and its zero line."""
        box = f'viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}"'
        return f'<svg {box} role="img" font-size="11" fill="#555">{"".join(self._scales())}{inside}</svg>'

    def _scales(self) -> Iterator[str]:
        floor = HEIGHT - BOTTOM
        across, up = ticks(*self.across, ACROSS), ticks(*self.up, UP)
        for value, x in zip(across.tolist(), self._x(across).tolist(), strict=True):
            yield f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{TOP}" y2="{floor}" class="grid" stroke="#e4e4e4"/>'
            yield f'<text x="{x:.1f}" y="{floor + 15}" text-anchor="middle">{value:g}</text>'
        for value, y in zip(up.tolist(), self._y(up).tolist(), strict=True):
            colour, kind = ("#e4e4e4", "grid") if value else ("#999", "zero")
            yield f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" y2="{y:.1f}" class="{kind}" stroke="{colour}"/>'
            yield f'<text x="{LEFT - 5}" y="{y + 4:.1f}" text-anchor="end">{value:g}</text>'


def ticks(low: float, high: float, count: int) -> Array:
    """About `count` round numbers from low to high; for an empty range, its only value."""
    if not high > low:
        return np.array([low])
    rough = (high - low) / count
    power = 10.0 ** np.floor(np.log10(rough))
    step = power * min(ROUND, key=lambda each: abs(np.log(each * power / rough)))
    numbers = np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1)
    return np.asarray(numbers * step, dtype=np.float64).round(15) + 0.0


def _edges(what: Line | Dots) -> tuple[Array, ...]:
    if isinstance(what, Dots) or what.spread is None:
        return (what.y,)
    return what.y - what.spread, what.y + what.spread
