"""Expressions of a block made into functions, once per shape; a function reads its numbers from a `Scope`."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

from ncfix.control.arithmetic import ARITHMETIC
from ncfix.control.faults import Fault
from ncfix.control.scope import BlockNumbers, literal
from ncfix.text.tree import Binary, Constant, Exists, Expression, Literal, NamedParameter, Parameter, Unary
from ncfix_iso.rs274.arithmetic import BINARY, UNARY, in_doubt, whole


class Values(Protocol):
    """The parameters as expressions see them.

    touched  a value known only at run time has been read
    """

    touched: bool

    def numbered(self, index: int) -> float:
        """The value of `#index`; raises `Fault`."""

    def named(self, name: str) -> float:
        """The value of `#<name>`; raises `Fault`."""

    def exists(self, key: int | str) -> bool:
        """Whether the parameter has been defined."""


class Scope(BlockNumbers, Protocol):
    """What an expression may refer to."""

    @property
    def parameters(self) -> Values:
        """The parameters."""


Evaluate = Callable[[Scope], float]


def compiled(expression: Expression) -> Evaluate:
    """The function that computes an expression; it raises `Fault` where the control would stop."""
    match expression:
        case Literal(slot):
            return literal(slot)
        case Constant(value):
            return lambda scope: value
        case Parameter(index):
            number = compiled(index)
            return lambda scope: scope.parameters.numbered(whole(number(scope), "the number of a parameter"))
        case NamedParameter(name):
            return lambda scope: scope.parameters.named(name)
        case Exists(parameter):
            return existence(parameter)
        case Unary(operator, operand):
            return unary(operator, compiled(operand))
        case Binary(operator, left, right):
            return binary(operator, compiled(left), compiled(right))
        case _:
            raise AssertionError(f"the grammars of this family have no {type(expression).__name__}")


def unary(operator: str, operand: Evaluate) -> Evaluate:
    """A sign or a function of one argument."""
    function = UNARY[operator]
    return lambda scope: function(operand(scope))


def binary(operator: str, left: Evaluate, right: Evaluate) -> Evaluate:
    """An operator between two operands; what depends on the version of the control is known at run time only."""
    function = BINARY[operator]

    def evaluate(scope: Scope) -> float:
        a, b = left(scope), right(scope)
        if in_doubt(operator, a, b):
            scope.parameters.touched = True
        value = function(a, b)
        if not math.isfinite(value):
            raise Fault(ARITHMETIC, f"the result of {operator} is not a finite number")
        return value

    return evaluate


def existence(parameter: Parameter | NamedParameter) -> Evaluate:
    """`EXISTS[...]`: 1 or 0."""
    if isinstance(parameter, NamedParameter):
        name = parameter.name
        return lambda scope: float(scope.parameters.exists(name))
    number = compiled(parameter.index)
    return lambda scope: float(scope.parameters.exists(whole(number(scope), "the number of a parameter")))
