"""From a machine to a chain: which errors, which constants, which names; and what needs no naming at all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from machine import chains
from ncfix.diagnostics import UsageError
from ncfix.machine import Axis, Effect, GaugeLine, Machine, State
from ncfix.machine.basis import Polynomial
from ncfix.machine.symbolic import derive, from_machine
from ncfix.machine.symbolic.from_machine import Constants
from ncfix.machine.symbolic.printing import compiled

HALF = 0.7071067811865476
X, Y, Z, C, B = sp.symbols("X Y Z C B", real=True)
L = sp.Symbol("tool_length", real=True)


def three_axes(*effects: Effect) -> Machine:
    directions = {"Y": (0.0, 1.0, 0.0), "X": (1.0, 0.0, 0.0), "Z": (0.0, 0.0, 1.0)}
    axes = tuple(Axis(name, False, name == "Y", direction) for name, direction in directions.items())
    return Machine("three axes", "w Y F X Z t", axes, effects=effects)


def error_of(machine: Machine, include: str, component: str) -> str:
    return str(derive(machine, include=include).error[component])


# -- known formulas ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "component", "formula"),
    [
        ("EXX", "dx", "EXX(X)"),
        ("EXY", "dx", "-EXY(Y)"),  # Y carries the workpiece
        ("EAX", "dz", "0"),
        ("EBX", "dx", "(Z - tool_length)*EBX(X)"),
        ("EBX", "ry", "EBX(X)"),
        ("EBZ", "dx", "-tool_length*EBZ(Z)"),
        ("EC0Y", "dx", "EC0Y*Y"),
        ("EB0Z", "dx", "EB0Z*Z"),
        ("EX0X", "dx", "EX0X"),
        ("EB0S", "dx", "-EB0S*tool_length"),
        ("EZ0S", "dz", "EZ0S"),
        ("EZS", "dz", "EZS"),
    ],
)
def test_three_axis_errors_by_hand(name: str, component: str, formula: str) -> None:
    assert error_of(three_axes(), name, component) == formula


def test_a_turntable_by_hand() -> None:
    """The table turns by -C about z: the workpiece sees a fixed tool turn by +C."""
    axis = Axis("C", True, True, (0.0, 0.0, -1.0))
    machine = Machine("table", "w C F t", (axis,), GaugeLine(point=(100.0, 0.0, 0.0)))
    derivation = derive(machine, include=["ECC", "EXC", "EA0C"])
    xT = sp.Symbol("xT", real=True)
    assert derivation.nominal["x"] == xT * sp.cos(C)
    assert derivation.nominal["y"] == xT * sp.sin(C)
    (ECC,) = (variable.symbol for variable in derivation.chain.smalls if variable.name == "ECC")
    assert derivation.error["rz"] == -ECC
    assert sp.simplify(derivation.error["dy"].coeff(ECC) + xT * sp.cos(C)) == 0


def test_errors_that_cannot_be_seen_are_named() -> None:
    gone = derive(three_axes(), include="locations").without_effect
    assert gone == ("EX0Y", "EZ0Y", "EB0Y", "EY0X", "EZ0X", "EA0X", "EX0Z", "EY0Z", "EC0Z")


# -- which errors -----------------------------------------------------------------------------------------------------


def names(machine: Machine, include: object) -> list[str]:
    return [variable.name for variable in from_machine(machine, include).smalls]  # type: ignore[arg-type]


def test_include_by_group_name_and_pattern() -> None:
    machine = three_axes(Effect("EXX", (0.01,)), Effect("EC0Y", (1e-5,)), Effect("EYY", (0.0,)))
    assert names(machine, "machine") == ["EC0Y", "EXX"]
    assert names(machine, ["EC?", "EX0X"]) == ["ECY", "ECX", "EX0X", "ECZ", "ECS"]
    assert names(machine, "spindle") == ["EX0S", "EY0S", "EZ0S", "EA0S", "EB0S", "EC0S"]
    assert len(names(machine, "motions")) == len(names(machine, "locations")) == 18
    assert len(derive(machine).chain.smalls) == 42


def test_a_perfect_machine_has_no_errors_of_its_own() -> None:
    derivation = derive(three_axes(), include="machine")
    assert derivation.error == dict.fromkeys(("dx", "dy", "dz", "rx", "ry", "rz"), 0)


@pytest.mark.parametrize(("given", "hint"), [("EXQ", "EX"), ("motion", "motions"), ("E?Q", "pattern")])
def test_an_error_that_is_not_there(given: str, hint: str) -> None:
    with pytest.raises(UsageError, match="NCF393") as caught:
        from_machine(three_axes(), given)
    assert hint in str(caught.value)


def test_one_symbol_cannot_stand_for_two_references() -> None:
    one = Effect("EAX", (1e-5,), reference=(0.0, 0.0, 10.0))
    with pytest.raises(UsageError, match="EAX"):
        from_machine(three_axes(one, replace(one, reference=(0.0, 0.0, 20.0))), "machine")
    shifts = Effect("EXX", (0.01,), reference=(0.0, 0.0, 10.0)), Effect("EXX", (0.01,))
    assert names(three_axes(*shifts), "machine") == ["EXX"]


def test_an_error_depends_on_what_its_effects_depend_on() -> None:
    linear = Polynomial((1,))
    effects = Effect("EXX", (0.01,), linear, times="Z"), Effect("EXX", (0.02,), linear, input="temp_x")
    (variable,) = from_machine(three_axes(*effects), "machine").smalls
    assert str(variable.symbol) == "EXX(X, Z, temp_x)"


def test_reference_points_become_levers() -> None:
    effect = Effect("EBX", (1e-5,), reference=(0.0, 0.0, -275.86))
    derivation = derive(three_axes(effect), include="machine")
    assert str(derivation.error["dx"]) == "(Z - tool_length - z_EBX)*EBX(X)"
    assert derivation.chain.variable("z_EBX").value == -275.86


@pytest.mark.parametrize("carried", [False, True])
def test_carried_location_errors(carried: bool) -> None:
    machine = three_axes(Effect("EC0X", (1e-5,), carried=carried))
    derivation = derive(machine, include="machine")
    _, error = compiled(derivation)
    q = np.array([[100.0, 50.0, 20.0]])
    found = error(*q.T, tool_length=30.0, EC0X=1e-5)
    first = np.einsum("nijk,njk->ni", machine.jacobians(q, 30.0).joints, machine.joint_errors(q, State(30.0)))
    np.testing.assert_allclose(found, first, rtol=0, atol=1e-15)


# -- constants and names ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("direction", "exact"),
    [
        ((0.0, 0.0, -1.0), (0, 0, -1)),
        ((0.0, -HALF, HALF), (0, -sp.sqrt(2) / 2, sp.sqrt(2) / 2)),
        (
            (0.0, np.sin(50 * np.pi / 180), np.cos(50 * np.pi / 180)),
            (0, sp.sin(5 * sp.pi / 18), sp.cos(5 * sp.pi / 18)),
        ),
        ((-0.5, 0.0, 3**0.5 / 2), (-sp.Rational(1, 2), 0, sp.sqrt(3) / 2)),
        ((1 / 3**0.5, -1 / 3**0.5, 1 / 3**0.5), (sp.sqrt(3) / 3, -sp.sqrt(3) / 3, sp.sqrt(3) / 3)),
    ],
)
def test_directions_are_recognised(direction: tuple[float, ...], exact: tuple[sp.Expr, ...]) -> None:
    constants = Constants()
    assert constants.direction(direction, "A", "the A axis") == exact
    assert not constants.variables


def test_a_direction_in_a_plane_that_is_not_recognised_becomes_an_angle() -> None:
    constants = Constants()
    angle = 0.7001
    found = constants.direction((0.0, -np.sin(angle), np.cos(angle)), "A", "the A axis")
    phi = sp.Symbol("phiA", real=True)
    assert found == (0, -sp.sin(phi), sp.cos(phi))
    assert constants.variables["phiA"].value == pytest.approx(angle, abs=1e-15)


def test_a_skew_direction_stays_a_number() -> None:
    direction = chains.unit_vector(np.random.default_rng(1))
    found = Constants().direction(direction, "A", "the A axis")
    assert tuple(float(part) for part in found) == direction


def test_fixed_angles_as_letters() -> None:
    axis = Axis("B", True, True, (0.0, -HALF, HALF))
    machine = Machine("tilted", "w B F t", (axis,), GaugeLine(point=(0.0, 0.0, 50.0)))
    assert derive(machine, include="ECB").nominal["k"] == sp.cos(B) / 2 + sp.Rational(1, 2)
    lettered = derive(machine, include="ECB", lettered=True)
    phi = sp.Symbol("phiB", real=True)
    assert sp.simplify(lettered.nominal["k"] - sp.sin(phi) ** 2 * sp.cos(B) - sp.cos(phi) ** 2) == 0
    assert lettered.chain.variable("phiB").value == pytest.approx(np.pi / 4)


def test_points_that_share_a_coordinate_share_its_letter() -> None:
    """B and C of a swivelling table meet: one height, not two."""
    b = Axis("B", True, True, (0.0, 1.0, 0.0), (0.0, 0.0, 155.0))
    c = Axis("C", True, True, (0.0, 0.0, 1.0), (0.0, 0.0, 155.0))
    machine = Machine("table", "w C B F t", (c, b))
    (height,) = (variable for variable in from_machine(machine, "ECC").dimensions if variable.name != "tool_length")
    assert (height.name, height.value) == ("zC", 155.0)
    assert "B axis" in height.definition
    assert "C axis" in height.definition
