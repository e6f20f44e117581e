"""What the candidates can show, against effects that are as physics has them; and which names act in the same way."""

from __future__ import annotations

import numpy as np
import pytest

from conftest import FULL
from diagnose.worlds import World
from ncfix.diagnosis.diagnosis import diagnose
from ncfix.machine import Effect
from ncfix.machine.basis import Fourier
from ncfix.measure.least_squares import orthonormal, without
from ncfix.measure.measurement import Array

ROUNDING = 1e-9
HARDLY = 2e-3
"""Share of squares that a form may lack: `groups.NEGLIGIBLE` is 3e-3 of all that it may show, and half is usual."""


@pytest.fixture(scope="module")
def world() -> World:
    return World.of("wCBXFZYSt", 3, 60)


def missed(world: World, name: str, shown: Array) -> float:
    """Share of squares of an error that the best form of a name cannot show, beside what is free."""
    base = orthonormal(world.data.base)
    left = without(base, shown[:, None])
    forms = [group.columns for group in world.visible.groups if group.owner.name == name]
    rests = [without(orthonormal(without(base, form)), left) for form in forms]
    return min(float((rest**2).sum()) for rest in rests) / float((left**2).sum())


@pytest.mark.parametrize("held", [-0.8, -0.3, 0.1, 0.55])
def test_a_scale_may_be_held_anywhere(world: World, held: float) -> None:
    low, high = world.data.measured.spans["X"]
    place = (low + high) / 2 + held * (high - low) / 2
    unit = world.data.design([Effect("EXX", (0.0,), times="X", times_center=place, times_scale=100.0)])[:, 0]
    time = world.data.column("time_s")[world.data.row]
    clock = 2 * (time - time.mean()) / np.ptp(time)
    assert missed(world, "thermal scale X", unit * np.sin(2.5 * clock)) < HARDLY


@pytest.mark.parametrize("ratio", [0.75, 1.0, 1.3])
def test_a_slide_tilts_by_nearly_the_slope(world: World, ratio: float) -> None:
    """A bow u^2 without its mean, and its slope 2 u times the ratio, are within one of the loadings."""
    sag, (low, high) = world.candidate("bed sag X"), world.data.measured.spans["X"]
    assert [effect.name for effect in sag.effects[2:4]] == ["EZX", "EBX"]
    units = np.where([[effect.rotational] for effect in sag.effects], (high - low) / 2, 1.0)
    asked, rests = np.zeros((2, len(sag.effects), 5)), []
    asked[:, 2, :3] = -1 / 3, 0.0, 1.0
    asked[:, 3, 1] = 2 * ratio, -2 * ratio
    for each in sag.loadings:
        span = orthonormal((units[..., None] * each.reshape(*asked.shape[1:], -1)).reshape(len(each), -1))
        rests += [without(span, coefficients.reshape(-1, 1)) for coefficients in asked]
    assert min(np.abs(rest).max() for rest in rests) < ROUNDING


def test_a_wobble_has_overtones(world: World) -> None:
    columns = world.data.design([Effect("EAC", (0.0,) * 6, Fourier(order=(1, 5, 7)))])
    assert missed(world, "wobble C", columns @ np.array([1.0, 0.2, 0.1, 0.0, 0.05, 0.05])) < HARDLY


def test_waves_of_a_worm_are_no_encoder(world: World) -> None:
    """A worm of six waves that swells along the turn, which has orders five and seven besides."""
    columns = world.data.design([Effect("ECC", (0.0,) * 6, Fourier(order=(5, 6, 7)))])
    assert (
        missed(world, "encoder C", columns @ np.array([0.15, 0.0, 1.0, 0.0, 0.15, 0.0])) > 0.5
    )  # 8 columns, 60 poses; less than 2e-3 with orders up to 8


WAVES = [("wCBXFZYSt", 1, 12.0), *([("wCBXFZYSt", 3, 6.0), ("wCAYFXZSt", 4, 20.0)] if FULL else [])]


@pytest.mark.parametrize(("name", "seed", "size_um"), WAVES)
def test_a_name_that_another_covers_has_that_one_next_to_it(name: str, seed: int, size_um: float) -> None:
    """One wave of EZC a turn is a sag and a face run-out: a run-out may have more waves, a sag grows with the load.

    The noise decides which is likelier: what it makes of the further waves is no reason to name one of them alone.
    """
    world, random = World.of(name, seed, 100), np.random.default_rng(seed)
    turned = world.data.q[:, world.machine.axis_names.index("C")][world.data.row]
    wave = world.data.design([Effect("EZC", (0.0,))])[:, 0] * np.cos(turned - 0.7)
    shown = world.data.rms(wave)
    data = world.measured(wave * size_um / shown + world.clutter(random, 0.7), random)
    found = diagnose([data], world.machine)
    (first,) = found.findings
    others = found.selected.runners_up[first.candidate.name]
    second, third, *_ = sorted(others, key=lambda each: -others[each])
    assert {first.candidate.name, second} == {"gravity sag C", "axial C"}
    assert first.aliases == (second,)
    assert others[third] < others[second] / 10


def test_a_spindle_that_grows_may_be_a_frame_that_drifts_where_no_tool_turns() -> None:
    """On three axes either moves the tip alike; their courses are assumed, and the set holds both."""
    world, random = World.of("three_axis", 5, 90), np.random.default_rng(5)
    data = world.measured(world.effect("spindle growth", 10.0, random), random)
    found = diagnose([data], world.machine)
    first = found.findings[0]
    assert {"spindle growth", "drift Z"} <= {first.candidate.name, *first.aliases}
