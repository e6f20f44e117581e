"""Ball-bar tests by themselves: centre, size and form, and the figures of ISO 230-4."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from measure.poses import machine
from ncfix.machine import Effect, Machine
from ncfix.machine.basis import Backlash, Polynomial
from ncfix.measure.checks import checked
from ncfix.measure.instruments import observe
from ncfix.measure.lengths import BallBarFigures, ball_bar_figures
from ncfix.measure.measurement import Measurement

RADIUS = 150.0
THREE = machine("three_axis").replace(effects=())
LINE = Polynomial(degree=(1,))


def circle(known: Machine, offset=(0.0, 0.0, 0.0), normal: str = "Z") -> BallBarFigures:
    """Counter-clockwise and back, as this machine runs it, with the centre ball off by `offset` mm."""
    turn = np.deg2rad(np.concatenate([np.arange(0, 361, 2), np.arange(360, -1, -2)]))
    first, second = {"Z": "XY", "X": "YZ"}[normal]
    middle = THREE.ranges.mean(axis=1)
    columns = {axis: np.full(len(turn), middle[THREE.axis_names.index(axis)]) for axis in "XYZ"}
    columns[first] = columns[first] + RADIUS * np.cos(turn)
    columns[second] = columns[second] + RADIUS * np.sin(turn)
    columns |= {f"dir_{axis}": np.sign(np.gradient(columns[axis])) for axis in (first, second)}
    centre = THREE.tip(middle, 0.0)
    columns |= {f"c{axis}": np.full(len(turn), centre[k]) for k, axis in enumerate("xyz")}
    columns["radius"] = np.full(len(turn), RADIUS)
    plan = Measurement("length", (), columns)
    seen = observe(plan, THREE)
    (found,) = ball_bar_figures(seen.with_values(seen.predict(known, np.asarray(offset))), THREE)
    return found


def test_a_perfect_machine_has_the_set_up_only():
    found = circle(THREE, (0.01, -0.02, 0.0))
    assert found.centre == pytest.approx((10, -20, 0), abs=2e-3)
    assert found.size == pytest.approx(0, abs=3e-3)  # (30 um)^2 / 300 mm, the second order of the set-up
    assert found.form < 6e-3
    assert found.radial == pytest.approx(2 * np.hypot(10, 20), rel=1e-3)


def test_a_scale_is_size_and_a_squareness_is_form():
    scales = tuple(replace(Effect(name, (20e-6,), LINE)) for name in ("EXX", "EYY"))
    found = circle(THREE.replace(effects=scales))
    assert abs(found.size) == pytest.approx(20e-6 * RADIUS * 1e3, rel=1e-3)
    assert found.form < 2e-3
    found = circle(THREE.replace(effects=(Effect("EC0Y", (20e-6,)),)))
    # r e sin 2t / 2: an ellipse at 45 degrees
    assert found.size == pytest.approx(0, abs=1e-3)
    assert found.form == pytest.approx(20e-6 * RADIUS * 1e3, rel=1e-3)


def test_play_is_hysteresis_of_the_two_ways():
    """Half the play to each side: at every angle off the axes the ways differ by it times |sin| or |cos|."""
    found = circle(THREE.replace(effects=(Effect("EXX", (0.006,), Backlash()),)))
    assert found.circle is not None
    # at 0 degrees X turns round: the sides change there
    assert pytest.approx(6, rel=0.02) == found.circle.H
    assert found.circle.G_clockwise == pytest.approx(found.circle.G_counter, rel=0.02)
    assert found.circle.Gb >= found.circle.G_counter


def test_the_plane_is_found():
    found = circle(THREE.replace(effects=(Effect("EZZ", (30e-6,), LINE),)), normal="X")
    assert found.circle is not None
    assert pytest.approx(found.size, abs=1e-6) == found.circle.D
    assert found.circle.F_max - found.circle.F_min == pytest.approx(found.form, abs=1e-6)


def test_other_lengths_have_no_such_figures():
    gauge = Measurement("length", (), {f"{end}{axis}": np.ones(3) for end in "ab" for axis in "xyz"})
    assert list(ball_bar_figures(gauge, THREE)) == []


def bar(length: float | None) -> Measurement:
    turn = np.deg2rad(np.arange(0, 360, 5))
    columns = {"X": RADIUS * np.cos(turn), "Y": RADIUS * np.sin(turn), "Z": np.full(len(turn), 100.0)}
    centre = THREE.tip(np.array([[0.0, 0.0, 100.0]]), 120.0)[0]
    columns |= {f"c{axis}": np.full(len(turn), centre[k]) for k, axis in enumerate("xyz")}
    columns |= {name: np.full(len(turn), RADIUS) for name in ("radius", "length")}
    if length is not None:
        columns["tool_length"] = np.full(len(turn), length)
    return Measurement("length", (), columns)


@pytest.mark.parametrize(("length", "codes"), [(120.0, []), (121.0, []), (None, ["NCF625"]), (170.0, ["NCF625"])])
def test_a_circle_about_another_place_is_remarked(length, codes):
    """Without its tool length the tip is above the centre ball: errors would come out of another size."""
    assert [message.code for message in checked(bar(length), THREE).remarks] == codes
