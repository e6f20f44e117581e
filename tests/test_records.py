"""`ncfix.records.dataclass` means what that of the standard library means."""

import copy
import dataclasses
import pickle
from dataclasses import FrozenInstanceError, asdict, field, fields, replace
from typing import Any, ClassVar

import numpy as np
import pytest

from ncfix import records

DECORATORS = (dataclasses.dataclass, records.declared)
OPTIONS: tuple[dict[str, bool], ...] = (
    {},
    {"frozen": True},
    {"slots": True},
    {"frozen": True, "slots": True},
    {"frozen": True, "slots": True, "eq": False, "repr": False},
    {"slots": True, "kw_only": True},
)


@records.dataclass(frozen=True, slots=True)
class Point:
    """Two numbers and what is worked out of them."""

    x: float
    y: float = 2.0
    sum: float = field(init=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "sum", self.x + self.y)


@records.dataclass(frozen=True)
class Turned(Point):
    """One more, and a dictionary of its own."""

    angle: float = 0.0


@records.dataclass(slots=True)
class Node:
    """One that may hold itself."""

    name: str
    parts: list["Node"] = field(default_factory=list)


def both(**options: bool) -> tuple[Any, Any]:
    """The same class, declared with both decorators."""

    def declared(dataclass: Any) -> Any:
        @dataclass(**options)
        class Value:
            """All kinds of fields."""

            known: ClassVar[int] = 7
            number: int
            text: str = "x"
            many: list[int] = field(default_factory=list)
            hidden: int = field(default=3, repr=False, compare=False)
            inner: dict[str, int] = field(init=False, default_factory=dict)
            fixed: int = field(init=False, default=5)

        return Value

    theirs, ours = map(declared, DECORATORS)
    return theirs, ours


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_objects_are_made_shown_and_compared_alike(options: dict[str, bool]) -> None:
    """With defaults, positions, names, and fields that are not given."""
    theirs, ours = both(**options)
    for given in ({"number": 1}, {"number": 2, "text": "y", "many": [1], "hidden": 4}):
        left, right = theirs(**given), ours(**given)
        assert asdict(left) == asdict(right)
        assert options.get("repr") is False or repr(left) == repr(right)
        assert (left == theirs(**given)) is (right == ours(**given))
        assert (left == theirs(number=3)) is (right == ours(number=3))
        assert right != left
    assert ours(number=1).many is not ours(number=1).many
    assert theirs.__match_args__ == ours.__match_args__
    assert [each.name for each in fields(theirs)] == [each.name for each in fields(ours)]


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_wrong_arguments_are_refused_alike(options: dict[str, bool]) -> None:
    """With the words of Python."""
    for given, named in (((), {}), ((1, 2, 3, 4, 5), {}), ((), {"number": 1, "other": 2}), ((), {"inner": {}})):
        with pytest.raises(TypeError) as expected:
            both(**options)[0](*given, **named)
        with pytest.raises(TypeError) as found:
            both(**options)[1](*given, **named)
        assert str(found.value) == str(expected.value)


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_what_has_a_hash_and_what_may_be_set(options: dict[str, bool]) -> None:
    """Mutable objects with values have no hash; frozen ones refuse to be changed, and say so alike."""
    said = []
    for kind in both(**options):
        value = kind(number=1, many=())  # type: ignore[arg-type]
        words: list[object] = [kind.__hash__ is None, hasattr(value, "__dict__")]
        for change in (lambda: setattr(value, "number", 2), lambda: delattr(value, "number")):  # noqa: B023
            try:
                words.append(change())
            except FrozenInstanceError as error:
                words.append(str(error))
        said.append(words)
    assert said[0] == said[1]


def test_frozen_values_are_keys() -> None:
    """Equal values have the hash of their fields."""
    assert {Point(1.0): "a"}[Point(1.0, 2.0)] == "a"
    assert hash(Point(1.0)) == hash((1.0, 2.0))
    assert Point(1.0) != Point(2.0)


def test_copies_and_pickles_are_equal() -> None:
    """Frozen slots, too, which cannot be set as others are."""
    for value in (Point(1.0, 5.0), Turned(1.0, 2.0, 3.0), Node("a", [Node("b")])):
        assert pickle.loads(pickle.dumps(value)) == copy.deepcopy(value) == copy.copy(value) == value
    assert pickle.loads(pickle.dumps(Point(1.0, 5.0))).sum == 6.0


def test_a_class_is_built_on_another() -> None:
    """Fields of both, the checks of the first, and values are made anew by `replace`."""
    value = Turned(1.0, angle=4.0)
    assert (value.x, value.y, value.sum, value.angle) == (1.0, 2.0, 3.0, 4.0)
    assert replace(value, x=5.0) == Turned(5.0, 2.0, 4.0)
    assert replace(value, x=5.0).sum == 7.0
    assert value != Point(1.0)


def test_what_a_class_says_itself_is_kept() -> None:
    """Its own comparison, hash and text."""

    @records.dataclass(frozen=True, slots=True)
    class Same:
        values: Any

        def __eq__(self, other: object) -> bool:
            return isinstance(other, Same) and bool((self.values == other.values).all())

        def __hash__(self) -> int:
            return 1

        def __repr__(self) -> str:
            return "same"

    assert Same(np.zeros(3)) == Same(np.zeros(3))
    assert (hash(Same(0)), repr(Same(0))) == (1, "same")


def test_one_that_holds_itself_is_shown() -> None:
    """Without end it would be."""
    node = Node("a")
    node.parts.append(node)
    assert repr(node) == "Node(name='a', parts=[...])"
