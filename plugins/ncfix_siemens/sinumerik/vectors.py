"""Stretches of straight motions whose blocks give the direction of the tool as A3 B3 C3, taken all at once.

X Y Z go by the fast lane; the rotary axes are worked out motion after motion, since where they go depends on where they
stand. What there is to say of, to refuse, or to keep in one piece ends the stretch, and goes block by block.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ncfix.control.coordinates import DEGREE
from ncfix.control.lanes.block_rows import BlockRows, IntArray, stage_of
from ncfix.control.lanes.lane import SHORTEST, before_placing, is_open, take
from ncfix.control.moves import FeedMode
from ncfix.control.pointing import Pointing, Ways, nearest
from ncfix.control.posture import FAR
from ncfix_siemens.sinumerik.orientation import BY_AXES, ON_CURVES
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.unit import SinumerikUnit

LONGEST = 1 << 10
"""Blocks that are taken at once; where one ends the stretch, those behind it were taken in vain."""


def run_vectors(control: Sinumerik, unit: SinumerikUnit, block: int, main: bool) -> int:
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
    ways = unit.directions.known(pointing, unit, block, stop, SHORTEST)
    if len(ways) < SHORTEST:
        return 0
    stage = stage_of(control, unit, block, block + len(ways))
    stage = replace(stage, mask=mask[: len(ways)])
    count = turn(control, pointing, letters, ways, stage)
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


def turn(control: Sinumerik, pointing: Pointing, letters: list[int], ways: Sequence[Ways], stage: BlockRows) -> int:
    """Put the rotary axes of a stage where one of two ways leads them; up to which motion that goes without saying."""
    first, second = letters
    (scale, other_scale), (offset, other_offset) = (
        [each[i] for i in letters] for each in (control.scale, control.offset)
    )
    here, path = (control.position[first], control.position[second]), stage.path
    found: list[tuple[float, float]] = []
    even = even_motions(control, stage.motion.astype(np.int64))
    at_will = True
    for both, is_even in zip(ways, even, strict=True):
        led = nearest(both, here)
        if (at_will and pointing.leaves_pole(here, led)) or not (is_even or pointing.stray(here, led[0]) <= FAR):
            break
        outer, inner = led[0]
        here = (
            scale * ((outer - offset) / DEGREE) + offset,
            other_scale * ((inner - other_offset) / DEGREE) + other_offset,
        )
        found.append(here)
        at_will = math.isnan(both[0][0])
    path[1 : len(found) + 1, letters] = found or np.empty((0, 2))
    return len(found)


def even_motions(control: Sinumerik, motion: IntArray) -> list[bool]:
    """(n,) motions in which the rotary axes turn evenly, whatever the tool does meanwhile."""
    even: list[bool] = ((motion == 0) | (control.modes.orientation == BY_AXES)).tolist()
    return even
