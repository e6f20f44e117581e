"""Blocks of plain numbers as columns: what they say, and where they lead."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ncfix import fast
from ncfix.control.control import Control
from ncfix.control.coordinates import N_LETTERS
from ncfix.control.lane_tables import LaneTables
from ncfix.control.moves import FeedMode
from ncfix.text.tree import Program

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Mask = NDArray[np.bool_]
Shapes = NDArray[np.int32]
Before = tuple[float, float, float]
"""What the number of an F word counts; feed and motion code in force before."""

LONGEST = 1 << 16
"""Blocks that are taken at once."""


class Text(Protocol):
    """A program text while it is executed."""

    @property
    def program(self) -> Program:
        """The program whose text it is."""

    @property
    def lanes(self) -> LaneTables:
        """The lanes of all shapes as columns."""


@dataclass(frozen=True, slots=True)
class Stage:
    """Consecutive blocks as the control takes them, one row per block.

    path    (n + 1, 9) the command before the first block, and at the end of each
    feed    (n,) feed in force, mm/min, 1/min or mm/rev; `fed` where the block has an F
    motion  (n,) motion code in force, in tenths; `coded` where the block has one
    mask    (n,) axis words, as bits
    turns   (n,) arcs; None: no block can be one
    """

    path: FloatArray
    feed: FloatArray
    fed: Mask
    motion: FloatArray
    coded: Mask
    mask: IntArray
    turns: Mask | None = None

    def rows(self, start: int, stop: int) -> Stage:
        """Some of the blocks."""
        own = slice(start, stop)
        path = self.path[start : stop + 1]
        turns = None if self.turns is None else self.turns[own]
        return Stage(path, self.feed[own], self.fed[own], self.motion[own], self.coded[own], self.mask[own], turns)

    def only(self, moving: Mask) -> Stage:
        """The blocks that move anything, (n,): the others lead nowhere."""
        if moving.all():
            return self
        path = np.concatenate((self.path[:1], self.path[1:].compress(moving, axis=0)))
        names = ["feed", "fed", "motion", "coded", "mask", *(["turns"] if self.turns is not None else [])]
        return replace(self, path=path, **{name: getattr(self, name).compress(moving) for name in names})


def stage_of(control: Control, unit: Text, start: int, stop: int) -> Stage:
    """What blocks say, and where they lead."""
    program = unit.program
    shapes, first = program.template[start:stop], program.first_number[start:stop]
    follow = followed_compiled if fast.engaged() else followed
    before = feed_unit(control), control.modal.feed, float(control.modal.motion)
    stage = follow(control, program.numbers, first, shapes, unit.lanes, before)
    return replace(stage, turns=unit.lanes.turns.take(shapes)) if unit.lanes.turns.any() else stage


def feed_unit(control: Control) -> float:
    """What the number of an F word counts."""
    return 1.0 if control.modal.feed_mode == FeedMode.INVERSE_TIME else control.modal.unit


def followed(
    control: Control, numbers: FloatArray, first: IntArray, shapes: Shapes, tables: LaneTables, before: Before
) -> Stage:
    """What blocks of some shapes with numbers from `first` on say, and where they lead."""
    unit, feed_before, motion_before = before
    path = np.empty((len(first) + 1, N_LETTERS))
    path[:] = control.position
    for letter in np.flatnonzero((tables.axes >= 0).any(axis=0)).tolist():
        path[1:, letter] = column(control, letter, words(numbers, first, tables.axes[:, letter].take(shapes)))
    feeds, motion = words(numbers, first, tables.feed.take(shapes)), tables.motion.take(shapes)
    fed, coded = ~np.isnan(feeds), motion >= 0
    feed = filled(unit * feeds, fed, feed_before)
    codes = filled(motion.astype(np.float64), coded, motion_before)
    return Stage(path, feed, fed, codes, coded, tables.mask.take(shapes))


def words(numbers: FloatArray, first: IntArray, slots: IntArray) -> FloatArray:
    """The numbers at some slots of blocks, NaN where the slot is -1."""
    given = slots >= 0
    if given.all():
        return numbers.take(first + slots)
    values = numbers.take(first + slots, mode="clip") if len(numbers) else np.empty(len(slots))
    values[np.flatnonzero(~given)] = np.nan
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
    control: Control, numbers: FloatArray, first: IntArray, shapes: Shapes, tables: LaneTables, before: Before
) -> Stage:
    """As `followed`."""
    from ncfix.control import lane_kernel

    position, offset, scale = (np.array(each) for each in (control.position, control.offset, control.scale))
    n = len(first)
    stage = Stage(
        np.empty((n + 1, N_LETTERS)),
        np.empty(n),
        np.empty(n, dtype=np.bool_),
        np.empty(n),
        np.empty(n, dtype=np.bool_),
        np.empty(n, dtype=np.int64),
    )
    lane_kernel.followed(
        (numbers, first, shapes),
        (tables.axes, tables.feed, tables.motion, tables.mask),
        (position, *before),
        (offset, scale, int(control.modal.incremental)),
        (stage.path, stage.feed, stage.fed, stage.motion, stage.coded, stage.mask),
    )
    return stage


def filled(values: FloatArray, valid: NDArray[np.bool_], before: float) -> FloatArray:
    """Every row's value, or the last one given above it; `before` where none is."""
    if valid.all():
        return values
    last = np.maximum.accumulate(np.where(valid, np.arange(len(values)), -1))
    return np.where(last >= 0, values[last], before)
