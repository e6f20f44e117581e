"""Searches that go step by step, compiled: one motion after the other instead of all at once.

They do what their plain forms do, operation by operation, so that the results are the same; a test holds them together.
"""

# numba finds out the types.
# mypy: disable-error-code="untyped-decorator"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
Mask = NDArray[np.bool_]


@njit(cache=True, nogil=True, error_model="numpy")
def deviation(fraction: Array, command: Array, follow: Array, a: int, b: int) -> float:
    """The largest deviation of the straight piece from node a to node b: as `Grid.deviations`."""
    most = 0.0
    for node in range(a + 1, b):
        share = (fraction[node] - fraction[a]) / (fraction[b] - fraction[a])
        square = 0.0
        for i in range(follow.shape[1]):
            off = 0.0
            for j in range(command.shape[1]):
                here = command[a, j] + share * (command[b, j] - command[a, j])
                off += follow[node, i, j] * (here - command[node, j])
            square += off * off
        most = max(most, np.sqrt(square))
    return most


@njit(cache=True, nogil=True, error_model="numpy")
def fewest(counts: Ints, fraction: Array, command: Array, follow: Array, tolerance: float) -> tuple[Mask, Array]:
    """Which nodes end a piece, and the largest deviation of each motion's pieces: as `split.fewest`."""
    ends, worst = np.zeros(len(fraction), np.bool_), np.zeros(len(counts))
    first = 0
    for motion in range(len(counts)):
        at, stop, usual = first, first + counts[motion] - 1, 1
        while at < stop:
            near, far, step, reached = at + 1, stop + 1, usual, 0.0
            fresh = True
            while near < stop:
                if far > stop:
                    trial = min(near + step, stop)
                elif near > at + 1:
                    trial = (near + far) // 2
                else:
                    trial = max(far - step, (near + far) // 2)
                if trial <= near:
                    break
                off = deviation(fraction, command, follow, at, trial)
                if off <= tolerance:
                    near, reached = trial, off
                else:
                    far = trial
                step = 1 if fresh else 2 * step
                fresh = False
            ends[near] = True
            worst[motion] = max(worst[motion], reached)
            usual, at = max(near - at - 1, 1), near
        first += counts[motion]
    return ends, worst
