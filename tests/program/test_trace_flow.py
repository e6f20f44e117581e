"""O-words, subprograms and program ends: which blocks are executed, and what is wrong with flow that breaks."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ncfix.control.setup import Setup
from ncfix.control.trace import trace
from ncfix.diagnostics import SourceError
from ncfix.text.reader import read
from program.tracing import KNOWN, ends, follow, last, reasons


def xs(text: str, **given: object) -> list[float]:
    """X of the ends of the motions."""
    return [row[0] for row in ends(follow(text, **given))]  # type: ignore[arg-type]


# -- branches and loops -----------------------------------------------------------------------------------------------

BRANCH = "#1={}\no1 if [#1 eq 1]\nG0 X1\no1 elseif [#1 eq 2]\nG0 X2\no1 else\nG0 X3\no1 endif"


@pytest.mark.parametrize(("value", "end"), [(1, 1.0), (2, 2.0), (7, 3.0)])
def test_branches(value: int, end: float) -> None:
    assert xs(BRANCH.format(value)) == [end]


def test_branches_may_be_nested_and_lack_an_else() -> None:
    text = "o1 if [1]\no2 if [0]\nG0 X1\no2 endif\nG0 X2\no1 else\no3 if [1]\nG0 X3\no3 endif\no1 endif\nG0 X4"
    assert xs(text) == [2.0, 4.0]


def test_while() -> None:
    assert xs("#1=0\no1 while [#1 lt 3]\n#1=[#1+1]\nG0 X#1\no1 endwhile") == [1.0, 2.0, 3.0]
    assert xs("o1 while [0]\nG0 X1\no1 endwhile\nG0 X2") == [2.0]


def test_do() -> None:
    assert xs("#1=5\no1 do\n#1=[#1+1]\nG0 X#1\no1 while [#1 lt 3]") == [6.0]
    assert xs("#1=0\no1 do\n#1=[#1+1]\nG0 X#1\no1 while [#1 lt 3]") == [1.0, 2.0, 3.0]


def test_repeat() -> None:
    assert xs("o1 repeat [2.6]\nG91 G0 X1\no1 endrepeat") == [1.0, 2.0, 3.0]
    assert xs("o1 repeat [0]\nG0 X1\no1 endrepeat\nG0 X2") == [2.0]
    nested = "o1 repeat [2]\no2 repeat [3]\nG91 G0 X1\no2 endrepeat\no1 endrepeat"
    assert len(xs(nested)) == 6


def test_break_and_continue() -> None:
    begin = "#1=0\no1 while [#1 lt 5]\n#1=[#1+1]\n"
    leave = "o2 if [#1 eq 2]\no1 continue\no2 endif\no3 if [#1 eq 4]\no1 break\no3 endif\n"
    assert xs(begin + leave + "G0 X#1\no1 endwhile\nG0 X9") == [1.0, 3.0, 9.0]


def test_labels_may_be_names_and_numbers_and_computed() -> None:
    assert xs("o<Long Name> if [1]\nG0 X1\no<longname> endif") == [1.0]
    assert xs("o007 if [1]\nG0 X1\no7 endif") == [1.0]
    assert xs("o5 sub\nG0 X5\no5 endsub\n#1=5\no#1 call\no[#1] call") == [5.0, 5.0]


# -- subprograms ------------------------------------------------------------------------------------------------------


def test_arguments_are_local_and_the_rest_is_zero() -> None:
    text = "o1 sub\nG0 X#1 Y#2 Z#3\n#1=99\no1 endsub\n#1=7 #3=8\no1 call [1] [2]\nG0 X#1 Z#3"
    assert ends(follow(text)) == [[1, 2, 0], [7, 2, 8]]


def test_return_values() -> None:
    text = "o1 sub\no1 return [#1 * 2]\nG0 X100\no1 endsub\no1 call [4]\nG0 X#<_value> Y#<_value_returned>"
    assert last(follow(text))[:2] == [8, 1]
    text = "o1 sub\no1 endsub [3]\no1 call\nG0 X#<_value>"
    assert last(follow(text))[0] == 3
    text = "o1 sub\no1 endsub\no1 call\nG0 X1 Y#<_value_returned>"
    assert last(follow(text))[:2] == [1, 0]


def test_subprograms_may_stand_after_the_end() -> None:
    program = read(b"o1 call [3]\nM2\no1 sub\nG0 X#1\no1 endsub\n", "part.ngc")
    followed = trace(program, KNOWN, ("X",), frozenset())
    assert followed.moves.end[:, 0].tolist() == [3.0]
    assert followed.moves.block.tolist() == [3]


def test_recursion_keeps_its_arguments() -> None:
    text = "o1 sub\no2 if [#1 gt 0]\no1 call [#1-1]\no2 endif\nG0 X#1\no1 endsub\no1 call [3]"
    assert xs(text) == [0.0, 1.0, 2.0, 3.0]


def test_files() -> None:
    files = {"hole": "(a file of its own)\no<hole> sub\nG0 X#1\no<hole> endsub\n", "20": "O20\nG0 X20\nM99\n"}
    followed = follow("G0 X1\no<hole> call [5]\nM98 P20\nG0 X2", files=files)
    assert [row[0] for row in ends(followed)] == [1, 5, 20, 2]
    assert followed.moves.block.tolist() == [0, 1, 2, 3]
    assert "subprogram file hole" in reasons(followed)[1]
    assert "subprogram file 20" in reasons(followed)[2]
    assert reasons(followed)[3] == ""


def test_m98_shares_its_parameters_and_repeats() -> None:
    program = read(b"#1=1\nM98 P5 L3\nG0 X#1\nM2\nO5\nG0 X#1\n#1=[#1+1]\nM99\n", "part.ngc")
    followed = trace(program, KNOWN, ("X",), frozenset())
    assert followed.moves.end[:, 0].tolist() == [1.0, 2.0, 3.0, 4.0]


def test_m98_l0_calls_nothing() -> None:
    program = read(b"M98 P5 L0\nG0 X1\nM2\nO5\nG0 X2\nM99\n", "part.ngc")
    assert len(trace(program, KNOWN, ("X",), frozenset()).moves) == 1


def test_iso_programs_find_numbered_subprograms_anywhere_and_move_before_they_call() -> None:
    program = read(b"O1\nM98 P2\nG0 X1 M98 P2\nM30\nO2\nG91 G0 Y1\nG90\nM99\n", "part.nc", "iso")
    followed = trace(program, KNOWN, ("X", "Y"), frozenset())
    assert followed.moves.end.tolist() == [[0, 1], [1, 1], [1, 2]]


def test_iso_calls_may_hold_the_repeats_in_p_and_files_may_begin_with_o() -> None:
    followed = follow("M98 P30020", dialect="iso", files={"O0020": "O20\nG91 G0 X1\nM99\n"})
    assert [row[0] for row in ends(followed)] == [1, 2, 3]


def test_a_state_can_be_saved_and_comes_back() -> None:
    text = "o1 sub\nM73\nG91 G20 G55\no1 endsub\no1 call\nG0 X1\nM70\nG91\nM72\nX2"
    assert xs(text) == [1.0, 2.0]


# -- ends -------------------------------------------------------------------------------------------------------------


def codes_of(source: bytes, dialect: str = "linuxcnc") -> list[str]:
    """The codes of the remarks."""
    followed = trace(read(source, "part", dialect), KNOWN, ("X",), frozenset())
    return [message.code for message in followed.messages]


def test_the_end_is_m2_m30_m99_or_tape() -> None:
    for end in (b"M2", b"M30", b"G0 X2 M30"):
        assert codes_of(b"G21 G0 X1\n" + end + b"\nS900\n") == []
    assert codes_of(b"%\nG21 G0 X1\n%\nnot looked at\n") == []


@pytest.mark.parametrize(
    ("dialect", "text", "found"),
    [
        ("linuxcnc", "G0 X1\nM2\nG0 X9\n", 1),
        ("linuxcnc", "%\nG0 X1\n%\n(X9)\n; X9\nG0 X9\n%\n", 1),
        ("linuxcnc", "o1 call\nG0 X1\nM2\no1 sub\nG0 X9\no1 endsub\n", 0),
        ("iso", "O1\nM98 P2\nM30\nO2\nG0 X1\nM99\n", 0),
        ("fanuc", "%\nO1\nG0 X1.\nM30\nO2\nG0 X9.\nX#1\nM99\n%\n", 1),
        ("fanuc", "%\nO1\nG0 X1.\nM30\n%\n%\nO2\nG0X9.\nM30\n%\n", 1),
        ("fanuc", "O1\nG0 X1.\nIF [1 EQ 2] GOTO 5\nGOTO 6\nN5 X2.\nN6 M30\n", 1),
        ("fanuc", "O1\n#1=0\nN5 G92 X0.\nG0 X1.\nIF [#1 EQ 1] GOTO 6\n#1=1\nGOTO 5\nN6 M30\n", 0),
        ("fanuc", "O1\nGOTO 6\nN5 G0 X2.\nGOTO 7\nN6 X1.\nGOTO 5\nN7 M30\n", 0),
        ("fanuc", "O1\nGOTO 6\nN5 (X2.)\n#1=3\nN6 G0 X1.\nM30\n", 0),
        ("fanuc", "O1\n#1=0\nN5 G0 X1.\nIF [#1 EQ 1] GOTO 7\n#1=1\nGOTO 6\nX2.\nN6 X3.\nGOTO 5\nN7 M30\n", 1),
        ("fanuc", "O1\n#1=0\nN5 G0 X1.\nIF [#1 EQ 1] GOTO 7\n#1=1\nGOTO 6\nN6 X3.\nGOTO 5\nN7 M30\n", 0),
        ("linuxcnc", "o1 if [0]\nG0 X1\no1 else\nG0 X2\no1 endif\nM2\n", 1),
        ("linuxcnc", "o1 while [0]\nG0 X1\no1 endwhile\nM2\n", 1),
        ("linuxcnc", "o1 sub\nG0 X1\no1 endsub\no1 call\nM2\n", 0),
        ("linuxcnc", "o1 sub\nG0 X1\no1 endsub\nM2\n", 1),
        ("fanuc", "O1\nG0 X1.\nG65 P2\nM30\nO2\nX#24\nM99\n", 0),
        ("siemens", "%_N_A_MPF\nG90 G0 X1\nM30\n%_N_B_MPF\nG0 X9\nX=R1\nM30\n", 1),
        ("siemens", "sent by DNC\n%_N_A_MPF\nG90 G0 X1\nM30\n", 1),
        ("siemens", "%_N_A_MPF\nG90 G0 X1\nSUB1\nM30\n%_N_SUB1_SPF\nG0 X9\nM17\n", 0),
        ("heidenhain", "BEGIN PGM A MM\nL X+1 FMAX\nEND PGM A MM\nBEGIN PGM B MM\nL IX+9\nL X+Q1\nEND PGM B MM\n", 1),
        ("siemens", "R1=2\nIF R1==1\nG0 X1\nELSE\nG0 X2\nENDIF\nM30\n", 1),
        ("siemens", "LAB: G0 X1\nX2\nEND1: X3\nREPEAT LAB END1 P=2\nM30\n", 0),
        ("heidenhain", "BEGIN PGM A MM\nFN 9: IF +0 EQU +0 GOTO LBL 2\nL X+1 FMAX\nLBL 2\nM30\nEND PGM A MM\n", 1),
        ("heidenhain", "BEGIN PGM A MM\nCALL LBL 1\nM30\nLBL 1\nL X+1 FMAX\nLBL 0\nEND PGM A MM\n", 0),
        ("heidenhain", 'BEGIN PGM A14 MM\nL X+1 FMAX M30\n* - X14\n7 TOOL CALL "Z1" Z\n8 END PGM A14 MM\n', 0),
    ],
)
def test_motions_that_the_program_never_goes_through_are_a_remark(dialect: str, text: str, found: int) -> None:
    program = read(text.encode(), "part", dialect)
    known = Setup(initial={"X": 0.0}, work_offsets={"G500": {}}, assume_zero=True)
    said = [each for each in trace(program, known, ("X",), frozenset()).messages if each.code == "NCF249"]
    assert len(said) == found


def test_a_missing_end_is_a_remark() -> None:
    assert codes_of(b"G21 G0 X1\n") == ["NCF234"]
    assert codes_of(b"%\nG21 G0 X1\n") == ["NCF234"]


def test_block_skip_is_executed_unless_the_setup_says_otherwise() -> None:
    assert xs("G0 X1\n/G0 X2\nG0 X3") == [1.0, 2.0, 3.0]
    assert xs("G0 X1\n/G0 X2\nG0 X3", block_skip=True) == [1.0, 3.0]
    assert codes_of(b"G21\n/G0 X1\n/G0 X2\nM2\n") == ["NCF235"]


# -- flow that breaks -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "code", "line"),
    [
        ("o1 call", "NCF231", 1),
        ("G0 X1\nM98 P5", "NCF231", 2),
        ("o1 endif", "NCF230", 1),
        ("o1 else", "NCF230", 1),
        ("o1 endwhile", "NCF230", 1),
        ("o1 endsub", "NCF230", 1),
        ("o1 return", "NCF230", 1),
        ("o1 break", "NCF230", 1),
        ("o1 if [0]\nG0 X1", "NCF230", 1),
        ("o1 sub\nG0 X1", "NCF230", 1),
        ("o1 sub\no2 sub\no2 endsub\no1 endsub", "NCF230", 2),
        ("o1 if [1]\no1 endif\no1 if [1]\no1 endif", "NCF230", 3),
        ("o1 repeat [2]\no1 endwhile", "NCF230", 2),
        ("o1 repeat [2]\no1 break\no1 endrepeat", "NCF230", 2),
        ("o1 sub\no1 endsub\no1 call\nM98 P1\n", "NCF230", None),
        ("o1 sub\no1 call\no1 endsub\no1 call", "NCF232", 2),
    ],
)
def test_broken_flow_is_an_error_at_its_line(text: str, code: str, line: int | None) -> None:
    with pytest.raises(SourceError) as caught:
        follow(text)
    message = caught.value.messages[0]
    assert message.code == code
    assert line in (None, message.place.line if message.place else 0)


def test_a_file_that_ends_inside_its_subprogram() -> None:
    with pytest.raises(SourceError) as caught:
        follow("o<part> call", files={"part": "o<part> sub\nG0 X1\n"})
    assert caught.value.code == "NCF230"
    assert caught.value.messages[0].place.path == "part"


def test_endless_programs_end() -> None:
    program = read(b"o1 while [1]\n#1=[#1+1]\no1 endwhile\nM2\n", "part.ngc")
    with pytest.raises(SourceError) as caught:
        trace(program, replace(KNOWN, most_blocks=1000), ("X",), frozenset())
    assert caught.value.code == "NCF233"
    assert "more than 1,000 blocks" in str(caught.value)


def test_a_program_is_not_endless_for_being_long() -> None:
    program = read(b"G21 G90 G54 G1 F100\n" + b"X1\nX0\n" * 600 + b"M2\n", "part.ngc")
    assert len(trace(program, replace(KNOWN, most_blocks=100), ("X",), frozenset()).moves) == 1200


def test_a_line_that_cannot_be_read_is_an_error_only_where_the_control_gets_to_it() -> None:
    assert codes_of(b"G21 G0 X1\nM2\nwhat is this?\n") == []
    with pytest.raises(SourceError) as caught:
        codes_of(b"o1 call\nM2\no1 sub\nwhat is this?\no1 endsub\n")
    assert caught.value.code == "NCF236"
