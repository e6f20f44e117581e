"""Arcs, dwells and turns of rotary axes among plain motions.

Mostly they are planned with these: an arc that stays one, a dwell between motions that end where they shall, a turn.
What is more than that is planned by the long way, as a short program of its own: each with the motion before it, so
that it begins where it shall, and the one behind it, which may have to begin somewhere else than it would behind a
plain motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ncfix.compensate.options import FixOptions
from ncfix.compensate.plan.arcs import Closure, fitted, full_circles
from ncfix.compensate.plan.arrays import Index, Mask, distinct
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.segments import Segments, arcs_within
from ncfix.compensate.settle import agree
from ncfix.control.moves import Kind, Moves
from ncfix.control.parts import taken
from ncfix.machine import Machine
from ncfix.text.dialect import Dialect
from ncfix.writer.pieces import Pieces

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


def together(
    intent: Intent, real: Segments, plain: Mask, dialect: Dialect, rounding: float
) -> tuple[Segments, Others] | None:
    """Motions as they are really done, with the circles of the arcs among them, and these arcs and dwells.

    real      where they really start and end
    plain     (n,) those that are straight; of the others a turn is as one of them
    rounding  how far a point may move when it is rounded to the control's digits, mm

    None if there are many arcs, or some that do not surely stay arcs within the travels.
    """
    moves, arc = intent.moves, intent.segments.arc
    dwell, turn = moves.kind == Kind.DWELL, (moves.kind == Kind.FEED) & (moves.modal == 10)
    arcs, dwells = np.flatnonzero(arc), np.flatnonzero(dwell)
    if FEW * len(arcs) > len(plain) or not (plain | arc | dwell | turn).all():
        return None
    if (real.start[dwells] != real.end[dwells]).any() or full_circles(intent, arcs).any():
        return None
    if arcs.size:
        fit = fitted(intent, real, arcs, Closure(dialect.closure_mm, dialect.closure_relative), rounding)
        centre, sweep = real.centre.copy(), real.sweep.copy()
        centre[arcs], sweep[arcs] = fit.centre, fit.sweep
        real = replace(real, centre=centre, sweep=sweep)
        within = (arcs_within(intent.machine, each.rows(arcs)).all() for each in (intent.segments, real))
        if not (fit.sound.all() and all(within)):
            return None
    rows = np.flatnonzero(arc | dwell)
    ones = np.ones(len(rows), dtype=np.intp)
    centre = np.where(arc[rows, None], real.centre[rows], np.nan)
    return real, Others(rows, ones, Pieces(rows, ones.astype(float), real.end[rows], arc[rows], centre, ~arc[rows]))


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
