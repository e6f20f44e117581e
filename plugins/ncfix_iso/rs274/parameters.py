"""Parameters of a program (numbered, named by scope, and those maintained by the control), and RS274NGC expressions as
computed by LinuxCNC.

A value that exists only at run time (a probed position, an input) has a nominal value here, as in a dry run, and is
`Unknown`; so is everything computed from it.

Source: LinuxCNC documentation, "G-code overview", "Binary operators" and "Functions"; angles in degrees. Since version
2.9.1 numbers that differ by less than 1e-6 are equal, also for `le` and `ge`. Earlier the limit was 0.0001 for `eq` and
`ne`, and `le` and `ge` were exact. `lt` and `gt` are exact in all versions (LinuxCNC, pull request 2525).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import field

from ncfix.control.expressions import (
    ARITHMETIC,
    FUNCTIONS,
    SUMS,
    Evaluate,
    Expressions,
    Fault,
    Unknown,
    Value,
    nominal,
    power,
    remainder,
)
from ncfix.text.tree import NamedParameter, NumberedParameter
from ncfix.values import mutable

EQUAL = 1e-6
"""Difference below which two numbers are equal."""

FORMERLY_EQUAL = 1e-4
"""The same for `eq` and `ne` before version 2.9.1."""


def modulo(left: float, right: float) -> float:
    """`left MOD right`, never negative."""
    rest = remainder(left, right)
    return rest + abs(right) if rest < 0.0 else rest


FARTHEST = 2**31
"""Bound of indices, labels and counts."""


def whole(value: float, what: str) -> int:
    """A number that must be an integer, such as an index or a label; LinuxCNC accepts a deviation of 0.0001."""
    if not abs(value) < FARTHEST:
        raise Fault(ARITHMETIC, f"{what} is {value:g}, which is too large")
    nearest = math.floor(value)
    if value - nearest > 0.9999:
        return nearest + 1
    if value - nearest > 0.0001:
        raise Fault(ARITHMETIC, f"{what} is {value:g}, but must be a whole number")
    return nearest


def number_of(value: Value) -> int:
    """The number of a parameter as an integer."""
    return whole(nominal(value), "the number of a parameter")


OPERATORS: dict[str, Callable[[float, float], float]] = {
    **SUMS,
    "mod": modulo,
    "**": power,
    "and": lambda a, b: float(a != 0.0 and b != 0.0),
    "or": lambda a, b: float(a != 0.0 or b != 0.0),
    "xor": lambda a, b: float((a != 0.0) != (b != 0.0)),
    "eq": lambda a, b: float(abs(a - b) < EQUAL),
    "ne": lambda a, b: float(abs(a - b) >= EQUAL),
    "lt": lambda a, b: float(a < b),
    "gt": lambda a, b: float(a > b),
    "le": lambda a, b: float(a <= b or abs(a - b) < EQUAL),
    "ge": lambda a, b: float(a >= b or abs(a - b) < EQUAL),
    "atan": lambda y, x: math.degrees(math.atan2(y, x)),
}

FUNCTIONS_OF_PARAMETERS: dict[str, tuple[Callable[..., float], int]] = {
    **FUNCTIONS,
    "fix": (lambda a: float(math.floor(a)), 1),
    "fup": (lambda a: float(math.ceil(a)), 1),
    "round": (lambda a: float(math.trunc(a + math.copysign(0.5, a))), 1),
}


class ParameterExpressions(Expressions):
    """Expressions of RS274NGC: `#1`, `#<name>`, `[...]`; the scope has `parameters`."""

    operators = OPERATORS
    functions = FUNCTIONS_OF_PARAMETERS

    def in_doubt(self, operator: str, left: float, right: float) -> bool:
        """Whether older versions of the control give another result for a comparison."""
        match operator:
            case "eq" | "ne":
                return EQUAL <= abs(left - right) < FORMERLY_EQUAL
            case "le":
                return 0.0 < left - right < EQUAL
            case "ge":
                return 0.0 < right - left < EQUAL
        return False

    def numbered(self, index: Evaluate) -> Evaluate:
        """`#1`, `#[...]`; its number may be unknown, too."""

        def evaluate(scope: object) -> Value:
            which = index(scope)
            value: Value = scope.parameters.numbered(number_of(which))  # type: ignore[attr-defined]
            return Unknown(which.why, nominal(value)) if isinstance(which, Unknown) else value

        return evaluate

    def named(self, name: str) -> Evaluate:
        """`#<name>`."""
        return lambda scope: scope.parameters.named(name)

    def existence(self, parameter: NumberedParameter | NamedParameter) -> Evaluate:
        """`EXISTS[...]`: 1 or 0."""
        if isinstance(parameter, NamedParameter):
            name = parameter.name
            return lambda scope: float(scope.parameters.exists(name))
        number = self.compiled(parameter.index)
        return lambda scope: float(scope.parameters.exists(number_of(number(scope))))


compiled = ParameterExpressions().compiled


N_PARAMETERS = 5603
"""Upper bound (exclusive) of the numbers of parameters, which begin at 1."""

LOCAL = range(1, 31)
"""Numbered parameters that each subprogram has for itself."""

READ_ONLY = frozenset((*range(5400, 5414), *range(5420, 5429), 5601, 5602))
UNDEFINED = "NCF211"
READ_ONLY_FAULT = "NCF212"
OUT_OF_RANGE = "NCF213"


Key = int | str
"""Identifies a parameter: its number or its name."""

OF_THE_MACHINE = ("_hal[", "_ini[")
"""Beginnings of the names of machine pins and configuration entries, which are known only at run time."""


Store = dict[Key, Value]
"""The parameters of one scope that have been set."""


@mutable
class NumberedParameters:
    """All parameters.

    numbers     numbered parameters that have been set
    scopes      named parameters: global ones and those of the program first, then those of each call
    live        numbered parameters that the control computes when they are read
    predefined  named parameters of that kind
    persistent  called with the number before a parameter from 5161 to 5390 is read, which may be missing in the setup
    unset       returns the value of any other parameter that the program has not set
    returned    value of the last `return`, and whether it gave one
    inputs      whether a pin of the machine or an input (M66) was read, on which results may depend
    changes     number of changed values, and of reads of parameters computed by the control
    """

    numbers: Store = field(default_factory=dict)
    scopes: list[Store] = field(default_factory=lambda: [{}])
    live: Mapping[int, Callable[[], Value]] = field(default_factory=dict)
    predefined: Mapping[str, Callable[[], Value]] = field(default_factory=dict)
    persistent: Callable[[int], None] = lambda index: None
    unset: Callable[[int], Value] = lambda index: 0.0
    returned: tuple[Value, bool] = (0.0, False)
    inputs: bool = False
    changes: int = 0

    # -- reading ------------------------------------------------------------------------------------------------------

    def numbered(self, index: int) -> Value:
        """The value of `#index`; raises `Fault`."""
        if not 1 <= index < N_PARAMETERS:
            raise Fault(OUT_OF_RANGE, f"there is no parameter #{index}", f"they are #1 to #{N_PARAMETERS - 1}")
        if index in self.live:
            self.changes += 1
            return self.live[index]()
        if 5161 <= index <= 5390:
            self.changes += 1
            self.persistent(index)
        elif index not in self.numbers:
            return self.unset(index)
        return self.numbers.get(index, 0.0)

    def named(self, name: str) -> Value:
        """The value of `#<name>`; raises `Fault`."""
        if name in self.predefined:
            self.changes += 1
            return self.predefined[name]()
        scope = self.scope_of(name)
        if name not in scope and name.startswith(OF_THE_MACHINE):
            self.inputs = True
            return Unknown(f"#<{name}>")
        if name not in scope:
            hint = f'if the control has it: variables."#<{name}>" in the setup file'
            raise Fault(UNDEFINED, f"parameter #<{name}> is used and not defined", hint)
        return scope[name]

    def exists(self, key: Key) -> bool:
        """Whether the parameter is defined."""
        if isinstance(key, int):
            return 1 <= key < N_PARAMETERS
        return key in self.predefined or key in self.scope_of(key)

    def scope_of(self, name: str) -> Store:
        """The scope of a name: global if it begins with `_`, else of the subprogram."""
        return self.scopes[0 if name.startswith("_") else -1]

    # -- writing ------------------------------------------------------------------------------------------------------

    def check_writable(self, key: Key) -> None:
        """Raise `Fault` if the program must not assign to the parameter."""
        if isinstance(key, int) and not 1 <= key < N_PARAMETERS:
            raise Fault(OUT_OF_RANGE, f"there is no parameter #{key}", f"they are #1 to #{N_PARAMETERS - 1}")
        if key in READ_ONLY or key in self.predefined:
            name = f"#{key}" if isinstance(key, int) else f"#<{key}>"
            raise Fault(READ_ONLY_FAULT, f"{name} cannot be set: the control sets it itself")

    def store_of(self, key: Key) -> Store:
        """The store of a parameter."""
        return self.numbers if isinstance(key, int) else self.scope_of(key)

    def assign(self, key: Key, value: Value) -> None:
        """Set a parameter; an unknown value then depends on this parameter."""
        store, number = self.store_of(key), nominal(value)
        self.changes += key not in store or nominal(store[key]) != number
        store[key] = Unknown(f"#{key}", number) if isinstance(value, Unknown) else number

    def is_unknown(self, number: int) -> bool:
        """Whether the value of a numbered parameter is known only at run time."""
        return isinstance(self.numbers.get(number), Unknown)

    # -- subprograms --------------------------------------------------------------------------------------------------

    def locals(self) -> list[Value]:
        """The values of #1 to #30."""
        return [self.numbers.get(index, 0.0) for index in LOCAL]

    def set_locals(self, values: list[Value]) -> None:
        """Set #1 to #30; those without a value become 0."""
        padded = values + [0.0] * (len(LOCAL) - len(values))
        for index, value in zip(LOCAL, padded, strict=True):
            self.assign(index, value)
