"""Arcs in the fast lane of Klartext: CR, C about a pole, and CP by an angle, in the plane of X and Y.

What blocks say is read as columns; where a circle lies is worked out arc by arc, with what `arcs` uses.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ncfix.control.arcs import CLOCKWISE, Point, centre_from_radius, check_closure, sweep_angle
from ncfix.control.builder import Circles
from ncfix.control.coordinates import DEGREE, IDENTITY, PLANES, X, Y, Z
from ncfix.control.expressions import Fault
from ncfix.control.lanes.block_rows import words
from ncfix_heidenhain.klartext.arcs import BAD_ARC, FLAT
from ncfix_heidenhain.klartext.control import KlartextControl
from ncfix_heidenhain.klartext.targets import arm, pole_frame
from ncfix_heidenhain.klartext.units import KlartextUnit

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

PLANE = PLANES[170]
ODD = "of this arc the interpreter has more to say"


class ArcBlock(NamedTuple):
    """What the block of an arc says: its name, R or IPA, sense, X and Y (NaN without), and the pole in force."""

    name: str
    value: float
    clockwise: bool
    end: Point
    pole: Point | None


def turned(
    control: KlartextControl, unit: KlartextUnit, start: int, path: FloatArray, motion: IntArray
) -> tuple[Circles, int]:
    """The circles of the arcs of a stretch that begins with a block, and how many blocks run before one it cannot take.

    path    (n + 1, 9) commands before the first block and at the end of each; put right behind a CP, which says by an
            angle where it ends
    motion  (n,) motion codes
    """
    shapes, count = unit.program.template[start : start + len(motion)], len(motion)
    rows = np.flatnonzero((unit.lanes.arc != "")[shapes])
    offset, found, swung = control.offset, [], Swung(unit, path, shapes)
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
    rows: IntArray,
    motion: IntArray,
) -> list[ArcBlock]:
    """What the blocks of arcs `rows` (k,) say."""
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
) -> tuple[IntArray, tuple[FloatArray, FloatArray]]:
    """Which blocks of a stretch set a pole (CC), and where: mm along X and Y of the program's frame."""
    slots = unit.lanes.pole[shapes]
    places = np.flatnonzero(slots[:, 0] >= 0)
    first = unit.program.first_number[start + places]
    x, y = (0.0 + control.scale[axis] * unit.program.numbers[first + slots[places, axis]] for axis in (X, Y))
    return places, (x, y)


def pole_before(control: KlartextControl) -> Point | None:
    """The pole in force, if an arc in the plane of X and Y may turn about it."""
    path = control.path
    return path.pole if path.plane == PLANE and path.pole_in == pole_frame(control) else None


def end_of(control: KlartextControl, arc: ArcBlock, begin: Point) -> Point:
    """Where an arc ends, along the axes of the program's frame."""
    if arc.name != "cp":
        x, y = arc.end
        return begin[0] if math.isnan(x) else x, begin[1] if math.isnan(y) else y
    if arc.pole is None:
        raise Fault(BAD_ARC, ODD)
    away = begin[0] - arc.pole[0], begin[1] - arc.pole[1]
    radius, angle = arm({"IPA": arc.value}, away, control.stretch)
    return arc.pole[0] + radius * math.cos(angle), arc.pole[1] + radius * math.sin(angle)


def circle(control: KlartextControl, arc: ArcBlock, begin: Point, end: Point) -> tuple[Point, float]:
    """The centre of an arc from its start, and its sweep; raises `Fault` where the interpreter has more to say."""
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


class Swung:
    """Where arcs end that say so by an angle: from there on X and Y stand there, until the next word.

    path  (n + 1, 9) as in `turned`
    """

    def __init__(self, unit: KlartextUnit, path: FloatArray, shapes: NDArray[np.int32]) -> None:
        self.path = path
        turning = (unit.lanes.arc == "cp")[shapes]
        told = [(unit.lanes.words.axes[shapes, axis] >= 0) | turning for axis in (X, Y)] if turning.any() else []
        self.told = [np.append(np.flatnonzero(each), len(shapes)) for each in told]

    def lead(self, row: int, end: Point) -> None:
        """The arc of a row leads to a command."""
        for axis, told in zip((X, Y), self.told, strict=True):
            stop = told[np.searchsorted(told, row, side="right")]
            self.path[row + 1 : stop + 1, axis] = end[axis]


def keep_pole(control: KlartextControl, unit: KlartextUnit, start: int, shapes: NDArray[np.int32]) -> None:
    """The last pole that a stretch from block `start` on sets is in force behind it."""
    _, (x, y) = poles_of(control, unit, start, shapes)
    if len(x):
        control.path.plane, control.path.pole = PLANE, (float(x[-1]), float(y[-1]))
        control.path.pole_in = pole_frame(control)
