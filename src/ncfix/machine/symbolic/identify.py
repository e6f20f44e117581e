"""What can be identified: the rank of the error formulas, and which parameters only show up together.

Coefficients of the errors are polynomials in functions of what is varied (axis positions, perhaps tool length): two
errors can be told apart if, and only if, their coefficients are linearly independent as such. This is exact: no grid
of poses is chosen. What is missing in Freeman and Ford (2003), whose Tests 6 to 8 ask for two parameters where the
formulas only have one.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ncfix.machine.symbolic.algebra import Algebra, Poly
from ncfix.machine.symbolic.dependence import Columns
from ncfix.machine.symbolic.derivation import Derivation

TIP = ("dx", "dy", "dz")


@dataclass(frozen=True, slots=True)
class Identifiable:
    """What measurements of all poses can say.

    unknowns      the errors asked for
    combinations  as many as the rank: each an error, or a sum of errors that act as one
    invisible     errors that no pose shows
    """

    unknowns: tuple[str, ...]
    combinations: tuple[sp.Expr, ...]
    invisible: tuple[str, ...]

    @property
    def rank(self) -> int:
        """How many independent parameters there are."""
        return len(self.combinations)

    @property
    def inseparable(self) -> tuple[sp.Expr, ...]:
        """The combinations of more than one error."""
        return tuple(combination for combination in self.combinations if combination.is_Add)

    def to_text(self) -> str:
        """In words."""
        lines = [f"rank {self.rank} of {len(self.unknowns)}"]
        lines += [f"only together: {combination}" for combination in self.inseparable]
        lines += [f"no pose shows: {' '.join(self.invisible)}"] if self.invisible else []
        return "\n".join(lines) + "\n"


def identifiable(
    derivation: Derivation,
    varied: Sequence[str] | None = None,
    components: Sequence[str] = TIP,
    absolute: bool = True,
) -> Identifiable:
    """What can be identified when `varied` is varied; errors that depend on positions are left out.

    varied      names of axes, and of dimensions that are varied too (a second tool length); None: all axes
    components  what is measured: dx dy dz, rx ry rz
    absolute    False: only changes are seen, since the origin of the measurement is unknown
    """
    names = set(varied) if varied is not None else {axis.name for axis in derivation.chain.axes}
    wanted = {i: variable for i, variable in enumerate(derivation.chain.smalls) if not variable.arguments}
    found = [{c: derivation.terms[c].get((i,), sp.Integer(0)) for c in components} for i in wanted]
    algebra = Algebra(sp.expand(value) for column in found for value in column.values())
    moving = np.array([any(str(symbol) in names for symbol in g.free_symbols) for g in algebra.ring.symbols])
    columns = Columns(algebra, [_split(algebra, column, moving, absolute) for column in found])
    unknowns = list(wanted.values())
    combinations = columns.combinations([variable.symbol for variable in unknowns])
    invisible = tuple(unknowns[i].name for i in columns.invisible)
    return Identifiable(tuple(v.name for v in unknowns), tuple(combinations.values()), invisible)


def _split(
    algebra: Algebra, column: Mapping[str, sp.Expr], moving: NDArray[np.bool_], absolute: bool
) -> dict[Hashable, Poly]:
    """Polynomials in what is fixed, by component and monomial of what is varied."""
    found: dict[Hashable, Poly] = {}
    for component, expression in column.items():
        poly = algebra.poly(expression)
        for powers, coefficient in poly.items():
            varied = tuple(np.where(moving, powers, 0).tolist())
            if absolute or any(varied):
                term = poly.new({tuple(np.where(moving, 0, powers).tolist()): coefficient})
                key = (component, varied)
                found[key] = found[key] + term if key in found else term
    return found
