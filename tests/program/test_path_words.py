"""A block with a word that leads somewhere makes a motion, gives the word to a setting, or is refused: in one place."""

from __future__ import annotations

import pytest

from ncfix.control.control import ProgramControl
from ncfix.control.interpreter import Interpreter
from ncfix.control.moves import Rule
from program.tracing import follow

REFUSED = "ncfix does not know what the control does with the word {} in this block"
HEADS = {
    "fanuc": "G21G17G90G40G49G80G94\nG54G0X0.Y0.Z10.\nG1F100.\n",
    "iso": "G21G17G90G40G49G80G94\nG54G0X0.Y0.Z10.\nG1F100.\n",
    "siemens": "G17 G90 G71 G54\nT1 D1\nG0 X0 Y0 Z10\nG1 F100\n",
}


@pytest.mark.parametrize(
    ("dialect", "block", "word"),
    [
        ("fanuc", ",A30.", ",A"),
        ("fanuc", "G4Y40.", "Y"),
        ("fanuc", "G2X10.R20.\nR25.", "R"),
        ("iso", "G4Y40.", "Y"),
        ("siemens", "G4 X30", "X"),
    ],
)
def test_a_word_that_leads_somewhere_is_never_passed_over(dialect: str, block: str, word: str) -> None:
    text = f"{HEADS[dialect]}{block}\nG1 X1. Y2.\nM30\n"
    moves = follow(text, dialect=dialect, no_point="calculator", assume_zero=True).moves
    line = HEADS[dialect].count("\n") + block.count("\n")
    rows = [row for row, block in enumerate(moves.block.tolist()) if block == line]
    assert moves.rule[rows[-1]] == Rule.REFUSE
    assert moves.reasons[moves.reason[rows[-1]]] == REFUSED.format(word)


@pytest.mark.parametrize("dialect", ["fanuc", "iso"])
@pytest.mark.parametrize("block", ["G80X5.", "G81X1.Z-5.R2.\nG80Z50."])
def test_a_word_beside_g80_needs_a_motion_code(dialect: str, block: str) -> None:
    moves = follow(f"{HEADS[dialect]}{block}\nG1 X1. Y2.\nM30\n", dialect=dialect, assume_zero=True).moves
    refused = [moves.reasons[moves.reason[row]] for row in range(len(moves)) if moves.rule[row] == Rule.REFUSE]
    assert refused[0].endswith("program G0 or G1 in the block")
    coded = follow(f"{HEADS[dialect]}{block.replace('G80', 'G0G80')}\nG1 X1. Y2.\nM30\n", dialect=dialect).moves
    assert (coded.rule != Rule.REFUSE).all()


def test_a_radius_without_an_end_is_refused_as_a_word_that_is_not_taken() -> None:
    text = f"{HEADS['siemens']}CR=25\nX1 Y2\nM30\n"
    moves = follow(text, dialect="siemens", assume_zero=True).moves
    refused = [moves.reasons[moves.reason[row]] for row in range(len(moves)) if moves.rule[row] == Rule.REFUSE]
    assert refused[0].startswith("G1 does not allow the word CR")


@pytest.mark.parametrize(
    ("dialect", "block"),
    [
        ("fanuc", "G92X0.Y0."),
        ("fanuc", "G52X1.Y2."),
        ("fanuc", "G10L2P1X1.Y2.Z3."),
        ("fanuc", "G4X2."),
        ("fanuc", "G5.1Q2X0Y0Z0"),
        ("fanuc", "G51.1X0."),
        ("fanuc", "G65P9000X1.Y2.\nM30\nO9000\nM99"),
        ("fanuc", "G81X1.Z-5.R2.K0"),
        ("fanuc", "I20."),
        ("linuxcnc", "G21 G17 G90 G94 F100 G1 X1 Y1\nG92 X0"),
        ("linuxcnc", "G21 G17 G90 G94 F100 G1 X1 Y1\nG43.1 Z5"),
        ("linuxcnc", "G21 G17 G90 G94 F100 G1 X1 Y1\nG10 L2 P1 X1 R10"),
        ("siemens", "TRANS X10 Y20"),
        ("siemens", "G110 X5 Y5"),
        ("siemens", "I20"),
        ("heidenhain", "TOOL CALL 0 Z S1000\nL X+1 Y+2 Z+3 R0 FMAX\nCC X+5 Y+5"),
        ("heidenhain", "TOOL CALL 0 Z S1000\nL X+1 Y+2 Z+3 R0 FMAX\nCYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+5"),
    ],
)
def test_settings_take_their_words(dialect: str, block: str) -> None:
    head, end = HEADS.get(dialect, ""), "M30"
    if dialect == "heidenhain":
        head, end = "BEGIN PGM T MM\n", "END PGM T MM"
    moves = follow(f"{head}{block}\n{end}\n", dialect=dialect, no_point="calculator", assume_zero=True).moves
    assert not [reason for reason in moves.reasons if reason.startswith("ncfix does not know what")]


@pytest.mark.parametrize("language", ["fanuc", "siemens", "heidenhain"])
def test_where_the_axes_stand_behind_it_is_not_known(language: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """An interpreter that forgets a motion: the block is named, and what counts from its end is refused."""
    lines = {
        "fanuc": f"{HEADS['fanuc']}X5.\nG91X1.\nM30\n",
        "siemens": f"{HEADS['siemens']}X5\nG91 X1\nM30\n",
        "heidenhain": "BEGIN PGM T MM\nTOOL CALL 0 Z S1000\nL X+0 Y+0 Z+9 R0 FMAX\nL X+5 F100\nL IX+1\nEND PGM T MM\n",
    }
    make = ProgramControl.make
    monkeypatch.setattr(Interpreter, "take_stretch", lambda self, plan: False)

    def forgetful(control: ProgramControl, motion: object) -> None:
        if control.row_block != FORGOTTEN[language] or not control.block_words:
            make(control, motion)  # type: ignore[arg-type]

    monkeypatch.setattr(ProgramControl, "make", forgetful)
    moves = follow(lines[language], dialect=language, no_point="calculator", assume_zero=True).moves
    ends = [(int(moves.block[row]), int(moves.rule[row])) for row in range(len(moves))]
    assert ends[-2:] == [(FORGOTTEN[language], Rule.REFUSE), (FORGOTTEN[language] + 1, Rule.REFUSE)]


FORGOTTEN = {"fanuc": 3, "siemens": 4, "heidenhain": 3}
