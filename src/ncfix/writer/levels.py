"""The level R of canned cycles: what it shall be in a block, what is in force, and where the control stands then."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ncfix.control.moves import Moves
from ncfix.writer.frames import FrameMap
from ncfix.writer.pieces import Pieces
from ncfix.writer.target import Level, Rendered, Target

FloatArray = NDArray[np.float64]


class LevelBook:
    """The book that the control keeps of R.

    Where a control stands at R and is to come back to where the series of holes began (G98), LinuxCNC goes up there
    before it goes to the hole, but not from any higher than R: so R must not sink below where it stands.

    in_force  the frame in whose numbers R was written, and R; None where that is not known
    approach  (n_axes,) the command over the last hole at that level
    """

    def __init__(self, moves: Moves, pieces: Pieces) -> None:
        self.moves = moves
        self.pieces = pieces
        self.in_force: tuple[int, float] | None = None
        self.approach: FloatArray | None = None

    def forget(self) -> None:
        """Something else than a corrected cycle: R is not known any more."""
        self.in_force = self.approach = None

    def wanted(
        self,
        row: int,
        piece: int,
        number: int,
        frame: FrameMap,
        as_programmed: FrameMap,
        here: FloatArray,
        address: str,
    ) -> Level | None:
        """What R shall be in the numbers of `frame` (its `number`), while the axes stand `here`; None of no cycle.

        address  what stands for R
        """
        moves, approach = self.moves, self.pieces.approach
        if approach is None or moves.approach is None or not np.isfinite(approach[piece]).all():
            return None
        nominal = as_programmed.program(moves.approach[row].copy())
        across = int(np.argmax(np.abs(nominal - as_programmed.program(moves.end[row].copy()))))
        in_frame, level = self.in_force or (-1, math.nan)
        stands = bool(as_programmed.program(moves.start[row].copy())[across] == nominal[across])
        return Level(
            across,
            wanted=float(frame.program(approach[piece].copy())[across]),
            nominal=float(nominal[across]),
            before=level if in_frame == number else math.nan,
            least=float(frame.program(here.copy())[across]) if stands and not self.comes_back(row) else math.nan,
            address=address,
        )

    def comes_back(self, row: int) -> bool:
        """Whether the control ends at R (G99) behind a cycle, and not where it began."""
        moves = self.moves
        if moves.approach is None or row + 1 == len(moves):
            return False
        on = moves.start[row + 1] == moves.approach[row]
        return bool(on[moves.end[row] != moves.approach[row]].all())

    def note(self, number: int, frame: FrameMap, target: Target, rendered: Rendered) -> None:
        """Note what was written."""
        self.forget()
        if rendered.level is not None and target.level is not None:
            over = rendered.ends[-1].copy()
            over[target.level.across] = rendered.level
            self.in_force, self.approach = (number, rendered.level), frame.command(over)

    def returns(self, row: int) -> NDArray[np.bool_]:
        """(n_axes,) axes that stand at that level where the motion behind a cycle begins."""
        if self.approach is None or self.moves.approach is None:
            return np.zeros(len(self.moves.axes), dtype=bool)
        level = self.moves.approach[row]
        return np.asarray((self.moves.start[row + 1] == level) & (self.moves.end[row] != level))
