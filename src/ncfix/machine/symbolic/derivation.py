"""The derivation itself: from a chain to nominal formulas and error formulas of first or higher order.

The error is actual minus nominal in the workpiece frame: dx dy dz of the tip, mm, and the rotation vector rx ry rz of
R_actual R_nominal^T, rad, as `Machine.error` has it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import sympy as sp
from sympy.polys.matrices import DomainMatrix

from ncfix.diagnostics import UsageError
from ncfix.machine.symbolic.algebra import Algebra
from ncfix.machine.symbolic.chain import Chain
from ncfix.machine.symbolic.series import Expansion, Series, compose, logarithm, multiply
from ncfix.machine.symbolic.steps import Monomial

POSITION = ("x", "y", "z")
DIRECTION = ("i", "j", "k")
COMPONENTS = ("dx", "dy", "dz", "rx", "ry", "rz")
Terms = dict[Monomial, sp.Expr]


@dataclass(frozen=True, slots=True)
class Derivation:
    """Formulas of a chain.

    nominal  x y z of the tool tip, mm, and i j k, the unit vector from the tip towards the spindle; workpiece frame
    terms    per component dx ... rz: the coefficient of every monomial of the errors (indices into `chain.smalls`)
    order    highest number of errors in a product
    """

    chain: Chain
    order: int
    nominal: Mapping[str, sp.Expr]
    terms: Mapping[str, Terms]

    @property
    def error(self) -> dict[str, sp.Expr]:
        """The error formulas: component -> expression, collected by error."""
        return {name: sp.Add(*self.products(name).values()) for name in COMPONENTS}

    def products(self, component: str) -> dict[Monomial, sp.Expr]:
        """The summands of a component: each a coefficient times its errors."""
        return {key: coefficient * self.monomial(key) for key, coefficient in self.terms[component].items()}

    def monomial(self, key: Monomial) -> sp.Expr:
        """The product of errors that a key stands for."""
        return sp.Mul(*(self.chain.smalls[i].symbol for i in key))

    @property
    def without_effect(self) -> tuple[str, ...]:
        """Errors that appear in no formula."""
        used = {i for terms in self.terms.values() for key in terms for i in key}
        return tuple(variable.name for i, variable in enumerate(self.chain.smalls) if i not in used)

    def to_text(self) -> str:
        """Plain text."""
        from ncfix.machine.symbolic.text import to_text

        return to_text(self)

    def to_latex(self) -> str:
        """LaTeX: aligned equations for a document that loads amsmath."""
        from ncfix.machine.symbolic.latex import to_latex

        return to_latex(self)

    def to_python(self) -> str:
        """Python source of `nominal(...)` and `error(...)`, functions of numpy arrays."""
        from ncfix.machine.symbolic.python import to_python

        return to_python(self)


def derive_chain(chain: Chain, order: int = 1, linear_trig: bool = False) -> Derivation:
    """Derive the formulas of a chain; raises `UsageError` NCF392 if the order is not 1, 2, ...

    linear_trig  replace sin t by t and cos t by 1 for errors, as Freeman and Ford do: wrong from second order on
    """
    if order < 1:
        raise UsageError.of("NCF392", f"the order is {order}", hint="1 is first order, 2 second order")
    smalls = tuple(variable.symbol for variable in chain.smalls)
    expansion = Expansion(smalls, order, linear_trig)
    factors = [factor for step in chain.steps for factor in expansion.step(step)]
    entries = [entry for factor in factors for matrix in factor.values() for entry in matrix]
    algebra = Algebra(sp.expand(entry) for entry in (*entries, *chain.tool_axis))
    series = [{key: algebra.matrix(matrix) for key, matrix in factor.items()} for factor in factors]
    pose = compose(algebra, series, order)
    return Derivation(chain, order, _nominal(algebra, pose[()], chain), _terms(algebra, pose, order))


def _nominal(algebra: Algebra, pose: DomainMatrix, chain: Chain) -> dict[str, sp.Expr]:
    axis = algebra.matrix(sp.Matrix([*chain.tool_axis, 0]))
    direction = algebra.product(pose, axis)
    columns = [algebra.entries(matrix.extract([0, 1, 2], [column])) for matrix, column in ((pose, 3), (direction, 0))]
    values = [algebra.expression(row[0]) for column in columns for row in column]
    return dict(zip((*POSITION, *DIRECTION), values, strict=True))


def _terms(algebra: Algebra, pose: Series, order: int) -> dict[str, Terms]:
    """Shift of the tip, and the rotation vector as the logarithm of R_actual R_nominal^T."""
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
