"""Blocks of plain numbers as columns: where shapes have their numbers, what blocks say, and where they lead.

That is found of one stretch, or of many ahead at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ncfix import core
from ncfix.arrays import Array, Ints, Mask
from ncfix.control.control import ProgramControl
from ncfix.control.coordinates import N_LETTERS
from ncfix.control.moves import FeedMode
from ncfix.text.tree import Program
from ncfix.values import frozen, mutable

Shapes = NDArray[np.int32]
Before = tuple[float, float, float]
"""What the number of an F word counts; feed and motion code in force before."""

LONGEST = 1 << 16
"""Blocks that are taken at once."""


@frozen
class Lane:
    """A block that is nothing but a straight motion, or an arc, with plain numbers.

    axes    pairs of letter index and slot
    feed    slot of F, -1 without
    motion  0, 10, 20, 30, or -1 if the code in force stays
    centre  slots of I, J and K, -1 without
    radius  slot of R, -1 without
    fixed   which of I, J and K count from the origin, whatever else is in force
    """

    axes: tuple[tuple[int, int], ...]
    feed: int
    motion: int
    centre: tuple[int, int, int] = (-1, -1, -1)
    radius: int = -1
    fixed: tuple[bool, bool, bool] = (False, False, False)

    @property
    def turns(self) -> bool:
        """Whether it is an arc."""
        return self.radius >= 0 or max(self.centre) >= 0


@frozen
class LaneTables:
    """The lanes of all shapes as columns; -1 for what a shape lacks, and for all of a shape that has no lane.

    axes    (s, 9) which number of a block is the word of an axis
    feed    (s,) which one is F
    motion  (s,) motion code in tenths
    mask    (s,) axis words, as bits
    centre  (s, 3) which ones are I, J and K
    radius  (s,) which one is R
    fixed   (s, 3) which of I, J and K count from the origin
    turns   (s,) arcs
    """

    axes: Ints
    feed: Ints
    motion: Ints
    mask: Ints
    centre: Ints
    radius: Ints
    fixed: Mask
    turns: Mask

    @classmethod
    def of(cls, lanes: Sequence[Lane | None]) -> LaneTables:
        """The tables of some lanes."""
        n = len(lanes)
        nowhere, none = np.full((n, N_LETTERS), -1, dtype=np.int64), np.full(n, -1, dtype=np.int64)
        turns = np.array([lane is not None and lane.turns for lane in lanes], dtype=np.bool_)
        fixed = np.array([(False,) * 3 if lane is None else lane.fixed for lane in lanes], dtype=np.bool_).reshape(n, 3)
        mask, centre = np.zeros(n, dtype=np.int64), np.full((n, 3), -1, dtype=np.int64)
        tables = cls(nowhere, none, none.copy(), mask, centre, none.copy(), fixed, turns)
        for shape, lane in enumerate(lanes):
            if lane is not None:
                for letter, slot in lane.axes:
                    tables.axes[shape, letter] = slot
                tables.feed[shape], tables.motion[shape] = lane.feed, lane.motion
                tables.mask[shape] = sum(1 << letter for letter, _ in lane.axes)
                tables.centre[shape], tables.radius[shape] = lane.centre, lane.radius
        return tables


class ProgramText(Protocol):
    """A program text while it is executed."""

    @property
    def program(self) -> Program:
        """The program whose text it is."""

    @property
    def lanes(self) -> LaneTables:
        """The lanes of all shapes as columns."""


@frozen
class BlockRows:
    """Consecutive blocks as the control takes them, one row per block.

    path    (n + 1, 9) the command before the first block, and at the end of each
    feed    (n,) feed in force, mm/min, 1/min or mm/rev; `fed` where the block has an F
    motion  (n,) motion code in force, in tenths; `coded` where the block has one
    mask    (n,) axis words, as bits
    turns   (n,) arcs; None: no block can be one
    """

    path: Array
    feed: Array
    fed: Mask
    motion: Array
    coded: Mask
    mask: Ints
    turns: Mask | None = None

    def rows(self, start: int, stop: int) -> BlockRows:
        """Some of the blocks."""
        own = slice(start, stop)
        path = self.path[start : stop + 1]
        turns = None if self.turns is None else self.turns[own]
        return BlockRows(path, self.feed[own], self.fed[own], self.motion[own], self.coded[own], self.mask[own], turns)

    def only(self, moving: Mask) -> BlockRows:
        """The blocks that move anything, (n,): the others lead nowhere."""
        if moving.all():
            return self
        path = np.concatenate((self.path[:1], self.path[1:].compress(moving, axis=0)))
        names = ["feed", "fed", "motion", "coded", "mask", *(["turns"] if self.turns is not None else [])]
        return replace(self, path=path, **{name: getattr(self, name).compress(moving) for name in names})


def stage_of(control: ProgramControl, unit: ProgramText, start: int, stop: int) -> BlockRows:
    """What blocks say, and where they lead."""
    program = unit.program
    shapes, first = program.template[start:stop], program.first_number[start:stop]
    before = feed_unit(control), control.modal.feed, float(control.modal.motion)
    stage = followed(control, program.numbers, first, shapes, unit.lanes, before)
    return replace(stage, turns=unit.lanes.turns.take(shapes)) if unit.lanes.turns.any() else stage


def feed_unit(control: ProgramControl) -> float:
    """What the number of an F word counts."""
    return 1.0 if control.modal.feed_mode == FeedMode.INVERSE_TIME else control.modal.unit


def words(numbers: Array, first: Ints, slots: Ints) -> Array:
    """The numbers at some slots of blocks, NaN where the slot is -1."""
    given = slots >= 0
    if given.all():
        return numbers.take(first + slots)
    values = numbers.take(first + slots, mode="clip") if len(numbers) else np.empty(len(slots))
    values[np.flatnonzero(~given)] = np.nan
    return values


def followed(
    control: ProgramControl, numbers: Array, first: Ints, shapes: Shapes, tables: LaneTables, before: Before
) -> BlockRows:
    """What blocks of some shapes with numbers from `first` on say, and where they lead."""
    position, offset, scale = (np.array(each) for each in (control.position, control.offset, control.scale))
    n = len(first)
    stage = BlockRows(
        np.empty((n + 1, N_LETTERS)),
        np.empty(n),
        np.empty(n, dtype=np.bool_),
        np.empty(n),
        np.empty(n, dtype=np.bool_),
        np.empty(n, dtype=np.int64),
    )
    core.loops("motions").followed(
        numbers,
        first,
        shapes,
        tables.axes,
        tables.feed,
        tables.motion,
        tables.mask,
        position,
        *before,
        offset,
        scale,
        control.modal.incremental,
        stage.path,
        stage.feed,
        stage.fed.view(np.uint8),
        stage.motion,
        stage.coded.view(np.uint8),
        stage.mask,
    )
    return stage


def filled(values: Array, valid: Mask, before: float) -> Array:
    """Every row's value, or the last one given above it; `before` where none is."""
    if valid.all():
        return values
    last = np.maximum.accumulate(np.where(valid, np.arange(len(values)), -1))
    return np.where(last >= 0, values[last], before)


FEWEST = 256
"""Blocks that are offered at least: few enough to be gone through in no time."""


@mutable
class Lookahead:
    """The blocks that were looked at together, of which one stretch after the other is taken.

    What stands between stretches (arcs, dwells, expressions) counts as if it did nothing; what it has really done is
    put right where the next stretch begins, up to the next word of an axis, the next F, the next motion code.
    Increments count from where the axes stand: of these each stretch is looked at by itself.

    begin  the first of these blocks; a jump may lead before it, or to it again from elsewhere
    stage  what they say, and where they lead
    frame  what their numbers counted from
    done   the blocks before it may have been taken: their rows must not change any more, nor where this one starts,
           which is where they end; a jump may come back to it from elsewhere
    reach  so many blocks are looked at next time
    most   so many blocks are offered to be taken next time
    """

    begin: int = 0
    stage: BlockRows | None = None
    frame: object = None
    done: int = 0
    reach: int = field(default=LONGEST)
    most: int = field(default=LONGEST)

    def stretch(self, control: ProgramControl, unit: ProgramText, block: int, stop: int) -> BlockRows:
        """The blocks from one on; the control stands before it. `done` is to be set to what has been taken of them."""
        frame = control.modal.incremental, feed_unit(control), *control.offset, *control.scale
        begin, stage = self.begin, self.stage
        known = stage is not None and frame == self.frame and not control.modal.incremental
        if stage is None or not known or not max(begin, self.done) < block < stop <= begin + len(stage.mask):
            begin, stage = block, self._looked(control, unit, block, stop)
            self.begin, self.stage, self.frame = begin, stage, frame
        found = stage.rows(block - begin, stop - begin)
        if block > begin:
            put_right(found, control)
        return found

    def note(self, taken: int, offered: int) -> None:
        """So many of the blocks offered can be taken: where others are in the way again and again, fewer are offered.

        What is offered is gone through to find what is in the way.
        """
        self.most = min(2 * self.most, LONGEST) if taken == offered else max(2 * taken, FEWEST)

    def _looked(self, control: ProgramControl, unit: ProgramText, block: int, stop: int) -> BlockRows:
        """Look at blocks, at twice as many as the last look was good for, but for those to `stop` at least."""
        if control.modal.incremental:
            return stage_of(control, unit, block, stop)
        if self.stage is not None:
            self.reach = min(max(stop - block, 2 * (self.done - self.begin)), LONGEST)
        return stage_of(control, unit, block, min(max(stop, block + self.reach), len(unit.program)))


def put_right(stage: BlockRows, control: ProgramControl) -> None:
    """Let blocks go on from where the control stands."""
    here = np.array(control.position)
    for letter in np.flatnonzero(here.view(np.int64) != stage.path[0].view(np.int64)).tolist():
        stage.path[: rows_before((stage.mask >> letter & 1) != 0) + 1, letter] = here[letter]
    stage.feed[: rows_before(stage.fed)] = control.modal.feed
    stage.motion[: rows_before(stage.coded)] = control.modal.motion


def rows_before(given: Mask) -> int:
    """How many rows (n,) come before the first one that is given."""
    first = int(given.argmax())
    return first if given[first] else len(given)
