"""Two accounts: the tolerance is for the path before rounding, and what the control's digits add is a bound."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path

import numpy as np
import pytest

from compensate.machines_at_random import TOPOLOGIES, perfect, random_machine
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import resolving
from ncfix.control.coordinates import INCH
from ncfix.control.setup import Setup, Tool
from ncfix.machine import Effect, Machine, load
from ncfix.machine.basis import ConstantBasis, Polynomial
from ncfix.text.dialect import get
from ncfix.text.reader import read

SETUP = Setup(assume_zero=True, tools={1: Tool(80.0, 3.0)})
HEAD = "G21 G90 G17 G94 F500\nG0 X0 Y0 Z0\n"
SEEDS = range(int(os.environ.get("NCFIX_ROUNDING", "2")))
STEPS = (0.001, 0.0001)
NOISE = 0.002
"""um: figures are told to a tenth of a nanometre, and corrections are right to one."""


def with_steps(machine: Machine, step: float) -> Machine:
    """A machine whose control resolves so many mm, and as many degrees."""
    return machine.replace(least_increment=(step, math.radians(step)))


def inserted(text: str, machine: Machine, tolerance_um: float = 1.0) -> int:
    options = FixOptions(tolerance_um=tolerance_um, figures=False)
    return fix_program(read(text.encode(), "part.ngc", "linuxcnc"), machine, SETUP, options).report.inserted_blocks


@pytest.fixture(scope="module")
def three_axis(root: Path) -> Machine:
    return load(str(root / "examples/machines/three_axis.toml"))


# -- the tolerance is not eaten ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("motions", "most"),
    [("G1 X100", 0), ("G1 X200 Y200 Z50", 2), ("G1 X100\nG2 X100 Y0 I100 J0", 9), ("G2 X200 Y0 I100 J0", 4)],
    ids=["straight", "diagonal", "circle", "half a circle"],
)
def test_a_step_of_1_um_puts_in_few_blocks_at_a_tolerance_of_1_um(motions: str, most: int, three_axis: Machine) -> None:
    """The screw's pitch error of 0.5 um is within the tolerance, whatever the digits are."""
    assert inserted(HEAD + motions + "\nM2\n", with_steps(three_axis, 0.001)) <= most


@pytest.mark.parametrize("tolerance_um", [0.5, 1.0])
def test_the_digits_have_no_say_in_where_motions_are_split(tolerance_um: float, three_axis: Machine) -> None:
    rng = np.random.default_rng(4)
    points = rng.uniform((-150, -100, 0), (150, 100, 200), (12, 3))
    text = HEAD + "".join(f"G1 X{x:.3f} Y{y:.3f} Z{z:.3f}\n" for x, y, z in points) + "M2\n"
    coarse, fine = (inserted(text, with_steps(three_axis, step), tolerance_um) for step in (0.001, 0.00001))
    assert coarse == fine > 0


@pytest.mark.parametrize("name", ["constant", "linear"])
def test_a_straight_line_over_a_constant_or_linear_error_stays_one_block(name: str) -> None:
    """Scales, offsets and squareness make straight lines of straight lines."""
    rng, effects = np.random.default_rng(7), []
    for axis in "XYZ":
        for component in "XYZ":
            basis = ConstantBasis() if name == "constant" else Polynomial((1,))
            effects.append(Effect(f"E{component}{axis}", (float(rng.uniform(-0.05, 0.05)),), basis, 0.0, 250.0))
    machine = with_steps(perfect(TOPOLOGIES["three-axis"]).replace(effects=tuple(effects)), 0.001)
    points = rng.uniform(-200, 200, (40, 3))
    text = HEAD + "".join(f"G1 X{x:.3f} Y{y:.3f} Z{z:.3f}\n" for x, y, z in points) + "M2\n"
    assert inserted(text, machine, 0.2) == 0


# -- what rounding adds is a bound ------------------------------------------------------------------------------------


def program(rng: np.random.Generator, machine: Machine, count: int = 14) -> str:
    """Straight motions, some that turn the axes, and arcs of all turns in all planes."""
    lines, here = [HEAD + "G1 X0 Y0 Z0 B0 C0" if machine.rotary.any() else HEAD + "G1 X0 Y0 Z0"], np.zeros(3)
    for _ in range(count):
        kind = rng.integers(0, 4)
        if kind < 2:
            here = np.round(rng.uniform((-60, -60, 0), (60, 60, 60)), 3)
            turn = f" B{rng.uniform(-40, 40):.3f} C{rng.uniform(-90, 90):.3f}" if kind and machine.rotary.any() else ""
            lines.append("G1 X{:.3f} Y{:.3f} Z{:.3f}".format(*here) + turn)
            continue
        plane, (first, second), words = [
            ("G17", (0, 1), "XYIJ"),
            ("G18", (2, 0), "ZXKI"),
            ("G19", (1, 2), "YZJK"),
        ][rng.integers(0, 3)]
        radius, begin = rng.uniform(5, 40), rng.uniform(0, 2 * np.pi)
        sweep = 2 * np.pi if kind == 3 else rng.uniform(0.3, 5.5)
        way = radius * np.array([np.cos(begin), np.sin(begin)])
        angle = begin + sweep * (1 if rng.random() < 0.5 else -1)
        code = "G3" if angle > begin else "G2"
        centre = here[[first, second]] - way
        end = here[[first, second]] if kind == 3 else centre + radius * np.array([np.cos(angle), np.sin(angle)])
        offset = centre - here[[first, second]]
        here = here.copy()
        here[[first, second]] = np.round(end, 4)
        a, b, i, j = words
        lines.append(f"{plane} {code} {a}{end[0]:.4f} {b}{end[1]:.4f} {i}{offset[0]:.4f} {j}{offset[1]:.4f}")
    return "\n".join(lines) + "\nM2\n"


@pytest.mark.parametrize("strategy", ["rotary-then-linear", "full"])
@pytest.mark.parametrize("topology", TOPOLOGIES.values(), ids=TOPOLOGIES)
def test_what_is_left_is_within_tolerance_and_rounding(topology: str, strategy: str) -> None:
    for seed in SEEDS:
        rng = np.random.default_rng((seed, len(topology)))
        machine = random_machine(rng, topology, micrometres=40.0, microradians=60.0)
        machine = with_steps(machine.replace(max_correction=(5.0, 0.5)), STEPS[seed % len(STEPS)])
        text, tolerance = program(rng, machine), float(rng.choice([0.3, 1.0, 4.0]))
        options = FixOptions(strategy=strategy, tolerance_um=tolerance, allow_refused=True)
        report = fix_program(read(text.encode(), "part.ngc", "linuxcnc"), machine, SETUP, options).report
        left = float(report.error_after_um["max"] or 0.0)
        assert report.compensated > 10, (seed, report.refused)
        if not report.refused and not report.left:
            assert left <= tolerance + report.rounding_um + NOISE, seed
            assert "NCF416" not in {each.code for each in report.warnings}, seed
        assert report.rounding_um >= 0.5 * STEPS[seed % len(STEPS)] * 1e3 * 3**0.5 - 1e-9


def test_a_program_in_which_nothing_is_corrected_has_no_rounding(three_axis: Machine) -> None:
    text = "G21 G90 G17 G94\nG53 G0 Z0\nM2\n"
    report = fix_program(read(text.encode(), "part.ngc", "linuxcnc"), three_axis, SETUP, FixOptions()).report
    assert report.as_dict()["rounding_um"] == 0.0


@pytest.mark.parametrize(("dialect", "step", "decimals"), [("fanuc", 0.001, 4), ("haas", 0.0001, 5), ("iso", 0.001, 5)])
def test_increment_systems_have_a_decimal_fraction_of_an_inch(
    dialect: str, step: float, decimals: int, three_axis: Machine
) -> None:
    """IS-B is 0.001 mm and 0.0001 inch, 2.54 um: no word has more digits, and the figures say what that rounds."""
    text = "G20 G90 G17 G94 F10.\nG0 X0. Y0. Z0.\nG1 X3. Y2.\nG2 X5. Y4. I1. J1.\nG91 X.5 Y.5 I.25 J.25\nM30\n"
    machine = with_steps(three_axis, step)
    fixed = fix_program(read(text.encode(), "part.nc", dialect), machine, SETUP, FixOptions(tolerance_um=0.1))
    found = re.findall(r"[XYZIJ]-?\d*\.(\d*)", fixed.text.decode())
    assert max(map(len, found)) == decimals
    assert fixed.report.error_after_um["max"] <= 0.1 + fixed.report.rounding_um + NOISE
    whole = 10.0**-decimals * INCH * 1e3 / 2
    assert whole <= fixed.report.rounding_um + NOISE


def test_comments_do_not_say_that_a_program_is_in_inches(three_axis: Machine) -> None:
    text = "G21 (NOT G20) G90 G17 G94 F10.\nG0 X0. Y0. Z0.\nG1 X70. Y50.\nM30\n"
    assert resolving(three_axis, get("fanuc"), text.encode()) is three_axis
    assert resolving(three_axis, get("fanuc"), b"G020G90") is not three_axis
    assert resolving(three_axis, get("fanuc"), b"G200") is three_axis
