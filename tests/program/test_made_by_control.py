"""Pockets and patterns of holes that Haas and Mitsubishi make by themselves: what is corrected, and where they lie."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import Fixed, fix_flat, fix_program
from ncfix.compensate.following import follow
from ncfix.control.moves import MotionKind
from ncfix.control.setup import Setup
from ncfix.diagnostics import SourceError
from ncfix.machine import Machine, loads
from ncfix.testing.judging import LINEAR, SETUP, shifted_machine
from ncfix.text.reader import read

HEAD = "G21 G17 G40 G80 G90\nT1 M6\nG54\nG0 X0 Y0\nG43 Z100. H1\n"
CYCLE = "G81 G98 Z-10. R2. F200. L0"
CALCULATED = 0.00071
"""mm: half a step of the text in either axis."""


def fixed(dialect: str, body: str, machine: Machine | None = None, flat: bool = False, setup: Setup = SETUP) -> Fixed:
    """A body behind a tool call at X0 Y0 Z100, corrected."""
    program = read(f"{HEAD}{body}\nG0 Z100.\nM30\n".encode(), "part.nc", dialect)
    options = FixOptions(tolerance_um=60, figures=False)
    return (fix_flat if flat else fix_program)(program, machine or shifted_machine(), setup, options)


def bent_machine() -> Machine:
    """Three axes whose errors follow their positions: 0.1 mm in a metre, and X leans with Z."""
    axes = "".join(
        f'[axis.{axis}]\ntype = "linear"\ndirection = [{direction}]\nrange = [-5000, 5000]\n[[effect]]\n'
        f'name = "E{axis}{axis}"\nbasis = "polynomial"\ndegree = [1]\nscale = 1000.0\ncoefficients = [0.1]\n'
        for axis, direction, _ in ((*each[:2], 0) for each in LINEAR)
    )
    lean = '[[effect]]\nname = "EXZ"\nbasis = "polynomial"\ndegree = [1]\nscale = 1000.0\ncoefficients = [0.4]\n'
    return loads(
        f'name = "bent"\ntopology = "w F X Y Z t"\n{axes}{lean}[tool]\ndirection = [0, 0, 1]\npoint = [0, 0, 0]\n'
    )


def test_a_circular_pocket_is_corrected_at_its_depth() -> None:
    """X and Y that the depth needs stand in the block of the pocket, which Haas takes as its middle."""
    done = fixed("haas", "G0 X50. Y60. Z2.\nG13 Z-40. I4. K10. Q2. D1 F400.", bent_machine())
    assert not done.report.refused
    assert [each.code for each in done.report.warnings if each.code == "NCF280"]
    before, after = (text for text in done.text.decode().splitlines() if text.startswith(("G0 X5", "G0 X4", "G13")))
    x, x_down = (float(text.split("X")[1].split()[0]) for text in (before, after))
    assert math.isclose(x_down - x, 0.4e-3 * 42, abs_tol=0.0011)  # EXZ is lean times the way down; two rounded words
    assert after.split()[3:] == ["I4.", "K10.", "Q2.", "D1", "F400."]


@pytest.mark.parametrize(
    ("dialect", "line", "expected"),
    [
        ("haas", "G12 I5. D1 F400.", "G12 I5. D1 F400."),
        ("haas", "N7 G12 X5. Y6. Z-4. I5. D1 F400. M8", "N7 G12 X4.988 Y6.021 Z-3.991 I5. D1 F400. M8"),
        ("mitsubishi", "G12 I5. D1 F400.", "G12 I5. D1 F400."),
    ],
)
def test_how_a_circular_pocket_is_written(dialect: str, line: str, expected: str) -> None:
    done = fixed(dialect, f"G0 X1. Y2.\nG0 Z2.\n{line}\nG1 X30.")
    assert not done.report.refused
    assert f"Z2.009\n{expected}\nG1 X29.988\n" in done.text.decode()


@pytest.mark.parametrize(
    ("dialect", "body"),
    [
        ("haas", "G91 G13 Z-1. L3 I4. D1 F400.\nG90"),
        ("haas", "G13 Z-1. L3 I4. D1 F400."),
        ("haas", "G18\nG13 Z-1. I4. D1 F400.\nG17"),
        ("haas", "G2 X10. I5. J0 F100.\nG13 I4. D1 F400."),
        ("mitsubishi", "G12 Z-1. I4. D1 F400."),
    ],
)
def test_a_circular_pocket_that_is_refused(dialect: str, body: str) -> None:
    reasons = [each.reason for each in fixed(dialect, body).report.refused]
    assert any("a circular pocket" in reason for reason in reasons)


def circle(x: float, y: float, radius: float, angles: list[float]) -> list[tuple[float, float]]:
    """Places on a circle."""
    return [(x + radius * math.cos(math.radians(a)), y + radius * math.sin(math.radians(a))) for a in angles]


PATTERNS = [
    ("haas", "G70 I40. J15. L4", circle(1, 2, 40, [15, 105, 195, 285])),
    ("haas", "G70 X5. Y6. I40. L3", circle(5, 6, 40, [0, 120, 240])),
    ("haas", "G71 I40. J10. K-30. L3", circle(1, 2, 40, [10, -20, -50])),
    ("mitsubishi", "G34 X10. Y10. I30. J0 K-4", circle(10, 10, 30, [0, -90, -180, -270])),
    ("mitsubishi", "G35 X10. Y11. I10. J30. K3", [(10 + 10 * k * 0.75**0.5, 11 + 5 * k) for k in range(3)]),
    ("mitsubishi", "G36 X1. Y0 I30. J5. P15. K3", circle(1, 0, 30, [5, 20, 35])),
    ("mitsubishi", "G37.1 X0 Y1. I10. P2 J20. K2", [(0, 1), (10, 1), (10, 21), (0, 21)]),
]


@pytest.mark.parametrize(("dialect", "line", "places"), PATTERNS)
def test_a_pattern_of_holes_is_written_out(dialect: str, line: str, places: list[tuple[float, float]]) -> None:
    """As it stands it is refused, with the option that helps."""
    body = f"G0 X1. Y2.\n{CYCLE}\nN9 {line} M8 (HOLES)\nG80"
    (why,) = fixed(dialect, body).report.refused
    assert "with --flatten ncfix writes them out" in why.reason
    text = fixed(dialect, body, flat=True, machine=shifted_machine(0.0)).text
    assert b"M8 (HOLES)" in text
    moves = follow(read(text, "part.nc", dialect), shifted_machine(), SETUP).trace.moves
    holes = moves.end[moves.kind == MotionKind.CYCLE]
    assert np.abs(holes[:, :2] - np.array(places)).max() < CALCULATED
    assert len({*holes[:, 2]}) == 1


@pytest.mark.parametrize(
    ("dialect", "body"),
    [
        ("haas", "G70 I40. J15. L4"),
        ("haas", f"{CYCLE}\nG91 G70 I40. J15. L4\nG90\nG80"),
        ("haas", f"{CYCLE}\nG70 J15. L4\nG80"),
        ("haas", f"{CYCLE}\nG70 I40. J15. L0\nG80"),
        ("haas", f"{CYCLE}\nG71 I40. J15. K5. L-4\nG80"),
        ("haas", f"{CYCLE}\nG70 I#5021 J15. L4\nG80"),
        ("mitsubishi", f"{CYCLE}\nG36 X0 Y0 I30. J0 K3\nG80"),
    ],
)
def test_a_pattern_that_is_not_followed(dialect: str, body: str) -> None:
    reasons = [each.reason for each in fixed(dialect, body).report.refused]
    assert any("holes on" in reason and "--flatten" not in reason for reason in reasons)


def test_behind_a_pattern_the_program_names_its_axes() -> None:
    refused = fixed("haas", f"{CYCLE}\nG70 I40. J15. L4\nG80\nG1 X5. F100.\nG1 Y6.").report.refused
    assert any("after a pattern of holes" in each.reason for each in refused)


def test_an_angle_without_a_decimal_point_is_asked_for() -> None:
    """Whether J15 is 15 degrees goes with a parameter."""
    body = f"{CYCLE}\nG70 I40. J15 L4\nG80"
    assert fixed("haas", body).report.refused  # the setup says that numbers without a point mean what they say
    with pytest.raises(SourceError, match="no decimal point"):
        fixed("haas", body, setup=replace(SETUP, no_point="IS-B"))
