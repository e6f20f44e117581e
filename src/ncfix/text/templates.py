"""What the memory of shapes keeps, shared between programs, and one block by its grammar alone."""

from __future__ import annotations

from collections import OrderedDict
from functools import lru_cache
from typing import Generic, TypeVar

from ncfix.text.build import Parsed
from ncfix.text.dialect import Dialect
from ncfix.text.language import language_of
from ncfix.text.tree import Template

CAPACITY = 5_000
"""How many shapes and texts of a dialect are remembered; the one that was not used for longest goes first."""

Value = TypeVar("Value")


class Memory(Generic[Value]):
    """Values by key, the least recently used forgotten first."""

    def __init__(self, capacity: int = CAPACITY) -> None:
        self._capacity = capacity
        self._values: OrderedDict[bytes, Value] = OrderedDict()

    def __len__(self) -> int:
        return len(self._values)

    def recall(self, key: bytes) -> Value | None:
        """The value under `key`, which is now the last to be forgotten."""
        if key in self._values:
            self._values.move_to_end(key)
        return self._values.get(key)

    def keep(self, key: bytes, value: Value) -> None:
        """Remember a value."""
        self._values[key] = value
        if len(self._values) > self._capacity:
            self._values.popitem(last=False)


@lru_cache(maxsize=32)
def shapes_of(dialect: Dialect) -> Memory[Template]:
    """The templates of the shapes of a dialect that were seen."""
    return Memory()


@lru_cache(maxsize=32)
def texts_of(dialect: Dialect) -> Memory[Parsed]:
    """The blocks of a dialect that were parsed one by one."""
    return Memory()


def parse_block(dialect: Dialect, text: str) -> Parsed:
    """One block, by the grammar and the rules that a grammar cannot say; raises `BlockError`."""
    return language_of(dialect).parse(dialect, text)
