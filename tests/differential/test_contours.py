"""Cutter radius compensation: what is claimed bounds what LinuxCNC makes of it, and no corner becomes worse unsaid."""

from __future__ import annotations

import math
import os
from collections.abc import Callable

import numpy as np
import pytest

from compensate.machines_at_random import TOPOLOGIES, perfect, random_machine
from conftest import FULL
from differential.canon import Canon, Controls
from differential.contours import contour, judged
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.report import FixReport
from ncfix.control.setup import Setup, Tool
from ncfix.machine import Effect, Machine
from ncfix.machine.basis import Periodic, Polynomial
from ncfix.text.reader import read

CONTOURS = int(os.environ.get("NCFIX_CONTOURS", "16" if FULL else "10"))
"""So many are made; of those that the control accepts, about a third, all are judged."""
LENGTH = 80.0
SAMPLED = 0.15
"""um: places of the judge stand 0.2 mm apart, and the control prints a tenth of a um."""


def corrected(text: str, machine: Machine, tool: Tool, tolerance_um: float) -> tuple[bytes, FixReport]:
    setup = Setup(assume_zero=True, tools={1: tool, 0: Tool(0.0)})
    options = FixOptions(tolerance_um=tolerance_um, allow_refused=True)
    fixed = fix_program(read(text.encode(), "part.ngc", "linuxcnc"), machine, setup, options)
    return fixed.text, fixed.report


def machine_of(rng: np.random.Generator, seed: int) -> Machine:
    step, size = (0.001, 0.0001)[seed % 2], float(rng.choice([3.0, 15.0, 40.0]))
    bases = ("periodic", "spline") if seed % 3 else ("polynomial", "fourier", "table")
    machine = random_machine(rng, TOPOLOGIES["three-axis"], bases, micrometres=size, microradians=size)
    return machine.replace(least_increment=(step, math.radians(step)), max_correction=(5.0, 0.5))


def test_no_corner_becomes_worse_unsaid(rs274: Callable[..., Canon]) -> None:
    seen, refused = 0, 0
    for seed in range(CONTOURS):
        rng = np.random.default_rng(seed)
        machine, tolerance = machine_of(rng, seed), float(rng.choice([0.5, 1.0, 3.0]))
        radius = float(round(rng.uniform(1, 8), 2))
        text, controls = contour(rng, radius), Controls(tools={1: (LENGTH, 2 * radius)})
        meant = rs274(text.encode(), controls)
        if not meant.accepted:
            continue
        done, report = corrected(text, machine, Tool(LENGTH, radius), tolerance)
        made, seen = rs274(done, controls), seen + 1
        assert made.accepted, (seed, made.error)
        if report.refused:
            refused += 1
            assert {each.code for each in report.refused} == {"NCF454"}, seed
            continue
        before, after = (judged(each, meant, machine, LENGTH) for each in (meant, made))
        said = {each.code for each in report.warnings}
        assert after.most <= float(report.error_after_um["max"] or 0.0) + SAMPLED, seed
        assert after.most <= tolerance + report.rounding_um + SAMPLED or "NCF416" in said, seed
        allowed = np.maximum(before.corners, tolerance) + report.rounding_um + SAMPLED
        assert (after.corners <= allowed).all(), (seed, before.corners, after.corners)
    assert seen > CONTOURS / 6
    assert refused < seen / 2


WAVES = "G21 G17 G90 G94 F500\nT1 M6\nG43 H1\nG0 X0 Y0 Z0\nG0 X-20 Y-10\nG41 D1 G1 X0 Y0\n{}G40 X-30 Y-30\nM2\n"
ACUTE = WAVES.format("X41.5\nX11 Y14\n")
"""Inside a corner of 25 degrees the tool is some 14 mm from the point of the contour."""


def wavy(size_um: float) -> Machine:
    """Straightness in X that comes again every 20 mm of Y, positioning in X every 24."""
    effects = [
        Effect("EXX", (size_um * 1e-3, 0.0), Periodic((1,), 24.0)),
        Effect("EYX", (0.0, size_um * 1e-3), Periodic((1,), 20.0)),
    ]
    return perfect(TOPOLOGIES["three-axis"]).replace(effects=tuple(effects), least_increment=(1e-5, 1e-5))


def test_the_radius_decides_and_without_it_that_is_said() -> None:
    """A scale is right along all of the contour, and wrong beside it: by how much, the radius says."""
    scale = Effect("EXX", (0.1,), Polynomial((1,)), 0.0, 250.0)
    machine = perfect(TOPOLOGIES["three-axis"]).replace(effects=(scale,), least_increment=(1e-5, 1e-5))
    left = {}
    for radius in (None, 0.001, 3.0):
        _, report = corrected(ACUTE, machine, Tool(LENGTH, radius), 50.0)
        assert not report.refused
        assert ("NCF455" in {each.code for each in report.warnings}) == (radius is None)
        left[radius] = float(report.error_after_um["max"] or 0.0)
    assert left[None] < 0.02
    assert left[0.001] < 0.02
    assert left[3.0] > 0.3  # 1.2 um along X, of which a line that leads little up and down sees little


@pytest.mark.parametrize("setting", ["G10 L12 P1 R8.", "#13001=8.", "G10 L13 P1 R0.02", "#12001=0.02", ""])
def test_a_radius_that_the_program_sets_is_not_that_of_the_setup(setting: str) -> None:
    """Its number may be a diameter, and wear may be added to it."""
    scale = Effect("EXX", (0.1,), Polynomial((1,)), 0.0, 250.0)
    machine = perfect(TOPOLOGIES["three-axis"]).replace(effects=(scale,), least_increment=(1e-5, 1e-5))
    setup = Setup(assume_zero=True, tools={1: Tool(LENGTH, 3.0)}, no_point="calculator")
    program = read(f"{setting}\n{ACUTE}".encode(), "part", "fanuc")
    report = fix_program(program, machine, setup, FixOptions(tolerance_um=50.0)).report
    changes = "L12" in setting or "13001" in setting
    assert ("NCF455" in {each.code for each in report.warnings}) == changes


def test_a_corner_that_would_become_worse_is_refused_and_a_larger_tolerance_takes_it() -> None:
    """Small errors at the places where the tool goes, larger ones where the contour has its points."""
    found = {}
    for tolerance in (0.2, 100.0):
        worst = 0
        for seed in range(30 if FULL else 15):
            rng = np.random.default_rng(seed)
            x, y = rng.uniform(30, 60), rng.uniform(8, 25)
            text = WAVES.format(f"X{x:.3f}\nX{x - 30:.3f} Y{y:.3f}\n")
            _, report = corrected(text, wavy(3.0), Tool(LENGTH, 3.0), tolerance)
            assert {each.code for each in report.refused} <= {"NCF454"}
            worst += bool(report.refused)
        found[tolerance] = worst
    assert found[0.2] > 3
    assert found[100.0] == 0
