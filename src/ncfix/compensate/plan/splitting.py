"""Splitting motions at the fewest places: each piece goes as far as it stays within the tolerance.

Each motion has a fine grid of nodes, each with its exactly corrected command. A straight piece from node a to node b is
judged at the nodes between them: the tip error there is the difference between the command on the piece and the exact
command, times the derivative of the tip by the commands. The error model need not be evaluated again. The differences
are of the order of the tolerance, so the neglected part is smaller by the gradient of the errors (under a thousandth).
If the pieces have few nodes, the grid is refined.

To go as far as possible from each point gives the fewest pieces whose ends are on the exact path. All motions are split
at the same time; motions with very many nodes are divided into stretches. In each round one end is tried for each
piece: first a piece as long as the one before, then longer or shorter ones in growing steps until the longest possible
end is bracketed; then the bracket is halved.

Arcs may be split into arcs. A corrected arc is in general no arc: different scales make an ellipse of it, play makes a
step where an axis reverses. Short arcs follow it smoothly, with far fewer blocks than straight pieces. The centre of a
piece lies on the perpendicular bisector of its ends, so that its radii agree; its place on the bisector is found by
least squares over the nodes between. Pieces too short for a control to determine their centre are straight, and so are
pieces that bend against the sense of the arc, for which a control would go the long way round.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Protocol

import numpy as np

from ncfix import core
from ncfix.arrays import (
    Array,
    Index,
    Mask,
    batches,
    largest,
    offsets,
    owners,
    picked,
    places,
    ranges,
    stacked,
    sums,
    vector_product,
)
from ncfix.compensate.plan.arcs import APART, NUDGE, Closure, across
from ncfix.compensate.plan.ends import as_commands, path_of, with_rotary_held
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.kinematics import regular
from ncfix.compensate.plan.sampling import MOST, bends, crossed, merged, reversals
from ncfix.compensate.plan.segments import Segments, sweep_between
from ncfix.compensate.plan.strategies import Strategy
from ncfix.values import frozen
from ncfix.writer.target import TANGENTIAL

STRETCH = 1024
"""Number of nodes of a motion after which a piece ends in any case."""


class Splittable(Protocol):
    """Motions divided by nodes, at which pieces may begin and end."""

    @property
    def counts(self) -> Index:
        """(g,) number of nodes of each motion, including its start and end; at least 2."""

    def deviations(self, first: Index, last: Index) -> Array:
        """(p,) the largest deviation of pieces from nodes `first` to nodes `last` (flat indices), mm."""

    def shape(self, first: Index, last: Index) -> tuple[Mask, Array]:
        """(p,) whether the pieces between nodes `first` and `last` are arcs, and their centres (p, 3), mm."""


@frozen(slots=False)
class PathNodes:
    """The nodes of motions for straight pieces, flat, motion after motion.

    counts    (g,) number of nodes of each motion, including its start and end; at least 2
    fraction  (k,) fraction of the motion at each node, ascending from 0 to 1
    command   (k, n_axes) exactly corrected command; at the start, where the machine really stands
    follow    (k or 1, 3, n_axes) derivative of the tip by the command at each node, mm per mm and mm per rad
    """

    counts: Index
    fraction: Array
    command: Array
    follow: Array

    def deviations(self, first: Index, last: Index) -> Array:
        """(p,) the largest deviation of straight pieces from nodes `first` to nodes `last` (flat indices), mm."""
        inner, fraction, (commands, follows) = last - first - 1, self.fraction, self._columns
        begun, ended = np.repeat(first, inner), np.repeat(last, inner)
        node = begun + 1 + places(inner)
        share = (fraction[node] - fraction[begun]) / (fraction[ended] - fraction[begun])
        start = commands.take(begun, axis=1)
        short = start + share * (commands.take(ended, axis=1) - start) - commands.take(node, axis=1)
        off = np.zeros((3, len(node)))
        for axis, row, follow in follows:
            off[row] += (follow[node] if len(follow) > 1 else follow) * short[axis]
        square: Array = largest(off[0] * off[0] + off[1] * off[1] + off[2] * off[2], inner)
        return np.sqrt(square)

    @cached_property
    def _columns(self) -> tuple[Array, list[tuple[int, int, Array]]]:
        """Commands as columns (n_axes, k), and the non-zero derivatives of the tip: axis, direction, values."""
        axes, rows = np.nonzero(self.follow.any(axis=0).T)
        follows = [(j, i, self.follow[:, i, j].copy()) for j, i in zip(axes.tolist(), rows.tolist(), strict=True)]
        return np.ascontiguousarray(self.command.T), follows

    def shape(self, first: Index, last: Index) -> tuple[Mask, Array]:
        """No piece is an arc."""
        return np.zeros(len(first), dtype=bool), np.full((len(first), 3), np.nan)


def fewest(grid: Splittable, tolerance: float) -> tuple[Mask, Array]:
    """(k,) the nodes at which pieces end, and (g,) the largest deviation of the pieces of each motion, mm.

    A piece from a node to the next is always allowed, because no node lies between.
    """
    if core.engaged() and isinstance(grid, PathNodes):
        from ncfix.core import motions as loops

        nodes, motions = np.zeros(len(grid.fraction), dtype=bool), np.zeros(len(grid.counts))
        follow = np.ascontiguousarray(grid.follow)
        own = nodes.view(np.uint8)
        loops.fewest(grid.counts, grid.fraction, grid.command, follow, tolerance, STRETCH, own, motions)
        return nodes, motions
    stretches, at, stop = _stretches(grid.counts)
    ends = np.zeros(int(grid.counts.sum()), dtype=bool)
    worst = np.zeros(len(at))
    near, far, reached = at + 1, stop + 1, np.zeros(len(at))
    usual = np.ones(len(at), dtype=np.intp)
    step, fresh = usual.copy(), np.ones(len(at), dtype=bool)
    active = np.arange(len(at))
    while active.size:
        trial = _next_trial(at[active], near[active], far[active], stop[active], step[active])
        settled = (trial <= near[active]) | (near[active] >= stop[active])
        trying, trial = active[~settled], trial[~settled]
        off = grid.deviations(at[trying], trial)
        good = off <= tolerance
        near[trying[good]], reached[trying[good]] = trial[good], off[good]
        far[trying[~good]] = trial[~good]
        step[trying] = np.where(fresh[trying], 1, 2 * step[trying])
        fresh[trying] = False
        done = active[settled]
        ends[near[done]] = True
        worst[done] = np.maximum(worst[done], reached[done])
        usual[done] = np.maximum(near[done] - at[done] - 1, 1)
        at[done], reached[done], far[done], step[done], fresh[done] = near[done], 0.0, stop[done] + 1, usual[done], True
        near[done] = np.minimum(at[done] + 1, stop[done])
        active = active[at[active] < stop[active]]
    return ends, largest(worst, stretches)


def _stretches(counts: Index) -> tuple[Index, Index, Index]:
    """(g,) number of stretches of motions with `counts` (g,) nodes, and the first and last node of each stretch."""
    many = np.maximum((counts - 1) // STRETCH, 1)
    begin = offsets(counts)[:-1][owners(many)] + places(many) * STRETCH
    end = begin + STRETCH
    end[offsets(many)[1:] - 1] = offsets(counts)[1:] - 1
    return many, begin, end


def _next_trial(at: Index, near: Index, far: Index, stop: Index, step: Index) -> Index:
    """The next ends to try for pieces from nodes `at`, between `near`, which is good, and `far`, which is not.

    `far` behind the last node `stop` means that no end has failed yet.
    """
    half = (near + far) // 2
    back = np.where(near > at + 1, half, np.maximum(far - step, half))
    return np.where(far > stop, np.minimum(near + step, stop), back)


WIDEST = 0.95 * np.pi
"""Largest turn, rad, of an arc piece: ends on opposite sides of a circle would not determine its centre."""
SHORTEST = 0.05
"""Least distance, mm, between the ends of an arc piece."""

JUMP = 2.0
"""Largest chord of an arc piece, as a multiple of its way along the arc. A longer one only takes up a jump (play, a
step), and is straight."""


OTHER_CODES = 1000
"""Least motion code, in tenths, that is not a G code."""


def may_be_round(intent: Intent, rows: Index, closure: Closure, rounding: float) -> Mask:
    """(k,) whether motions `rows` are arcs that may be split into arcs.

    The difference of radii by rounding must be within half of what the control accepts. Arcs that are not given by a
    centre or radius (CIP, whose code is none of G0 to G99) stay whole or become straight pieces, unless they can be
    written with another code.
    """
    moves, radius = intent.moves, radii(intent, rows)
    allowed = np.maximum(closure.mm, closure.relative * radius) / 2
    enough: Mask = intent.segments.arc[rows] & (radius > SHORTEST) & (4 * rounding <= allowed)
    enough &= (moves.modal[rows] < OTHER_CODES) | np.isin(moves.modal[rows], list(TANGENTIAL))
    return enough if APART * rounding < SHORTEST else np.zeros(len(rows), dtype=bool)


def radii(intent: Intent, rows: Index) -> Array:
    """(k,) the radius of each arc of motions `rows`, mm."""
    moves = intent.moves
    spoke = moves.end[rows[:, None], intent.columns] - moves.centre[rows]
    return np.linalg.norm(across(spoke, moves.normal[rows]), axis=1)


@frozen
class RoundGrid:
    """The nodes of arcs that are split into arcs.

    grid     the nodes
    normal   (k, 3) normal of each node's motion
    sweep    (k,) sweep of each node's motion, rad
    radius   (k,) radius of each node's motion, mm
    columns  (3,) columns of X, Y and Z
    """

    grid: PathNodes
    normal: Array
    sweep: Array
    radius: Array
    columns: Index

    @classmethod
    def of(cls, grid: PathNodes, intent: Intent, rows: Index) -> RoundGrid:
        """The nodes of motions `rows`, which are all arcs."""
        move, moves = rows[owners(grid.counts)], intent.moves
        return cls(grid, moves.normal[move], moves.sweep[move], radii(intent, move), intent.columns)

    @property
    def counts(self) -> Index:
        """(g,) number of nodes of each motion."""
        return self.grid.counts

    def deviations(self, first: Index, last: Index) -> Array:
        """(p,) the largest deviation of pieces from nodes `first` to nodes `last`, mm; inf beyond `WIDEST`."""
        inner = last - first - 1
        arcs, share = self._between(first, last)
        off = self._off(arcs, first + 1, inner, share)
        straight = np.sqrt(np.einsum("ki,ki->k", off, off))
        worst = largest(straight, inner)
        wide = np.abs(self._turn(first, last)) > WIDEST
        return np.where(wide & (inner > 0), np.inf, worst)

    def shape(self, first: Index, last: Index) -> tuple[Mask, Array]:
        """See `Splittable.shape`."""
        arcs, _ = self._between(first, last)
        return arcs.arc, arcs.centre

    def _turn(self, first: Index, last: Index) -> Array:
        return self.sweep[first] * (self.grid.fraction[last] - self.grid.fraction[first])

    def _between(self, first: Index, last: Index) -> tuple[Segments, Array]:
        """The pieces from nodes `first` to nodes `last`, and the fractions (flat) of each at its inner nodes."""
        command, fraction = self.grid.command, self.grid.fraction
        inner = last - first - 1
        piece = owners(inner)
        node = first[piece] + 1 + places(inner)
        share = (fraction[node] - fraction[first[piece]]) / (fraction[last[piece]] - fraction[first[piece]])
        start, end, normal = command[first], command[last], self.normal[first]
        turn = self._turn(first, last)
        ends = start[:, self.columns], end[:, self.columns]
        chord = across(ends[1] - ends[0], normal)
        length = np.linalg.norm(chord, axis=1)
        arc = (length >= SHORTEST) & (np.abs(turn) <= WIDEST) & (length < JUMP * self.radius[first] * np.abs(turn))
        way = vector_product(normal, chord) / np.maximum(length, 1e-300)[:, None]
        height = length / 2 / np.tan(np.where(arc, turn, 1.0) / 2)
        pieces = _on_bisector(Segments(start, end, arc, ends[0], normal, turn, self.columns), way, height)
        here = pieces.at(piece, share)
        nudged = _on_bisector(pieces, way, height + NUDGE).at(piece, share)
        slope = (nudged - here)[:, self.columns] / NUDGE
        squares = sums(np.einsum("ki,ki->k", slope, slope), inner)
        miss = (command[node] - here)[:, self.columns]
        amount = sums(np.einsum("ki,ki->k", slope, miss), inner) / np.maximum(squares, 1e-12)
        best = _on_bisector(pieces, way, height + np.where(squares > 0, amount, 0.0))
        same = best.sweep * turn > 0
        return replace(best, arc=best.arc & same, centre=np.where(same[:, None], best.centre, np.nan)), share

    def _off(self, pieces: Segments, first: Index, inner: Index, share: Array) -> Array:
        piece = owners(inner)
        node = first[piece] + places(inner)
        command = pieces.at(piece, share) - self.grid.command[node]
        follow = self.grid.follow
        return np.einsum("kij,kj->ki", follow[node] if len(follow) > 1 else follow, command)


def _on_bisector(pieces: Segments, way: Array, height: Array) -> Segments:
    """The pieces with their centres `height` (p,) mm from the middle of the chord along unit vectors `way` (p, 3)."""
    start, end = pieces.start[:, pieces.columns], pieces.end[:, pieces.columns]
    rise = np.einsum("ij,ij->i", end - start, pieces.normal)[:, None] * pieces.normal
    centre = (start + end - rise) / 2 + height[:, None] * way
    sweep = sweep_between(start, end, centre, pieces.normal, pieces.sweep)
    return replace(pieces, centre=np.where(pieces.arc[:, None], centre, np.nan), sweep=sweep)


PER_BEND = 8
"""Number of nodes for each time that the error may bend."""
PER_PIECE = 32
"""Number of nodes for each expected piece; the length of a piece is optimal to one part in this number."""
FEW = 14
"""Average number of nodes per piece below which the grid is refined."""
SPARSE = 4
"""Average number of nodes per piece below which the pieces have not been examined closely enough."""
REFINEMENTS = 3
INSTANT = 1e-7
"""Fraction of a motion from one side of a jump or reversal to the other."""
BATCH = 100_000
"""Number of nodes worked on at a time."""


@frozen
class Split:
    """The pieces of motions, flat, motion after motion.

    counts    (g,) number of pieces of each motion
    fraction  (p,) fraction of the motion at which the piece ends
    end       (p, n_axes) command at the end of the piece
    arc       (p,) the piece is an arc
    centre    (p, 3) centre of an arc, mm
    worst     (g,) largest deviation of the tip along the pieces, mm
    """

    counts: Index
    fraction: Array
    end: Array
    arc: Mask
    centre: Array
    worst: Array


@frozen
class Cutter:
    """The conditions by which motions are split.

    tolerance  largest deviation of the tip between the ends of a piece, mm
    round      split arcs into arcs; else into straight pieces
    """

    strategy: Strategy
    tolerance: float
    round: bool = False


def split(intent: Intent, real: Segments, rows: Index, pieces: Array, cutter: Cutter) -> Split:
    """Split motions `rows` (g,) at the fewest places.

    real    the corrected starts and ends of all motions
    pieces  (g,) about how many pieces to expect

    `worst` is infinite for motions that need so many pieces that these cannot be examined in between.
    """
    if not rows.size:
        empty = np.empty(0)
        ends = np.empty((0, intent.moves.end.shape[1]))
        return Split(rows, empty, ends, np.empty(0, dtype=bool), np.empty((0, 3)), empty)
    wished = np.maximum(PER_BEND * bends(intent, rows), PER_PIECE * pieces)
    nodes = np.clip(np.ceil(wished), 2 * PER_PIECE, MOST).astype(np.intp)
    parts = [_split(intent, real, rows[part], nodes[part], cutter) for part in batches(nodes, BATCH)]
    for _ in range(REFINEMENTS):
        result = stacked(parts)
        short = np.flatnonzero((nodes < FEW * result.counts) & (nodes < MOST))
        if not short.size:
            break
        nodes[short] = np.minimum(2 * PER_PIECE * result.counts[short], MOST)
        chosen = [short[part] for part in batches(nodes[short], BATCH)]
        finer = [_split(intent, real, rows[each], nodes[each], cutter) for each in chosen]
        parts = [_replaced(result, short, stacked(finer))]
    result = stacked(parts)
    result.worst[(nodes >= MOST) & (nodes < SPARSE * result.counts)] = np.inf
    return result


def _replaced(result: Split, which: Index, finer: Split) -> Split:
    """`result` with the motions `which` taken from `finer`."""
    order = np.arange(len(result.counts))
    order[which] = len(result.counts) + np.arange(len(which))
    return reordered(stacked([result, finer]), order)


def reordered(parts: Split, order: Index) -> Split:
    """The motions of `parts` in another order."""
    counts = parts.counts[order]
    take = ranges(offsets(parts.counts)[order], counts)
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


def _grid(intent: Intent, real: Segments, rows: Index, nodes: Index, strategy: Strategy) -> PathNodes:
    """The nodes of motions `rows`, with exactly corrected commands; at both ends, those of `real`."""
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
    solved = strategy.solve(intent.machine, q, intent.states(move, fraction), path)
    result = with_rotary_held(intent, strategy, move, fraction, q, solved)
    command = as_commands(intent, move, programmed, q, result.q)
    command[first], command[last] = real.start[rows], real.end[rows]
    command = _as_they_stand(intent, real, move, fraction, command)
    use = result.converged | bounds
    counts = sums(use.astype(np.intp), counts).astype(np.intp)
    if not use.all():
        move, fraction, command = move[use], fraction[use], command[use]
    return PathNodes(counts, fraction, command, _follow(intent, move, command, strategy))


def _as_they_stand(intent: Intent, real: Segments, move: Index, fraction: Array, command: Array) -> Array:
    """Corrected commands (k, n_axes) with axes that get no word as in `real`; X Y Z are solved for such rotary axes."""
    if intent.idle is None:
        return command
    stand, idle = real.at(move, fraction), intent.idle[move]
    result = np.where(idle, stand, command)
    turned = np.flatnonzero((idle & intent.machine.rotary & (stand != command)).any(axis=1))
    if turned.size:
        found, arrived = intent.aimed(move[turned], fraction[turned], result[turned])
        result[turned[arrived]] = np.where(idle[turned], result[turned], found)[arrived]
    return result


def _fractions(intent: Intent, real: Segments, rows: Index, nodes: Index) -> tuple[Index, Array]:
    """The fractions of the nodes of motions, including both ends: counts (g,) and flat fractions.

    There are evenly spaced nodes, one right behind the start, and nodes on both sides of each place at which the
    corrected axes pass a kink or a jump, or reverse if an error depends on direction.
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
    """(k or 1, 3, n_axes) derivative of the tip by commands (k, n_axes) of motions `rows`, mm per mm and mm per rad.

    Only the size of a deviation matters, so any frame will do. If X, Y and Z are carried together and only they are
    corrected, the frame in which they move is taken, and one row is valid for all. Under tool-centre-point control the
    tip does not move with rotary commands.
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
