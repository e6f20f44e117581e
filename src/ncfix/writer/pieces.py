"""Corrected motions as columns: what shall be commanded instead, one row per block piece to be written; and what a
control made of an earlier attempt to write them, which the next one has to know."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.control.moves import Frame, Moves


@dataclass(frozen=True, slots=True)
class Pieces:
    """The corrected path, struct of arrays; m rows in order, at least one per motion.

    A motion that need not be split has one row; a motion that is kept as it was has one row with its original end.

    move      (m,) index of the motion in `Moves`
    fraction  (m,) where on the original motion the piece ends, in (0, 1]; the last piece of a motion has 1
    end       (m, n_axes) the command at the end of the piece, mm and rad, before rounding to the control's digits
    arc       (m,) the piece is an arc (its motion is an arc and stays one), else straight
    centre    (m, 3) centre of an arc piece in command coordinates, mm, NaN elsewhere
    kept      (m,) the motion is left as it was
    share     (m,) the piece's share of its motion's time, for inverse-time feed; None: that of the fraction. They
              differ for pieces that only take up a jump (play, a step): these have next to no fraction, but a way
    approach  (m, n_axes) of canned cycles: the command at the level R, as `Moves.approach`; None: nowhere
    """

    move: NDArray[np.int64]
    fraction: NDArray[np.float64]
    end: NDArray[np.float64]
    arc: NDArray[np.bool_]
    centre: NDArray[np.float64]
    kept: NDArray[np.bool_]
    share: NDArray[np.float64] | None = None
    approach: NDArray[np.float64] | None = None

    def __len__(self) -> int:
        return len(self.move)

    @property
    def known(self) -> NDArray[np.bool_]:
        """(m,) the command at the end is known in all axes."""
        finite = np.isfinite(self.end)
        return np.ones(len(self), dtype=np.bool_) if finite.all() else np.asarray(finite.all(axis=1))


@dataclass(frozen=True, slots=True)
class SecondReading:
    """What a control made of an earlier attempt, one row per motion of the original.

    A program may set its frames where the machine stands (G92, G10 L20): then they move with the corrections.

    frame, frames  (n,) index into `frames`: the frame in which each motion is really read
    start, end     (n, n_axes) where motions that are kept really start and end; None before any attempt
    """

    frame: NDArray[np.int32]
    frames: tuple[Frame, ...]
    start: NDArray[np.float64] | None = None
    end: NDArray[np.float64] | None = None

    @classmethod
    def of(cls, moves: Moves, pieces: Pieces) -> SecondReading:
        """From the motions that were read where `pieces` were written (same rows)."""
        last = np.flatnonzero(np.append(pieces.move[1:] != pieces.move[:-1], True))
        first = np.append(0, last[:-1] + 1)
        return cls(moves.frame[last], moves.frames, moves.start[first], moves.end[last])
