"""The fast lane: stretches of straight motions with plain numbers, taken all at once.

It does what the steps of `order.py` would do block by block, with the same operations in the same order, so that the
results are the same to the last bit; a test holds the two together. What it cannot take it leaves alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.program.moves import Kind
from ncfix.program.rs274.builder import Stretch
from ncfix.program.rs274.control import Control
from ncfix.program.rs274.coordinates import N_LETTERS
from ncfix.program.rs274.feeds import INVERSE_TIME, PER_REVOLUTION
from ncfix.program.rs274.plans import Lane
from ncfix.program.rs274.unit import Unit

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SHORTEST = 16
"""Stretches of fewer blocks go one by one."""

LONGEST = 1 << 16
"""Blocks that are taken at once."""


@dataclass(slots=True)
class Words:
    """The words of a stretch as columns, NaN (motion: -1) where there is none: axes (n, 9), feed, motion, axis mask."""

    axes: FloatArray
    feed: FloatArray
    motion: IntArray
    mask: IntArray


def run_lane(control: Control, unit: Unit, block: int, main: bool) -> int:
    """Take the stretch that begins with a block; the number of blocks taken, 0 for none."""
    stop = min(unit.lane_end(block), block + LONGEST)
    if stop - block < SHORTEST or not is_open(control, unit, block):
        return 0
    words = words_of(unit, block, stop)
    motion = filled(words.motion.astype(np.float64), words.motion >= 0, control.modal.motion)
    feed = filled(words.feed, ~np.isnan(words.feed), np.nan)
    count = count_allowed(control, words, motion, feed)
    if count < SHORTEST:
        return 0
    words = Words(words.axes[:count], words.feed[:count], words.motion[:count], words.mask[:count])
    take(control, words, motion[:count], feed[:count], block, main)
    return count


def is_open(control: Control, unit: Unit, block: int) -> bool:
    """Whether the state allows the fast lane at all."""
    modal = control.modal
    lane = unit.plan(block).lane
    begun = modal.motion in (0, 10) or (lane is not None and lane.motion >= 0)
    known = not (control.unknown or control.shaky or control.is_rotated)
    return begun and known and (modal.incremental or control.offset_checked)


def words_of(unit: Unit, start: int, stop: int) -> Words:
    """The words of a stretch."""
    count = stop - start
    program = unit.program
    words = Words(np.full((count, N_LETTERS), np.nan), np.full(count, np.nan), np.full(count, -1), np.zeros(count, int))
    first = program.first_number[start:stop]
    for lane, rows in shapes_of(unit, start, stop):
        for letter, slot in lane.axes:
            words.axes[rows, letter] = program.numbers[first[rows] + slot]
        if lane.feed >= 0:
            words.feed[rows] = program.numbers[first[rows] + lane.feed]
        words.motion[rows] = lane.motion
        words.mask[rows] = sum(1 << letter for letter, _ in lane.axes)
    return words


def shapes_of(unit: Unit, start: int, stop: int) -> Iterator[tuple[Lane, IntArray]]:
    """The shapes of a stretch with the rows that have them."""
    shapes = unit.program.template[start:stop]
    order = np.argsort(shapes, kind="stable")
    edges = np.flatnonzero(np.diff(shapes[order])) + 1
    for rows in np.split(order, edges):
        lane = unit.plan_of_shape(int(shapes[rows[0]])).lane
        assert lane is not None
        yield lane, rows


def filled(values: FloatArray, valid: NDArray[np.bool_], before: float) -> FloatArray:
    """Every row's value, or the last one given above it; `before` where none is."""
    last = np.maximum.accumulate(np.where(valid, np.arange(len(values)), -1))
    return np.where(last >= 0, values[last], before)


def count_allowed(control: Control, words: Words, motion: FloatArray, feed: FloatArray) -> int:
    """How many blocks run before one that the control would refuse for want of a feed."""
    modal = control.modal
    if not control.rules.strict:
        return len(motion)
    at_feed = (motion == 10) & ((words.mask != 0) | (words.motion == 10))
    if modal.feed_mode == INVERSE_TIME:
        refused = at_feed & np.isnan(words.feed)
    elif modal.feed_mode == PER_REVOLUTION and modal.speed == 0.0:
        refused = at_feed
    else:
        missing = np.isnan(feed) & (not modal.feed_given)
        refused = at_feed & (missing | (feed == 0.0))
    return int(np.argmax(refused)) if refused.any() else len(motion)


def take(control: Control, words: Words, motion: FloatArray, feed: FloatArray, block: int, main: bool) -> None:
    """Add the motions of a stretch, and leave the control as they leave it."""
    modal = control.modal
    unit = 1.0 if modal.feed_mode == INVERSE_TIME else modal.unit
    feeds = np.where(np.isnan(feed), modal.feed, unit * feed)
    given = ~np.isnan(words.feed)
    if given.any():
        modal.feed, modal.feed_given = float(feeds[-1]), bool(feeds[-1] != 0.0)
    modal.motion = modal.straight = int(motion[-1])
    rows = np.flatnonzero(words.mask)
    if not len(rows):
        return
    ends = commands(control, words.axes[rows])
    starts = np.vstack((control.position, ends[:-1]))
    styles = np.where(motion[rows] == 0, style(control, Kind.RAPID), style(control, Kind.FEED))
    blocks = block + rows if main else np.full(len(rows), control.row_block)
    control.builder.extend(Stretch(blocks, words.mask[rows], styles, feeds[rows], starts, ends))
    control.position = ends[-1].tolist()
    modal.cycle.initial = None


def commands(control: Control, axes: FloatArray) -> FloatArray:
    """The commands at the ends of motions with these words, (n, 9)."""
    ends = np.empty_like(axes)
    for index in range(N_LETTERS):
        column = axes[:, index]
        valid = ~np.isnan(column)
        here = control.position[index]
        if not valid.any():
            ends[:, index] = here
        elif control.modal.incremental:
            steps = np.where(valid, control.scale[index] * column, 0.0)
            ends[:, index] = np.cumsum(np.append(here, steps))[1:]
        else:
            ends[:, index] = filled(control.offset[index] + control.scale[index] * column, valid, here)
    return ends


def style(control: Control, kind: Kind) -> int:
    """The style of motions whose start and end are known."""
    return control.style_of(kind, 0 if kind == Kind.RAPID else 10)
