"""What the second reader takes for known where a program begins: axes that it never names, sides of play, cycles."""

from __future__ import annotations

import pytest

from certificate.planting import machine
from ncfix.certificate.coordinates import Given
from ncfix.certificate.findings import BlockProof
from ncfix.certificate.proof import prove
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_flat, fix_program
from ncfix.control.setup import Setup, Tool
from ncfix.text.dialect import get
from ncfix.text.reader import read


def proof_of(text: bytes, name: str, initial: dict[str, float], dialect: str = "linuxcnc") -> BlockProof:
    """The proof of the correction of a program on a machine of the goldens."""
    setup, given = Setup(initial=initial, assume_zero=True), Given(initial=initial, assume_zero=True)
    options = FixOptions(figures=False, allow_refused=True)
    known = machine(name)
    fixed = fix_program(read(text, "part", get(dialect)), known, setup, options).text
    return prove(text, fixed, known, given, dialect)


LINES = b"G21 G90 G17 G40\nG0 X10. Y20. Z30.\nG1 X15. Y10. Z5. F300.\nX-20.\nY-3.\nG2 X-10. Y7. I10. J0.\nM30\n"


@pytest.mark.parametrize("name", ["three", "table", "head"])
def test_rotary_axes_that_a_program_never_names_do_no_harm(name: str) -> None:
    proof = proof_of(LINES, name, {})
    assert (proof.faults, proof.unproved, proof.proved_motions) == ([], 0, 5)


def test_axes_with_play_that_have_not_moved_are_in_the_middle() -> None:
    lines = LINES[: LINES.index(b"G2 ")] + b"M30\n"
    known = proof_of(lines, "play", {"X": 0.0, "Y": 0.0, "Z": 200.0})
    assert known.faults == []
    assert [*known.reasons] == ["the path of a motion: backlash"]  # where an axis turns round
    assert proof_of(lines, "play", {}).faults == []


def test_an_arc_that_ends_where_an_axis_turns_round_is_not_called_faulty() -> None:
    text = b"G21 G90 G17\nG0 X10. Y0. Z5.\nG1 Y-5. F200.\nG3 X15. Y0. I0. J5.\nG1 X15. Y10.\nM30\n"
    assert proof_of(text, "play", {"X": 0.0, "Y": 0.0, "Z": 200.0}).faults == []


def test_an_axis_with_play_comes_out_of_a_hole_the_other_way_than_it_went_in() -> None:
    text = b"G21 G90 G17\nG0 X1. Y1. Z20.\nG99 G81 X10. Y5. Z-4. R2. F100.\nX20.\nG80\nG1 X30.\nY9.\nM30\n"
    proof = proof_of(text, "play", {"X": 0.0, "Y": 0.0, "Z": 200.0}, "iso")
    assert proof.faults == []
    assert proof.proved_motions >= 4


def test_where_a_cycle_goes_back_to_is_not_guessed() -> None:
    text = b"G21 G90 G17\nG0 X0 Y0 Z20\n%sG81 X10 Y5 Z-4 R2 F100\nX20\nG80\nG1 X0\nM2\n"
    assert proof_of(text % b"", "table", {}).reasons["the position of an axis is not known"] == 1
    for code in (b"G98 ", b"G99 "):
        proof = proof_of(text % code, "table", {})
        assert (proof.faults, proof.unproved) == ([], 0)


def test_a_repeated_cycle_that_is_written_out_is_no_fault() -> None:
    text = (
        b"G21 G90 G17 G80\nG0 X0. Y0. Z20.\nG99 G81 X5. Y5. Z-5. R2. F100.\nG91 X20. L3\nG90 G80\nG0 X3. Y1. Z20.\nM2\n"
    )
    known, setup = machine("three"), Setup(assume_zero=True)
    flat = fix_flat(read(text, "part", get("linuxcnc")), known, setup, FixOptions(figures=False, flatten=True)).text
    assert flat.count(b"\n") > text.count(b"\n") + 2
    proof = prove(text, flat, known, Given(assume_zero=True), "linuxcnc")
    assert (proof.faults, proof.proved_motions) == ([], 3)


def test_full_circles_end_within_the_tolerance_and_inches_to_the_digit_of_the_control() -> None:
    text = b"G20 G90 G17\nG0 X1.5 Y0.25 Z0.5\nG1 X1.00000000 Y0.50000000 F10.\nG2 Z0.5 I0.25 J0.\nG1 X2.\nM2\n"
    proof = proof_of(text, "table", {})
    assert (proof.faults, proof.unproved) == ([], 0)


@pytest.mark.parametrize("words", ["G5.1 Q1 R5", "G5.1 Q2 X0 Y0 Z0", "G5.1Q3X0Y0Z0A0C0", "G05 P10000", "G5.1 Q0"])
def test_what_smooths_the_path_moves_nothing(words: str) -> None:
    text = LINES.replace(b"G1 X15.", words.encode() + b"\nG1 X15.")
    proof = proof_of(text, "table", {}, "fanuc")
    assert (proof.faults, proof.unproved, proof.proved_motions) == ([], 0, 5)


KLARTEXT = """0 BEGIN PGM A MM
1 CYCL DEF 247 DATUM SETTING ~
    Q339=+1 ;DATUM NUMBER
2 TOOL CALL "FR10" Z S8000
3 FN 0: Q1=+1200
4 CYCL DEF 32.0 TOLERANCE
5 CYCL DEF 32.1 T0.02
6 M126
7 L X+10 Y+20 Z+50 A-10 C+0 R0 FMAX M3
8 {on}
9 L X+10 Y+20 Z+5 FMAX M107
10 L X+15 Y+10 Z+2 A-12 C+20 FQ1
11 M120 LA20
12 L X-20 Y-3.5 A-14 C+40 F AUTO
13 L Z+50 FMAX
14 {off}
15 M30
16 END PGM A MM
"""
TIP = {"on": "M128", "off": "M129"}


def klartext_proof(text: str, change: tuple[str, str] = ("", "")) -> BlockProof:
    """The proof of the correction of a Klartext program, in which something is changed behind it."""
    initial = dict.fromkeys("XYZAC", 0.0)
    offsets, length = {"PRESET1": {"X": 5.0, "Y": 0.0, "Z": 40.0}}, 90.0
    setup = Setup(work_offsets=offsets, named_tools={"FR10": Tool(length)}, initial=initial)
    known, options = machine("table"), FixOptions(figures=False)
    fixed = fix_program(read(text.encode(), "part", get("heidenhain")), known, setup, options).text.decode()
    assert change[0] in fixed
    given = Given(offsets=offsets, tools={"FR10": length}, initial=initial)
    return prove(text.encode(), fixed.replace(*change).encode() if change[0] else fixed.encode(), known, given)


@pytest.mark.parametrize(
    "words", [TIP, {"on": "FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS", "off": "FUNCTION RESET TCPM"}]
)
def test_what_cam_systems_write_in_klartext_is_followed(words: dict[str, str]) -> None:
    proof = klartext_proof(KLARTEXT.format(**words))
    assert (proof.faults, dict(proof.reasons), proof.proved_motions) == ([], {}, 5)
    assert klartext_proof(KLARTEXT.format(**words), ("A-14", "A-14.01")).faults


@pytest.mark.parametrize(
    ("line", "instead", "reason"),
    [
        ("Q339=+1", "Q339=+Q5", "the position of an axis is not known"),
        ("S8000", "S8000 DL+QL1", "a tool call without a tool or an oversize that the second reader knows"),
        (
            "S8000",
            "S8000 DL+0.1\nTOOL CALL S9000",
            "a tool call without a tool or an oversize that the second reader knows",
        ),
        ("M120 LA20", "TOOL CALL DL+0.1", "another tool under tool-centre-point control (M128, TCPM)"),
        ("C+20 FQ1", "C+220 FQ1", "a rotary axis takes the shorter path (M126)"),
    ],
)
def test_what_is_not_followed_in_klartext_is_not_proved(line: str, instead: str, reason: str) -> None:
    text = KLARTEXT.format(on="FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS", off="FUNCTION RESET TCPM")
    given = Given(offsets={"PRESET1": {}}, tools={"FR10": 90.0}, initial=dict.fromkeys("XYZAC", 0.0))
    changed = text.replace(line, instead).encode()
    proof = prove(changed, changed, machine("table"), given)
    assert reason in proof.reasons


def test_a_tool_that_turns_in_a_plane_is_proved_where_it_does_not_turn_and_at_the_ends() -> None:
    text = KLARTEXT.format(on="FUNCTION TCPM F TCP AXIS POS PATHCTRL VECTOR", off="FUNCTION RESET TCPM")
    proof = klartext_proof(text)
    ways = {"the path of a motion in which the tool turns in a plane (PATHCTRL VECTOR)": 2}
    assert (proof.faults, dict(proof.reasons), proof.proved_motions) == ([], ways, 3)
    assert klartext_proof(text, ("A-14", "A-14.01")).faults


def test_an_oversize_is_added_to_the_length_of_the_tool() -> None:
    text = KLARTEXT.format(**TIP).replace("S8000", "S8000 DL-0.25 DR+0.1")
    proof = klartext_proof(text)
    assert (proof.faults, dict(proof.reasons), proof.proved_motions) == ([], {}, 5)
    assert klartext_proof(text, ("DL-0.25", "DL-0.26")).faults


SIEMENS = """N10 DEF REAL _X_HOME, _Z_HOME
N20 _X_HOME=0 _Z_HOME=300
N30 G17 G71 G94 G90
N40 SUPA G0 Z=_Z_HOME D0
N50 SUPA X=_X_HOME Y=0
N60 T1 D1 M6
N70 G54
N80 CYCLE800()
N90 G0 X16 Y11 Z60 A0 C0
N100 TRAORI
N110 G1 X0 Y30 Z20 A0 C0 F100
N120 X-50 A-70 C{c}
N130 TRAFOOF
N140 SUPA G0 Z=_Z_HOME D0
N150 M30
"""


@pytest.mark.parametrize("c", [-120, -200])
def test_what_posts_of_sinumerik_write_is_followed_and_half_turns_need_not_be_split(c: int) -> None:
    known, start = machine("table"), dict.fromkeys("XYZAC", 0.0)
    setup = Setup(work_offsets={"G54": {}}, tools={1: Tool(80.0)}, initial=start, assume_zero=True)
    text = SIEMENS.format(c=c).encode()
    options = FixOptions(figures=False, allow_refused=True)
    fixed = fix_program(read(text, "part", get("siemens")), known, setup, options).text
    given = Given(offsets={"G54": {}}, tools={1: 80.0}, initial=start, assume_zero=True)
    proof = prove(text, fixed, known, given, "siemens")
    rolls = {"a rotary axis may turn in the other direction": 1} if c < -180 else {}
    assert (proof.faults, dict(proof.reasons), proof.motions) == ([], rolls, 6)
    assert prove(text, fixed.replace(b"Z=_Z_HOME", b"Z=_X_HOME", 1), known, given, "siemens").faults


def test_between_a_tool_change_and_the_next_length_offset_nothing_is_called_faulty() -> None:
    text = (
        b"G21 G90 G17 G54\nT1 M6\nG0 X10. Y20. A0. C0.\nG43 H1 Z30.\nG1 Z5. F300.\nG0 Z30.\nT2 M6\n"
        b"G0 X-20. Y5. A-30. C90.\nG43 H2 Z30.\nG1 X15. Y10. Z5.\nG0 Z30.\nM30\n"
    )
    initial = dict.fromkeys("XYZAC", 0.0)
    setup = Setup(work_offsets={"G54": {}}, tools={1: Tool(120.0), 2: Tool(60.0)}, initial=initial)
    given = Given(offsets={"G54": {}}, tools={1: 120.0, 2: 60.0}, initial=initial)
    fixed = fix_program(read(text, "part", get("fanuc")), machine("table"), setup, FixOptions(figures=False)).text
    proof = prove(text, fixed, machine("table"), given, "fanuc")
    assert (proof.faults, proof.lines("the length of the tool is not known")) == ([], [8])


def test_a_sinumerik_begins_with_the_first_edge_of_the_tool_in_the_spindle() -> None:
    text = b"G71 G90 G17 G94\nG0 X-20 Y20\nG0 Z26\nG1 Z20 F100\nM30\n"
    initial, known = {"X": 0.0, "Y": 0.0, "Z": 250.0}, machine("three")
    setup = Setup(initial=initial, work_offsets={"G500": {}}, tools={0: Tool(length=80.0)})
    fixed = fix_program(read(text, "part", get("siemens")), known, setup, FixOptions(figures=False)).text
    proof = prove(text, fixed, known, Given(initial=initial, tools={0: 80.0}), "siemens")
    assert (proof.faults, proof.proved_motions) == ([], 3)


def test_a_pole_that_is_put_back_behind_a_circle_belongs_to_the_circle() -> None:
    blocks = ["BEGIN PGM A MM", "TOOL CALL 1 Z S900", "L X+10 Y+10 Z+5 R0 FMAX", "CC X+0 Y+10", "L Z-1 F200"]
    blocks += ["CP IPA+360 DR+", "L X+10.5 Y+11", "L Z+20", "CP IPA+90 DR+", "L X+2", "END PGM A MM"]
    text = "".join(f"{number} {block}\n" for number, block in enumerate(blocks)).encode()
    proof = proof_of(text, "three", {"X": 0.0, "Y": 0.0, "Z": 200.0}, "heidenhain")
    assert proof.faults == []


def test_a_surface_normal_is_not_followed_and_all_behind_it_is() -> None:
    text = (
        b"0 BEGIN PGM A MM\n1 TOOL CALL 1 Z S8000\n2 L X+0 Y+0 Z+90 A+0 C+0 R0 FMAX\n3 M128\n"
        b"4 L X+10 Y+5 Z+2 A+5 C+40 F900\n"
        b"5 LN X+12 Y+6 Z+2 NX+0.1 NY+0 NZ+0.995\n6 L X+14 Y+6 Z+2.5 A+6 C+44\n7 L X+55 Y+3 Z+2 A+9 C+80\n"
        b"8 L Z+90 R0 FMAX M30\n9 END PGM A MM\n"
    )
    proof = proof_of(text, "table", {}, "heidenhain")
    assert (proof.faults, proof.motions, proof.proved_motions) == ([], 6, 4)
    assert "surface normal" in proof.left[6]
    assert sorted(proof.left) == [6, 7]  # pieces may belong to either


def test_pieces_of_a_motion_with_a_direction_of_the_tool_are_its_own() -> None:
    blocks = ["BEGIN PGM A MM", "TOOL CALL 1 Z S8000", "L X+0 Y+0 Z+90 A+0 C+0 R0 FMAX", "M128"]
    blocks += ["L X+10 Y+5 Z+2 A+5 C+40 F900", "LN X+130 Y+200 Z+2 TX+0.3 TY+0.2 TZ+0.9", "CC X+130 Y+190"]
    blocks += ["C X+140 Y+190 DR-", "L IX+5 IC+5", "M129", "L Z+90 R0 FMAX M30", "END PGM A MM"]
    text = "".join(f"{number} {block}\n" for number, block in enumerate(blocks)).encode()
    assert proof_of(text, "table", {}, "heidenhain").faults == []


def test_an_end_of_the_program_that_is_lost_is_a_fault() -> None:
    text = b"%\nO1(A)\nG21 G90 G17\nG0 X1. Y2. Z9.\nG1 X5. F300.\nM30\n%\n"
    known, setup, given = machine("three"), Setup(assume_zero=True), Given(assume_zero=True)
    fixed = fix_program(read(text, "part", get("fanuc")), known, setup, FixOptions(figures=False)).text
    assert prove(text, fixed, known, given, "fanuc").faults == []
    for lost in (b"M30\n", b"M30\n%\n", b"\n%\n"):
        assert prove(text, fixed.replace(lost, b"\n" if lost[:1] == b"\n" else b""), known, given, "fanuc").faults
