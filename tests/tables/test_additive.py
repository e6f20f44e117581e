"""Sums of one-axis tables: means over the other axes, rotary axes turned right first, either way apart if asked for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ncfix.machine import Effect, load
from ncfix.machine.basis import Polynomial
from ncfix.tables.axis_tables import additive
from ncfix.tables.compensation import Compensation, Term
from ncfix.tables.correction import even_poses, ranges_of, residual
from ncfix.testing import single_error


def test_a_sum_of_functions_of_one_axis_is_found() -> None:
    """Positioning and straightness of X, and an offset of Y: the sum says it all."""
    effects = (
        Effect("EXX", (0.01,), Polynomial((1,)), scale=200.0),
        Effect("EZX", (0.004,), Polynomial((2,)), scale=200.0),
        Effect("EYY", (0.003,)),
    )
    machine = single_error("EXX").replace(effects=effects)
    space = ranges_of(machine)
    lines = additive(machine, space, 0.0, 256, 0.0004)
    terms = tuple(Term((line.grid(name),)) for line in lines for name in line.outputs)
    left = residual(machine, Compensation(terms), space, 0.0, 300)
    assert left.after.max() < 0.0004
    assert {line.input: set(line.outputs) for line in lines} == {"X": {"X", "Z"}, "Y": {"Y"}, "Z": {"Z"}}


def test_a_rotary_axis_turns_itself_right(root: Path) -> None:
    machine = load(root / "examples" / "machines" / "wCAYFXZSt.toml").replace(
        effects=(Effect("ECC", (1e-4,), Polynomial((1,)), scale=100.0),)
    )
    lines = {line.input: line for line in additive(machine, ranges_of(machine), 0.0, 256, 0.001)}
    assert lines["C"].outputs == ("C",)
    assert np.ptp(lines["C"].values) > 1e-4
    assert not np.abs(np.concatenate([lines[name].values.reshape(-1) for name in "XYZA"])).max() > 1e-6


def test_poses_are_spread_more_evenly_than_at_random() -> None:
    poses = even_poses(np.array([[0.0, 1.0]] * 5), 128)
    assert poses.mean(axis=0) == pytest.approx(np.full(5, 0.5), abs=0.02)
    assert poses.std(axis=0) == pytest.approx(np.full(5, 12**-0.5), abs=0.01)
