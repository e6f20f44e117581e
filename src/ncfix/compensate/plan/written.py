"""Corrected motions as they are written: the geometry of their pieces, and what the control's digits make of them.

Rotary positions are put on the digits that will be written, and X Y Z are solved again: a rotary axis resolves 0.001
degree, say, which is 1.7 um at 100 mm. Pieces that do not move once their numbers are rounded would be blocks without a
word. They come where an error jumps: a motion is cut on both sides of the jump, 1e-7 of its length apart, and what has
to change there may be less than the digits show; then both pieces end in the same place.

What rounding does to the path is an account of its own, on top of the tolerance. Every number is off by up to half an
output step. At the end of a motion that is half a step in each linear axis. On the way of an arc its centre is off,
too: in the middle of a turn by `a` that counts 1 - cos(a / 2) times, twice on a full circle. Where a rotary axis turns
the tool stands on another arm between the ends of a piece than at them, and half a step of the axis counts by what the
arm has changed.
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
    """Pieces on a program on a machine.

    start  (n, n_axes) the command at which each motion really starts; NaN where not known
    """

    intent: Intent
    pieces: Pieces
    start: Array

    @cached_property
    def before(self) -> Array:
        """The fraction of the motion at which each piece starts, (m,)."""
        return self.pieces.begun

    @cached_property
    def span(self) -> Array:
        """The part of the motion that each piece covers, (m,)."""
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
        """Axis positions at fractions of pieces, (k, n_axes)."""
        return self.intent.joints(self.pieces.move[piece], self.segments.at(piece, fraction))

    @cached_property
    def programmed(self) -> Array:
        """The axis positions of the program at the end of each piece, (m, n_axes) mm and rad."""
        return self.intent.joints_at(self.pieces.move, self.pieces.fraction)

    @property
    def done(self) -> Array:
        """The axis positions at the end of each piece, (m, n_axes) mm and rad."""
        return self.ends[1]

    @cached_property
    def ends(self) -> tuple[Array, Array]:
        """The axis positions where each piece starts and where it ends, (m, n_axes) mm and rad."""
        return self.intent.ends_of(self.pieces.move, self.segments)

    @cached_property
    def correction(self) -> Array:
        """What is added to the axis positions of the program at the end of each piece, (m, n_axes) mm and rad."""
        return self.done - self.programmed


TURN_DEGREES = 360.0
TURNED = 1e-12
"""rad; a rotary axis that is so close to its number in the program stands there."""


@frozen
class Known:
    """Ends of motions, found by bringing the tip there on the exact model.

    before  (n,) mm: how far off the tip is without correction; NaN where that is not known
    end     (n, n_axes) commands at which it is where it should be, to 1 nm
    beside  (n, n_axes) mm: how far axes that get no word are at most from where they should be on the way there; 0 for
            all others. None: there are none
    """

    before: Array
    end: Array
    beside: Array | None = None

    def at(self, written: WrittenPieces, piece: Index) -> tuple[Mask, Array, Array]:
        """Which of these pieces (k,) end where errors are known, and these: before and after (k,) mm.

        After a correction what is off is what the numbers that were written differ from those that were meant, as the
        linear axes take the tip. The errors change on that way by less than a thousandth of it.
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
        here = np.isfinite(before) & (pieces.fraction[piece] == 1) & straight
        here[lacking(intent, move)] = False
        shift = off[:, intent.columns] @ ways.T
        return here, before, np.sqrt(np.einsum("ij,ij->i", shift, shift))


HeldAngle = Callable[[str, float, float, float], float]
"""A rotary axis, its angle as programmed and as corrected, and one digit -> what the control may be told, degrees."""


def on_digits(intent: Intent, pieces: Pieces, among: Index | None = None, held: HeldAngle | None = None) -> Pieces:
    """The pieces with rotary positions as they will be written; those that the program wrote stay as they are.

    among  (k,) pieces that may have others; all if not given
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
    """Corrected angles (n, n_rotary), rad, as the control may be told them; `programmed`: without correction."""
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
    """Straight pieces with a rotary position that the program does not have as a number of its own."""
    turned = some((picked(pieces.end, among) != picked(moves.end, pieces.move[among]))[:, moves.rotary])
    return among[turned & ~pieces.unchanged[among] & ~pieces.arc[among]]


def _rounded(angle: Array, machine: Machine) -> Array:
    """Angles (rad) rounded to the decimals (of degrees) that the least increment needs."""
    decimals = decimals_for(float(np.degrees(machine.least_increment[1])))
    return np.radians(np.round(np.degrees(angle), decimals))


def without_idle(moves: Moves, pieces: Pieces, emission: Emission, first: int = 0) -> Pieces:
    """The pieces without those that do not move as they were written; the same object if there are none.

    first  the motion from which on pieces were written
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
    begins = np.append(0, left[:-1] + 1)  # the time of a piece goes to the next one that is left, of the same motion
    return replace(chosen, share=np.add.reduceat(pieces.share, begins))


def standing_still(pieces: Pieces, end: Array, start: Array, first: int = 0) -> Mask:
    """(m,) straight pieces that another one of their motion can stand for: it goes on from where they begin.

    end, start  (m, n_axes), (n, n_axes) commands at the ends of pieces and at the starts of motions, as written
    first       the motion from which on pieces were written
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


def rounding_along(intent: Intent, pieces: Pieces, corners: float, own: Mask | None = None) -> float:
    """How far the tip may be off along corrected motions because numbers are rounded, mm; 0 where there are none.

    corners  what it may do at corners that the control offsets, in half output steps
    own      (n,) motions that count; all if not given
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
    """How far the tip may be off along arcs that turn by `sweep` (k,) rad, mm: their ends and centres are rounded."""
    half, bend = 0.5 * machine.least_increment[0], 1 - np.cos(np.minimum(np.abs(sweep), 2 * np.pi) / 2)
    in_plane = 2**0.5 + CENTRE * float(bend.max(initial=0.0))
    return max(half * float(np.hypot(in_plane, 1.0)), rounding(machine))


def _turns(moves: Moves, pieces: Pieces, rows: Index) -> Array:
    """By how much arcs among pieces turn, (k,) rad: each by its share of its motion."""
    return moves.sweep[pieces.move[rows]] * (pieces.fraction[rows] - pieces.begun[rows])


def _rounding_of_turns(intent: Intent, pieces: Pieces, rows: Index) -> float:
    """What rounded rotary positions do between the ends of pieces `rows` (k,), mm.

    Only without tool-centre-point control: with it the tip stays where it is while the axes turn.
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
