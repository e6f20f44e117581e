"""Lines of further pieces in languages where they are more than axis words: the block number, `L`, FMAX."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.text.tree import Program
from ncfix.text.writer import Splices
from ncfix.writer.bulk_layouts import Layouts

IntArray = NDArray[np.int64]


def lines_of(
    program: Program, layouts: Layouts, blocks: IntArray, end_of_line: bytes
) -> tuple[list[bytes], list[bytes]]:
    """What stands before and behind the axis words of the lines of further pieces of `blocks` (k,)."""
    shapes, begins = program.template[blocks].tolist(), program.blocks[blocks, 0].tolist()
    stops = layouts.lead_ends(program, blocks).tolist()
    openings, closings = (
        [row.tobytes().rstrip(b"\0") for row in table] for table in (layouts.openings, layouts.closings)
    )
    before = [
        end_of_line + program.source[begin:stop] + openings[shape]
        for begin, stop, shape in zip(begins, stops, shapes, strict=True)
    ]
    return before, [closings[shape] for shape in shapes]


def with_lines(words: Splices, before: list[bytes], behind: list[bytes], places: tuple[IntArray, IntArray]) -> Splices:
    """Words, of which some are the first and the last of a line, with what stands before and behind them there."""
    first, last = places
    length, ends = words.length.copy(), np.cumsum(words.length)
    pieces: list[bytes] = []
    done = 0
    for begin, stop, head, tail in zip(
        (ends - words.length)[first].tolist(), ends[last].tolist(), before, behind, strict=True
    ):
        pieces += (words.data[done:begin], head, words.data[begin:stop], tail)
        done = stop
    np.add.at(length, first, [len(each) for each in before])
    np.add.at(length, last, [len(each) for each in behind])
    return Splices(words.start, words.stop, length, b"".join([*pieces, words.data[done:]]))
