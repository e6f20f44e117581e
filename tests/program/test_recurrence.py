"""Programs that go round for ever are told at once; those that count are followed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ncfix.control.flow import ENDLESS as CODE
from ncfix.control.flow import MAX_JUMPS_REMEMBERED, NEVER_ENDS, WAITS, Recurrence
from ncfix.control.moves import Moves, Rule
from ncfix.control.setup import Setup, Tool
from ncfix.control.trace import trace
from ncfix.diagnostics import SourceError
from ncfix.text.reader import read

SETUP = Setup(
    work_offsets={name: dict.fromkeys("XYZ", 0.0) for name in ("G54", "G500", "PRESET")},
    tools={number: Tool(0.0, 5.0) for number in range(3)},
    initial=dict.fromkeys("XYZ", 0.0),
    no_point="calculator",
)

ENDLESS = {
    "siemens, a jump": ("siemens", "AA: G0 X1\nR1=3\nGOTOB AA\nM30", 3),
    "siemens, a loop": ("siemens", "LOOP\nG91 G0 X1\nENDLOOP\nM30", 3),
    "siemens, in a subprogram": ("siemens", "SUB\nM30\n%_N_SUB_SPF\nWHILE TRUE\nG0 X1\nENDWHILE\nM17", 6),
    "linuxcnc, do": ("linuxcnc", "o1 do\nG0 X1\no1 while [1]\nM2", 3),
    "linuxcnc, a loop in a loop that counts": (
        "linuxcnc",
        "o1 repeat [3]\no2 while [1]\nG0 X1\no2 endwhile\no1 endrepeat\nM2",
        4,
    ),
    "fanuc, GOTO": ("fanuc", "%\nO1\nN10 G0 X1.\n#1=3.\nGOTO 10\nM30\n%", 5),
    "fanuc, WHILE": ("fanuc", "%\nO1\nWHILE[1 EQ 1]DO1\nG0 X1.\nEND1\nM30\n%", 5),
    "klartext": (
        "heidenhain",
        "0 BEGIN PGM T MM\n1 LBL 1\n2 L X+1 FMAX\n3 Q1 = 2\n4 FN 9: IF +1 EQU +1 GOTO LBL 1\n5 END PGM T MM",
        5,
    ),
}
"""Dialect, program, and the line that jumps back."""

COUNTING = {
    "siemens": ("siemens", "R1=0\nAA: R1=R1+1\nG0 X=R1\nIF R1<500 GOTOB AA\nM30", 500),
    "siemens, sections": ("siemens", "AA: G0 X1\nBB: G0 X2\nREPEAT AA BB P=99\nM30", 200),
    "siemens, calls": ("siemens", "SUB P50\nSUB\nM30\n%_N_SUB_SPF\nGOTOF BB\nAA: G0 X1\nM17\nBB: GOTOB AA", 51),
    "linuxcnc": ("linuxcnc", "o1 repeat [70]\nG0 X1\no1 endrepeat\nM2", 70),
    "linuxcnc, a loop in which the program ends": (
        "linuxcnc",
        "#1=0\no1 repeat [99999999]\nG0 X1\n#1=[#1+1]\no2 if [#1 GE 9]\nM2\no2 endif\no1 endrepeat",
        9,
    ),
    "siemens, left by a jump": (
        "siemens",
        "R1=0\nAA: G0 X1\nG0 Y1\nG0 Z1\nR1=R1+1\nIF R1>8 GOTOF CC\nBB: G0 X2\nREPEAT AA BB P9999\nCC: M30",
        35,
    ),
    "fanuc": ("fanuc", "%\nO1\n#1=0\nWHILE[#1 LT 300]DO1\nG0 X1.\n#1=#1+1\nEND1\nM30\n%", 300),
    "fanuc, calls": ("fanuc", "%\nO1\nM98 P2 L30\nM98 P2\nM30\nO2\nGOTO 3\nN2 G0 X1.\nM99\nN3 GOTO 2\n%", 31),
    "klartext": (
        "heidenhain",
        "0 BEGIN PGM T MM\n1 LBL 1\n2 L X+1 FMAX\n3 CALL LBL 1 REP 60\n4 L X+2 FMAX\n5 END PGM T MM",
        62,
    ),
}
"""Dialect, program, and how many motions it makes."""


def moves_of(dialect: str, text: str) -> Moves:
    program = read(text.encode(), "part", dialect)
    return trace(program, replace(SETUP, most_blocks=20_000), ("X", "Y", "Z"), frozenset()).moves


def test_a_loop_that_waits_for_the_machine_is_not_said_to_be_endless() -> None:
    with pytest.raises(SourceError) as error:
        moves_of("fanuc", "%\nO1\nWHILE[#1000 EQ 0]DO1\nG4 X1.\nEND1\nG0 X1.\nM30\n%")
    assert WAITS in str(error.value)


@pytest.mark.parametrize("name", ENDLESS)
def test_what_never_ends_is_told_at_once(name: str) -> None:
    dialect, text, line = ENDLESS[name]
    with pytest.raises(SourceError) as caught:
        moves_of(dialect, text)
    assert caught.value.code == "NCF233"
    assert NEVER_ENDS in str(caught.value)
    place = caught.value.messages[0].place
    assert place is not None
    assert place.line == line


@pytest.mark.parametrize("name", COUNTING)
def test_what_counts_is_followed(name: str) -> None:
    dialect, text, count = COUNTING[name]
    assert len(moves_of(dialect, text)) == count


def test_a_count_up_without_end_runs_into_the_limit() -> None:
    with pytest.raises(SourceError, match="probably never ends"):
        moves_of("siemens", "R1=0\nAA: R1=R1+1\nGOTOB AA\nM30")


HOLE = "G0 X1. Y1. Z9.\nF100.\n"
TWICE = "0 BEGIN PGM T MM\n1 LBL 1\n2 LBL 2\n3 L X+1\n4 CALL LBL 2 REP {n}\n5 CALL LBL 1 REP {n}\n6 END PGM T MM"
PATTERN = "4 CYCL CALL PAT\n5 CALL LBL 1 REP {n}\n6 END PGM T MM"
DRILL = "1 CYCL DEF 200 DRILLING Q200=2 Q201=-5 Q206=100 Q202=5 Q210=0 Q203=0 Q204=2 Q211=0\n"
HOLES = DRILL + "2 PATTERN DEF ROW1 (X+0 Y+0 D+1 NUM500 ROT+0 Z+0)\n3 LBL 1\n"
REPEATED = {
    "linuxcnc, a cycle": ("linuxcnc", HOLE + "G81 X1 Z1 R2 L{n}\nM2", 4),
    "linuxcnc, a subprogram": ("linuxcnc", "M98 P2 L{n}\nM2\nO2\nM99", 0),
    "linuxcnc, a loop": ("linuxcnc", "o1 repeat [{n}]\no1 endrepeat\nM2", 0),
    "fanuc, a cycle": ("fanuc", f"%\nO1\n{HOLE}G81 X1. Z1. R2. K{{n}}\nM30\n%", 4),
    "fanuc, a subprogram": ("fanuc", "%\nO1\nM98 P2 L{n}\nM30\nO2\nM99\n%", 0),
    "fanuc, a macro": ("fanuc", "%\nO1\nG65 P2 L{n}\nM30\nO2\nM99\n%", 0),
    "siemens, a subprogram": ("siemens", "SUB P{n}\nSUB\nM30\n%_N_SUB_SPF\nM17", 0),
    "siemens, of nothing": ("siemens", "SUB P{n}\nSUB\nM30\n%_N_SUB_SPF\nWORK P{n}\n%_N_WORK_SPF\n", 0),
    "siemens, a section": ("siemens", "AA: G0 X1\nBB: G0 X2\nREPEAT AA BB P={n}\nM30", 8),
    "klartext, a section": ("heidenhain", TWICE, 16),
    "klartext, a pattern": ("heidenhain", "0 BEGIN PGM T MM\n" + HOLES + PATTERN, 2000),
}
"""Dialect, program that repeats something `n` times, and the motions of three times."""


@pytest.mark.parametrize("name", REPEATED)
@pytest.mark.parametrize("times", [25_000, 99_999_999])
def test_repeats_count_as_blocks(name: str, times: int) -> None:
    dialect, text, _ = REPEATED[name]
    with pytest.raises(SourceError) as caught:
        moves_of(dialect, text.format(n=times))
    assert caught.value.code == CODE
    assert "probably never ends" in str(caught.value)


@pytest.mark.parametrize("name", REPEATED)
def test_few_repeats_are_followed(name: str) -> None:
    dialect, text, count = REPEATED[name]
    assert len(moves_of(dialect, text.format(n=3))) == count


def test_a_pattern_of_no_columns_is_none() -> None:
    lines = "2 PATTERN DEF PAT1 (X+0 Y+0 DX+1 DY+1 NUMX0 NUMY999999999 ROT+0 ROTX+0 ROTY+0 Z+0)\n3 CYCL CALL PAT\n"
    assert moves_of("heidenhain", f"0 BEGIN PGM T MM\n{DRILL}{lines}4 END PGM T MM").rule.tolist() == [Rule.REFUSE]


def test_a_large_array_is_not_filled() -> None:
    text = "DEF REAL AR[9999,9999]=REP(5)\nG0 X=AR[1,1]\nM30"
    assert moves_of("siemens", text).rule.tolist() == [Rule.REFUSE]


def test_a_scale_of_zero_is_refused() -> None:
    text = "0 BEGIN PGM T MM\n1 CYCL DEF 11.0 SCALING\n2 CYCL DEF 11.1 SCL 0\n3 L X+1 F9\n4 END PGM T MM"
    assert moves_of("heidenhain", text).rule.tolist() == [Rule.REFUSE]


def test_a_jump_is_another_when_something_has_changed() -> None:
    recurrence = Recurrence()
    assert not recurrence.seen("jump", 1)
    assert not recurrence.seen("other", 1)
    assert not recurrence.seen("jump", 2)
    assert recurrence.seen("jump", 2)


def test_jumps_are_forgotten_when_they_are_many() -> None:
    recurrence = Recurrence()
    assert not any(recurrence.seen(jump, 0) for jump in range(MAX_JUMPS_REMEMBERED + 5))
    assert len(recurrence.made) <= MAX_JUMPS_REMEMBERED
