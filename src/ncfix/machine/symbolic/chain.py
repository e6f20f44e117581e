"""A chain: its variables, and the ordered elementary transformations from the workpiece to the tool.

Each variable is Large (a position, a dimension) or Small (an error). Formulas are expanded in powers of the Small ones.
An error may be a function of axis positions: `EXX(X)`. A step is a right-handed translation, rotation, or small motion:
it takes coordinates after it to coordinates before it, and the chain is the product of all steps from the workpiece
(left) to the tool (right). The matrix of a step is a series in the Small variables: the sum of their monomials, each
times a coefficient matrix (4, 4). Freeman and Ford (2003), sections 2 to 4; their rotations about x and z are
left-handed.
"""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterable, Sequence
from dataclasses import field, fields, replace
from enum import Enum
from itertools import combinations_with_replacement
from math import prod
from typing import Self, TypeAlias

import sympy as sp

from ncfix.diagnostics import ConfigError
from ncfix.values import frozen

TAKEN = (
    "np", "shape", "map", "v", "locals", "float", "pi", "sin", "cos", "tan", "sqrt", "branch", *"xyzijk",
    "dx", "dy", "dz", "rx", "ry", "rz",
)  # fmt: skip
RESERVED = {*keyword.kwlist, *keyword.softkwlist, *TAKEN}
GREEK = re.compile(r"(Theta|theta|phi|psi|alpha|beta|gamma|delta)(\w*)")
LETTER = re.compile(r"([A-Za-z])_?(\w+)")


class Size(Enum):
    """The size of a variable: formulas are exact in Large ones, and expanded in powers of Small ones."""

    LARGE = "large"
    SMALL = "small"


@frozen
class Variable:
    """A variable of a chain.

    name        a name that is valid in programming languages, too
    size        Large or Small
    definition  its meaning in words
    axis        it is the position of an axis, which a command sets
    rotary      it is an angle, rad; else a length, mm
    arguments   names of the variables on which an error depends; empty if it is constant
    value       its value, mm or rad; None if it has none
    sign        -1 if the angle is defined clockwise, as in some older work; the formulas of chain files apply it
    """

    name: str
    size: Size = Size.LARGE
    definition: str = ""
    axis: bool = False
    rotary: bool = False
    arguments: tuple[str, ...] = ()
    value: float | None = None
    sign: int = 1

    def __post_init__(self) -> None:
        if self.name in RESERVED or not all(name.isidentifier() for name in (self.name, *self.arguments)):
            hint = (
                "use letters, digits and underscores; Python keywords and names of results such as x or dx are not "
                "possible"
            )
            raise ConfigError.of("NCF391", f"{self.name!r} cannot be the name of a variable", hint=hint)

    @property
    def small(self) -> bool:
        """Whether it is an error."""
        return self.size is Size.SMALL

    @property
    def plain(self) -> sp.Symbol:
        """The bare symbol."""
        return sp.Symbol(self.name, real=True)

    @property
    def symbol(self) -> sp.Expr:
        """Its symbol in formulas, or a function of the variables on which it depends."""
        if not self.arguments:
            return self.plain
        return sp.Function(self.name, real=True)(*(sp.Symbol(name, real=True) for name in self.arguments))

    @property
    def latex(self) -> str:
        """Its name in LaTeX, without arguments."""
        if self.name == "tool_length":
            return "L"
        if match := GREEK.fullmatch(self.name):
            return rf"\{match[1]}_{{{match[2]}}}" if match[2] else rf"\{match[1]}"
        if match := LETTER.fullmatch(self.name):
            return rf"{match[1]}_{{\mathrm{{{match[2]}}}}}"
        return self.name


Expr: TypeAlias = sp.Expr
Vector = tuple[Expr, Expr, Expr]
Monomial = tuple[int, ...]
"""A product of Small variables: their indices in ascending order, repeated for powers; () for the number one."""
Matrices = dict[Monomial, sp.Matrix]

ZERO: Vector = (sp.Integer(0),) * 3
UNITS: dict[str, Vector] = {
    name: tuple(sp.Integer(int(i == k)) for i in range(3)) for k, name in enumerate("xyz")
}  # fmt: skip


@frozen
class Transformation:
    """Base class of the steps; their fields are vectors and expressions."""

    @property
    def expressions(self) -> tuple[Expr, ...]:
        """All expressions in the step; vectors give their three components."""
        parts = (getattr(self, each.name) for each in fields(self))
        return tuple(e for part in parts for e in (part if isinstance(part, tuple) else (part,)))

    def with_values(self, values: dict[Expr, Expr]) -> Self:
        """The step with symbols replaced by expressions: `values`."""
        parts = {each.name: getattr(self, each.name) for each in fields(self)}
        vectors = {n: tuple(e.xreplace(values) for e in part) for n, part in parts.items() if isinstance(part, tuple)}
        return replace(self, **{n: vectors[n] if n in vectors else part.xreplace(values) for n, part in parts.items()})


@frozen
class Translation(Transformation):
    """A shift along the coordinate axes, mm; each component a polynomial in the Small variables."""

    vector: Vector

    @property
    def inverse(self) -> Translation:
        """The shift back."""
        return Translation(negated(self.vector))


@frozen
class Rotation(Transformation):
    """A right-handed rotation about a unit vector through the origin; the angle, rad, is linear in the errors."""

    direction: Vector
    angle: Expr

    @property
    def inverse(self) -> Rotation:
        """The rotation back."""
        return Rotation(self.direction, -self.angle)


@frozen
class Screw(Transformation):
    """The exponential of a small twist about the origin: rotation vector, rad, and velocity of the origin, mm."""

    rotation: Vector
    velocity: Vector = field(default=ZERO)

    @property
    def inverse(self) -> Screw:
        """The screw back."""
        return Screw(negated(self.rotation), negated(self.velocity))


Step = Translation | Rotation | Screw


def inverse(steps: Sequence[Step]) -> tuple[Step, ...]:
    """The steps that undo these: their inverses in reverse order."""
    return tuple(step.inverse for step in reversed(steps))


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
    """The rotation matrix (3, 3) of a unit vector and an angle; functions of sums of angles are expanded."""
    cosine, sine = (sp.expand_trig(f(angle)) if f(angle).free_symbols else f(angle) for f in (sp.cos, sp.sin))
    turning, u = skew(direction), sp.Matrix(direction)
    return cosine * sp.eye(3) + sine * turning + (1 - cosine) * (u * u.T)


def homogeneous(rotation: sp.Matrix, translation: Sequence[Expr], corner: int = 1) -> sp.Matrix:
    """The 4x4 matrix of a motion (corner 1) or of a twist (corner 0)."""
    top = rotation.row_join(sp.Matrix(list(translation)))
    return top.col_join(sp.Matrix([[0, 0, 0, corner]]))


def linear_part(expression: Expr, smalls: Sequence[Expr]) -> tuple[Expr, dict[int, Expr]]:
    """The parts of an expression that is linear in the Small variables: the one without them, and index -> factor."""
    found = {i: expression.diff(small) for i, small in enumerate(smalls) if expression.has(small)}
    return expression.xreplace(dict.fromkeys(smalls, sp.Integer(0))), found


def polynomial_part(expression: Expr, smalls: Sequence[Expr], order: int) -> dict[Monomial, Expr]:
    """Monomial of the Small variables -> its coefficient in the Taylor series of an expression, up to an order."""
    present = [i for i, small in enumerate(smalls) if expression.has(small)]
    zero = dict.fromkeys(smalls, sp.Integer(0))
    found = {}
    for degree in range(order + 1):
        for monomial in combinations_with_replacement(present, degree):
            derivative = sp.diff(expression, *(smalls[i] for i in monomial)) if monomial else expression
            found[monomial] = derivative.xreplace(zero) / prod(sp.factorial(monomial.count(i)) for i in set(monomial))
    return found


@frozen
class Chain:
    """A chain: the input of a derivation.

    name       its name, for people
    variables  all variables of the steps, Large and Small
    steps      workpiece_from_tool is their product, left to right; the last frame has its origin at the tool tip
    tool_axis  the unit vector from the tip towards the spindle in the last frame
    """

    name: str
    variables: tuple[Variable, ...]
    steps: tuple[Step, ...]
    tool_axis: Vector = UNITS["z"]

    @property
    def smalls(self) -> tuple[Variable, ...]:
        """The errors, in the order of `variables`."""
        return tuple(variable for variable in self.variables if variable.small)

    @property
    def axes(self) -> tuple[Variable, ...]:
        """The axis positions."""
        return tuple(variable for variable in self.variables if variable.axis)

    @property
    def dimensions(self) -> tuple[Variable, ...]:
        """The Large variables that are not axis positions."""
        return tuple(variable for variable in self.variables if not variable.small and not variable.axis)

    def variable(self, name: str) -> Variable:
        """The variable of that name; KeyError if there is none."""
        return {variable.name: variable for variable in self.variables}[name]

    def without(self, names: Iterable[str]) -> Chain:
        """This chain with some errors set to zero."""
        gone = set(names)
        zero = {variable.symbol: sp.Integer(0) for variable in self.smalls if variable.name in gone}
        steps = tuple(step.with_values(zero) for step in self.steps)
        variables = tuple(variable for variable in self.variables if variable.symbol not in zero)
        return replace(self, variables=variables, steps=steps)

    def shifted(self, shift: Vector) -> Chain:
        """This chain seen from a frame whose origin is moved by -shift: `shift` is added to every position."""
        return replace(self, steps=(Translation(shift), *self.steps))
