"""The fast lane: stretches of straight motions with plain numbers, taken all at once.

It does what the interpreter would do block by block, with the same operations in the same order, so that the
results are the same to the last bit; a test holds the two together. What it cannot take it leaves alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ncfix import fast
from ncfix.program.follow.builder import Stretch
from ncfix.program.follow.contour import resting_of_many
from ncfix.program.follow.control import Control
from ncfix.program.follow.coordinates import N_LETTERS
from ncfix.program.follow.lane_tables import Lane, LaneTables
from ncfix.program.moves import FeedMode, Kind
from ncfix.program.tree import Program

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SHORTEST = 16
"""Stretches of fewer blocks go one by one."""

LONGEST = 1 << 16
"""Blocks that are taken at once."""


@dataclass(frozen=True, slots=True)
class Stage:
    """A stretch as the control takes it, one row per block.

    path    (n + 1, 9) the command before the first block, and at the end of each
    feed    (n,) F words, NaN where there is none
    motion  (n,) motion codes in force, in tenths; `coded` where the block has one
    mask    (n,) axis words, as bits
    """

    path: FloatArray
    feed: FloatArray
    motion: FloatArray
    coded: NDArray[np.bool_]
    mask: IntArray

    def head(self, count: int) -> Stage:
        """The first blocks of it."""
        if count == len(self.feed):
            return self
        return Stage(
            self.path[: count + 1], self.feed[:count], self.motion[:count], self.coded[:count], self.mask[:count]
        )


class HasLane(Protocol):
    """The plan of a block."""

    @property
    def lane(self) -> Lane | None:
        """Where its numbers are, if it may go through the fast lane."""


class Unit(Protocol):
    """A program text while it is executed."""

    @property
    def program(self) -> Program:
        """The program whose text it is."""

    @property
    def lanes(self) -> LaneTables:
        """The lanes of all shapes as columns."""

    def plan(self, block: int) -> HasLane:
        """The plan of a block."""

    def lane_end(self, block: int) -> int:
        """The first block from `block` on that cannot go through the fast lane."""


def run_lane(control: Control, unit: Unit, block: int, main: bool) -> int:
    """Take the stretch that begins with a block; the number of blocks taken, 0 for none."""
    stop = min(unit.lane_end(block), block + LONGEST)
    if stop - block < SHORTEST or not is_open(control, unit, block):
        return 0
    stop = before_placing(control, unit.lanes.mask[unit.program.template[block:stop]], block)
    if stop - block < SHORTEST:
        return 0
    stage = stage_of(control, unit, block, stop)
    feed = filled(stage.feed, ~np.isnan(stage.feed), np.nan)
    count = count_allowed(control, stage, feed)
    if count < SHORTEST:
        return 0
    take(control, stage.head(count), feed[:count], block, main)
    return count


def is_open(control: Control, unit: Unit, block: int) -> bool:
    """Whether the state allows the fast lane at all."""
    modal = control.modal
    lane = unit.plan(block).lane
    begun = modal.motion in (0, 10) or (lane is not None and lane.motion >= 0)
    known = not (control.unknown or control.shaky or control.is_rotated)
    return begun and known and (modal.incremental or control.offset_checked)


def before_placing(control: Control, mask: IntArray, block: int) -> int:
    """The block that first brings an adrift axis to its place, or the end of blocks with these axis words (n,).

    That block goes by itself, so that all of a stretch have the same axes adrift.
    """
    if not control.places.adrift or control.modal.incremental:
        return block + len(mask)
    placing = (mask & control.places.adrift) != 0
    return block + (int(np.argmax(placing)) if placing.any() else len(mask))


def stage_of(control: Control, unit: Unit, start: int, stop: int) -> Stage:
    """What the blocks of a stretch say, and where they lead."""
    program, tables = unit.program, unit.lanes
    shapes, first = program.template[start:stop], program.first_number[start:stop]
    motion, coded = tables.motion[shapes], tables.motion[shapes] >= 0
    follow = followed_compiled if fast.engaged() else followed
    path, feed = follow(control, program.numbers, first, shapes, tables)
    before = float(control.modal.motion)
    return Stage(path, feed, filled(motion.astype(np.float64), coded, before), coded, tables.mask[shapes])


def followed(
    control: Control, numbers: FloatArray, first: IntArray, shapes: NDArray[np.int32], tables: LaneTables
) -> tuple[FloatArray, FloatArray]:
    """The path (n + 1, 9) and the F words (n,) of blocks of some shapes with numbers from `first` on."""
    path = np.empty((len(first) + 1, N_LETTERS))
    path[0] = control.position
    for letter in range(N_LETTERS):
        path[1:, letter] = column(control, letter, words(numbers, first, tables.axes[shapes, letter]))
    return path, words(numbers, first, tables.feed[shapes])


def words(numbers: FloatArray, first: IntArray, slots: IntArray) -> FloatArray:
    """The numbers at some slots of blocks, NaN where the slot is -1."""
    values = np.full(len(slots), np.nan)
    rows = np.flatnonzero(slots >= 0)
    values[rows] = numbers[first[rows] + slots[rows]]
    return values


def column(control: Control, letter: int, words: FloatArray) -> FloatArray:
    """The commands of one axis at the ends of blocks with these words, (n,)."""
    here, given = control.position[letter], ~np.isnan(words)
    if not given.any():
        return np.full(len(words), here)
    if control.modal.incremental:
        steps = np.where(given, control.scale[letter] * words, 0.0)
        return np.cumsum(np.append(here, steps))[1:]
    return filled(control.offset[letter] + control.scale[letter] * words, given, here)


def followed_compiled(
    control: Control, numbers: FloatArray, first: IntArray, shapes: NDArray[np.int32], tables: LaneTables
) -> tuple[FloatArray, FloatArray]:
    """As `followed`."""
    from ncfix.program.follow import lane_kernel

    position, offset, scale = (np.array(each) for each in (control.position, control.offset, control.scale))
    incremental = control.modal.incremental
    found = np.empty((len(first) + 1, N_LETTERS)), np.empty(len(first))
    frame = offset, scale
    lane_kernel.followed(numbers, first, shapes, tables.axes, tables.feed, position, frame, incremental, found)
    return found


def filled(values: FloatArray, valid: NDArray[np.bool_], before: float) -> FloatArray:
    """Every row's value, or the last one given above it; `before` where none is."""
    if valid.all():
        return values
    last = np.maximum.accumulate(np.where(valid, np.arange(len(values)), -1))
    return np.where(last >= 0, values[last], before)


def count_allowed(control: Control, stage: Stage, feed: FloatArray) -> int:
    """How many blocks run before one that the control would refuse for want of a feed."""
    modal = control.modal
    if not control.needs_feed:
        return len(feed)
    at_feed = (stage.motion == 10) & ((stage.mask != 0) | stage.coded)
    if modal.feed_mode == FeedMode.INVERSE_TIME:
        refused = at_feed & np.isnan(stage.feed)
    elif modal.feed_mode == FeedMode.PER_REVOLUTION and modal.speed == 0.0:
        refused = at_feed
    else:
        missing = np.isnan(feed) & (not modal.feed_given)
        refused = at_feed & (missing | (feed == 0.0))
    return int(np.argmax(refused)) if refused.any() else len(feed)


def take(control: Control, stage: Stage, feed: FloatArray, block: int, main: bool) -> None:
    """Add the motions of a stretch, and leave the control as they leave it."""
    modal = control.modal
    unit = 1.0 if modal.feed_mode == FeedMode.INVERSE_TIME else modal.unit
    feeds = np.where(np.isnan(feed), modal.feed, unit * feed)
    if not np.isnan(stage.feed).all():
        modal.feed, modal.feed_given = float(feeds[-1]), bool(feeds[-1] != 0.0)
    modal.motion = modal.straight = int(stage.motion[-1])
    moving = stage.mask != 0
    if not moving.any():
        return
    rows: IntArray | slice = slice(None) if moving.all() else np.flatnonzero(moving)
    codes, blocks = stage.motion[rows], block + np.arange(len(moving))[rows]
    styles = np.where(codes == 0, style(control, Kind.RAPID), style(control, Kind.FEED))
    blocks = blocks if main else np.full(len(blocks), control.row_block)
    starts, ends = stage.path[:-1][rows], stage.path[1:][rows]
    control.places.begun = True
    plane = control.still_beside(0)
    adrift = control.places.adrift | np.where(stage.mask[rows] & plane != 0, 0, plane)
    if plane:
        control.builder.many_rest(resting_of_many(control, stage.mask[rows], starts, ends))
    control.builder.extend(Stretch(blocks, stage.mask[rows], styles, feeds[rows], starts, ends, adrift))
    control.position = ends[-1].tolist()
    modal.cycle.initial = None


def style(control: Control, kind: Kind) -> int:
    """The style of motions whose start and end are known."""
    return control.style_of(kind, 0 if kind == Kind.RAPID else 10)
