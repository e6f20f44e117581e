"""The plan: pieces of all motions in one list, and what goes with them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ncfix.compensate.grids import INSTANT
from ncfix.compensate.known import Known
from ncfix.compensate.plan.arrays import Array, Index, Mask, lengths, offsets, owners, picked, places, sums
from ncfix.compensate.plan.findings import Finding
from ncfix.control.moves import Kind, Moves
from ncfix.writer.pieces import Pieces

if TYPE_CHECKING:
    from ncfix.compensate.grids import Split
    from ncfix.compensate.plan.segments import Segments

LEAST_SHARE = 1e-6
"""Of a motion's time, for a piece that goes nowhere: inverse-time feed is divided by it."""


@dataclass(frozen=True, slots=True)
class Plan:
    """What to write, and what there is to say about it.

    pieces     the corrected path, one row or more per motion
    start      (n, n_axes) the command at which each motion really starts, NaN where not known
    deviation  (n,) mm: how far the tip was found to leave the intended path, before rounding; 0 where not looked at
    oriented   (n,) the tool direction is corrected too, without damping or limits
    findings   what is wrong, by motion; `pieces.kept` tells what was left as it was
    known      what is known of the ends of motions
    corners    what rounding may do at corners that the control offsets, in half output steps; 0 where there are none
    """

    pieces: Pieces
    start: Array
    deviation: Array
    oriented: Mask
    findings: tuple[Finding, ...]
    known: Known | None = None
    corners: float = 0.0


def untouched(moves: Moves, kept: Mask) -> Plan:
    """The plan that changes nothing."""
    n = len(moves)
    pieces = Pieces(np.arange(n), np.ones(n), moves.end.copy(), moves.kind == Kind.ARC, moves.centre.copy(), kept)
    return Plan(pieces, moves.start.copy(), np.zeros(n), np.ones(n, dtype=bool), ())


def assembled(
    moves: Moves,
    real: Segments,
    kept: Mask,
    rows: Index,
    parts: Split | None,
    deviation: Array,
    oriented: Mask,
    findings: tuple[Finding, ...],
) -> Plan:
    """The plan of motions done as `real` has them, but for motions `rows`, which are done in `parts`."""
    counts = np.ones(len(moves), dtype=np.intp)
    if parts is not None:
        counts[rows] = parts.counts
    move = owners(counts)
    fraction, end, arc = np.ones(len(move)), picked(real.end, move), real.arc[move]
    centre = np.full((len(move), 3), np.nan)
    centre[arc] = real.centre[move[arc]]
    if parts is not None:
        at = np.repeat(offsets(counts)[:-1][rows], parts.counts) + places(parts.counts)
        fraction[at], end[at], arc[at], centre[at] = parts.fraction, parts.end, parts.arc, parts.centre
    pieces = Pieces(move, fraction, end, arc, centre, kept[move])
    pieces = replace(pieces, share=_shares(pieces, real, counts))
    return Plan(pieces, real.start, deviation, oriented, findings)


def with_approaches(plan: Plan, approaches: Array | None) -> Plan:
    """The plan with the levels (n, n_axes) from which canned cycles feed."""
    if approaches is None:
        return plan
    return replace(plan, pieces=replace(plan.pieces, approach=approaches[plan.pieces.move]))


def _shares(pieces: Pieces, real: Segments, counts: Index) -> Array:
    """Shares of time: those of the fraction; a piece that only takes up a jump has the share of its way."""
    before = np.zeros(len(pieces))
    before[1:] = pieces.fraction[:-1]
    first = offsets(counts)[:-1]
    before[first] = 0.0
    span = pieces.fraction - before
    jumps = span < 2 * INSTANT
    if not jumps.any():
        return span
    start = np.empty_like(pieces.end)
    start[1:] = pieces.end[:-1]
    start[first] = real.start
    way = lengths(pieces.end - start)
    whole = np.repeat(sums(way, counts), counts)
    share = np.where(jumps, np.maximum(way / np.maximum(whole, 1e-300), LEAST_SHARE), span)
    result: Array = share / np.repeat(sums(share, counts), counts)
    return result
