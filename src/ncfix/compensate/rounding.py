"""What rounding to the control's digits does to the path: an account of its own, on top of the tolerance.

Every number is off by up to half an output step. At the end of a motion that is half a step in each linear axis. On the
way of an arc its centre is off, too: in the middle of a turn by `a` that counts 1 - cos(a / 2) times, twice on a full
circle. A rotary axis that is put on its digits has X Y Z solved again where a piece ends (see `digits`); in between the
tool stands on another arm than at the ends, and half a step of the axis counts by what the arm has changed.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from ncfix.compensate.assembly import Plan
from ncfix.compensate.plan.arrays import Array, Index, Mask, lengths, picked, some
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.sampling import reach
from ncfix.control.moves import Kind, Moves
from ncfix.machine import Machine
from ncfix.writer.pieces import Pieces

CENTRE = 2.0
"""Half steps by which a centre may be off in its plane: one that a radius says is within an output step of its place,
and two words for it are within half a step each."""


def rounding(machine: Machine) -> float:
    """How far the tip may be off at the end of a motion because numbers are rounded: half a step in each axis, mm."""
    half = 0.5 * machine.least_increment[0]
    ways = np.array([axis.direction for axis in machine.axes if not axis.rotary])
    if not len(ways):
        return 0.0
    corners = np.array(list(product((-1.0, 1.0), repeat=len(ways)))) @ ways
    return float(half * max(lengths(corners).max(), min(len(ways), 3) ** 0.5))


def rounding_along(intent: Intent, plan: Plan, own: Mask | None = None) -> float:
    """How far the tip may be off along corrected motions because numbers are rounded, mm; 0 where there are none.

    own  (n,) motions that count; all if not given
    """
    machine, moves, pieces = intent.machine, intent.moves, plan.pieces
    rows = np.flatnonzero(~pieces.kept & (moves.kind != Kind.DWELL)[pieces.move])
    rows = rows if own is None else rows[own[pieces.move[rows]]]
    if not rows.size:
        return 0.0
    arcs = rows[pieces.arc[rows]]
    round_ = rounding_of_arcs(machine, _turns(moves, pieces, arcs)) if arcs.size else 0.0
    corners = 0.5 * machine.least_increment[0] * plan.corners
    return max(rounding(machine) + _rounding_of_turns(intent, pieces, rows), round_, corners)


def rounding_of_arcs(machine: Machine, sweep: Array) -> float:
    """How far the tip may be off along arcs that turn by `sweep` (k,) rad, mm: their ends and centres are rounded."""
    half, bend = 0.5 * machine.least_increment[0], 1 - np.cos(np.minimum(np.abs(sweep), 2 * np.pi) / 2)
    in_plane = 2**0.5 + CENTRE * float(bend.max(initial=0.0))
    return max(half * float(np.hypot(in_plane, 1.0)), rounding(machine))


def _turns(moves: Moves, pieces: Pieces, rows: Index) -> Array:
    """By how much arcs among pieces turn, (k,) rad: each by its share of its motion."""
    return moves.sweep[pieces.move[rows]] * (pieces.fraction[rows] - _begun(pieces)[rows])


def _begun(pieces: Pieces) -> Array:
    """(m,) the fraction of its motion at which each piece begins."""
    begun = np.zeros(len(pieces))
    begun[1:] = np.where(np.diff(pieces.move) == 0, pieces.fraction[:-1], 0.0)
    return begun


def _rounding_of_turns(intent: Intent, pieces: Pieces, rows: Index) -> float:
    """What rounded rotary positions do between the ends of pieces `rows` (k,), mm.

    Only without tool-centre-point control: with it the tip stays where it is while the axes turn.
    """
    moves, rotary = intent.moves, intent.machine.rotary
    anew = some((picked(pieces.end, rows) != picked(moves.end, pieces.move[rows]))[:, rotary])
    on = rows[anew & ~moves.tcp[pieces.move[rows]]]
    if not on.size:
        return 0.0
    most = 0.0
    for each in (on, np.minimum(on + 1, len(pieces) - 1)):  # those that end there, and those that begin there
        move, first = pieces.move[each], _begun(pieces)[each] == 0
        start = np.where(first[:, None], picked(moves.start, move), picked(pieces.end, np.maximum(each - 1, 0)))
        way = np.nan_to_num(np.abs(picked(pieces.end, each) - start))
        arm = reach(intent, move) * way[:, rotary].sum(axis=1)
        most = max(most, float((lengths(way[:, ~rotary]) + arm).max()))
    return 0.5 * intent.machine.least_increment[1] * float(np.count_nonzero(rotary)) * most / 2
