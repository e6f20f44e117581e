"""Reading: what a block consists of, and where."""

from __future__ import annotations

import pytest

from ncfix.program.reader import read
from ncfix.program.tree import Binary, Constant, Flow, Literal, Unary, Word
from ncfix.program.writer import apply


def test_words_have_addresses_values_and_places() -> None:
    program = read(b"N10 g1 X-12.5Y+.5 (side) F100.\n", dialect="linuxcnc")
    words = [item for item in program.items_of(0) if isinstance(item, Word)]
    assert [word.address for word in words] == ["N", "G", "X", "Y", "F"]
    assert [program.slice(0, word.value_span) for word in words] == ["10", "1", "-12.5", "+.5", "100."]
    assert program.values_of(0).tolist() == [10.0, -12.5, 0.5, 100.0]
    assert words[1].value == Constant(1.0)


def test_expressions_are_trees_over_the_numbers_of_the_block() -> None:
    program = read(b"X[1 + 2 * -sin[30]]\n", dialect="linuxcnc")
    (word,) = program.items_of(0)
    assert isinstance(word, Word)
    product = Binary("*", Literal(1), Unary("-", Unary("sin", Literal(2))))
    assert word.value == Binary("+", Literal(0), product)
    assert program.values_of(0).tolist() == [1.0, 2.0, 30.0]


def test_o_words_are_flow() -> None:
    program = read(b"o<Side> call [1] [#2]\nO0100 sub\n", dialect="linuxcnc")
    call, sub = program.items_of(0)[0], program.items_of(1)[0]
    assert isinstance(call, Flow)
    assert isinstance(sub, Flow)
    assert (call.label, call.keyword, len(call.arguments)) == ("side", "call", 2)
    assert (sub.label, sub.keyword) == ("100", "sub")


@pytest.mark.parametrize("source", [b"G0 X0.\r\nG1X1 ; \xe4\r\n", b"%\nM2", b" \n\n/N1 g 0 x 1 2 . 5\n"])
def test_a_program_without_edits_comes_out_as_it_went_in(source: bytes) -> None:
    assert apply(read(source).source, []) == source
