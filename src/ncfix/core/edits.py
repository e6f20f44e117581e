# cython: boundscheck=False
"""Edits put into a text, and a text compared with what edits were to make of it; every span is checked first."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Bytes = NDArray[np.uint8]
    Ints = NDArray[np.int64]


def spliced(source: Bytes, start: Ints, stop: Ints, length: Ints, data: Bytes, out: Bytes) -> int:
    """Put a text into `out` with edits made that are as in `writer.Splices`; returns where the next byte would go.

    Raises IndexError for edits that overlap or lie outside.
    """
    at, done, taken = 0, 0, 0
    for edit in range(start.shape[0] + 1):
        last = edit == start.shape[0]
        begin = source.shape[0] if last else start[edit]
        end = source.shape[0] if last else stop[edit]
        more = 0 if last else length[edit]
        if not (done <= begin <= end <= source.shape[0] and 0 <= more <= data.shape[0] - taken):
            raise IndexError("edits overlap, or lie outside the text")
        if at + begin - done + more > out.shape[0]:
            raise IndexError("there is no room for the text")
        for k in range(begin - done):
            out[at + k] = source[done + k]
        at += begin - done
        for k in range(more):
            out[at + k] = data[taken + k]
        at, taken, done = at + more, taken + more, end
    return at


def left_alone(old: Bytes, new: Bytes, start: Ints, stop: Ints, length: Ints) -> bool:
    """Whether all between some edits, as in `Splices`, is the same in the text that they make of the old one."""
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
