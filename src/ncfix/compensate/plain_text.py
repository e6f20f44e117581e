"""A planned part of plain motions as text: written in long stretches."""

from __future__ import annotations

import numpy as np

from ncfix.compensate.plain import Course
from ncfix.compensate.plan.arrays import Array, squares
from ncfix.compensate.plan.written import standing_still
from ncfix.text.language import Language
from ncfix.writer.bulk import Bulk
from ncfix.writer.emit import Emission, emit


def written(language: Language, course: Course, position: Array, steps: Array) -> Emission | None:
    """Write a part; None if any of it cannot be written, or would not move.

    position  (n_axes,) the command at which the control stands
    steps     (n_axes,) what the control can resolve, mm and rad
    """
    program, moves, pieces = course.part.program, course.part.moves, course.pieces
    bulk = Bulk.among(language, program, moves, pieces, course.first, course.plain)
    if bulk is None:
        return None
    emission = emit(program, moves, pieces, steps, done=position, bulk=bulk)
    idle = not course.single and standing_still(pieces, emission.end, emission.start).any()
    return None if emission.conflicts or idle else emission


def largest_shift(course: Course, emission: Emission) -> float:
    """The largest shift of the linear axes at the end of a motion, mm."""
    moves = course.part.moves
    return float(np.sqrt(squares((course.last(emission.end) - moves.end)[:, ~moves.rotary]).max()))
