"""How far axes can stray from the straight way between two positions while tool-centre-point control leads them.

The tip goes straight in the workpiece, at even speed, and the rotary axes turn evenly by angles that together are S. A
point at most r away from every line about which it is turned then has an acceleration, in the base frame and with the
fraction of the motion as time, of at most S^2 r + 2 S P, where P is the way of the tip in the workpiece. Whatever has
no more acceleration than that strays by no more than an eighth of it from its chord.
"""

from __future__ import annotations

import numpy as np

from ncfix.compensate.findings import Array, Mask
from ncfix.compensate.kinematics import linear_columns
from ncfix.compensate.rows import lengths
from ncfix.machine import Machine


def surely_within(machine: Machine, begin: Array, end: Array, tool_length: float) -> Mask:
    """(k,) motions that cannot leave the range of an axis between positions begin and end (k, n_axes), mm and rad.

    tool_length  mm, the longest
    """
    share = skew(machine)
    if share is None:
        return np.zeros(len(begin), dtype=bool)
    turning = machine.rotary
    turn = np.abs(end - begin)[:, turning].sum(axis=1)
    way = lengths((end - begin)[:, ~turning])
    pivots = sum(float(np.linalg.norm(axis.point)) for axis in machine.axes if axis.rotary)
    fixed = tool_length + float(np.linalg.norm(machine.tool.point)) + 4 * pivots
    fixed += float(np.linalg.norm(machine.workpiece_offset))
    arm = 2 * (np.maximum(lengths(begin[:, ~turning]), lengths(end[:, ~turning])) + fixed)
    stray = share * (3 * turn**2 * arm + 2 * turn * way) / 8
    low, high = machine.ranges.T
    room = np.minimum(np.minimum(begin, end) - low, high - np.maximum(begin, end))
    return np.asarray((room[:, ~turning] > stray[:, None]).all(axis=1) & (room[:, turning] >= 0).all(axis=1))


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
