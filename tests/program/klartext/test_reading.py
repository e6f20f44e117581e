"""Klartext as it is found: every file of the corpus, and the odd things that are in it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from ncfix.diagnostics import SourceError
from ncfix.text.dialect import detect
from ncfix.text.reach import UNREAD
from ncfix.text.reader import read
from ncfix.text.tree import Assignment, Command, Opaque, OWordLine, Program, Word
from ncfix.text.writer import apply
from program.klartext.tnc import program
from program.lanes import assert_read_right

NO_KLARTEXT = "antlr__75f6ad_sapf-bif-examples.txt"
"""A file of another language that has strayed into the corpus."""


def one(text: str) -> Program:
    return read(program(text), "t.h")


def words(text: str) -> dict[str, float]:
    """The words of a block with plain numbers."""
    source = one(text)
    values = source.values_of(1)
    found = source.templates[int(source.template[1])].slots
    return {address: float(values[slot]) for address, slot in found.items()}


def unread(source: Program) -> list[int]:
    """The lines that are not Klartext."""
    return [
        source.line(block)
        for block in source
        if any(isinstance(item, Opaque) and item.kind == UNREAD for item in source.items_of(block))
    ]


def test_what_is_nested_too_deep_is_not_read() -> None:
    deep = 3000
    assert unread(one(f"Q1 = {'( ' * deep}1{' )' * deep}\nQ2 = {'SQRT ' * deep}1\nL X+1")) == [2, 3]


def test_every_file_of_the_corpus_is_read(shared: Callable[[str], Path], figures: Callable[[str], None]) -> None:
    files, blocks, odd = 0, 0, 0
    for path in sorted((shared("corpus") / "heidenhain").iterdir()):
        if path.name == NO_KLARTEXT:
            continue
        source = path.read_bytes()
        found = read(source, path.name)
        assert found.dialect.name == "heidenhain"
        assert apply(found.source, []) == source
        files, blocks, odd = files + 1, blocks + len(found), odd + len(unread(found))
    figures(f"klartext corpus: {files} files read, {blocks} blocks, {odd} of them no Klartext")
    assert files == 29
    assert odd <= 0.01 * blocks


def test_what_the_shapes_say_is_what_the_grammar_says(shared: Callable[[str], Path]) -> None:
    for path in sorted((shared("corpus") / "heidenhain").iterdir()):
        if path.name != NO_KLARTEXT:
            assert_read_right(read(b"".join(path.read_bytes().splitlines(keepends=True)[:80]), path.name, "heidenhain"))


def test_what_has_no_beginning_is_no_klartext(shared: Callable[[str], Path]) -> None:
    path = shared("corpus") / "heidenhain" / NO_KLARTEXT
    with pytest.raises(SourceError, match="NCF103"):
        read(path.read_bytes(), path.name, "heidenhain")


def test_an_n_before_block_numbers_is_refused_once() -> None:
    with pytest.raises(SourceError, match="NCF103: this is Klartext with an N"):
        read(b"N0 BEGIN PGM T MM\nN10 L X+1 FMAX\nN20 END PGM T MM\n", "t.h", "heidenhain")


@pytest.mark.parametrize("name", ["iso", "linuxcnc"])
def test_klartext_read_as_something_else_is_an_error(name: str) -> None:
    with pytest.raises(SourceError, match="NCF103"):
        read(program("L X+1 FMAX"), "t.nc", name)


@pytest.mark.parametrize("path", ["t.h", "t.nc", "t.ptp", "t"])
def test_the_beginning_shows_the_language(path: str) -> None:
    assert detect(program("L X+1"), path).name == "heidenhain"
    assert detect(b"\r\n0   BEGIN PGM 5 INCH\r\n", path).name == "heidenhain"


@pytest.mark.parametrize(
    ("block", "expected"),
    [
        ("L X+10,5 Y-.25 Z50. R0 FMAX M3", {"X": 10.5, "Y": -0.25, "Z": 50.0}),
        ("12 L  IX+10  IC-5 F1500,5", {"N": 12.0, "IX": 10.0, "IC": -5.0, "F": 1500.5}),
        ("L X- 5 Y +3", {"X": -5.0, "Y": 3.0}),
        ("Z0.0 B0.0 C15.", {"Z": 0.0, "B": 0.0, "C": 15.0}),
        ("CP IPA-180 IZ-0.1 DR-", {"IPA": -180.0, "IZ": -0.1}),
        ("CR X+1 Y+2 R-20,5 DR+", {"X": 1.0, "Y": 2.0, "R": -20.5}),
        ("CR X1 Y2 R24.8 DR+", {"X": 1.0, "Y": 2.0, "R": 24.8}),
        ("TOOL CALL 2 Z DR2.5 DR2+0.1", {"DR": 2.5, "DR2": 0.1}),
        ("LN X1 Y2 Z3 NX0.1 NY0 NZ1 F500", {"X": 1.0, "Y": 2.0, "Z": 3.0, "NX": 0.1, "NY": 0.0, "NZ": 1.0, "F": 500.0}),
        ("APPR LCT X+3 Y+4 R10 RL F100", {"X": 3.0, "Y": 4.0, "R": 10.0, "F": 100.0}),
        ("TOOL CALL 5 Z S 1500,000 DL+0,1", {"S": 1500.0, "DL": 0.1}),
        ("PLANE SPATIAL SPA+0 SPB+45 SPC-10 TURN MB MAX FMAX", {"SPA": 0.0, "SPB": 45.0, "SPC": -10.0}),
        ("L X+1 M128 F1000", {"X": 1.0, "F": 1000.0}),
        ("/5 L X+1", {"N": 5.0, "X": 1.0}),
    ],
)
def test_words(block: str, expected: dict[str, float]) -> None:
    assert words(block) == expected
    assert_read_right(one(block))


@pytest.mark.parametrize(
    ("block", "kind", "names"),
    [
        ("L X+1 F MAX RL DR+", Command, ["l", "fmax", "rl", "dr+"]),
        ("CYCL DEF9 .0", Command, ["cycl def 9.0"]),
        ("TOOL DEF1 L+30", Command, ["tool def"]),
        ("CYCL  CALL M3", Command, ["cycl call"]),
        ("L M140 MB MAX", Command, ["l", "mb max"]),
        ("APPR PLT PR+1 PA+2 LEN5 R0 ", Command, ["appr plt", "r0"]),
        ("CALL LBL 5 REP 3/3", OWordLine, ["5"]),
        ("LBL 007", OWordLine, ["7"]),
        ('FN 9: IF +Q1 EQU -Q2 GOTO LBL "END"', OWordLine, ["END"]),
        ("FN 0 : Q1 = - 10", Assignment, ["Q1"]),
        ("Q5 = ( Q1 + SIN 30 ) * Q2 ^ 2 ; note", Assignment, ["Q5"]),
        ("CYCL DEF 200 DRILLING Q200=2. Q201=-5.", Assignment, ["Q200", "Q201"]),
    ],
)
def test_statements(block: str, kind: type, names: list[str]) -> None:
    source = one(block)
    found = [item for item in source.items_of(1) if isinstance(item, kind)]
    assert [getattr(i, "name", getattr(i, "label", None)) or i.target.name for i in found] == names
    assert_read_right(source)


def test_a_tilde_joins_lines() -> None:
    source = one("19 CYCL DEF 247 PRESET~\n   Q339=+1 ;NUMBER\n20 L X+1")
    assert len(source) == 4
    assert source.line(2) == 4
    assert [item.target.name for item in source.items_of(1) if isinstance(item, Assignment)] == ["Q339"]
    assert_read_right(source)


def test_a_comment_goes_on_after_a_tilde() -> None:
    source = one("3 ;free software~\n under the terms~\n of X+5\n4 L X+1")
    assert len(source) == 4
    assert not any(isinstance(item, Word) and item.address == "X" for item in source.items_of(1))


@pytest.mark.parametrize("remark", ["; note ~", "* - headline ~", "5 ;note ~"])
def test_whether_a_remark_swallows_a_block_nobody_says(remark: str) -> None:
    assert unread(one(f"{remark}\nL X+1 F100\nL X+2")) == [2]
    assert unread(one(f"{remark}\n6 CALL LBL 1\nL X+2")) == [2]
    assert unread(one(f"{remark}\n goes on, as in X+1\nL X+2")) == []


def test_a_line_that_is_no_klartext_is_kept_and_named() -> None:
    assert unread(one("L X+1\nG91 G28 Z0.0\nL X+100 FAMX")) == [3, 4]


def test_other_line_ends_and_letters() -> None:
    text = program("L X+1 ;Fräser\nL Y+2").replace(b"\n", b"\r\n")
    found = read(text, "t.h")
    assert len(found) == 4
    assert_read_right(found)
