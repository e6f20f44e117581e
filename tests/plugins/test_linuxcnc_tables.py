"""LinuxCNC's `.comp` files: to the byte, as its source reads them, and what the linter says of broken ones."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ncfix.diagnostics import ConfigError
from ncfix.machine import Effect
from ncfix.machine.basis import Polynomial
from ncfix.machine.piecewise import PiecewiseLinear
from ncfix.tables.control import Request, get_control
from ncfix.tables.correction import ranges_of
from ncfix.tables.export import export
from ncfix.testing import single_error

INI = b"[TRAJ]\nCOORDINATES = X Y Z\nLINEAR_UNITS = mm\n\n[JOINT_0]\nCOMP_FILE = x.comp\nCOMP_FILE_TYPE = 1\n"
GOOD = b"-10.0 0.001 0.002\n0.0 0.000 0.001\n10.0 -0.001 0.000\n"
CONTROL = get_control("linuxcnc")


def test_golden_bytes() -> None:
    """A screw that is 0.1 um per mm too long over 500 mm, worked by hand: at x the correction is -x / 10001."""
    machine = single_error("EXX").replace(effects=(Effect("EXX", (1e-4,), Polynomial((1,))),))
    files = export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.001), 100).native
    assert files == {
        "joint_0_X.comp": b"-200.000000 0.019998 0.019998\n300.000000 -0.029997 -0.029997\n",
        "comp.ini": b"[TRAJ]\nCOORDINATES = X Y Z\nLINEAR_UNITS = mm\nANGULAR_UNITS = degree\n\n"
        b"[JOINT_0]\nCOMP_FILE = joint_0_X.comp\nCOMP_FILE_TYPE = 1\n",
    }


def test_curves_of_both_directions_are_the_two_columns() -> None:
    """Forward and reverse as a laser reads them: tables of one direction each in the machine file."""
    places = (-200.0, 50.0, 300.0)
    curves = {"positive": (0.004, -0.002, 0.006), "negative": (0.007, 0.003, 0.009)}
    effects = tuple(Effect("EXX", curve, PiecewiseLinear(places, way)) for way, curve in curves.items())
    machine = single_error("EXX").replace(effects=effects)
    text = export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.001), 100).native["joint_0_X.comp"]
    rows = np.array([line.split() for line in text.decode().splitlines()], dtype=float)
    for column, curve in zip(rows.T[1:], curves.values(), strict=True):
        # an error of 8 um in the place where the curve is read, on slopes of 5 um in 250 mm
        np.testing.assert_allclose(np.interp(places, rows[:, 0], column), -np.array(curve), rtol=0, atol=2e-6)


def at(files: dict[str, bytes], x: float, way: float) -> float:
    found = CONTROL.read(files).at(("X",), np.array([[x]]), np.array([[way]]))
    return float(found[0, 0])


@pytest.mark.parametrize(
    ("x", "way", "expected"), [(5, 1, -0.0005), (5, -1, 0.0005), (99, 1, -0.001), (-99, -1, 0.002), (0, 0, 0.0005)]
)
def test_columns_ends_and_between(x: float, way: float, expected: float) -> None:
    assert at({"comp.ini": INI, "x.comp": GOOD}, x, way) == pytest.approx(expected, abs=1e-9)  # float32 of 0.002


def test_type_0_says_where_the_axis_really_is(shared: Callable[[str], Path]) -> None:
    """LinuxCNC's own sample: at 10 the forward reading is 9.999, so 0.001 is added."""
    sample = (shared("tables") / "linuxcnc" / "screwcompX.dat").read_bytes()
    files = {"comp.ini": INI.replace(b"TYPE = 1", b"TYPE = 0"), "x.comp": sample}
    assert at(files, 10, 1) == pytest.approx(0.001, abs=1e-9)
    assert at(files, 10, -1) == pytest.approx(0.0, abs=1e-9)


def test_the_slip_in_linuxcncs_own_sample_is_named(shared: Callable[[str], Path]) -> None:
    sample = (shared("tables") / "linuxcnc" / "screwcompX.dat").read_bytes()
    found = CONTROL.lint({"comp.ini": INI.replace(b"TYPE = 1", b"TYPE = 0"), "x.comp": sample})
    assert {message.place.line for message in found if message.place} == {4, 5}  # into -4.2 and out of it
    assert {message.code for message in found} == {"NCF492"}


def test_inches() -> None:
    ini = INI.replace(b"= mm", b"= inch")
    assert at({"comp.ini": ini, "x.comp": GOOD}, 254.0, 1) == pytest.approx(-0.0254, abs=1e-8)


def test_a_machine_in_inches_gets_its_tables_in_inches() -> None:
    """Positions and values are 25.4 times smaller, what they do is the same to 3 nm; the last digit is 2.5 nm."""
    machine = single_error("EXX").replace(effects=(Effect("EXX", (1e-4,), Polynomial((1,))),))
    request = Request(machine, ranges_of(machine), 0.0, 0.001, CONTROL.settings({"unit": "inch"}))
    made = export(CONTROL, request, 100)
    assert b"LINEAR_UNITS = inch" in made.native["comp.ini"]
    assert made.native["joint_0_X.comp"].startswith(b"-7.8740157 0.0007873 ")
    assert made.left.after.max() < 5e-6


def test_tables_of_rotary_axes_are_in_degrees() -> None:
    ini = INI.replace(b"= mm", b"= mm\nANGULAR_UNITS = rad")
    (found,) = CONTROL.lint({"comp.ini": ini, "x.comp": GOOD})
    assert "ANGULAR_UNITS = rad" in found.text
    assert found.place is not None
    assert found.place.line == 4


def test_two_joints_of_one_axis_are_not_added_up() -> None:
    """A gantry: each joint has its table, and the axis is not corrected twice."""
    ini = INI.replace(b"X Y Z", b"X X Y Z") + b"[JOINT_1]\nCOMP_FILE = y.comp\nCOMP_FILE_TYPE = 1\n"
    with pytest.raises(ConfigError, match="joints 0 and 1 move X together"):
        CONTROL.read({"comp.ini": ini, "x.comp": GOOD, "y.comp": GOOD.replace(b"0.002", b"0.003")})
    same = {"comp.ini": ini.replace(b"y.comp", b"x.comp"), "x.comp": GOOD}
    assert not CONTROL.lint(same)
    assert at(same, 5, 1) == pytest.approx(-0.0005, abs=1e-9)


def test_a_gantry_has_its_table_for_both_joints() -> None:
    machine = single_error("EYY").replace(effects=(Effect("EYY", (1e-4,), Polynomial((1,))),))
    space = ranges_of(machine)
    plain = export(CONTROL, Request(machine, space, 0.0, 0.001), 100)
    made = export(CONTROL, Request(machine, space, 0.0, 0.001, {"coordinates": "XYYZ"}), 100)
    assert made.native["joint_1_Y.comp"] == made.native["joint_2_Y.comp"] == plain.native["joint_1_Y.comp"]
    assert b"COORDINATES = X Y Y Z\n" in made.native["comp.ini"]
    assert (made.left.after == plain.left.after).all()


@pytest.mark.parametrize("head", ["# screw of X\n", "0,0 0,0 0,0\n", "; X\n\n", "nominal forward reverse\n"])
def test_a_table_that_linuxcnc_does_not_read_is_known_by_its_name(head: str) -> None:
    content = head.encode() + GOOD
    assert CONTROL.knows("x.comp", content)
    assert "LinuxCNC stops reading here" in str(CONTROL.look({"x.comp": content})[0])
    assert not CONTROL.knows("notes.comp", b"of 3 screws\n3 are worn\nand\none is new\n")


BROKEN = {
    "a comment": (b"# screw of X\n" + GOOD, "not three numbers"),
    "a blank line": (GOOD.replace(b"\n0.0", b"\n\n0.0"), "a blank line"),
    "a decimal comma": (GOOD.replace(b"0.002", b"0,002"), "a decimal comma"),
    "two columns": (GOOD.replace(b" 0.002", b""), "not three numbers"),
    "descending": (GOOD.replace(b"10.0 -0", b"-20.0 -0"), "must ascend"),
    "twice the same": (GOOD.replace(b"10.0 -0", b"0.0 -0"), "must ascend"),
    "one point": (GOOD.splitlines(keepends=True)[0], "1 points"),
    "too many points": (b"".join(b"%d 0 0\n" % n for n in range(257)), "holds 256"),
    "not ASCII": (GOOD + "30.0 0 0 µm\n".encode(), "not ASCII"),
    "lines that end in CR": (GOOD.replace(b"\n", b"\r"), "CR alone"),
    "a word": (GOOD.replace(b"0.001", b"nan"), "not three numbers"),
}
BROKEN |= {
    "actual positions as corrections": (b"-10 -10.001 -9.999\n10 9.999 10.000\n", "-10.001 mm, which no machine needs"),
    "a blank line before more": (GOOD + b"\n\n30.0 0 0\n", "a blank line"),
    "a comment at the end": (GOOD + b"# 30.0 0 0\n", "not three numbers"),
}
BROKEN_INI = {
    "no type": (INI.replace(b"COMP_FILE_TYPE = 1\n", b""), "has no COMP_FILE_TYPE"),
    "type 2": (INI.replace(b"TYPE = 1", b"TYPE = 2"), "COMP_FILE_TYPE = 2"),
    "no such file": (INI.replace(b"x.comp", b"y.comp"), "y.comp is missing"),
    "no such joint": (INI.replace(b"JOINT_0", b"JOINT_7"), "no axis of COORDINATES"),
    "no units": (INI.replace(b"LINEAR_UNITS = mm\n", b""), "LINEAR_UNITS"),
    "two types": (INI + b"COMP_FILE_TYPE = 0\n", "COMP_FILE_TYPE appears twice: LinuxCNC takes the first"),
    "a joint twice": (INI + b"[JOINT_0]\nCOMP_FILE = y.comp\n", "COMP_FILE appears twice"),
    "the section of an axis": (INI.replace(b"JOINT_0", b"AXIS_X"), "reads it under [JOINT_n]"),
    "no assignment": (INI + b"COMP FILE x\n", "nor NAME = VALUE"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_tables(case: str) -> None:
    content, expected = BROKEN[case]
    files = {"comp.ini": INI, "x.comp": content}
    assert any(expected in message.text and message.code == "NCF491" for message in CONTROL.lint(files))
    with pytest.raises(ConfigError, match=expected):
        CONTROL.read(files)


@pytest.mark.parametrize("case", BROKEN_INI)
def test_broken_ini_files(case: str) -> None:
    content, expected = BROKEN_INI[case]
    assert any(expected in message.text for message in CONTROL.lint({"comp.ini": content, "x.comp": GOOD}))


def test_corrections_as_actual_positions_are_refused_with_the_other_type() -> None:
    ini = INI.replace(b"TYPE = 1", b"TYPE = 0")
    (message,) = CONTROL.lint({"comp.ini": ini, "x.comp": GOOD})
    assert (message.code, "COMP_FILE_TYPE 1, corrections?" in message.hint) == ("NCF491", True)


def test_blank_lines_at_the_end_change_nothing() -> None:
    files = {"comp.ini": INI, "x.comp": GOOD + b"\n  \n\n"}
    assert not CONTROL.lint(files)
    assert at(files, 99, 1) == pytest.approx(-0.001, abs=1e-9)  # float32 of 0.001


def test_backlash_beside_a_table_is_doubtful() -> None:
    found = CONTROL.lint({"comp.ini": INI + b"BACKLASH = 0.01\n", "x.comp": GOOD})
    assert [message.code for message in found] == ["NCF492"]
    assert "BACKLASH is ignored" in found[0].text


def test_a_good_pair_of_files_is_not_remarked_on() -> None:
    assert not CONTROL.lint({"comp.ini": INI, "x.comp": GOOD})
