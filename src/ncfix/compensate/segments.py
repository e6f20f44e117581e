"""Lines and arcs in the space of commands: where the command is at a fraction of a motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate.findings import Array, Index, Mask
from ncfix.compensate.rows import picked, spread, vector_product
from ncfix.program.moves import Kind, Moves


@dataclass(frozen=True, slots=True)
class Segments:
    """Motions as the control interpolates them: every axis linear in the fraction; X Y Z of an arc on a circle.

    start, end  (n, n_axes) commands, mm and rad
    arc         (n,) X Y Z go on an arc
    centre      (n, 3) mm; any point of the arc's axis
    normal      (n, 3) unit vector along it
    sweep       (n,) signed angle about it, full turns included, rad
    columns     (3,) the columns of X, Y and Z; -1 for an axis that the machine lacks

    Where start and end are not equally far from the axis, the radius changes linearly with the fraction; so does the
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
        return cls(moves.start, moves.end, moves.kind == Kind.ARC, moves.centre, moves.normal, moves.sweep, columns)

    def __len__(self) -> int:
        return len(self.start)

    def rows(self, rows: Index) -> Segments:
        """Some of the motions."""
        ends, centre, normal = (self.start[rows], self.end[rows]), self.centre[rows], self.normal[rows]
        return Segments(*ends, self.arc[rows], centre, normal, self.sweep[rows], self.columns)

    def at(self, rows: Index, fraction: Array) -> Array:
        """The commands at fractions (k,) of motions `rows` (k,), shape (k, n_axes).

        The end of a motion is known even if its start is not.
        """
        command = self.linearly(rows, fraction)
        if self.arc.any():
            on_arc = np.flatnonzero(self.arc[rows] & (fraction != 1))
            if on_arc.size:
                command[on_arc[:, None], self.columns] = self._on_arc(rows[on_arc], fraction[on_arc])
        return command

    def linearly(self, rows: Index, fraction: Array) -> Array:
        """As `at`, with X Y Z of arcs on their chords."""
        inside = np.flatnonzero(fraction != 1)
        if not inside.size:
            return picked(self.end, rows)
        if inside.size == len(rows):
            return self._on_line(rows, fraction)
        command = picked(self.end, rows)
        command[inside] = self._on_line(rows[inside], fraction[inside])
        return command

    def _on_line(self, rows: Index, fraction: Array) -> Array:
        """The commands at fractions, each axis linear, (k, n_axes)."""
        axes = self.end.shape[1]
        result, end = picked(self.start, rows), picked(self.end, rows)
        result *= spread(1 - fraction, axes)
        end *= spread(fraction, axes)
        result += end
        return result

    def _on_arc(self, rows: Index, fraction: Array) -> Array:
        """X Y Z at fractions of arcs, (k, 3)."""
        centre, normal = picked(self.centre, rows), picked(self.normal, rows)
        sweep, f = self.sweep[rows], fraction[:, None]
        start, end = (picked(points, rows).take(self.columns, axis=1) - centre for points in (self.start, self.end))
        low, high = height(start, normal), height(end, normal)
        from_start = _turned(start - low * normal, normal, fraction * sweep)
        from_end = _turned(end - high * normal, normal, (fraction - 1) * sweep)
        between = (1 - f) * low + f * high
        result: Array = centre + between * normal + (1 - f) * from_start + f * from_end
        return result


def height(points: Array, normal: Array) -> Array:
    """How far vectors (k, 3) go along the normals, (k, 1)."""
    along: Array = np.einsum("ij,ij->i", points, normal)[:, None]
    return along


def _turned(radius: Array, normal: Array, angle: Array) -> Array:
    """Radius vectors turned about the normal that they are perpendicular to."""
    across = vector_product(normal, radius)
    result: Array = np.cos(angle)[:, None] * radius + np.sin(angle)[:, None] * across
    return result


def sweep_between(start: Array, end: Array, centre: Array, normal: Array, like: Array) -> Array:
    """The signed angle from start to end (k, 3) about the axis, with as many turns as `like` (k,) has, rad.

    For where the ends of an arc were moved a little: of all angles that fit, the one next to `like`.
    """
    first, last = start - centre, end - centre
    sine = np.einsum("ij,ij->i", vector_product(first, last), normal)
    cosine = np.einsum("ij,ij->i", first, last) - height(first, normal)[:, 0] * height(last, normal)[:, 0]
    change = np.arctan2(sine, cosine) - like
    result: Array = like + change - 2 * np.pi * np.round(change / (2 * np.pi))
    return result
