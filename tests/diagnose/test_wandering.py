"""What wanders for a quarter of an hour is the instrument's; what drifts for hours is not, if a name explains it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from diagnose.worlds import SIGMA_UM, World
from ncfix.diagnosis.effect_form import EffectForm
from ncfix.diagnosis.evidence import DRIFT_TIME
from ncfix.diagnosis.noise import estimated_background, everything_covariance
from ncfix.diagnosis.residual_data import residual_data
from ncfix.measure.measurement import Array


@pytest.fixture(scope="module")
def world() -> World:
    return World.of("three_axis", 1, 120)


def drift(world: World, shown: Array, named: Sequence[EffectForm]) -> float:
    """How much the instrument is said to wander where this is in the data."""
    seen = residual_data([world.measured(shown, np.random.default_rng(5), stated=True)], world.machine)
    return estimated_background(seen, everything_covariance(seen, world.visible.groups), seen.relative, named).drift


@pytest.mark.parametrize("name", ["drift Z", "thermal bend EAZ"])
def test_a_drift_of_hours_is_not_taken_for_a_wandering_instrument(world: World, name: str) -> None:
    shown = world.effect(name, 5.0, np.random.default_rng(1))
    assert drift(world, shown, ()) > drift(world, shown, world.visible.groups)


def test_a_wandering_instrument_is_not_taken_for_effects(world: World) -> None:
    """Of 0.7 of the noise, every component for itself, remembered for a quarter of an hour."""
    seen, random = world.data, np.random.default_rng(2)
    time = seen.column("time_s")
    keep = np.exp(-np.diff(time, prepend=time[0]) / DRIFT_TIME)
    state, walked = random.normal(size=3), np.empty((len(time), 3))
    for row, share in enumerate(keep):
        state = share * state + np.sqrt(1 - share**2) * random.normal(size=3)
        walked[row] = state
    shown = 0.7 * SIGMA_UM * walked[seen.row, seen.component]
    assert drift(world, shown, world.visible.groups) >= 0.35
