"""What holds for every program that can be read: the one assertion that the tests of the reader share."""

from __future__ import annotations

import numpy as np

from ncfix.text.reach import UNREAD
from ncfix.text.reader import AFTER_TAPE, parse_block
from ncfix.text.tree import Opaque, Program
from ncfix.text.writer import apply


def assert_read_right(program: Program) -> None:
    """The program is lossless, and every block means what the grammar alone says that it means."""
    assert apply(program.source, []) == program.source
    assert len(program.first_number) == len(program) + 1
    assert program.first_number[-1] == len(program.numbers) == len(program.number_spans)
    outside = bytearray(program.source)
    for block in program:
        start, stop = program.blocks[block]
        outside[start:stop] = b"" if stop == len(outside) else b" " * (stop - start)
        assert_every_byte_is_accounted_for(program, block)
        if not is_passed_whole(program, block):
            assert_same_as_the_grammar(program, block)
    assert not bytes(outside).removeprefix(b"\xef\xbb\xbf").strip()


def is_passed_whole(program: Program, block: int) -> bool:
    """Whether a block was not read, because the control never gets to it."""
    items = program.items_of(block)
    return items == AFTER_TAPE.template.items or any(isinstance(item, Opaque) and item.kind == UNREAD for item in items)


def assert_same_as_the_grammar(program: Program, block: int) -> None:
    """The template and the numbers of a block are those that Lark finds in its text."""
    parsed = parse_block(program.dialect, program.text_of(block))
    numbers = slice(*program.first_number[block : block + 2])
    assert program.templates[int(program.template[block])] == parsed.template
    spans = program.number_spans[numbers] - program.blocks[block, 0]
    assert spans.tolist() == [list(span) for span in parsed.spans]
    assert program.values_of(block).tolist() == list(parsed.values)
    assert np.isfinite(program.values_of(block)).all()


def assert_every_byte_is_accounted_for(program: Program, block: int) -> None:
    """The items stand in order, do not overlap, and leave nothing but blanks, and what joins lines, between them."""
    text = program.source[slice(*program.blocks[block])]
    done = 0
    for item in program.items_of(block):
        start, stop = (place - int(program.blocks[block, 0]) for place in program.span(block, item.span))
        assert done <= start < stop <= len(text) or (isinstance(item, Opaque) and start == stop == done)
        assert not text[done:start].strip(b" \t\r\n~")
        done = stop
    assert not text[done:].strip(b" \t\r\n~")
