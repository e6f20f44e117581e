"""Two programs compared as `verify` does it, of their motions at once."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ncfix.compensate.along import Along
from ncfix.compensate.cuts import Cut
from ncfix.compensate.intent import Intent
from ncfix.compensate.side_by_side import SideBySide
from ncfix.machine import Machine, State
from ncfix.program.moves import Moves

NEAR = 1e-5
"""mm: of distances below it is not found out whether another point is nearer."""


def compared(machine: Machine, original: Moves, other: Moves, near: float = NEAR) -> tuple[Along, Along, Along]:
    """How far the original is from what it means, the other one from that, and that from the other one.

    Lines are the rows of the motions. Raises `DifferenceError` NCF420 if the two are not the same cut at all.
    """
    found = SideBySide(near)
    found.run(cut(machine, original, meant=True), cut(machine, other, meant=False))
    before, there, back = found.matches
    return before.along, there.along, back.along


def cut(machine: Machine, moves: Moves, meant: bool) -> Iterator[Cut]:
    """What motions cut, at once."""
    yield Cut.of(Intent(machine, moves, State()), np.arange(len(moves)), slice(None), True, meant)
