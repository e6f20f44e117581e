"""Splitting motions: fine grids of exactly corrected commands, made finer where the pieces come out short."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate.ends import as_commands, path_of
from ncfix.compensate.held import with_rotary_held
from ncfix.compensate.plan.arrays import Array, Index, Mask, batches, offsets, owners, picked, places, sums
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.kinematics import regular
from ncfix.compensate.plan.sampling import MOST, bends, crossed, merged, reversals
from ncfix.compensate.plan.segments import Segments
from ncfix.compensate.plan.strategies import Strategy
from ncfix.compensate.round import RoundGrid
from ncfix.compensate.split import Grid, fewest

PER_BEND = 8
"""Nodes for each time that the error may bend."""
PER_PIECE = 32
"""Nodes to each piece expected; a piece is longest to one part in so many."""
FEW = 14
"""Pieces with fewer nodes on average are worth a finer grid."""
SPARSE = 4
"""Pieces with fewer have not been looked at in between."""
REFINEMENTS = 3
INSTANT = 1e-7
"""Fraction of a motion from one side of a jump or reversal to the other."""
BATCH = 100_000
"""Nodes worked on at a time."""


@dataclass(frozen=True, slots=True)
class Split:
    """Motions made of pieces, flat, the pieces of a motion next to each other.

    counts    (g,) pieces of each motion
    fraction  (p,) where each ends on its motion
    end       (p, n_axes) commands
    arc       (p,) the piece is an arc
    centre    (p, 3) its centre then, mm
    worst     (g,) largest deviation of the tip found, mm
    """

    counts: Index
    fraction: Array
    end: Array
    arc: Mask
    centre: Array
    worst: Array


@dataclass(frozen=True, slots=True)
class Cutter:
    """What motions are cut for.

    tolerance  how far the tip may be off between the ends of a piece, mm
    round      pieces are arcs (all motions are, then), not straight
    """

    strategy: Strategy
    tolerance: float
    round: bool = False


def split(intent: Intent, real: Segments, rows: Index, pieces: Array, cutter: Cutter) -> Split:
    """Split motions `rows` (g,) at the fewest places.

    real    where all motions really start and end
    pieces  (g,) about how many pieces to expect

    Of motions that are too long to be looked at between so many pieces the largest deviation is infinite.
    """
    if not rows.size:
        empty = np.empty(0)
        ends = np.empty((0, intent.moves.end.shape[1]))
        return Split(rows, empty, ends, np.empty(0, dtype=bool), np.empty((0, 3)), empty)
    wished = np.maximum(PER_BEND * bends(intent, rows), PER_PIECE * pieces)
    nodes = np.clip(np.ceil(wished), 2 * PER_PIECE, MOST).astype(np.intp)
    parts = [_split(intent, real, rows[part], nodes[part], cutter) for part in batches(nodes, BATCH)]
    for _ in range(REFINEMENTS):
        result = joined(parts)
        short = np.flatnonzero((nodes < FEW * result.counts) & (nodes < MOST))
        if not short.size:
            break
        nodes[short] = np.minimum(2 * PER_PIECE * result.counts[short], MOST)
        chosen = [short[part] for part in batches(nodes[short], BATCH)]
        finer = [_split(intent, real, rows[each], nodes[each], cutter) for each in chosen]
        parts = [_replaced(result, short, joined(finer))]
    result = joined(parts)
    result.worst[(nodes >= MOST) & (nodes < SPARSE * result.counts)] = np.inf
    return result


def joined(parts: list[Split]) -> Split:
    """Splits of different motions as one."""
    return (
        parts[0]
        if len(parts) == 1
        else Split(
            np.concatenate([part.counts for part in parts]),
            np.concatenate([part.fraction for part in parts]),
            np.concatenate([part.end for part in parts]),
            np.concatenate([part.arc for part in parts]),
            np.concatenate([part.centre for part in parts]),
            np.concatenate([part.worst for part in parts]),
        )
    )


def _replaced(result: Split, which: Index, finer: Split) -> Split:
    """`result` with the motions `which` taken from `finer`."""
    order = np.arange(len(result.counts))
    order[which] = len(result.counts) + np.arange(len(which))
    return taken(joined([result, finer]), order)


def taken(parts: Split, order: Index) -> Split:
    """The motions of `parts` in another order."""
    counts = parts.counts[order]
    take = np.repeat(offsets(parts.counts)[order], counts) + places(counts)
    ends, centres = (parts.fraction[take], picked(parts.end, take)), (parts.arc[take], parts.centre[take])
    return Split(counts, *ends, *centres, parts.worst[order])


def _split(intent: Intent, real: Segments, rows: Index, nodes: Index, cutter: Cutter) -> Split:
    grid = _grid(intent, real, rows, nodes, cutter.strategy)
    cut = RoundGrid.of(grid, intent, rows) if cutter.round else grid
    ends, worst = fewest(cut, cutter.tolerance)
    counts = sums(ends.astype(np.intp), grid.counts).astype(np.intp)
    last = np.flatnonzero(ends)
    first = np.append(0, last[:-1])
    opens = offsets(counts)[:-1]
    first[opens] = offsets(grid.counts)[:-1]
    return Split(counts, grid.fraction[last], picked(grid.command, last), *cut.shape(first, last), worst)


def _grid(intent: Intent, real: Segments, rows: Index, nodes: Index, strategy: Strategy) -> Grid:
    """Exactly corrected commands of motions at nodes; at both ends where the machine really stands."""
    counts, fraction = _fractions(intent, real, rows, nodes)
    move = rows[owners(counts)]
    ends = offsets(counts)
    first, last = ends[:-1], ends[1:] - 1
    bounds = np.zeros(len(move), dtype=bool)
    bounds[first] = bounds[last] = True
    programmed = intent.segments.at(move, fraction)
    q = intent.joints(move, programmed)
    path = None
    if strategy.corrects_orientation:
        decided = np.where(bounds[:, None], real.at(move, fraction) - programmed, 0.0)
        path = path_of(intent, q, intent.machine.tip(q, intent.lengths(move)), fraction == 0, bounds, decided)
    found = strategy.solve(intent.machine, q, intent.states(move, fraction), path)
    result = with_rotary_held(intent, strategy, move, fraction, q, found)
    command = as_commands(intent, move, programmed, q, result.q)
    command[first], command[last] = real.start[rows], real.end[rows]
    command = _as_they_stand(intent, real, move, fraction, command)
    use = result.converged | bounds
    counts = sums(use.astype(np.intp), counts).astype(np.intp)
    if not use.all():
        move, fraction, command = move[use], fraction[use], command[use]
    return Grid(counts, fraction, command, _follow(intent, move, command, strategy))


def _as_they_stand(intent: Intent, real: Segments, move: Index, fraction: Array, command: Array) -> Array:
    """Corrected commands (k, n_axes) with the axes that get no word as `real` has them, X Y Z for such rotary axes."""
    if intent.wordless is None:
        return command
    stand, idle = real.at(move, fraction), intent.wordless[move]
    result = np.where(idle, stand, command)
    turned = np.flatnonzero((idle & intent.machine.rotary & (stand != command)).any(axis=1))
    if turned.size:
        found, arrived = intent.aimed(move[turned], fraction[turned], result[turned])
        result[turned[arrived]] = np.where(idle[turned], result[turned], found)[arrived]
    return result


def _fractions(intent: Intent, real: Segments, rows: Index, nodes: Index) -> tuple[Index, Array]:
    """Fractions of the nodes of motions, both ends included: counts and flat fractions.

    Nodes stand evenly, behind the start, and on both sides of wherever the corrected axes pass a kink or a jump, or
    reverse if that matters.
    """
    counts = nodes + 3
    fraction = (places(counts) - 1) / np.repeat(nodes + 1, counts)
    first = offsets(counts)[:-1]
    fraction[first], fraction[first + 1] = 0.0, INSTANT
    found = [reversals(intent, rows, counts, fraction)]
    if intent.kinks:
        owner = owners(counts)
        q = intent.joints(rows[owner], intent.guessed(real, rows[owner], fraction))
        found.append(crossed(intent, owner, fraction, q))
    if not any(len(at) for _, at in found):
        return counts, fraction
    sides = [(owner, np.clip(at + side, INSTANT, 1.0)) for owner, at in found for side in (-INSTANT / 2, INSTANT / 2)]
    return merged(len(rows), (owners(counts), fraction), *sides)


def _follow(intent: Intent, rows: Index, commands: Array, strategy: Strategy) -> Array:
    """How the tip follows commands (k, n_axes) of motions `rows`, (k or 1, 3, n_axes) mm per mm and mm per rad.

    As seen from where is all the same to the size of a deviation. Where X, Y and Z turn together and nothing else is
    corrected, that is from where they move, so that one is for all. With tool-centre-point control the tip stays where
    it is when only rotary commands change.
    """
    together = intent.machine.linear_ways
    if together is not None and not strategy.corrects_orientation:
        follow = np.zeros((1, 3, commands.shape[1]))
        follow[0, :, intent.columns] = regular(together[None])[0][0].T
        return follow
    follow = np.zeros((len(rows), 3, commands.shape[1]))
    follow[:, :, intent.columns] = intent.follows(rows, commands)
    plain = np.flatnonzero(~intent.moves.tcp[rows])
    if strategy.corrects_orientation and plain.size:
        turning = np.flatnonzero(intent.machine.rotary)
        jacobian = intent.machine.jacobians(commands[plain], intent.lengths(rows[plain])).axes
        follow[plain[:, None, None], np.arange(3)[:, None], turning] = jacobian[:, :3, turning]
    return follow
