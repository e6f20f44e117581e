"""What is in force on Fanuc controls from one block to the next, where LinuxCNC differs or has no such thing."""

from __future__ import annotations

import numpy as np
import pytest

from ncfix.control.setup import Setup, Tool
from ncfix.diagnostics import SourceError
from program.tracing import ends, follow, last, reasons

SETUP = Setup(
    work_offsets={"G54": {}, "G55": {"X": 100.0}, "G54.1P2": {"X": 1000.0, "Y": 0.0, "Z": 0.0}},
    tools={number: Tool(10.0 * number, 3.0) for number in range(5)},
    initial={"X": 0.0, "Y": 0.0, "Z": 0.0},
    references={"G28": {"Z": 300.0}, "G30": {"Z": 290.0}},
    no_point="calculator",
    assume_zero=True,
)


def motions(text: str) -> list[list[float]]:
    return ends(follow(text, setup=SETUP, dialect="fanuc"))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("G54P2X5.G0", [[1005, 0, 0]]),
        ("G54G4P2\nG0X5.", [[0, 0, 0], [5, 0, 0]]),
        ("G54M98P7\nM30\nO7\nG0X1.\nM99", [[1, 0, 0]]),
        ("G0X5.\nG92X0.\nG52X3.\nX1.\nG52X0.\nX1.", [[5, 0, 0], [9, 0, 0], [6, 0, 0]]),
        ("G52X3.Y1.\nG0X0.Y0.\nG92X10.\nX10.Y0.", [[3, 1, 0], [3, 1, 0]]),
        ("G52X3.\nG55G0X1.", [[104, 0, 0]]),
        ("G43H2G0Z0.\nH3Z0.\nH0Z0.\nG49Z0.", [[0, 0, 20], [0, 0, 30], [0, 0, 0], [0, 0, 0]]),
        ("G43H3G0Z0.\nG49Z0.\nG43Z0.", [[0, 0, 30], [0, 0, 0], [0, 0, 30]]),
        ("G43H2G0Z0\nG10L10P2R7.\nG43H2Z0", [[0, 0, 20], [0, 0, 7]]),
        ("G43H2G0Z0.\nG10L3\nP1L10\nT3H3\nG11\nG0Z1.", [[0, 0, 20], [0, 0, 21]]),
        ("G43H2G0Z0.\nG10L3\nP1L10\nG0Z1.\nH3Z0", [[0, 0, 20], [0, 0, 21], [0, 0, 30]]),
        ("H4\nG43G0Z0.\nG49.1Z0.", [[0, 0, 40], [0, 0, 0]]),
        ("G27Z5.\nG0X1.", [[0, 0, 5], [1, 0, 5]]),
        ("G30P2Z0.\nG0X1.", [[0, 0, 0], [0, 0, 290], [1, 0, 290]]),
        ("G0X5.Y1.\nG98G87X1.R-9.Z-5.F50.\nG80\nG0X0.", [[5, 1, 0], [1, 1, -5], [0, 1, 0]]),
        ("G81X1.Z-5.R2.F50.\nR4.\nG99X2.\nG80\nY1.G0", [[1, 0, -5], [1, 0, -5], [2, 0, -5], [2, 1, 4]]),
        ("M98P7Q20\nM30\nO7\nG0X1.\nN20G0Y2.\nM99", [[0, 2, 0]]),
        ("G51.1X10.\nG0X12.Y1.\nG91X1.\nG90G50.1X0\nX3.", [[8, 1, 0], [7, 1, 0], [3, 1, 0]]),
        ("G51.1X10.Y0\nG0X12.Y1.\nG50.1X0\nX3.Y2.\nG50.1\nX4.Y5.", [[8, -1, 0], [3, -2, 0], [4, 5, 0]]),
        ("G51.1X0\nG0X1.\nG69\nX2.\nG81Y3.Z-5.R2.F50.\nG50.1X0", [[-1, 0, 0], [-2, 0, 0], [-2, 3, -5]]),
        ("G1X1.F50.\nG31Z-5.\nG0Z9.\nX2.", [[1, 0, 0], [1, 0, np.nan], [1, 0, 9], [2, 0, 9]]),
    ],
)
def test_codes(text: str, expected: list[list[float]]) -> None:
    np.testing.assert_allclose(motions(text), expected, atol=1e-9)


@pytest.mark.parametrize(("dialect", "z"), [("fanuc", 25), ("haas", 5)])
def test_the_reference_point_takes_the_length_away_on_haas(dialect: str, z: float) -> None:
    found = follow("G43H2G0Z0.\nG91G28Z0.\nG90G0Z5.", setup=SETUP, dialect=dialect)
    assert ends(found)[-1] == [0.0, 0.0, z]


def test_after_skipping_the_code_before_it_is_in_force_again() -> None:
    found = follow("G1X1.F50.\nG31Z-5.\nX2.\nG0X3.Y0.Z9.\nG1G31X0.\nZ8.", setup=SETUP, dialect="fanuc")
    assert reasons(found)[1] == "probing"
    assert reasons(found)[2] == "the position of the axis Z after probing is known only at run time"
    assert found.moves.modal.tolist() == [10, 310, 10, 0, 310, 10]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("G30P3Z0.\nG0X1.", "reference point"),
        ("G81X1.Y1.Z-5.R2.K0F50.\nX3.", "cycle without a hole"),
        ("G1F50.\nX5.,A45.\nX9.", "given by its angle"),
        ("G68X0Y0\nG0X1.Y1.", "the angle of the rotation"),
        ("G43H2G0Z0\nG10L10P2R7.\nZ1.", "while it is in force"),
        ("G43H2G0Z0\n#11002=7.\nZ1.", "while it is in force"),
        ("G0X5.\nG16Y90.", "only one of radius and angle"),
        ("G0X5.\nG91G16Y90.", "only one of radius and angle"),
        ("G0X5.\nG91G92X1.\nG90X2.", "G92 counts in G91"),
        ("G81X5.Y5.Z-5.R-5.F50.", "is at the bottom of the hole"),
        ("M98P7L0\nG0X1.\nM30\nO7\nM99", "a call with L0"),
        ("G65P7L0\nG0X1.\nM30\nO7\nM99", "a call with L0"),
        ("G91G68X1.Y0R30.\nG90G0X1.Y1.", "count in G91"),
        ("G68R30.\nG91G68R30.\nG90G0X1.Y1.", "count in G91"),
        ("G68X0Y0R30.\nG0X5.Y0\nG68R45.\nX1.Y1.", "without centre words"),
        ("G0X1.Y1.\nG68X0Y0R30.\nX2.", "until both axes of the plane are programmed"),
        ("G0X1.Y1.\nG68X0Y0R30.\nX2.Y2.\nG69\nX1.", "until both axes of the plane are programmed"),
        ("G0X1.Y1.\nG68X0Y0R30.\nX2.Y2.\nG69\nG91X1.", "until both axes of the plane are programmed"),
        ("G0X1.Y1.\nG68X0Y0R30.\nG81X2.Z-5.R2.F50.", "until both axes of the plane are programmed"),
    ],
)
def test_what_differs_from_control_to_control_is_refused(text: str, reason: str) -> None:
    assert reason in reasons(follow(text, setup=SETUP, dialect="fanuc"))[-1]


@pytest.mark.parametrize("begin", ["G68X0Y0R#139", "G68X#139Y0R30.", "G68X1.Y1.", "G68.2X0Y0Z0I0J#139K0"])
def test_coordinates_that_are_not_certain_end_with_g69(begin: str) -> None:
    """A rotation in the plane leaves rotary axes where they are known to stand."""
    end = "X3.Y3.Z3." if begin.startswith("G68X") else "X3.Y3.Z3.B0C0"
    found = follow(f"G0X1.Y1.Z1.B0C0\n{begin}\nX2.Y2.\nG69\n{end}\nX4.", "CBXYZ", setup=SETUP, dialect="fanuc")
    assert [bool(reason) for reason in reasons(found)] == [False, True, False, False]


@pytest.mark.parametrize("mirror", ["", "X0", "Y0", "Z0", "X0Y0"])
def test_mirrored_arcs_turn_the_other_way(mirror: str) -> None:
    text = f"G51.1{mirror}\n" if mirror else ""
    moves = follow(f"{text}G0X5.Y0.Z0.\nG3X0.Y5.Z1.I-5.J0.F50.", setup=SETUP, dialect="fanuc").moves
    signs = np.array([-1.0 if axis in mirror else 1.0 for axis in "XYZ"])
    np.testing.assert_allclose(moves.end, signs * [[5, 0, 0], [0, 5, 1]], atol=1e-12)
    np.testing.assert_allclose(moves.centre[1], 0.0, atol=1e-12)
    spoke = moves.start[1] * [1, 1, 0]
    angle = moves.sweep[1]
    turned = np.cos(angle) * spoke + np.sin(angle) * np.cross(moves.normal[1], spoke)
    np.testing.assert_allclose(turned, moves.end[1] * [1, 1, 0], atol=1e-12)


def test_heights_do_not_depend_on_a_rotation_in_the_plane() -> None:
    found = follow("G0X1.Y1.\nG68X0Y0R30.\nX2.Y2.\nG69\nZ5.\nX1.Y1.", setup=SETUP, dialect="fanuc")
    assert reasons(found) == [""] * 4
    assert last(found) == [1, 1, 5]


def test_haas_adds_rotations() -> None:
    found = follow("G68X0Y0R30.\nG91G68R60.\nG90G0X1.Y0", setup=SETUP, dialect="haas")
    assert last(found) == pytest.approx([0, 1, 0])


def test_k_is_the_smallest_peck_of_haas() -> None:
    found = follow("G83X1.Z-5.R2.I.5J.1K.2F50.\nX3.L2", setup=SETUP, dialect="haas")
    assert ends(found) == [[1, 0, -5], [3, 0, -5], [3, 0, -5]]


def test_a_stretch_after_a_rotation_is_taken_block_by_block() -> None:
    lines = "\n".join(f"X{n}." for n in range(1, 31))
    found = follow(f"G0X1.Y1.\nG68X0Y0R30.\nX2.Y2.\nG69\n{lines}", setup=SETUP, dialect="fanuc")
    assert all("until both" in why for why in reasons(found)[2:])


@pytest.mark.parametrize("text", ["M98P7H20\nM30\nO7\nM99", "M98P7Q20L2\nM30\nO7\nN20\nM99"])
def test_calls_that_are_not_certain_are_errors(text: str) -> None:
    with pytest.raises(SourceError) as caught:
        follow(text, setup=SETUP, dialect="fanuc")
    assert caught.value.messages[0].code == "NCF242"


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("G43G0Z0.", "NCF217"),
        ("G0A90.\nG43.4H1", "NCF218"),
        ("G43.4H1\nG0A90.\nH2", ""),
        ("G18G81X1.Z2.Y-5.R3.F50.", "NCF245"),
        ("G19G43H1Z5.", "NCF245"),
        ("G43H1Z5.\nG18G2X1.R3.F50.", ""),
    ],
)
def test_what_cannot_be_seen_in_the_program_is_said(text: str, code: str) -> None:
    codes = {message.code for message in follow(text, "XYZA", setup=SETUP, dialect="fanuc").messages}
    assert codes & {"NCF217", "NCF218", "NCF245"} == ({code} if code else set())


def test_a_feature_coordinate_system_of_haas_is_refused_until_it_ends() -> None:
    found = follow("G0X1.\nG268X1.Y0Z0I10.\nG253\nG0X2.Y1.Z3.\nG269\nG0X1.Y2.Z3.", setup=SETUP, dialect="haas")
    assert ["G253" in why or "G268" in why for why in reasons(found)] == [False, True, True, False]


@pytest.mark.parametrize(("dialect", "refused"), [("haas", True), ("fanuc", False)])
def test_m96_of_haas_jumps_by_an_input(dialect: str, refused: bool) -> None:
    found = reasons(follow("G21G0X1.\nM96P5Q8\nX2.\nN5X3.", setup=SETUP, dialect=dialect))
    assert ["M96" in reason for reason in found] == [False, refused, refused]


def test_where_a_program_of_haas_goes_may_be_for_a_pallet_or_the_operator() -> None:
    pallet = reasons(follow("G21G0X1.\nM46Q1P5\nX2.\nN5X3.", setup=SETUP, dialect="haas"))
    assert ["M46" in reason for reason in pallet] == [False, True, True]
    asked = "G21G0X1.\n#501=0.\nM109P501(GO ON Y/N)\nIF[#501EQ78.]GOTO9\nX2.\nN9X3."
    found = reasons(follow(asked, setup=SETUP, dialect="haas"))
    assert ["known only at run time" in reason for reason in found] == [False, True, True]


def test_m199_of_haas_ends_a_program() -> None:
    text = "G21G0X1.\nM98P9\nM199\nO9\nX2.\nM99"
    assert ends(follow(text, setup=SETUP, dialect="haas")) == [[1, 0, 0], [2, 0, 0]]


@pytest.mark.parametrize("dialect", ["fanuc", "mitsubishi"])
def test_m97_without_a_block_ends_interrupts(dialect: str) -> None:
    found = follow("G21G0X1.\nM96P9000\nX2.\nM97\nX3.", setup=SETUP, dialect=dialect)
    assert reasons(found) == [""] * 3


@pytest.mark.parametrize("angle", [20.0, 25.0, 33.3, 71.7])
@pytest.mark.parametrize("code", ["G28", "G30"])
def test_increments_of_zero_to_a_reference_point_lead_by_no_way(code: str, angle: float) -> None:
    """In turned coordinates the place is one of rounding: seen from there the words led a hair away from it."""
    text = f"G0X1.1Y2.2Z60.3\nG68.2X.1Y.2Z.3I0J{angle}K0\nG91{code}Z0\nG90"
    moves = follow(text, "XYZAC", setup=SETUP, dialect="fanuc").moves
    assert (moves.block == 2).sum() == 1
    assert (follow(text.replace("Z0\n", "Z1.\n"), "XYZAC", setup=SETUP, dialect="fanuc").moves.block == 2).sum() == 2


@pytest.mark.parametrize("mode", ["G16", "G51X0Y0Z0P2."])
def test_words_beside_a_computed_code_are_polar_or_scaled_like_others(mode: str) -> None:
    """G#1 with a 1 in #1 is G1."""
    text = "G21G0X0Y0Z0\n#1=1\n{}\n{}X20.Y60.F100.\nX9.Y30."
    said, computed = (ends(follow(text.format(mode, code), setup=SETUP, dialect="fanuc")) for code in ("G1", "G#1"))
    assert computed == said
    assert said[1] == [pytest.approx(each) for each in ([10.0, 300**0.5, 0.0] if mode == "G16" else [40.0, 120.0, 0.0])]


def test_a_computed_macro_call_is_refused() -> None:
    """It was passed over."""
    found = reasons(follow("G21G0X1.\n#1=65\nG#1P9\nX2.\nM30\nO9\nX5.\nM99", setup=SETUP, dialect="fanuc"))
    assert ["macro call" in reason for reason in found] == [False, True]
