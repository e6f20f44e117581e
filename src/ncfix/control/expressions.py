"""Evaluation of the expressions in blocks: one evaluator for all languages.

Each expression is compiled once per block shape to a function. The function reads the numbers of the block being
executed from a `Scope` and returns a `Value`: a number, a text, or `Unknown` for what is not known before the machine
runs (a probed position, an input, a variable left by an earlier program). A result computed from an unknown value is
unknown for the same reason. Each language defines its operators, functions and number rules in its own `Expressions`.
Angles are in degrees.

`Fault` is raised for what stops the control; its place in the file is added while it propagates.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, ClassVar, NamedTuple, Protocol

from ncfix.text.tree import (
    Binary,
    Constant,
    Exists,
    Expression,
    FunctionCall,
    Literal,
    NamedParameter,
    NumberedParameter,
    Span,
    StringLiteral,
    Unary,
)


class Fault(Exception):  # noqa: N818 - a fault of the program that is followed, not of ncfix
    """An error in the program being followed: the control would stop here, or ncfix cannot follow further.

    code  the coded error
    text  what is wrong, in plain words
    hint  what to do about it
    span  place in the block; None for the whole block
    """

    def __init__(self, code: str, text: str, hint: str = "", span: Span | None = None) -> None:
        super().__init__(code, text)
        self.code = code
        self.text = text
        self.hint = hint
        self.span = span

    def at(self, span: Span | None) -> Fault:
        """This fault with a place in the block, unless it has one already."""
        if self.span is None:
            self.span = span
        return self


ARITHMETIC = "NCF210"


class Unknown(NamedTuple):
    """A value that is known only at run time.

    why      what it depends on, for messages: the name of a variable; empty if there is nothing to tell
    nominal  the value in a dry run
    """

    why: str = ""
    nominal: float = 0.0


Value = float | str | Unknown
"""A number (also true and false), a text, or a value known only at run time."""


class Scope(Protocol):
    """What an expression can read; each language adds its variables."""

    @property
    def numbers(self) -> Sequence[float]:
        """The numbers of the text being executed."""

    @property
    def first(self) -> int:
        """Index of the first number of the block."""


Evaluate = Callable[[Any], Value]
"""Computes the value of an expression in a `Scope` of its language; raises `Fault` where the control would stop."""


class Expressions:
    """The arithmetic of a language.

    operators   operator -> function of its two operands
    functions   name or sign -> function, and its number of arguments
    impossible  message for a result that is not a finite number; `{}` stands for the operator or function

    Functions raise `Fault`, ValueError or ArithmeticError if there is no result. With an unknown operand no fault is
    raised: the result is unknown, with nominal value 0.
    """

    operators: ClassVar[Mapping[str, Callable[[float, float], float]]] = {}
    functions: ClassVar[Mapping[str, tuple[Callable[..., float], int]]] = {}
    impossible = "the result of {} is not a finite number"

    def compiled(self, expression: Expression, address: str = "") -> Evaluate:
        """The function that computes an expression; `address`: the address that it follows, if any."""
        match expression:
            case Literal(slot):
                return lambda scope: scope.numbers[scope.first + slot]
            case Constant(value):
                return lambda scope: value
            case StringLiteral(text):
                return self.text(text)
            case NumberedParameter(index):
                return self.numbered(self.compiled(index))
            case NamedParameter(name):
                return self.named(name)
            case Exists(parameter):
                return self.existence(parameter)
            case Unary(operator, operand):
                return self.function(operator, (self.compiled(operand, address),), address)
            case Binary(operator, left, right):
                return self.operator(operator, left, right, address)
            case FunctionCall(name, arguments, indexed):
                parts = tuple(left_out if part is None else self.compiled(part) for part in arguments)
                return self.element(name, parts) if indexed else self.function(name, parts, address)
        raise self.none_such(expression)

    def none_such(self, expression: object) -> AssertionError:
        """The error for an expression that the grammar of the language does not have."""
        return AssertionError(f"{type(self).__name__}: the grammar has no {expression!r}")

    # -- what a language has of its own -------------------------------------------------------------------------------

    def operand(self, value: float) -> float:
        """The value as which a number enters arithmetic."""
        return value

    def in_doubt(self, operator: str, left: float, right: float) -> bool:
        """Whether a comparison depends on the control or on rounding; its result is unknown then."""
        return False

    def text(self, text: str) -> Evaluate:
        """The function for a text."""
        return lambda scope: text

    def numbered(self, index: Evaluate) -> Evaluate:
        """The function for a variable read by its number."""
        raise self.none_such(index)

    def named(self, name: str) -> Evaluate:
        """The function for a variable read by its name."""
        raise self.none_such(name)

    def element(self, name: str, index: tuple[Evaluate, ...]) -> Evaluate:
        """The function for an element of an array."""
        raise self.none_such(name)

    def existence(self, parameter: NumberedParameter | NamedParameter) -> Evaluate:
        """The function that tells whether a variable has been defined."""
        raise self.none_such(parameter)

    # -- operators and functions --------------------------------------------------------------------------------------

    def function(self, name: str, arguments: tuple[Evaluate, ...], address: str = "") -> Evaluate:
        """The function for a sign or a function call; `arguments` compute its arguments."""
        function, count = self.functions[name]
        if len(arguments) != count:
            text = f"{name.upper()} takes {count} argument{'s' if count > 1 else ''}"

            def wrong(scope: Scope) -> Value:
                raise Fault(ARITHMETIC, text)

            return wrong
        return lambda scope: self.applied(name, function, *[argument(scope) for argument in arguments])

    def operator(self, operator: str, left: Expression, right: Expression, address: str = "") -> Evaluate:
        """The function for an operator with two operands."""
        function = self.operators[operator]
        first, second = self.compiled(left, address), self.compiled(right, address)

        def evaluate(scope: Scope) -> Value:
            a, b = first(scope), second(scope)
            value = self.applied(operator, function, a, b)
            if isinstance(value, float) and self.in_doubt(operator, nominal(a), nominal(b)):
                return Unknown("", value)
            return value

        return evaluate

    def applied(self, name: str, function: Callable[..., float], *values: Value) -> Value:
        """The result of `function`; unknown if an argument is unknown, or is a text, which is no number."""
        unknown = next((value for value in reversed(values) if isinstance(value, Unknown | str)), None)
        try:
            result = float(function(*(self.operand(nominal(value)) for value in values)))
            if not math.isfinite(result):
                raise ArithmeticError
        except (Fault, ValueError, ArithmeticError) as error:
            if unknown is not None:
                return Unknown(unknown.why if isinstance(unknown, Unknown) else "")
            if isinstance(error, Fault):
                raise
            raise Fault(ARITHMETIC, self.impossible.format(name)) from None
        if unknown is None:
            return result
        return Unknown(unknown.why if isinstance(unknown, Unknown) else "", result)


def left_out(scope: Scope) -> Value:
    """Value of an omitted argument, or of anything that cannot be known: unknown."""
    return Unknown()


# -- what all controls compute alike ----------------------------------------------------------------------------------


def divide(left: float, right: float) -> float:
    """`left / right`."""
    if right == 0.0:
        raise Fault(ARITHMETIC, "division by zero")
    return left / right


def power(left: float, right: float) -> float:
    """`left ** right`."""
    if left < 0.0 and not right.is_integer():
        raise Fault(ARITHMETIC, f"a negative number to the power {right:g}")
    try:
        return float(left**right)
    except (OverflowError, ZeroDivisionError):
        raise Fault(ARITHMETIC, f"{left:g} ** {right:g} is too large a number") from None


def remainder(left: float, right: float) -> float:
    """`left MOD right`, with the sign of `left`."""
    if right == 0.0:
        raise Fault(ARITHMETIC, "MOD by zero")
    return math.fmod(left, right)


def inverse(function: Callable[[float], float], name: str) -> Callable[[float], float]:
    """Arc sine or arc cosine in degrees."""

    def checked(value: float) -> float:
        if not -1.0 <= value <= 1.0:
            raise Fault(ARITHMETIC, f"{name} of {value:g}: the argument must be between -1 and 1")
        return math.degrees(function(value))

    return checked


def logarithm(value: float) -> float:
    """`LN[value]`."""
    if value <= 0.0:
        raise Fault(ARITHMETIC, f"LN of {value:g}: the argument must be positive")
    return math.log(value)


def square_root(value: float) -> float:
    """`SQRT[value]`."""
    if value < 0.0:
        raise Fault(ARITHMETIC, f"SQRT of the negative number {value:g}")
    return math.sqrt(value)


def exponential(value: float) -> float:
    """`EXP[value]`."""
    try:
        return math.exp(value)
    except OverflowError:
        raise Fault(ARITHMETIC, f"EXP of {value:g} is too large a number") from None


FUNCTIONS: dict[str, tuple[Callable[..., float], int]] = {
    "+": (lambda a: a, 1),
    "-": (lambda a: -a, 1),
    "abs": (abs, 1),
    "acos": (inverse(math.acos, "ACOS"), 1),
    "asin": (inverse(math.asin, "ASIN"), 1),
    "cos": (lambda a: math.cos(math.radians(a)), 1),
    "exp": (exponential, 1),
    "ln": (logarithm, 1),
    "sin": (lambda a: math.sin(math.radians(a)), 1),
    "sqrt": (square_root, 1),
    "tan": (lambda a: math.tan(math.radians(a)), 1),
}
"""Signs, and the one-argument functions common to most languages."""

SUMS: dict[str, Callable[[float, float], float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": divide,
}
"""The four rules of arithmetic."""


def nominal(value: Value) -> float:
    """The value in a dry run: a number itself, the nominal value of an unknown, 0 for a text."""
    if isinstance(value, Unknown):
        return value.nominal
    return 0.0 if isinstance(value, str) else value


def number(value: Value) -> float | None:
    """The value as a number; None for a text or an unknown value."""
    return None if isinstance(value, Unknown | str) else value


def numbers(values: Iterable[Value]) -> list[float] | None:
    """The values as numbers; None if one is a text or unknown."""
    found: list[float] = []
    for value in values:
        if isinstance(value, Unknown | str):
            return None
        found.append(value)
    return found


def scaled(factor: float, value: Value) -> Value:
    """A value multiplied by a number."""
    return Unknown(value.why, factor * value.nominal) if isinstance(value, Unknown) else factor * nominal(value)
