# cython: boundscheck=False
"""Applies edits to a text, and checks that a text differs from another one by its edits only."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Bytes = NDArray[np.uint8]
    Ints = NDArray[np.int64]

OTHER_LENGTH = "the text has another length than its room"


def spliced(source: Bytes, start: Ints, stop: Ints, length: Ints, data: Bytes, out: Bytes) -> int:
    """Write the text with its edits, columns as in `text.writer.Splices`, into `out`.

    Raises IndexError for edits that overlap or lie outside the text, and if `out` has not the length of the result.
    """
    if not start.shape[0] == stop.shape[0] == length.shape[0]:
        raise IndexError("not as many of everything as there are edits")
    at, done, taken = 0, 0, 0
    for edit in range(start.shape[0] + 1):
        last = edit == start.shape[0]
        begin = source.shape[0] if last else start[edit]
        end = source.shape[0] if last else stop[edit]
        more = 0 if last else length[edit]
        if not (done <= begin <= end <= source.shape[0] and 0 <= more <= data.shape[0] - taken):
            raise IndexError("edits overlap, or lie outside the text")
        if at + begin - done + more > out.shape[0]:
            raise IndexError(OTHER_LENGTH)
        for k in range(begin - done):
            out[at + k] = source[done + k]
        at += begin - done
        for k in range(more):
            out[at + k] = data[taken + k]
        at, taken, done = at + more, taken + more, end
    if at < out.shape[0]:
        raise IndexError(OTHER_LENGTH)
    return 0


def left_alone(old: Bytes, new: Bytes, start: Ints, stop: Ints, length: Ints) -> bool:
    """Whether the new text differs from the old one at most where the edits are, columns as in `text.writer.Splices`.

    Raises IndexError as `spliced` does.
    """
    if not start.shape[0] == stop.shape[0] == length.shape[0]:
        raise IndexError("not as many of everything as there are edits")
    at, to, different = 0, 0, 0
    for edit in range(start.shape[0] + 1):
        last = edit == start.shape[0]
        begin = old.shape[0] if last else start[edit]
        end = old.shape[0] if last else stop[edit]
        more = 0 if last else length[edit]
        if not (at <= begin <= end <= old.shape[0] and more >= 0):
            raise IndexError("edits overlap, or lie outside the text")
        if to + begin - at + more > new.shape[0]:
            return False
        for k in range(begin - at):
            different |= old[at + k] ^ new[to + k]
        at, to = end, to + begin - at + more
    return different == 0 and to == new.shape[0]
