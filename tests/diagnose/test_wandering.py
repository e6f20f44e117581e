"""What wanders for a quarter of an hour is the instrument's; what drifts for hours is not, if a name explains it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from diagnose.worlds import SIGMA_UM, World
from ncfix.diagnose.background import everything_of
from ncfix.diagnose.groups import Group
from ncfix.diagnose.view import view
from ncfix.diagnose.wandering import LASTING, background
from ncfix.measure.measurement import Array


@pytest.fixture(scope="module")
def world() -> World:
    return World.of("three_axis", 1, 120)


def wander(world: World, shown: Array, named: Sequence[Group]) -> float:
    """How much the instrument is said to wander where this is in the data."""
    seen = view([world.measured(shown, np.random.default_rng(5), stated=True)], world.machine)
    return background(seen, everything_of(seen, world.gathered.groups), seen.relative, named).wander


@pytest.mark.parametrize("name", ["drift Z", "thermal bend EAZ"])
def test_a_drift_of_hours_is_not_taken_for_a_wandering_instrument(world: World, name: str) -> None:
    shown = world.effect(name, 5.0, np.random.default_rng(1))
    assert wander(world, shown, ()) > wander(world, shown, world.gathered.groups)


def test_a_wandering_instrument_is_not_taken_for_effects(world: World) -> None:
    """Of 0.7 of the noise, every component for itself, remembered for a quarter of an hour."""
    seen, random = world.view, np.random.default_rng(2)
    time = seen.column("time_s")
    keep = np.exp(-np.diff(time, prepend=time[0]) / LASTING)
    state, walked = random.normal(size=3), np.empty((len(time), 3))
    for row, share in enumerate(keep):
        state = share * state + np.sqrt(1 - share**2) * random.normal(size=3)
        walked[row] = state
    shown = 0.7 * SIGMA_UM * walked[seen.row, seen.component]
    assert wander(world, shown, world.gathered.groups) >= 0.35
