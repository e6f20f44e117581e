"""Kind `length`: the distance between two positions (interferometer, gauge), or a ball-bar's about its centre.

Gauge: the machine goes from position a to position b; `length` is how far that really was, `nominal` how far it should
have been (the distance commanded, if there is no such column). With `# setup: unknown` all lengths of a set have an
unknown part in common: an artefact that is not calibrated. Ball-bar: `length` is the distance of the tip from a centre
ball; where that ball really is, (u, v, w), is unknown per set, and with `# setup: unknown` so is the bar's length.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ncfix.machine import Effect, Machine
from ncfix.measure.kinds import CENTRE
from ncfix.measure.measurement import Array, Measurement, groups
from ncfix.measure.observation import Observation, Unknowns
from ncfix.measure.probing import linear_axes

SHORT = 1e-9
"""mm: a length that has no direction."""


class Length(Observation):
    """What gauges and ball-bars have in common: one length a row, and what is unknown of it per set."""

    def __init__(self, measurement: Measurement, machine: Machine) -> None:
        super().__init__(measurement, machine)
        self.set_names, self.set_index = groups(measurement.sets)
        self.setup = measurement.header("setup")

    @property
    def components(self) -> tuple[str, ...]:
        """One length a row."""
        return ("length",)

    def _constant(self) -> Unknowns:
        names = self.set_names if self.setup == "unknown" else ()
        labels = tuple(f"length of the artefact in set {name}" for name in names)
        return Unknowns(labels, np.zeros(len(labels)), np.full(len(labels), 0.05))

    def _constant_design(self) -> Array:
        ones: Array = (self.set_index[:, None] == np.arange(len(self.set_names))).astype(np.float64)
        return ones if self.setup == "unknown" else ones[:, :0]


class Gauge(Length):
    """Rows of ax ay az bx by bz length [nominal]."""

    def __init__(self, measurement: Measurement, machine: Machine) -> None:
        super().__init__(measurement, machine)
        linear = linear_axes(measurement, machine)
        self.ends = []
        for end in "ab":
            q = self.q.copy()
            q[:, linear] = measurement.stacked(*(f"{end}{axis}" for axis in "xyz"))
            self.ends.append(q)
        way = machine.tip(self.ends[1], self.state.tool_length) - machine.tip(self.ends[0], self.state.tool_length)
        self.commanded = np.linalg.norm(way, axis=1)
        self.way = way / np.maximum(self.commanded, SHORT)[:, None]
        self.nominal = measurement.columns.get("nominal", self.commanded)

    @cached_property
    def unknowns(self) -> Unknowns:
        """The artefact's length per set, if it is not known."""
        return self._constant()

    def predict(self, machine: Machine, unknowns: Array) -> Array:
        """See `Observation`."""
        first, last = (machine.actual_tip(q, self.state) for q in self.ends)
        distance: Array = np.linalg.norm(last - first, axis=1)
        read: Array = self.nominal + distance - self.commanded + self._constant_design() @ unknowns
        return read

    def design(self, effects: Sequence[Effect]) -> Array:
        """See `Observation`: the difference of the errors of both ends along the way (Soons, Eq. 4.5)."""
        first, last = (self.machine.design(q, self.state, effects)[:, :3] for q in self.ends)
        return np.asarray(np.einsum("ni,nik->nk", self.way, last - first))

    def unknown_design(self, unknowns: Array) -> Array:
        """See `Observation`."""
        return self._constant_design()


class BallBar(Length):
    """Rows of cx cy cz radius length."""

    def __init__(self, measurement: Measurement, machine: Machine) -> None:
        super().__init__(measurement, machine)
        self.centre = measurement.stacked(*CENTRE)
        arm = machine.tip(self.q, self.state.tool_length) - self.centre
        self.commanded = np.linalg.norm(arm, axis=1)
        self.way = arm / np.maximum(self.commanded, SHORT)[:, None]
        self.radius = measurement.columns["radius"]

    @cached_property
    def unknowns(self) -> Unknowns:
        """The centre's offset u v w per set, and the bar's length if it is not known."""
        if self.setup == "none":
            return Unknowns.joined([])
        return Unknowns.joined([Unknowns.vectors("centre of set ", self.set_names), self._constant()])

    def predict(self, machine: Machine, unknowns: Array) -> Array:
        """See `Observation`; `radius` is what the commanded circle has, so its own rounding does not matter."""
        arm = machine.actual_tip(self.q, self.state) - self.centre
        constant = np.zeros(len(arm))
        if self.setup != "none":
            size = 3 * len(self.set_names)
            arm = arm - unknowns[:size].reshape(-1, 3)[self.set_index]
            constant = self._constant_design() @ unknowns[size:]
        read: Array = self.radius + np.linalg.norm(arm, axis=1) - self.commanded + constant
        return read

    def design(self, effects: Sequence[Effect]) -> Array:
        """See `Observation`."""
        tip = self.machine.design(self.q, self.state, effects)[:, :3]
        return np.asarray(np.einsum("ni,nik->nk", self.way, tip))

    def unknown_design(self, unknowns: Array) -> Array:
        """See `Observation` (Esmaeili, Eq. 15-17)."""
        if self.setup == "none":
            return np.zeros((len(self.q), 0))
        columns = np.zeros((len(self.q), 3 * len(self.set_names)))
        for k in range(3):
            columns[np.arange(len(self.q)), 3 * self.set_index + k] = -self.way[:, k]
        return np.concatenate([columns, self._constant_design()], axis=1)
