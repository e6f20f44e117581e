"""`frozen` and `mutable` make what `dataclass` makes."""

from __future__ import annotations

import inspect
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, asdict, dataclass, field, fields, replace
from functools import cached_property, partial
from typing import Any, ClassVar

import pytest

from ncfix.values import frozen, mutable

Maker = Callable[..., Any]
STANDARD: Maker = partial(dataclass, frozen=True, slots=True)


def classes(maker: Maker) -> tuple[Any, Any]:
    """A class with every kind of field, and one that is built on it."""

    @maker
    class Base:
        size: ClassVar[int] = 3
        first: int
        second: float = 2.5
        many: list[int] = field(default_factory=list)
        hidden: str = field(default="h", repr=False, compare=False)
        worked_out: int = field(init=False)
        preset: int = field(init=False, default=7)
        made: dict[str, int] = field(init=False, default_factory=dict)

        def __post_init__(self) -> None:
            object.__setattr__(self, "worked_out", 2 * self.first)

    @maker(kw_only=True)
    class Derived(Base):
        name: str
        more: tuple[int, ...] = ()

    return Base, Derived


@pytest.mark.parametrize("ours", [False, True])
def test_a_value_is_what_a_frozen_dataclass_is(ours: bool) -> None:
    base, derived = classes(frozen if ours else STANDARD)
    one, other = base(1, many=[1]), base(1, 2.5, [1], hidden="else")
    assert one == other
    assert one != base(2)
    assert one != derived(first=1, name="n", many=[1])
    assert (one.worked_out, one.preset, one.made, base.size) == (2, 7, {}, 3)
    assert one.made is not other.made
    assert repr(one) == f"{base.__qualname__}(first=1, second=2.5, many=[1], worked_out=2, preset=7, made={{}})"
    assert replace(one, first=4) == base(4, many=[1])
    assert [each.name for each in fields(derived)][-2:] == ["name", "more"]
    assert asdict(derived(first=1, name="n"))["name"] == "n"
    assert list(inspect.signature(derived).parameters) == ["first", "second", "many", "hidden", "name", "more"]
    assert base.__match_args__ == ("first", "second", "many", "hidden")
    for change in (lambda: setattr(one, "first", 3), lambda: delattr(one, "first")):
        with pytest.raises(FrozenInstanceError):
            change()
    for wrong in ((), (1, 2, 3, 4, 5)):
        with pytest.raises(TypeError, match="__init__"):
            base(*wrong)
    with pytest.raises(TypeError, match="name"):
        derived(1)
    with pytest.raises(TypeError, match="unhashable"):
        hash(one)


@frozen
class Point:
    """Of two numbers."""

    x: float
    y: float = 0.0


@frozen(slots=False, repr=False)
class Line:
    """With something that is worked out once, and its own words."""

    begin: Point
    end: Point

    @cached_property
    def length(self) -> float:
        return abs(self.end.x - self.begin.x)

    def __repr__(self) -> str:
        return "a line"


@frozen(eq=False)
class Mark:
    """One thing, equal to nothing else."""

    at: Point


def test_values_are_hashed_pickled_and_matched() -> None:
    line = Line(Point(1.0), Point(3.0, 1.0))
    assert line.length == 2.0
    assert pickle.loads(pickle.dumps((line, Point(1.0)))) == (line, Point(1.0))
    assert {Point(1.0), Point(1.0, 0.0)} == {Point(1.0)}
    assert hash(line) == hash(Line(Point(1.0), Point(3.0, 1.0)))
    assert repr(line) == "a line"
    assert not hasattr(Point(1.0), "__dict__")
    assert Mark(Point(1.0)) != Mark(Point(1.0))
    match line:
        case Line(Point(x), Point(_, y)):
            assert (x, y) == (1.0, 1.0)


@mutable
class Count:
    """What changes."""

    number: int = 0
    seen: list[int] = field(default_factory=list)
    last: int = field(init=False)


@mutable(slots=False, eq=False)
class Open:
    """Takes more than its fields."""

    number: int


def test_what_changes() -> None:
    count, other = Count(1), Count(1)
    assert repr(Open(1)) == "Open(number=1)"
    count.last = other.last = 3
    assert count == other
    assert pickle.loads(pickle.dumps(count)) == count
    count.number += 1
    assert count != other
    assert count.seen is not other.seen
    with pytest.raises(TypeError, match="unhashable"):
        hash(count)
    with pytest.raises(AttributeError):
        count.more = 1
    unequal = Open(1)
    unequal.more = 2
    assert unequal != Open(1)
    assert hash(unequal) == object.__hash__(unequal)
