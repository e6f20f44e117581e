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
from collections.abc import Mapping
from typing import Protocol

import numpy as np

from ncfix.compensate.plan.arrays import Array, Mask
from ncfix.control.moves import Moves
from ncfix.diagnostics import Message, Place, RefusedError
from ncfix.text.tree import Program

COARSE = 10
"""Steps of the grid of round numbers, in steps of the control's digits."""
NEAR = 1.0
"""Steps within which a number is on the grid; two roundings, of the number and of its correction, are less."""
ENOUGH = 30
"""Different numbers that have to become round."""
SURE = 6.0
"""Standard deviations by which more have to become round than cease to be; by chance, one program in 10^9."""
LOOKED = 10_000
"""Lines of a program that are looked at: parts of the usual size have more, so that nothing is in a pipe by then."""
MOVED = 0.75
"""Steps by which a number has to be corrected to say anything."""


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


Numbers = Mapping[int, tuple[Array, Array]]
"""Of each linear axis, by its column: the different commands (k,), and what is added to them (k,), mm."""


def numbers_of(settled: Changed, step: float, among: Mask | bool = True) -> Numbers:
    """The commands that change their axis and are corrected, of motions `among` (n,) which they shall be.

    step  of the control's digits, mm
    """
    moves, change = settled.moves, settled.shift
    new = np.abs(moves.end - moves.start) > step / 2
    told = ~settled.kept & among
    said = new & told[:, None] & (np.abs(change) > MOVED * step) & ~moves.rotary
    rows = ((axis, np.flatnonzero(each)) for axis, each in enumerate(said.T))
    return {axis: _different(moves.end[row, axis], change[row, axis], step) for axis, row in rows if len(row)}


def numbers_at_the_beginning(program: Program, settled: Changed, step: float, own: Mask | bool = True) -> Numbers:
    """The numbers in the first lines of a program, of which this is a part; `own` (n,) motions of the part."""
    if program.first_line > LOOKED:
        return {}
    return numbers_of(settled, step, own & (program.lines(settled.moves.block) <= LOOKED))


def together(one: Numbers, other: Numbers, step: float) -> Numbers:
    """The different numbers of both; of equal ones those that come first."""
    both = {axis: np.hstack([each[axis] for each in (one, other) if axis in each]) for axis in {**one, **other}}
    return {axis: _different(values, change, step) for axis, (values, change) in both.items()}


def suspected(numbers: Numbers, step: float, path: str, force: bool) -> tuple[Message, ...]:
    """Raise RefusedError NCF438 for a program that seems to have been corrected before; with `force`, only say so."""
    if not looks_corrected(numbers, step):
        return ()
    text = "seems to have been corrected already: with this machine's errors put in, its numbers become round"
    message = Message("NCF438", text, Place(path), "fix the original program, or say --force if this is it")
    if not force:
        raise RefusedError((message,))
    return (message,)


def looks_corrected(numbers: Numbers, step: float) -> bool:
    """Whether the program with these numbers seems to have been corrected before, for this machine.

    step  of the control's digits, mm
    """
    gained, lost = 0, 0
    for before, change in numbers.values():
        crooked, straightened = ~_round(before, step), _round(before - change, step)
        gained += int((straightened & crooked).sum())
        lost += int((~straightened & ~crooked).sum())
    return gained >= ENOUGH and gained - lost > SURE * math.sqrt(gained + lost)


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
