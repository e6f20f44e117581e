"""The nominal inverse: axis positions by the tip position and the tool direction, where there is a closed form.

The tool direction d gives the rotary axes. With two of them, a and b, of directions u_a and u_b, and the tool along t
with the axes at zero, u_a . d = u_a . R(u_b, b) t gives b, and the rotation about u_a from R(u_b, b) t to d gives a
(subproblems of Paden and Kahan; Lynch and Park, Modern Robotics (2017), 6.1). The linear axes then follow from a linear
system. Each axis must turn or move by its own position only.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import sympy as sp

from ncfix.machine.symbolic.algebra import Algebra, Poly
from ncfix.machine.symbolic.chain import Chain, Expr, Rotation, linear_part, rodrigues
from ncfix.machine.symbolic.derivation import DIRECTION, POSITION, Derivation
from ncfix.values import frozen

BRANCH = sp.Symbol("branch", real=True)
"""Chooses one of two solutions: +1 or -1."""
TARGET = sp.Matrix([sp.Symbol(name, real=True) for name in DIRECTION])
TIP = sp.Matrix([sp.Symbol(name, real=True) for name in POSITION])


@frozen
class Inverse:
    """The inverse.

    formulas  name of an axis -> formula of its position, in the order in which they can be evaluated
    notes     explanations, and reasons for missing formulas
    """

    formulas: Mapping[str, sp.Expr]
    notes: tuple[str, ...]

    def lines(self) -> Iterator[str]:
        """The formulas and notes as lines of text."""
        yield from (f"{axis} = {formula}" for axis, formula in self.formulas.items())
        yield from self.notes


@frozen
class _Turn:
    """A rotary axis: its direction with all axes at zero, about which a positive position turns the tool."""

    name: str
    direction: sp.Matrix


class _UnreachableError(Exception):
    """Raised with the reason if there is no closed form."""


def inverse_nominal(derivation: Derivation) -> Inverse:
    """The inverse, with the reasons for missing formulas in its notes."""
    formulas: dict[str, sp.Expr] = {}
    notes: list[str] = []
    for solve in (_rotary, _linear):
        try:
            found, remarks = solve(derivation)
            formulas |= found
            notes += remarks
        except _UnreachableError as reason:
            notes.append(str(reason))
    return Inverse(formulas, tuple(notes))


def _rotary(derivation: Derivation) -> tuple[dict[str, Expr], list[str]]:
    turns, tool = _turns(derivation.chain)
    if len(turns) > 2:
        names = ", ".join(turn.name for turn in turns)
        raise _UnreachableError(f"rotary axes: a tool direction does not determine {names}: no closed form")
    if not turns:
        return {}, []
    if len(turns) == 1:
        return {turns[0].name: _about(turns[0], tool)}, [
            f"only tool directions that {turns[0].name} reaches have a solution"
        ]
    outer, inner = turns
    formulas = {inner.name: _to_level(outer, inner, tool)}
    moved = rodrigues(tuple(inner.direction), sp.Symbol(inner.name, real=True)) * tool
    formulas[outer.name] = _about(outer, moved)
    notes = [f"{BRANCH} = 1 or -1: two solutions", f"{outer.name} is free where the tool is parallel to its axis"]
    return formulas, notes


def _turns(chain: Chain) -> tuple[list[_Turn], sp.Matrix]:
    """The rotary axes from the workpiece to the tool, and the tool axis, with all axes at zero."""
    smalls = [variable.symbol for variable in chain.smalls]
    rotary = {variable.symbol for variable in chain.axes if variable.rotary}
    fixed, turns = sp.eye(3), []
    for step in chain.steps:
        if not isinstance(step, Rotation):
            continue
        angle, _ = linear_part(step.angle, smalls)
        names = angle.free_symbols & rotary
        if not names:
            fixed = fixed * rodrigues(step.direction, angle)
            continue
        sign = angle / next(iter(names))
        if sign not in (1, -1):
            raise _UnreachableError(f"rotary axes: a rotation by {angle} is not that of one axis: no closed form")
        turns.append(_Turn(str(next(iter(names))), sign * fixed * sp.Matrix(step.direction)))
    return turns, fixed * sp.Matrix(chain.tool_axis)


def _to_level(outer: _Turn, inner: _Turn, tool: sp.Matrix) -> Expr:
    """The position of the inner axis at which the tool's angle to the outer axis is that of the target direction."""
    along = outer.direction.dot(inner.direction) * inner.direction.dot(tool)
    even = outer.direction.dot(tool) - along
    odd = outer.direction.dot(inner.direction.cross(tool))
    level = outer.direction.dot(TARGET) - along
    even, odd, level = _shortest([even, odd, level])
    if even == 0 and odd == 0:
        raise _UnreachableError(f"rotary axes: {inner.name} does not change the tool's angle to {outer.name}")
    if odd == 0:
        return BRANCH * sp.acos(level / even)
    if even == 0:
        return sp.pi / 2 + BRANCH * sp.acos(level / odd)
    return sp.atan2(odd, even) + BRANCH * sp.acos(level / sp.sqrt(even**2 + odd**2))


def _about(turn: _Turn, start: sp.Matrix) -> Expr:
    """The position of the axis that turns a start direction to the target direction."""
    u = turn.direction
    sine = u.dot(start.cross(TARGET))
    cosine = start.dot(TARGET) - u.dot(start) * u.dot(TARGET)
    return sp.atan2(*_shortest([sine, cosine]))


def _linear(derivation: Derivation) -> tuple[dict[str, Expr], list[str]]:
    axes = [variable for variable in derivation.chain.axes if not variable.rotary]
    if not axes:
        return {}, []
    if len(axes) != 3:
        raise _UnreachableError(f"linear axes: {len(axes)} of them for three coordinates: no unique solution")
    symbols = [axis.symbol for axis in axes]
    tip = sp.Matrix([derivation.nominal[name] for name in POSITION])
    matrix, rest = tip.jacobian(symbols), TIP - tip.xreplace(dict.fromkeys(symbols, sp.Integer(0)))
    solution, determinant = _cramer(matrix, rest)
    if determinant == 0:
        raise _UnreachableError("linear axes: they do not span space: no solution")
    notes = ["x y z: the tip; the rotary axes as above"] if len(derivation.chain.axes) > 3 else []
    return {axis.name: part / determinant for axis, part in zip(axes, solution, strict=True)}, notes


def _cramer(matrix: sp.Matrix, right: sp.Matrix) -> tuple[list[Expr], Expr]:
    """The adjugate times the right-hand side, and the determinant, simplified after each product."""
    algebra = Algebra(sp.expand(entry) for entry in (*matrix, *right))
    rows = [[algebra.poly(matrix[i, k]) for k in range(3)] for i in range(3)]
    sides = [algebra.poly(entry) for entry in right]

    def minor(i: int, k: int) -> Poly:
        (p, q), (r, s) = ((i + 1) % 3, (i + 2) % 3), ((k + 1) % 3, (k + 2) % 3)
        return algebra.reduced(rows[p][r] * rows[q][s] - rows[p][s] * rows[q][r])

    minors = [[minor(i, k) for k in range(3)] for i in range(3)]
    determinant = algebra.reduced(sum(rows[0][k] * minors[0][k] for k in range(3)))
    solution = [algebra.reduced(sum(minors[i][k] * sides[i] for i in range(3))) for k in range(3)]
    return [algebra.expression(poly) for poly in solution], algebra.expression(determinant)


def _shortest(expressions: list[Expr]) -> list[Expr]:
    algebra = Algebra([sp.expand(expression) for expression in expressions])
    return [algebra.expression(algebra.poly(expression)) for expression in expressions]
