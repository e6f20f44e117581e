"""The derivation: nominal formulas, and error formulas of first or higher order, of a machine or a chain.

The error is actual minus nominal in the workpiece frame: dx dy dz of the tip, mm, and the rotation vector rx ry rz of
R_actual R_nominal^T, rad, as in `Machine.error`.

Matrices are power series in the Small variables, {monomial: coefficient matrix}. Products of more Small variables than
the order are dropped as they arise, as in Freeman and Ford (2003); sines and cosines of small angles are expanded to
the order. With `linear_trig`, the simpler substitution of that paper is used instead, sin t = t and cos t = 1, which
omits second-order terms.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from itertools import product

import sympy as sp
from sympy.polys.matrices import DomainMatrix

from ncfix.diagnostics import UsageError
from ncfix.machine.machine import Machine
from ncfix.machine.symbolic.algebra import Algebra
from ncfix.machine.symbolic.chain import (
    UNITS,
    ZERO,
    Chain,
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
from ncfix.machine.symbolic.from_machine import DEFAULT, from_machine
from ncfix.values import frozen

Series = dict[Monomial, DomainMatrix]


@frozen
class Expansion:
    """The expansion of steps into power series.

    smalls       symbols of the Small variables, by the index that monomials use
    order        highest order of the terms
    linear_trig  use sin t = t and cos t = 1 for small angles
    """

    smalls: tuple[sp.Expr, ...]
    order: int
    linear_trig: bool = False

    def step(self, step: Step) -> list[Matrices]:
        """The power series whose product is the step; coefficients are sympy matrices (4, 4)."""
        if isinstance(step, Translation):
            parts = [polynomial_part(component, self.smalls, self.order) for component in step.vector]
            found = {}
            for monomial in dict.fromkeys(key for part in parts for key in part):
                vector = [part.get(monomial, sp.Integer(0)) for part in parts]
                found[monomial] = homogeneous(sp.zeros(3) if monomial else sp.eye(3), vector, int(not monomial))
            return [found]
        if isinstance(step, Screw):
            twist: Matrices = {}
            for row, unit in enumerate(UNITS.values()):
                for i, factor in linear_part(step.rotation[row], self.smalls)[1].items():
                    twist[(i,)] = twist.get((i,), sp.zeros(4)) + factor * homogeneous(skew(unit), ZERO, 0)
                for i, factor in linear_part(step.velocity[row], self.smalls)[1].items():
                    twist[(i,)] = twist.get((i,), sp.zeros(4)) + factor * homogeneous(sp.zeros(3), unit, 0)
            return self._exponential(twist)
        large, factors = linear_part(step.angle, self.smalls)
        nominal: Matrices = {(): homogeneous(rodrigues(step.direction, large), ZERO)}
        turning = homogeneous(skew(step.direction), ZERO, 0)
        return [nominal, *self._exponential({(i,): factor * turning for i, factor in factors.items()})]

    def _exponential(self, twist: Matrices) -> list[Matrices]:
        """The series 1 + t + t^2/2 + ... of a twist t that is linear in the Small variables; none for a zero twist."""
        if not twist:
            return []
        total: Matrices = {(): sp.eye(4)}
        power: Matrices = {(): sp.eye(4)}
        for degree in range(1, 2 if self.linear_trig else self.order + 1):
            last, power = power, {}
            for (p, left), (q, right) in product(last.items(), twist.items()):
                key = tuple(sorted(p + q))
                power[key] = power.get(key, sp.zeros(4)) + left * right
            for monomial, matrix in power.items():
                total[monomial] = total.get(monomial, sp.zeros(4)) + matrix / sp.factorial(degree)
        return [total]


def multiply(algebra: Algebra, a: Series, b: Series, order: int) -> Series:
    """The product of two series, without terms above the order."""
    found: Series = {}
    for (p, left), (q, right) in product(a.items(), b.items()):
        if len(p) + len(q) <= order:
            key, matrix = tuple(sorted(p + q)), algebra.product(left, right)
            found[key] = found[key] + matrix if key in found else matrix
    return found


def compose(algebra: Algebra, factors: Sequence[Series], order: int) -> Series:
    """The product of many series: of neighbours first, so that most products involve few variables."""
    level = list(factors)
    while len(level) > 1:
        pairs = zip(level[::2], level[1::2], strict=False)
        level = [multiply(algebra, a, b, order) for a, b in pairs] + level[len(level) // 2 * 2 :]
    return level[0]


def logarithm(algebra: Algebra, series: Series, order: int) -> Series:
    """The series x - x^2/2 + x^3/3 - ..., the logarithm of 1 + x; x has no constant part."""
    x = {key: matrix for key, matrix in series.items() if key}
    total: Series = {}
    power: Series | None = None
    for degree in range(1, order + 1):
        power = x if power is None else multiply(algebra, power, x, order)
        factor = algebra.ring.domain_new(sp.Rational((-1) ** (degree + 1), degree))
        for key, matrix in power.items():
            scaled = matrix.applyfunc(lambda poly, factor=factor: poly * factor)
            total[key] = total[key] + scaled if key in total else scaled
    return total


POSITION = ("x", "y", "z")
DIRECTION = ("i", "j", "k")
COMPONENTS = ("dx", "dy", "dz", "rx", "ry", "rz")
Terms = dict[Monomial, sp.Expr]


@frozen
class Derivation:
    """The formulas of a chain.

    nominal  x y z of the tool tip, mm, and i j k, the unit vector from the tip towards the spindle; workpiece frame
    terms    component dx ... rz -> monomial of the errors (indices into `chain.smalls`) -> coefficient
    order    highest number of errors in a product
    """

    chain: Chain
    order: int
    nominal: Mapping[str, sp.Expr]
    terms: Mapping[str, Terms]

    @property
    def error(self) -> dict[str, sp.Expr]:
        """The error formulas: component -> sum of its products."""
        return {name: sp.Add(*self.products(name).values()) for name in COMPONENTS}

    def products(self, component: str) -> dict[Monomial, sp.Expr]:
        """Monomial -> summand of a component: its coefficient times its errors."""
        return {key: coefficient * self.monomial(key) for key, coefficient in self.terms[component].items()}

    def monomial(self, key: Monomial) -> sp.Expr:
        """The product of errors that a monomial means."""
        return sp.Mul(*(self.chain.smalls[i].symbol for i in key))

    @property
    def without_effect(self) -> tuple[str, ...]:
        """Names of the errors that occur in no formula."""
        used = {i for terms in self.terms.values() for key in terms for i in key}
        return tuple(variable.name for i, variable in enumerate(self.chain.smalls) if i not in used)


def _nominal(algebra: Algebra, pose: DomainMatrix, chain: Chain) -> dict[str, sp.Expr]:
    axis = algebra.matrix(sp.Matrix([*chain.tool_axis, 0]))
    direction = algebra.product(pose, axis)
    columns = [algebra.entries(matrix.extract([0, 1, 2], [column])) for matrix, column in ((pose, 3), (direction, 0))]
    values = [algebra.expression(row[0]) for column in columns for row in column]
    return dict(zip((*POSITION, *DIRECTION), values, strict=True))


def _terms(algebra: Algebra, pose: Series, order: int) -> dict[str, Terms]:
    """The terms of each component: the tip's shift, and the rotation vector, the logarithm of R_actual R_nominal^T."""
    rotations = {key: matrix.extract([0, 1, 2], [0, 1, 2]) for key, matrix in pose.items()}
    turned = multiply(algebra, rotations, {(): rotations[()].transpose()}, order)
    vector = logarithm(algebra, turned, order)
    found: dict[str, Terms] = {component: {} for component in COMPONENTS}
    for key in sorted({*pose, *vector} - {()}, key=lambda key: (len(key), key)):
        shift = algebra.entries(pose[key]) if key in pose else [[0] * 4] * 4
        turn = algebra.entries(algebra.simplified(vector[key])) if key in vector else [[0] * 3] * 3
        polys = shift[0][3], shift[1][3], shift[2][3], turn[2][1], turn[0][2], turn[1][0]
        for component, poly in zip(COMPONENTS, polys, strict=True):
            if poly:
                found[component][key] = algebra.expression(poly)
    return found


def derive(
    source: Machine | Chain,
    order: int = 1,
    include: str | Iterable[str] | None = None,
    lettered: bool = False,
    linear_trig: bool = False,
) -> Derivation:
    """Nominal formulas, and error formulas to an order, of a machine or of a chain of elementary transformations.

    order        highest number of errors in a product: 1, 2, ...
    include      names of errors, or patterns such as "E?C"; for a machine also the groups "motions", "locations",
                 "spindle" and "machine" (those in its file). None: of a machine the first three groups, of a chain all
    lettered     for a machine: fixed angles of axes become variables instead of exact constants
    linear_trig  sin t = t and cos t = 1 for errors, as in Freeman and Ford: wrong from second order on

    Raises `UsageError` NCF392 for a wrong order, and NCF393 for an error that does not exist.
    """
    if isinstance(source, Machine):
        chain = from_machine(source, DEFAULT if include is None else include, lettered)
    else:
        chain = source if include is None else _only(source, [include] if isinstance(include, str) else list(include))
    if order < 1:
        raise UsageError.of("NCF392", f"the order is {order}", hint="give 1 for first order, 2 for second order")
    expansion = Expansion(tuple(variable.symbol for variable in chain.smalls), order, linear_trig)
    factors = [factor for step in chain.steps for factor in expansion.step(step)]
    entries = [entry for factor in factors for matrix in factor.values() for entry in matrix]
    algebra = Algebra(sp.expand(entry) for entry in (*entries, *chain.tool_axis))
    series = [{key: algebra.matrix(matrix) for key, matrix in factor.items()} for factor in factors]
    pose = compose(algebra, series, order)
    return Derivation(chain, order, _nominal(algebra, pose[()], chain), _terms(algebra, pose, order))


def _only(chain: Chain, patterns: list[str]) -> Chain:
    names = [variable.name for variable in chain.smalls]
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise UsageError.of("NCF393", f"{pattern!r} matches no error of this chain", hint=" ".join(names))
    return chain.without(name for name in names if not any(fnmatchcase(name, pattern) for pattern in patterns))
