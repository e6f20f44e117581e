"""The fast lane: stretches of straight motions and arcs with plain numbers, executed in numpy, all blocks at once.

It applies the operations of the interpreter in the same order as block by block, so that results are identical to the
last bit; a test compares the two. Blocks that it cannot execute are left to the interpreter.

Arcs: the words of the blocks are read as columns. The centre of an arc given by R, and whether the control accepts an
arc whose radii at start and end differ, is computed by `arcs`, arc by arc.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

import numpy as np

from ncfix import core
from ncfix.arrays import Array, Ints, Mask
from ncfix.control.arcs import CLOCKWISE, COUNTER, MIN_RADIUS_MM, MIN_SWEEP_RAD, centre_from_radius, check_closure
from ncfix.control.builder import Circles, MotionColumns
from ncfix.control.control import ProgramControl
from ncfix.control.coordinates import IDENTITY, X, mask_of
from ncfix.control.expressions import Fault
from ncfix.control.lanes.block_rows import BlockRows, Lane, LaneTables, Lookahead, ProgramText, rows_before, words
from ncfix.control.moves import FeedMode, MotionKind

MIN_STRETCH_BLOCKS = 16
"""Smallest number of blocks in a stretch; shorter stretches are executed block by block."""
ARCS = (CLOCKWISE, COUNTER)


class HasLane(Protocol):
    """The plan of a block, as far as the fast lane uses it."""

    @property
    def lane(self) -> Lane | None:
        """The slots of the block's numbers, or None if it must not go through the fast lane."""


class LaneText(ProgramText, Protocol):
    """A program text whose stretches can go through the fast lane."""

    @property
    def ahead(self) -> Lookahead:
        """The blocks evaluated in advance."""

    def plan(self, block: int) -> HasLane:
        """The plan of a block."""

    def lane_end(self, block: int) -> int:
        """The first block from `block` on that cannot go through the fast lane."""


Turned = tuple[Circles | None, int]
"""The circles of the arcs of a stage, and the number of its blocks before the first that the lane cannot execute."""


def run_lane(
    control: ProgramControl,
    unit: LaneText,
    block: int,
    main: bool,
    turned: Callable[[int, BlockRows], Turned] | None = None,
) -> int:
    """Execute the stretch that begins with `block`. Return the number of blocks executed, 0 if there is none.

    turned  for languages that have arcs in the fast lane: finds the circles of the stage that begins with `block`
    """
    stop = min(unit.lane_end(block), block + unit.ahead.most)
    if stop - block < MIN_STRETCH_BLOCKS or not is_open(control, unit, block):
        return 0
    stage = unit.ahead.stretch(control, unit, block, stop)
    count, circles = min(before_placing(control, stage.mask, 0), count_allowed(control, stage)), None
    if control.turns_in_plane and (turning := stage.mask[:count] & mask_of(control.turning)).any():
        count = int(np.argmax(turning != 0))
    if turned is not None and stage.turns is not None and count >= MIN_STRETCH_BLOCKS:
        circles, count = turned(block, stage.rows(0, count))
    unit.ahead.note(count, stop - block)
    if count < MIN_STRETCH_BLOCKS:
        return 0
    unit.ahead.done = block + count
    take(control, stage.rows(0, count), block, main, circles)
    return count


def is_open(control: ProgramControl, unit: LaneText, block: int) -> bool:
    """Whether the modal state permits the fast lane."""
    modal = control.modal
    lane = unit.plan(block).lane
    begun = modal.motion in (0, 10) or (lane is not None and (lane.motion >= 0 or lane.turns))
    known = not (control.unknown or control.composed.unknown or control.is_rotated)
    return begun and known and (modal.incremental or control.offset_checked)


def before_placing(control: ProgramControl, mask: Ints, block: int) -> int:
    """The first block that names an axis whose position is unknown; `block` + n if none of n does (`mask`: (n,)).

    That block is executed by the interpreter, so that in a stretch the same axes are unplaced throughout.
    """
    if not control.places.unplaced or control.modal.incremental:
        return block + len(mask)
    placing = (mask & control.places.unplaced) != 0
    return block + (int(np.argmax(placing)) if placing.any() else len(mask))


def count_allowed(control: ProgramControl, stage: BlockRows) -> int:
    """Number of blocks before the first that is refused for lack of a feed, or of an F under inverse time feed."""
    modal, count = control.modal, len(stage.mask)
    exact = control.needs_feed or modal.feed_mode == FeedMode.INVERSE_TIME
    if not exact or (modal.feed_mode == FeedMode.PER_MINUTE and modal.feed_given and stage.feed.all()):
        return count
    at_feed = (stage.motion >= 10) & (moving(stage) | stage.coded)
    if modal.feed_mode == FeedMode.INVERSE_TIME:
        refused = at_feed & ~stage.fed
    elif modal.feed_mode == FeedMode.PER_REVOLUTION and modal.speed == 0.0:
        refused = at_feed
    else:
        refused, unfed = at_feed & (stage.feed == 0.0), rows_before(stage.fed)
        refused[:unfed] = at_feed[:unfed] & (not modal.feed_given)
    return int(np.argmax(refused)) if refused.any() else count


def moving(stage: BlockRows) -> Mask:
    """(n,) blocks that make a motion: they have axis words or are arcs."""
    named: Mask = stage.mask != 0
    return named if stage.turns is None else named | stage.turns


def take(control: ProgramControl, stage: BlockRows, block: int, main: bool, circles: Circles | None = None) -> None:
    """Add the motions of a stretch and update the state of the control; `circles`: of its arcs, by block."""
    modal, moves = control.modal, moving(stage)
    note_codes(control, stage)
    if not moves.any():
        return
    rows = np.empty(0, dtype=np.int64) if circles is None else np.cumsum(moves)[circles.row] - 1
    blocks, stage = np.arange(block, block + len(moves)), stage.only(moves)
    blocks = blocks.compress(moves) if main else np.full(len(stage.mask), control.row_block)
    control.places.begun = True
    plane, unplaced = control.still_beside(0), np.full(len(blocks), control.places.unplaced)
    if plane:
        unplaced |= np.where(stage.mask & plane != 0, 0, plane)
    path = stage.path
    stretch = MotionColumns(blocks, stage.mask, styles(control, stage), stage.feed, path[:-1], path[1:], unplaced, path)
    if plane:
        resting = control.resting_of_many(stretch.programmed, stretch.start, stretch.end)
        resting[rows] = 0
        control.builder.many_rest(resting)
    if circles is not None:
        control.builder.circles(circles._replace(row=rows))
    control.builder.extend(stretch)
    control.position = path[-1].tolist()
    modal.cycle.initial = None


def note_codes(control: ProgramControl, stage: BlockRows) -> None:
    """Update the feed and the motion codes in force after a stretch."""
    modal = control.modal
    modal.motion = int(stage.motion[-1])
    straight = stage.motion[-1:] if modal.motion <= 10 else stage.motion[stage.motion <= 10]
    if straight.size:
        modal.straight = int(straight[-1])
    if stage.fed.any():
        modal.feed = float(stage.feed[-1])
        modal.feed_given = modal.feed != 0.0


def styles(control: ProgramControl, stage: BlockRows) -> Ints:
    """The styles of the motions of a stretch, (n,); their start and end are known."""
    found = np.full(len(stage.motion), control.style_of(MotionKind.FEED, 10))
    rapid = stage.motion == 0
    if rapid.any():
        found[rapid] = control.style_of(MotionKind.RAPID, 0)
    for code in () if stage.turns is None or not stage.turns.any() else ARCS:
        if (round_ := stage.motion == code).any():
            found[round_] = control.style_of(MotionKind.ARC, code)
    return found


# -- arcs --------------------------------------------------------------------------------------------------------------


def turned(control: ProgramControl, unit: ProgramText, block: int, stage: BlockRows) -> tuple[Circles | None, int]:
    """The circles of the arcs of a stage that begins with `block`, and the number of blocks before one left to `arc`.

    The lane leaves out an arc that the control refuses, or one that lacks words.
    """
    assert stage.turns is not None
    rows = np.flatnonzero(stage.turns | (stage.motion > 10))
    count = fitting(control, unit, block, stage, rows) if rows.size else len(stage.mask)
    rows = rows[stage.turns[rows] & (rows < count)]
    if not rows.size:
        return None, count
    plane = control.modal.plane
    columns = list(plane.pair)
    begin, end = stage.path[rows], stage.path[rows + 1]
    centre, radius = centre_words(control, unit, block + rows, begin)
    step, clockwise = (end - begin)[:, columns], stage.motion[rows] == CLOCKWISE
    for k in np.flatnonzero(~(np.isnan(radius) & closes(control, step, centre))).tolist():
        way, point = step[k].tolist(), centre[k].tolist()
        try:
            centre[k] = on_circle(control, way, point, float(radius[k]), clockwise=bool(clockwise[k]))
        except Fault:
            count, rows = int(rows[k]), rows[:k]
            break
    local, sweep = np.zeros((len(rows), 3)), np.empty(len(rows))
    local[:, columns] = centre[: len(rows)]
    core.loops("motions").sweeps(centre, np.ascontiguousarray(step), clockwise.view(np.uint8), MIN_SWEEP_RAD, sweep)
    fixed = np.logical_or(*unit.lanes.fixed[unit.program.template[block + rows]][:, columns].T)
    middle = begin[: len(rows), :3] + local
    return Circles(rows, middle, IDENTITY[plane.across], control.handedness * sweep, fixed), count


def closes(control: ProgramControl, step: Array, centre: Array) -> Mask:
    """(k,) arcs whose radii at start and end (`step` from the start) surely agree; `on_circle` decides on others."""
    start, end = np.hypot(*centre.T), np.hypot(*(step - centre).T)
    return (np.minimum(start, end) > 2 * MIN_RADIUS_MM) & (np.abs(start - end) < control.closure_mm / 2)


def on_circle(
    control: ProgramControl, end: list[float], centre: list[float], radius: float, *, clockwise: bool
) -> tuple[float, float]:
    """The centre relative to the start, mm, from R (NaN without R) or the given centre; raises `Fault` if refused."""
    way = end[0], end[1]
    if not math.isnan(radius):
        return centre_from_radius(way, radius, clockwise=clockwise)
    point = centre[0], centre[1]
    check_closure(point, way, control.closure_mm, control.dialect.closure_relative)
    return point


def fitting(control: ProgramControl, unit: ProgramText, block: int, stage: BlockRows, rows: Ints) -> int:
    """Number of blocks before the first arc that lacks words or is a spiral, or straight motion with an arc's words.

    rows  (k,) the blocks that have words of arcs, or in which G2 or G3 is in force
    """
    assert stage.turns is not None
    turns, motion = stage.turns[rows], stage.motion[rows]
    arcs = (motion == CLOCKWISE) | (motion == COUNTER)
    able = named(control, unit.lanes)[unit.program.template[block + rows]] & is_flat(control, unit, block + rows)
    odd = (turns | (stage.mask[rows] != 0)) & (turns != arcs) | turns & ~able
    return int(rows[np.argmax(odd)]) if odd.any() else len(stage.mask)


def named(control: ProgramControl, lanes: LaneTables) -> Mask:
    """(s,) block shapes that have the words of an arc in the active plane: its centre, or R and an end in the plane."""
    plane = control.modal.plane
    if plane.across > 2:
        return np.zeros(len(lanes.turns), dtype=np.bool_)
    first, second = (lanes.centre[:, letter] >= 0 for letter in plane.pair)
    centre = first & second if control.modal.arc_absolute else first | second
    ends_there = lanes.mask & (1 << plane.first | 1 << plane.second) != 0
    able: Mask = np.where(lanes.radius >= 0, ends_there, centre)
    return able & ~lanes.fixed[:, X] if control.modal.diameter else able


def is_flat(control: ProgramControl, unit: ProgramText, blocks: Ints) -> Mask:
    """(k,) blocks without a centre word across the active plane, or with one that has no effect: no spirals."""
    program, plane = unit.program, control.modal.plane
    if plane.across > 2:
        return np.zeros(len(blocks), dtype=np.bool_)
    slots = unit.lanes.centre[program.template[blocks], plane.across]
    across = words(program.numbers, program.first_number[blocks], slots)
    return np.isnan(across) | ((across == 0.0) & control.takes_zero_across)


def centre_words(control: ProgramControl, unit: ProgramText, blocks: Ints, begin: Array) -> tuple[Array, Array]:
    """Centres (k, 2), mm, relative to the start points `begin`, and radii R (k,), mm, NaN without R, of arc blocks."""
    program, lanes, plane = unit.program, unit.lanes, control.modal.plane
    shapes, first, mm = program.template[blocks], program.first_number[blocks], control.unit_of(X)
    columns = list(plane.pair)
    centre = np.stack([words(program.numbers, first, lanes.centre[shapes, letter]) for letter in columns], axis=1)
    centre = mm * np.where(np.isnan(centre), 0.0, centre)
    fixed = lanes.fixed[shapes][:, columns] | control.modal.arc_absolute
    if fixed.any():
        centre = np.where(fixed, centre - (begin - np.array(control.offset))[:, columns], centre)
    return centre, mm * words(program.numbers, first, lanes.radius[shapes])
