"""Blocks of plain numbers as columns: the slots of their numbers, their codes and feeds, and the path they describe.

A stretch is evaluated on its own, or together with many blocks after it.
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
from ncfix.text.tree import Program
from ncfix.values import frozen, mutable

Shapes = NDArray[np.int32]
Before = tuple[float, float, float]
"""mm per unit of an F word (1 under inverse time feed); the feed and the motion code in force before the blocks."""

MAX_BLOCKS_AT_ONCE = 1 << 16
"""Largest number of blocks evaluated at once."""


@frozen
class Lane:
    """A block that is only a straight motion or arc with plain numbers. A slot is the index of a number in the block.

    axes    pairs of letter index and slot
    feed    slot of F, -1 without F
    motion  motion code in tenths (0, 10, 20, 30); -1: the code in force remains
    centre  slots of I, J and K, -1 without the word
    radius  slot of R, -1 without R
    fixed   whether I, J and K count from the origin, in whatever mode
    """

    axes: tuple[tuple[int, int], ...]
    feed: int
    motion: int
    centre: tuple[int, int, int] = (-1, -1, -1)
    radius: int = -1
    fixed: tuple[bool, bool, bool] = (False, False, False)

    @property
    def turns(self) -> bool:
        """Whether the block is an arc."""
        return self.radius >= 0 or max(self.centre) >= 0


@frozen
class LaneTables:
    """The lanes of all block shapes as columns; -1 for a missing word, and throughout for a shape without a lane.

    axes    (s, 9) slot of the word of each axis
    feed    (s,) slot of F
    motion  (s,) motion code in tenths
    mask    (s,) axis words, as bits
    centre  (s, 3) slots of I, J and K
    radius  (s,) slot of R
    fixed   (s, 3) whether I, J and K count from the origin
    turns   (s,) whether the block is an arc
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
        """Make the tables from one lane per shape."""
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
    """A program text that is being executed."""

    @property
    def program(self) -> Program:
        """The program of this text."""

    @property
    def lanes(self) -> LaneTables:
        """The lanes of all block shapes."""


@frozen
class BlockRows:
    """Consecutive blocks evaluated as the control executes them, one row per block.

    path    (n + 1, 9) commanded position before the first block and at the end of each block
    feed    (n,) feed in force, mm/min, 1/min or mm/rev; `fed`: the block has an F word
    motion  (n,) motion code in force, in tenths; `coded`: the block has a motion code
    mask    (n,) axis words, as bits
    turns   (n,) whether the block is an arc; None: no block is
    """

    path: Array
    feed: Array
    fed: Mask
    motion: Array
    coded: Mask
    mask: Ints
    turns: Mask | None = None

    def rows(self, start: int, stop: int) -> BlockRows:
        """The blocks from `start` to before `stop`, as views."""
        own = slice(start, stop)
        path = self.path[start : stop + 1]
        turns = None if self.turns is None else self.turns[own]
        return BlockRows(path, self.feed[own], self.fed[own], self.motion[own], self.coded[own], self.mask[own], turns)

    def only(self, moving: Mask) -> BlockRows:
        """The blocks that make a motion (`moving`, (n,)); the others do not change the position."""
        if moving.all():
            return self
        path = np.concatenate((self.path[:1], self.path[1:].compress(moving, axis=0)))
        names = ["feed", "fed", "motion", "coded", "mask", *(["turns"] if self.turns is not None else [])]
        return replace(self, path=path, **{name: getattr(self, name).compress(moving) for name in names})


def stage_of(control: ProgramControl, unit: ProgramText, start: int, stop: int) -> BlockRows:
    """Evaluate the blocks from `start` to before `stop`, beginning at the present state of the control."""
    program = unit.program
    shapes, first = program.template[start:stop], program.first_number[start:stop]
    before = control.feed_unit, control.modal.feed, float(control.modal.motion)
    stage = followed(control, program.numbers, first, shapes, unit.lanes, before)
    return replace(stage, turns=unit.lanes.turns.take(shapes)) if unit.lanes.turns.any() else stage


def words(numbers: Array, first: Ints, slots: Ints) -> Array:
    """The numbers in the given slots of blocks, NaN for slot -1; `first`: index of each block's first number."""
    given = slots >= 0
    if given.all():
        return numbers.take(first + slots)
    values = numbers.take(first + slots, mode="clip") if len(numbers) else np.empty(len(slots))
    values[np.flatnonzero(~given)] = np.nan
    return values


def followed(
    control: ProgramControl, numbers: Array, first: Ints, shapes: Shapes, tables: LaneTables, before: Before
) -> BlockRows:
    """Evaluate blocks of the given shapes, whose first numbers have the indices `first`."""
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
    """Every row's value, or the last valid one above it; `before` where no row above is valid."""
    if valid.all():
        return values
    last = np.maximum.accumulate(np.where(valid, np.arange(len(values)), -1))
    return np.where(last >= 0, values[last], before)


MIN_OFFERED_BLOCKS = 256
"""Smallest number of blocks offered after a rejection; evaluating so few takes negligible time."""


@mutable
class Lookahead:
    """Blocks evaluated together in advance, from which one stretch after the other is taken.

    Blocks between stretches (arcs, dwells, expressions) are evaluated as if they did nothing. `put_right` corrects that
    at the start of the next stretch: each axis up to its next word, the feed up to the next F, the motion code up to
    the next code. In incremental coordinates (G91) positions depend on the start, and each stretch is evaluated on its
    own.

    begin  index of the first evaluated block; a jump may lead to before it, or to it again from elsewhere
    stage  the evaluated blocks
    frame  coordinate mode, feed unit, offsets and scales with which they were evaluated
    done   end of the blocks that may have been taken. Their rows, and the start position of this block, are in use and
           must not change; a jump may lead back to it from elsewhere
    reach  number of blocks to evaluate next time
    most   largest number of blocks to offer next time
    """

    begin: int = 0
    stage: BlockRows | None = None
    frame: object = None
    done: int = 0
    reach: int = field(default=MAX_BLOCKS_AT_ONCE)
    most: int = field(default=MAX_BLOCKS_AT_ONCE)

    def stretch(self, control: ProgramControl, unit: ProgramText, block: int, stop: int) -> BlockRows:
        """The blocks from `block` to before `stop`, from the present state. The caller then sets `done`."""
        frame = control.modal.incremental, control.feed_unit, *control.offset, *control.scale
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
        """Adapt the number of blocks to offer: fewer where stretches are interrupted again and again.

        All blocks offered are searched for the one that interrupts them, which would be wasted time.
        """
        self.most = min(2 * self.most, MAX_BLOCKS_AT_ONCE) if taken == offered else max(2 * taken, MIN_OFFERED_BLOCKS)

    def _looked(self, control: ProgramControl, unit: ProgramText, block: int, stop: int) -> BlockRows:
        """Evaluate up to twice as many blocks as were used of the last evaluation, and at least those to `stop`."""
        if control.modal.incremental:
            return stage_of(control, unit, block, stop)
        if self.stage is not None:
            self.reach = min(max(stop - block, 2 * (self.done - self.begin)), MAX_BLOCKS_AT_ONCE)
        return stage_of(control, unit, block, min(max(stop, block + self.reach), len(unit.program)))


def put_right(stage: BlockRows, control: ProgramControl) -> None:
    """Correct the first rows of a stage to the present position, feed and motion code of the control."""
    here = np.array(control.position)
    for letter in np.flatnonzero(here.view(np.int64) != stage.path[0].view(np.int64)).tolist():
        stage.path[: rows_before((stage.mask >> letter & 1) != 0) + 1, letter] = here[letter]
    stage.feed[: rows_before(stage.fed)] = control.modal.feed
    stage.motion[: rows_before(stage.coded)] = control.modal.motion


def rows_before(given: Mask) -> int:
    """Number of rows (n,) before the first True; n if there is none."""
    first = int(given.argmax())
    return first if given[first] else len(given)
