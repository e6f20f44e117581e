"""Dataclasses that are created ten times faster: `frozen` for values, `mutable` for objects that change.

`dataclasses` generates three to six methods of each class as text and compiles them at import. ncfix has hundreds of
such classes: that took a third of a short run. Here all methods but one are closures, and `__init__` is generated when
a class is first called, which in one run most classes never are.

Everything else is left to `dataclasses`: `field`, `fields`, `replace`, `asdict` and `match` work with these classes.
Two differences: a dataclass derived from a frozen one must be `frozen`, too; and objects with an array among their
fields are equal only if they are the same object, because `==` of arrays is no truth value.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import MISSING, Field, FrozenInstanceError, dataclass, field, fields
from operator import attrgetter
from typing import Any, TypeVar, dataclass_transform, overload

T = TypeVar("T")
PUT = object.__setattr__
ARRAYS = re.compile(r"\b(?:Array|Mask|Index|Indices|Ints|Signs|Bytes|NDArray|ndarray)\b")
"""Names of types of arrays."""


@overload
def frozen(cls: type[T], /) -> type[T]: ...


@overload
def frozen(
    *, slots: bool = True, eq: bool = True, repr: bool = True, kw_only: bool = False
) -> Callable[[type[T]], type[T]]: ...


@dataclass_transform(frozen_default=True, field_specifiers=(Field, field))
def frozen(cls: type[T] | None = None, /, **options: bool) -> type[T] | Callable[[type[T]], type[T]]:
    """Make a class an immutable dataclass with slots; the options are those of `dataclasses.dataclass`.

    A method that the class defines itself is kept. Setting or deleting an attribute of an object raises
    FrozenInstanceError.
    """
    if cls is None:
        return lambda cls: _made(cls, True, **options)
    return _made(cls, True)


@overload
def mutable(cls: type[T], /) -> type[T]: ...


@overload
def mutable(
    *, slots: bool = True, eq: bool = True, repr: bool = True, kw_only: bool = False
) -> Callable[[type[T]], type[T]]: ...


@dataclass_transform(field_specifiers=(Field, field))
def mutable(cls: type[T] | None = None, /, **options: bool) -> type[T] | Callable[[type[T]], type[T]]:
    """Make a class a mutable dataclass with slots; without hash if objects are compared (`eq`)."""
    if cls is None:
        return lambda cls: _made(cls, False, **options)
    return _made(cls, False)


def _made(
    cls: type[T], stays: bool, *, slots: bool = True, eq: bool = True, repr: bool = True, kw_only: bool = False
) -> type[T]:
    written = {name for name, method in vars(cls).items() if method is not None}
    cls = dataclass(init=False, repr=False, eq=False, slots=slots, kw_only=kw_only)(cls)
    methods: dict[str, object] = {"__init__": _Init(cls, stays)}
    if repr:
        methods["__repr__"] = _in_words
    if eq:
        methods["__eq__"], hashed = _comparing(cls)
        methods["__hash__"] = hashed if stays else None
    if stays:
        methods["__setattr__"] = methods["__delattr__"] = _refuse
        if slots:
            methods["__getstate__"], methods["__setstate__"] = _items, _set_items
    for name in methods.keys() - written:
        setattr(cls, name, methods[name])
    return cls


class _Init:
    """Placeholder for the `__init__` of a class; on first access it generates the real one and replaces itself."""

    def __init__(self, cls: type, stays: bool) -> None:
        self.cls, self.stays = cls, stays

    def __get__(self, instance: object, owner: type | None = None) -> object:
        init: Any = _init_of(self.cls, self.stays)
        setattr(self.cls, "__init__", init)  # noqa: B010  (mypy: a method is put in its place)
        return init.__get__(instance, owner)


def _init_of(cls: Any, stays: bool) -> Callable[..., None]:
    """The `__init__` that `dataclasses` would generate."""
    names: dict[str, Any] = {"put": PUT, "MISSING": MISSING}
    positional, by_name, lines = ["self"], list[str](), list[str]()
    for each in fields(cls):
        name, preset, item = each.name, f"preset_{each.name}", each.name
        made = each.default_factory is not MISSING
        if each.default is not MISSING or made:
            names[preset] = each.default_factory if made else each.default
        if each.init:
            parameter = name if preset not in names else f"{name}=MISSING" if made else f"{name}={preset}"
            (by_name if each.kw_only else positional).append(parameter)
            if made:
                item = f"{preset}() if {name} is MISSING else {name}"
        elif preset in names:
            item = f"{preset}()" if made else preset
        else:
            continue
        lines.append(f"put(self, {name!r}, {item})" if stays else f"self.{name} = {item}")
    if hasattr(cls, "__post_init__"):
        lines.append("self.__post_init__()")
    parameters = ", ".join([*positional, *(["*", *by_name] if by_name else [])])
    exec(f"def __init__({parameters}):\n " + "\n ".join(lines or ["pass"]), names)
    init: Callable[..., None] = names["__init__"]
    init.__annotations__ = {each.name: each.type for each in fields(cls) if each.init}
    init.__qualname__ = f"{cls.__qualname__}.__init__"
    return init


def _comparing(cls: Any) -> tuple[Callable[..., object], Callable[..., int]]:
    """`__eq__` and `__hash__` over the fields that are compared; by identity if one of them is an array."""
    compared = [each for each in fields(cls) if each.compare]
    if any(ARRAYS.search(str(each.type)) for each in compared):
        return object.__eq__, object.__hash__
    names = [each.name for each in compared]
    values: Callable[[object], object] = lambda self: tuple([getattr(self, name) for name in names])  # noqa: E731
    if len(names) > 1:
        values = attrgetter(*names)  # the same, in a third of the time

    def equal(self: object, other: object) -> object:
        return values(self) == values(other) if type(self) is type(other) else NotImplemented

    def hashed(self: object) -> int:
        return hash(values(self))

    return equal, hashed


def _refuse(self: object, name: str, *_: object) -> None:
    raise FrozenInstanceError(f"field {name!r} of a frozen {type(self).__name__}")


def _in_words(self: Any) -> str:
    shown = ", ".join(f"{each.name}={getattr(self, each.name)!r}" for each in fields(self) if each.repr)
    return f"{type(self).__qualname__}({shown})"


def _items(self: Any) -> list[object]:
    return [getattr(self, each.name) for each in fields(self)]


def _set_items(self: Any, items: list[object]) -> None:
    for each, item in zip(fields(self), items, strict=True):
        PUT(self, each.name, item)
