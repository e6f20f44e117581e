"""Limits on rates: kept, met exactly where something is decided, and no change where none is needed."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import some
from ncfix.compensate.plan.strategies import PoseSequence, limited

RATE = 0.01
FUZZ = 1e-12
wanted = st.lists(st.floats(-1e-3, 1e-3, allow_nan=False), min_size=1, max_size=40)


def path(
    n: int, step: float = 0.01, begins: list[int] | None = None, pins: dict[int, float] | None = None
) -> PoseSequence:
    """Poses at equal steps of rotary travel."""
    start, pinned, decided = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool), np.zeros((n, 1))
    start[begins or []] = True
    for row, value in (pins or {}).items():
        pinned[row], decided[row] = True, value
    return PoseSequence(np.zeros(n), np.full(n, step), start, pinned, decided)


@settings(max_examples=some(200), deadline=None)
@given(wanted)
def test_no_step_is_above_the_rate(values: list[float]) -> None:
    result = limited(np.array(values)[:, None], path(len(values)), 0.0, RATE)
    assert np.abs(np.diff(result[:, 0])).max(initial=0.0) <= RATE * 0.01 + FUZZ
    assert result.min() >= min(values) - FUZZ
    assert result.max() <= max(values) + FUZZ


@settings(max_examples=some(100), deadline=None)
@given(wanted)
def test_what_keeps_the_rate_stays_as_it_is(values: list[float]) -> None:
    slow = np.cumsum(np.array(values) * RATE * 0.01 / 1e-3)[:, None]
    np.testing.assert_allclose(limited(slow, path(len(values)), 0.0, RATE), slow, rtol=0, atol=FUZZ)


def test_a_new_stretch_is_free_of_what_was_before() -> None:
    values = np.array([0.0, 0.0, 1e-3, 1e-3])[:, None]
    np.testing.assert_allclose(limited(values, path(4, begins=[2]), 0.0, RATE), values, atol=FUZZ)
    assert np.abs(limited(values, path(4), 0.0, RATE) - values).max() > 4e-4


def test_decided_values_are_met_and_the_rate_kept_towards_them() -> None:
    values = np.full((11, 1), 1e-3)
    result = limited(values, path(11, pins={0: 0.0, 10: 2e-4}), 0.0, RATE)[:, 0]
    assert result[0] == 0.0
    assert result[10] == 2e-4
    assert np.abs(np.diff(result)).max() <= 1e-4 + FUZZ
    assert abs(result[4] - 4e-4) < FUZZ


def test_the_way_of_the_tip_allows_a_change_too() -> None:
    values = np.array([0.0, 1e-3])[:, None]
    still = np.zeros(2, dtype=bool)
    moving = PoseSequence(np.array([0.0, 20.0]), np.zeros(2), still, still, np.zeros((2, 1)))
    assert abs(np.diff(limited(values, moving, 2e-5, 0.0)[:, 0])[0] - 20 * 2e-5) < FUZZ
