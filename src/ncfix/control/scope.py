"""What functions that are made of a block's expressions read: its numbers, and with each family its variables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol


class BlockNumbers(Protocol):
    """The numbers of the block that is executed, among those of its program."""

    @property
    def numbers(self) -> Sequence[float]:
        """The numbers of the program."""

    @property
    def first(self) -> int:
        """Where those of the block begin."""


def literal(slot: int) -> Callable[[BlockNumbers], float]:
    """The function that gives a number of the block as it is written."""
    return lambda scope: scope.numbers[scope.first + slot]
