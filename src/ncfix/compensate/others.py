"""Arcs and dwells among plain motions: planned by the long way, as a short program of their own.

Each has the motion before it there, so that it begins where it shall, and the one behind it, which may have to begin
somewhere else than it would behind a plain motion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate.findings import Index, Mask
from ncfix.compensate.options import FixOptions
from ncfix.compensate.ragged import distinct
from ncfix.compensate.settle import agree
from ncfix.machine import Machine
from ncfix.program.dialect import Dialect
from ncfix.program.moves import Kind, Moves
from ncfix.program.parts import taken
from ncfix.program.pieces import Pieces

FEW = 16
"""Of so many motions at most one may be other than plain."""


@dataclass(frozen=True, slots=True)
class Others:
    """What is to be written of some motions.

    rows    (k,) which motions, in order
    counts  (k,) how many pieces each has
    pieces  these pieces
    """

    rows: Index
    counts: Index
    pieces: Pieces


def planned(machine: Machine, dialect: Dialect, options: FixOptions, moves: Moves, plain: Mask) -> Others | None:
    """The motions that are not `plain` (n,), and those behind them; None if more has to be said of them than that."""
    odd = np.flatnonzero(~plain)
    if FEW * len(odd) > len(moves) or odd[0] == 0 or odd[-1] + 2 >= len(moves):
        return None
    near = distinct(np.concatenate([odd - 1, odd, odd + 1]))
    few = taken(moves, near)
    agreed = agree(few, machine, dialect, options)
    still = few.kind == Kind.DWELL
    if agreed.reasons or agreed.plan.findings or (agreed.kept != still).any():
        return None
    pieces = agreed.plan.pieces
    own = ~(plain[near] & plain[near - 1])
    chosen = own[pieces.move]
    columns = {name: getattr(pieces, name)[chosen] for name in ("fraction", "end", "arc", "centre", "kept")}
    move = near[pieces.move[chosen]]
    return Others(near[own], np.bincount(pieces.move, minlength=len(near))[own], Pieces(move=move, **columns))
