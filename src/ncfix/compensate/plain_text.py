"""A planned part of plain motions as text: written in one stretch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate.findings import Array
from ncfix.compensate.idle import standing_still
from ncfix.compensate.plain import Course
from ncfix.compensate.rows import lengths
from ncfix.program.bulk import Bulk
from ncfix.program.frames import FrameMap
from ncfix.program.language import Language
from ncfix.program.writer import Splices


@dataclass(frozen=True, slots=True)
class PlainText:
    """What was written of a part.

    start    (n_axes,) the command at which the control stood before
    end      (m, n_axes) the command at the end of each piece as the control will understand it
    splices  what changes in the text
    added    lines that were put in
    """

    start: Array
    end: Array
    splices: Splices
    added: int

    def largest_shift(self, course: Course) -> float:
        """The largest shift of the linear axes at the end of a motion, mm."""
        ends = self.end if course.single else self.end[course.first[1:] - 1]
        return float(lengths((ends - course.part.moves.end)[:, ~course.part.moves.rotary]).max())


def written(language: Language, course: Course, position: Array, steps: Array) -> PlainText | None:
    """Write a part; None if any of it has to go motion by motion.

    position  (n_axes,) the command at which the control stands
    steps     (n_axes,) what the control can resolve, mm and rad
    """
    program, moves = course.part.program, course.part.moves
    frame = FrameMap(moves.frames[int(moves.frame[0])], moves.axes, moves.rotary)
    bulk = Bulk.of_all(language, program, moves, course.pieces, course.first, frame.frame)
    if bulk is None:
        return None
    end = bulk.take_all(position, frame, frame.decimals(steps))
    if end is None:
        return None
    if not course.single:
        start = np.concatenate([position[None], end])[course.first[:-1]]
        if standing_still(course.pieces, end, start).any():
            return None
    return PlainText(position, end, Splices.joined(bulk.parts), bulk.added)
