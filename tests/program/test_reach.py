"""Lines that cannot be read where a control never gets to are kept, and named when somebody gets there after all."""

from __future__ import annotations

import pytest

from ncfix.diagnostics import SourceError
from ncfix.text.reach import UNREAD
from ncfix.text.reader import read
from ncfix.text.tree import Opaque, Program
from program.lanes import assert_read_right


def unread(program: Program) -> list[int]:
    """The blocks that were not read."""
    assert_read_right(program)
    opaque = ((block, item) for block in program for item in program.items_of(block) if isinstance(item, Opaque))
    return [block for block, item in opaque if item.kind == UNREAD]


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        (b"G0 X1\nM2\nThis is prose, 12 & 13.\nG0 X2\n", [2]),
        (b"o<a> sub\nG0 X[1\no<a> endsub\nM2\n", [1]),
        (b"o<a> sub\no<a> endsub\nM30\n\nThese are the words:\n  1 = 2, \n(a (b))\n", [4, 5, 6]),
        (b"o1 do\nG0 X1\no1 while [#1 LT 2]\nM2\nprose here\n", [4]),
        (b"G0 X1\nM2\n(" + b"-" * 300 + b")\n", [2]),
    ],
)
def test_lines_out_of_reach_are_passed_through(source: bytes, expected: list[int]) -> None:
    assert unread(read(source, dialect="linuxcnc")) == expected


@pytest.mark.parametrize(
    ("source", "line"),
    [
        (b"G0 X1\nprose here\nM2\n", 2),
        (b"o1 if [#1 GT 2]\nM2\no1 endif\nprose here\nM2\n", 4),
        (b"o1 sub\nM2\no1 endsub\nprose here\nM2\n", 4),
        (b"o1 while [1]\nM30\no1 endwhile\nprose here\n", 4),
        (b"o1 repeat [2]\nprose here\no1 endrepeat\nM2\n", 2),
        (b"M[2]\nprose here\n", 2),
    ],
)
def test_lines_within_reach_are_errors(source: bytes, line: int) -> None:
    with pytest.raises(SourceError) as caught:
        read(source, dialect="linuxcnc")
    place = caught.value.messages[0].place
    assert place is not None
    assert place.line == line


def test_what_was_passed_through_once_is_an_error_elsewhere() -> None:
    read(b"M2\nsome prose\n", dialect="linuxcnc")
    with pytest.raises(SourceError):
        read(b"some prose\nM2\n", dialect="linuxcnc")
