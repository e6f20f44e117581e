"""`input = "K+L"`: an error of a joint that goes with how a link leans, whichever way the tip is worked out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ncfix.diagnostics import ConfigError
from ncfix.machine import Effect, Machine, State, dumps, load, loads
from ncfix.machine.basis import Fourier
from ncfix.machine.effects import leaning, library

SUM = Effect("EBK", (1e-4, -3e-4), Fourier(order=(1,)), input="K+L")


@pytest.fixture
def robot(root: Path) -> Machine:
    return load(root / "examples/stories/robot/robot.toml")


def test_the_error_is_that_of_the_summed_angle(robot: Machine) -> None:
    q = np.radians(np.random.default_rng(3).uniform(-50, 50, (40, 6)))
    summed = q[:, 1] + q[:, 2]
    tips = robot.replace(effects=(SUM,)).actual_tip(q)
    for pose, angle, tip in zip(q, summed, tips, strict=True):
        own = Effect("EBK", (float(1e-4 * np.cos(angle) - 3e-4 * np.sin(angle)),))
        assert np.abs(robot.replace(effects=(own,)).actual_tip(pose) - tip).max() < 1e-9  # mm


def test_the_design_has_its_columns(robot: Machine) -> None:
    q = np.radians(np.random.default_rng(4).uniform(-50, 50, (20, 6)))
    seen = robot.design(q, State(), [SUM]) @ np.array(SUM.coefficients)
    moved = robot.replace(effects=(SUM,)).actual_tip(q) - robot.tip(q, np.zeros(20))
    assert np.abs(seen[:, :3] - moved).max() < 1e-3 * np.abs(moved).max() + 1e-9


def test_it_is_written_and_read(robot: Machine) -> None:
    assert loads(dumps(robot.replace(effects=(SUM,)))).effects == (SUM,)


def test_a_sum_with_an_unknown_axis_is_refused(robot: Machine) -> None:
    text = dumps(robot.replace(effects=(SUM,)))
    with pytest.raises(ConfigError):
        loads(text.replace("K+L", "K+X"))


def test_joints_bear_what_leans_behind_them(robot: Machine) -> None:
    """J turns about the vertical, M and O roll, N follows a roll: K and L bear links."""
    assert {axis.name: leaning(robot.axes, axis) for axis in robot.axes} == {
        "J": (), "K": ("K", "K+L"), "L": ("K+L",), "M": (), "N": (), "O": ()
    }  # fmt: skip
    assert {name for name in library(robot) if name.startswith("compliance")} == {"compliance-K", "compliance-L"}


def test_machining_centres_have_no_joints_that_yield(root: Path) -> None:
    machine = load(root / "examples/machines/dmu50.toml")
    assert not [name for name in library(machine) if name.startswith("compliance")]
