"""How far axes can stray from the straight way between two positions while tool-centre-point control leads them.

The tip goes straight in the workpiece, at even speed, and the rotary axes under the workpiece turn evenly by angles
that together are S. A point at most r away from every line about which it is turned then has an acceleration, in the
base frame and with the fraction of the motion as time, of at most S^2 r + 2 S P, where P is the way of the tip in the
workpiece; where rotary axes carry the tool, its tip has one more, of at most S^2 r with the S and r of these. Whatever
has no more acceleration than that strays by no more than an eighth of it from its chord. A straight way in the
workpiece is nowhere farther from a pivot than at one of its ends.
"""

from __future__ import annotations

import numpy as np

from ncfix.compensate.findings import Array, Index, Mask
from ncfix.compensate.kinematics import linear_columns
from ncfix.compensate.rows import every, lengths
from ncfix.compensate.segments import Segments, height
from ncfix.machine import Machine


def surely_within(machine: Machine, begin: Array, end: Array, tool_length: float) -> Mask:
    """(k,) motions that cannot leave the range of an axis between positions begin and end (k, n_axes), mm and rad.

    tool_length  mm, the longest
    """
    acceleration = accelerations(machine, begin, end, tool_length)
    if acceleration is None:
        return np.zeros(len(begin), dtype=bool)
    return stays_within(machine, begin, end, acceleration)


def stays_within(machine: Machine, begin: Array, end: Array, acceleration: Array) -> Mask:
    """As `surely_within`, of motions with these accelerations at most (k,), see below."""
    turning, stray = machine.rotary, acceleration / 8
    low, high = machine.ranges.T
    room = np.minimum(np.minimum(begin, end) - low, high - np.maximum(begin, end))
    return every((room >= 0) & ((room > stray[:, None]) | turning))


def arcs_within(machine: Machine, arcs: Segments) -> Mask:
    """(k,) arcs of commands that are axis positions which cannot leave the range of an axis.

    What is between both ends in height is no farther from the arc's axis than the farther end; other axes go straight.
    """
    begin, end, reach = arcs.start.copy(), arcs.end.copy(), np.zeros(arcs.end.shape)
    for ends in (begin, end):
        points = ends[:, arcs.columns]
        feet = arcs.centre + height(points - arcs.centre, arcs.normal) * arcs.normal
        reach[:, arcs.columns] = np.maximum(reach[:, arcs.columns], lengths(points - feet)[:, None])
        ends[:, arcs.columns] = feet
    low, high = machine.ranges.T
    return every(np.minimum(np.minimum(begin, end) - low, high - np.maximum(begin, end)) >= reach)


def accelerations(
    machine: Machine, begin: Array, end: Array, tool_length: float, way: Array | None = None
) -> Array | None:
    """What no linear axis exceeds along motions between positions begin and end (k, n_axes), (k,) mm per motion^2.

    tool_length  mm, the longest
    way          (k,) mm: of the tip in the workpiece, if known

    None where rotary axes carry some of X, Y and Z along.
    """
    share = skew(machine)
    if share is None:
        return None
    table, head = (_pivots(machine, side) for side in (True, False))
    origin, ways = machine.at_zero
    base, travel = origin + machine.workpiece_offset, np.abs(end - begin)
    turning, tilting = (travel[:, columns].sum(axis=1) for columns, _ in (table, head))
    swing = _reach(head[1][::-1], base) + tool_length if len(head[1]) else 0.0
    first, last = (q @ ways + base for q in (begin, end))
    arm = np.zeros(len(begin))
    if len(table[1]):
        outermost = table[1][-1]
        arm += np.maximum(lengths(first - outermost), lengths(last - outermost))
        arm += tool_length + 2 * swing + 2 * _reach(table[1], table[1][0])
    if way is None:
        way = lengths(last - first) + turning * arm + tilting * swing
    result: Array = share * (turning**2 * arm + 2 * turning * way + tilting**2 * swing)
    return result


def _pivots(machine: Machine, workpiece_side: bool) -> tuple[Index, Array]:
    """The rotary axes on one side, in the order of the chain: their columns, and points on their lines (k, 3) mm."""
    found = [k for k, axis in enumerate(machine.axes) if axis.rotary and axis.workpiece_side == workpiece_side]
    points = np.array([machine.axes[k].point for k in found]).reshape(-1, 3)
    return np.array(found, dtype=np.intp), points


def _reach(pivots: Array, point: Array) -> float:
    """How far a point is from pivots (k, 3) at most, mm, whatever turns it about the first, that about the next, ..."""
    return float(lengths(np.diff(np.vstack((point, pivots)), axis=0)).sum())


def skew(machine: Machine) -> float | None:
    """How far X, Y and Z may have to go for 1 mm of way; None where rotary axes carry them along."""
    nested = (
        [axis for axis in machine.axes if axis.workpiece_side][::-1],
        [axis for axis in machine.axes if not axis.workpiece_side],
    )
    for branch in nested:
        kinds = [axis.rotary for axis in branch]
        if sorted(kinds) != kinds:
            return None
    ways = np.array([machine.axes[column].direction for column in linear_columns(machine)])
    least = float(np.linalg.svd(ways, compute_uv=False)[-1])
    return None if least < FLAT else 1 / least


FLAT = 1e-3
"""Directions of X, Y and Z that span less lie in a plane."""
