"""The elementary transformations of a chain: each a translation, a rotation, or a small motion. Right-handed.

A step takes coordinates after it to coordinates before it; the chain is their product from the workpiece (left) to
the tool (right). A step gives its matrix as a series in the Small variables: the sum, over monomials of them, of
coefficient matrices (4, 4). Freeman and Ford (2003), sections 2 and 4, who take rotations about x and z left-handed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations_with_replacement
from math import prod
from typing import TypeAlias

import sympy as sp

Expr: TypeAlias = sp.Expr
Vector = tuple[Expr, Expr, Expr]
Monomial = tuple[int, ...]
"""Indices of Small variables, in order, repeated if squared; () is one."""
Matrices = dict[Monomial, sp.Matrix]

ZERO: Vector = (sp.Integer(0),) * 3
UNITS: dict[str, Vector] = {
    name: tuple(sp.Integer(int(i == k)) for i in range(3)) for k, name in enumerate("xyz")
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Translation:
    """A shift along the coordinate axes, mm; each component a polynomial in the Small variables."""

    vector: Vector

    @property
    def inverse(self) -> Translation:
        """The shift back."""
        return Translation(negated(self.vector))

    @property
    def expressions(self) -> tuple[Expr, ...]:
        """Every expression in it."""
        return self.vector

    def with_values(self, values: dict[Expr, Expr]) -> Translation:
        """The step with some symbols replaced."""
        return Translation(substituted(self.vector, values))


@dataclass(frozen=True, slots=True)
class Rotation:
    """A right-handed rotation about a unit vector through the origin; the angle, rad, is linear in the errors."""

    direction: Vector
    angle: Expr

    @property
    def inverse(self) -> Rotation:
        """The rotation back."""
        return Rotation(self.direction, -self.angle)

    @property
    def expressions(self) -> tuple[Expr, ...]:
        """Every expression in it."""
        return (*self.direction, self.angle)

    def with_values(self, values: dict[Expr, Expr]) -> Rotation:
        """The step with some symbols replaced."""
        return Rotation(substituted(self.direction, values), self.angle.xreplace(values))


@dataclass(frozen=True, slots=True)
class Screw:
    """The exponential of a small twist about the origin: rotation vector, rad, and velocity of the origin, mm."""

    rotation: Vector
    velocity: Vector = field(default=ZERO)

    @property
    def inverse(self) -> Screw:
        """The screw back."""
        return Screw(negated(self.rotation), negated(self.velocity))

    @property
    def expressions(self) -> tuple[Expr, ...]:
        """Every expression in it."""
        return (*self.rotation, *self.velocity)

    def with_values(self, values: dict[Expr, Expr]) -> Screw:
        """The step with some symbols replaced."""
        return Screw(substituted(self.rotation, values), substituted(self.velocity, values))


Step = Translation | Rotation | Screw


def inverse(steps: Sequence[Step]) -> tuple[Step, ...]:
    """The steps that undo these."""
    return tuple(step.inverse for step in reversed(steps))


def substituted(vector: Vector, values: dict[Expr, Expr]) -> Vector:
    """The vector with some symbols replaced."""
    x, y, z = (part.xreplace(values) for part in vector)
    return x, y, z


def negated(vector: Vector) -> Vector:
    """The opposite vector."""
    x, y, z = vector
    return -x, -y, -z


def cross(a: Vector, b: Vector) -> Vector:
    """The vector product."""
    return tuple(sp.Matrix(a).cross(sp.Matrix(b)))


def added(a: Vector, b: Vector) -> Vector:
    """The sum."""
    return tuple(p + q for p, q in zip(a, b, strict=True))


def scaled(factor: Expr, a: Vector) -> Vector:
    """A multiple."""
    return tuple(factor * p for p in a)


def dot(a: Vector, b: Vector) -> Expr:
    """The scalar product."""
    return sum((p * q for p, q in zip(a, b, strict=True)), sp.Integer(0))


def skew(vector: Vector) -> sp.Matrix:
    """The matrix that takes b to `vector x b`."""
    x, y, z = vector
    return sp.Matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def rodrigues(direction: Vector, angle: Expr) -> sp.Matrix:
    """The rotation matrix (3, 3) of a unit vector and an angle; sums of angles are written out."""
    cosine, sine = _written_out(sp.cos(angle)), _written_out(sp.sin(angle))
    turning, u = skew(direction), sp.Matrix(direction)
    return cosine * sp.eye(3) + sine * turning + (1 - cosine) * (u * u.T)


def _written_out(expression: Expr) -> Expr:
    return sp.expand_trig(expression) if expression.free_symbols else expression


def homogeneous(rotation: sp.Matrix, translation: Sequence[Expr], corner: int = 1) -> sp.Matrix:
    """The 4x4 matrix of a motion (corner 1) or of a twist (corner 0)."""
    top = rotation.row_join(sp.Matrix(list(translation)))
    return top.col_join(sp.Matrix([[0, 0, 0, corner]]))


def linear_part(expression: Expr, smalls: Sequence[Expr]) -> tuple[Expr, dict[int, Expr]]:
    """An expression that is linear in the Small variables: what is free of them, and their factors by index."""
    found = {i: expression.diff(small) for i, small in enumerate(smalls) if expression.has(small)}
    return expression.xreplace(dict.fromkeys(smalls, sp.Integer(0))), found


def polynomial_part(expression: Expr, smalls: Sequence[Expr], order: int) -> dict[Monomial, Expr]:
    """The coefficients of an expression by monomials of the Small variables, up to an order."""
    present = [i for i, small in enumerate(smalls) if expression.has(small)]
    zero = dict.fromkeys(smalls, sp.Integer(0))
    found = {}
    for degree in range(order + 1):
        for monomial in combinations_with_replacement(present, degree):
            derivative = sp.diff(expression, *(smalls[i] for i in monomial)) if monomial else expression
            found[monomial] = derivative.xreplace(zero) / prod(sp.factorial(monomial.count(i)) for i in set(monomial))
    return found
