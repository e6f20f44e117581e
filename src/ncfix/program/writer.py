"""From edits back to bytes: what no edit covers goes out as it came in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Edit:
    """Replace the source's bytes from `start` up to `stop` by `text`; with start == stop, insert it there."""

    start: int
    stop: int
    text: bytes


def apply(source: bytes, edits: Sequence[Edit]) -> bytes:
    """The source with the edits made; they are sorted and do not overlap (insertions at one place keep their order).

    Raises ValueError if an edit reaches outside the source or into the one before it: a fault of the caller.
    """
    pieces: list[bytes] = []
    done = 0
    for edit in edits:
        if not done <= edit.start <= edit.stop <= len(source):
            raise ValueError(f"edit {edit} overlaps an earlier one, or lies outside the {len(source)} bytes")
        pieces += (source[done : edit.start], edit.text)
        done = edit.stop
    pieces.append(source[done:])
    return b"".join(pieces)
