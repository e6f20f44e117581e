"""A second reading that looks only at what was written anew.

A text that was made from another one by edits is compared with it, byte for byte, between the edits. Where an edit
replaces a number by a number, and nothing else is done to a block, the block has the shape that it had, and only the
new number is read. All other blocks that were changed are read as any text is. What comes out is what a reader finds
in the whole text, to the last bit; a test holds the two together.

Only compiled: by columns, it takes longer to look for what is new than to read everything.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ncfix import fast
from ncfix.program.numbers import BLANK, BLANKS, EXACT_DIGITS, POWERS, SIGN, UNSIGNED_AFTER
from ncfix.program.parts import PartReader
from ncfix.program.tree import Program
from ncfix.program.writer import Splices

IntArray = NDArray[np.int64]
FloatArray = NDArray[np.float64]

FEW = 16
"""If more than one block in so many is to be read anew, all of them are."""


class NotAsWrittenError(Exception):
    """The text is not what the edits make of the other one."""


@dataclass(frozen=True, slots=True)
class Looked:
    """What was found in the numbers of a text.

    numbers  (m,) their values, the new ones as they are read
    spans    (m, 2) where they stand now
    odd      (k,) edits that are more than one number for another
    """

    numbers: FloatArray
    spans: IntArray
    odd: NDArray[np.bool_]


def reread(reader: PartReader, program: Program, splices: Splices, text: bytes) -> Program | None:
    """`text`, which is that of `program` with edits made, as `reader` would read it; None if it had better do so.

    Raises `NotAsWrittenError` if the text differs elsewhere, and what `reader` does.
    """
    if not fast.engaged() or not len(splices):
        return None
    put_in = np.count_nonzero(splices.start == splices.stop)
    if FEW * put_in > len(program) or b"%" in text:
        return None
    moved = np.cumsum(splices.length - (splices.stop - splices.start))
    if len(text) != len(program.source) + moved[-1]:
        raise NotAsWrittenError
    looked = looked_at(program, splices, text)
    owners = np.searchsorted(program.blocks[:, 0], splices.start[looked.odd], side="right") - 1
    odd = np.flatnonzero(np.bincount(owners, minlength=1)) if len(owners) else owners
    if FEW * len(odd) > len(program):
        return None
    before = np.searchsorted(splices.start, program.blocks, side="left")
    blocks = program.blocks + np.append(0, moved)[before]
    quick = replace(program, source=text, blocks=blocks, number_spans=looked.spans, numbers=looked.numbers)
    return quick if not len(odd) else _with_blocks(reader, quick, odd)


def looked_at(program: Program, splices: Splices, text: bytes) -> Looked:
    """Compare all between the edits, and read the new numbers."""
    from ncfix.program import rereading_kernels

    old, new = (np.frombuffer(each, dtype=np.uint8) for each in (program.source, text))
    numbers, odd = program.numbers.copy(), np.zeros(len(splices), dtype=np.bool_)
    spans = np.empty_like(program.number_spans)
    same = rereading_kernels.looked_at(
        old,
        new,
        np.ascontiguousarray(program.number_spans),
        tuple(np.ascontiguousarray(each) for each in (splices.start, splices.stop, splices.length)),
        (SIGN, UNSIGNED_AFTER, BLANK),
        (BLANKS, EXACT_DIGITS),
        POWERS,
        (numbers, spans, odd),
    )
    if not same:
        raise NotAsWrittenError
    return Looked(numbers, spans, odd)


def _with_blocks(reader: PartReader, quick: Program, odd: IntArray) -> Program:
    """The text with the blocks `odd` (k,) and what was put in behind them as `reader` reads them."""
    edges = np.append(quick.blocks[:, 0], len(quick.source))
    own = reader.read(b"".join(quick.source[edges[block] : edges[block + 1]] for block in odd.tolist()))
    begins = np.cumsum(np.append(0, edges[odd + 1] - edges[odd]))
    rows = np.searchsorted(own.blocks[:, 0], begins)
    rows[-1] = len(own)
    numbers, way = own.first_number[rows], edges[odd] - begins[:-1]
    blocks = own.blocks + np.repeat(way, np.diff(rows))[:, None]
    spans = own.number_spans + np.repeat(way, np.diff(numbers))[:, None]
    of_blocks, of_numbers = (odd, odd + 1), (quick.first_number[odd], quick.first_number[odd + 1])
    counts = _put_in(np.diff(quick.first_number), of_blocks, np.diff(own.first_number), rows)
    return replace(
        quick,
        templates=own.templates,
        template=_put_in(quick.template, of_blocks, own.template, rows),
        blocks=_put_in(quick.blocks, of_blocks, blocks, rows),
        first_number=np.concatenate(([0], np.cumsum(counts))),
        number_spans=_put_in(quick.number_spans, of_numbers, spans, numbers),
        numbers=_put_in(quick.numbers, of_numbers, own.numbers, numbers),
    )


def _put_in(old: NDArray[Any], gaps: tuple[IntArray, IntArray], new: NDArray[Any], edges: IntArray) -> NDArray[Any]:
    """A column with its rows from each start to its stop (k,) replaced by those of another between two of its edges."""
    parts: list[NDArray[Any]] = []
    done = 0
    starts, stops = (each.tolist() for each in gaps)
    for start, stop, (first, last) in zip(starts, stops, pairwise(edges.tolist()), strict=True):
        parts += (old[done:start], new[first:last])
        done = stop
    return np.concatenate([*parts, old[done:]])
