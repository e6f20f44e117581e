"""What a part of a program leaves to the next one.

Plan and emitter take turns until nothing more has to be left as it was (`settle`), over a whole program all at once.
What has to be left shows by and by, and motions behind it are planned before that, too. So the part behind goes through
the same rounds with what the part before had in each: it refuses what the whole program would, and no less.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate.plan.arrays import Array, Mask
from ncfix.compensate.plan.kinematics import Signs


@dataclass(frozen=True, slots=True)
class Round:
    """The last motion of a part in one round: the plans that are made until nothing speaks against one, and its text.

    kept      (k,) in each plan, whether that motion is left as it was
    shift     (k, n_axes) how far off the axes stand at its start then, mm and rad
    position  (n_axes,) the command at its end, as written
    """

    kept: Mask
    shift: Array
    position: Array

    def shortened(self) -> Round:
        """Without plans that only repeat the one before."""
        changes = np.append(True, (self.kept[1:] != self.kept[:-1]) | (self.shift[1:] != self.shift[:-1]).any(axis=1))
        count = int(np.flatnonzero(changes)[-1]) + 1
        return Round(self.kept[:count], self.shift[:count], self.position)

    def goes_on(self, other: Round) -> bool:
        """Whether another round, behind this one, only repeats its end."""
        same = len(other.kept) == 1 and other.kept[0] == self.kept[-1] and (other.shift[0] == self.shift[-1]).all()
        return bool(same and np.array_equal(other.position, self.position, equal_nan=True))


@dataclass(frozen=True, slots=True)
class Before:
    """The last motion of the part before, with which a part begins once more.

    rounds     in each round, see there; behind the last it stays as it is
    direction  (n_axes,) in which the axes came to its start
    """

    rounds: tuple[Round, ...]
    direction: Signs

    @classmethod
    def steady(cls, shift: Array, direction: Signs, position: Array) -> Before:
        """It was never left as it was; arrays (n_axes,) as in `Round`."""
        return cls((Round(np.zeros(1, dtype=bool), shift[None], position),), direction)

    @classmethod
    def of(cls, rounds: tuple[Round, ...], direction: Signs) -> Before:
        """From all rounds of a part."""
        found: list[Round] = []
        for each in map(Round.shortened, rounds):
            if not found or not found[-1].goes_on(each):
                found.append(each)
        return cls(tuple(found), direction)

    def in_round(self, number: int) -> Round:
        """What it was in a round, counted from 0."""
        return self.rounds[min(number, len(self.rounds) - 1)]

    @property
    def kept(self) -> bool:
        """Whether it was left as it was in the end."""
        return bool(self.rounds[-1].kept[-1])

    @property
    def position(self) -> Array:
        """(n_axes,) the command at its end, as written."""
        return self.rounds[-1].position
