"""R parameters and variables: those of the program, of each subprogram, and what the setup gives."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

from ncfix.control.expressions import Unknown, Value, number
from ncfix_siemens.sinumerik.expressions import Key

CONSTANTS: dict[str, Value] = {"true": 1.0, "false": 0.0, "$pi": math.pi}
INITIAL: dict[str, Value] = {"real": 0.0, "int": 0.0, "bool": 0.0, "string": "", "char": Unknown(), "axis": Unknown()}
WHOLE = frozenset({"int", "char"})


MOST_CELLS = 100_000
"""Elements of an array that is filled; those of a larger one count as known only at run time."""


@dataclass(slots=True)
class Local:
    """The variables that one program has defined.

    kinds   name -> type
    sizes   array -> how many elements it has in each direction
    values  what they are
    """

    kinds: dict[str, str] = field(default_factory=dict)
    sizes: dict[str, tuple[int, ...]] = field(default_factory=dict)
    values: dict[Key, Value] = field(default_factory=dict)


@dataclass(slots=True)
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
            return self.shared.get(key, Unknown())
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
            plain = number(value)
            whole = plain is not None and scope.kinds[name] in WHOLE
            scope.values[key] = float(math.floor(plain + 0.5)) if whole and plain is not None else value
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


def name_of(key: Key) -> str:
    """The name of a variable or array."""
    return key if isinstance(key, str) else key[0]


def key_of(text: str) -> Key:
    """The variable that a setup names."""
    name, bracket, rest = "".join(text.split()).lower().partition("[")
    if bracket:
        return name, tuple(float(part) for part in rest.rstrip("]").split(",") if is_number(part))
    return ("r", (float(name[1:]),)) if name[:1] == "r" and name[1:].isdigit() else name


def is_number(text: str) -> bool:
    """Whether a text is a whole number."""
    return text.lstrip("-").isdigit()
