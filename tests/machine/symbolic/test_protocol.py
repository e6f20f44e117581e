"""Measurement protocols and identifiability on machines; Freeman and Ford's own are in tests/validation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from ncfix.machine import Axis, GaugeLine, Machine, load
from ncfix.machine.symbolic import Derivation, derive, equations, identifiable, protocol
from ncfix.machine.symbolic.identification import Equation, report, simplest
from ncfix.machine.symbolic.printing import compiled

ROOT = Path(__file__).resolve().parents[3]
DIFFERENCES = (-1,)


@pytest.fixture(scope="module")
def trunnion() -> Derivation:
    return derive(load(ROOT / "examples/machines/wCBXFZYSt.toml"), include=["locations", "spindle"])


def test_rank_equals_that_of_the_numeric_design(trunnion: Derivation) -> None:
    """At random poses, by singular values: one tool length, then two."""
    _, error = compiled(trunnion)
    rng = np.random.default_rng(5)
    poses = rng.uniform(-1, 1, (200, 5)) * np.where([axis.rotary for axis in trunnion.chain.axes], 3, 200)
    for varied, lengths in ((None, [120.0]), (["C", "B", "X", "Y", "Z", "tool_length"], [120.0, 60.0])):
        columns = []
        for variable in trunnion.chain.smalls:
            rows = [error(*poses.T, tool_length=length, **{variable.name: 1.0})[:, :3] for length in lengths]
            column = np.concatenate(rows).ravel()
            columns.append(column / max(np.linalg.norm(column), 1e-30))
        numeric = np.linalg.matrix_rank(np.stack(columns, axis=1), tol=1e-9)
        assert identifiable(trunnion, varied).rank == numeric


def test_combinations_are_what_the_formulas_have(trunnion: Derivation) -> None:
    """Writing the errors with the combinations alone changes nothing."""
    found = identifiable(trunnion)
    smalls = {variable.symbol: variable for variable in trunnion.chain.smalls}
    kept = {next(s for s in smalls if combination.coeff(s) == 1): combination for combination in found.combinations}
    reduced = {symbol: kept.get(symbol, sp.Integer(0)) for symbol in smalls}
    _, error = compiled(trunnion)
    rng = np.random.default_rng(6)
    values = {symbol: float(rng.normal() * 1e-4) for symbol in smalls}
    numbers = {sp.Symbol(v.name, real=True): v.value for v in trunnion.chain.dimensions} | values
    numbers[sp.Symbol("tool_length", real=True)] = 120.0
    pose = rng.uniform(-2, 2, 5)
    full = error(*pose, tool_length=120.0, **{v.name: values[s] for s, v in smalls.items()})
    few = error(
        *pose, tool_length=120.0, **{v.name: float(sp.sympify(reduced[s]).subs(numbers)) for s, v in smalls.items()}
    )
    np.testing.assert_allclose(few[:3], full[:3], rtol=0, atol=1e-15)


def test_text_says_what_is_inseparable_and_what_is_invisible(trunnion: Derivation) -> None:
    text = identifiable(trunnion).to_text()
    assert text.startswith("rank 17 of 36\n")
    assert "only in combination: EC0C + EC0Y\n" in text
    assert "visible at no pose:" in text
    assert "EZ0C" in text


def table_with_two_tilts() -> Derivation:
    """A table C whose line may be shifted and tilted, probed away from its axis."""
    axis = Axis("C", True, True, (0.0, 0.0, -1.0))
    machine = Machine("table", "w C F t", (axis,), GaugeLine(point=(100.0, 0.0, 40.0)))
    return derive(machine, include=["EX0C", "EY0C", "EA0C", "EB0C"])


def test_equations_solved_together() -> None:
    """Nothing isolates the shifts from the tilts in X and Y; Z has the tilts alone."""
    found = equations(table_with_two_tilts(), signs=DIFFERENCES)
    tests = protocol(found)
    assert {str(test.identifies) for test in tests} == {"EX0C", "EY0C", "EA0C", "EB0C"}
    singles = [test for test in tests if len(test.equations) == 1]
    assert {str(test.identifies) for test in singles} >= {"EB0C"}
    text = report(tests)
    assert text.count("Z(") >= 2
    for number in range(1, 5):
        assert f"{number:3}. E" in text


def test_a_protocol_recovers_the_errors_it_identifies() -> None:
    """Readings made with drawn errors, test after test solved: the draws come back."""
    derivation = table_with_two_tilts()
    _, error = compiled(derivation)
    nominal, _ = compiled(derivation)
    drawn = {"EX0C": 0.01, "EY0C": -0.02, "EA0C": 3e-5, "EB0C": -4e-5}

    def reading(coordinate: str, pose: tuple[int, ...]) -> float:
        angle = np.deg2rad(pose[0])
        k = "xyz".index(coordinate)
        return float(nominal(angle)[k] + error(angle, **drawn)[k])

    numbers = {sp.Symbol(v.name, real=True): v.value for v in derivation.chain.dimensions}
    known: dict[sp.Expr, float] = {}
    for test in protocol(equations(derivation, signs=DIFFERENCES)):
        unknowns = sorted(set().union(*(eq.unknowns for eq in test.equations)) - known.keys(), key=str)
        system = [
            eq.expression.subs(numbers).subs(known)
            - (reading(eq.coordinate, eq.first) - reading(eq.coordinate, eq.second))
            for eq in test.equations
        ]
        if unknowns:
            known |= {symbol: float(value) for symbol, value in sp.solve(system, unknowns).items()}
    assert {str(symbol): value for symbol, value in known.items()} == pytest.approx(drawn, abs=1e-12)


def test_errors_of_a_position_are_unknowns_of_their_own() -> None:
    derivation = derive(load(ROOT / "examples/machines/wCBXFZYSt.toml"), include=["EZC"])
    names = {str(unknown) for equation in equations(derivation, signs=DIFFERENCES) for unknown in equation.unknowns}
    assert names == {"EZC(0)", "EZC(pi/2)", "EZC(pi)", "EZC(3*pi/2)"}
    assert identifiable(derivation).unknowns == ()


def test_the_user_may_choose_and_set_to_zero() -> None:
    derivation = table_with_two_tilts()
    found = equations(derivation, zero=["EA0C", "EB0C"], signs=DIFFERENCES)
    assert {str(u) for equation in found for u in equation.unknowns} == {"EX0C", "EY0C"}
    seen: list[int] = []

    def last(candidates: list[Equation]) -> Equation:
        seen.append(len(candidates))
        return candidates[-1]

    tests = protocol(found, choose=last)  # type: ignore[arg-type]
    assert len(tests) == 2
    assert seen
    wanted = sp.Symbol("EX0C", real=True)
    assert all(wanted in equation.unknowns for equation in simplest(found, wanted=wanted))
    assert protocol(equations(derivation, zero=["EA0C", "EB0C", "EX0C", "EY0C"])) == ()
