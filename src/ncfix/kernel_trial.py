"""A kernel with every kind of argument there is, to try whether this numba passes them as `kernel` says."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ncfix.kernel import Library
from ncfix.kernel_build import compiled

LIBRARY = Library(__name__)


class TrialPair(NamedTuple):
    """A tuple with names."""

    low: NDArray[np.float64]
    high: NDArray[np.uint8]


Given = tuple[int, TrialPair]


@LIBRARY.helper
def scaled(value: float, factor: float) -> float:
    """A part of the loop."""
    return value * factor


@LIBRARY.kernel("f8[:,:]", ("i8", (TrialPair, "f8[:]", "u1[:]")), "f8", "b1[:]", "i4[:]", "i8[:]", "f8[:,:,:]")
def weighed(
    values: NDArray[np.float64],
    given: Given,
    factor: float,
    chosen: NDArray[np.bool_],
    small: NDArray[np.int32],
    counts: NDArray[np.int64],
    result: NDArray[np.float64],
) -> int:
    """Mix all arguments into `result` (2, n, m), so that none can be taken for another; count what was chosen."""
    columns, pair = given
    count = 0
    for i in range(values.shape[0]):
        for j in range(columns):
            result[0, i, j] = scaled(values[i, j] - pair.low[j], factor) / pair.high[j]
            result[1, i, j] = small[i] - counts[j]
        count += 1 if chosen[i] else 0
    return count


def passes() -> bool:
    """Whether machine code and Python do the same with the same arguments.

    Numba does not promise that; a wrong guess may end the process.
    """
    LIBRARY.link(compiled(LIBRARY))
    values = np.arange(6.0).reshape(3, 2) / 7
    pair = TrialPair(np.array([0.25, -3.0]), np.array([3, 200], dtype=np.uint8))
    chosen, small = np.array([True, False, True]), np.array([-5, 0, 9], dtype=np.int32)
    plain, fast = np.zeros((2, 3, 2)), np.zeros((2, 3, 2))
    common = (values, (2, pair), -1.5, chosen, small, np.array([1 << 40, -2]))
    counts = weighed.loop(*common, plain), weighed(*common, fast)
    return counts == (2, 2) and bool((plain == fast).all())
