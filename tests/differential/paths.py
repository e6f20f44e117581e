"""Where the control is along its canonical motions: lines, arcs, helices and spirals, and the way back."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from differential.canon import ARC, Canon

Floats = NDArray[np.float64]
Rows = NDArray[np.int64]


BACK = 0.98  # of a turn: a first piece does not go so far, but may end a little behind the start


def sweep(canon: Canon, rows: Rows) -> Floats:
    """Signed angle of arcs (n,), rad, full turns included; a start equal to the end is a full circle."""
    first, second, normal = _arms(canon, rows)
    angle = np.arctan2(np.sum(np.cross(first, second) * normal, axis=1), np.sum(first * second, axis=1))
    turns = canon.turns[rows]
    wrapped = np.where(turns > 0, angle % (2 * np.pi), -((-angle) % (2 * np.pi)))
    full = np.abs(wrapped) < 1e-9
    return np.where(full, 0.0, wrapped) + 2 * np.pi * np.sign(turns) * (np.abs(turns) - 1 + full)


def at(canon: Canon, rows: Rows, fraction: Floats) -> Floats:
    """Machine positions (n, 9) at fractions (n,) of motions; a spiral's radius changes evenly with the angle."""
    start, end, s = canon.start[rows], canon.end[rows], fraction[:, None]
    position = start + s * (end - start)
    arcs = np.flatnonzero(canon.kind[rows] == ARC)
    if arcs.size:
        some, along = rows[arcs], s[arcs]
        first, second, normal = _arms(canon, some)
        grown = 1 + along * (_length(second) / np.maximum(_length(first), 1e-12) - 1)
        middle = canon.centre[some]
        height = np.sum((position[arcs, :3] - middle) * normal, axis=1)[:, None] * normal
        angle = fraction[arcs] * sweep(canon, some)
        position[arcs, :3] = middle + height + grown * _turn(first, normal, angle)
    return position


def fraction_of(canon: Canon, rows: Rows, position: Floats, after: Floats) -> Floats:
    """Fractions (n,) at which motions come nearest to positions (n, 9), not before the fractions `after`.

    On a line by projection over all axes (a degree counts as a mm); on an arc by the angle, the first turn that is
    not before `after`, where 0 says that nothing of the arc is done yet: just behind its start is then its start.
    """
    step = canon.end[rows] - canon.start[rows]
    square = np.sum(step * step, axis=1)
    dot = np.sum((position - canon.start[rows]) * step, axis=1)
    fraction = np.where(square > 0, dot / np.where(square > 0, square, 1.0), 0.0)
    arcs = np.flatnonzero(canon.kind[rows] == ARC)
    if arcs.size:
        fraction[arcs] = _arc_fraction(canon, rows[arcs], position[arcs, :3], after[arcs])
    return np.clip(fraction, 0.0, 1.0)


def turns_before(canon: Canon, rows: Rows, fraction: Floats, begins: NDArray[np.bool_]) -> Floats:
    """What to add to fractions of successive pieces of arcs of many turns, each told as if it were the first turn."""
    falls = np.where(begins, 0, np.diff(fraction, prepend=0.0) < -1e-6)
    total = np.cumsum(falls)
    starts = np.maximum.accumulate(np.where(begins, np.arange(len(rows)), 0))
    arcs = canon.kind[rows] == ARC
    turn = np.where(arcs, 2 * np.pi / np.maximum(np.abs(sweep(canon, rows)), 1e-9), 0.0)
    return (total - total[starts]) * turn


def _arc_fraction(canon: Canon, rows: Rows, position: Floats, after: Floats) -> Floats:
    first, _, normal = _arms(canon, rows)
    arm = position - canon.centre[rows]
    angle = np.arctan2(np.sum(np.cross(first, arm) * normal, axis=1), np.sum(first * arm, axis=1))
    total = sweep(canon, rows)
    turn = 2 * np.pi / np.abs(total)
    fraction = (angle * np.sign(total) % (2 * np.pi)) / np.abs(total)
    fraction = np.where((fraction > BACK * turn) & (after == 0), fraction - turn, fraction)
    return fraction + turn * np.maximum(np.ceil((after - 1e-3 * turn - fraction) / turn), 0.0)


def nearest(
    curve: Callable[[Floats], Floats], point: Floats, fraction: Floats, low: Floats, high: Floats
) -> tuple[Floats, Floats]:
    """Fractions near the given ones at which a curve (fractions (n,) -> (n, 3)) is nearest to points, and distances."""
    h = 1e-4
    for _ in range(2):
        here = curve(fraction)
        slope = (curve(fraction + h) - curve(fraction - h)) / (2 * h)
        square = np.sum(slope * slope, axis=1)
        step = np.sum((point - here) * slope, axis=1) / np.where(square > 1e-12, square, 1.0)
        fraction = np.clip(fraction + np.where(square > 1e-12, step, 0.0), low, high)
    return fraction, _length(point - curve(fraction))[:, 0]


def _arms(canon: Canon, rows: Rows) -> tuple[Floats, Floats, Floats]:
    """From the centre to start and end, in the plane of the arc, and the normal."""
    normal = canon.normal[rows]
    both = (canon.start[rows, :3] - canon.centre[rows], canon.end[rows, :3] - canon.centre[rows])
    first, second = (arm - np.sum(arm * normal, axis=1)[:, None] * normal for arm in both)
    return first, second, normal


def _turn(vector: Floats, normal: Floats, angle: Floats) -> Floats:
    return vector * np.cos(angle)[:, None] + np.cross(normal, vector) * np.sin(angle)[:, None]


def _length(vector: Floats) -> Floats:
    return np.linalg.norm(vector, axis=1)[:, None]
