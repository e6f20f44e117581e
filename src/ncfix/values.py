"""`dataclass`, as that of the standard library, for programs that start often.

The standard library compiles up to six methods for every class, which is a quarter of the time in which ncfix starts.
Here a class gets the same methods, but only `__init__` is compiled for it; the others are shared by all classes. A
frozen class that is derived from another is left to the standard library.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import MISSING, FrozenInstanceError
from operator import attrgetter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(
        plain: type | None = None,
        /,
        *,
        frozen: bool = False,
        slots: bool = False,
        repr: bool = True,
        eq: bool = True,
        kw_only: bool = False,
    ) -> type | Callable[[type], type]:
        """See `dataclasses.dataclass`."""

        def made(cls: type) -> type:
            if frozen and any(map(dataclasses.is_dataclass, cls.__bases__)):
                return dataclasses.dataclass(frozen=True, slots=slots, repr=repr, eq=eq, kw_only=kw_only)(cls)
            own = vars(cls).keys() - ({"__hash__"} if vars(cls).get("__hash__", 0) is None else set())
            cls = dataclasses.dataclass(init=not frozen, repr=False, eq=False, slots=slots, kw_only=kw_only)(cls)
            methods = (_comparison(cls, frozen) if eq else {}) | ({"__repr__": _shown} if repr else {})
            if frozen:
                methods |= {"__init__": _initializer(cls), "__setattr__": _refused_assignment}
                methods |= {"__delattr__": _refused_deletion}
                cls.__dataclass_params__.frozen = True
            if frozen and slots:
                methods |= {"__getstate__": _state, "__setstate__": _set_state}
            for name, method in methods.items():
                if name not in own:
                    setattr(cls, name, method)
            return cls

        return made if plain is None else made(plain)


UNSET = object()
"""An argument that is not given: a factory makes the value."""
SET = object.__setattr__


def _initializer(cls: type) -> Callable[..., None]:
    """`__init__` of a frozen class: one parameter a field, in order; those that are given by keyword only come last."""
    names: dict[str, Any] = {"SET": SET, "UNSET": UNSET}
    positional: list[str] = []
    keyword: list[str] = []
    body: list[str] = []
    for field in dataclasses.fields(cls):
        name = value = field.name
        parameter = name
        if field.default_factory is not MISSING:
            names[f"factory_{name}"] = field.default_factory
            parameter = f"{name}=UNSET"
            value = f"factory_{name}() if {name} is UNSET else {name}" if field.init else f"factory_{name}()"
        elif field.default is not MISSING:
            names[f"default_{name}"] = field.default
            parameter = f"{name}=default_{name}"
            value = name if field.init else f"default_{name}"
        elif not field.init:
            continue
        if field.init:
            (keyword if field.kw_only else positional).append(parameter)
        body.append(f" SET(self, {name!r}, {value})")
    if hasattr(cls, "__post_init__"):
        body.append(" self.__post_init__()")
    parameters = ["self", *positional, *(["*", *keyword] if keyword else [])]
    exec(f"def __init__({', '.join(parameters)}):\n" + ("\n".join(body) or " pass"), names)
    made: Callable[..., None] = names["__init__"]
    made.__qualname__, made.__module__ = f"{cls.__qualname__}.__init__", cls.__module__
    made.__annotations__ = {each.name: each.type for each in dataclasses.fields(cls) if each.init} | {"return": None}
    return made


def _comparison(cls: type, frozen: bool) -> dict[str, Any]:
    """`__eq__` by the fields, for values of the same class; `__hash__` by the same, or None if they may change."""
    compared = [field.name for field in dataclasses.fields(cls) if field.compare]
    several = attrgetter(*compared) if len(compared) > 1 else None

    def values(self: object) -> tuple[Any, ...]:
        return several(self) if several else tuple(getattr(self, name) for name in compared)

    def equal(self: object, other: object) -> bool:
        return values(self) == values(other) if other.__class__ is self.__class__ else NotImplemented

    def hashed(self: object) -> int:
        return hash(values(self))

    return {"__eq__": equal, "__hash__": hashed if frozen else None}


def _shown(self: Any) -> str:
    fields = (f"{each.name}={getattr(self, each.name)!r}" for each in dataclasses.fields(self) if each.repr)
    return f"{self.__class__.__qualname__}({', '.join(fields)})"


def _refused_assignment(self: object, name: str, value: object) -> None:
    raise FrozenInstanceError(f"cannot assign to field {name!r}")


def _refused_deletion(self: object, name: str) -> None:
    raise FrozenInstanceError(f"cannot delete field {name!r}")


def _state(self: Any) -> list[Any]:
    """What is pickled; the values of the fields, as of the standard library."""
    return [getattr(self, field.name) for field in dataclasses.fields(self)]


def _set_state(self: Any, state: list[Any]) -> None:
    for field, value in zip(dataclasses.fields(self), state, strict=True):
        SET(self, field.name, value)
