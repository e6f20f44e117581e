"""The machine file: what it means, and that it comes back as it was."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import some
from machine import chains
from machine.files import GOOD, changed
from ncfix.machine import Axis, Effect, GaugeLine, Machine, dumps, loads
from ncfix.machine.basis import Backlash, Fourier, Periodic, Polynomial
from ncfix.machine.piecewise import PiecewiseConstant, PiecewiseLinear, Spline


def test_what_a_file_means() -> None:
    machine = loads(GOOD)
    assert machine.axis_names == ("C", "B", "X", "Y", "Z")
    assert machine.topology == "w C B F X Y Z t"
    assert machine.name == "DMU 50 eVolution"
    assert machine.control == "heidenhain"
    assert machine.rotary.tolist() == [True, True, False, False, False]
    assert machine.least_increment == (0.001, math.radians(0.002))
    assert machine.max_correction == (0.25, math.radians(0.1))
    np.testing.assert_allclose(
        machine.ranges, [[-np.inf, np.inf], [0, np.pi], [0, 500], [-np.inf, np.inf], [-400, 0]], rtol=1e-15
    )
    c, b, x, y, _ = machine.axes
    assert (c.workpiece_side, b.workpiece_side, x.workpiece_side) == (True, True, False)
    assert c.endless
    assert not y.endless
    assert y.direction == (0.0, 1.0, 0.0)
    assert x.pitch == 10.0
    assert b.moving_frame
    np.testing.assert_allclose(b.error_axes @ np.transpose(b.error_axes), np.eye(3), atol=1e-15)
    assert machine.tool == GaugeLine((0.0, 0.0, 1.0), (0.0, 0.0, 120.0))
    positioning, square, growth = machine.effects
    assert positioning.basis == Polynomial((1, 2, 3))
    assert positioning.reference == (0.0, 0.0, -275.86)
    assert positioning.covariance == ((4e-8, 0, 0), (0, 1e-8, 0), (0, 0, 1e-8))
    assert square == Effect("EC0Y", (12e-6,))
    assert (growth.input, growth.time_constant_s) == ("temp_spindle", 1800.0)
    assert machine.inputs == {"temp_spindle", "time_s"}
    assert str(machine.provenance["date"]) == "2026-11-21"


def test_the_polynomial_s_u_is_in_the_file_s_unit() -> None:
    extra = '[[effect]]\nname = "ECC"\nbasis = "polynomial"\ndegree = [1]\n'
    extra += "center = 90\nscale = 45\ncoefficients = [1e-5]\n\n"
    machine = loads(changed("[provenance]", extra + "[provenance]"))
    machine = machine.replace(effects=tuple(e for e in machine.effects if e.name in ("EXX", "ECC")))
    q = np.array([np.pi, 0, 500, 0, 0])
    errors = machine.joint_errors(q)
    assert errors[0, 5] == pytest.approx(2e-5)
    assert errors[2, 0] == pytest.approx(0.0103 - 0.0021 + 0.0004)


def test_the_simplest_file() -> None:
    machine = loads('topology = "wFXt"\n[axis.X]\ntype = "linear"\ndirection = [1, 0, 0]\n', "folder/mill.toml")
    assert machine == Machine("mill", "w F X t", (Axis("X", False, False, (1.0, 0.0, 0.0)),))
    assert machine.max_correction == (0.5, math.radians(0.05))
    assert machine.is_perfect


def test_the_spindle_in_the_topology_is_optional_and_kept() -> None:
    with_spindle = loads(changed("X Y Z t", "X Y Z S t"))
    assert with_spindle.topology == "w C B F X Y Z S t"
    assert with_spindle.axes == loads(GOOD).axes
    assert loads(dumps(with_spindle)) == with_spindle


# -- coming back ------------------------------------------------------------------------------------------------------


def test_the_file_comes_back_as_it_was() -> None:
    machine = loads(GOOD)
    assert loads(dumps(machine)) == machine
    assert dumps(loads(dumps(machine))) == dumps(machine)
    assert "range = [0.0, 180.0]" in dumps(machine)


def test_every_basis_and_option_comes_back() -> None:
    knots = (0.0, 0.0, 0.0, 0.0, 250.0, 500.0, 500.0, 500.0, 500.0)
    effects = (
        Effect("EXX", (1e-3, 2e-3), Backlash((0, 1)), scale=500.0),
        Effect(
            "EYX",
            (0.1, 0.2, 0.3),
            PiecewiseLinear((0.0, 1 / 3, 500.0)),
            center=1.0,
            times="Z",
            times_center=-5.0,
            times_scale=7.0,
        ),
        Effect("EZX", (0.0, 1.0, 2.0, 3.0, 4.0), Spline(knots, 3)),
        Effect("EAX", (1e-5, 2e-5), Periodic((1,), 10.0)),
        Effect("ECC", (1e-5, 2e-5), Fourier((3,))),
        Effect("EBX", (1e-5, 2e-5, 3e-5), PiecewiseConstant((5.0, 6.0), "negative")),
        Effect("EX0C", (0.01,), carried=True, reference=(1.0, 2.0, 1 / 3)),
        Effect("EY0C", (0.01,), Polynomial((1,)), input="temp_table", time_constant_s=0.1),
        Effect("EZX", (0.5,), input="X"),
    )
    machine = loads(GOOD).replace(effects=effects, workpiece_offset=(1.0, 2.0, 3.5), provenance={})
    assert loads(dumps(machine)) == machine


@settings(max_examples=some(40), deadline=None)
@given(seed=st.integers(0, 10**6), low=st.integers(-36000, 0), high=st.integers(1, 36000))
def test_any_machine_comes_back(seed: int, low: int, high: int) -> None:
    """Ranges of rotary axes in hundredths of a degree; everything else any number."""
    rng = np.random.default_rng(seed)
    machine = chains.random_errors(rng, chains.random_chain(rng, 5))
    degree = math.pi / 180
    limits = (low / 100 * degree, high / 100 * degree)
    axes = tuple(
        Axis(a.name, a.rotary, a.workpiece_side, a.direction, a.point, limits if a.rotary else (low / 7, high / 7),
             chains.triad(rng), bool(rng.integers(2)), 3.3)
        for a in machine.axes
    )  # fmt: skip
    machine = machine.replace(axes=axes)
    again = loads(dumps(machine), "random.toml")
    assert again == loads(dumps(again))
    assert again.effects == machine.effects
    assert again.tool.point == machine.tool.point
    for mine, theirs in zip(machine.axes, again.axes, strict=True):
        assert (mine.range, mine.point, mine.pitch) == (theirs.range, theirs.point, theirs.pitch)
        np.testing.assert_allclose(mine.direction, theirs.direction, atol=1e-15)
        np.testing.assert_allclose(mine.error_axes, theirs.error_axes, atol=1e-14)


def test_what_changes_the_hash_and_what_does_not() -> None:
    machine = loads(GOOD)
    assert len(machine.hash) == 12
    assert int(machine.hash, 16) >= 0
    for same in (
        loads(changed("DMU 50", "DMU 60")),
        loads(changed("covariance", "#")),
        loads(changed("2026-11-21", "2026-11-22")),
        loads(changed("pitch = 10.0", "")),
        machine.replace(effects=(*machine.effects, Effect("EYY", (0.0,)))),
        loads(dumps(machine)),
    ):
        assert same.hash == machine.hash
    for other in (
        loads(changed("0.0103", "0.01030001")),
        loads(changed("154.996", "154.997")),
        loads(changed("linear = 0.25", "linear = 0.26")),
        loads(changed("[0, 0, -275.86]", "[0, 0, -275.87]")),
        machine.replace(workpiece_offset=(0.0, 0.0, 1.0)),
    ):
        assert other.hash != machine.hash


def test_a_table_says_its_direction_only_if_it_has_one() -> None:
    """So that the hash of a file from before there was a choice stays: it is in stamps and certificates."""
    known = Machine("slide", "w F X t", (Axis("X", False, False, (1.0, 0.0, 0.0)),))
    for way, said in (("both", False), ("negative", True)):
        machine = known.replace(effects=(Effect("EXX", (0.0, 0.01), PiecewiseLinear((0.0, 100.0), way)),))
        assert (f'direction = "{way}"' in dumps(machine)) == said
        assert loads(dumps(machine)) == machine
