"""Corrected motions as columns: what shall be commanded instead, one row per block piece to be written."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


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
