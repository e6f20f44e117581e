"""Corrected motions as they are written: the geometry of their pieces, and the effect of rounding to output steps.

Rotary positions are rounded to the digits that will be written, and X Y Z are solved again: a rotary axis may resolve
0.001 degree, which is 1.7 um at 100 mm. Pieces that do not move after rounding would be blocks without a word, and are
removed. They occur where an error jumps: a motion is split on both sides of the jump, 1e-7 of its length apart, and the
jump may be smaller than an output step.

The effect of rounding on the path comes on top of the tolerance. Every number is off by up to half an output step. At
the end of a motion, that is half a step in each linear axis. The centre of an arc is off, too: in the middle of an arc
of angle a, the path is off by the error of the centre times 1 - cos(a / 2), twice the error on a full circle. If a
rotary axis turns during a piece, the lever arm of the tool differs from that at the ends, and the path is off by half a
step of the axis times the change of this arm.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from itertools import product

import numpy as np

from ncfix.arrays import Array, Index, Mask, finite, greatest, lengths, picked, put, some
from ncfix.compensate.plan.intent import Intent, lacking
from ncfix.compensate.plan.sampling import reach
from ncfix.compensate.plan.segments import Segments, sweep_between
from ncfix.control.moves import MotionKind, Moves
from ncfix.machine import Machine
from ncfix.text.spelling import decimals_for
from ncfix.values import frozen
from ncfix.writer.emit import Emission
from ncfix.writer.pieces import Pieces


@frozen(slots=False)
class WrittenPieces:
    """The corrected pieces of the motions of a program on a machine.

    start  (n, n_axes) the command at which each motion really starts; NaN if not known
    """

    intent: Intent
    pieces: Pieces
    start: Array

    @cached_property
    def before(self) -> Array:
        """(m,) the fraction of its motion at which each piece starts."""
        return self.pieces.begun

    @cached_property
    def span(self) -> Array:
        """(m,) the fraction of its motion that each piece covers."""
        return self.pieces.fraction - self.before

    @cached_property
    def segments(self) -> Segments:
        """The pieces as the control interpolates them."""
        pieces, moves = self.pieces, self.intent.moves
        start = np.empty_like(pieces.end)
        start[1:] = pieces.end[:-1]
        first = pieces.first
        put(start, first, picked(self.start, pieces.move[first]))
        normal, sweep = picked(moves.normal, pieces.move), moves.sweep[pieces.move] * self.span
        arc = pieces.arc.copy()
        arc[arc] = finite(pieces.centre[arc])
        columns = self.intent.columns
        found = sweep.copy()
        found[arc] = sweep_between(
            start[arc][:, columns], pieces.end[arc][:, columns], pieces.centre[arc], normal[arc], sweep[arc]
        )
        return Segments(start, pieces.end, arc, pieces.centre, normal, found, columns)

    def joints(self, piece: Index, fraction: Array) -> Array:
        """(k, n_axes) axis positions at fractions (k,) of pieces (k,)."""
        return self.intent.joints(self.pieces.move[piece], self.segments.at(piece, fraction))

    @cached_property
    def programmed(self) -> Array:
        """(m, n_axes) programmed axis positions at the end of each piece, mm and rad."""
        return self.intent.joints_at(self.pieces.move, self.pieces.fraction)

    @property
    def done(self) -> Array:
        """(m, n_axes) corrected axis positions at the end of each piece, mm and rad."""
        return self.ends[1]

    @cached_property
    def ends(self) -> tuple[Array, Array]:
        """(m, n_axes) corrected axis positions at the start and at the end of each piece, mm and rad."""
        return self.intent.ends_of(self.pieces.move, self.segments)

    @cached_property
    def correction(self) -> Array:
        """(m, n_axes) corrected minus programmed axis positions at the end of each piece, mm and rad."""
        return self.done - self.programmed


TURN_DEGREES = 360.0
TURNED = 1e-12
"""Difference, rad, up to which a rotary axis stands at its intended position."""


@frozen
class Known:
    """Tip errors at the ends of motions, known from their correction on the exact model.

    before  (n,) tip error without correction, mm; NaN if not known
    end     (n, n_axes) commands at which the tip is at its intended place, to 1 nm
    beside  (n, n_axes) largest distance, mm, during the motion, of an axis without a word from its intended place; 0
            for all other axes. None: there are no such axes
    """

    before: Array
    end: Array
    beside: Array | None = None

    def at(self, written: WrittenPieces, piece: Index) -> tuple[Mask, Array, Array]:
        """(k,) whether the tip errors at the ends of pieces (k,) are known, and the errors before and after (k,), mm.

        The error after the correction is the difference between written and meant commands, as the linear axes move the
        tip by it. The errors of the machine change over this way by less than a thousandth of it.
        """
        intent, pieces = written.intent, written.pieces
        move = pieces.move[piece]
        machine, ways = intent.machine, intent.machine.linear_ways
        before = self.before[move]
        if ways is None:
            return np.zeros(len(piece), dtype=bool), before, before
        off = picked(pieces.end, piece) - picked(self.end, move)
        turned = greatest(np.abs(off[:, machine.rotary]))
        straight = (intent.moves.kind[move] != MotionKind.ARC) & (turned <= TURNED)
        known = np.isfinite(before) & (pieces.fraction[piece] == 1) & straight
        known[lacking(intent, move)] = False
        shift = off[:, intent.columns] @ ways.T
        return known, before, np.sqrt(np.einsum("ij,ij->i", shift, shift))


HeldAngle = Callable[[str, float, float, float], float]
"""(axis letter, programmed angle, corrected angle, one digit) -> angle that may be written for the control, degrees."""


def on_digits(intent: Intent, pieces: Pieces, among: Index | None = None, held: HeldAngle | None = None) -> Pieces:
    """The pieces with rotary positions rounded as they will be written, and X Y Z solved for them.

    Positions that are those of the program stay as they are.

    among  (k,) the pieces to round; None: all
    held   chooses the angle that may be written beyond 0 to 360 degrees, see `WrittenLanguage.held_angle`
    """
    machine, moves = intent.machine, intent.moves
    rows = _newly_written(moves, pieces, np.arange(len(pieces)) if among is None else among)
    if not rows.size:
        return pieces
    move = pieces.move[rows]
    commands, fraction = picked(pieces.end, rows), pieces.fraction[rows]
    offset = np.array([frame.offset for frame in moves.frames])[moves.frame[move]][:, moves.rotary]
    angles = _rounded(commands[:, moves.rotary] - offset, machine)
    if held is not None:
        start, end = (picked(places, move)[:, moves.rotary] - offset for places in (moves.start, moves.end))
        angles = _held(moves, start + fraction[:, None] * (end - start), angles, machine, held)
    commands[:, moves.rotary] = offset + angles
    solved, arrived = intent.aimed(move, fraction, commands)
    end = pieces.end.copy()
    solved = np.where(moves.wordless[move], end[rows], solved)
    end[rows[arrived]] = solved[arrived]
    return replace(pieces, end=end)


def _held(moves: Moves, programmed: Array, angles: Array, machine: Machine, held: HeldAngle) -> Array:
    """(n, n_rotary) corrected angles, rad, as they may be written; `programmed` (n, n_rotary): without correction."""
    digit = 10.0 ** -decimals_for(float(np.degrees(machine.least_increment[1])))
    letters = [axis for axis, turns in zip(moves.axes, moves.rotary, strict=True) if turns]
    told, nominal, found = np.degrees(angles), np.degrees(programmed), angles.copy()
    for row, column in np.argwhere((told < 0.0) | (told >= TURN_DEGREES)).tolist():
        before, after = float(nominal[row, column]), float(told[row, column])
        angle = held(letters[column], before, after, digit)
        if angle != after:
            found[row, column] = np.radians(angle)
    return found


def _newly_written(moves: Moves, pieces: Pieces, among: Index) -> Index:
    """The straight pieces `among` (k,) with a rotary position that differs from that of the program."""
    turned = some((picked(pieces.end, among) != picked(moves.end, pieces.move[among]))[:, moves.rotary])
    return among[turned & ~pieces.unchanged[among] & ~pieces.arc[among]]


def _rounded(angle: Array, machine: Machine) -> Array:
    """Angles, rad, rounded to the decimals of degrees that the least increment needs."""
    decimals = decimals_for(float(np.degrees(machine.least_increment[1])))
    return np.radians(np.round(np.degrees(angle), decimals))


def without_idle(moves: Moves, pieces: Pieces, emission: Emission, first: int = 0) -> Pieces:
    """The pieces without those that do not move once rounded; the same object if there are none.

    first  the first motion whose pieces were written
    """
    if len(pieces) == len(moves):
        return pieces
    drop = standing_still(pieces, emission.end, emission.start, first)
    if not drop.any():
        return pieces
    left = np.flatnonzero(~drop)
    chosen = pieces.rows(left)
    if pieces.share is None:
        return chosen
    begins = np.append(0, left[:-1] + 1)  # the time of a removed piece goes to the next piece of its motion
    return replace(chosen, share=np.add.reduceat(pieces.share, begins))


def standing_still(pieces: Pieces, end: Array, start: Array, first: int = 0) -> Mask:
    """(m,) straight pieces that can be left out: they do not move, or the last piece of the motion, next, does not.

    end, start  (m, n_axes), (n, n_axes) commands at the ends of pieces and at the starts of motions, as written
    first       the first motion whose pieces were written
    """
    found = np.zeros(len(pieces), dtype=bool)
    goes_on = pieces.move[1:] == pieces.move[:-1]
    rows = np.flatnonzero(np.append(goes_on, False) | np.append(False, goes_on))
    if not rows.size:
        return found
    move, end = pieces.move[rows], end[rows]
    inner = move[1:] == move[:-1]
    plain = ~(pieces.arc[rows] | pieces.unchanged[rows]) & (move >= first)
    stays = np.zeros(len(rows), dtype=bool)
    stays[1:] = inner & (end[1:] == end[:-1]).all(axis=1)
    begins = np.flatnonzero(np.append(True, ~inner))
    stays[begins] = (end[begins] == start[move[begins]]).all(axis=1)
    last = np.append(~inner, True)
    before_last = np.append(last[1:] & stays[1:] & inner, False)
    found[rows] = plain & ((stays & ~last) | before_last)
    return found


CENTRE = 2.0
"""Largest shift of a centre in its plane by rounding, in half output steps: a centre given by a radius is within one
step of its place; one given by two words, within half a step in each."""


def rounding(machine: Machine) -> float:
    """Largest tip error at the end of a motion by rounding, mm: half an output step in each linear axis."""
    half = 0.5 * machine.least_increment[0]
    ways = np.array([axis.direction for axis in machine.axes if not axis.rotary])
    if not len(ways):
        return 0.0
    corners = np.array(list(product((-1.0, 1.0), repeat=len(ways)))) @ ways
    return float(half * max(lengths(corners).max(), min(len(ways), 3) ** 0.5))


def rounding_along(intent: Intent, pieces: Pieces, corners: float, own: Mask | None = None) -> float:
    """Largest tip error along corrected motions by rounding, mm; 0 if there are none.

    corners  effect of rounding at corners that the control offsets, in half output steps
    own      (n,) the motions to include; None: all
    """
    machine, moves = intent.machine, intent.moves
    rows = np.flatnonzero(~pieces.unchanged & (moves.kind != MotionKind.DWELL)[pieces.move])
    rows = rows if own is None else rows[own[pieces.move[rows]]]
    if not rows.size:
        return 0.0
    arcs = rows[pieces.arc[rows]]
    round_ = rounding_of_arcs(machine, _turns(moves, pieces, arcs)) if arcs.size else 0.0
    at_corners = 0.5 * machine.least_increment[0] * corners
    return max(rounding(machine) + _rounding_of_turns(intent, pieces, rows), round_, at_corners)


def rounding_of_arcs(machine: Machine, sweep: Array) -> float:
    """Largest tip error, mm, by rounding of ends and centres along arcs that turn by `sweep` (k,) rad."""
    half, bend = 0.5 * machine.least_increment[0], 1 - np.cos(np.minimum(np.abs(sweep), 2 * np.pi) / 2)
    in_plane = 2**0.5 + CENTRE * float(bend.max(initial=0.0))
    return max(half * float(np.hypot(in_plane, 1.0)), rounding(machine))


def _turns(moves: Moves, pieces: Pieces, rows: Index) -> Array:
    """(k,) the turn of arc pieces `rows`, rad: each piece's share of the sweep of its motion."""
    return moves.sweep[pieces.move[rows]] * (pieces.fraction[rows] - pieces.begun[rows])


def _rounding_of_turns(intent: Intent, pieces: Pieces, rows: Index) -> float:
    """Largest tip error, mm, by rounding of rotary positions between the ends of pieces `rows` (k,).

    It occurs only without tool-centre-point control: with it, the tip does not move with the rotary axes.
    """
    moves, rotary = intent.moves, intent.machine.rotary
    anew = some((picked(pieces.end, rows) != picked(moves.end, pieces.move[rows]))[:, rotary])
    on = rows[anew & (~moves.tcp | moves.beside_tip)[pieces.move[rows]]]
    if not on.size:
        return 0.0
    most = 0.0
    for each in (on, np.minimum(on + 1, len(pieces) - 1)):  # those that end there, and those that begin there
        move, first = pieces.move[each], pieces.begun[each] == 0
        start = np.where(first[:, None], picked(moves.start, move), picked(pieces.end, np.maximum(each - 1, 0)))
        way = np.nan_to_num(np.abs(picked(pieces.end, each) - start))
        arm = reach(intent, move) * way[:, rotary].sum(axis=1)
        most = max(most, float((lengths(way[:, ~rotary]) + arm).max()))
    return 0.5 * intent.machine.least_increment[1] * float(np.count_nonzero(rotary)) * most / 2
