"""The increments of an axis: from the curve of its correction to small whole numbers whose sums follow it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ncfix.diagnostics import RefusedError
from ncfix.tables.axis_tables import positioning
from ncfix.tables.control import Request
from ncfix.tables.grid import Array, Grid
from ncfix_fanuc.pitch_text import LARGEST, MOST, Pitch

MOST_MAGNIFICATION = 100
"""The largest magnification of pitch errors (parameter 3623)."""


def curves(request: Request) -> dict[str, tuple[Grid, ...]]:
    """The forward and the reverse correction of each axis over itself."""
    tables = positioning(request.machine, request.space, request.tool_length, MOST - 1, request.target)
    found: dict[str, tuple[Grid, ...]] = {}
    for term in tables.terms:
        found[term.outputs[0]] = (*found.get(term.outputs[0], ()), term.factors[0])
    return found


def at_zero(tables: tuple[Grid, ...]) -> float:
    """The correction at the reference position, mm or rad: what increments cannot say."""
    return float(np.mean([table.at(np.zeros((1, 1)))[0, 0] for table in tables]))


def pitch_of(request: Request, axis: str, tables: tuple[Grid, ...], step: float, number: int) -> Pitch | None:
    """The increments of an axis; twice as many points as the curve needs, and twice again, while that rounds less.

    step    what a detection unit adds to a correction, mm or rad: below zero where increments are errors
    number  the first point that is free
    """
    if not tables:
        return None
    cells = len(tables[0].nodes[0]) - 1
    best = _with_cells(request, axis, tables, step, number, cells)
    while best is not None and best.magnification > 1 and 2 * cells < MOST - 1:
        cells *= 2
        best = _with_cells(request, axis, tables, step, number, cells)
    return best


def _with_cells(
    request: Request, axis: str, tables: tuple[Grid, ...], step: float, number: int, cells: int
) -> Pitch | None:
    """The increments with about so many intervals, if they make the axis better: the value at zero cannot be said.

    Points are numbered so that the reference position has a number of zero or more, wherever it lies. The first and the
    last point of a turn are one place, and have the same value (B-63980EN, p. 100).
    """
    column = request.machine.axis_names.index(axis)
    described = request.machine.axes[column]
    low, high = (request.space[column] / described.unit).tolist()
    turn = 360.0 if described.endless else 0.0
    interval = 360.0 / cells if turn else math.ceil((high - low) / cells * 1000) / 1000
    first, last = (0, cells) if turn else _ends(low, high, interval)
    if last - first + 1 > MOST:
        raise RefusedError.of(
            "NCF484", f"{axis} needs {last - first + 1} points, and the control has {MOST} for an axis"
        )
    places = np.arange(first, last + 1) * interval * described.unit
    inside = _turned(places, request.space[column]) if turn else np.clip(places, *request.space[column])
    mean = np.mean([table.at(inside[:, None])[:, 0] for table in tables], axis=0)
    curve: Array = mean - at_zero(tables)
    if turn:
        curve[-1] = curve[0]
    increments, magnification = diffused(curve / step)
    if not increments.any() or np.mean((mean - curve) ** 2) > np.mean(mean**2):
        return None
    if turn:
        increments[0] = increments[-1]
    number = max(number, first)
    return Pitch(axis, number, increments, number - first, magnification, interval, turn)


def _ends(low: float, high: float, interval: float) -> tuple[int, int]:
    """The first and last whole number of intervals from zero that hold a range."""
    first = math.floor(low / interval + 1e-9)
    return first, max(math.ceil(high / interval - 1e-9), first + 1)


def _turned(places: Array, space: Array) -> Array:
    found: Array = space[0] + np.mod(places - space[0], 2 * np.pi)
    return found


def diffused(curve: Array) -> tuple[NDArray[np.int64], int]:
    """Increments from -7 to 7 whose sums follow a curve (detection units) within half a step, and the magnification.

    The first increment leads to the first point and is none: sums count from the reference position, where the curve
    is zero.
    """
    magnification = 1
    while True:
        steps = np.rint(curve / magnification)
        increments = np.diff(steps, prepend=steps[0]).astype(np.int64)
        if np.abs(increments).max() <= LARGEST:
            return increments, magnification
        magnification += 1
        if magnification > MOST_MAGNIFICATION:
            raise RefusedError.of(
                "NCF484", f"a pitch error needs a magnification above {MOST_MAGNIFICATION}", hint="is the error in mm?"
            )
