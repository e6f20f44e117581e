"""Was the program corrected before, although it carries no stamp?

People and CAM systems write round numbers; a correction makes them crooked. If a program's coordinates are crooked,
and become round when the errors of the machine are put into them, then it was written for these errors: it has been
corrected already, and its stamp is gone. Correcting it again would put the errors back in, the other way round, as
large as they were, and nothing later on would show it.

A number is round here if it lies within one step of the control's digits of a grid that is ten times coarser. Of
numbers with all digits used as many become round as cease to be, by chance; nothing is said of them.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from ncfix.compensate.findings import Array, Mask
from ncfix.diagnostics import Message, Place, RefusedError
from ncfix.program.moves import Moves

COARSE = 10
"""Steps of the grid of round numbers, in steps of the control's digits."""
NEAR = 1.0
"""Steps within which a number is on the grid; two roundings, of the number and of its correction, are less."""
ENOUGH = 30
"""Different numbers that have to become round."""
SURE = 6.0
"""Standard deviations by which more have to become round than cease to be; by chance, one program in 10^9."""
MOVED = 0.75
"""Steps by which a number has to be corrected to say anything."""


def suspected(settled: Changed, step: float, path: str, force: bool) -> tuple[Message, ...]:
    """Raise RefusedError NCF438 for a program that seems to have been corrected before; with `force`, only say so."""
    if not looks_corrected(settled, step):
        return ()
    text = "seems to have been corrected already: with this machine's errors put in, its numbers become round"
    message = Message("NCF438", text, Place(path), "fix the original program, or say --force if this is it")
    if not force:
        raise RefusedError((message,))
    return (message,)


class Changed(Protocol):
    """Motions (n), which of them are left as they are, and how the commands at their ends change, (n, n_axes)."""

    @property
    def moves(self) -> Moves:
        """As programmed."""

    @property
    def kept(self) -> Mask:
        """Those that are left, (n,)."""

    @property
    def shift(self) -> Array:
        """What is added, (n, n_axes) mm and rad."""


def looks_corrected(settled: Changed, step: float) -> bool:
    """Whether the program seems to have been corrected before, for this machine.

    step  of the control's digits, mm
    """
    gained, lost = 0, 0
    for before, change in _numbers(settled, step):
        crooked, straightened = ~_round(before, step), _round(before - change, step)
        gained += int((straightened & crooked).sum())
        lost += int((~straightened & ~crooked).sum())
    return gained >= ENOUGH and gained - lost > SURE * math.sqrt(gained + lost)


def _numbers(settled: Changed, step: float) -> list[tuple[Array, Array]]:
    """For each linear axis the different commands that change it, and their corrections, mm."""
    moves, change = settled.moves, settled.shift
    new = np.abs(moves.end - moves.start) > step / 2
    said = new & ~settled.kept[:, None] & (np.abs(change) > MOVED * step) & ~moves.rotary
    rows = (np.flatnonzero(each) for each in said.T)
    return [_different(moves.end[row, axis], change[row, axis], step) for axis, row in enumerate(rows) if len(row)]


def _different(values: Array, change: Array, step: float) -> tuple[Array, Array]:
    _, first = np.unique(np.rint(values / step), return_index=True)
    return values[first], change[first]


def _round(values: Array, step: float) -> Mask:
    """Which of the values are near a grid of round numbers, wherever it begins: where most of these are."""
    grid = COARSE * step
    phase = np.exp(2j * np.pi * values / grid)
    start = np.angle(phase.mean()) / (2 * np.pi) * grid
    near: Mask = np.abs((values - start + grid / 2) % grid - grid / 2) <= NEAR * step
    return near
