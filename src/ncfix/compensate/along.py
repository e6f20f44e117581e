"""How far a path is from where it should be, added up place after place."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

import numpy as np

from ncfix.compensate.findings import Array, Index
from ncfix.compensate.ragged import distinct


class Samples(Protocol):
    """Errors at k places of a path: lines (k,), sizes (k,) mm, and the way (k,) mm that each stands for."""

    @property
    def lines(self) -> Index:
        """The line in which each is."""

    @property
    def size(self) -> Array:
        """How large it is."""

    @property
    def weight(self) -> Array:
        """The way that it stands for."""


Some = TypeVar("Some", bound=Samples)


@dataclass(slots=True)
class Along:
    """Errors along a path; of as many parts as there may be, the same.

    limit   mm; where the error is larger is noted; may become larger
    max     mm; NaN once one is not known
    where   the line of the largest
    beyond  lines with errors beyond the limit, and the largest there, by parts; some twice
    """

    limit: float = np.inf
    max: float = 0.0
    where: int | None = None
    squares: float = 0.0
    way: float = 0.0
    plain_squares: float = 0.0
    count: int = 0
    beyond: list[tuple[Index, Array]] = field(default_factory=list)

    def add(self, lines: Index, error: Array, weight: Array) -> None:
        """Add errors (k,) mm in lines (k,), with the way (k,) that each stands for."""
        if not len(error):
            return
        worst = int(np.argmax(error))
        if self.where is None or not (error[worst] <= self.max or np.isnan(self.max)):
            self.max, self.where = float(error[worst]), int(lines[worst])
        squares = error**2
        self.squares = _added(self.squares, squares * weight)
        self.way = _added(self.way, weight)
        self.plain_squares = _added(self.plain_squares, squares)
        self.count += len(error)
        if self.max > self.limit:
            over = np.flatnonzero(error > self.limit)
            first = np.flatnonzero(np.diff(lines[over], prepend=-1))
            if over.size:
                self.beyond.append((lines[over[first]], np.maximum.reduceat(error[over], first)))

    @classmethod
    def of(cls, errors: Iterable[Samples]) -> Along:
        """Of all samples of a path."""
        along = cls()
        deque(along.adding(errors), maxlen=0)
        return along

    def adding(self, errors: Iterable[Some]) -> Iterator[Some]:
        """Add samples as they are asked for."""
        for each in errors:
            self.add(each.lines, each.size, each.weight)
            yield each

    @property
    def rms(self) -> float:
        """The root mean square along the path, mm; over the places where the path has no length."""
        if not self.count:
            return 0.0
        return float(np.sqrt(self.squares / self.way if self.way else self.plain_squares / self.count))

    @property
    def lines_beyond(self) -> list[int]:
        """The lines with errors beyond the limit, in order."""
        return lines_of([lines[error > self.limit] for lines, error in self.beyond])


def lines_of(parts: list[Index]) -> list[int]:
    """The lines that occur in parts, each once, in order."""
    lines: list[int] = distinct(np.concatenate([np.zeros(0, dtype=np.intp), *parts])).tolist()
    return lines


def _added(total: float, values: Array) -> float:
    """A total and values (k,), added one by one: in whatever parts they come, the sum is the same to the last bit."""
    return float(np.add.accumulate(np.concatenate([[total], values]))[-1])
