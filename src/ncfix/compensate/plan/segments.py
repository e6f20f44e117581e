"""Lines and arcs of commands, and bounds of how far axes deviate from straight motion along them.

Axes deviate under tool-centre-point control. The tip moves straight and evenly in the workpiece, while the rotary axes
under the workpiece turn evenly by angles whose sum is S. With the fraction of the motion as time, a point within r of
every line about which it is turned has an acceleration in the base frame of at most S^2 r + 2 S P, where P is the way
of the tip in the workpiece. Rotary axes that carry the tool add at most S^2 r, with their own S and r. A point deviates
from its chord by at most an eighth of its acceleration. A straight way in the workpiece is nowhere farther from a pivot
than at one of its ends.
"""

from __future__ import annotations

import numpy as np

from ncfix.arrays import Array, Index, Mask, every, lengths, owners, picked, spread, vector_product
from ncfix.compensate.plan.kinematics import linear_columns
from ncfix.control.moves import MotionKind, Moves
from ncfix.machine import Machine
from ncfix.machine.chain import turn
from ncfix.machine.steps import dot
from ncfix.values import frozen


@frozen
class Segments:
    """Motions as the control interpolates them: every axis linear in the fraction; X Y Z of an arc on a circle.

    start, end  (n, n_axes) commands, mm and rad
    arc         (n,) X Y Z move on an arc
    centre      (n, 3) any point of the axis of an arc, mm
    normal      (n, 3) unit vector along this axis
    sweep       (n,) signed angle about it, with full turns, rad
    columns     (3,) the columns of X, Y and Z; -1 for an axis that the machine lacks

    If start and end have different distances from the axis, the radius changes linearly with the fraction; so does the
    height along the axis (helix).
    """

    start: Array
    end: Array
    arc: Mask
    centre: Array
    normal: Array
    sweep: Array
    columns: Index

    @classmethod
    def of_moves(cls, moves: Moves, columns: Index) -> Segments:
        """The motions as programmed."""
        return cls(
            moves.start, moves.end, moves.kind == MotionKind.ARC, moves.centre, moves.normal, moves.sweep, columns
        )

    def __len__(self) -> int:
        return len(self.start)

    def rows(self, rows: Index) -> Segments:
        """The motions `rows`."""
        ends, centre, normal = (self.start[rows], self.end[rows]), self.centre[rows], self.normal[rows]
        return Segments(*ends, self.arc[rows], centre, normal, self.sweep[rows], self.columns)

    def at(self, rows: Index, fraction: Array) -> Array:
        """(k, n_axes) the commands at fractions (k,) of motions `rows` (k,).

        At fraction 1 the result is the end even if the start is not known.
        """
        command = self.linearly(rows, fraction)
        if self.arc.any():
            on_arc = np.flatnonzero(self.arc[rows] & (fraction != 1))
            if on_arc.size:
                self._onto(command[None], on_arc, ArcColumns.each(self, rows[on_arc]).at(fraction[on_arc])[:, None])
        return command

    def evenly(self, rows: Index, fraction: Array) -> Array:
        """(m, k, n_axes) the commands at the same fractions (m,), below 1, of motions `rows` (k,), all of them arcs."""
        commands = self.chords(rows, fraction)
        self._onto(commands, slice(None), ArcColumns.of(self, rows).at(fraction[:, None]))
        return commands

    def chords(self, rows: Index, fraction: Array) -> Array:
        """Like `evenly`, but with X Y Z of arcs on their chords."""
        share = fraction[:, None, None]
        return (1 - share) * picked(self.start, rows) + share * picked(self.end, rows)

    def _onto(self, command: Array, rows: Index | slice, found: Array) -> None:
        """Write X Y Z (3, m, k) of some rows into commands (m, ., n_axes)."""
        for column, value in zip(self.columns.tolist(), found, strict=True):
            command[:, rows, column] = value

    def linearly(self, rows: Index, fraction: Array) -> Array:
        """Like `at`, but with X Y Z of arcs on their chords."""
        inside = np.flatnonzero(fraction != 1)
        if not inside.size:
            return picked(self.end, rows)
        if inside.size == len(rows):
            return self._on_line(rows, fraction)
        command = picked(self.end, rows)
        command[inside] = self._on_line(rows[inside], fraction[inside])
        return command

    def _on_line(self, rows: Index, fraction: Array) -> Array:
        """(k, n_axes) the commands at fractions (k,), every axis linear."""
        axes = self.end.shape[1]
        result, end = picked(self.start, rows), picked(self.end, rows)
        result *= spread(1 - fraction, axes)
        end *= spread(fraction, axes)
        result += end
        return result


@frozen
class ArcColumns:
    """k arcs as columns, prepared for interpolation.

    start, end  (9, k) mm, three rows each: the point, its radius vector from the axis, and that turned by a right angle
    sweep       (k,) rad
    """

    start: Array
    end: Array
    sweep: Array

    @classmethod
    def of(cls, arcs: Segments, rows: Index) -> ArcColumns:
        """The motions `rows` (k,), which are all arcs."""
        centre, normal = _columns(arcs.centre, rows), _columns(arcs.normal, rows)
        points = (picked(table, rows).T[arcs.columns] for table in (arcs.start, arcs.end))
        start, end = (_about_axis(each, centre, normal) for each in points)
        return cls(start, end, arcs.sweep[rows])

    @classmethod
    def each(cls, arcs: Segments, rows: Index) -> ArcColumns:
        """Like `of`, for rows in which each motion occurs several times in succession."""
        first = np.flatnonzero(np.diff(rows, prepend=-1))
        found = cls.of(arcs, rows[first])
        if len(first) == len(rows):
            return found
        own = owners(np.diff(first, append=len(rows)))
        return cls(found.start.take(own, axis=1), found.end.take(own, axis=1), found.sweep[own])

    def at(self, fraction: Array) -> Array:
        """X Y Z (3, k) at one fraction of each arc, `fraction` (k,); or (3, m, k) at fractions (m, 1) of all arcs."""
        rest, found = 1 - fraction, np.empty((3, *np.broadcast_shapes(fraction.shape, self.sweep.shape)))
        (sine, versine), (back, least) = turn(fraction * self.sweep), turn((fraction - 1) * self.sweep)
        for i in range(3):
            (a, r, q), (b, s, t) = self.start[i::3], self.end[i::3]
            found[i] = rest * (a - versine * r + sine * q) + fraction * (b - least * s + back * t)
        return found


def _columns(table: Array, rows: Index) -> Array:
    """Rows `rows` (k,) of a table (n, 3) as columns (3, k)."""
    return np.ascontiguousarray(picked(table, rows).T)


def _about_axis(point: Array, centre: Array, normal: Array) -> Array:
    """(9, k) points (3, k) of arcs, their radius vectors from the axes, and these turned by a right angle."""
    result = np.empty((9, point.shape[1]))
    result[:3], arm = point, point - centre
    arm -= dot(normal, arm) * normal
    (a, b, c), (x, y, z) = normal, arm
    result[3:6], result[6], result[7], result[8] = arm, b * z - c * y, c * x - a * z, a * y - b * x
    return result


def height(points: Array, normal: Array) -> Array:
    """(k, 1) components of vectors (k, 3) along the normals (k, 3)."""
    return np.einsum("ij,ij->i", points, normal)[:, None]


def sweep_between(start: Array, end: Array, centre: Array, normal: Array, like: Array) -> Array:
    """(k,) signed angle from start to end (k, 3) about the axis, rad: of all that fit, the one nearest to `like` (k,).

    It is the sweep of an arc with slightly moved ends, with the same number of turns.
    """
    first, last = start - centre, end - centre
    sine = np.einsum("ij,ij->i", vector_product(first, last), normal)
    cosine = np.einsum("ij,ij->i", first, last) - height(first, normal)[:, 0] * height(last, normal)[:, 0]
    change = np.arctan2(sine, cosine) - like
    return like + change - 2 * np.pi * np.round(change / (2 * np.pi))


def surely_within(machine: Machine, begin: Array, end: Array, tool_length: float) -> Mask:
    """(k,) whether motions under TCP surely stay within the ranges of all axes between positions begin and end.

    begin, end   (k, n_axes) axis positions, mm and rad
    tool_length  the longest tool length, mm
    """
    acceleration = accelerations(machine, begin, end, tool_length)
    if acceleration is None:
        return np.zeros(len(begin), dtype=bool)
    return stays_within(machine, begin, end, acceleration)


def stays_within(machine: Machine, begin: Array, end: Array, acceleration: Array) -> Mask:
    """Like `surely_within`, for motions with a bound of their acceleration (k,), see `accelerations`."""
    turning, stray = machine.rotary, acceleration / 8
    low, high = machine.ranges.T
    room = np.minimum(np.minimum(begin, end) - low, high - np.maximum(begin, end))
    return every((room >= 0) & ((room > stray[:, None]) | turning))


def arcs_within(machine: Machine, arcs: Segments) -> Mask:
    """(k,) whether arcs of axis positions surely stay within the ranges of all axes.

    Every point of an arc lies between its ends in height, and is no farther from the arc's axis than the farther end.
    All other axes move linearly.
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
    """(k,) bound of the acceleration of any linear axis along motions under TCP, mm per motion^2.

    begin, end   (k, n_axes) axis positions at the ends of the motions
    tool_length  the longest tool length, mm
    way          (k,) way of the tip in the workpiece, mm, if known

    None if rotary axes carry some of X, Y and Z.
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
    return share * (turning**2 * arm + 2 * turning * way + tilting**2 * swing)


def _pivots(machine: Machine, workpiece_side: bool) -> tuple[Index, Array]:
    """The columns of the rotary axes on one side, in the order of the chain, and (k, 3) points on their lines, mm."""
    found = [k for k, axis in enumerate(machine.axes) if axis.rotary and axis.workpiece_side == workpiece_side]
    points = np.array([machine.axes[k].point for k in found]).reshape(-1, 3)
    return np.array(found, dtype=np.intp), points


def _reach(pivots: Array, point: Array) -> float:
    """Largest distance, mm, of a point from pivots (k, 3) if it turns about the first, that about the next, ..."""
    return float(lengths(np.diff(np.vstack((point, pivots)), axis=0)).sum())


def skew(machine: Machine) -> float | None:
    """Largest motion of X, Y or Z for 1 mm of way; None if rotary axes carry them, or their directions are flat."""
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
"""Least singular value below which the directions of X, Y and Z count as lying in a plane."""
