"""The judge's own machine model against numbers worked out by hand from the contract of the machine file."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from differential.errors import LETTERS, Machine, from_dict

LINEAR = {axis: {"type": "linear", "direction": direction} for axis, direction in
          (("X", [1, 0, 0]), ("Y", [0, 1, 0]), ("Z", [0, 0, 1]))}  # fmt: skip
TABLE_A = {"type": "rotary", "direction": [1, 0, 0], "point": [0, 0, -50]}
TABLE_C = {"type": "rotary", "direction": [0, 0, 1], "point": [0, 0, 0]}


def built(topology: str, *effects: dict[str, Any], **axes: dict[str, Any]) -> Machine:
    """A machine of three linear axes and others, with effects."""
    tool = {"direction": [0, 0, 1], "point": [0, 0, 0]}
    table = {"name": "m", "topology": topology, "axis": LINEAR | axes, "tool": tool, "effect": list(effects)}
    return from_dict(table)


def at(**position: float) -> np.ndarray:
    q = np.zeros((1, 9))
    for axis, value in position.items():
        q[0, LETTERS.index(axis)] = value
    return q


def error(machine: Machine, length: float = 0.0, **position: float) -> np.ndarray:
    q = at(**position)
    return (machine.actual_tip(q, length) - machine.tip(q, length))[0]


CASES: dict[str, tuple[Machine, float, dict[str, float], list[float]]] = {
    "EXX on the tool side": (
        built("w F X Y Z t", {"name": "EXX", "coefficients": [0.01]}), 0, {"X": 5}, [0.01, 0, 0]),
    "EXX on the workpiece side acts with a minus sign": (
        built("w X F Y Z t", {"name": "EXX", "coefficients": [0.01]}, X=LINEAR["X"] | {"direction": [-1, 0, 0]}),
        0, {"X": 5}, [-0.01, 0, 0]),
    "a polynomial in u": (
        built("w F X Y Z t", {"name": "EZX", "basis": "polynomial", "degree": [1, 2], "center": 100, "scale": 50,
                              "coefficients": [0.01, 0.002]}), 0, {"X": 200}, [0, 0, 0.01 * 2 + 0.002 * 4]),
    "a rotation has its arm from the reference carried along": (
        built("w F X Y Z t", {"name": "ECX", "coefficients": [1e-4], "reference": [0, -200, 0]}),
        0, {"X": 300, "Y": 100}, [-0.03, 0, 0]),
    "a pitch with the tool length": (
        built("w F X Y Z t", {"name": "EBX", "coefficients": [1e-4]}), 120, {"Z": 20}, [-0.01, 0, 0]),
    "EC0Y turns the direction of Y about C": (
        built("w F X Y Z t", {"name": "EC0Y", "coefficients": [1e-4]}), 0, {"Y": 100}, [-0.01, 0, 0]),
    "and moves nothing else": (
        built("w F X Y Z t", {"name": "EC0Y", "coefficients": [1e-4]}), 0, {"X": 100, "Z": 100}, [0, 0, 0]),
    "carried, it turns what Y carries too": (
        built("w F Y X Z t", {"name": "EC0Y", "coefficients": [1e-4], "carried": True}), 0, {"X": 100}, [0, 0.01, 0]),
    "a shifted rotary axis does nothing at zero": (
        built("w C F X Y Z t", {"name": "EX0C", "coefficients": [0.02]}, C=TABLE_C), 0, {"X": 30}, [0, 0, 0]),
    "and twice its shift after half a turn": (
        built("w C F X Y Z t", {"name": "EX0C", "coefficients": [0.02]}, C=TABLE_C), 0, {"C": 180}, [0.04, 0, 0]),
    "a zero offset of C": (
        built("w C F X Y Z t", {"name": "EC0C", "coefficients": [1e-4]}, C=TABLE_C), 0, {"X": 100}, [0, -0.01, 0]),
    "the errors of a table turn with the workpiece frame, not with the axis": (
        built("w C F X Y Z t", {"name": "EXC", "coefficients": [0.01]}, C=TABLE_C), 0, {"C": 90}, [0, 0.01, 0]),
    "unless they are given in a moving frame": (
        built("w C F X Y Z t", {"name": "EXC", "coefficients": [0.01]}, C=TABLE_C | {"error_frame": "moving"}),
        0, {"C": 90}, [-0.01, 0, 0]),
    "a tilted triad": (
        built("w F X Y Z t", {"name": "EXX", "coefficients": [0.01]},
              X=LINEAR["X"] | {"error_axes": [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]}), 0, {}, [0, 0.01, 0]),
    "a fourier series in the angle": (
        built("w A F X Y Z t", {"name": "EYA", "basis": "fourier", "order": [1, 2],
                                "coefficients": [0.01, 0.02, 0.004, 0.003]}, A=TABLE_A),
        0, {"A": 90, "Z": -50}, [0, 0, 0.02 - 0.004]),
    "a periodic error": (
        built("w F X Y Z t", {"name": "EXX", "basis": "periodic", "period": 20.0, "order": [1],
                              "coefficients": [0.0, 0.005]}), 0, {"X": 25}, [0.005, 0, 0]),
    "a table of values, held at its ends": (
        built("w F X Y Z t", {"name": "EXX", "basis": "table", "positions": [0, 10], "coefficients": [0.0, 0.01]}),
        0, {"X": 25}, [0.01, 0, 0]),
    "a shifted spindle": (
        built("w F X Y Z S t", {"name": "EY0S", "coefficients": [0.01]}), 0, {}, [0, 0.01, 0]),
    "a tilted spindle moves the tip by the tool length": (
        built("w F X Y Z S t", {"name": "EA0S", "coefficients": [1e-4]}), 150, {"X": 7}, [0, 0.015, 0]),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_tip_error_by_hand(name: str) -> None:
    machine, length, position, expected = CASES[name]
    np.testing.assert_allclose(error(machine, length, **position), expected, atol=2e-6)  # second order: 1e-4**2 * 150


def test_a_spline_is_the_polynomial_it_was_made_of() -> None:
    # On one interval a cubic B-spline is a Bezier curve: coefficients 0 0 0 1 give u**3.
    effect = {"name": "EXX", "basis": "spline", "degree": 3, "knots": [0] * 4 + [10] * 4, "coefficients": [0, 0, 0, 1]}
    machine = built("w F X Y Z t", effect)
    assert error(machine, X=5.0)[0] == pytest.approx(0.125)
    assert error(machine, X=50.0)[0] == pytest.approx(1.0)


def test_backlash_is_half_the_lost_motion_to_either_side() -> None:
    machine = built("w F X Y Z t", {"name": "EXX", "basis": "backlash", "coefficients": [0.02]})
    q, way = at(X=5), at(X=-1)
    assert machine.actual_tip(q, 0.0, way)[0, 0] == pytest.approx(5 - 0.01)
    assert machine.actual_tip(q, 0.0, -way)[0, 0] == pytest.approx(5 + 0.01)


@pytest.mark.parametrize("name", ["three", "table", "four_a", "five_ac", "five_bc"])
def test_correcting_and_embedding_are_inverse(machine: Callable[[str], Machine], name: str) -> None:
    model, rng = machine(name), np.random.default_rng(7)
    q = np.zeros((300, 9))
    q[:, :3], q[:, 3:6] = rng.uniform(-300, 300, (300, 3)), rng.uniform(-100, 100, (300, 3))
    corrected = model.corrected(q, 80.0)
    np.testing.assert_allclose(model.actual_tip(corrected, 80.0), model.tip(q, 80.0), atol=1e-9)
    np.testing.assert_allclose(model.embedded(corrected, 80.0), q, atol=1e-9)
    assert 0.02 < np.abs(corrected - q).max() < 1.0


def test_what_it_does_not_know_it_refuses() -> None:
    with pytest.raises(NotImplementedError):
        built("w F X Y Z t", {"name": "EXX", "coefficients": [0.01], "input": "temp_spindle"})
