"""Stretches of straight motions whose blocks give the direction of the tool as A3 B3 C3, taken all at once.

X Y Z go by the fast lane; the rotary axes are worked out motion after motion, since where they go depends on where they
stand. What there is to say of, to refuse, or to keep in one piece ends the stretch, and goes block by block.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ncfix.program.follow.coordinates import DEGREE
from ncfix.program.follow.lane import SHORTEST, before_placing, is_open, take
from ncfix.program.follow.stage import FloatArray, IntArray, Stage, stage_of
from ncfix.program.moves import FeedMode
from ncfix.program.pointing import Pointing
from ncfix.program.sinumerik.orientation import BY_AXES, FAR, NO_LENGTH, ON_CURVES, direction_of, is_choice
from ncfix.program.sinumerik.state import Sinumerik
from ncfix.program.sinumerik.unit import Unit

LONGEST = 1 << 10
"""Blocks that are taken at once; where one ends the stretch, those behind it were taken in vain."""


def run_vectors(control: Sinumerik, unit: Unit, block: int, main: bool) -> int:
    """Take the stretch that begins with a block; the number of blocks taken, 0 for none."""
    stop = min(unit.vector_end(block), block + LONGEST)
    if stop - block < SHORTEST or not is_ready(control) or not is_open(control, unit, block):
        return 0
    pointing = control.pointing
    assert pointing is not None
    letters = [control.machine[column] for column in pointing.columns]
    turning = 1 << letters[0] | 1 << letters[1]
    mask = unit.lanes.mask[unit.program.template[block:stop]] | turning
    stop = before_placing(control, mask, block)
    if stop - block < SHORTEST:
        return 0
    stage = stage_of(control, unit, block, stop)
    stage = replace(stage, mask=mask[: stop - block])
    count = turn(control, pointing, letters, vectors_of(unit, block, stop), stage)
    if count < SHORTEST:
        return 0
    control.points = True
    control.builder.says_the_way(turning, count)
    take(control, stage.rows(0, count), block, main)
    return count


def is_ready(control: Sinumerik) -> bool:
    """Whether directions of the tool can be followed many at a time."""
    modes, modal = control.modes, control.modal
    plain = not modal.incremental and modal.feed_mode != FeedMode.INVERSE_TIME and control.tools.offset is not None
    followed = modes.transformed and not modes.orientation.startswith(ON_CURVES)
    return plain and followed and control.pointing is not None


def vectors_of(unit: Unit, start: int, stop: int) -> FloatArray:
    """(n, 3) the components of the vectors of blocks; zero where one is not written."""
    program = unit.program
    slots = unit.vectors[program.template[start:stop]]
    values = program.numbers[program.first_number[start:stop, None] + np.maximum(slots, 0)]
    found: FloatArray = np.where(slots >= 0, values, 0.0)
    return found


def turn(control: Sinumerik, pointing: Pointing, letters: list[int], vectors: FloatArray, stage: Stage) -> int:
    """Put the rotary axes of a stage where vectors (n, 3) lead them; up to which motion that goes without saying."""
    first, second = letters
    here, path = (control.position[first], control.position[second]), stage.path
    found: list[tuple[float, float]] = []
    even = even_motions(control, stage.motion.astype(np.int64))
    for vector, is_even in zip(vectors.tolist(), even, strict=True):
        if math.hypot(*vector) < NO_LENGTH:
            break
        ways = pointing.angles(direction_of(control, (vector[0], vector[1], vector[2])), here)
        if not ways or is_choice(pointing, here, ways):
            break
        if not is_even and pointing.stray(here, ways[0]) > FAR:
            break
        one, other = (
            control.scale[index] * ((angle - control.offset[index]) / DEGREE) + control.offset[index]
            for index, angle in zip(letters, ways[0], strict=True)
        )
        here = one, other
        found.append(here)
    path[1 : len(found) + 1, first] = [one for one, _ in found]
    path[1 : len(found) + 1, second] = [other for _, other in found]
    return len(found)


def even_motions(control: Sinumerik, motion: IntArray) -> list[bool]:
    """(n,) motions in which the rotary axes turn evenly, whatever the tool does meanwhile."""
    even: list[bool] = ((motion == 0) | (control.modes.orientation == BY_AXES)).tolist()
    return even
