"""The machine model of the certificate: the commands that bring the real tip to the place of a perfect one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ncfix.arrays import Array, Mask
from ncfix.certificate.steps import Kind, ProgramSteps
from ncfix.certificate.text import Indices
from ncfix.certificate.turning import RotaryWay
from ncfix.machine import Machine, State
from ncfix.values import frozen

FLAT = 1e-6
LEVER = 100.0
"""Lever arm, mm, by which turns are weighed against lengths when the nearest place of a motion is searched."""
PROBE = 100.0
"""Additional tool length, mm, by which the direction of the tool is found."""
SHORT_MM, SHORT_RAD = 2.0, 0.02
"""Largest way of an axis, mm and rad, in a short straight motion."""


@frozen(slots=False)
class TipModel:
    """A calibrated machine with the workpiece at its place; `columns`: those of X, Y and Z."""

    machine: Machine
    columns: tuple[int, int, int]

    @classmethod
    def of(cls, machine: Machine) -> TipModel | None:
        """The model of a machine; None for a machine without three linear axes X, Y and Z."""
        names = machine.axis_names
        if not all(name in names and not machine.rotary[names.index(name)] for name in "XYZ"):
            return None
        x, y, z = (names.index(name) for name in "XYZ")
        return cls(machine, (x, y, z))

    @property
    def leads(self) -> bool:
        """Whether X Y Z can bring the tip to every place, for all positions of the rotary axes."""
        ways = self.machine.linear_ways
        return ways is not None and abs(np.linalg.det(ways)) > FLAT

    def internal(self, rows: Sequence[Sequence[float]] | Array) -> Array:
        """(n, n_axes) positions given in mm and degree, as mm and rad."""
        found = np.array(rows, dtype=np.float64).reshape(-1, len(self.machine.axes))
        found[:, self.machine.rotary] *= math.pi / 180
        return found

    def _at_zero(self, command: Array) -> Array:
        offset, ways = self.machine.at_zero
        return offset + command @ ways

    def joints(self, command: Array, tcp: Mask, length: Array) -> Array:
        """(n, n_axes) axis positions for commands (n, n_axes), also those under tool-centre-point control."""
        q = command.copy()
        if tcp.any():
            found = self.machine.xyz_for_tip(command[tcp], self.columns, self._at_zero(command[tcp]), length[tcp])
            q[np.flatnonzero(tcp)[:, None], list(self.columns)] = found
        return q

    def commands(self, q: Array, tcp: Mask, length: Array) -> Array:
        """The inverse of `joints`."""
        command = q.copy()
        if tcp.any():
            rest = q[tcp].copy()
            rest[:, self.columns] = 0.0
            ways = self.machine.at_zero[1][list(self.columns)]
            off = self.machine.tip(q[tcp], length[tcp]) - self._at_zero(rest)
            command[np.flatnonzero(tcp)[:, None], list(self.columns)] = off @ np.linalg.inv(ways)
        return command

    def turned(self, numbers: Sequence[float], length: float, on: bool) -> Sequence[float]:
        """The command, mm and degree, for the same axis positions after tool-centre-point control goes on or off."""
        if not self.leads or any(map(math.isnan, (*numbers, length))):
            return [math.nan] * len(numbers)
        q, every, tool = self.internal([numbers]), np.array([True]), np.array([length])
        found = self.commands(q, every, tool) if on else self.joints(q, every, tool)
        found[:, self.machine.rotary] *= 180 / math.pi
        result: list[float] = found[0].tolist()
        return result

    @cached_property
    def rotary_way(self) -> RotaryWay | None:
        """The directions of the tool by two rotary axes; None for a machine without exactly two."""
        axes = np.flatnonzero(self.machine.rotary)
        if len(axes) != 2:
            return None

        def directions(positions: Array) -> Array:
            q = np.zeros((len(positions), len(self.machine.axes)))
            q[:, axes] = positions
            tips = [self.machine.tip(q, np.full(len(q), length)) for length in (0.0, PROBE)]
            found: Array = (tips[0] - tips[1]) / PROBE
            return found

        return RotaryWay(directions, self.machine.ranges[axes])

    def aimed(self, meant: Array, tcp: Mask, length: Array, direction: Array, turned: Array | None = None) -> Array:
        """(n, n_axes) the exactly corrected commands for commands `meant` (n, n_axes); NaN if there are none.

        direction  (n, n_axes) directions of motion
        turned     (n, n_axes) positions of the rotary axes, of a correction that changes them, too
        """
        q = self.joints(meant, tcp, length)
        begin, target = q, None
        if turned is not None:
            target = self.machine.tip(q, length)
            begin = np.where(self.machine.rotary, turned, q)
        found = self.machine.aim(begin, self.columns, State(length, direction), target)
        result = begin.copy()
        result[:, self.columns] = np.where(np.asarray(found.arrived)[:, None], found.place, np.nan)
        return self.commands(result, tcp, length)

    def strays(self, ways: Ways, length: Array) -> Array:
        """(n,) largest deviation of the tool direction from an even turn in a plane, rad; 0 if it does not turn."""
        axes = self.machine.rotary
        found = np.zeros(len(ways.start))
        turns = np.flatnonzero((ways.start[:, axes] != ways.end[:, axes]).any(axis=1))
        shares = np.linspace(0.0, 1.0, 9)
        row, share = np.repeat(turns, len(shares)), np.tile(shares, len(turns))
        q, tool = ways.at(row, share), length[row]
        points = (self.machine.tip(q, tool + PROBE) - self.machine.tip(q, tool)).reshape(-1, len(shares), 3) / -PROBE
        first, last = points[:, 0], points[:, -1]
        whole = np.linalg.norm(np.cross(first, last), axis=1)
        angle = np.arctan2(whole, (first * last).sum(axis=1))
        side = (last - np.cos(angle)[:, None] * first) / np.maximum(whole, 1e-12)[:, None]
        turned = shares * angle[:, None]
        even = np.cos(turned)[:, :, None] * first[:, None] + np.sin(turned)[:, :, None] * side[:, None]
        found[turns] = np.linalg.norm(points - even, axis=2).max(axis=1)
        return found

    def gaps(self, meant: Array, done: Array, tcp: Mask, length: Array, direction: Array) -> Array:
        """(n,) distance of the real tip under commands `done` from the perfect tip under commands `meant`, mm."""
        state = State(length, direction)
        off = self.machine.gaps(self.joints(meant, tcp, length), [self.joints(done, tcp, length)], state)[0]
        gap: Array = np.linalg.norm(off, axis=1)
        return gap


@frozen
class Ways:
    """Motions as the control interpolates them: straight in all axes, or X Y Z on a circle; commands in mm and rad."""

    start: Array
    end: Array
    arc: Mask
    centre: Array
    across: Indices
    sweep: Array
    columns: tuple[int, int, int]
    turn: Array | None
    """(n, 3, 3) rotation of the coordinates of arcs; None if none is turned."""

    @classmethod
    def of(cls, model: TipModel, steps: ProgramSteps, at: Indices) -> Ways:
        """The ways of steps `at` (n,)."""
        turn = steps.turn[at]
        return cls(
            model.internal(steps.start[at]),
            model.internal(steps.end[at]),
            steps.kind[at] == Kind.ARC,
            steps.centre[at],
            steps.across[at],
            steps.sweep[at],
            model.columns,
            steps.rotations[turn] if turn.any() else None,
        )

    def _numbers(self, here: Indices, places: Array) -> Array:
        """X Y Z (k, 3) in the coordinates of arcs `here` (k,)."""
        return places if self.turn is None else np.einsum("kji,kj->ki", self.turn[here], places)

    def is_short(self, rotary: Mask) -> Mask:
        """(n,) whether the motion is straight and short in all axes."""
        far = np.abs(self.end - self.start) > np.where(rotary, SHORT_RAD, SHORT_MM)
        return ~(far.any(axis=1) | self.arc)

    def at(self, row: Indices, share: Array) -> Array:
        """(k, n_axes) the commands at shares (k,) of motions `row` (k,)."""
        begin, end = self.start[row], self.end[row]
        found: Array = begin + share[:, None] * (end - begin)
        on = np.flatnonzero(self.arc[row])
        if on.size:
            here, part = row[on], share[on]
            one, two = (self.across[here] + 1) % 3, (self.across[here] + 2) % 3
            columns, each = np.array(self.columns), np.arange(len(on))
            middle = self._numbers(here, self.centre[here])
            places = self._numbers(here, found[on[:, None], columns])
            a = self._numbers(here, begin[on][:, columns]) - middle
            b = self._numbers(here, end[on][:, columns]) - middle
            first, last = np.hypot(a[each, one], a[each, two]), np.hypot(b[each, one], b[each, two])
            angle = np.arctan2(a[each, two], a[each, one]) + part * self.sweep[here]
            radius = first + part * (last - first)
            places[each, one] = middle[each, one] + radius * np.cos(angle)
            places[each, two] = middle[each, two] + radius * np.sin(angle)
            if self.turn is not None:
                places = np.einsum("kij,kj->ki", self.turn[here], places)
            found[on[:, None], columns] = places
        return found

    def share(self, row: Indices, place: Array, rotary: Mask) -> Array:
        """(k,) share of motions `row` (k,) that is nearest to `place` (k, n_axes); for arcs, by the angle."""
        way, weight = self.end[row] - self.start[row], np.where(rotary, LEVER**2, 1.0)
        square = np.einsum("ij,ij,j->i", way, way, weight)
        with np.errstate(all="ignore"):
            share: Array = np.einsum("ij,ij,j->i", place - self.start[row], way, weight) / square
        on = np.flatnonzero(self.arc[row])
        if on.size:
            here, each, columns = row[on], np.arange(len(on)), np.array(self.columns)
            one, two = (self.across[here] + 1) % 3, (self.across[here] + 2) % 3
            a = self._numbers(here, self.start[here][:, columns] - self.centre[here])
            b = self._numbers(here, place[on][:, columns] - self.centre[here])
            turn = np.arctan2(b[each, two], b[each, one]) - np.arctan2(a[each, two], a[each, one])
            whole, sweep = 2 * np.pi, np.abs(self.sweep[here])
            turn = np.where(self.sweep[here] > 0, turn, -turn) % whole
            share[on] = np.where(turn > (sweep + whole) / 2, turn - whole, turn) / sweep  # below 0: before it begins
        return share
