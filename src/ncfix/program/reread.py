"""A second reading that looks only at what was written anew.

A text that was made from another one by edits is compared with it, byte for byte, between the edits. Where an edit
replaces a number by a number, and nothing else is done to a block, the block has the shape that it had, and only the
new number is read. All other blocks that were changed are read as any text is. What comes out is what a reader finds
in the whole text, to the last bit; a test holds the two together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ncfix import fast
from ncfix.program.numbers import (
    BLANK,
    BLANKS,
    EIGHT,
    EXACT_DIGITS,
    POINT,
    POWERS,
    SIGN,
    UNSIGNED_AFTER,
    digits_of,
    last_before,
)
from ncfix.program.parts import PartReader
from ncfix.program.tree import Program
from ncfix.program.writer import Splices, cover

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
    if not len(splices) or b"%" in text:
        return None
    moved = np.cumsum(splices.length - (splices.stop - splices.start))
    if len(text) != len(program.source) + moved[-1]:
        raise NotAsWrittenError
    looked = looked_at(program, splices, text, moved)
    owners = np.searchsorted(program.blocks[:, 0], splices.start[looked.odd], side="right") - 1
    odd = np.flatnonzero(np.bincount(owners, minlength=1)) if len(owners) else owners
    if FEW * len(odd) > len(program):
        return None
    before = np.searchsorted(splices.start, program.blocks, side="left")
    blocks = program.blocks + np.append(0, moved)[before]
    quick = replace(program, source=text, blocks=blocks, number_spans=looked.spans, numbers=looked.numbers)
    return quick if not len(odd) else _with_blocks(reader, quick, odd)


def looked_at(program: Program, splices: Splices, text: bytes, moved: IntArray) -> Looked:
    """Compare all between the edits, and read the new numbers."""
    if fast.engaged():
        return _compiled(program, splices, text)
    old, new = (np.frombuffer(each, dtype=np.uint8) for each in (program.source, text))
    stops = splices.stop + moved
    starts = stops - splices.length
    kept = old[~cover(len(old), splices.start, splices.stop)], new[~cover(len(new), starts, stops)]
    if not np.array_equal(*kept):
        raise NotAsWrittenError
    spans = program.number_spans
    which = np.minimum(np.searchsorted(spans[:, 0], splices.start), len(spans) - 1)
    values, fine = _read(old, new, splices, np.stack((starts, stops), axis=1))
    fine &= (spans[which, 0] == splices.start) & (spans[which, 1] == splices.stop)
    rows = which[fine]
    numbers, growth = program.numbers.copy(), np.zeros(len(spans), dtype=np.int64)
    numbers[rows] = values[fine]
    growth[rows] = (splices.length - (splices.stop - splices.start))[fine]
    shift = np.cumsum(growth)
    if not fine.all():
        shift += np.append(0, np.cumsum(np.diff(moved, prepend=0)[~fine]))[
            np.searchsorted(splices.start[~fine], spans[:, 0], side="right")
        ]
    return Looked(numbers, np.stack((spans[:, 0] + shift - growth, spans[:, 1] + shift), axis=1), ~fine)


def _read(
    old: NDArray[np.uint8], new: NDArray[np.uint8], splices: Splices, spans: IntArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """The values of new numbers at `spans` (k, 2), and which of them are clearly numbers like those before."""
    full = spans[:, 1] > spans[:, 0]
    first = np.minimum(spans[:, 0], len(new) - 1)
    signed = SIGN[new[first]] & full
    digits = spans + np.stack((signed, np.zeros_like(signed)), axis=1)
    found = digits_of(new, digits)
    length = digits[:, 1] - digits[:, 0]
    fine = found.pure & (found.points == 1) & (length > 1) & (length <= min(2 * EIGHT, EXACT_DIGITS + 1))
    fine &= _had_point(old, splices, found.decimals)
    rows = np.flatnonzero(signed)
    fine[rows] &= ~UNSIGNED_AFTER[last_before(new, spans[rows, 0]).characters]
    values = found.value / POWERS[found.decimals]
    values[rows[new[spans[rows, 0]] == ord("-")]] *= -1
    return values, fine


def _had_point(old: NDArray[np.uint8], splices: Splices, decimals: IntArray) -> NDArray[np.bool_]:
    """Which replaced numbers had a decimal point, mostly before as many `decimals` (k,) as they have now."""
    place = splices.stop - 1 - decimals
    found: NDArray[np.bool_] = (place >= splices.start) & (old[np.maximum(place, 0)] == POINT)
    rows = np.flatnonzero(~found)
    if len(rows):
        found[rows] = digits_of(old, np.stack((splices.start[rows], splices.stop[rows]), axis=1)).points > 0
    return found


def _compiled(program: Program, splices: Splices, text: bytes) -> Looked:
    """As `looked_at`."""
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
    parts: list[tuple[Program, int, int, int]] = []
    done = 0
    for k, block in enumerate(odd.tolist()):
        parts.append((quick, done, block, 0))
        parts.append((own, int(rows[k]), int(rows[k + 1]), int(edges[block] - begins[k])))
        done = block + 1
    parts.append((quick, done, len(quick), 0))
    counts = np.concatenate([np.diff(part.first_number[a : b + 1]) for part, a, b, _ in parts])
    numbers = [(part, slice(part.first_number[a], part.first_number[b]), at) for part, a, b, at in parts]
    return replace(
        quick,
        templates=own.templates,
        template=np.concatenate([part.template[a:b] for part, a, b, _ in parts]),
        blocks=np.concatenate([part.blocks[a:b] + at for part, a, b, at in parts]),
        first_number=np.concatenate(([0], np.cumsum(counts))),
        number_spans=np.concatenate([part.number_spans[rows] + at for part, rows, at in numbers]),
        numbers=np.concatenate([part.numbers[rows] for part, rows, _ in numbers]),
    )
