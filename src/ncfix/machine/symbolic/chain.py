"""A chain: variables and the ordered elementary transformations from the workpiece to the tool."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import sympy as sp

from ncfix.machine.symbolic.steps import UNITS, Step, Translation, Vector
from ncfix.machine.symbolic.variables import Variable


@dataclass(frozen=True, slots=True)
class Chain:
    """What a derivation starts from.

    name       for people
    variables  all that occur in the steps, Large and Small
    steps      workpiece_from_tool is their product, left to right; the last frame has its origin at the tool tip
    tool_axis  the unit vector from the tip towards the spindle in the last frame
    """

    name: str
    variables: tuple[Variable, ...]
    steps: tuple[Step, ...]
    tool_axis: Vector = UNITS["z"]

    @property
    def smalls(self) -> tuple[Variable, ...]:
        """The errors, in order."""
        return tuple(variable for variable in self.variables if variable.small)

    @property
    def axes(self) -> tuple[Variable, ...]:
        """The axis positions."""
        return tuple(variable for variable in self.variables if variable.axis)

    @property
    def dimensions(self) -> tuple[Variable, ...]:
        """Large variables that are no axis positions."""
        return tuple(variable for variable in self.variables if not variable.small and not variable.axis)

    def variable(self, name: str) -> Variable:
        """The variable of that name; KeyError if there is none."""
        for variable in self.variables:
            if variable.name == name:
                return variable
        raise KeyError(name)

    def without(self, names: Iterable[str]) -> Chain:
        """The same chain with some errors set to zero."""
        gone = set(names)
        zero = {variable.symbol: sp.Integer(0) for variable in self.smalls if variable.name in gone}
        steps = tuple(step.with_values(zero) for step in self.steps)
        variables = tuple(variable for variable in self.variables if variable.symbol not in zero)
        return replace(self, variables=variables, steps=steps)

    def shifted(self, shift: Vector) -> Chain:
        """The same chain seen from a frame whose origin is moved by -shift: `shift` is added to every position."""
        return replace(self, steps=(Translation(shift), *self.steps))
