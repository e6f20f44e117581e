"""Blocks of SINUMERIK: what they are made of, and that every byte stays where it was."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from ncfix.diagnostics import SourceError
from ncfix.text.dialect import detect
from ncfix.text.reader import read
from ncfix.text.tree import Assignment, Command, FunctionCall, Literal, NamedParameter, Opaque, OWordLine, Program, Word
from program.lanes import assert_read_right

BLOCKS = """%_N_PART_MPF
;$PATH=/_N_WKS_DIR/_N_PART_WPD
N10 DEF REAL _X_HOME, _Y_HOME = -3.5, LIST[4]
N20 PROC PART(INT NUMBER, VAR REAL DEPTH) SAVE DISPLOF ; head
N30G0G90X53.839Y129.142C1=DC(0.5)F=R1*2
/3 N40 MARK: G1 X=AC(10) Y = IC( -2.5 ) Z.5 F100 ; a comment with X1
G2 X10 Y20 CR=-7.5 TURN=2
CIP X1 Y2 Z3 I1=4 J1=5 K1=6
R1=-5.5 R[2+1]=R1 _X_HOME=1.5EX-3 $TC_DP3[2,1]=100
IF (R1==2) AND (_X_HOME<>'HFF') GOTOF N100
WHILE NOT _X_HOME>R1
FOR I1A = 1 TO 10
CASE (R1) OF 1 GOTOF AB 2 GOTOF CD DEFAULT GOTOF EF
REPEAT AB CD P=3
TRANS X10 Y=R1
CYCLE83(50,0,2,-20,,,,5)
MSG("text ; with X1 "<<R1)
WHEN $A_IN[1]==1 DO $A_OUT[1]=1
T="DRILL 8.5" M6
HEAD_CLEAN
CGTECH_MACRO "of another" 17
X=-5 Y=R1-5
M30
"""


def items(text: str) -> tuple[object, ...]:
    """The items of one block."""
    return read(text.encode(), "part.mpf", "siemens").items_of(0)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_every_byte_stays_and_templates_mean_what_the_grammar_says(end: str) -> None:
    program = read(BLOCKS.replace("\n", end).encode(), "part.mpf", "siemens")
    assert_read_right(program)


def test_packed_words_are_words() -> None:
    words = [item for item in items("N440G01X498.375Y82.325C1=DC(0)") if isinstance(item, Word)]
    assert [word.address for word in words] == ["N", "G", "X", "Y", "C1"]
    assert isinstance(words[-1].value, FunctionCall)
    assert words[-1].value.name == "dc"


def test_a_name_needs_two_letters() -> None:
    assert [type(item) for item in items("G0SUPA Z=AA1")] == [Word, Command, Word]
    (variable,) = (item for item in items("XA1=5") if isinstance(item, Assignment))
    assert variable.target == NamedParameter("xa1")


def test_a_plain_number_after_an_equals_sign_is_one() -> None:
    (word,) = items("X=-12.5")
    assert isinstance(word, Word)
    assert isinstance(word.value, Literal)


def test_what_the_grammar_does_not_take_is_opaque_if_it_has_a_name() -> None:
    (item,) = items('CGTECH_MACRO "of another" 17')
    assert isinstance(item, Opaque)
    assert item.kind == "statement"
    (known,) = items("HEAD_CLEAN")
    assert isinstance(known, Command)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("X10..5", "NCF115"),
        ("X1,5", "NCF115"),
        ("X=", "NCF114"),
        ("X Y5", "NCF114"),
        ("X10 )", "NCF110"),
        ("X1 Y2 X3", "NCF117"),
        ("X1e3", "NCF116"),
    ],
)
def test_what_is_no_block_is_an_error_with_its_place(text: str, code: str) -> None:
    with pytest.raises(SourceError) as caught:
        items(text)
    assert caught.value.messages[0].code == code


def test_jumps_know_where_they_lead() -> None:
    found = [item for item in items("IF R1==1 GOTOF N 100") if isinstance(item, OWordLine)]
    assert [(item.keyword, item.label) for item in found] == [("if", ""), ("gotof", "N100")]


def test_the_corpus_is_read(shared: Callable[[str], Path], figures: Callable[[str], None]) -> None:
    files = sorted((shared("corpus") / "siemens").iterdir())
    unreadable, blocks, opaque = 0, 0, 0
    for path in files:
        source = path.read_bytes()
        assert detect(source, path.name).name == "siemens", path.name
        try:
            program = read(source, path.name, "siemens")
        except SourceError:
            unreadable += 1
            continue
        blocks += len(program)
        opaque += sum(is_statement(program, block) for block in program)
        assert program.source == source
    figures(f"siemens corpus: {len(files)} files, {unreadable} unreadable; {blocks} blocks, {opaque} not understood")
    assert unreadable <= 0.01 * len(files)


def is_statement(program: Program, block: int) -> bool:
    return any(isinstance(item, Opaque) and item.kind == "statement" for item in program.items_of(block))


def test_the_lanes_agree_over_the_corpus(shared: Callable[[str], Path]) -> None:
    """The first lines of each file, block for block by the grammar alone."""
    for path in sorted((shared("corpus") / "siemens").iterdir()):
        source = b"".join(path.read_bytes().splitlines(keepends=True)[:25])
        assert_read_right(read(source, path.name, "siemens"))


def test_a_tape_with_a_program_number_is_not_taken_for_sinumerik_code() -> None:
    """A machine with a Siemens control reads what does not show its language as Siemens code; this shows it."""
    with pytest.raises(SourceError, match=r"NCF103.*Fanuc"):
        read(b"%\nO0001\nN10 G21 G90\nN20 G0 X10.\nM30\n%\n", "part.nc", "siemens")
