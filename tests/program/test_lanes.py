"""Two lanes, one grammar: blocks that the grammars generate mean the same by template as by Lark alone."""

from __future__ import annotations

import re
from functools import cache
from random import Random

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.lark import from_lark

from conftest import some
from ncfix.diagnostics import SourceError
from ncfix.text.dialect import Dialect, check_content, get
from ncfix.text.faults import BlockError
from ncfix.text.grammar import parser_of
from ncfix.text.reader import parse_block, read
from program.lanes import assert_read_right

unkept = cache(parser_of)
"""A parser that knows its grammar; one with kept tables has forgotten it."""

NUMBER = re.compile(r"\d+\.?\d*|\.\d+")
UNSUITABLE = re.compile(r"[\n\0]|\A[ \t\r]*%|m0*(2|30)(?!\d)", re.IGNORECASE)
"""What does not stay one block, or ends the program, so that what follows is not read."""

ALPHABET = st.characters(min_codepoint=1, max_codepoint=255, exclude_characters="\n")
NUMBERS = ["0", "7", "7.", ".7", "0.125", "12345", "1234567890123456789", "00.10", "3.0000"]
BLANKS = ["", "", "", "", " ", "  ", "\t", "    "]


def with_blanks(random: Random, text: str) -> str:
    """The text with blanks between any two characters."""
    return "".join(random.choice(BLANKS) + character for character in text)


def with_other_numbers(random: Random, text: str) -> str:
    """The text with every number in it replaced by another."""
    return NUMBER.sub(lambda _: random.choice(NUMBERS), text)


def is_legal(dialect: Dialect, text: str) -> bool:
    """Whether the grammar takes a text as one block, with others to follow."""
    if UNSUITABLE.search(text):
        return False
    try:
        parse_block(dialect, text.rstrip("\r"))
    except BlockError:
        return False
    return not dialect.line_limit or len(text) <= dialect.line_limit


@pytest.mark.parametrize("name", ["iso", "linuxcnc"])
@settings(max_examples=some(100), deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data(), seed=st.integers(0, 2**32))
def test_generated_blocks_mean_what_the_grammar_says(name: str, data: st.DataObject, seed: int) -> None:
    dialect, random = get(name), Random(seed)
    plain = data.draw(from_lark(unkept(dialect.grammar), start="block", alphabet=ALPHABET))
    texts = [plain, with_blanks(random, plain), with_blanks(random, plain)]
    texts += [with_other_numbers(random, text) for text in texts for _ in range(2)]
    legal = [text for text in texts if is_legal(dialect, text)]
    source = "\n".join([*legal, "g0x1"]).encode("latin-1")
    if is_program(source, dialect):
        assert_read_right(read(source, dialect=dialect))


def is_program(source: bytes, dialect: Dialect) -> bool:
    """Whether the bytes are not refused as a whole."""
    try:
        check_content(source, "", dialect)
    except SourceError:
        return False
    return True


LINES = (
    "N10 G1 X1.5 Y-2 (move) F100.",
    "/g2 x[1+2*#3] y-#<name> i.5 ; arc",
    "o100 while [#1 LT [2 - 3]]",
    "o<side> call [1] [#2] (call)",
    "#<depth> = [SIN[30] ** 2 / ATAN[1]/[2]]",
    "G10 L2 P1 X+1. Y 1 2 Z- 3",
    "#1=1 #2=-3 G0 X##1 M3 S1000",
    "%",
    "",
)


@pytest.mark.parametrize("name", ["iso", "linuxcnc"])
@settings(max_examples=some(300), deadline=None)
@given(line=st.sampled_from(LINES), data=st.data())
def test_a_damaged_block_is_read_by_the_grammar_or_refused_with_its_place(
    name: str, line: str, data: st.DataObject
) -> None:
    dialect = get(name)
    for _ in range(data.draw(st.integers(1, 3))):
        start = data.draw(st.integers(0, len(line)))
        stop = data.draw(st.integers(start, min(len(line), start + 2)))
        line = line[:start] + data.draw(st.text(ALPHABET, max_size=2)) + line[stop:]
    source = f"G1 X1.5 Y-2 (move) F100.\nN5 G1 X2\n{line}\n".encode("latin-1")
    assume(line.strip() and is_program(source, dialect))
    try:
        program = read(source, "part", dialect)
    except SourceError as error:
        place = error.messages[0].place
        assert place is not None
        assert place.line >= 3
        assert 1 <= place.column <= len(place.text) + 1
    else:
        assert_read_right(program)
