"""Proof before writing: the new text says what the plan meant, and what the plan means for the path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ncfix.compensate.block_delete import Readings, Together
from ncfix.compensate.plan.arcs import across
from ncfix.compensate.plan.arrays import Array, Index, Mask, every, picked
from ncfix.compensate.settle import Settled
from ncfix.control.moves import Moves, Trace
from ncfix.diagnostics import NcfixError
from ncfix.text.reader import read
from ncfix.text.tree import Program
from ncfix.writer.second_reading import SecondReading

SAME = 1e-6
"""mm and rad; the emitter's book and a second reading differ by floating-point noise only."""
STRAY = 1.0
"""mm and rad; more than earlier corrections can shift a motion that is kept (or `STRAYS` times the largest of them)."""
STRAYS = 10.0
TURN = 1.0
"""rad; a corrected arc turns by what it did but for little, or else by a full turn more or less."""
ATTEMPTS = 16
"""The second attempt knows the frames that moved with the first, each further one a frame that depends on others."""

Attempt = Callable[[Readings], tuple[Together, bytes]]
Follow = Callable[[Program], Trace]


class SelfCheckError(Exception):
    """The text that was written does not mean what was planned: a fault of ncfix. Nothing may be written."""


@dataclass(frozen=True, slots=True)
class Proven:
    """A text that a second reading has confirmed in each position of block delete, and what was settled for each."""

    text: bytes
    together: Together


def proven(program: Program, attempt: Attempt, follows: Sequence[Follow]) -> Proven:
    """Write, read what was written, and write again with what the reading taught, until both agree.

    attempt  settles and writes, given what a control made of the last attempt in each position of block delete
    follows  traces a program, in each of them

    Raises `SelfCheckError` if they never agree.
    """
    readings: Readings = [None] * len(follows)
    for _ in range(ATTEMPTS):
        together, text = attempt(readings)
        if text == program.source:
            return Proven(text, together)
        pairs = [
            (own, _followed(program, text, own, follow)) for own, follow in zip(together.settled, follows, strict=True)
        ]
        wrong = [_wrong(*each) for each in pairs]
        if not any(each.any() for each in wrong):
            return Proven(text, together)
        readings = [SecondReading.of(again, own.plan.pieces) for own, again in pairs]
    at = next(k for k, each in enumerate(wrong) if each.any())
    raise SelfCheckError(_what_is_wrong(program, *pairs[at], int(np.argmax(wrong[at]))))


def _wrong(settled: Settled, again: Moves) -> Mask:
    wrong = differences(settled, again)
    assert wrong is not None, "the numbers of motions have been compared"
    return wrong


def _what_is_wrong(program: Program, settled: Settled, again: Moves, piece: int) -> str:
    """Where a piece would lead, and was not meant to."""
    move = int(settled.plan.pieces.move[piece])
    line = program.line(int(settled.moves.block[move]))
    meant = settled.moves.end[move] if settled.plan.pieces.kept[piece] else settled.emission.end[piece]
    return f"line {line} would lead to {again.end[piece]}, not to {meant}"


def _followed(program: Program, text: bytes, settled: Settled, follow: Follow) -> Moves:
    try:
        again = follow(read(text, program.path, program.dialect)).moves
    except NcfixError as error:
        raise SelfCheckError(f"the corrected program cannot be read: {error}") from error
    pieces = settled.plan.pieces
    if len(again) != len(pieces):
        raise SelfCheckError(f"the corrected program has {len(again)} motions, {len(pieces)} were written")
    return again


def differences(settled: Settled, again: Moves, own: Mask | None = None) -> Mask | None:
    """Pieces that the control would understand otherwise than they were meant; None if their number differs.

    own  (m,) pieces that stand in the text that was read; all if not given
    """
    emission, pieces = settled.emission, settled.plan.pieces
    rows = np.arange(len(pieces)) if own is None else np.flatnonzero(own)
    if len(again) != len(rows):
        return None
    meant = emission.end if own is None else picked(emission.end, rows)
    differs: Mask = differ(again.end, meant) | _strayed(settled, again, rows)
    if not pieces.arc.any():
        return differs
    arcs = np.flatnonzero((pieces.arc & ~pieces.kept)[rows])
    if not arcs.size:
        return differs
    off = again.centre[arcs] - emission.centre[rows[arcs]]
    off[np.isnan(again.centre[arcs]) & np.isnan(emission.centre[rows[arcs]])] = 0.0
    off = across(off, again.normal[arcs])  # the height of a centre means nothing
    differs[arcs[differ(off, np.zeros_like(off))]] = True
    differs[arcs] |= np.abs(again.sweep[arcs] - _sweeps(settled)[rows[arcs]]) > TURN
    return differs


def _sweeps(settled: Settled) -> Array:
    """(m,) about how far each piece of an arc turns, rad: its share of what its motion does."""
    pieces = settled.plan.pieces
    before = np.where(np.diff(pieces.move, prepend=-1) == 0, np.append(0.0, pieces.fraction[:-1]), 0.0)
    sweep: Array = settled.moves.sweep[pieces.move] * (pieces.fraction - before)
    return sweep


def _strayed(settled: Settled, again: Moves, rows: Index) -> Mask:
    """Motions that are kept, and that the new text leads elsewhere: what they rely on was not kept."""
    pieces, ends = settled.plan.pieces, settled.moves.end
    if not pieces.kept.any():
        return np.zeros(len(rows), dtype=bool)
    kept = pieces.kept[rows]
    own = np.flatnonzero(kept)
    off = np.abs(again.end[own] - ends[pieces.move[rows[own]]])
    if not (off > STRAY).any():
        return np.zeros_like(kept)
    last = np.flatnonzero(pieces.fraction == 1)
    shifts = np.abs(picked(pieces.end, last) - picked(ends, pieces.move[last]))
    most = max(STRAY, STRAYS * float(np.max(shifts[np.isfinite(shifts)], initial=0.0)))
    kept[own] = (off > most).any(axis=1)
    return kept


def differ(found: Array, meant: Array) -> Mask:
    """Rows of commands (m, n_axes) that are not the same but for noise."""
    with np.errstate(invalid="ignore"):
        off = found - meant
        same = np.asarray(np.abs(off, out=off) <= SAME)
    if not same.all():
        same = same | (found == meant) | (np.isnan(found) & np.isnan(meant))
    return ~every(same)
