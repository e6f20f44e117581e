"""Words for axes that the program has not named yet, where it was only assumed how they stand.

A correction may need an axis that the block does not name. The new word says where the axis already stands, but for
some um; if that was assumed (`--assume-zero`) and is wrong, the word makes the axis move, perhaps into the part.
"""

from __future__ import annotations

import numpy as np

from ncfix.compensate.findings import Index
from ncfix.compensate.settle import Settled
from ncfix.diagnostics import Message
from ncfix.program.tree import Program

WRITTEN = 1e-9
"""mm or rad; a command that is changed by more has a word of its own."""


def words_on_trust(program: Program, settled: Settled, assumed: tuple[str, ...]) -> tuple[Message, ...]:
    """A warning (NCF439) for each axis that gets a word before the program names it, if anything was assumed."""
    if not assumed:
        return ()
    found = []
    for axis, rows in enumerate(_rows(settled)):
        if len(rows):
            name = settled.moves.axes[axis]
            text = f"{name} is written here, the program has not named it yet, and where it stands was assumed"
            hint = f"name {name} in one of the first blocks, or give --initial and --offset"
            found.append(Message("NCF439", text, program.place(int(settled.moves.block[rows[0]])), hint))
    return tuple(found)


def _rows(settled: Settled) -> list[Index]:
    """For each axis the motions that move it although no block has named it so far."""
    moves, changed = settled.moves, np.abs(settled.shift) > WRITTEN
    named = np.logical_or.accumulate(moves.programmed & ~moves.incremental[:, None], axis=0)
    return [np.flatnonzero(each) for each in (changed & ~named & ~settled.kept[:, None]).T]
