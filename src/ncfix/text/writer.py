"""Applies edits to a source text; bytes that no edit covers are written unchanged."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ncfix import core
from ncfix.arrays import Ints
from ncfix.values import frozen


@frozen
class Edit:
    """Replacement of the source's bytes from `start` up to `stop` by `text`; with start == stop, an insertion."""

    start: int
    stop: int
    text: bytes


def apply(source: bytes, edits: Sequence[Edit]) -> bytes:
    """The source with the edits made; they must be sorted and disjoint (insertions at one place keep their order).

    Raises ValueError if an edit reaches outside the source or into the one before it: an error of the caller.
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


def line_end(source: bytes) -> bytes:
    """The first line end of a text; a carriage return alone only if the text has no line feed."""
    at = source.find(b"\n")
    if at < 0 and b"\r" in source.rstrip(b"\r"):
        return b"\r"
    return b"\r\n" if at > 0 and source[at - 1 : at] == b"\r" else b"\n"


@frozen
class Splices:
    """Many edits, as columns.

    start, stop  (n,) range that is replaced
    length       (n,) number of bytes of each replacement
    data         the bytes of all replacements in sequence
    """

    start: Ints
    stop: Ints
    length: Ints
    data: bytes

    def __len__(self) -> int:
        return len(self.start)

    @classmethod
    def of(cls, edits: Sequence[Edit]) -> Splices:
        """From single edits."""
        places = np.array([(edit.start, edit.stop, len(edit.text)) for edit in edits], dtype=np.int64).reshape(-1, 3)
        return cls(places[:, 0], places[:, 1], places[:, 2], b"".join(edit.text for edit in edits))

    @classmethod
    def joined(cls, parts: Sequence[Splices]) -> Splices:
        """Several sets of edits as one, sorted by place; at the same place in the order given."""
        parts = [part for part in parts if len(part)] or [cls.of(())]
        if len(parts) == 1:
            start, stop, length, data = parts[0].start, parts[0].stop, parts[0].length, parts[0].data
        else:
            columns = ([getattr(part, name) for part in parts] for name in ("start", "stop", "length"))
            start, stop, length = map(np.concatenate, columns)
            data = b"".join(part.data for part in parts)
        if not (stop[:-1] > start[1:]).any():
            return cls(start, stop, length, data)
        order = np.argsort(2 * start + (stop > start), kind="stable")
        ends = np.cumsum(length)
        breaks = np.flatnonzero(np.diff(order) != 1)  # what lies between two breaks stands together already
        heads, tails = np.append(0, breaks + 1), np.append(breaks, len(order) - 1)
        edges = zip((ends - length)[order[heads]].tolist(), ends[order[tails]].tolist(), strict=True)
        return cls(start[order], stop[order], length[order], b"".join(data[slice(*each)] for each in edges))

    def moved(self, way: int) -> Splices:
        """These edits moved by `way` bytes."""
        return replace(self, start=self.start + way, stop=self.stop + way)

    def outside(self, spans: Ints) -> Splices:
        """The edits that are not within any of the disjoint spans (k, 2) of the source, which may be in any order."""
        starts, stops = np.sort(spans, axis=0).T
        at = np.searchsorted(starts, self.start, side="right") - 1
        outside = (at < 0) | (self.start > stops[at])
        data = np.frombuffer(self.data, dtype=np.uint8)[np.repeat(outside, self.length)]
        return Splices(self.start[outside], self.stop[outside], self.length[outside], data.tobytes())

    def edits(self) -> Iterator[Edit]:
        """The edits one by one."""
        at = 0
        for start, stop, length in zip(self.start.tolist(), self.stop.tolist(), self.length.tolist(), strict=True):
            yield Edit(start, stop, self.data[at : at + length])
            at += length


def spliced(source: bytes, splices: Splices) -> bytes:
    """The source with many edits made, like `apply`; raises ValueError likewise."""
    if not len(splices):
        return source
    start, stop = splices.start, splices.stop
    if start[0] < 0 or stop[-1] > len(source) or (start > stop).any() or (stop[:-1] > start[1:]).any():
        raise ValueError(f"edits overlap, or lie outside the {len(source)} bytes")
    if core.engaged():
        from ncfix.core import edits

        text, data = (np.frombuffer(each, dtype=np.uint8) for each in (source, splices.data))
        out = np.empty(len(text) + len(data) - int((stop - start).sum()), dtype=np.uint8)
        begins, ends, lengths = (np.ascontiguousarray(each) for each in (start, stop, splices.length))
        edits.spliced(text, begins, ends, lengths, data, out)
        return out.tobytes()
    return apply(source, tuple(splices.edits()))


def overlong(source: bytes, blocks: Ints, splices: Splices, limit: int) -> dict[int, int]:
    """Blocks (n, 2) in which edits make a line longer than `limit` characters -> its length; limit 0: none."""
    if not limit or not len(splices):
        return {}
    grown = np.zeros(len(splices) + 1, dtype=np.int64)
    np.cumsum(np.maximum(splices.length - (splices.stop - splices.start), 0), out=grown[1:])
    first = np.searchsorted(splices.start, np.append(blocks[:, 0], len(source) + 1))
    more = np.diff(grown.take(first))
    suspects = np.flatnonzero((more > 0) & (blocks[:, 1] - blocks[:, 0] + more > limit)).tolist()
    ends, found = np.cumsum(splices.length) if suspects else grown, {}
    for block in suspects:
        start, stop = blocks[block].tolist()
        own = slice(first[block], first[block + 1])
        begin, end = int(ends[own][0] - splices.length[own][0]), int(ends[own][-1])
        edits = Splices(
            splices.start[own] - start, splices.stop[own] - start, splices.length[own], splices.data[begin:end]
        )
        longest = max(map(len, apply(source[start:stop], tuple(edits.edits())).splitlines()))
        if longest > limit:
            found[block] = longest
    return found


def left_alone(source: bytes, splices: Splices, text: bytes) -> bool:
    """Whether `text`, made from the source by edits, is unchanged between them; compiled only."""
    from ncfix.core import edits

    columns = (np.ascontiguousarray(each) for each in (splices.start, splices.stop, splices.length))
    old, new = (np.frombuffer(each, dtype=np.uint8) for each in (source, text))
    return bool(edits.left_alone(old, new, *columns))
