"""The words of a stretch of plain motions taken block by block, compiled: as `lane.words_of` and `lane.commands`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.kernel import Library

Ints = NDArray[np.int64]
Rows = NDArray[np.int32]
Floats = NDArray[np.float64]


LIBRARY = Library(__file__)


@LIBRARY.kernel("f8[:]", "i8[:]", "i4[:]", "i8[:,:]", "i8[:]", "f8[:]", ("f8[:]", "f8[:]"), "i8", ("f8[:,:]", "f8[:]"))
def followed(
    numbers: Floats,
    first: Ints,
    shapes: Rows,
    slots: Ints,
    feeds: Ints,
    position: Floats,
    frame: tuple[Floats, Floats],
    incremental: bool,
    found: tuple[Floats, Floats],
) -> None:
    """Where the k blocks of a stretch lead, and their F words.

    numbers, first, shapes  of the program; first and shapes (k,) of these blocks
    slots, feeds            (s, letters), (s,) which number of a block of each shape is an axis word, or F; -1 for none
    position                (letters,) the command before the first block
    frame                   offset and scale (letters,)
    found                   room for commands (k + 1, letters), the first of them `position`, and for F words (k,), NaN
                            where there is none
    """
    (offset, scale), (path, feed) = frame, found
    letters = len(position)
    for letter in range(letters):
        path[0, letter] = position[letter]
    for row in range(len(first)):
        shape = shapes[row]
        for letter in range(letters):
            slot = slots[shape, letter]
            if slot < 0:
                path[row + 1, letter] = path[row, letter]
            else:
                step = scale[letter] * numbers[first[row] + slot]
                path[row + 1, letter] = (path[row, letter] if incremental else offset[letter]) + step
        feed[row] = numbers[first[row] + feeds[shape]] if feeds[shape] >= 0 else np.nan
