"""What a control understands of a corrected text: what the next attempt to write it has to know."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.control.moves import Frame, Moves
from ncfix.writer.pieces import Pieces

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SecondReading:
    """What a control made of an earlier attempt, one row per motion of the original.

    A program may set its frames where the machine stands (G92, G10 L20): then they move with the corrections.

    frame, frames  (n,) index into `frames`: the frame in which each motion is really read
    start, end     (n, n_axes) where motions that are kept really start and end; None before any attempt
    """

    frame: NDArray[np.int32]
    frames: tuple[Frame, ...]
    start: FloatArray | None = None
    end: FloatArray | None = None

    @classmethod
    def of(cls, moves: Moves, pieces: Pieces) -> SecondReading:
        """From the motions that were read where `pieces` were written (same rows)."""
        last = np.flatnonzero(np.append(pieces.move[1:] != pieces.move[:-1], True))
        first = np.append(0, last[:-1] + 1)
        return cls(moves.frame[last], moves.frames, moves.start[first], moves.end[last])
