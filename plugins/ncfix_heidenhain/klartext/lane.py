"""The fast lane of Klartext: stretches of straight motions, arcs and poles with plain numbers, taken all at once.

It does what the interpreter would do block by block, with the same operations in the same order, so that the results
are the same to the last bit; a test holds the two together. What it cannot take it leaves alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix import core
from ncfix.control.arcs import CLOCKWISE, COUNTER
from ncfix.control.builder import Circles, MotionColumns
from ncfix.control.lanes.block_rows import LONGEST, filled, followed, followed_compiled
from ncfix.control.lanes.lane import SHORTEST, before_placing
from ncfix.control.moves import Arc, FeedMode, MotionKind
from ncfix_heidenhain.klartext.arc_lane import keep_pole, turned
from ncfix_heidenhain.klartext.arcs import direction_at_end
from ncfix_heidenhain.klartext.control import KlartextControl
from ncfix_heidenhain.klartext.layout import CORNERS
from ncfix_heidenhain.klartext.lines import FLAT
from ncfix_heidenhain.klartext.units import FEED, RAPID, KlartextUnit

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Mask = NDArray[np.bool_]

KINDS = {RAPID: MotionKind.RAPID, FEED: MotionKind.FEED, CLOCKWISE: MotionKind.ARC, COUNTER: MotionKind.ARC}


@dataclass(frozen=True, slots=True)
class KlartextBlockRows:
    """A stretch as the control takes it, one row per block.

    path    (n + 1, 9) the command before the first block, and at the end of each
    feed    (n,) feed in force, mm/min
    motion  (n,) `RAPID`, `FEED`, or the code of an arc
    side    (n,) radius compensation in force
    mask    (n,) axis words, as bits; 0: the block moves nothing
    """

    path: FloatArray
    feed: FloatArray
    motion: IntArray
    side: IntArray
    mask: IntArray

    def head(self, count: int) -> KlartextBlockRows:
        """The first blocks of it."""
        if count == len(self.feed):
            return self
        return KlartextBlockRows(
            self.path[: count + 1], self.feed[:count], self.motion[:count], self.side[:count], self.mask[:count]
        )


def run_lane(control: KlartextControl, unit: KlartextUnit, block: int) -> tuple[int, int]:
    """Take the stretch that begins with a block.

    Returns how many blocks are taken, 0 for none, and the first block at which it is worth while to try again.
    """
    if not is_open(control):
        return 0, block + 1
    end = unit.lane_end(block)
    stop = before_corner(unit, block, min(end, block + LONGEST))
    stop = before_placing(control, unit.lanes.words.mask[unit.program.template[block:stop]], block)
    if stop - block < SHORTEST:
        return 0, min(stop, end) + 1
    stage = stage_of(control, unit, block, stop)
    stage = stage.head(min(count_on_one_turn(control, stage), count_beside(control, stage)))
    circles, count = turned(control, unit, block, stage.path, stage.motion)
    if count < SHORTEST:
        return 0, block + count + 1
    take(control, stage.head(count), unit, block, circles)
    return count, block + count


def before_corner(unit: KlartextUnit, block: int, stop: int) -> int:
    """Where a stretch has to stop: the motion before a corner (RND, CHF) is no plain one."""
    following = unit.next_plan(stop)
    if following is None or following.name not in CORNERS:
        return stop
    shapes = unit.program.template[block:stop]
    busy = np.flatnonzero(~unit.lanes.empty[shapes] & (unit.lanes.pole[shapes, 0] < 0))
    return block + int(busy[-1]) if len(busy) else stop


def is_open(control: KlartextControl) -> bool:
    """Whether the state allows the fast lane at all."""
    modal, path = control.modal, control.path
    known = not (control.unknown or control.composed.unknown) and control.preset_checked and control.tool_called
    turned = control.is_rotated or control.plane_tilted
    special = path.corner or path.by_vector or path.spatial or control.cycle.modal or control.ends is not None
    plain = modal.feed_mode == FeedMode.PER_MINUTE and not (modal.incremental or modal.arc_absolute)
    return known and plain and not (turned or special)


def stage_of(control: KlartextControl, unit: KlartextUnit, start: int, stop: int) -> KlartextBlockRows:
    """What the blocks of a stretch say, and where they lead."""
    program, tables = unit.program, unit.lanes
    shapes, first = program.template[start:stop], program.first_number[start:stop]
    follow = followed_compiled if core.engaged() else followed
    found = follow(
        control, program.numbers, first, shapes, tables.words, (control.modal.unit, control.modal.feed, RAPID)
    )
    own = tables.side[shapes]
    side = filled(own.astype(np.float64), own >= 0, control.modal.compensated).astype(np.int64)
    return KlartextBlockRows(found.path, found.feed, tables.words.motion[shapes], side, found.mask)


def count_on_one_turn(control: KlartextControl, stage: KlartextBlockRows) -> int:
    """How many blocks run before one in which a rotary axis takes the shorter way round past a turn (M126)."""
    if not control.shortest:
        return len(stage.feed)
    turns = np.zeros(len(stage.feed), dtype=np.bool_)
    for index in control.machine:
        if control.rotary[index]:
            turns |= np.rint(np.diff(stage.path[:, index]) / (2 * math.pi)) != 0
    return int(np.argmax(turns)) if turns.any() else len(turns)


def count_beside(control: KlartextControl, stage: KlartextBlockRows) -> int:
    """How many blocks run before one that ends radius compensation (R0), or an arc with it.

    From there on it matters what is named.
    """
    before = np.append(control.modal.compensated, stage.side[:-1])
    ends = (before != 0) & ((stage.side == 0) | (stage.motion > FEED))
    return int(np.argmax(ends)) if ends.any() else len(ends)


def take(control: KlartextControl, stage: KlartextBlockRows, unit: KlartextUnit, block: int, circles: Circles) -> None:
    """Add the motions of a stretch, `circles` those of its arcs, and leave the control as they leave it."""
    shapes = unit.program.template[block : block + len(stage.feed)]
    control.suspended.pop("M130", None)
    control.external, control.tilted = unit.external, False
    last = block + len(stage.feed) - 1
    control.row_block = control.row_block if unit.external else last
    moving = np.flatnonzero(stage.mask != 0)
    if len(moving):
        blocks = np.full(len(moving), control.row_block) if unit.external else block + moving
        mask, starts, ends = stage.mask[moving], stage.path[:-1][moving], stage.path[1:][moving]
        styles = styles_of(control, stage.motion[moving], stage.side[moving], (unit.lanes.arc == "cp")[shapes[moving]])
        control.places.begun = True
        sided = stage.side[moving] != 0
        if sided.any():
            control.builder.many_rest(np.where(sided, control.resting_of_many(mask, starts, ends), 0))
        plane = control.plane_axes
        unplaced = control.places.unplaced | np.where(sided & (mask & plane == 0), plane, 0)
        control.builder.circles(circles._replace(row=np.searchsorted(moving, circles.row)))
        control.builder.extend(MotionColumns(blocks, mask, styles, stage.feed[moving], starts, ends, unplaced))
        control.position = ends[-1].tolist()
        keep_tangent(control, stage.path, circles)
    keep_pole(control, unit, block, shapes)
    control.modal.feed = float(stage.feed[-1])
    control.modal.compensated = int(stage.side[-1])


def styles_of(control: KlartextControl, motion: IntArray, side: IntArray, relative: Mask) -> IntArray:
    """The styles of motions whose start and end are known; `relative`: they count from where they start."""
    styles = np.empty(len(motion), dtype=np.int64)
    keys = (side << 6 | motion) << 1 | relative
    for key in np.flatnonzero(np.bincount(keys)).tolist():
        code = key >> 1 & 63
        control.modal.compensated, control.modal.incremental = key >> 7, bool(key & 1)
        styles[keys == key] = control.style_of(KINDS[code], code)
    control.modal.incremental = False
    return styles


def keep_tangent(control: KlartextControl, path: FloatArray, circles: Circles) -> None:
    """Note in which direction the last motion went that had a way."""
    ways = np.diff(path[:, :3], axis=0)
    arc = int(circles.row[-1]) if len(circles.row) else -1
    for row in np.flatnonzero(np.abs(ways).max(axis=1) > FLAT / 2)[::-1].tolist():
        if row <= arc:
            break
        x, y, z = ways[row].tolist()
        length = math.hypot(x, y, z)
        if length > FLAT:
            control.path.tangent = (x / length, y / length, z / length)
            return
    if arc >= 0:
        x, y, z = circles.centre[-1].tolist()
        last = Arc((x, y, z), circles.normal, float(circles.sweep[-1]))
        control.path.tangent = direction_at_end(path[arc + 1].tolist(), last)
