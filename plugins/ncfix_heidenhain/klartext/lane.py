"""The fast lane of Klartext: whole stretches of straight motions, arcs and poles with plain numbers, taken at once.

It does what the interpreter would do block by block, with the same operations in the same order, so the results are the
same to the last bit; a test compares the two. Blocks that it cannot take are left to the interpreter.

It takes three kinds of arcs, in the plane of X and Y: CR, C about a pole, and CP with IPA. The words of all blocks are
read as columns; circles are worked out arc by arc, with the functions that `arcs` uses.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ncfix.arrays import Array, Ints, Mask
from ncfix.control.arcs import CLOCKWISE, COUNTER, Point, centre_from_radius, check_closure, sweep_angle
from ncfix.control.builder import Circles, MotionColumns
from ncfix.control.coordinates import DEGREE, IDENTITY, PLANES, X, Y, Z
from ncfix.control.expressions import Fault
from ncfix.control.lanes.block_rows import MAX_BLOCKS_AT_ONCE, filled, followed, words
from ncfix.control.lanes.lane import MIN_STRETCH_BLOCKS, before_placing
from ncfix.control.moves import Arc, FeedMode, MotionKind
from ncfix.values import frozen
from ncfix_heidenhain.klartext.arcs import BAD_ARC, FLAT, direction_at_end
from ncfix_heidenhain.klartext.control import KlartextControl
from ncfix_heidenhain.klartext.layout import CORNERS
from ncfix_heidenhain.klartext.targets import arm, pole_frame
from ncfix_heidenhain.klartext.units import FEED, RAPID, KlartextUnit

KINDS = {RAPID: MotionKind.RAPID, FEED: MotionKind.FEED, CLOCKWISE: MotionKind.ARC, COUNTER: MotionKind.ARC}
PLANE = PLANES[170]
ODD = "the interpreter reports more on this arc"


@frozen
class KlartextBlockRows:
    """A stretch of n blocks, one row per block.

    path, feed, mask  as in `BlockRows`; a block that names no axis moves nothing
    motion            (n,) `RAPID`, `FEED`, or the code of an arc
    side              (n,) radius compensation in force: 0, 41 or 42
    """

    path: Array
    feed: Array
    motion: Ints
    side: Ints
    mask: Ints

    def head(self, count: int) -> KlartextBlockRows:
        """The first `count` blocks."""
        return KlartextBlockRows(
            self.path[: count + 1], self.feed[:count], self.motion[:count], self.side[:count], self.mask[:count]
        )


def run_lane(control: KlartextControl, unit: KlartextUnit, block: int) -> tuple[int, int]:
    """Execute as much of the stretch that begins with a block as the fast lane can take.

    Returns how many blocks were executed, and the first block at which it is worth while to try again.
    """
    if not is_open(control):
        return 0, block + 1
    end = unit.lane_end(block)
    stop = before_corner(unit, block, min(end, block + MAX_BLOCKS_AT_ONCE))
    stop = before_placing(control, unit.lanes.words.mask[unit.program.template[block:stop]], block)
    if stop - block < MIN_STRETCH_BLOCKS:
        return 0, min(stop, end) + 1
    stage = stage_of(control, unit, block, stop)
    stage = stage.head(min(count_on_one_turn(control, stage), count_beside(control, stage)))
    circles, count = circles_of(control, unit, block, stage.path, stage.motion)
    if count < MIN_STRETCH_BLOCKS:
        return 0, block + count + 1
    take(control, stage.head(count), unit, block, circles)
    return count, block + count


def before_corner(unit: KlartextUnit, block: int, stop: int) -> int:
    """Where a stretch has to stop: before the last motion if a corner (RND, CHF) follows it."""
    following = unit.next_plan(stop)
    if following is None or following.name not in CORNERS:
        return stop
    shapes = unit.program.template[block:stop]
    busy = np.flatnonzero(~unit.lanes.empty[shapes] & (unit.lanes.pole[shapes, 0] < 0))
    return block + int(busy[-1]) if len(busy) else stop


def is_open(control: KlartextControl) -> bool:
    """Whether the state of the control allows the fast lane at all."""
    modal, path = control.modal, control.path
    known = not (control.unknown or control.composed.unknown) and control.preset_checked and control.tool_called
    turned = control.is_rotated or control.plane_tilted
    special = path.corner or path.by_vector or path.spatial or control.cycle.modal or control.ends is not None
    plain = modal.feed_mode == FeedMode.PER_MINUTE and not (modal.incremental or modal.arc_absolute)
    return known and plain and not (turned or special)


def stage_of(control: KlartextControl, unit: KlartextUnit, start: int, stop: int) -> KlartextBlockRows:
    """The rows of a stretch; CP does not lead anywhere yet (see `PolarArcEnds`)."""
    program, tables = unit.program, unit.lanes
    shapes, first = program.template[start:stop], program.first_number[start:stop]
    found = followed(
        control, program.numbers, first, shapes, tables.words, (control.modal.per_feed, control.modal.feed, RAPID)
    )
    own = tables.side[shapes]
    side = filled(own.astype(np.float64), own >= 0, control.modal.compensated).astype(np.int64)
    return KlartextBlockRows(found.path, found.feed, tables.words.motion[shapes], side, found.mask)


def count_on_one_turn(control: KlartextControl, stage: KlartextBlockRows) -> int:
    """The number of blocks before the first in which a rotary axis takes the shorter way past a turn (M126)."""
    if not control.shortest:
        return len(stage.feed)
    turns = np.zeros(len(stage.feed), dtype=np.bool_)
    for index in control.axis_indices:
        if control.rotary[index]:
            turns |= np.rint(np.diff(stage.path[:, index]) / (2 * math.pi)) != 0
    return int(np.argmax(turns)) if turns.any() else len(turns)


def count_beside(control: KlartextControl, stage: KlartextBlockRows) -> int:
    """The number of blocks before the first that ends radius compensation (R0) or is an arc under compensation.

    In such a block it matters which axes have words, so the interpreter takes it.
    """
    before = np.append(control.modal.compensated, stage.side[:-1])
    ends = (before != 0) & ((stage.side == 0) | (stage.motion > FEED))
    return int(np.argmax(ends)) if ends.any() else len(ends)


def take(control: KlartextControl, stage: KlartextBlockRows, unit: KlartextUnit, block: int, circles: Circles) -> None:
    """Add the motions of a stretch, and bring the control into the state after it; `circles`: those of its arcs."""
    shapes = unit.program.template[block : block + len(stage.feed)]
    control.resume("M130")
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


def styles_of(control: KlartextControl, motion: Ints, side: Ints, relative: Mask) -> Ints:
    """(n,) the styles of motions whose start and end are known; `relative`: they depend on where they start."""
    styles = np.empty(len(motion), dtype=np.int64)
    keys = (side << 6 | motion) << 1 | relative
    for key in np.flatnonzero(np.bincount(keys)).tolist():
        code = key >> 1 & 63
        control.modal.compensated, control.modal.incremental = key >> 7, bool(key & 1)
        styles[keys == key] = control.style_of(KINDS[code], code)
    control.modal.incremental = False
    return styles


def keep_tangent(control: KlartextControl, path: Array, circles: Circles) -> None:
    """Note the direction in which the last motion that had a length ended."""
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


# -- arcs -------------------------------------------------------------------------------------------------------------


class ArcBlock(NamedTuple):
    """The block of an arc.

    name       `cr`, `c` or `cp`
    value      R or IPA
    clockwise  DR-, not DR+
    end        X and Y, mm; NaN without a word
    pole       the pole in force, mm; None if there is none that an arc can use
    """

    name: str
    value: float
    clockwise: bool
    end: Point
    pole: Point | None


def circles_of(
    control: KlartextControl, unit: KlartextUnit, start: int, path: Array, motion: Ints
) -> tuple[Circles, int]:
    """The circles of the arcs of a stretch, and the number of blocks before the first that the fast lane cannot take.

    start   first block of the stretch
    path    (n + 1, 9) commands before the first block and at the end of each; the ends of CP are filled in here
    motion  (n,) motion codes
    """
    shapes, count = unit.program.template[start : start + len(motion)], len(motion)
    rows = np.flatnonzero((unit.lanes.arc != "")[shapes])
    offset, found, swung = control.offset, [], PolarArcEnds(unit, path, shapes)
    for row, arc in zip(rows.tolist(), arcs_of(control, unit, start, shapes, rows, motion), strict=True):
        x, y, z = path[row, :3].tolist()
        begin = x - offset[X], y - offset[Y]
        try:
            end = end_of(control, arc, begin)
            centre, sweep = circle(control, arc, begin, end)
        except Fault:
            count = row
            break
        if arc.name == "cp":
            swung.lead(row, (end[0] + offset[X], end[1] + offset[Y]))
        found.append((x + centre[0], y + centre[1], z + 0.0, sweep))
    table, rows = np.array(found, dtype=np.float64).reshape(-1, 4), rows[: len(found)]
    return Circles(rows, table[:, :3], IDENTITY[Z], table[:, 3], unit.lanes.arc[shapes[rows]] == "c"), count


def arcs_of(
    control: KlartextControl,
    unit: KlartextUnit,
    start: int,
    shapes: NDArray[np.int32],
    rows: Ints,
    motion: Ints,
) -> list[ArcBlock]:
    """The blocks of the arcs in these `rows` (k,) of a stretch."""
    program, lanes, first = unit.program, unit.lanes, unit.program.first_number[start + rows]
    own = shapes[rows]
    x, y = (0.0 + control.scale[axis] * words(program.numbers, first, lanes.words.axes[own, axis]) for axis in (X, Y))
    places, (pole_x, pole_y) = poles_of(control, unit, start, shapes)
    poles = [pole_before(control), *zip(pole_x.tolist(), pole_y.tolist(), strict=True)]
    return list(
        map(
            ArcBlock,
            lanes.arc[own].tolist(),
            words(program.numbers, first, lanes.value[own]).tolist(),
            (motion[rows] == CLOCKWISE).tolist(),
            zip(x.tolist(), y.tolist(), strict=True),
            [poles[place] for place in np.searchsorted(places, rows).tolist()],
        )
    )


def poles_of(
    control: KlartextControl, unit: KlartextUnit, start: int, shapes: NDArray[np.int32]
) -> tuple[Ints, tuple[Array, Array]]:
    """The rows of a stretch that set a pole (CC), and the poles, mm along X and Y of the program's frame."""
    slots = unit.lanes.pole[shapes]
    places = np.flatnonzero(slots[:, 0] >= 0)
    first = unit.program.first_number[start + places]
    x, y = (0.0 + control.scale[axis] * unit.program.numbers[first + slots[places, axis]] for axis in (X, Y))
    return places, (x, y)


def pole_before(control: KlartextControl) -> Point | None:
    """The pole in force, if it lies in the plane of X and Y and the frame has not changed since; else None."""
    path = control.path
    return path.pole if path.plane == PLANE and path.pole_in == pole_frame(control) else None


def end_of(control: KlartextControl, arc: ArcBlock, begin: Point) -> Point:
    """The end of an arc, mm along X and Y of the program's frame."""
    if arc.name != "cp":
        x, y = arc.end
        return begin[0] if math.isnan(x) else x, begin[1] if math.isnan(y) else y
    if arc.pole is None:
        raise Fault(BAD_ARC, ODD)
    away = begin[0] - arc.pole[0], begin[1] - arc.pole[1]
    radius, angle = arm({"IPA": arc.value}, away, control.stretch)
    return arc.pole[0] + radius * math.cos(angle), arc.pole[1] + radius * math.sin(angle)


def circle(control: KlartextControl, arc: ArcBlock, begin: Point, end: Point) -> tuple[Point, float]:
    """The centre of an arc from its start, and its sweep; raises `Fault` where the interpreter has to decide."""
    away, clockwise = (end[0] - begin[0], end[1] - begin[1]), arc.clockwise
    if arc.name == "cr":
        centre = centre_from_radius(away, control.stretch * arc.value, clockwise=clockwise)
        return centre, sweep_angle(centre, away, 1, clockwise=clockwise)
    if arc.pole is None:
        raise Fault(BAD_ARC, ODD)
    centre = arc.pole[0] - begin[0], arc.pole[1] - begin[1]
    if arc.name == "c":
        check_closure(centre, away, control.dialect.closure_mm, control.dialect.closure_relative)
        return centre, sweep_angle(centre, away, 1, clockwise=clockwise)
    if math.hypot(*centre) < FLAT or arc.value == 0.0 or (arc.value < 0.0) != clockwise:
        raise Fault(BAD_ARC, ODD)
    return centre, arc.value * DEGREE


class PolarArcEnds:
    """Fills in the ends of CP, which has no X and Y: they hold until a later block names X or Y.

    path  (n + 1, 9) as in `circles_of`; changed in place
    """

    def __init__(self, unit: KlartextUnit, path: Array, shapes: NDArray[np.int32]) -> None:
        self.path = path
        turning = (unit.lanes.arc == "cp")[shapes]
        told = [(unit.lanes.words.axes[shapes, axis] >= 0) | turning for axis in (X, Y)] if turning.any() else []
        self.told = [np.append(np.flatnonzero(each), len(shapes)) for each in told]

    def lead(self, row: int, end: Point) -> None:
        """Fill in the command at the end of the arc in a row."""
        for axis, told in zip((X, Y), self.told, strict=True):
            stop = told[np.searchsorted(told, row, side="right")]
            self.path[row + 1 : stop + 1, axis] = end[axis]


def keep_pole(control: KlartextControl, unit: KlartextUnit, start: int, shapes: NDArray[np.int32]) -> None:
    """Put the last pole that a stretch sets into force."""
    _, (x, y) = poles_of(control, unit, start, shapes)
    if len(x):
        control.path.plane, control.path.pole = PLANE, (float(x[-1]), float(y[-1]))
        control.path.pole_in = pole_frame(control)
