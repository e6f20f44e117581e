"""Matrices as truncated power series in the Small variables: {monomial: coefficient matrix}.

Products of more Small variables than the order are dropped as they arise, as Freeman and Ford (2003) do; sines and
cosines of small angles are expanded to the order asked for. `linear_trig` takes their simpler substitution instead,
sin t = t and cos t = 1, which leaves second-order terms out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp
from sympy.polys.matrices import DomainMatrix

from ncfix.machine.symbolic.algebra import Algebra
from ncfix.machine.symbolic.steps import (
    UNITS,
    ZERO,
    Matrices,
    Monomial,
    Screw,
    Step,
    Translation,
    homogeneous,
    linear_part,
    polynomial_part,
    rodrigues,
    skew,
)

Series = dict[Monomial, DomainMatrix]


@dataclass(frozen=True, slots=True)
class Expansion:
    """How far, and in what."""

    smalls: tuple[sp.Expr, ...]
    order: int
    linear_trig: bool = False

    def step(self, step: Step) -> list[Matrices]:
        """A step as the product of power series whose coefficients are sympy matrices."""
        if isinstance(step, Translation):
            return [self._translation(step)]
        if isinstance(step, Screw):
            return self._exponential(self._twist(step))
        large, factors = linear_part(step.angle, self.smalls)
        nominal: Matrices = {(): homogeneous(rodrigues(step.direction, large), ZERO)}
        turning = homogeneous(skew(step.direction), ZERO, 0)
        return [nominal, *self._exponential({(i,): factor * turning for i, factor in factors.items()})]

    def _translation(self, step: Translation) -> Matrices:
        parts = [polynomial_part(component, self.smalls, self.order) for component in step.vector]
        found = {}
        for monomial in dict.fromkeys(key for part in parts for key in part):
            vector = [part.get(monomial, sp.Integer(0)) for part in parts]
            found[monomial] = homogeneous(sp.zeros(3) if monomial else sp.eye(3), vector, int(not monomial))
        return found

    def _twist(self, step: Screw) -> Matrices:
        twist: Matrices = {}
        for row, unit in enumerate(UNITS.values()):
            for i, factor in linear_part(step.rotation[row], self.smalls)[1].items():
                twist[(i,)] = twist.get((i,), sp.zeros(4)) + factor * homogeneous(skew(unit), ZERO, 0)
            for i, factor in linear_part(step.velocity[row], self.smalls)[1].items():
                twist[(i,)] = twist.get((i,), sp.zeros(4)) + factor * homogeneous(sp.zeros(3), unit, 0)
        return twist

    def _exponential(self, twist: Matrices) -> list[Matrices]:
        """1 + t + t^2/2 + ... of a twist that is linear in the Small variables."""
        if not twist:
            return []
        total: Matrices = {(): sp.eye(4)}
        power: Matrices = {(): sp.eye(4)}
        for degree in range(1, 2 if self.linear_trig else self.order + 1):
            power = _multiplied(power, twist)
            for monomial, matrix in power.items():
                total[monomial] = total.get(monomial, sp.zeros(4)) + matrix / sp.factorial(degree)
        return [total]


def _multiplied(a: Matrices, b: Matrices) -> Matrices:
    found: Matrices = {}
    for p, left in a.items():
        for q, right in b.items():
            key = tuple(sorted(p + q))
            found[key] = found.get(key, sp.zeros(4)) + left * right
    return found


def multiply(algebra: Algebra, a: Series, b: Series, order: int) -> Series:
    """The product of two series, truncated."""
    found: Series = {}
    for p, left in a.items():
        for q, right in b.items():
            if len(p) + len(q) <= order:
                key = tuple(sorted(p + q))
                product = algebra.product(left, right)
                found[key] = found[key] + product if key in found else product
    return found


def add(a: Series, b: Series, factor: sp.Rational) -> Series:
    """a + factor * b."""
    found = dict(a)
    for key, matrix in b.items():
        ring = matrix.domain.ring
        scaled = matrix.applyfunc(lambda poly, ring=ring: poly * ring.domain_new(factor))
        found[key] = found[key] + scaled if key in found else scaled
    return found


def compose(algebra: Algebra, factors: Sequence[Series], order: int) -> Series:
    """The product of many, neighbours first, so that most of the work is done with few variables."""
    level = list(factors)
    while len(level) > 1:
        pairs = zip(level[::2], level[1::2], strict=False)
        level = [multiply(algebra, a, b, order) for a, b in pairs] + level[len(level) // 2 * 2 :]
    return level[0]


def logarithm(algebra: Algebra, series: Series, order: int) -> Series:
    """x - x^2/2 + x^3/3 - ... of a series 1 + x whose x has no constant part."""
    x = {key: matrix for key, matrix in series.items() if key}
    total: Series = {}
    power: Series | None = None
    for degree in range(1, order + 1):
        power = x if power is None else multiply(algebra, power, x, order)
        total = add(total, power, sp.Rational((-1) ** (degree + 1), degree))
    return total
