"""Kinds `tcp` and `tcp6`: the error of the tool point relative to the workpiece (R-test, ball plates, machined parts).

What is read is actual minus nominal, plus where the instrument's own zero lies. With the actual pose (R, p), the
nominal one (R0, p0), ball offset b and stylus offset t, kind `tcp` reads p + R t - p0 - b in the workpiece frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ncfix.machine import Effect, Machine, se3
from ncfix.measure.geometry import base_from_workpiece, spindle_turn
from ncfix.measure.kinds import SHIFTS, TURNS
from ncfix.measure.measurement import Array, Measurement, groups
from ncfix.measure.observation import Observation, Unknowns

SAME = 1e-9
BALL, RIGID, NONE = "ball", "rigid", "none"
TILT = 1e-4
"""rad: how far an instrument may stand askew, in simulations."""


class TipErrors(Observation):
    """Rows of dx dy dz [rx ry rz]."""

    def __init__(self, measurement: Measurement, machine: Machine) -> None:
        super().__init__(measurement, machine)
        self.setup = measurement.header("setup")
        self.nominal = machine.nominal(self.q, self.state.tool_length)
        self.set_names, self.set_index = groups(measurement.sets)
        self.tool_names, self.tool_index = groups([f"{value:g}" for value in measurement.column("tool_length")])
        turned = spindle_turn(machine, measurement.column("spindle_deg"))
        self.held: Array = turned
        self.observed_turn = self._observed_turn()

    def _observed_turn(self) -> Array | None:
        """From workpiece axes to those in which the values are given, (n, 3, 3); None where these are the same."""
        if self.measurement.header("frame") == "base":
            return base_from_workpiece(self.machine, self.q)
        return None

    @property
    def components(self) -> tuple[str, ...]:
        """The columns that there are; all, in a plan that has none."""
        every = (*SHIFTS, *TURNS) if self.measurement.kind == "tcp6" else SHIFTS
        return self.measurement.measured or every

    @cached_property
    def has_stylus(self) -> bool:
        """Whether the stylus offset is seen apart from the ball's: there are tools, orientations or spindle angles."""
        turned = self.nominal[:, :3, :3] @ self.held
        vary = len(self.tool_names) > 1 or bool(np.abs(turned - turned[:1]).max() > SAME)
        return self.setup == BALL and vary

    @cached_property
    def unknowns(self) -> Unknowns:
        """Ball offset per set and stylus offset per tool; or a rigid motion per set; or nothing."""
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
        """See `Observation`; what is unknown about angles is taken to first order."""
        actual = machine.actual(self.q, self.state)
        errors = np.zeros((len(self.measurement), 6))
        errors[:, :3] = actual[:, :3, 3] - self.nominal[:, :3, 3]
        if self._turns:
            turned = actual[:, :3, :3] @ np.swapaxes(self.nominal[:, :3, :3], 1, 2)
            errors[:, 3:] = se3.rotation_vector(turned)
        return self._picked(errors) + self._setup(unknowns, actual[:, :3, :3]) @ unknowns

    def design(self, effects: Sequence[Effect]) -> Array:
        """See `Observation`."""
        every = self.machine.design(self.q, self.state, effects)
        return self._picked(every)

    def unknown_design(self, unknowns: Array) -> Array:
        """See `Observation`."""
        return self._setup(unknowns, self.nominal[:, :3, :3])

    @property
    def _turns(self) -> bool:
        return any(self.angular)

    @property
    def _shifts(self) -> bool:
        return not all(self.angular)

    def _picked(self, errors: Array) -> Array:
        """The components that were read, in the frame in which they were: (n, 6[, k]) -> (m[, k])."""
        parts = [errors[:, :3], errors[:, 3:]] if self._turns else [errors[:, :3]]
        if self.observed_turn is not None:
            parts = [np.einsum("nij,nj...->ni...", self.observed_turn, part) for part in parts]
        seen = [(*SHIFTS, *TURNS).index(name) for name in self.components]
        every = np.concatenate(parts, axis=1) if self._turns else parts[0]
        turned: Array = every[:, seen]
        return turned.reshape(turned.shape[0] * turned.shape[1], *errors.shape[2:])

    def _setup(self, unknowns: Array, turned: Array) -> Array:
        """The derivative by the unknowns with the tool turned like this, (m, k)."""
        n, size = len(self.measurement), len(unknowns)
        columns = np.zeros((n, 6, size))
        if not size:
            return self._picked(columns)
        rows = np.arange(n)[:, None]
        at = 0
        if self._turns or self.setup == RIGID:
            places = at + 3 * self.set_index[:, None] + np.arange(3)
            for k in range(3):
                columns[rows[:, 0], 3 + k, places[:, k]] = -1.0
            if self.setup == RIGID:
                arms = se3.skew(self.nominal[:, :3, 3])
                for k in range(3):
                    columns[rows[:, 0], :3, places[:, k]] = arms[:, :, k]
            at += 3 * len(self.set_names)
        if self._shifts:
            places = at + 3 * self.set_index[:, None] + np.arange(3)
            for k in range(3):
                columns[rows[:, 0], k, places[:, k]] = -1.0
            at += 3 * len(self.set_names)
        carried = turned @ self.held
        for part, wanted in (slice(0, 3), self._shifts), (slice(3, 6), self._turns):
            if self.has_stylus and wanted:
                places = at + 3 * self.tool_index[:, None] + np.arange(3)
                for k in range(3):
                    columns[rows[:, 0], part, places[:, k]] = carried[:, :, k]
                at += 3 * len(self.tool_names)
        return self._picked(columns)
