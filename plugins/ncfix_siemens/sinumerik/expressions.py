"""The expressions of SINUMERIK: numbers and texts.

Angles are degrees; places in a text count from zero.
Source: Siemens, "SINUMERIK 840D sl, NC programming, job planning", arithmetic functions, priority of the operations,
string operations.

R parameters and variables: those of the program, of each subprogram, and what the setup gives.
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
"""Whether a program is tested, simulated, searched or run dry: not while it cuts."""
INITIAL: dict[str, Value] = {"real": 0.0, "int": 0.0, "bool": 0.0, "string": "", "char": Unknown(), "axis": Unknown()}
WHOLE = frozenset({"int", "char"})


MOST_CELLS = 100_000
"""Elements of an array that is filled; those of a larger one count as known only at run time."""


@mutable
class Local:
    """The variables that one program has defined.

    kinds   name -> type
    sizes   array -> how many elements it has in each direction
    values  what they are
    """

    kinds: dict[str, str] = field(default_factory=dict)
    sizes: dict[str, tuple[int, ...]] = field(default_factory=dict)
    values: dict[Key, Value] = field(default_factory=dict)


@mutable
class SinumerikVariables:
    """All variables; what nobody has set is known only at run time.

    shared  R parameters and whatever the control has of its own
    scopes  the program's own variables, those of the subprogram being executed last
    changes how often a variable has got another value
    """

    shared: dict[Key, Value] = field(default_factory=dict)
    scopes: list[Local] = field(default_factory=lambda: [Local()])
    changes: int = 0

    @classmethod
    def given(cls, variables: Mapping[str, float]) -> SinumerikVariables:
        """What a setup gives: `R1`, `_GUD`, `$MC_NAME`, `NAME[1,2]`."""
        return cls({key_of(name): value for name, value in variables.items()})

    def value(self, key: Key) -> Value:
        """The value of a variable; unknown if nobody has set it."""
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
        """Set a variable; whole ones round."""
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
        """The innermost program that has defined a name, the main program at last."""
        return next((scope for scope in (self.scopes[-1], self.scopes[0]) if name in scope.kinds), None)

    def define(self, kind: str, name: str, sizes: tuple[int, ...] = ()) -> None:
        """`DEF`: the variable begins anew."""
        scope = self.scopes[-1]
        self.changes += any(name_of(key) == name for key in scope.values)
        scope.kinds[name], scope.sizes[name] = kind, sizes
        for key in [key for key in scope.values if name_of(key) == name]:
            del scope.values[key]

    def fill(self, name: str, index: tuple[Value, ...], values: Sequence[Value], *, repeated: bool) -> None:
        """`NAME[index]=SET(values)` from an element on; repeated: `REP(value)` or `REP(value, count)`."""
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
        """All elements of an array are known only at run time from here on."""
        scope = self.scope_of(name)
        self.changes += 1
        if scope is None:
            self.shared = {key: value for key, value in self.shared.items() if name_of(key) != name}
            return
        scope.kinds[name] = ""
        scope.values = {key: value for key, value in scope.values.items() if name_of(key) != name}


def renamed(values: Mapping[Key, Value], name: str, other: str) -> dict[Key, Value]:
    """The elements of an array as those of another."""
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
"""Relative difference up to which two numbers are equal (MD10280)."""

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
    """`SUBSTR`."""
    first = int(start)
    return text[first:] if length is None else text[first : first + int(length)]


def as_number(text: str) -> float | None:
    """`NUMBER`, None where the control would stop."""
    try:
        return float(text.upper().replace("EX", "E"))
    except ValueError:
        return None


def of_kind(kind: str, value: Value) -> Value:
    """A value as a variable of a type keeps it."""
    plain = number(value)
    if plain is None or kind not in {"bool", *WHOLE}:
        return value
    return float(bool(plain)) if kind == "bool" else float(math.floor(plain + 0.5))


def constant(text: str) -> Value:
    """What a number, a text in quotes, TRUE or FALSE stands for; other things only the control knows."""
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
"""Name -> the function, the types of its arguments, and how many of them it needs."""


def of_texts(name: str, values: tuple[Value, ...]) -> Value:
    """The value of a function of texts; unknown where an argument is not known or of another type."""
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
        """`R[...]`."""
        return self.element("r", (index,))

    def named(self, name: str) -> Evaluate:
        """A variable."""
        return lambda scope: scope.variables.value(name)

    def element(self, name: str, index: tuple[Evaluate, ...]) -> Evaluate:
        """An element of an array."""

        def evaluate(scope: Scope) -> Value:
            places = tuple(number(part(scope)) for part in index)
            if None in places:
                return Unknown()
            return scope.variables.value((name, places))  # type: ignore[attr-defined]

        return evaluate

    def function(self, name: str, arguments: tuple[Evaluate, ...], address: str = "") -> Evaluate:
        """Brackets, functions of numbers and of texts; what is none of ours has a value that only the control knows."""
        if name == BRACKET:
            return arguments[0]
        if name == "<<":
            return lambda scope: shown(arguments[0](scope))
        if name in TEXT_FUNCTIONS:
            return lambda scope: of_texts(name, tuple(argument(scope) for argument in arguments))
        return super().function(name, arguments, address) if name in self.functions else left_out

    def operator(self, operator: str, left: Expression, right: Expression, address: str = "") -> Evaluate:
        """An operator between two operands; `<<` joins texts.

        Of a comparison of two without brackets, or of a sum of truths, controls and people do not think alike: unknown.
        """
        if operator == "<<":
            first, second = self.compiled(left), self.compiled(right)
            return lambda scope: joined(first(scope), second(scope))
        if operator not in COMPARISONS:
            return super().operator(operator, left, right, address)
        if any(is_loose(side) for side in (left, right)):
            return left_out
        first, second = self.compiled(left), self.compiled(right)
        return lambda scope: compared(operator, first(scope), second(scope))


def is_loose(side: Expression) -> bool:
    """Whether a side of a comparison is one itself, or a logical operation, without brackets."""
    return isinstance(side, Binary) and side.operator in COMPARISONS | {"and", "or", "xor"}


def compared(operator: str, left: Value, right: Value) -> Value:
    """Two values compared; 1 for true."""
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
    """A value as the text that `<<` makes of it."""
    return value if isinstance(value, Unknown | str) else f"{value:.15g}"


def joined(left: Value, right: Value) -> Value:
    """Two texts as one."""
    first, second = shown(left), shown(right)
    return Unknown() if isinstance(first, Unknown) or isinstance(second, Unknown) else f"{first}{second}"


compiled = VariableExpressions().compiled
