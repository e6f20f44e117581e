"""Kinds `tcp`, `tcp6` and `probe`: position of the tool tip relative to the workpiece, or to balls on it.

Kinds `tcp` and `tcp6` (R-test, ball plates, machined parts) read actual minus nominal, plus the zero offset of the
instrument. With the actual pose (R, p), the nominal one (R0, p0), ball offset b and stylus offset t, kind `tcp` reads
p + R t - p0 - b in the workpiece frame.

Kind `probe` (SAMBA, RUMBA, chase-the-ball) reads the axis positions m at which the stylus tip is in the centre of a
ball: p(m) + R(m) t = P. To first order the reading is m - A^-1 (p(m) + R t - P), with A the derivative of the tip by
the linear axes. `predict` returns this, which is exact at the true positions. Ball positions P (workpiece frame) and
stylus offsets t (tool frame) are unknown.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnostics import ConfigError
from ncfix.machine import Effect, Machine, se3
from ncfix.machine.linear import UnitResponses
from ncfix.measure.measurement import SHIFTS, TURNS, Measurement, groups
from ncfix.measure.observation import (
    Observation,
    Unknowns,
    base_from_workpiece,
    linear_axes,
    spindle_turn,
    vector_columns,
)

SAME = 1e-9
BALL, RIGID, NONE = "ball", "rigid", "none"
TILT = 1e-4
"""Standard deviation of an instrument's tilt in simulations, rad."""
READ = ("mx", "my", "mz")
COVERAGE = 2.0
"""Coverage factor k of the uncertainty of calibrated distances, as certificates state it."""


class TipErrors(Observation):
    """Observation of kinds `tcp` and `tcp6`: rows of dx dy dz [rx ry rz]."""

    def __init__(self, measurement: Measurement, machine: Machine) -> None:
        super().__init__(measurement, machine)
        self.setup = measurement.header("setup")
        self.nominal = machine.nominal(self.q, self.state.tool_length)
        self.tool_names, self.tool_index = groups([f"{value:g}" for value in measurement.column("tool_length")])
        self.held = spindle_turn(machine, measurement.column("spindle_deg"))
        self.observed_turn = base_from_workpiece(machine, self.q) if measurement.header("frame") == "base" else None
        """Rotation (n, 3, 3) from the workpiece frame to the frame of the values; None if they are the same."""

    @property
    def components(self) -> tuple[str, ...]:
        """The measured columns of the file; all possible ones for a plan without any."""
        every = (*SHIFTS, *TURNS) if self.measurement.kind == "tcp6" else SHIFTS
        return self.measurement.measured or every

    @cached_property
    def has_stylus(self) -> bool:
        """Whether tools, orientations or spindle angles vary, so that stylus and ball offsets act differently."""
        turned = self.nominal[:, :3, :3] @ self.held
        vary = len(self.tool_names) > 1 or bool(np.abs(turned - turned[:1]).max() > SAME)
        return self.setup == BALL and vary

    @cached_property
    def unknowns(self) -> Unknowns:
        """By set-up: ball offset per set and stylus offset per tool; or a rigid motion per set; or none."""
        if self.setup == NONE:
            return Unknowns.joined([])
        parts = []
        if self._turns or self.setup == RIGID:
            parts.append(Unknowns.vectors("tilt of the set-up in set ", self.set_names, spread=TILT))
        if self._shifts:
            parts.append(Unknowns.vectors("offset of the set-up in set ", self.set_names))
        if self.has_stylus and self._shifts:
            parts.append(Unknowns.vectors("stylus offset of tool ", self.tool_names))
        if self.has_stylus and self._turns:
            parts.append(Unknowns.vectors("tilt in the spindle of tool ", self.tool_names, spread=TILT))
        return Unknowns.joined(parts)

    def predict(self, machine: Machine, unknowns: Array) -> Array:
        """See `Observation`; unknown angles are treated to first order."""
        actual = machine.actual(self.q, self.state)
        errors = np.zeros((len(self.measurement), 6))
        errors[:, :3] = actual[:, :3, 3] - self.nominal[:, :3, 3]
        if self._turns:
            turned = actual[:, :3, :3] @ np.swapaxes(self.nominal[:, :3, :3], 1, 2)
            errors[:, 3:] = se3.rotation_vector(turned)
        return self._picked(errors) + self._setup(unknowns, actual[:, :3, :3]) @ unknowns

    def design(self, effects: Sequence[Effect]) -> Array:
        """See `Observation`."""
        if self.observed_turn is not None:
            return self._picked(self.machine.design(self.q, self.state, effects))
        rows = 6 if self._turns else 3
        every = self.machine.design_columns(self.q, self.state, effects, self._responses, rows)
        picked = np.empty((every.shape[1], every.shape[2], len(self.components)))
        for place, name in enumerate(self.components):
            picked[:, :, place] = every[(*SHIFTS, *TURNS).index(name)]
        return picked.reshape(len(picked), len(self.measurement) * len(self.components)).T

    def unknown_design(self, unknowns: Array) -> Array:
        """See `Observation`."""
        return self._setup(unknowns, self.nominal[:, :3, :3])

    @cached_property
    def _responses(self) -> UnitResponses:
        """The responses of the tool pose to single errors."""
        return self.machine.unit_responses(self.q, self.state)

    @property
    def _turns(self) -> bool:
        return any(self.angular)

    @property
    def _shifts(self) -> bool:
        return not all(self.angular)

    def _picked(self, errors: Array) -> Array:
        """Errors (n, 6[, k]) in the workpiece frame -> the components and frame that were read, (m[, k])."""
        parts = [errors[:, :3], errors[:, 3:]] if self._turns else [errors[:, :3]]
        if self.observed_turn is not None:
            parts = [np.einsum("nij,nj...->ni...", self.observed_turn, part) for part in parts]
        seen = [(*SHIFTS, *TURNS).index(name) for name in self.components]
        every = np.concatenate(parts, axis=1) if self._turns else parts[0]
        turned: Array = every[:, seen]
        return turned.reshape(turned.shape[0] * turned.shape[1], *errors.shape[2:])

    def _setup(self, unknowns: Array, turned: Array) -> Array:
        """Derivative (m, k) by the unknowns, for tool orientations `turned` (n, 3, 3)."""
        n = len(self.measurement)
        none, less = np.zeros((n, 3, 3)), np.broadcast_to(np.diag([-1.0, -1.0, -1.0]), (n, 3, 3))
        sets, tools = (self.set_index, len(self.set_names)), (self.tool_index, len(self.tool_names))
        rigid, stylus = self.setup == RIGID, self.has_stylus
        parts = [np.zeros((n, 6, 0))]
        for wanted, vectors, shift, turn in (
            (self._turns or rigid, sets, se3.skew(self.nominal[:, :3, 3]) if rigid else none, less),
            (self._shifts, sets, less, none),
            (self._shifts and stylus, tools, turned @ self.held, none),
            (self._turns and stylus, tools, none, turned @ self.held),
        ):
            if wanted and len(unknowns):
                parts.append(vector_columns(*vectors, np.concatenate([shift, turn], axis=1)))
        return self._picked(np.concatenate(parts, axis=2))


class Probing(Observation):
    """Observation of kind `probe`: rows of ball, mx my mz."""

    def __init__(self, measurement: Measurement, machine: Machine) -> None:
        super().__init__(measurement, machine)
        self.linear = linear_axes(measurement, machine)
        if all(name in measurement.columns for name in READ):
            self.q[:, self.linear] = measurement.stacked(*READ)
        self.balls, self.ball_index = groups(measurement.labels["ball"])
        self.tools, self.tool_index = groups([f"{value:g}" for value in measurement.column("tool_length")])
        self.held = spindle_turn(machine, measurement.column("spindle_deg"))
        tip_by_axes = machine.axis_jacobian(self.q, self.state.tool_length)[:, :3, self.linear]
        self.axes_by_tip = np.asarray(np.linalg.inv(tip_by_axes), dtype=np.float64)
        self.found, self.meant = self._consistent()
        self.nominal = machine.nominal(self.meant, self.state.tool_length)
        self.distances = [_distance(text, self.balls, measurement) for text in measurement.all_headers("distance")]

    def _consistent(self) -> tuple[Array, Array]:
        """Mean ball positions (b, 3) of a perfect machine, and the axis positions (n, n_axes) at which it finds them.

        Derivatives are taken at these positions: the errors of the positions read would blur what the set-up explains.
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
        """Standard deviations of the calibrated distances, (e,), mm: half their expanded uncertainties."""
        return np.array([uncertainty / COVERAGE for *_, uncertainty in self.distances])

    @cached_property
    def has_stylus(self) -> bool:
        """Whether tools or orientations vary, so that the stylus offset is not a common shift of all balls."""
        turned = self.nominal[:, :3, :3] @ self.held
        return len(self.tools) > 1 or bool(np.abs(turned - turned[:1]).max() > SAME)

    @cached_property
    def unknowns(self) -> Unknowns:
        """Ball positions, starting from those of a perfect machine; stylus offsets per tool."""
        parts = [Unknowns.vectors("position of ball ", self.balls, self.found)]
        if self.has_stylus:
            parts.append(Unknowns.vectors("stylus offset of tool ", self.tools))
        return Unknowns.joined(parts)

    def predict(self, machine: Machine, unknowns: Array) -> Array:
        """See `Observation`; exact at the measured positions."""
        actual = machine.actual(self.q, self.state)
        gap = actual[:, :3, 3] - self._balls(unknowns)[self.ball_index]
        if self.has_stylus:
            gap = gap + np.einsum("nij,nj->ni", actual[:, :3, :3] @ self.held, self._stylus(unknowns)[self.tool_index])
        read = self.q[:, self.linear] - np.einsum("nij,nj->ni", self.axes_by_tip, gap)
        return np.concatenate([read.ravel(), self._lengths(unknowns)])

    def design(self, effects: Sequence[Effect]) -> Array:
        """See `Observation`."""
        tip = self.machine.design_columns(self.meant, self.state, effects, self._responses, rows=3)
        rows = np.empty((tip.shape[1], tip.shape[2], 3))
        for k in range(3):
            by_tip = [self.axes_by_tip[:, k, j] * tip[j] for j in range(3)]
            rows[:, :, k] = -(by_tip[0] + by_tip[1] + by_tip[2])
        design = rows.reshape(len(rows), 3 * len(self.measurement)).T
        return np.concatenate([design, np.zeros((len(self.distances), len(rows)))]) if self.distances else design

    @cached_property
    def _responses(self) -> UnitResponses:
        """The responses of the tool pose to single errors."""
        return self.machine.unit_responses(self.meant, self.state)

    def unknown_design(self, unknowns: Array) -> Array:
        """See `Observation`."""
        parts = [vector_columns(self.ball_index, len(self.balls), self.axes_by_tip)]
        if self.has_stylus:
            carried = -self.axes_by_tip @ self.nominal[:, :3, :3] @ self.held
            parts.append(vector_columns(self.tool_index, len(self.tools), carried))
        rows = np.concatenate(parts, axis=2).reshape(3 * len(self.measurement), -1)
        return np.concatenate([rows, self._lengths_design(unknowns)])

    def with_bars(self, unknowns: Array, random: np.random.Generator) -> Array:
        """The unknowns (k,) with the second ball of each calibrated distance moved to a random true distance, which
        deviates from the certificate by its standard uncertainty.
        """
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


def _distance(text: str, balls: tuple[str, ...], measurement: Measurement) -> tuple[int, int, float, float]:
    first, second, length, uncertainty = text.split()
    for ball in (first, second):
        if ball not in balls:
            raise ConfigError.of("NCF612", f"distance {text!r}: ball {ball} was not measured", measurement.place(0))
    return balls.index(first), balls.index(second), float(length), float(uncertainty)
