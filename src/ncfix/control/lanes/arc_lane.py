"""Arcs in the fast lane: the circles of all arcs of a stretch, as the interpreters find that of one block.

What blocks say is read as columns. Where a centre lies that R says, and whether the control accepts an arc that does
not surely close, is asked of `arcs`, arc by arc.
"""

from __future__ import annotations

import math

import numpy as np

from ncfix import core
from ncfix.control.arcs import CLOCKWISE, COUNTER, FUZZ, ZERO_RADIUS, centre_from_radius, check_closure
from ncfix.control.builder import Circles
from ncfix.control.control import ProgramControl
from ncfix.control.coordinates import IDENTITY, X
from ncfix.control.expressions import Fault
from ncfix.control.lanes.block_rows import BlockRows, FloatArray, IntArray, Mask, ProgramText, words
from ncfix.control.lanes.lane_tables import LaneTables


def turned(control: ProgramControl, unit: ProgramText, block: int, stage: BlockRows) -> tuple[Circles | None, int]:
    """The circles of the arcs of a stage that begins with a block, and how many blocks run before one for `arc`.

    That is what the lane cannot take: an arc that the control refuses, or one without the words that it needs.
    """
    assert stage.turns is not None
    rows = np.flatnonzero(stage.turns | (stage.motion > 10))
    count = fitting(control, unit, block, stage, rows) if rows.size else len(stage.mask)
    rows = rows[stage.turns[rows] & (rows < count)]
    if not rows.size:
        return None, count
    plane = control.modal.plane
    columns = [plane.first, plane.second]
    begin, end = stage.path[rows], stage.path[rows + 1]
    centre, radius = said(control, unit, block + rows, begin)
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
    core.loops("motions").sweeps(centre, np.ascontiguousarray(step), clockwise.view(np.uint8), FUZZ, sweep)
    fixed = np.logical_or(*unit.lanes.fixed[unit.program.template[block + rows]][:, columns].T)
    middle = begin[: len(rows), :3] + local
    return Circles(rows, middle, IDENTITY[plane.across], control.handedness * sweep, fixed), count


def closes(control: ProgramControl, step: FloatArray, centre: FloatArray) -> Mask:
    """(k,) arcs that surely close, from their start to `step` about `centre`; of the others `on_circle` says it."""
    start, end = np.hypot(*centre.T), np.hypot(*(step - centre).T)
    sure: Mask = (np.minimum(start, end) > 2 * ZERO_RADIUS) & (np.abs(start - end) < control.closure_mm / 2)
    return sure


def on_circle(
    control: ProgramControl, end: list[float], centre: list[float], radius: float, *, clockwise: bool
) -> tuple[float, float]:
    """The centre relative to the start, from R (NaN without) or from what centre words say; raises `Fault`."""
    way = end[0], end[1]
    if not math.isnan(radius):
        return centre_from_radius(way, radius, clockwise=clockwise)
    point = centre[0], centre[1]
    check_closure(point, way, control.closure_mm, control.dialect.closure_relative)
    return point


def fitting(control: ProgramControl, unit: ProgramText, block: int, stage: BlockRows, rows: IntArray) -> int:
    """How many blocks run before an arc without the words that it needs, or a straight motion with those of one.

    rows  (k,) the blocks that have such words, or that G2 or G3 is in force at
    """
    assert stage.turns is not None
    turns, motion = stage.turns[rows], stage.motion[rows]
    arcs = (motion == CLOCKWISE) | (motion == COUNTER)
    able = named(control, unit.lanes)[unit.program.template[block + rows]] & is_flat(control, unit, block + rows)
    odd = (turns | (stage.mask[rows] != 0)) & (turns != arcs) | turns & ~able
    return int(rows[np.argmax(odd)]) if odd.any() else len(stage.mask)


def named(control: ProgramControl, lanes: LaneTables) -> Mask:
    """(s,) shapes with the words that an arc needs in the plane in force."""
    plane = control.modal.plane
    if plane.across > 2:
        return np.zeros(len(lanes.turns), dtype=np.bool_)
    first, second = (lanes.centre[:, letter] >= 0 for letter in (plane.first, plane.second))
    centre = first & second if control.modal.arc_absolute else first | second
    ends_there = lanes.mask & (1 << plane.first | 1 << plane.second) != 0
    able: Mask = np.where(lanes.radius >= 0, ends_there, centre)
    return able & ~lanes.fixed[:, X] if control.modal.diameter else able


def is_flat(control: ProgramControl, unit: ProgramText, blocks: IntArray) -> Mask:
    """(k,) blocks without a centre word across the plane in force, or with one that says nothing: no spirals."""
    program, plane = unit.program, control.modal.plane
    if plane.across > 2:
        return np.zeros(len(blocks), dtype=np.bool_)
    slots = unit.lanes.centre[program.template[blocks], plane.across]
    across = words(program.numbers, program.first_number[blocks], slots)
    flat: Mask = np.isnan(across) | ((across == 0.0) & control.takes_zero_across)
    return flat


def said(
    control: ProgramControl, unit: ProgramText, blocks: IntArray, begin: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """What the centre words of blocks say, (k, 2) relative to their starts `begin`, and R, (k,) NaN without; in mm."""
    program, lanes, plane = unit.program, unit.lanes, control.modal.plane
    shapes, first, mm = program.template[blocks], program.first_number[blocks], control.unit_of(X)
    columns = [plane.first, plane.second]
    centre = np.stack([words(program.numbers, first, lanes.centre[shapes, letter]) for letter in columns], axis=1)
    centre = mm * np.where(np.isnan(centre), 0.0, centre)
    fixed = lanes.fixed[shapes][:, columns] | control.modal.arc_absolute
    if fixed.any():
        centre = np.where(fixed, centre - (begin - np.array(control.offset))[:, columns], centre)
    return centre, mm * words(program.numbers, first, lanes.radius[shapes])
