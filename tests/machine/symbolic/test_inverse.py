"""The nominal inverse: tip and tool direction back to the axes, on every kind of machine; and when there is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from conftest import some
from machine import chains
from ncfix.machine import Axis, GaugeLine, Machine, load
from ncfix.machine.symbolic import derive, inverse_nominal, load_chain

ROOT = Path(__file__).resolve().parents[3]


def solved(machine: Machine, pose: np.ndarray, length: float, branch: int) -> np.ndarray:
    """Axis positions from the pose of the tool, by the formulas one after the other."""
    derivation = derive(machine, include="machine")
    known = {v.name: v.value for v in derivation.chain.dimensions} | {"tool_length": length, "branch": branch}
    known |= dict(zip("xyz", pose[:3, 3], strict=True))
    known |= dict(zip("ijk", pose[:3, :3] @ np.asarray(machine.tool.direction), strict=True))
    for axis, formula in inverse_nominal(derivation).formulas.items():
        known[axis] = float(formula.subs({sp.Symbol(name, real=True): value for name, value in known.items()}))
    return np.array([known[name] for name in machine.axis_names])


@pytest.mark.parametrize("name", ["dmu50", "wCAYFXZSt", "wCBXFZYSt", "three_axis", "angle_head"])
@pytest.mark.parametrize("branch", [1, -1])
def test_round_trip_on_the_shipped_machines(name: str, branch: int) -> None:
    machine = load(ROOT / f"examples/machines/{name}.toml").replace(effects=())
    rng = np.random.default_rng(3)
    for _ in range(4):
        q = np.where(
            machine.rotary, rng.uniform(-1.3, 1.3, len(machine.axes)), rng.uniform(-200, 200, 5)[: len(machine.axes)]
        )
        pose = machine.nominal(q, 80.0)
        back = machine.nominal(solved(machine, pose, 80.0, branch), 80.0)
        np.testing.assert_allclose(back[:3, 3], pose[:3, 3], rtol=0, atol=1e-8)
        direction = np.asarray(machine.tool.direction)
        np.testing.assert_allclose(back[:3, :3] @ direction, pose[:3, :3] @ direction, rtol=0, atol=1e-10)


@pytest.mark.parametrize("seed", range(some(3)))
def test_round_trip_with_skew_rotary_axes(seed: int) -> None:
    """Two rotary axes of any direction on either branch, with three linear axes between them."""
    rng = np.random.default_rng(seed)
    names = ["C", "X", "Y", "Z", "B"]
    axes = tuple(
        Axis(letter, letter in "BC", k < 2, chains.unit_vector(rng), chains.point(rng))
        for k, letter in enumerate(names)
    )
    machine = Machine("skew", "w C X F Y Z B t", axes, GaugeLine(chains.unit_vector(rng)))
    q = np.array([0.4, 30.0, -20.0, 50.0, -0.7])
    pose = machine.nominal(q, 60.0)
    direction = np.asarray(machine.tool.direction)
    for branch in (1, -1):
        back = machine.nominal(solved(machine, pose, 60.0, branch), 60.0)
        np.testing.assert_allclose(back[:3, 3], pose[:3, 3], rtol=0, atol=1e-8)
        np.testing.assert_allclose(back[:3, :3] @ direction, pose[:3, :3] @ direction, rtol=0, atol=1e-10)


def test_the_dmu_50_as_its_thesis_has_it() -> None:
    """Ellingsdalen (2021), Eq. 3.25: B = arccos(2k - 1)."""
    derivation = derive(load(ROOT / "examples/machines/dmu50.toml"), include="machine")
    k, branch = sp.symbols("k branch", real=True)
    found = inverse_nominal(derivation)
    assert found.formulas["B"] == branch * sp.acos(2 * k - 1)
    assert list(found.formulas) == ["B", "C", "X", "Y", "Z"]
    assert any("C is free" in note for note in found.notes)


def machine_of(topology: str, **axes: Axis) -> Machine:
    return Machine(topology, topology, tuple(axes.values()))


ABOUT_Z, ABOUT_X, ABOUT_Y = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)


def test_three_rotary_axes_have_no_closed_form() -> None:
    machine = machine_of(
        "w F A B C t",
        A=Axis("A", True, False, ABOUT_X),
        B=Axis("B", True, False, ABOUT_Y),
        C=Axis("C", True, False, ABOUT_Z),
    )
    found = inverse_nominal(derive(machine, include="machine"))
    assert not found.formulas
    assert "no closed form" in found.notes[0]


def test_an_axis_that_does_not_turn_the_tool() -> None:
    machine = machine_of("w C F B t", C=Axis("C", True, True, ABOUT_X), B=Axis("B", True, False, ABOUT_Z))
    found = inverse_nominal(derive(machine, include="machine"))
    assert not found.formulas
    assert "B does not change" in found.notes[0]


def test_one_rotary_axis_reaches_some_directions() -> None:
    machine = machine_of("w A F X t", A=Axis("A", True, True, ABOUT_X), X=Axis("X", False, False, ABOUT_X))
    found = inverse_nominal(derive(machine, include="machine"))
    assert str(found.formulas["A"]) == "atan2(j, k)"
    assert found.notes == (
        "only tool directions that A reaches have a solution",
        "linear axes: 1 of them for three coordinates: no unique solution",
    )


def test_linear_axes_that_do_not_span_space() -> None:
    machine = machine_of(
        "w F X Y U t",
        X=Axis("X", False, False, ABOUT_X),
        Y=Axis("Y", False, False, ABOUT_Y),
        U=Axis("U", False, False, ABOUT_X),
    )
    assert "do not span space" in inverse_nominal(derive(machine, include="machine")).notes[0]


def test_the_angle_head_of_the_chain_file() -> None:
    found = inverse_nominal(derive(load_chain(ROOT / "examples/chains/angle_head.toml"), include=[]))
    assert str(found.formulas["Ap"]) == "branch*acos((k - cos(Yp)**2)/sin(Yp)**2)"
