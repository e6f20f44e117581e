"""Data classes that cost little to declare.

The `dataclass` of Python 3.11 compiles six functions for each class when its module is imported: half a millisecond a
class, and a third of the time of a short program, which declares some two hundred. This one means the same and has the
same fields (`dataclasses.fields`, `replace`, `asdict`), but what it adds are functions that all classes share, and
`__init__` is compiled when the first object is made.

It has no `order`, `unsafe_hash` and `InitVar`. To the standard library its classes do not look frozen, so that its own
decorator cannot make a frozen class of one of these.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import MISSING, Field, FrozenInstanceError, fields
from operator import attrgetter
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any

__all__ = ["dataclass"]

Names = dict[str, Any]


def declared(kind: type | None = None, /, *, frozen: bool = False, slots: bool = False, **others: bool) -> Any:
    """Make a data class, with the options of `dataclasses.dataclass`."""
    if kind is None:
        return lambda kind: declared(kind, frozen=frozen, slots=slots, **others)
    own = {name for name, value in vars(kind).items() if value is not None}
    shown, compared = others.pop("repr", True), others.pop("eq", True)
    made: type = dataclasses.dataclass(kind, init=False, repr=False, eq=False, slots=slots, **others)
    methods: Names = {"__init__": first_init(made, frozen, slots)}
    if shown:
        methods["__repr__"] = _shown
    if compared:
        methods |= comparison(made, frozen)
    if frozen:
        methods |= FROZEN_SLOTS if slots else FROZEN
    for name in methods.keys() - own:
        setattr(made, name, methods[name])
    return made


if TYPE_CHECKING:
    from dataclasses import dataclass
else:
    dataclass = declared


# -- how an object is made --------------------------------------------------------------------------------------------


def first_init(kind: type, frozen: bool, slots: bool) -> Callable[..., None]:
    """What `__init__` is until the first object is made: it puts the compiled one into its place."""

    def first(self: Any, *given: Any, **named: Any) -> None:
        kind.__init__ = compiled = compiled_init(kind, frozen, slots)  # type: ignore[misc]
        compiled(self, *given, **named)

    return first


def compiled_init(kind: type, frozen: bool, slots: bool) -> Callable[..., None]:
    """The `__init__` that sets the fields."""
    known: Names = {"_missing": MISSING, "_put": object.__setattr__}
    lines = []
    for each in fields(kind):
        value = _value(each, known)
        if value and frozen and slots:
            known[f"_put_{each.name}"] = getattr(kind, each.name).__set__
            lines.append(f"_put_{each.name}(self, {value})")
        elif value:
            lines.append(f"_put(self, {each.name!r}, {value})" if frozen else f"self.{each.name} = {value}")
    if hasattr(kind, "__post_init__"):
        lines.append("self.__post_init__()")
    exec(f"def __init__({_parameters(kind, known)}):\n " + "\n ".join(lines or ["pass"]), known)
    made: Callable[..., None] = known["__init__"]
    made.__qualname__ = f"{kind.__qualname__}.__init__"
    return made


def _parameters(kind: type, known: Names) -> str:
    """Those of `__init__`."""
    given = [each for each in fields(kind) if each.init]
    ordered = [each.name + _default(each, known) for each in given if not each.kw_only]
    named = [each.name + _default(each, known) for each in given if each.kw_only]
    return ", ".join(["self", *ordered, *(["*", *named] if named else [])])


def _default(each: Field[Any], known: Names) -> str:
    """What stands behind the name of a parameter."""
    if each.default is not MISSING:
        known[f"_default_{each.name}"] = each.default
        return f"=_default_{each.name}"
    return "" if each.default_factory is MISSING else "=_missing"


def _value(each: Field[Any], known: Names) -> str:
    """What a field is set to; nothing for one that `__init__` does not set."""
    name, maker = each.name, f"_make_{each.name}"
    if each.default_factory is MISSING:
        return name if each.init else _default(each, known).removeprefix("=")
    known[maker] = each.default_factory
    return f"{maker}() if {name} is _missing else {name}" if each.init else f"{maker}()"


# -- what classes share -----------------------------------------------------------------------------------------------


@recursive_repr("...")
def _shown(self: Any) -> str:
    values = (f"{each.name}={getattr(self, each.name)!r}" for each in fields(self) if each.repr)
    return f"{type(self).__qualname__}({', '.join(values)})"


def comparison(kind: type, frozen: bool) -> Names:
    """Objects of a class are equal if their fields are; frozen ones have a hash."""
    names = [each.name for each in fields(kind) if each.compare]
    values: Callable[[Any], tuple[Any, ...]] = (
        attrgetter(*names) if len(names) > 1 else lambda self: tuple(getattr(self, name) for name in names)
    )

    def equal(self: Any, other: Any) -> Any:
        return values(self) == values(other) if type(other) is type(self) else NotImplemented

    def hashed(self: Any) -> int:
        return hash(values(self))

    return {"__eq__": equal, "__hash__": hashed if frozen else None}


def _set(self: Any, name: str, value: Any) -> None:
    raise FrozenInstanceError(f"cannot assign to field {name!r}")


def _delete(self: Any, name: str) -> None:
    raise FrozenInstanceError(f"cannot delete field {name!r}")


def _state(self: Any) -> list[Any]:
    return [getattr(self, each.name) for each in fields(self)]


def _restore(self: Any, state: list[Any]) -> None:
    for each, value in zip(fields(self), state, strict=True):
        object.__setattr__(self, each.name, value)


FROZEN: Names = {"__setattr__": _set, "__delattr__": _delete}
FROZEN_SLOTS: Names = FROZEN | {"__getstate__": _state, "__setstate__": _restore}
"""Without `__setattr__` the slots of a frozen object cannot be restored as others are."""
