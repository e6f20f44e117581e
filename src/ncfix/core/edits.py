# cython: boundscheck=False
"""Collects the edits of a text, applies them, and checks that a text differs from another one by its edits only."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Bytes = NDArray[np.uint8]
    Ints = NDArray[np.int64]

OTHER_LENGTH = "the text has another length than its room"


class EditBuffer:
    """Room for the edits of a text, columns as in `text.writer.Splices`.

    start, stop, length  (n,) the bytes that each edit replaces, and the number of bytes it puts there
    data    these bytes
    count   number of edits so far
    size    number of bytes so far

    Raises IndexError if the columns have different lengths.
    """

    def __init__(self, start: Ints, stop: Ints, length: Ints, data: Bytes) -> None:
        if not start.shape[0] == stop.shape[0] == length.shape[0]:
            raise IndexError("not as many of everything as there are edits")
        self.start, self.stop, self.length, self.data = start, stop, length, data
        self.count = self.size = 0

    def has_room(self, edits: int, size: int) -> bool:
        """Whether so many edits, with so many bytes together, may be added."""
        return self.count + edits <= self.start.shape[0] and self.size + size <= self.data.shape[0]

    def put(self, character: int) -> None:
        """Append a byte to `data`; there must be room."""
        self.data[self.size] = character
        self.size += 1

    def note(self, begin: int, end: int, size: int) -> None:
        """Append an edit: the bytes from `begin` to `end` become the last `size` bytes of `data`; with room only."""
        self.start[self.count], self.stop[self.count], self.length[self.count] = begin, end, size
        self.count += 1

    def back_to(self, count: int, size: int) -> None:
        """Forget all edits behind the first `count` ones, which have `size` bytes."""
        self.count, self.size = count, size


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
