"""How corrected Klartext looks: what changes, what stays, what is put in."""

from __future__ import annotations

import re

import numpy as np
import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.solve import SelfCheckError
from ncfix.machine import loads
from ncfix.text.reader import read
from ncfix.text.spelling import Spelling
from ncfix.text.writer import apply
from ncfix_heidenhain.klartext.arc_text import PieceOfArc, arc_text, pole_in_force
from ncfix_heidenhain.klartext.writing import NOT_CLOSED
from program.klartext.tnc import KNOWN, THREE, fixed, follow, program


def lines(body: str, **more: object) -> list[str]:
    """The blocks of the corrected program without its first, its stamp and its last."""
    text = fixed(body, **more).text.decode("latin-1").splitlines()  # type: ignore[arg-type]
    return [line for line in text if "ncfix" not in line and " PGM " not in line]


def test_words_keep_their_manner() -> None:
    found = lines("12 L X+100,5 Y50 Z-.25 R0 FMAX M3 ; note\n13 L  X101.  F500")
    assert re.fullmatch(r"12 L X\+100,51\d* Y50[.,]00\d* Z-\.24\d* R0 FMAX M3 ; note", found[0])
    assert re.match(r"13 L  X101\.01\d*  ", found[1])


def test_new_words_have_a_sign_and_the_mark_of_the_program() -> None:
    assert re.search(r" Y\+0,00\d\d| Y-0,00\d\d", lines("L X+100,0 Y+0,0 Z+0,0 FMAX\nL X+300,0 F500")[1])
    assert re.search(r" Y[+-]0\.00\d\d", lines("L X+100.0 Y+0.0 Z+0.0 FMAX\nL X+300.0 F500")[1])


def test_the_stamp_follows_the_first_block() -> None:
    for text in (program("L X+100 FMAX"), b"0 BEGIN PGM 5 MM\r\n1 L X+100 FMAX\r\n2 END PGM 5 MM\r\n"):
        found = fix_program(read(text, "t.h"), THREE, KNOWN, FixOptions(figures=False)).text.splitlines()
        assert found[0] == text.splitlines()[0]
        assert found[1].startswith(b"; ncfix ")


def test_blocks_that_are_put_in_have_the_number_of_theirs() -> None:
    found = lines("10 L X-300 Y+0 Z+0 FMAX\n20 L X+300 F500 M9\n30 L Y+5")
    assert len(found) > 3
    assert all(line.startswith("20 L ") for line in found[1:-1])
    assert [("M9" in line) for line in found[1:-1]] == [False] * (len(found) - 3) + [True]
    assert "F500" in found[1]


def test_an_arc_becomes_one_by_its_radius() -> None:
    found = lines("L X+100 Y+0 Z+0 FMAX\nCC X+100 Y+10\nC X+108.66 Y+5 DR+ F500")
    assert found[1] == "CC X+100 Y+10"
    assert (
        re.fullmatch(r"(CR|CP) .*DR\+ F500", found[-1] if found[-1].startswith("C") else found[2]) or "CP" in found[3]
    )


def test_the_old_pole_comes_back_after_one_that_was_put_in() -> None:
    found = lines("L X+100 Y+0 Z+0 FMAX\nCC X+100 Y+10\nC X+100 Y+20 DR+ F500\nLP PR+5 PA+90")
    poles = [line for line in found if line.startswith("CC")]
    assert poles[0] == "CC X+100 Y+10"
    assert poles[-1] == "CC X+100.0000 Y+10.0000"
    assert len(poles) >= 3


AFTER_CR = (
    "L X+120 Y+0 Z+0 FMAX\nCC X+110,0 Y+10\nCR X+130 Y+10 R+10 DR+ F500\nLBL 1\nLP PR+30 IPA+10\nCALL LBL 1 REP 2"
)


def test_after_an_arc_without_a_pole_the_one_in_force_comes_back() -> None:
    text = fixed(AFTER_CR).text.decode("latin-1")
    assert [line for line in text.splitlines() if line.startswith("CC")][-1] == "CC X+110,0 Y+10"


def test_a_refused_block_that_would_lead_elsewhere_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ncfix_heidenhain.klartext.writing.pole_in_force", lambda source, at: "X+50 Y+50")
    with pytest.raises(SelfCheckError, match="would end at"):
        fixed(AFTER_CR)


def test_an_arc_is_refused_where_nobody_knows_which_pole_comes_back() -> None:
    report = fixed(AFTER_CR.replace("CC X+110,0 Y+10\n", "CC X+110,0 Y+10\nLBL 2\n")).report
    reasons = {each.line: each.reason for each in report.refused}
    assert "which pole was in force" in reasons[5]
    assert "(line 5)" in reasons[2], "the arc begins at its end"


def test_a_pole_that_nobody_relies_on_does_not_come_back() -> None:
    found = lines("L X+120 Y+0 Z+0 FMAX\nCC X+110 Y+10\nCR X+130 Y+10 R+10 DR+ F500\nCC X+1 Y+1\nLP PR+30 PA+10")
    assert [line for line in found if line.startswith("CC X+110")] == ["CC X+110 Y+10"]


BARELY = loads(
    """
    ncfix = 1
    name = "barely"
    topology = "w F X Y Z t"
    least_increment = { linear = 0.0001, rotary = 0.0001 }
    axis.X = { type = "linear", direction = [1, 0, 0] }
    axis.Y = { type = "linear", direction = [0, 1, 0] }
    axis.Z = { type = "linear", direction = [0, 0, 1] }
    tool = { direction = [0, 0, 1], point = [0, 0, 0] }
    effect = [{ name = "EXX", coefficients = [0.005] }, { name = "EYY", coefficients = [-1.3e-5] }]
    """
)
"""A machine that is off by just over half an output step of a program in inches along Y."""


def test_the_end_of_an_arc_with_more_digits_than_the_control_takes() -> None:
    """Rounded, the corrected end is next to the programmed one, which stays; the radius must be of that."""
    body = "L X-0.98267717 Y+1.14173228 FMAX\nCC X-0.41771654 Y+1.14173228\nC X-0.41771654 Y+0.57677165 DR+ F50"
    assert "Y+0.57677165" in fixed(body, BARELY, unit="INCH").text.decode()


DRILL = "CYCL DEF 200 D Q200=2 Q201=-15 Q203=+1 Q204=10\nL X+120 Y+90 Z+50 FMAX\n"


@pytest.mark.parametrize(("end", "refused"), [("X+100.0000 Y+20.0000", 0), ("X+100 Y+20", 1)])
def test_a_full_circle_ends_where_it_begins_to_the_last_digit_or_is_refused(end: str, refused: int) -> None:
    """The control resolves a micrometre, and the motion before the circle names ten times as many places."""
    machine = THREE.replace(least_increment=(0.001, 1e-5))
    body = f"L X+100.0000 Y+20.0000 Z+0 FMAX\nCC X+110 Y+20\nC {end} DR+ F500\nL X+90"
    found = fix_program(read(program(body), "t.h"), machine, KNOWN, FixOptions(tolerance_um=20.0))
    assert [each.reason for each in found.report.refused][1:] == [NOT_CLOSED] * refused
    begin, *_, circle, _, _ = found.text.decode().splitlines()[2:]
    assert [float(word[1:]) for word in circle.split()[1:3]] == [float(word[1:]) for word in begin.split()[1:3]]


def test_a_hole_gets_a_surface_of_its_own_which_is_taken_back() -> None:
    found = lines(DRILL + "7 L X+200 FMAX M99\nL Z+100 FMAX")
    assert re.fullmatch(r"7 FN 1: Q203 = \+Q203 \+ [+-]0\.\d+", found[2])
    assert re.match(r"7 L X\+200\.\d+ .*FMAX M99", found[3])
    assert found[4] == found[2].replace("FN 1", "FN 2").replace("+Q203 +", "+Q203 -")


def test_a_called_cycle_is_positioned_anew_for_its_bottom() -> None:
    tilted = loads(
        """
        name = "leaning"
        topology = "w F X Y Z t"
        axis.X = { type = "linear", direction = [1, 0, 0] }
        axis.Y = { type = "linear", direction = [0, 1, 0] }
        axis.Z = { type = "linear", direction = [0, 0, 1] }
        tool = { direction = [0, 0, 1], point = [0, 0, 0] }
        effect = [{ name = "EXZ", basis = "polynomial", degree = [1], coefficients = [0.001] }]
        """
    )
    found = fixed(DRILL + "CYCL CALL M3", tilted).text.decode().splitlines()
    assert found[3:5] == ["L X+119.95 Y+90 Z+50 FMAX", "L X+120.014 FMAX M99 M3"]


def test_a_departure_goes_on_along_the_corrected_line() -> None:
    body = "L X+120 Y+0 Z+0 FMAX\nL X+140 RL F500\nL X+300 Y+30\nDEP LT LEN20\nL Z+100 R0 FMAX"
    ends = fixed(body).text.decode("latin-1").splitlines()
    assert "DEP LT LEN20" in ends
    straight = body.replace("X+300 Y+30", "X+300")
    assert "DEP LT LEN20" in fixed(straight).text.decode("latin-1").splitlines()


LEADING = [
    ("APPR LT X+100 Y+20 LEN15 RR F100", "APPR LT"),
    ("APPR LN X+100 Y+20 LEN15 RR F100", "APPR LN"),
    ("APPR CT X+100 Y+20 CCA180 R+10 RR F100", "APPR CT"),
    ("APPR LCT X+100 Y+20 R10 RR F100", "APPR LCT"),
    ("APPR PLT PR+100 PA+20 LEN15 RL F100", "APPR LT"),
    ("APPR PLN PR+100 PA+20 LEN10 RL F100", "APPR LN"),
    ("APPR PCT PR+100 PA+20 CCA90 R+10 RL F100", "APPR CT"),
    ("APPR PLCT PR+100 PA+20 R+10 RL F100", "APPR LCT"),
    ("DEP LT LEN12.5 F100", "DEP LT LEN12.5 F100"),
    ("DEP LN LEN+20 F100", "DEP LN LEN+20 F100"),
    ("DEP CT CCA 180 R+8 F100", "DEP CT CCA 180 R+8 F100"),
    ("DEP LCT X+110 Y+12 R8 R0 F100", "DEP LCT"),
    ("DEP PLCT PR+150 PA+10 R8 R0 F100", "DEP LCT"),
]


@pytest.mark.parametrize(("block", "written"), LEADING)
def test_all_ways_to_and_from_a_contour(block: str, written: str) -> None:
    body = f"L X+120 Y-10 Z+0 R0 FMAX\nCC X+0 Y+0\nL X+150 RL F100\n{block}\nL X+90 Y+40\nL X+120 Y+40 R0 FMAX"
    report = fixed(body).report
    found = next(line for line in lines(body) if line.startswith(("APPR", "DEP")))
    assert found.startswith(written)
    assert "PA" not in found
    unknown_after = block.startswith(("DEP LT", "DEP LN", "DEP CT"))
    assert [refusal.line for refusal in report.refused] == ([6] if unknown_after else [])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("L X+1\n", ""),
        ("5 CC X+1,5 Y-2 ; here\n6 L X+1\n", "X+1,5 Y-2"),
        ("CC X+1 Y+2\nCC X+3 Y+4\n", "X+3 Y+4"),
        ("CC X+1 Y+2\nCC\n", None),
        ("CC X+1 Y+2\nCC X+3\n", None),
        ("CC X+1 Y+2\nCC IX+3 Y+4\n", None),
        ("CC X+1 Y+2\nCC X+Q1 Y+4\n", None),
        ("CC X+1 Y+2\nLBL 3\n", None),
        ("CC X+1 Y+2\n7 CALL PGM A.H\n", None),
        ("CC X+1 Y+2\n7 FN 9: IF +Q1 EQU +0 GOTO LBL 5\n", "X+1 Y+2"),
    ],
)
def test_the_pole_in_force_by_the_text(text: str, words: str | None) -> None:
    assert pole_in_force(text.encode(), len(text)) == words


def test_polar_lines_become_cartesian() -> None:
    found = lines("L X+100 Y+0 Z+0 FMAX\nCC X+100 Y+10\nLP PR+10 PA+0 F500\nLP IPA+45")
    assert re.fullmatch(r"L X\+110\.01\d* Y\+10\.00\d*.* F500", found[2])
    assert not any("PA" in line for line in found)


@pytest.mark.parametrize("body", ["L Z+100 FMAX M91", "CC X+1 Y+1", "TOOL CALL 3 Z S500", "LBL 5\nLBL 0"])
def test_what_does_not_move_in_the_workpiece_keeps_its_bytes(body: str) -> None:
    text = program("L X+100 Y+0 Z+0 FMAX\n" + body)
    found = fix_program(read(text, "t.h"), THREE, KNOWN, FixOptions(figures=False)).text
    assert all(line.encode() in found for line in body.splitlines())


def test_a_corner_gets_no_word_of_the_tool_axis() -> None:
    found = lines("L X+0 Y+0 Z+0 FMAX\nL X+100 F500\nRND R5\nL Y+150\nL X+0")
    assert "Z" not in found[1]
    assert "Z" not in found[3]
    assert found[2] == "RND R5"


def test_a_repeated_section_is_refused() -> None:
    report = fixed("L X+0 Y+0 Z+0 FMAX\nLBL 1\nL IX+50 F100\nL Y+20\nCALL LBL 1 REP 3").report
    assert {refusal.code for refusal in report.refused} == {"NCF433"}


def test_without_a_correction_nothing_changes() -> None:
    text = program("L X+1 ;note~\nand more\n7 C X5,0")
    assert apply(read(text, "t.h").source, []) == text


def test_a_corrected_program_is_not_corrected_again() -> None:
    once = fixed("L X+100 Y+0 Z+0 FMAX")
    assert once.changed
    assert follow("L X+100 Y+0 Z+0 FMAX").stamp == ""
    from ncfix.diagnostics import RefusedError

    with pytest.raises(RefusedError, match="NCF430"):
        fix_program(read(once.text, "t.h"), THREE, KNOWN)


@pytest.mark.parametrize(
    ("choice", "numbers"), [("same", ["10", "20", "20", "20"]), ("none", ["10", "20", "L", "L"]), ("renumber", [])]
)
def test_block_numbers_as_asked_for(choice: str, numbers: list[str]) -> None:
    text = b"5 BEGIN PGM T MM\n10 L X-300 Y+0 Z+0 FMAX\n20 L X+300 F500\n\n/7 L Y+5\n9 END PGM T MM\n"
    options = FixOptions(block_numbers=choice, figures=False)
    found = fix_program(read(text, "t.h"), THREE, KNOWN, options).text.decode().splitlines()
    moves = [line.split()[0] for line in found if " L " in f" {line}"]
    if choice == "renumber":
        assert [int(line.removeprefix("/").split()[0]) for line in found if line] == list(range(len(found) - 1))
        assert found[-2].startswith("/")
    else:
        assert moves[:4] == numbers


@pytest.mark.parametrize(
    ("radius", "degrees"), [(3.0, 90.0), (12.0, -270.0), (250.0, 359.0), (8000.0, 0.7), (40.0, 1080)]
)
def test_an_angle_of_as_many_digits_as_a_control_takes_leads_to_the_end(radius: float, degrees: float) -> None:
    """0.0001 degrees are 14 um on a radius of 8 m: the pole is chosen so that they lead there all the same."""
    turn = np.radians(degrees)
    begin, middle = np.array([7.1234, -3.4321, 5.0]), np.array([7.1234 - radius, -3.4321, 5.0])
    end = middle + radius * np.array([np.cos(turn), np.sin(turn), 0.0]) + [0, 0, 2.0]
    arc = PieceOfArc(begin, end, middle, (0, 1, 2), (0, 1, 2), degrees < 0, turn, np.full(3, 4))
    text = arc_text(arc, Spelling(signed=True))
    assert text.function == "CP"
    assert len(text.words[0].partition(".")[2]) <= 4
    off = radius * 1e-4 * np.pi / 360 if abs(degrees) > 180 else 0.0
    assert np.hypot(*(text.end - end)[:2]) < 2e-4 + off
    assert np.hypot(*(text.centre - middle)[:2]) * (1 - np.cos(turn / 2)) < 3e-4


def test_rounded_ends_of_a_nearly_full_circle_do_not_lead_its_pole_astray() -> None:
    """Ends on 0.001 mm are equally far only from a place 2.3 um aside; that takes the other side off by twice as much.

    Half a step along both axes, 0.71 um, is what each end may be off; the pole gives about as much to either side.
    """
    begin, end = np.array([-79.002, -59.446, 3.001]), np.array([-78.390, -58.062, 1.237])
    middle = np.array([-81.72646, -57.41652, 3.0])
    arc = PieceOfArc(begin, end, middle, (0, 1, 2), (0, 1, 2), True, np.radians(-334.27), np.full(3, 3))
    text = arc_text(arc, Spelling(signed=True))
    assert 2 * np.hypot(*(text.centre - middle)[:2]) < 1e-3
    assert np.hypot(*(text.end - end)[:2]) < 1e-3
