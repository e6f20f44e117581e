"""Elementary transformations: their matrices, inverses and power series, against numbers."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from ncfix.diagnostics import UsageError
from ncfix.machine import se3
from ncfix.machine.symbolic import Chain, Size, Variable, derive
from ncfix.machine.symbolic.chain import UNITS, Rotation, Screw, Step, Translation, inverse
from ncfix.machine.symbolic.derivation import Expansion
from ncfix.machine.symbolic.printing import compiled

a, b, t = (Variable(name, Size.SMALL).symbol for name in "abt")
X, C = (Variable(name, axis=True).symbol for name in "XC")
SMALLS = (a, b, t)
SIXTIETH = sp.pi / 3
STEPS: list[Step] = [
    Translation((X + a, b, sp.Integer(3))),
    Rotation(UNITS["x"], C + 2 * a),
    Rotation((sp.Integer(0), sp.sin(SIXTIETH), sp.cos(SIXTIETH)), -C + b),
    Screw((a, b, -t), (t, sp.Integer(0), 4 * a)),
]


def value(step: Step, numbers: dict[sp.Expr, float]) -> np.ndarray:
    """The exact matrix, by the numeric engine."""

    def at(vector: tuple[sp.Expr, ...]) -> np.ndarray:
        return np.array([float(component.subs(numbers)) for component in vector])

    if isinstance(step, Translation):
        return se3.shift(at(step.vector))
    if isinstance(step, Rotation):
        return se3.turn(at(step.direction) * float(step.angle.subs(numbers)))
    return se3.exp(np.concatenate([at(step.velocity), at(step.rotation)]))


def series_value(step: Step, order: int, numbers: dict[sp.Expr, float]) -> np.ndarray:
    """The truncated power series at those numbers."""
    total = np.eye(4)
    for factor in Expansion(SMALLS, order).step(step):
        terms = [
            np.array(matrix.subs(numbers), dtype=float) * np.prod([numbers[SMALLS[i]] for i in key])
            for key, matrix in factor.items()
        ]
        total = total @ sum(terms)
    return total


@pytest.mark.parametrize("step", STEPS, ids=lambda step: type(step).__name__)
@pytest.mark.parametrize("order", [1, 2, 3])
def test_power_series_leave_the_next_order(step: Step, order: int) -> None:
    numbers = {X: 12.0, C: 0.7, a: 2e-3, b: -1e-3, t: 3e-3}
    error = np.abs(series_value(step, order, numbers) - value(step, numbers)).max()
    assert error < 20 * (4e-3) ** (order + 1)


@pytest.mark.parametrize("step", STEPS, ids=lambda step: type(step).__name__)
def test_inverse_steps_undo(step: Step) -> None:
    numbers = {X: 12.0, C: 0.7, a: 0.2, b: -0.1, t: 0.3}
    (back,) = inverse([step])
    np.testing.assert_allclose(value(step, numbers) @ value(back, numbers), np.eye(4), atol=1e-15)


def test_linear_trig_leaves_out_the_squares() -> None:
    """Freeman and Ford's substitution: no -t^2/2 of the cosine."""
    chain = Chain("lever", (Variable("t", Size.SMALL), Variable("L")), lever())
    true, paper = derive(chain, 2), derive(chain, 2, linear_trig=True)
    assert true.error["dx"] == -sp.Symbol("L", real=True) * t**2 / 2
    assert paper.error["dx"] == 0
    assert true.error["dy"] == paper.error["dy"] == sp.Symbol("L", real=True) * t


def lever() -> tuple[Step, ...]:
    return Rotation(UNITS["z"], t), Translation((sp.Symbol("L", real=True), sp.Integer(0), sp.Integer(0)))


def test_higher_orders_of_a_lever_are_sine_and_cosine() -> None:
    derivation = derive(Chain("lever", (Variable("t", Size.SMALL), Variable("L")), lever()), 5)
    length = sp.Symbol("L", real=True)
    assert sp.expand(derivation.error["dx"] - length * (-(t**2) / 2 + t**4 / 24)) == 0
    assert sp.expand(derivation.error["dy"] - length * (t - t**3 / 6 + t**5 / 120)) == 0
    assert derivation.error["rz"] == t  # the rotation vector has no higher orders


@pytest.mark.parametrize("order", [0, -1])
def test_the_order_is_at_least_one(order: int) -> None:
    with pytest.raises(UsageError, match="NCF392"):
        derive(Chain("lever", (Variable("t", Size.SMALL), Variable("L")), lever()), order)


def test_fork_head_by_hand() -> None:
    """C about z, A about x through a point H below it, tool G: Freeman and Ford's first test object, simpler."""
    text = {name: Variable(name, axis=name in "AC", rotary=name in "AC") for name in ("A", "C", "G", "H")}
    small = {name: Variable(name, Size.SMALL) for name in ("EA", "OY", "ES")}
    v = {name: variable.symbol for name, variable in (text | small).items()}
    zero = sp.Integer(0)
    steps = (
        Rotation(UNITS["z"], v["C"]),
        Translation((zero, v["OY"], -v["H"])),
        Rotation(UNITS["x"], v["A"] + v["EA"]),
        Rotation(UNITS["y"], v["ES"]),
        Translation((zero, zero, -v["G"])),
    )
    derivation = derive(Chain("fork head", (*text.values(), *small.values()), steps))
    A, C, G, H = (v[name] for name in "ACGH")
    assert sp.simplify(derivation.nominal["x"] + G * sp.sin(A) * sp.sin(C)) == 0
    assert sp.simplify(derivation.nominal["y"] - G * sp.sin(A) * sp.cos(C)) == 0
    assert sp.simplify(derivation.nominal["z"] + G * sp.cos(A) + H) == 0
    expected = -G * sp.cos(A) * sp.sin(C) * v["EA"] - sp.sin(C) * v["OY"] - G * sp.cos(C) * v["ES"]
    assert sp.simplify(derivation.error["dx"] - expected) == 0
    _, error = compiled(derivation)
    np.testing.assert_allclose(error(0.3, 0.5, 100.0, 40.0, EA=1e-4)[3:], [1e-4 * np.cos(0.5), 1e-4 * np.sin(0.5), 0])
