"""`ncfix.lazy_dataclass` makes of a class what Python's `dataclass` makes of it."""

import copy
import dataclasses
import pickle
from dataclasses import FrozenInstanceError, field
from functools import partial
from typing import Any, ClassVar

import pytest

from ncfix.lazy_dataclass import dataclass


def bodies() -> dict[str, type]:
    """Classes to be made dataclasses of, by name."""

    class Plain:
        x: int
        y: float = 2.5

    class Single:
        x: object

    class Empty:
        pass

    class Rich:
        kind: ClassVar[str] = "rich"
        x: int
        many: list[int] = field(default_factory=list)
        hidden: int = field(default=3, repr=False)
        aside: int = field(default=4, compare=False)
        made: int = field(init=False, default=5)
        listed: dict[str, int] = field(init=False, default_factory=dict)
        named: str = field(default="n", kw_only=True)

    class Own:
        x: int

        def __eq__(self, other: object) -> bool:
            return True

        def __repr__(self) -> str:
            return "own"

    class Hashed:
        x: Any

        def __eq__(self, other: object) -> bool:
            return True

        def __hash__(self) -> int:
            return 7

    class Checked:
        x: int
        twice: int = 0

        def __post_init__(self) -> None:
            if self.x < 0:
                raise ValueError("negative")
            object.__setattr__(self, "twice", 2 * self.x)

    return {each.__name__: each for each in (Plain, Single, Empty, Rich, Own, Hashed, Checked)}


CALLS: list[tuple[tuple[Any, ...], dict[str, Any]]] = [
    ((), {}), ((1,), {}), ((1, 3.5), {}), ((), {"x": 1}), ((-1,), {}), (([],), {}),
    ((1, [2]), {"named": "k"}), ((1, 2, 3, 4, 5, 6), {}), ((1,), {"not_there": 2}), ((1,), {"made": 2}),
]  # fmt: skip


def of(action: Any) -> Any:
    """What comes of it, an error as its kind."""
    try:
        return action()
    except (TypeError, ValueError, AttributeError) as error:
        return type(error)


def facts(cls: Any) -> list[Any]:
    """All that a user of the class may see."""
    seen: list[Any] = [cls.__name__, cls.__match_args__, [f.name for f in dataclasses.fields(cls)]]
    made = []
    for arguments, named in CALLS:
        instance = of(partial(cls, *copy.deepcopy(arguments), **named))
        seen.append(instance if isinstance(instance, type) else repr(instance))
        if isinstance(instance, cls):
            made.append(instance)
    for one in made:
        number = of(partial(hash, one))
        seen += [[one == other for other in made], one == 1, isinstance(number, int)]
        seen += [[number == of(partial(hash, other)) for other in made], repr(copy.copy(one))]
        seen += [dataclasses.asdict(one), dataclasses.astuple(one)]
        seen += [repr(of(partial(dataclasses.replace, one, x=9)))]
        if "x" in seen[2]:  # Python stumbles over other names of frozen classes with slots
            seen += [of(partial(setattr, copy.copy(one), "x", 3)), of(partial(delattr, copy.copy(one), "x"))]
    return seen


@pytest.mark.parametrize("frozen", [True, False])
@pytest.mark.parametrize("slots", [True, False])
@pytest.mark.parametrize("more", [{}, {"kw_only": True}, {"repr": False}, {"eq": False}], ids=str)
@pytest.mark.parametrize("name", list(bodies()))
def test_a_class_is_what_python_makes_of_it(name: str, frozen: bool, slots: bool, more: dict[str, Any]) -> None:
    ours = dataclass(frozen=frozen, slots=slots, **more)(bodies()[name])
    theirs = dataclasses.dataclass(frozen=frozen, slots=slots, **more)(bodies()[name])
    found, wanted = facts(ours), facts(theirs)
    if more == {"repr": False}:
        assert len(found) == len(wanted)  # an address is in each text
    else:
        assert str(found) == str(wanted)


@dataclass(frozen=True, slots=True)
class Base:
    """A class at the top, so that it can be pickled."""

    x: int
    rest: list[Any] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Child(Base):
    """One that adds a field."""

    y: int = 2


@dataclasses.dataclass(frozen=True, slots=True)
class Foreign(Base):
    """One that a plugin makes of a class of ncfix, with Python's own."""

    z: int = 3


@dataclass(frozen=True)
class Back(Foreign):
    """And one of ncfix made of that."""

    w: int = 4


@pytest.mark.parametrize("cls", [Base, Child, Foreign, Back])
def test_classes_derived_from_each_other_work_and_can_be_pickled(cls: type) -> None:
    one = cls(1, [2])
    assert pickle.loads(pickle.dumps(one)) == one == copy.deepcopy(one)
    assert one.rest == [2]
    assert cls(1).rest is not cls(1).rest
    assert (one == Base(1, [2])) == (cls is Base)
    for name in ("x", "not_there"):
        with pytest.raises(FrozenInstanceError if name == "x" or cls is Base else (AttributeError, TypeError)):
            setattr(one, name, 2)
    with pytest.raises(TypeError, match="unhashable"):
        hash(one)


def test_a_value_that_holds_itself_is_shown() -> None:
    one = Base(1)
    one.rest.append(one)
    assert repr(one) == "Base(x=1, rest=[...])"


def test_a_class_that_is_frozen_cannot_be_made_of_one_that_is_not() -> None:
    with pytest.raises(TypeError, match="frozen"):
        dataclass(slots=True)(type("Loose", (Base,), {}))
