"""Where a tracker's target is depends on the tool that carries it: against a simulation of three lines of its own.

A slide along Z turns about Y by EB and is shifted along X by EX, about and at the base origin carried with it: a target
at p with Z at zero is at z + R(EB) p + EX. In the tool it is at the tip, `tool_length` below the gauge line.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from measure.poses import machine
from ncfix.machine import Effect, Machine, State
from ncfix.machine.basis import Polynomial
from ncfix.measure.calibrate import calibrate
from ncfix.measure.contradictions import refusals
from ncfix.measure.measurement import Measurement

AROUND = np.array([[80.0, 0.0, 20.0], [-50.0, 60.0, -30.0], [-30.0, -60.0, 10.0]])
"""mm, three reflectors about the tip; their mean is the tip."""
EB, EX, BEND = 10e-6, 6e-3, 2e-3
"""rad, mm and mm at a tool of 100 mm, at Z 400, with the square of Z."""
SECOND_ORDER = 1e-5
"""mm: the data are exact to 9 digits after the point; squares of EB times levers of 1 m are 1e-7 mm."""


def slide(bending: bool, zero: bool = False) -> Machine:
    effects = [Effect("EBZ", (EB,), Polynomial(degree=(2,)), scale=400.0, reference=(0.0, 0.0, 0.0))]
    effects.append(Effect("EXZ", (EX,), Polynomial(degree=(2,)), scale=400.0, reference=(0.0, 0.0, 0.0)))
    if bending:
        square = Polynomial(degree=(2,))
        bend = Effect("EYZ", (BEND,), square, scale=400.0, times="tool_length", times_center=0.0, times_scale=100.0)
        effects.append(bend)
    if zero:
        effects = [replace(e, coefficients=(0.0,)) for e in effects]
    return machine("three_axis").replace(effects=tuple(effects))


def seen(lengths: tuple[float, ...], moving: bool, bending: bool, headers: tuple[tuple[str, str], ...]) -> Measurement:
    z, length, k = (g.ravel() for g in np.meshgrid(np.linspace(-50, 450, 21), lengths, range(3), indexing="ij"))
    k = k.astype(int)
    p = AROUND[k] - np.stack([0 * z, 0 * z, length if moving else 0 * z + 150.0], axis=-1)
    u = (z / 400.0) ** 2
    cos, sin = np.cos(EB * u), np.sin(EB * u)
    bent = BEND * length / 100 * u if bending else 0 * u
    at = np.stack([cos * p[:, 0] + sin * p[:, 2] + EX * u, p[:, 1] + bent, cos * p[:, 2] - sin * p[:, 0] + z], axis=-1)
    at += [700.0, -400.0, 250.0]
    columns = {"Z": z, "tool_length": length, **dict(zip("xyz", np.round(at, 9).T, strict=True))}
    labels = {"target": tuple(str(each) for each in k), "set": ("1",) * len(z)}
    return Measurement("points", (("frame", "base"), ("noise_um", "0.1"), *headers), columns, labels)


def bias(data: Measurement, bending: bool) -> float:
    """mm: the largest error of the calibrated tip along Z, at a tool of 190 mm; shifts are those of the set-up."""
    found = calibrate([data], slide(bending, zero=True), loss="none").machine
    q = np.zeros((10, 3))
    q[:, found.axis_names.index("Z")] = np.linspace(-50, 400, 10)
    state = State(190.0)
    left = found.error(q, state)[:, :3] - slide(bending).error(q, state)[:, :3]
    return float(np.abs(left).max())


def stated(length: float) -> tuple[tuple[str, str], ...]:
    return tuple(("target", f"{k} {x} {y} {z - length}") for k, (x, y, z) in enumerate(AROUND))


TOOL, HEAD = (("carried_by", "tool"),), (("carried_by", "spindle"),)


@pytest.mark.parametrize("bending", [False, True])
@pytest.mark.parametrize(
    ("lengths", "moving", "headers"),
    [
        pytest.param((190.0,), True, TOOL, id="one tool, the fit starts at its tip"),
        pytest.param((190.0,), True, (*TOOL, *stated(190.0)), id="one tool, where the target really is"),
        pytest.param((120.0, 190.0, 300.0), True, TOOL, id="three tools"),
        pytest.param((120.0, 190.0, 300.0), True, (*TOOL, *stated(120.0)), id="three tools, place with the first"),
        pytest.param((190.0, 120.0), True, (*TOOL, stated(190.0)[1]), id="the longer first, one place said"),
        pytest.param((120.0, 190.0), False, (*HEAD, *stated(150.0)), id="on the head"),
    ],
)
def test_the_tool_length_leaves_no_bias(lengths, moving, headers, bending):
    """Targets taken at a tool of no length leave 10 urad at 190 mm: 1.9 um."""
    assert bias(seen(lengths, moving, bending, headers), bending) < SECOND_ORDER


def test_a_tool_of_no_length_would_leave_1_9_um():
    """What a tip at the wrong end of the tool costs: the same readings, stated at the gauge line."""
    assert bias(seen((190.0,), True, False, (*TOOL, *stated(0.0))), False) == pytest.approx(1.9e-3, rel=1e-3)


def test_targets_on_the_head_are_not_taken_for_ones_in_the_tool_without_a_word():
    """Of two tools, either half of the rows may be the outliers, or the model fits neither: rounding decides."""
    data = seen((120.0, 190.0), False, False, (*TOOL, *stated(150.0)))
    found = calibrate([data], slide(False, zero=True))
    assert {"NCF622", "NCF642"} & {message.code for message in refusals(found, ())}
