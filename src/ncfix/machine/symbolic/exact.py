"""Numbers of a machine file as exact constants: 0.7071067811865476 is sqrt(2)/2, a head's 50 degrees stay 50 degrees.

What is recognised is put into formulas as it is; what is not, or what the reader wants to see as a letter, becomes a
Large variable with a value.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import atan2, pi

import sympy as sp

from ncfix.machine.symbolic.steps import UNITS, ZERO, Expr, Vector, added, scaled
from ncfix.machine.symbolic.variables import Variable

CLOSE = 1e-14
"""How near an exact constant a number must be: well below what the fast engine resolves."""
STEPS_PER_DEGREE = 60
"""Angles of whole minutes of arc are exact."""
LARGEST_DENOMINATOR = 100
"""Numbers whose squares are fractions with no larger denominator are exact."""


class Constants:
    """Turns numbers into exact constants or variables; keeps the variables."""

    def __init__(self, lettered: bool = False) -> None:
        """`lettered`: fixed angles become variables even where they are recognised."""
        self.lettered = lettered
        self.variables: dict[str, Variable] = {}
        self._shared: dict[tuple[str, float], str] = {}

    def point(self, values: Sequence[float], suffix: str, definition: str) -> Vector:
        """A point, mm: zero is zero; every other coordinate a variable, the same one where points share it."""
        x, y, z = (self._length(value, c, suffix, definition) for c, value in zip("xyz", values, strict=True))
        return x, y, z

    def _length(self, value: float, coordinate: str, suffix: str, definition: str) -> Expr:
        if not value:
            return sp.Integer(0)
        name = self._shared.setdefault((coordinate, value), f"{coordinate}{suffix}")
        if name in self.variables:
            known = self.variables[name]
            meaning = known.definition if definition in known.definition else f"{known.definition}, {definition}"
            self.variables[name] = replace(known, definition=meaning)
            return known.symbol
        return self._variable(name, value, f"{coordinate} of {definition}")

    def direction(self, values: Sequence[float], suffix: str, definition: str) -> Vector:
        """A unit vector: along a coordinate axis, in a coordinate plane, or skew."""
        inside = [k for k, value in enumerate(values) if abs(value) > CLOSE]
        if len(inside) == 1:
            return tuple(sp.Integer(round(value)) for value in values)
        if len(inside) == 2:
            return self._in_plane(values, inside, suffix, definition)
        x, y, z = (_root(value) or sp.Rational(value) for value in values)
        return x, y, z

    def _in_plane(self, values: Sequence[float], inside: list[int], suffix: str, definition: str) -> Vector:
        near, far = inside if 2 not in inside else reversed(inside)
        size = atan2(abs(values[far]), abs(values[near]))
        where = f"angle from {'xyz'[near]} towards {'xyz'[far]} of {definition}"
        exact = None if self.lettered else _degrees(size)
        angle = self._variable(f"phi{suffix}", size, where, rotary=True) if exact is None else exact
        parts = {near: (sp.cos(angle), values[near]), far: (sp.sin(angle), values[far])}
        total = ZERO
        for k, (size_k, value) in parts.items():
            total = added(total, scaled(size_k if value > 0 else -size_k, UNITS["xyz"[k]]))
        return total

    def _variable(self, name: str, value: float, definition: str, rotary: bool = False) -> Expr:
        self.variables[name] = Variable(name, definition=definition, value=float(value), rotary=rotary)
        return self.variables[name].symbol


def _degrees(angle: float) -> Expr | None:
    """The angle as a rational part of pi if it is a whole number of minutes of arc."""
    minutes = round(angle * 180 / pi * STEPS_PER_DEGREE)
    if abs(minutes / STEPS_PER_DEGREE * pi / 180 - angle) > CLOSE:
        return None
    return sp.pi * sp.Rational(minutes, 180 * STEPS_PER_DEGREE)


def _root(value: float) -> Expr | None:
    """The number as the square root of a simple fraction."""
    square = sp.Rational(value * value).limit_denominator(LARGEST_DENOMINATOR)
    root = sp.sqrt(square) * (1 if value > 0 else -1)
    return root if abs(float(root) - value) < CLOSE else None
