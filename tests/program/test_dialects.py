"""Which dialect a text is read with, and where grammars come from."""

from __future__ import annotations

import re
import shutil
import time
from dataclasses import replace
from pathlib import Path

import pytest

from ncfix.compensate.following import follow
from ncfix.control.setup import Setup
from ncfix.diagnostics import NcfixError
from ncfix.machine import load
from ncfix.text.dialect import check_content, detect, get, names
from ncfix.text.grammar import find_grammar, parser
from ncfix.text.reader import read
from ncfix.text.tree import Word
from program.lanes import assert_read_right

FIVE_AXES = Path(__file__).parents[2] / "examples/machines/wCAYFXZSt.toml"


@pytest.mark.parametrize("name", names())
def test_codes_that_a_dialect_says_it_understands_are_codes_of_it(name: str) -> None:
    dialect, machine, unknown = get(name), load(str(FIVE_AXES)), []
    for code in {code for line in dialect.understands for code in re.findall(r"\bG\d+(?:\.\d+)?\b", line)}:
        program = read(f"G21 G90\nG0 X1 Y1 Z50\n{code}\nM2\n".encode(), "part.nc", dialect)
        try:
            follow(program, machine, Setup(assume_zero=True))
        except NcfixError as error:
            unknown += [each.text for each in error.messages if each.code == "NCF227"]
    assert not unknown


def test_the_built_in_dialects_are_there() -> None:
    assert {"iso", "linuxcnc"} <= set(names())
    assert get("iso").name == "iso"


@pytest.mark.parametrize(
    ("source", "path", "expected"),
    [
        (b"G0 X1\n", "part.ngc", "linuxcnc"),
        (b"G0 X1\n", "PART.NGC", "linuxcnc"),
        (b"G0 X1\n", "part.nc", "iso"),
        (b"G0 X1\n", "part", "iso"),
        (b"G0 X1\n", "-", "iso"),
        (b"o<side> sub\no<side> endsub\n", "part.nc", "linuxcnc"),
        (b"(x)\n O100 IF [#1 GT 2]\n O100 ENDIF\n", "part.nc", "linuxcnc"),
        (b"#<depth> = 5\n", "part.tap", "linuxcnc"),
        (b"O1000 (PART)\nG0 X1\n", "part.tap", "iso"),
        (b"(T# < 2 OR > 5)\n(#<2> is the side)\n(o1 if)\nG0 X1\n", "part.tap", "iso"),
        (b"G0 X1 ; see #<side> and G65 P1\n", "part.tap", "iso"),
        (b"(G65 P9832 #<side>)\nIF [#1 GT 2] GOTO 5\nN5\n", "part.tap", "fanuc"),
        (b";$PATH=/_N_WKS_DIR\nG0 X1\n", "part.nc", "siemens"),
    ],
)
def test_detection(source: bytes, path: str, expected: str) -> None:
    assert detect(source, path).name == expected
    assert read(source, path).dialect.name == expected


@pytest.mark.parametrize("name", ["fanuc", "haas", "iso", "siemens"])
def test_signs_of_another_language_in_a_comment_are_none(name: str) -> None:
    dialect = get(name)
    comment = b"(T# < 2 OR > 5) (G15 H3)" if name != "siemens" else b"; #<side> o<a> call"
    check_content(b"G0 X1 " + comment + b"\nG1 X2 F100\n", "part.nc", dialect)


@pytest.mark.parametrize(
    ("source", "control", "expected"),
    [
        (b"G65 P9832\n", "haas", "haas"),
        (b"G65 P9832\n", "mitsubishi", "mitsubishi"),
        (b"G65 P9832\n", "siemens", "fanuc"),
        (b"G187 P3\n", "fanuc", "haas"),
        (b"G187 P3\n", "mitsubishi", "mitsubishi"),
        (b"o<side> call\n", "iso", "linuxcnc"),
    ],
)
def test_what_a_family_has_is_read_as_the_control_of_the_machine_has_it(
    source: bytes, control: str, expected: str
) -> None:
    assert detect(source, "part.nc", control).name == expected


@pytest.mark.parametrize("dialect", ["iso", "fanuc", "haas", "mitsubishi"])
@pytest.mark.parametrize(
    "text",
    ["G96 S200\nG1 X5. Y#1", "G50\nS2000", "(G50 S2000)", "G73 X1. Z-5. R2. P500 Q2000", "M3 G50 S800", "G97 S1"],
)
def test_what_milling_machines_do_is_no_sign_of_a_lathe(text: str, dialect: str) -> None:
    assert read(f"{text}\n".encode(), dialect=dialect).dialect.name == dialect


def test_a_long_line_of_cycles_is_searched_for_signs_of_a_lathe_in_no_time() -> None:
    """Not for every cycle to the end of the line: that takes ten seconds and more."""
    begun = time.process_time()
    check_content(b"G73 P1 Q2 " * 6000, "part.nc", get("fanuc"))
    assert time.process_time() - begun < 3.0


def test_a_plugin_may_bring_a_grammar_of_its_own(tmp_path: Path) -> None:
    grammar = tmp_path / "upper.lark"
    grammar.write_text("%import common (word, ADDRESS)\nblock: word*\n%override ADDRESS: /[XY]/\n", encoding="utf-8")
    program = read(b"X1 Y-2.5\n", dialect=replace(get("iso"), name="upper", grammar=str(grammar)))
    assert_read_right(program)
    assert [item.address for item in program.items_of(0) if isinstance(item, Word)] == ["X", "Y"]


def test_a_grammar_that_is_not_there_is_a_fault_of_who_names_it() -> None:
    with pytest.raises(FileNotFoundError, match=r"no grammar 'none\.lark'"):
        find_grammar("none.lark")


def test_a_parser_leaves_no_files(tmp_path: Path, root: Path) -> None:
    for file in ("common.lark", "iso.lark"):
        shutil.copy(root / "grammars" / file, tmp_path)
    parser(str(tmp_path / "iso.lark")).parse("G1X1")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["common.lark", "iso.lark"]


@pytest.mark.parametrize("dialect", ["iso", "linuxcnc", "fanuc"])
@pytest.mark.parametrize(
    ("line", "foreign"),
    [
        ("(RPT N10,N20)N3", True),
        ("N5 (IF P1 EQ 0 GOTO N10)", True),
        ("( GOTO N100 )", True),
        ("(P1=P1+1)", True),
        ("(SUB 12)\nX1\n(RET)", True),
        ("(SUB 12)", False),
        ("(RET)", False),
        ("(P1=5)", False),
        ("(return)", False),
        ("(retract, then goto N10)", False),
        ("(SUB 12)\n(return)", False),
        ("(GOTO10)", False),
        ("(IF[#1EQ#0]GOTO10)", False),
        ("(IF LOOSE GOTO N10)", False),
        ("; (RPT N10,N20)N3", False),
    ],
)
def test_statements_of_fagor_are_no_comments(dialect: str, line: str, foreign: bool) -> None:
    source = f"G21 G90\nG1 X1 F100\n{line}\nG1 X2\nM30\n".encode()
    if foreign:
        with pytest.raises(NcfixError, match="NCF103: this is Fagor code"):
            read(source, "part.nc", dialect)
    else:
        read(source, "part.nc", dialect)


@pytest.mark.parametrize("dialect", ["iso", "fanuc", "linuxcnc"])
@pytest.mark.parametrize(
    ("line", "family"),
    [
        ("#RTCP ON", "code of Fagor or ISG controls"),
        ("N10 #CS ON[1]", "code of Fagor or ISG controls"),
        ("#1:=10.;", "Syntec code"),
        ("%@MACRO", "Syntec code"),
        ("%PM9001", "code of Philips or MAHO controls"),
        ("#1=10.", ""),
        ("(#RTCP ON)", ""),
        ("#atan[1]/[1]=3", ""),
        ("N9 #ROUND [2.2] = 5", ""),
        ("(#1:=10.)", ""),
    ],
)
def test_statements_that_begin_with_a_hash_name_their_control(dialect: str, line: str, family: str) -> None:
    source = f"{line}\nG21 G90\nG1 X1 F100\nM30\n".encode()
    if family:
        with pytest.raises(NcfixError, match=f"NCF103: this is {family}"):
            read(source, "part.nc", dialect)
    else:
        read(source, "part.nc", dialect)


@pytest.mark.parametrize(
    ("text", "foreign"),
    [
        ("%9001\nN10 G0 G52 Z0\nN20 X1 Y1\n", True),
        ("\n% 12 (PART)\nN10 G1 X5 F100\nN20 G79 N10\n", True),
        ("%9001\nL1=5\nG0 X1\n", True),
        ("%9001\nG0 X1 Y1\n", False),
        ("%\nO9001\nG52 X0 Y0\nG0 X1\n", False),
        ("%9001\n(G52 Z0)\nG0 X1 Y1\n", False),
    ],
)
@pytest.mark.parametrize("dialect", ["iso", "fanuc"])
def test_num_is_known_by_its_number_and_its_codes(dialect: str, text: str, foreign: bool) -> None:
    if foreign:
        with pytest.raises(NcfixError, match="NCF103: this is NUM code"):
            read(text.encode(), "part.nc", dialect)
    else:
        read(text.encode(), "part.nc", dialect)
