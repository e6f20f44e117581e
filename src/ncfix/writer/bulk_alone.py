"""Arcs among motions written all at once that the renderer writes all the same, each by itself.

While a stretch is written they count as straight: their words of axes say where the motions behind them begin. An arc
may be written so that it ends elsewhere, by some digits; what behind it relies on that, having no word for an axis, is
written by itself, too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Mask = NDArray[np.bool_]


def write_alone(
    arcs: Sequence[int], stop: int, start: FloatArray, named: Mask, write: Callable[[int], FloatArray]
) -> list[int]:
    """Write arcs of a stretch that ends before motion `stop`, in order, and what relies on where they end.

    start  (n, n_axes) the commands at which motions begin; put right
    named  (n, n_axes) axes for which a motion has a word
    write  writes a motion from its start on; returns the command at its end

    Returns the motions that were written.
    """
    rows: list[int] = []
    for arc in arcs:
        row, relies = arc, not rows or arc > rows[-1]
        while relies:
            end = write(row)
            rows.append(row)
            row += 1
            relies = row < stop and bool(((end != start[row]) & ~named[row]).any())
            if row < stop:
                start[row] = end
    return rows
