"""What there is to say when a program has been followed, the same for all languages."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.control import rollover
from ncfix.control.control import Control
from ncfix.control.moves import Kind, Moves, Rule, Trace
from ncfix.diagnostics import SourceError, UsageError
from ncfix.text import stamp
from ncfix.text.tree import Program

FAR = 1e9
"""mm or rad; no machine goes farther from zero, and sums of such numbers do not tell micrometres apart."""
TOO_FAR = "NCF248"


def check_reach(program: Program, moves: Moves) -> None:
    """Raise SourceError at the first motion that leads farther away than any machine goes."""
    far, arcs = _are_far(moves.end), np.flatnonzero(moves.kind == Kind.ARC)
    far[arcs] |= _are_far(moves.centre[arcs])
    rows = np.flatnonzero(far & (moves.rule != Rule.REFUSE))
    if rows.size:
        text = "this leads farther away than any machine goes (1e9 mm or radians)"
        raise SourceError.of(TOO_FAR, text, program.place(int(moves.block[rows[0]])), "check the numbers of the block")


def _are_far(places: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) which of (n, k) places are too far away."""
    rows = np.zeros(len(places), dtype=np.bool_)
    if not places.size or max(places.max(), -places.min()) <= FAR:
        return rows
    rows[np.flatnonzero(np.abs(places) > FAR) // places.shape[1]] = True
    return rows


def finished(control: Control, program: Program, moves: Moves) -> Trace:
    """The trace of a program; raises UsageError with all that was not given."""
    check_reach(program, moves)
    rollover.say(control, program)
    lacking = (*control.foreign.values(), *control.knowledge.missing.values())
    if lacking:
        raise UsageError.collected(lacking)
    marked = stamp.find(program)
    return Trace(
        moves=moves,
        messages=rollover.remarks(control),
        assumed=tuple(control.knowledge.assumed),
        stamp="" if marked is None else program.text_of(marked),
        switches=frozenset(control.switches),
    )
