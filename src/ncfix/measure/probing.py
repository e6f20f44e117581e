"""Kind `probe`: axis positions with which the stylus tip sits in the centre of a ball (SAMBA, RUMBA, chase-the-ball).

The tip of the real machine at the positions read is where the ball is: p(m) + R(m) t = P. To first order the position
read is m - A^-1 (p(m) + R t - P), A the derivative of the tip by the linear axes; that is what `predict` gives, and at
the true positions it is exact. Ball positions P (workpiece frame) and stylus offsets t (tool frame) are unknown.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ncfix.diagnostics import ConfigError
from ncfix.machine import Effect, Machine
from ncfix.measure.geometry import spindle_turn
from ncfix.measure.measurement import Array, Measurement, groups
from ncfix.measure.observation import Observation, Unknowns
from ncfix.measure.tip_errors import SAME

READ = ("mx", "my", "mz")
COVERAGE = 2.0
"""Calibrated distances come with an expanded uncertainty, k = 2, as certificates state it."""


class Probing(Observation):
    """Rows of ball, mx my mz."""

    def __init__(self, measurement: Measurement, machine: Machine) -> None:
        super().__init__(measurement, machine)
        self.linear = linear_axes(measurement, machine)
        if all(name in measurement.columns for name in READ):
            self.q[:, self.linear] = measurement.stacked(*READ)
        self.balls, self.ball_index = groups(measurement.labels["ball"])
        self.tools, self.tool_index = groups([f"{value:g}" for value in measurement.column("tool_length")])
        self.held = spindle_turn(machine, measurement.column("spindle_deg"))
        tip_by_axes = machine.axis_jacobian(self.q, self.state.tool_length)[:, :3, self.linear]
        self.axes_by_tip = np.linalg.inv(tip_by_axes)
        self.found, self.meant = self._consistent()
        self.nominal = machine.nominal(self.meant, self.state.tool_length)
        self.distances = [_distance(text, self.balls, measurement) for text in measurement.all_headers("distance")]

    def _consistent(self) -> tuple[Array, Array]:
        """Where a perfect machine finds the balls on average, and the positions at which it would find them there.

        Derivatives are taken at those: at the positions read, which err, what the set-up can and cannot explain would
        be blurred by their errors.
        """
        tips = self.machine.tip(self.q, self.state.tool_length)
        counts = np.bincount(self.ball_index)[:, None]
        found = np.stack([np.bincount(self.ball_index, tips[:, k]) for k in range(3)], axis=-1) / counts
        meant = self.q.copy()
        meant[:, self.linear] -= np.einsum("nij,nj->ni", self.axes_by_tip, tips - found[self.ball_index])
        return found, meant

    @property
    def components(self) -> tuple[str, ...]:
        """The positions of the three linear axes."""
        return READ

    @property
    def extra_values(self) -> Array:
        """The calibrated distances, (e,), mm."""
        return np.array([length for _, _, length, _ in self.distances])

    @property
    def extra_sigma(self) -> Array:
        """Half of their expanded uncertainties (k = 2), (e,), mm."""
        return np.array([uncertainty / COVERAGE for *_, uncertainty in self.distances])

    @cached_property
    def has_stylus(self) -> bool:
        """Whether tools or orientations vary, so that the stylus offset is no common shift of all balls."""
        turned = self.nominal[:, :3, :3] @ self.held
        return len(self.tools) > 1 or bool(np.abs(turned - turned[:1]).max() > SAME)

    @cached_property
    def unknowns(self) -> Unknowns:
        """Ball positions, starting from where a perfect machine would have found them; stylus offsets per tool."""
        parts = [Unknowns.vectors("position of ball ", self.balls, self.found)]
        if self.has_stylus:
            parts.append(Unknowns.vectors("stylus offset of tool ", self.tools))
        return Unknowns.joined(parts)

    def predict(self, machine: Machine, unknowns: Array) -> Array:
        """See `Observation`; exact where the values are."""
        actual = machine.actual(self.q, self.state)
        gap = actual[:, :3, 3] - self._balls(unknowns)[self.ball_index]
        if self.has_stylus:
            gap = gap + np.einsum("nij,nj->ni", actual[:, :3, :3] @ self.held, self._stylus(unknowns)[self.tool_index])
        read = self.q[:, self.linear] - np.einsum("nij,nj->ni", self.axes_by_tip, gap)
        return np.concatenate([read.ravel(), self._lengths(unknowns)])

    def design(self, effects: Sequence[Effect]) -> Array:
        """See `Observation`."""
        tip = self.machine.design(self.meant, self.state, effects)[:, :3]
        rows = -np.einsum("nij,njk->nik", self.axes_by_tip, tip)
        rows = rows.reshape(3 * len(self.measurement), rows.shape[-1])
        return np.concatenate([rows, np.zeros((len(self.distances), rows.shape[1]))])

    def unknown_design(self, unknowns: Array) -> Array:
        """See `Observation`."""
        n = len(self.measurement)
        columns = np.zeros((n, 3, len(unknowns)))
        each = np.arange(n)
        for k in range(3):
            columns[each, :, 3 * self.ball_index + k] = self.axes_by_tip[:, :, k]
        if self.has_stylus:
            carried = -self.axes_by_tip @ self.nominal[:, :3, :3] @ self.held
            first = 3 * len(self.balls)
            for k in range(3):
                columns[each, :, first + 3 * self.tool_index + k] = carried[:, :, k]
        return np.concatenate([columns.reshape(3 * n, -1), self._lengths_design(unknowns)])

    def with_bars(self, unknowns: Array, random: np.random.Generator) -> Array:
        """The unknowns (k,) with the second ball of each calibrated distance as far away as its certificate has it."""
        moved = unknowns.copy()
        for first, second, length, uncertainty in self.distances:
            balls = self._balls(moved)
            way = balls[second] - balls[first]
            true = length + uncertainty / COVERAGE * random.standard_normal()
            balls[second] = balls[first] + way * (true / float(np.linalg.norm(way)))
        return moved

    def _balls(self, unknowns: Array) -> Array:
        return unknowns[: 3 * len(self.balls)].reshape(-1, 3)

    def _stylus(self, unknowns: Array) -> Array:
        return unknowns[3 * len(self.balls) :].reshape(-1, 3)

    def _lengths(self, unknowns: Array) -> Array:
        balls = self._balls(unknowns)
        return np.array([np.linalg.norm(balls[b] - balls[a]) for a, b, *_ in self.distances])

    def _lengths_design(self, unknowns: Array) -> Array:
        balls, rows = self._balls(unknowns), np.zeros((len(self.distances), len(unknowns)))
        for row, (a, b, *_) in zip(rows, self.distances, strict=True):
            way = (balls[b] - balls[a]) / np.linalg.norm(balls[b] - balls[a])
            row[3 * a : 3 * a + 3], row[3 * b : 3 * b + 3] = -way, way
        return rows


def linear_axes(measurement: Measurement, machine: Machine) -> list[int]:
    """The indices of the axes X Y Z; raises `ConfigError` NCF610 if the machine has not all three."""
    names = list(machine.axis_names)
    for axis in "XYZ":
        if axis not in names:
            raise ConfigError.of("NCF610", f"the machine has no axis {axis}", measurement.place(0))
    return [names.index(axis) for axis in "XYZ"]


def _distance(text: str, balls: tuple[str, ...], measurement: Measurement) -> tuple[int, int, float, float]:
    first, second, length, uncertainty = text.split()
    for ball in (first, second):
        if ball not in balls:
            raise ConfigError.of("NCF612", f"distance {text!r}: ball {ball} was not measured", measurement.place(0))
    return balls.index(first), balls.index(second), float(length), float(uncertainty)
