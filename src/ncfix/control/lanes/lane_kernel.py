"""What a stretch of plain motions says, taken block by block, compiled: as `stage.followed`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.kernel import Library

Ints = NDArray[np.int64]
Rows = NDArray[np.int32]
Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


LIBRARY = Library(__name__)


@LIBRARY.kernel(
    ("f8[:]", "i8[:]", "i4[:]"),
    ("i8[:,:]", "i8[:]", "i8[:]", "i8[:]"),
    ("f8[:]", "f8", "f8", "f8"),
    ("f8[:]", "f8[:]", "i8"),
    ("f8[:,:]", "f8[:]", "b1[:]", "f8[:]", "b1[:]", "i8[:]"),
)
def followed(
    blocks: tuple[Floats, Ints, Rows],
    tables: tuple[Ints, Ints, Ints, Ints],
    before: tuple[Floats, float, float, float],
    frame: tuple[Floats, Floats, int],
    stage: tuple[Floats, Floats, Mask, Floats, Mask, Ints],
) -> None:
    """What the k blocks of a stretch say, and where they lead.

    blocks  numbers of the program; the first number and the shape of each block (k,)
    tables  axes, feed, motion, mask of `LaneTables`
    before  the command before the first block (letters,), what the number of F counts, feed and motion code in force
    frame   offset and scale (letters,), and whether words are increments
    stage   room for path, feed, fed, motion, coded, mask of `BlockRows`
    """
    (numbers, first, shapes), (slots, feeds, motions, masks) = blocks, tables
    (position, unit, feed, motion), (offset, scale, incremental) = before, frame
    path, feed_of, fed, motion_of, coded, mask = stage
    letters = len(position)
    for letter in range(letters):
        path[0, letter] = position[letter]
    for row in range(len(first)):
        shape, number = shapes[row], first[row]
        for letter in range(letters):
            slot = slots[shape, letter]
            if slot < 0:
                path[row + 1, letter] = path[row, letter]
            else:
                step = scale[letter] * numbers[number + slot]
                path[row + 1, letter] = (path[row, letter] if incremental else offset[letter]) + step
        fed[row], coded[row], mask[row] = feeds[shape] >= 0, motions[shape] >= 0, masks[shape]
        if fed[row]:
            feed = unit * numbers[number + feeds[shape]]
        if coded[row]:
            motion = float(motions[shape])
        feed_of[row], motion_of[row] = feed, motion
