"""Expressions of SINUMERIK with numbers and texts; R parameters and variables of program, subprograms and setup.

Angles are degrees; positions in a text count from zero.
Source: Siemens, "SINUMERIK 840D sl, NC programming, job planning", arithmetic functions, priority of the operations,
string operations.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from itertools import product

from ncfix.control.expressions import (
    FUNCTIONS,
    SUMS,
    Evaluate,
    Expressions,
    Scope,
    Unknown,
    Value,
    divide,
    left_out,
    number,
    power,
)
from ncfix.text.tree import Binary, Constant, Expression, NumberedParameter
from ncfix.values import mutable
from ncfix_siemens.sinumerik.blocks import BRACKET

CONSTANTS: dict[str, Value] = {"true": 1.0, "false": 0.0, "$pi": math.pi}
CUTTING = dict.fromkeys(("$p_istest", "$p_sim", "$p_search", "$p_searchl", "$p_dryrun"), 0.0)
"""System variables of program test, simulation, block search and dry run: false while the program cuts."""
INITIAL: dict[str, Value] = {"real": 0.0, "int": 0.0, "bool": 0.0, "string": "", "char": Unknown(), "axis": Unknown()}
WHOLE = frozenset({"int", "char"})


MOST_CELLS = 100_000
"""Largest number of elements of an array that is filled; larger arrays count as unknown."""


@mutable
class Local:
    """The variables that one program has defined.

    kinds   name -> type
    sizes   array -> its size in each dimension
    values  variable or element -> value
    """

    kinds: dict[str, str] = field(default_factory=dict)
    sizes: dict[str, tuple[int, ...]] = field(default_factory=dict)
    values: dict[Key, Value] = field(default_factory=dict)


@mutable
class SinumerikVariables:
    """All variables; those never set are known only at run time.

    shared  R parameters and variables of the control
    scopes  variables defined by the main program, then by each active subprogram
    changes number of changes of values so far
    """

    shared: dict[Key, Value] = field(default_factory=dict)
    scopes: list[Local] = field(default_factory=lambda: [Local()])
    changes: int = 0

    @classmethod
    def given(cls, variables: Mapping[str, float]) -> SinumerikVariables:
        """The variables given in a setup: `R1`, `_GUD`, `$MC_NAME`, `NAME[1,2]`."""
        return cls({key_of(name): value for name, value in variables.items()})

    def value(self, key: Key) -> Value:
        """The value of a variable; unknown if it was never set."""
        name = name_of(key)
        if name in CONSTANTS:
            return CONSTANTS[name]
        scope = self.scope_of(name)
        if scope is None:
            return self.shared.get(key, CUTTING.get(name, Unknown()))
        if key in scope.sizes and scope.sizes[name]:
            return Unknown()  # an array as a whole
        return scope.values.get(key, INITIAL.get(scope.kinds[name], Unknown()))

    def assign(self, key: Key, value: Value) -> None:
        """Assign a value to a variable; integer variables round it."""
        name = name_of(key)
        scope = self.scope_of(name)
        before = self.value(key)
        if isinstance(value, Unknown):
            value = Unknown()
        if scope is None:
            self.shared[key] = value
        else:
            scope.values[key] = of_kind(scope.kinds[name], value)
        self.changes += self.value(key) != before

    def scope_of(self, name: str) -> Local | None:
        """The scope that defines a name: that of the current subprogram, else of the main program; None if neither."""
        return next((scope for scope in (self.scopes[-1], self.scopes[0]) if name in scope.kinds), None)

    def define(self, kind: str, name: str, sizes: tuple[int, ...] = ()) -> None:
        """`DEF`: define a variable, with its initial value."""
        scope = self.scopes[-1]
        self.changes += any(name_of(key) == name for key in scope.values)
        scope.kinds[name], scope.sizes[name] = kind, sizes
        for key in [key for key in scope.values if name_of(key) == name]:
            del scope.values[key]

    def fill(self, name: str, index: tuple[Value, ...], values: Sequence[Value], *, repeated: bool) -> None:
        """`NAME[index]=SET(values)`: assign elements from an index on; repeated: `REP(value)`, `REP(value, count)`."""
        scope = self.scope_of(name)
        sizes = () if scope is None else scope.sizes.get(name, ())
        small = sizes if math.prod(sizes) <= MOST_CELLS else ()
        cells = list(product(*(map(float, range(size)) for size in small)))
        if scope is None or not sizes or index not in cells:
            self.forget(name)
            return
        cells = cells[cells.index(index) :]  # type: ignore[arg-type]
        if repeated:
            count = number(values[1]) if len(values) > 1 else len(cells)
            values = [values[0]] * len(cells[: int(count or 0)])
        for cell, value in zip(cells, values, strict=False):
            self.assign((name, cell), value)

    def forget(self, name: str) -> None:
        """Make a variable, or all elements of an array, unknown."""
        scope = self.scope_of(name)
        self.changes += 1
        if scope is None:
            self.shared = {key: value for key, value in self.shared.items() if name_of(key) != name}
            return
        scope.kinds[name] = ""
        scope.values = {key: value for key, value in scope.values.items() if name_of(key) != name}


def renamed(values: Mapping[Key, Value], name: str, other: str) -> dict[Key, Value]:
    """The elements of an array under the name of another."""
    return {
        (other, key[1]): value for key, value in values.items() if name_of(key) == name and not isinstance(key, str)
    }


def name_of(key: Key) -> str:
    """The name of a variable or array."""
    return key if isinstance(key, str) else key[0]


def key_of(text: str) -> Key:
    """The variable that a setup names."""
    name, bracket, rest = "".join(text.split()).lower().partition("[")
    if bracket:
        return name, tuple(float(part) for part in rest.rstrip("]").split(",") if part.lstrip("-").isdigit())
    return ("r", (float(name[1:]),)) if name[:1] == "r" and name[1:].isdigit() else name


Key = str | tuple[str, tuple[float, ...]]
"""A variable, or an element of an array."""

COMPARISONS = frozenset({"==", "<>", ">", "<", ">=", "<="})
EQUAL = 1e-12
"""Largest relative difference of equal numbers (MD10280)."""

OPERATORS: dict[str, Callable[[float, float], float]] = {
    **SUMS,
    "div": lambda a, b: float(math.trunc(divide(a, b))),
    "mod": lambda a, b: a - b * math.trunc(divide(a, b)),
    "and": lambda a, b: float(bool(a) and bool(b)),
    "or": lambda a, b: float(bool(a) or bool(b)),
    "xor": lambda a, b: float(bool(a) != bool(b)),
    "b_and": lambda a, b: float(int(a) & int(b)),
    "b_or": lambda a, b: float(int(a) | int(b)),
    "b_xor": lambda a, b: float(int(a) ^ int(b)),
}

FUNCTIONS_OF_NUMBERS: dict[str, tuple[Callable[..., float], int]] = {
    **FUNCTIONS,
    "not": (lambda a: float(not a), 1),
    "b_not": (lambda a: float(~int(a)), 1),
    "atan2": (lambda y, x: math.degrees(math.atan2(y, x)), 2),
    "pot": (lambda a: power(a, 2.0), 1),
    "trunc": (lambda a: float(math.trunc(a)), 1),
    "round": (lambda a: float(math.floor(a + 0.5)), 1),
    "roundup": (lambda a: float(math.ceil(a)), 1),
    "minval": (min, 2),
    "maxval": (max, 2),
    "bound": (lambda low, high, a: min(max(low, a), high), 3),
}


def substring(text: str, start: float, length: float | None = None) -> str:
    """The value of `SUBSTR`."""
    first = int(start)
    return text[first:] if length is None else text[first : first + int(length)]


def as_number(text: str) -> float | None:
    """The value of `NUMBER`; None if the control would stop."""
    try:
        return float(text.upper().replace("EX", "E"))
    except ValueError:
        return None


def of_kind(kind: str, value: Value) -> Value:
    """A value converted to the type of a variable."""
    plain = number(value)
    if plain is None or kind not in {"bool", *WHOLE}:
        return value
    return float(bool(plain)) if kind == "bool" else float(math.floor(plain + 0.5))


def constant(text: str) -> Value:
    """The value of a number, a text in quotes, TRUE or FALSE; unknown for other text."""
    if len(text) > 1 and text[0] == text[-1] == '"':
        return text[1:-1]
    value = as_number(text)
    return CONSTANTS.get(text.lower(), Unknown()) if value is None else value


TEXT_FUNCTIONS: dict[str, tuple[Callable[..., Value | None], tuple[type, ...], int]] = {
    "strlen": (lambda text: float(len(text)), (str,), 1),
    "toupper": (str.upper, (str,), 1),
    "tolower": (str.lower, (str,), 1),
    "substr": (substring, (str, float, float), 2),
    "index": (lambda text, part: float(text.find(part[:1])), (str, str), 2),
    "rindex": (lambda text, part: float(text.rfind(part[:1])), (str, str), 2),
    "match": (lambda text, part: float(text.find(part)), (str, str), 2),
    "isnumber": (lambda text: float(as_number(text) is not None), (str,), 1),
    "number": (as_number, (str,), 1),
}
"""Name -> function, types of its arguments, smallest number of arguments."""


def of_texts(name: str, values: tuple[Value, ...]) -> Value:
    """The value of a text function; unknown if an argument is unknown or of another type."""
    function, types, least = TEXT_FUNCTIONS[name]
    fits = least <= len(values) <= len(types)
    if not fits or any(not isinstance(value, kind) for value, kind in zip(values, types, strict=False)):
        return Unknown()
    found = function(*values)
    return Unknown() if found is None else found


class VariableExpressions(Expressions):
    """SINUMERIK: R parameters, variables, arrays and texts; scopes have `variables`."""

    operators = OPERATORS
    functions = FUNCTIONS_OF_NUMBERS
    impossible = "the result of a calculation is not a finite number"

    def compiled(self, expression: Expression, address: str = "") -> Evaluate:
        """As everywhere; an R parameter with a plain number is found at once."""
        if isinstance(expression, NumberedParameter) and isinstance(expression.index, Constant):
            key = ("r", (expression.index.value,))
            return lambda scope: scope.variables.value(key)
        return super().compiled(expression, address)

    def numbered(self, index: Evaluate) -> Evaluate:
        """The function that evaluates the R parameter `R[...]`."""
        return self.element("r", (index,))

    def named(self, name: str) -> Evaluate:
        """The function that evaluates a variable."""
        return lambda scope: scope.variables.value(name)

    def element(self, name: str, index: tuple[Evaluate, ...]) -> Evaluate:
        """The function that evaluates an element of an array."""

        def evaluate(scope: Scope) -> Value:
            places = tuple(number(part(scope)) for part in index)
            if None in places:
                return Unknown()
            return scope.variables.value((name, places))  # type: ignore[attr-defined]

        return evaluate

    def function(self, name: str, arguments: tuple[Evaluate, ...], address: str = "") -> Evaluate:
        """Brackets, functions of numbers and of texts; the value of other functions is unknown."""
        if name == BRACKET:
            return arguments[0]
        if name == "<<":
            return lambda scope: shown(arguments[0](scope))
        if name in TEXT_FUNCTIONS:
            return lambda scope: of_texts(name, tuple(argument(scope) for argument in arguments))
        return super().function(name, arguments, address) if name in self.functions else left_out

    def operator(self, operator: str, left: Expression, right: Expression, address: str = "") -> Evaluate:
        """An operator between two operands; `<<` joins texts.

        A comparison of comparisons or logical operations without brackets is unknown, since its precedence is doubtful.
        """
        if operator == "<<":
            first, second = self.compiled(left), self.compiled(right)
            return lambda scope: concatenated(first(scope), second(scope))
        if operator not in COMPARISONS:
            return super().operator(operator, left, right, address)
        if any(is_loose(side) for side in (left, right)):
            return left_out
        first, second = self.compiled(left), self.compiled(right)
        return lambda scope: compared(operator, first(scope), second(scope))


def is_loose(side: Expression) -> bool:
    """Whether an operand of a comparison is a comparison or logical operation without brackets."""
    return isinstance(side, Binary) and side.operator in COMPARISONS | {"and", "or", "xor"}


def compared(operator: str, left: Value, right: Value) -> Value:
    """The result of a comparison, 1 or 0; unknown if the values are unknown or of different types."""
    if isinstance(left, Unknown) or isinstance(right, Unknown) or isinstance(left, str) != isinstance(right, str):
        return Unknown()
    if isinstance(left, str) or isinstance(right, str):
        same, greater = str(left).upper() == str(right).upper(), str(left).upper() > str(right).upper()
    else:
        same = abs(left - right) <= EQUAL * max(abs(left), abs(right))
        greater = not same and left > right
    truth = {"==": same, "<>": not same, ">": greater, "<=": not greater, ">=": greater or same}
    return float(truth.get(operator, not greater and not same))


def shown(value: Value) -> Value:
    """A value converted to text, as by `<<`."""
    return value if isinstance(value, Unknown | str) else f"{value:.15g}"


def concatenated(left: Value, right: Value) -> Value:
    """Two values joined as text."""
    first, second = shown(left), shown(right)
    return Unknown() if isinstance(first, Unknown) or isinstance(second, Unknown) else f"{first}{second}"


compiled = VariableExpressions().compiled
