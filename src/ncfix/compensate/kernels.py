"""Searches that go step by step, compiled: one motion after the other instead of all at once.

They do what their plain forms do, operation by operation, so that the results are the same; a test holds them together.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.compensate.plan.splitting import STRETCH
from ncfix.kernel import Library

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
Mask = NDArray[np.bool_]

LIBRARY = Library(__name__)


@LIBRARY.helper
def deviation(fraction: Array, command: Array, follow: Array, a: int, b: int) -> float:
    """The largest deviation of the straight piece from node a to node b: as `Grid.deviations`."""
    most = 0.0
    for node in range(a + 1, b):
        seen = node if len(follow) > 1 else 0
        share = (fraction[node] - fraction[a]) / (fraction[b] - fraction[a])
        square = 0.0
        for i in range(follow.shape[1]):
            off = 0.0
            for j in range(command.shape[1]):
                here = command[a, j] + share * (command[b, j] - command[a, j])
                off += follow[seen, i, j] * (here - command[node, j])
            square += off * off
        most = max(most, np.sqrt(square))
    return most


@LIBRARY.kernel("i8[:]", "f8[:]", "f8[:,:]", "f8[:,:,:]", "f8", "b1[:]", "f8[:]")
def fewest(
    counts: Ints, fraction: Array, command: Array, follow: Array, tolerance: float, ends: Mask, worst: Array
) -> None:
    """Mark in `ends`, all False, which nodes end a piece; put down the largest deviation of each motion's pieces.

    As `split.fewest`.
    """
    first = 0
    for motion in range(len(counts)):
        at, last, usual = first, first + counts[motion] - 1, 1
        stop = at
        while at < last:
            if at == stop:
                stop, usual = at + STRETCH if last - at >= 2 * STRETCH else last, 1
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
