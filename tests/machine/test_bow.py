"""How far the error may bow on a straight motion is never more than the bound says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from conftest import some
from machine import chains
from ncfix.machine import Axis, Effect, GaugeLine, Machine, State, load
from ncfix.machine.basis import Backlash, Basis, ConstantBasis, Fourier, Periodic, Polynomial
from ncfix.machine.piecewise import PiecewiseConstant, PiecewiseLinear, Spline, Truncated

BASES: tuple[tuple[Basis, int], ...] = (
    (ConstantBasis(), 1),
    (Polynomial((0, 1, 2, 3)), 4),
    (Polynomial((5,)), 1),
    (Fourier((1, 3)), 4),
    (Periodic((1, 2), 0.7), 4),
    (Spline((-1, -1, -1, -1, -0.3, 0.1, 0.6, 1, 1, 1, 1)), 7),
    (Spline((-1, -1, 0.2, 1, 1), 1), 3),
)
STATE = State(80.0, 1)


def bows(machine: Machine, start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far the error leaves its chord, by looking at it, and the bound (k,)."""
    assert machine.bow is not None
    errors = []
    for share in np.linspace(0, 1, 33):
        q = (1 - share) * start + share * end
        errors.append(machine.actual_tip(q, STATE) - machine.tip(q, 80.0))
    share = np.linspace(0, 1, 33)[:, None, None]
    off = np.array(errors) - ((1 - share) * errors[0] + share * errors[-1])
    farthest = np.maximum(np.abs(start), np.abs(end)).max(axis=0)
    found = np.linalg.norm(off, axis=2).max(axis=0)
    return found, machine.bow.of(np.abs(end - start), farthest, 80.0, machine.rotary)[0]


@pytest.mark.parametrize(("basis", "size"), BASES, ids=lambda each: getattr(each, "name", each))
def test_bounds_of_a_basis(basis: Basis, size: int) -> None:
    rng = np.random.default_rng(size)
    u = np.linspace(-1, 1, 4001)
    for _ in range(20):
        coefficients = tuple(rng.normal(size=size).tolist())
        bounds = basis.bounds(coefficients, -1.0, 1.0)
        assert bounds is not None
        values = basis.combine(np.array([coefficients]), u, np.ones_like(u))[0]
        slopes = np.array(coefficients) @ basis.slopes(u, np.ones_like(u))
        assert np.abs(values).max() <= bounds[0] * (1 + 1e-12)
        assert np.abs(slopes[:-1]).max() <= bounds[1] * (1 + 1e-12)
        if not isinstance(basis, Spline) or basis.degree > 1:
            assert np.abs(np.diff(slopes[:-1]) / np.diff(u[:-1])).max() <= bounds[2] * (1 + 1e-9) + 1e-9


def test_bounds_with_kinks_and_directions() -> None:
    assert PiecewiseLinear((0.0, 1.0, 3.0)).bounds((0.0, -2.0, 1.0), -5, 5) == (2.0, 2.0, 0.0)
    assert PiecewiseConstant((0.0,)).bounds((1.0, -3.0), -5, 5) == (3.0, 0.0, 0.0)
    assert Backlash((0,)).bounds((0.01,), -np.inf, np.inf) == (0.01, 0.0, 0.0)
    assert Polynomial((1,)).bounds((1.0,), -np.inf, 0.0) is None
    assert Truncated((0.0,)).bounds((1.0, 1.0, 1.0), -1, 1) is None


@pytest.mark.parametrize("seed", range(some(8)))
def test_any_chain_with_smooth_errors(seed: int) -> None:
    """Polynomials in all error motions of random chains, location errors of every joint."""
    rng = np.random.default_rng(seed)
    plain = chains.random_chain(rng, 5)
    travel = [(-2.0, 2.0) if axis.rotary else (-300.0, 300.0) for axis in plain.axes]
    axes = tuple(
        Axis(axis.name, axis.rotary, axis.workpiece_side, axis.direction, axis.point, limits)
        for axis, limits in zip(plain.axes, travel, strict=True)
    )
    names = {axis.name: axis for axis in axes}
    effects = []
    for effect in chains.random_errors(rng, plain).effects:
        scale = 1.0
        if effect.joint in names:
            axis = names[effect.joint]
            scale = axis.range[1] / axis.unit
        effects.append(Effect(effect.name, effect.coefficients, effect.basis, 0.0, scale, reference=effect.reference))
    machine = plain.replace(axes=axes, effects=tuple(effects))
    low, high = np.array(travel).T
    start = rng.uniform(low, high, (400, 5))
    end = np.clip(
        start + rng.uniform(-0.5, 0.5, start.shape) * (high - low) * 10 ** rng.uniform(-3, 0, (400, 1)), low, high
    )
    found, bound = bows(machine, start, end)
    assert (found <= bound).all()
    assert found.max() > 1e-4


def test_the_machine_of_the_benchmarks_is_bounded(root: Path) -> None:
    """A block of the benchmark, a third of a millimetre and a third of a degree, bows by less than 0.1 um."""
    machine = load(root / "benchmarks" / "five_axis.toml")
    start = np.array([[0.3, 0.5, 200.0, 200.0, 20.0]])
    found, bound = bows(machine, start, start + np.array([0.006, 0.006, 0.3, 0.3, 0.1]))
    assert found[0] < bound[0] < 1e-4


def test_without_ranges_or_with_products_no_bound_is_known(root: Path) -> None:
    """Without ranges polynomials have no bounds, and neither have products of signals."""
    axes = (Axis("X", False, False, (1.0, 0.0, 0.0)),)
    machine = Machine("one", "w F X t", axes, GaugeLine(), (Effect("EXX", (1e-3,), Polynomial((1,))),))
    assert machine.bow is None
    ranged = machine.replace(axes=(Axis("X", False, False, (1.0, 0.0, 0.0), range=(0.0, 100.0)),))
    assert ranged.bow is not None
    times = Effect("EXX", (1e-3,), Polynomial((1,)), times="X")
    assert ranged.replace(effects=(times,)).bow is None
