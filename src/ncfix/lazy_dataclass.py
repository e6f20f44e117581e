"""`dataclass` as Python's, but its methods are made when they are first needed.

Python's writes source text for each method of each class and compiles it while a module is imported: a third of the
time of a short run, for hundreds of classes of which most get no instance. Here `__init__` is compiled at the first
call, and the other methods need no text. Fields, `replace`, `asdict`, pickles and errors are those of Python's.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from operator import attrgetter
from reprlib import recursive_repr
from typing import Any, TypeVar, cast, dataclass_transform

Class = TypeVar("Class", bound=type)


@dataclass_transform(field_specifiers=(dataclasses.field,))
def dataclass(
    *, frozen: bool = False, slots: bool = False, kw_only: bool = False, repr: bool = True, eq: bool = True
) -> Callable[[Class], Class]:
    """Make a class a dataclass; the options mean what they mean for `dataclasses.dataclass`."""

    def made(body: Class) -> Class:
        own = vars(body)
        derived = any(dataclasses.is_dataclass(base) for base in body.__mro__[1:])
        whole: Any = dataclasses.dataclass(
            init=False, repr=False, eq=False, frozen=frozen and derived, slots=slots, kw_only=kw_only
        )(body)
        if frozen and not derived:
            whole.__dataclass_params__.frozen = True
            _freeze(whole, slots and "__getstate__" not in own)
        methods: dict[str, Any] = {"__init__": _first_init(whole, frozen)}
        if repr:
            methods["__repr__"] = _repr(whole)
        if eq:
            methods["__eq__"] = _eq(whole)
        for name, method in methods.items():
            if name not in own:
                method.__qualname__ = f"{whole.__qualname__}.{name}"
                setattr(whole, name, method)
        if eq and ("__hash__" not in own or (own["__hash__"] is None and "__eq__" in own)):
            whole.__hash__ = _hash(whole) if frozen else None
        return cast(Class, whole)

    return made


def _first_init(cls: type, frozen: bool) -> Callable[..., None]:
    """An `__init__` that puts the compiled one in its place, and calls it."""

    def __init__(self: Any, /, *arguments: Any, **named: Any) -> None:  # noqa: N807
        compiled = _init(cls, frozen)
        cls.__init__ = compiled  # type: ignore[misc]
        compiled(self, *arguments, **named)

    return __init__


def _init(cls: type, frozen: bool) -> Callable[..., None]:
    """The `__init__` of a class: it sets each field to what is given, or to its default, and calls `__post_init__`."""
    names: dict[str, Any] = {"_set": object.__setattr__, "_MISSING": dataclasses.MISSING}
    given: dict[bool, list[str]] = {False: [], True: []}
    body = []
    for field in dataclasses.fields(cls):
        name, value = field.name, field.name
        if field.default_factory is not dataclasses.MISSING:
            names[f"_make_{name}"] = field.default_factory
            value = f"_make_{name}() if {name} is _MISSING else {name}" if field.init else f"_make_{name}()"
            default = "=_MISSING"
        elif field.default is not dataclasses.MISSING:
            names[f"_default_{name}"] = field.default
            default = f"=_default_{name}"
            value = name if field.init else f"_default_{name}"
        elif not field.init:
            continue
        else:
            default = ""
        if field.init:
            given[bool(field.kw_only)].append(name + default)
        body.append(f" _set(_self, {name!r}, {value})" if frozen else f" _self.{name} = {value}")
    if hasattr(cls, "__post_init__"):
        body.append(" _self.__post_init__()")
    arguments = ", ".join(["_self", *given[False], *(["*", *given[True]] if given[True] else [])])
    exec(f"def __init__({arguments}):\n" + ("\n".join(body) or " pass"), names)
    names["__init__"].__qualname__ = f"{cls.__qualname__}.__init__"
    made: Callable[..., None] = names["__init__"]
    return made


def _freeze(cls: Any, slots: bool) -> None:
    """Refuse changes of an instance; with slots, pickles set its values nevertheless."""
    names = frozenset(field.name for field in dataclasses.fields(cls))

    def __setattr__(self: Any, name: str, value: Any) -> None:  # noqa: N807
        if type(self) is cls or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def __delattr__(self: Any, name: str) -> None:  # noqa: N807
        if type(self) is cls or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    def __getstate__(self: Any) -> list[Any]:  # noqa: N807
        return [getattr(self, field.name) for field in dataclasses.fields(self)]

    def __setstate__(self: Any, state: list[Any]) -> None:  # noqa: N807
        for field, value in zip(dataclasses.fields(self), state, strict=True):
            object.__setattr__(self, field.name, value)

    cls.__setattr__, cls.__delattr__ = __setattr__, __delattr__
    if slots:
        cls.__getstate__, cls.__setstate__ = __getstate__, __setstate__


def _values(fields: list[str]) -> Callable[[Any], tuple[Any, ...]]:
    """A function of an object that gives the values of these fields."""
    if len(fields) > 1:
        return attrgetter(*fields)
    return (lambda self: (getattr(self, fields[0]),)) if fields else (lambda self: ())


def _eq(cls: type) -> Callable[[Any, Any], Any]:
    values = _values([field.name for field in dataclasses.fields(cls) if field.compare])

    def __eq__(self: Any, other: Any) -> Any:  # noqa: N807
        return values(self) == values(other) if other.__class__ is self.__class__ else NotImplemented

    return __eq__


def _hash(cls: type) -> Callable[[Any], int]:
    fields = dataclasses.fields(cls)
    values = _values([field.name for field in fields if (field.compare if field.hash is None else field.hash)])

    def __hash__(self: Any) -> int:  # noqa: N807
        return hash(values(self))

    return __hash__


def _repr(cls: type) -> Callable[[Any], str]:
    names = [field.name for field in dataclasses.fields(cls) if field.repr]

    @recursive_repr()
    def __repr__(self: Any) -> str:  # noqa: N807
        return f"{self.__class__.__qualname__}({', '.join(f'{name}={getattr(self, name)!r}' for name in names)})"

    return __repr__
