"""Proof before writing: the new text says what the plan meant, and what the plan means for the path."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ncfix.compensate.findings import Array, Mask
from ncfix.compensate.settle import Settled
from ncfix.diagnostics import SourceError
from ncfix.program.moves import Trace
from ncfix.program.reader import read
from ncfix.program.tree import Program

SAME = 1e-6
"""mm and rad; the emitter's book and a second reading differ by floating-point noise only."""


class SelfCheckError(Exception):
    """The text that was written does not mean what was planned: a fault of ncfix. Nothing may be written."""


def check_reading(program: Program, text: bytes, settled: Settled, follow: Callable[[Program], Trace]) -> None:
    """Read and follow the new text, and compare it with the plan; raises `SelfCheckError`."""
    try:
        again = follow(read(text, program.path, program.dialect)).moves
    except SourceError as error:
        raise SelfCheckError(f"the corrected program cannot be read: {error}") from error
    emission, pieces = settled.emission, settled.plan.pieces
    if len(again) != len(pieces):
        raise SelfCheckError(f"the corrected program has {len(again)} motions, {len(pieces)} were written")
    differs = _differs(again.end, emission.end)
    arcs = np.flatnonzero(pieces.arc & ~pieces.kept)
    in_plane = np.where(np.abs(again.normal[arcs]) < 0.5, 1.0, np.nan)
    differs[arcs] |= _differs(again.centre[arcs] * in_plane, emission.centre[arcs] * in_plane)
    if differs.any():
        piece = int(np.argmax(differs))
        line = program.line(int(settled.moves.block[pieces.move[piece]]))
        raise SelfCheckError(f"line {line} would lead to {again.end[piece]}, not to {emission.end[piece]}")


def _differs(found: Array, meant: Array) -> Mask:
    same: Mask = np.isclose(found, meant, rtol=0, atol=SAME, equal_nan=True).all(axis=1)
    return ~same
