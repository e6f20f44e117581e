"""ISO 230-2 from direct readings: by hand, and the order that the figures must have."""

from __future__ import annotations

import numpy as np
import pytest

from ncfix.measure.direct import positioning_figures
from ncfix.measure.measurement import Measurement


def readings(value: np.ndarray, side: np.ndarray, component: str = "EXX") -> Measurement:
    """value, side (runs, places): five places at 100 mm."""
    runs, places = value.shape
    position = np.tile(np.arange(places) * 100.0, runs)
    columns = {"position": position, "direction": side.ravel(), "value": value.ravel()}
    n = runs * places
    labels = {"axis": (component[2],) * n, "component": (component,) * n, "set": ("1",) * n}
    return Measurement("axis", (), columns, labels)


def test_figures_of_two_runs_worked_out_by_hand():
    up, down = np.array([[0.0, 4.0], [2.0, 6.0]]), np.array([[-3.0, 1.0], [-1.0, 3.0]])
    value = np.concatenate([up, down]) * 1e-3
    side = np.concatenate([np.ones((2, 2)), -np.ones((2, 2))])
    (found,) = positioning_figures(readings(value, side))
    s = np.sqrt(2.0)  # of two values 2 um apart
    # means: up 1, 5; down -2, 2
    assert pytest.approx(7) == found.E
    assert pytest.approx(4) == found.M
    assert pytest.approx(3) == found.B
    assert found.mean_reversal == pytest.approx(3)
    assert pytest.approx(4 * s + 3) == found.R
    assert pytest.approx(7 + 4 * s) == found.A
    assert found.runs == 2
    # one side alone: means 4 um apart and 2 s on either end; 4 s
    assert [found.E_up, found.E_down] == pytest.approx([4, 4])
    assert [found.A_up, found.A_down] == pytest.approx([4 + 4 * s] * 2)
    assert [found.R_up, found.R_down] == pytest.approx([4 * s] * 2)


def test_the_order_that_laspas_s_tables_keep():
    """A is no smaller than E, R no smaller than the reversal (thesis, Tables 4 to 6)."""
    random = np.random.default_rng(0)
    for _ in range(20):
        side = np.concatenate([np.ones((5, 9)), -np.ones((5, 9))])
        value = 1e-3 * (random.standard_normal(9) * 5 + side * random.uniform(0, 4) + random.standard_normal((10, 9)))
        (found,) = positioning_figures(readings(value, side))
        assert found.A >= found.E >= found.M
        assert found.R >= found.B >= abs(found.mean_reversal)


def test_one_run_has_no_repeatability_and_one_side_no_reversal():
    (found,) = positioning_figures(readings(np.array([[1e-6, 3e-6, 2e-6]]), np.ones((1, 3)), "EAX"))
    assert np.isnan([found.A, found.R, found.B, found.mean_reversal]).all()
    assert pytest.approx(2) == found.E
    assert pytest.approx(2) == found.E_up
    assert np.isnan([found.A_up, found.R_up, found.E_down]).all()


def test_other_kinds_have_none():
    assert list(positioning_figures(Measurement("tcp", (), {"dx": np.zeros(3)}))) == []
