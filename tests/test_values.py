"""Classes made by `ncfix.values` are what the standard library makes of them."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
import re
from collections.abc import Callable
from dataclasses import FrozenInstanceError, field
from typing import Any, ClassVar

import pytest

from ncfix import values

Maker = Callable[..., Callable[[type], type]]


def shapes(dataclass: Maker) -> dict[str, type]:
    """One class of each shape that the project uses."""

    @dataclass(frozen=True, slots=True)
    class Plain:
        number: int
        text: str = "x"
        many: list[int] = field(default_factory=list)
        seen: dict[str, int] = field(default_factory=dict, repr=False, compare=False)
        count: ClassVar[int] = 3

    @dataclass(frozen=True)
    class Checked:
        number: int
        twice: int = field(init=False, default=0)

        def __post_init__(self) -> None:
            object.__setattr__(self, "twice", 2 * self.number)

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Named:
        text: str = "y"
        number: int

    @dataclass(slots=True)
    class Changing:
        number: int
        many: list[int] = field(default_factory=list)

    @dataclass(frozen=True, slots=True)
    class Own:
        number: int

        def __eq__(self, other: object) -> bool:
            return isinstance(other, Own) and self.number % 10 == other.number % 10

        def __hash__(self) -> int:
            return self.number % 10

        def __repr__(self) -> str:
            return "own"

    @dataclass(frozen=True, slots=True)
    class Derived(Plain):  # type: ignore[misc, valid-type]
        more: float = 0.5

    @dataclasses.dataclass(frozen=True, slots=True)
    class Foreign(Plain):  # type: ignore[misc, valid-type]
        more: float = 0.5

    @dataclass(frozen=True, repr=False, eq=False)
    class Bare:
        number: int

    @dataclass(frozen=True, slots=True)
    class Empty:
        pass

    return {name: made for name, made in locals().items() if isinstance(made, type)}


OURS, THEIRS = shapes(values.dataclass), shapes(dataclasses.dataclass)
GIVEN = {"Empty": {}}


@pytest.mark.parametrize("name", OURS)
def test_they_are_made_shown_compared_and_changed_alike(name: str) -> None:
    found: list[list[Any]] = []
    for made in (OURS[name], THEIRS[name]):
        given = GIVEN.get(name, {"number": 5})
        one, other = made(**given), made(**given)
        assert dataclasses.is_dataclass(made)
        facts = [one == other, one != other, one == 5, [each.name for each in dataclasses.fields(made)]]
        facts += [made.__match_args__, getattr(made, "__slots__", None), list(inspect.signature(made).parameters)]
        facts.append([each.kind for each in inspect.signature(made).parameters.values()])
        facts.append([dataclasses.asdict(one), copy.copy(one) == one])
        facts.append(re.sub(r"0x\w+", "", repr(one)).replace(made.__qualname__, made.__name__))
        facts.append(inspect.signature(made.__init__).parameters.keys())
        if given:
            facts.append(dataclasses.asdict(dataclasses.replace(one, number=7)))
            facts.append(dataclasses.replace(one, number=7) == one)
        for attempt in (setattr, delattr) if given else ():
            try:
                attempt(one, "number", *([1] if attempt is setattr else []))
                facts.append("done")
            except FrozenInstanceError as error:
                facts.append(str(error))
        for call in (made, lambda made=made: made(5, "x", [], {}, 1, 2, 3), lambda made=made: made(odd=1)):
            try:
                facts.append(repr(call()) if name == "Own" else call() == made(**given))
            except TypeError:
                facts.append("refused")
        found.append(facts)
    assert found[0] == found[1]


@pytest.mark.parametrize("name", sorted(OURS))
def test_they_are_hashed_alike(name: str) -> None:
    found: list[Any] = []
    for made in (OURS[name], THEIRS[name]):
        one = made(**GIVEN.get(name, {"number": 5}))
        try:
            found.append(0 if name == "Bare" else hash(one))
        except TypeError as error:
            found.append(str(error).replace(made.__qualname__, ""))
    assert found[0] == found[1]


@values.dataclass(frozen=True, slots=True)
class Pickled:
    """Found by pickle."""

    number: int
    many: tuple[int, ...] = ()


def test_they_are_pickled() -> None:
    one = Pickled(3, (1, 2))
    assert pickle.loads(pickle.dumps(one)) == one
    assert hash(one) == hash(copy.deepcopy(one)) == hash((3, (1, 2)))
