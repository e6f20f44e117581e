"""The words of a stretch of plain motions taken block by block, compiled: as `lane.words_of` and `lane.commands`."""

# numba finds out the types.
# mypy: disable-error-code="untyped-decorator"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Rows = NDArray[np.int32]
Floats = NDArray[np.float64]


@njit(cache=True, nogil=True)
def followed(
    numbers: Floats,
    first: Ints,
    shapes: Rows,
    slots: Ints,
    feeds: Ints,
    position: Floats,
    frame: tuple[Floats, Floats],
    incremental: bool,
) -> tuple[Floats, Floats]:
    """Where the blocks of a stretch lead, and their F words.

    numbers, first, shapes  of the program; first and shapes (k,) of these blocks
    slots, feeds            (s, letters), (s,) which number of a block of each shape is an axis word, or F; -1 for none
    position                (letters,) the command before the first block
    frame                   offset and scale (letters,)

    Returns commands (k + 1, letters), the first of them `position`, and F words (k,), NaN where there is none.
    """
    offset, scale = frame
    count, letters = len(first), len(position)
    path, feed = np.empty((count + 1, letters)), np.empty(count)
    for letter in range(letters):
        path[0, letter] = position[letter]
    for row in range(count):
        shape = shapes[row]
        for letter in range(letters):
            slot = slots[shape, letter]
            if slot < 0:
                path[row + 1, letter] = path[row, letter]
            else:
                step = scale[letter] * numbers[first[row] + slot]
                path[row + 1, letter] = (path[row, letter] if incremental else offset[letter]) + step
        feed[row] = numbers[first[row] + feeds[shape]] if feeds[shape] >= 0 else np.nan
    return path, feed
