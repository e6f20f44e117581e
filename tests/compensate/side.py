"""Two programs compared as `verify` does it, of their motions at once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ncfix.compensate.figures.comparison import CutPath, RunningComparison
from ncfix.compensate.figures.simulation import SimulatedErrors
from ncfix.compensate.plan.intent import Intent
from ncfix.control.moves import Moves
from ncfix.machine import Machine, State

NEAR = 1e-5
"""mm: of distances below it is not found out whether another point is nearer."""


def compared(
    machine: Machine, original: Moves, other: Moves, near: float = NEAR, parts: int = 1
) -> tuple[SimulatedErrors, SimulatedErrors, SimulatedErrors]:
    """How far the original is from what it means, the other one from that, and that from the other one.

    Lines are the rows of the motions. Raises `DifferenceError` NCF420 if the two are not the same cut at all.

    parts  in how many both are given, one after the other
    """
    found = RunningComparison(near, 0.0)
    found.run(divided(cut(machine, original, meant=True), parts), divided(cut(machine, other, meant=False), parts))
    before, there, back = found.matches
    return before.along, there.along, back.along


def cut(machine: Machine, moves: Moves, meant: bool) -> CutPath:
    """What motions cut, at once."""
    return CutPath.of(Intent(machine, moves, State()), np.arange(len(moves)), slice(None), True, meant)


def divided(whole: CutPath, parts: int) -> Iterator[CutPath]:
    """The same in so many parts."""
    for begin, end in pairwise(np.linspace(0, 1, parts + 1)):
        actual, intended = (
            each and each.taken(slice(round(begin * len(each)), round(end * len(each))))
            for each in (whole.actual, whole.intended)
        )
        assert actual is not None
        yield replace(whole, actual=actual, intended=intended, last=end == 1)
