"""The variables of Macro B (local to a call level, common, and those of the control), and its expressions.

A variable that was never set is vacant, represented by NaN: it is copied unchanged, is zero in arithmetic, and equals
only another vacant one. A value that is known only at run time is `Unknown`, as in RS274. So is the machine's position:
compensation changes the value that a program reads, so nothing computed from it can be corrected.
Source: Fanuc 30i operator's manual, "Custom macro", "Variables", "System variables" and "Arithmetic and logic
operation".
"""

from __future__ import annotations

import math
from collections.abc import Callable

from ncfix.control.expressions import (
    ARITHMETIC,
    FUNCTIONS,
    SUMS,
    Evaluate,
    Expressions,
    Fault,
    Scope,
    Unknown,
    Value,
    nominal,
    power,
    remainder,
    scaled,
)
from ncfix.text.tree import Expression
from ncfix.values import mutable
from ncfix_iso.rs274.parameters import OUT_OF_RANGE, READ_ONLY_FAULT, Key, NumberedParameters, Store

VACANT = math.nan
"""The value of a variable that has none."""

NEARLY = 1e-8
"""Relative difference below which two numbers may be equal on a control with other rounding."""

ROUNDED = frozenset("XYZABCUVWIJKRQ")
"""Addresses in which ROUND works to the least increment."""


def number(value: float) -> float:
    """A value in arithmetic: vacant counts as zero."""
    return 0.0 if math.isnan(value) else value


def is_vacant(value: Value) -> bool:
    """Whether a value is vacant."""
    return math.isnan(nominal(value))


def variable_number(value: float) -> int:
    """The number of a variable given by a value; raises `Fault` if it is not whole."""
    index = number(value)
    if abs(index - round(index)) > 0.001:
        raise Fault(ARITHMETIC, f"the number of a variable is {value:g}, but must be a whole number")
    return round(index)


def whole_number(value: float) -> int:
    """The operand of a bit operation: the value rounded to a whole number."""
    return math.floor(value + 0.5)


def rounded(value: float) -> float:
    """ROUND: to the nearest whole number, halves away from zero."""
    return math.copysign(math.floor(abs(value) + 0.5), value)


def from_bcd(value: float) -> float:
    """BIN: the number whose decimal digits are the hexadecimal ones of `value`."""
    try:
        return float(int(f"{whole_number(value):x}"))
    except ValueError:
        raise Fault(ARITHMETIC, f"BIN of {value:g}: not a binary coded decimal") from None


def arc_tangent(y: float, x: float) -> float:
    """`ATAN[y]/[x]` in degrees, from 0 to 360 (the control's parameter NAT at 0)."""
    if x == 0.0 and y == 0.0:
        raise Fault(ARITHMETIC, "ATAN of zero by zero")
    return math.degrees(math.atan2(y, x)) % 360.0


RELATIONS: dict[str, Callable[[float, float], bool]] = {
    "eq": lambda a, b: math.isnan(a) and math.isnan(b) if math.isnan(a) or math.isnan(b) else a == b,
    "ne": lambda a, b: not RELATIONS["eq"](a, b),
    "lt": lambda a, b: number(a) < number(b),
    "gt": lambda a, b: number(a) > number(b),
    "le": lambda a, b: number(a) <= number(b),
    "ge": lambda a, b: number(a) >= number(b),
}
"""EQ and NE: a vacant variable equals a vacant one only."""


OPERATORS: dict[str, Callable[[float, float], float]] = {
    **SUMS,
    "mod": remainder,
    "**": power,
    "pow": power,
    "and": lambda a, b: float(whole_number(a) & whole_number(b)),
    "or": lambda a, b: float(whole_number(a) | whole_number(b)),
    "xor": lambda a, b: float(whole_number(a) ^ whole_number(b)),
    "atan": arc_tangent,
}

FUNCTIONS_OF_MACROS: dict[str, tuple[Callable[..., float], int]] = {
    **FUNCTIONS,
    "adp": (lambda a: a, 1),
    "atan": (lambda a: math.degrees(math.atan(a)), 1),
    "bcd": (lambda a: float(int(str(whole_number(a)), 16)), 1),
    "bin": (from_bcd, 1),
    "fix": (lambda a: float(math.trunc(a)), 1),
    "fup": (lambda a: math.copysign(math.ceil(abs(a)), a), 1),
    "rnd": (rounded, 1),
    "round": (rounded, 1),
}


class MacroExpressions(Expressions):
    """Macro B: `#1`, `#[...]`, `[...]`; scopes have `parameters` and `least_increment(address)`."""

    operators = OPERATORS
    functions = FUNCTIONS_OF_MACROS

    def operand(self, value: float) -> float:
        """A vacant variable counts as zero."""
        return number(value)

    def numbered(self, index: Evaluate) -> Evaluate:
        """`#1`, `#[...]`; the number of the variable may itself be unknown."""

        def evaluate(scope: object) -> Value:
            which = index(scope)
            value: Value = scope.parameters.numbered(variable_number(nominal(which)))  # type: ignore[attr-defined]
            return Unknown(which.why, nominal(value)) if isinstance(which, Unknown) else value

        return evaluate

    def function(self, name: str, arguments: tuple[Evaluate, ...], address: str = "") -> Evaluate:
        """A function or a sign; both keep a vacant value vacant. ROUND in an address rounds to the least increment."""
        (operand,) = arguments
        if name in "+-":
            sign = -1.0 if name == "-" else 1.0
            return lambda scope: scaled(sign, operand(scope))
        if name != "round" or address not in ROUNDED:
            return super().function(name, arguments, address)

        def to_increments(scope: Scope) -> Value:
            increment = scope.least_increment(address)  # type: ignore[attr-defined]
            return self.applied(name, lambda value: rounded(value / increment) * increment, operand(scope))

        return to_increments

    def operator(self, operator: str, left: Expression, right: Expression, address: str = "") -> Evaluate:
        """An operator; a relation is unknown if rounding may decide it."""
        relation = RELATIONS.get(operator)
        if relation is None:
            return super().operator(operator, left, right, address)
        first, second = self.compiled(left, address), self.compiled(right, address)

        def evaluate(scope: Scope) -> Value:
            one, other = first(scope), second(scope)
            a, b = nominal(one), nominal(other)
            holds = float(relation(a, b))
            in_doubt = a != b and abs(a - b) <= NEARLY * max(abs(a), abs(b))
            if in_doubt or isinstance(one, Unknown) or isinstance(other, Unknown):
                return Unknown("", holds)
            return holds

        return evaluate


compiled = MacroExpressions().compiled


LOCAL = range(1, 34)
"""#1 to #33 belong to the call level."""

LASTING = (range(400, 1000), range(900_000, 907_400))
"""Common variables that keep their values for other programs; those from #400 and #900000 on are Mitsubishi's."""

COMMON = (range(100, 200), *LASTING, range(98000, 98500))
LAST = 149_999
"""The largest number of a variable of the control."""

POSITIONS = (range(5001, 5021), range(5021, 5041), range(5041, 5061))
"""End of the block before, machine position, present position."""


@mutable
class MacroVariables(NumberedParameters):
    """All variables of a program.

    scopes    local variables of each call level, the main program's first
    position  called with the number of a variable when the program reads a position of the machine
    inherits  the program is called by another one, which sets its local variables
    """

    position: Callable[[int], None] = lambda index: None
    inherits: bool = False

    def numbered(self, index: int) -> Value:
        """The value of `#index`, vacant if it has none; raises `Fault`."""
        if index == 0:
            return VACANT
        if not exists(index):
            raise Fault(OUT_OF_RANGE, f"there is no variable #{index}")
        store = self.store_of(index)
        if index in self.live:
            return self.from_control(index)
        if index not in store and (is_common(index) or (self.inherits and len(self.scopes) == 1)):
            return self.unset(index)
        return store.get(index, Unknown(f"#{index}") if is_system(index) else VACANT)

    def from_control(self, index: int) -> Value:
        """A value that the control computes; a position is `Unknown`, because a correction changes it."""
        self.changes += 1
        value = self.live[index]()
        if any(index in positions for positions in POSITIONS):
            self.position(index)
            return Unknown(f"#{index}", nominal(value))
        return value

    def store_of(self, index: Key) -> Store:
        """The store that holds a variable."""
        return self.scopes[-1] if index in LOCAL else self.numbers

    def check_writable(self, key: Key) -> None:
        """Raise `Fault` if the program may not assign to the variable."""
        if key == 0 or not isinstance(key, int):
            raise Fault(READ_ONLY_FAULT, "#0 is always vacant and cannot be set")
        if not exists(key):
            raise Fault(OUT_OF_RANGE, f"there is no variable #{key}")
        if any(key in positions for positions in POSITIONS):
            raise Fault(READ_ONLY_FAULT, f"#{key} cannot be set: it is a position of the machine")


def is_common(index: int) -> bool:
    """Whether all programs share a variable."""
    return any(index in numbers for numbers in COMMON)


def is_lasting(index: int) -> bool:
    """Whether a variable keeps its value for other programs."""
    return any(index in numbers for numbers in LASTING)


def exists(index: int) -> bool:
    """Whether a control of the family may have a variable with this number."""
    return 0 < index <= LAST or is_common(index)


def is_system(index: Key) -> bool:
    """Whether a variable is one of the control's own."""
    return isinstance(index, int) and index not in LOCAL and not is_common(index)
