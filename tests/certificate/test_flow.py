"""Loops and subprograms are followed where counts and conditions are plain, and their motions are proved each time."""

from __future__ import annotations

import pytest

from certificate.planting import GIVEN, SETUP, machine
from ncfix.certificate.findings import BlockProof
from ncfix.certificate.flow import LineOrder, NotPlainError
from ncfix.certificate.formulas import value_of
from ncfix.certificate.proof import prove
from ncfix.certificate.reading import JUMPS, Family
from ncfix.certificate.text import Text
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.text.dialect import get
from ncfix.text.reader import read

FAMILIES = {"heidenhain": Family.KLARTEXT, "siemens": Family.SINUMERIK, "fanuc": Family.WORDS, "linuxcnc": Family.WORDS}


def executed(language: str, rows: list[str], counter: str = "") -> list[int]:
    """The lines in the order in which they are executed; `counter` counts in lines that are `counter = counter + 1`."""
    order = LineOrder.of(Text.of("\n".join(rows).encode(), FAMILIES[language]))
    assert order is not None
    found, row, known = list[int](), 0, {counter: 0.0}
    while row < len(rows) and rows[row] != "M30":
        found.append(row)
        if counter and rows[row].startswith(f"{counter}="):
            known[counter] = value_of(rows[row].partition("=")[2], known) or 0.0
        row = order.line_after(row, known)
    return found


@pytest.mark.parametrize(
    ("language", "text", "expected"),
    [
        ("heidenhain", "LBL 1|L X+1|CALL LBL 1 REP 2|L X+2", [0, 1, 2, 0, 1, 0, 1, 3]),
        ("heidenhain", "LBL 1|LBL 2|CALL LBL 2 REP 1|CALL LBL 1 REP 1|M30", [0, 1, 2, 1, 3, 0, 1, 2, 1]),
        ("heidenhain", "CALL LBL 7|CALL LBL 7|M30|LBL 7|L X+1|LBL 0", [0, 3, 4, 5, 1, 3, 4, 5]),
        ("heidenhain", "Q1=0|LBL 1|Q1=Q1+1|FN 12: IF +Q1 LT +3 GOTO LBL 1|M30", [0, *[1, 2, 3] * 3]),
        ("siemens", "A1:|X1|REPEAT A1 P=2|X2", [0, 1, 2, 0, 1, 0, 1, 3]),
        ("siemens", "A1:|X1|ENDLABEL:|X3|REPEAT A1|X2", [0, 1, 2, 3, 4, 0, 1, 2, 5]),
        ("siemens", "A1: X1|X3|REPEATB A1 P=2|X2", [0, 1, 2, 0, 0, 3]),
        ("siemens", "R1=0|A1:|R1=R1+1|IF R1<3 GOTOB A1|GOTOF A2|X5|A2:", [0, *[1, 2, 3] * 3, 4, 6]),
        ("fanuc", "#1=0|WHILE [#1 LT 2] DO1|#1=#1+1|END1|X1", [0, *[1, 2, 3] * 2, 1, 4]),
        ("fanuc", "#1=0|N10 X1|#1=#1+1|IF [#1 NE 2] GOTO 10|X1", [0, *[1, 2, 3] * 2, 4]),
        ("fanuc", "O1|M98 P20 L2|M30|O20|X1|M99", [0, 1, *[3, 4, 5] * 2]),
        ("linuxcnc", "O1 REPEAT [2]|X1|O1 ENDREPEAT|X2", [0, 1, 1, 3]),
        ("linuxcnc", "O1 REPEAT [0]|X1|O1 ENDREPEAT|X2", [0, 3]),
    ],
)
def test_lines_are_executed_in_this_order(language: str, text: str, expected: list[int]) -> None:
    counter = {"heidenhain": "Q1", "siemens": "R1", "fanuc": "#1"}.get(language, "")
    assert executed(language, text.split("|"), counter) == expected


@pytest.mark.parametrize(
    ("language", "text"),
    [
        ("heidenhain", "LBL 1|L X+1|CALL LBL 1 REP Q1"),
        ("heidenhain", "LBL 1|LBL 1|CALL LBL 1 REP 2"),
        ("heidenhain", "CALL PGM OTHER"),
        ("siemens", "A1:|X1|REPEAT A2"),
        ("siemens", "FOR R1=0 TO 5|X1|ENDFOR"),
        ("siemens", "/ GOTOF A1|A1:"),
        ("fanuc", "O1|M98 P20|M30"),
        ("fanuc", "N1 X1|N1 X2|GOTO 1"),
    ],
)
def test_what_is_not_plain_has_no_order(language: str, text: str) -> None:
    assert LineOrder.of(Text.of(text.replace("|", "\n").encode(), FAMILIES[language])) is None


@pytest.mark.parametrize(
    ("language", "text"),
    [
        ("siemens", "A1:|GOTOB A1"),
        ("siemens", "R1=0|A1:|R1=R1+1|IF R1>1 GOTOF A2|REPEAT A1 P=3|A2:"),
        ("siemens", "A1:|REPEAT A1 P=-1"),
        ("siemens", "A1:|REPEAT A1 P=R7"),
        ("siemens", "IF R7==1 GOTOF A1|A1:"),
        ("siemens", "R1=0.1+0.2|A1:|IF R1==0.3000001 GOTOB A1"),
        ("fanuc", "GOTO 1|N1 M99"),
    ],
)
def test_what_is_not_known_or_never_ends_is_not_followed(language: str, text: str) -> None:
    with pytest.raises(NotPlainError):
        executed(language, text.split("|"), "R1")


HEADS = {
    "heidenhain": "BEGIN PGM A MM|TOOL CALL 1 Z S1000|L X+0 Y+0 Z+20 R0 FMAX M3|",
    "siemens": "G17 G40 G90 G94 G71|T1 D1|M6|G54|G0 X0 Y0 Z20|",
    "fanuc": "O1|G21 G17 G40 G49 G80 G90 G94|T1 M6|G54|G0 G43 H1 Z20. X0. Y0.|",
}
LOOPS = {
    "heidenhain": "LBL 1|L X+5 Y+5 Z+5 F500|L X+50.5 Y+20|L X+7|CALL LBL 1 REP 6|L X+60|M30|END PGM A MM",
    "siemens": "R1=0|A1:|G1 X5 Y5 Z5 F500|X50.5 Y20|X7|R1=R1+1|IF R1<7 GOTOB A1|X60|M30",
    "fanuc": "#1=0|WHILE [#1 LT 7] DO1|G1 X5. Y5. Z5. F500|X50.5 Y20.|X7.|#1=#1+1|END1|X60.|M30",
}
CALLED = {
    "heidenhain": "CALL LBL 5|L X+60 F500|CALL LBL 5|M30|LBL 5|L X+20 Y+20 Z+5 F500|L X+50 Y+30 Z+5|LBL 0|END PGM A MM",
    "fanuc": "M98 P20|G1 X60. F500|M98 P20 L2|M30|O20|G1 X20. Y20. Z5. F500|X50. Y30. Z5.|M99",
}


def proved(language: str, body: str, change: tuple[str, str] | None = None) -> BlockProof:
    text = (HEADS[language] + body).replace("|", "\n").encode() + b"\n"
    program = read(text, "part", get(language))
    fixed = fix_program(program, machine("three"), SETUP, FixOptions(figures=False, allow_refused=True)).text.decode()
    if change is not None:
        assert change[0] in fixed, fixed
        fixed = fixed.replace(*change)
    return prove(text, fixed.encode(), machine("three"), GIVEN, language)


@pytest.mark.parametrize(("language", "body"), [*LOOPS.items(), *CALLED.items()])
def test_motions_that_are_made_again_are_proved(language: str, body: str) -> None:
    found = proved(language, body)
    assert found.faults == []
    assert JUMPS not in found.reasons
    assert found.proved_motions == found.motions >= 4, found.left


@pytest.mark.parametrize("language", LOOPS)
def test_a_fault_in_a_loop_is_found(language: str) -> None:
    words = {"heidenhain": ("X+50.47", "X+50.49"), "siemens": ("X50.47", "X50.49"), "fanuc": ("X50.47", "X50.49")}
    found = proved(language, LOOPS[language], words[language])
    assert len(found.faults) == 1, found.faults


def test_a_motion_that_is_another_one_each_time_is_not_proved() -> None:
    found = proved("heidenhain", "LBL 1|L IX+1 F500|CALL LBL 1 REP 6|M30|END PGM A MM")
    assert found.faults == []
    assert found.reasons["a motion with more possible paths than the second reader checks"] == 1
