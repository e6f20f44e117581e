"""The axes of a plot: from data to places on a page, with ticks at round numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ncfix.machine.se3 import Array
from ncfix.report.document import Dots, Line

WIDTH, HEIGHT = 520, 190
LEFT, RIGHT, TOP, BOTTOM = 52, 12, 10, 24
"""Pixels round the axes, for the numbers."""
ACROSS, UP = 7, 5
"""Ticks that there are about."""
ROUND = (1.0, 2.0, 5.0, 10.0)


class Frame:
    """A plot's axes: what is across and what is up."""

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
            yield f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{TOP}" y2="{floor}" stroke="#e4e4e4"/>'
            yield f'<text x="{x:.1f}" y="{floor + 15}" text-anchor="middle">{value:g}</text>'
        for value, y in zip(up.tolist(), self._y(up).tolist(), strict=True):
            colour = "#e4e4e4" if value else "#999"
            yield f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" y2="{y:.1f}" stroke="{colour}"/>'
            yield f'<text x="{LEFT - 5}" y="{y + 4:.1f}" text-anchor="end">{value:g}</text>'


def ticks(low: float, high: float, count: int) -> Array:
    """Round numbers from low to high, about so many; of a range without width its only value."""
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
