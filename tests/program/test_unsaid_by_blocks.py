"""What a block does not say, or says twice, is asked for, said, or refused; never guessed."""

from __future__ import annotations

from pathlib import Path

import pytest

import ncfix
from ncfix.compensate.following import kinematics_of
from ncfix.control.moves import Moves, Rule
from ncfix.control.setup import Setup, Tool
from ncfix.control.trace import trace
from ncfix.diagnostics import SourceError
from ncfix.machine import load
from ncfix.text.dialect import detect
from ncfix.text.reader import read
from program.siemens.following import KNOWN as SINUMERIK
from program.siemens.following import follow as on_sinumerik
from program.tracing import KNOWN, ends, follow, reasons

MACHINES = Path(__file__).parents[2] / "examples/machines"
THREE_AXES, FIVE_AXES = MACHINES / "three_axis.toml", MACHINES / "wCAYFXZSt.toml"
SETUP = Setup(
    work_offsets={"G54": dict.fromkeys("XYZAC", 0.0)},
    tools={1: Tool(80.0, 5.0)},
    initial=dict.fromkeys("XYZAC", 0.0),
    no_point="calculator",
)


def on_five_axes(text: str, dialect: str) -> Moves:
    """The motions of a program on a machine with two rotary tables."""
    machine = load(str(FIVE_AXES))
    program = read(text.encode(), "part", dialect)
    return trace(program, SETUP, machine.axis_names, frozenset("AC"), kinematics=kinematics_of(machine)).moves


@pytest.mark.parametrize(("dialect", "unknown"), [("iso", True), ("fanuc", True), ("linuxcnc", False)])
def test_a_variable_that_was_never_set_has_no_value_but_in_linuxcnc(dialect: str, unknown: bool) -> None:
    found = follow("G21 G0 X[#150+1] Y2.\nX3. Y3. Z1.", dialect=dialect)
    assert (found.moves.rule.tolist()[0] == Rule.REFUSE) == unknown
    assert ("NCF244" in [each.code for each in found.messages]) == unknown
    given = follow("G21 G0 X[#150+1] Y2.\nX3. Y3. Z1.", dialect=dialect, variables={"#150": 4.0})
    assert ends(given)[0][:2] == [5.0, 2.0]


@pytest.mark.parametrize("dialect", ["iso", "fanuc", "haas"])
def test_k_beside_m98_is_not_passed_over(dialect: str) -> None:
    with pytest.raises(SourceError) as caught:
        follow("O1\nG21 G0 X1.\nM98 P2 K3\nM30\nO2\nG91 X1.\nM99", dialect=dialect)
    assert caught.value.code == "NCF242"


@pytest.mark.parametrize(
    ("line", "harmless"),
    [
        *((line, True) for line in ("$X", "$$", "$10=3", "$N0=G54", "$ (help)", "$PART.MIN%")),
        *((line, False) for line in ("$1 G0 X5", "$100=250", "$RST=#", "$C", "$SD/Run=a.nc")),
    ],
)
def test_only_commands_of_grbl_that_change_no_place_are_passed(line: str, harmless: bool) -> None:
    found = follow(f"G21 G0 X1 Y1 Z1\n{line}\nG0 X2", dialect="iso")
    assert found.moves.rule.tolist() == [Rule.CORRECT, Rule.CORRECT if harmless else Rule.REFUSE]
    assert ("NCF228" in [each.code for each in found.messages]) != harmless


@pytest.mark.parametrize("dialect", ["fanuc", "mitsubishi"])
def test_an_arc_with_radius_and_centre_goes_by_its_radius(dialect: str) -> None:
    text = "G21 G17 G0 X0. Y0. Z0.\nG2 X10. Y0. R{} F100.{}"
    both, alone = (follow(text.format(13.0, own), dialect=dialect).moves for own in (" I5. J-12.1", ""))
    assert both.centre[1].tolist() == alone.centre[1].tolist()
    with pytest.raises(SourceError):
        follow(text.format(13.0, " I5. J-12."), dialect="haas")


def test_mirror_images_of_haas() -> None:
    found = follow("G21 G0 X10. Y5. Z0.\nG101 X0.\nX10. Y6.\nG100\nX10. Y7.\nG107\nX11. Y7.", dialect="haas")
    assert [row[0] for row in ends(found)] == [10.0, -10.0, 10.0, 11.0]
    assert set(found.moves.rule.tolist()) == {Rule.CORRECT}
    for code, again in (("G101 X5.", "G100"), ("G107 X0. R20.", "G107")):
        found = follow(f"G21 G0 X10. Y5. Z0.\n{code}\nX10. Y6.\n{again}\nX10. Y7. Z1.", dialect="haas")
        assert found.moves.rule.tolist() == [Rule.CORRECT, Rule.REFUSE, Rule.CORRECT], reasons(found)


@pytest.mark.parametrize(
    ("dialect", "code", "said"),
    [
        *(("iso", code, code != "") for code in ("G20", "G21", "")),
        *(("linuxcnc", code, code != "") for code in ("G21", "")),
        *(("siemens", code, code != "") for code in ("G70", "G71", "G700", "G710", "")),
    ],
)
def test_a_program_that_names_no_unit_is_remarked_on(dialect: str, code: str, said: bool) -> None:
    setup = SINUMERIK if dialect == "siemens" else KNOWN
    program = read(f"{code}\nG54\nG1 X1 Y1 F100\nM30\n".encode(), "part", dialect)
    messages = trace(program, setup, tuple("XYZ"), frozenset()).messages
    assert ([each.code for each in messages] == []) == said
    assert {each.code for each in messages} <= {"NCF215"}


TURNS = {
    "siemens": ("T1 D1\nTRAORI\nG54\n{}\nG1 X0 Y0 Z50 A0 C0 F500\nX30 A40 C80\nX40 A40 C81\n", "{}"),
    "fanuc": ("G43.4 H1 {}\nG1 X0 Y0 Z50 A0 C0 F500\nX30 A40 C80\nX40 A40 C81\n", "{}"),
}


@pytest.mark.parametrize(
    ("dialect", "code", "in_plane"),
    [
        *(("siemens", code, True) for code in ("ORIVECT", "ORIPLANE", "ORIWKS", "ORIWKS\nORIVECT")),
        *(("siemens", code, False) for code in ("", "ORIAXES", "ORIMKS", "ORIWKS\nORIAXES")),
        *(("fanuc", code, code == "P1") for code in ("", "P0", "P1")),
    ],
)
@pytest.mark.parametrize("many", [0, 40])
def test_a_turn_in_a_plane_is_not_split_where_axes_that_turn_evenly_would_leave_it(
    dialect: str, code: str, in_plane: bool, many: int
) -> None:
    """Of many blocks, too, which go through the fast lane."""
    body = TURNS[dialect][0].format(code)
    more = "".join(f"X{40 + k / 8} Y{k / 8}\n" for k in range(many))
    moves = on_five_axes(f"G90\n{body}{more}A20 C20\nM30\n", dialect)
    assert moves.whole.nonzero()[0].tolist() == ([1, 3 + many] if in_plane else [])


def test_another_tip_control_than_is_known_is_refused() -> None:
    moves = on_five_axes("G90 G21\nG43.4 H1 P3\nG1 X0 Y0 Z50 A0 C0 F500\nG49\nM30\n", "fanuc")
    assert moves.rule.tolist() == [Rule.REFUSE]


@pytest.mark.parametrize(
    ("dialect", "text", "stops"),
    [
        ("siemens", "G60\nG1 X1 F100\nG64\nX2\nG60 X3\nG642 X4", [True, False, True, False]),
        ("fanuc", "G61\nG1 X1. F100.\nG64\nX2.", [True, False]),
        ("iso", "G61\nG1 X1 F100\nG64\nX2", [True, False]),
        ("linuxcnc", "G61\nG1 X1 F100\nG61.1\nX2\nG64\nX3", [False, True, False]),
    ],
)
def test_exact_stops_are_known_of_each_motion(dialect: str, text: str, stops: list[bool]) -> None:
    program = read(f"{text}\nM30\n".encode(), "part", dialect)
    moves = trace(program, KNOWN if dialect != "siemens" else SINUMERIK, tuple("XYZ"), frozenset()).moves
    assert moves.exact_stop.tolist() == stops


@pytest.mark.parametrize(
    ("path", "control", "found"),
    [
        ("PART.MPF", "fanuc", "siemens"),
        ("part.ngc", "siemens", "linuxcnc"),
        ("part.fnc", "mitsubishi", "mitsubishi"),
        ("part.nc", "fanuc", "fanuc"),
        ("part", "haas", "haas"),
        ("part.tap", "", "iso"),
    ],
)
def test_a_suffix_of_one_maker_says_more_than_the_machine_file(path: str, control: str, found: str) -> None:
    assert detect(b"G0 X1 Y1\n", path, control).name == found


@pytest.mark.parametrize(
    ("arguments", "sets"), [("100,,90001,1", False), ("100,0,90001", False), ("100,1,90001", True)]
)
def test_a_measuring_cycle_sets_a_work_offset_only_where_it_is_told_which(arguments: str, sets: bool) -> None:
    found = on_sinumerik(f"G71 G54 G0 X1 Y1 Z1\nCYCLE978({arguments})\nG0 X2 Y2 Z2")
    assert found.moves.rule.tolist() == [Rule.CORRECT, Rule.PASS, Rule.REFUSE if sets else Rule.CORRECT]


@pytest.mark.parametrize(("shift", "codes"), [(0.0, []), (1.0, ["NCF282"])])
def test_a_basic_offset_beside_another_work_offset_is_remarked_on(shift: float, codes: list[str]) -> None:
    offsets = {"G500": dict.fromkeys("XYZ", shift), "G54": dict.fromkeys("XYZ", 5.0)}
    found = on_sinumerik("G71\nG500 G0 X1 Y1 Z1\nG54 X2\nG55", work_offsets=offsets)
    assert [each.code for each in found.messages][: len(codes)] == codes
    assert ends(found)[-1][0] == 7.0


def test_a_section_that_is_called_is_refused() -> None:
    found = on_sinumerik("G71 G0 X1 Y1 Z1\nCALL BLOCK AA TO BB\nG0 X2 Y2 Z2\nM30\nAA:\nG1 X3 F100\nBB:")
    assert found.moves.rule.tolist() == [Rule.CORRECT, Rule.REFUSE, Rule.REFUSE]
    assert next(each.code for each in found.messages) == "NCF252"


@pytest.mark.parametrize(
    ("formula", "x"), [("2 ^ 3 + 1", 9.0), ("(2 ^ 3) ^ 2", 64.0), ("2 ^ (3 ^ 2)", 512.0), ("2 ^ 3 ^ 2", None)]
)
def test_powers_of_powers_need_brackets_in_klartext(formula: str, x: float | None) -> None:
    text = f"0 BEGIN PGM A MM\n1 TOOL CALL 1 Z S1\n2 Q1 = {formula}\n3 L X+Q1 Y+1 Z+1 R0 FMAX\n4 END PGM A MM\n"
    setup = Setup(work_offsets={"PRESET": {}}, tools={1: Tool(0.0, 5.0)}, initial=dict.fromkeys("XYZ", 0.0))
    moves = trace(read(text.encode(), "a.h", "heidenhain"), setup, tuple("XYZ"), frozenset()).moves
    assert (moves.rule[0] == Rule.CORRECT) == (x is not None)
    assert x is None or moves.end[0, 0] == x


@pytest.mark.parametrize(("code", "told"), [("G61", 1), ("G64", 0)])
def test_pieces_under_exact_stop_are_remarked_on_once(code: str, told: int) -> None:
    text = f"G21 G90 G54 G17 {code}\nG43 H1 G0 X-300. Y-200. Z50.\nG1 X300. Y200. F500.\nX-300. Y-200.\nM30\n"
    fixed = ncfix.fix(read(text.encode(), "a.nc", "fanuc"), THREE_AXES, setup=SETUP)
    assert fixed.text.count(b"\n") > text.count("\n") + 1, "a line more than that with the stamp"
    assert [each.code for each in fixed.report.warnings].count("NCF283") == told


def test_an_arc_with_radius_and_centre_is_written_with_its_centre_alone() -> None:
    text = "G21 G90 G54 G17\nG43 H1 G0 X0. Y0. Z50.\nG2 X10. Y10. R10. I10. J0. F500.\nG3 X30. Y30. R20. J20.\nM30\n"
    fixed = ncfix.fix(read(text.encode(), "a.nc", "fanuc"), THREE_AXES, setup=SETUP)
    arcs = [line for line in fixed.text.decode().splitlines() if "I" in line and "J" in line and "(" not in line]
    assert len(arcs) >= 2
    assert not any("R" in line for line in arcs)


@pytest.mark.parametrize("tolerance_um", [1.0, 50.0])
@pytest.mark.parametrize("centre", ["R10. I5.", "R-15. I5.", "R15. I5. J3.", "R15. K5.", "R15. I-11. K3.", "R10. J10."])
def test_beside_a_radius_the_words_of_a_centre_say_nothing(centre: str, tolerance_um: float) -> None:
    """Whatever they are, the R alone counts; a word across the plane would make a helix once the R is gone.

    2 um: the tolerance, or less where that is wide, and rounding to 1 um in three axes.
    """
    text = f"G21 G90 G54 G17\nG43 H1 G0 X0. Y0. Z50.\nG3 X0. Y20. {centre} F500.\nG1 X30.\nM30\n"
    fixed = ncfix.fix(read(text.encode(), "a.nc", "fanuc"), THREE_AXES, setup=SETUP, tolerance_um=tolerance_um)
    assert not fixed.report.refused
    assert fixed.report.error_after_um["max"] < 2.0 < fixed.report.error_before_um["max"]


@pytest.mark.parametrize("words", ["R15. P3", "R15. L2", "R15. Q5."])
def test_an_arc_that_would_wind_without_its_radius_is_refused(words: str) -> None:
    assert (
        "has more turns" in reasons(follow(f"G21 G90 G0 X0. Y0. Z0.\nG3 X0. Y20. {words} F500.", dialect="fanuc"))[-1]
    )


@pytest.mark.parametrize("centre", ["R.25", "I-.25 J0."])
def test_arcs_in_inches_stay_arcs_with_the_digits_of_the_control(centre: str) -> None:
    """Steps of 0.0001 inch move the radii by more than half of 0.01 mm; in inches the control allows 0.001 inch."""
    text = f"G20 G90 G54 G17\nG43 H1 G0 X1.5 Y.25 Z2.\nG1 Z0. F20.\nG3 X1.25 Y.5 {centre}\nG1 X0.\nM30\n"
    fixed = ncfix.fix(read(text.encode(), "a.nc", "fanuc"), THREE_AXES, setup=SETUP)
    assert fixed.text.count(b"\n") == text.count("\n") + 1, "a line more: the stamp"
