"""Kind `points`: targets on the spindle head or the table, seen from an instrument that stands on the foundation.

A laser tracker reads x = Q (B p) + s: p the target's place on its body, B the body's real pose in the base frame, Q and
s how the instrument stands. Places and stand are unknown. Three or more targets show all six errors of a body.

Places are those in the base frame with all axes at zero. A target that the tool carries is there with the tool of its
first row; a longer one moves it away from the spindle along the tool. One on the spindle head stays where it is.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from ncfix.diagnostics import Message
from ncfix.machine import Effect, Machine, State, se3
from ncfix.measure.geometry import TOOL, WORKPIECE, branch
from ncfix.measure.measurement import Array, Measurement, groups
from ncfix.measure.observation import LEVER, Observation, Unknowns
from ncfix.measure.stands import Sights, first_guess

READ = ("x", "y", "z")
STOOD = 0.02
"""rad: how far the instrument may be turned against the base, in simulations."""


class Targets(Observation):
    """Rows of target, x y z."""

    def __init__(self, measurement: Measurement, machine: Machine) -> None:
        super().__init__(measurement, machine)
        self.side = measurement.header("carried_by")
        self.body, self.axes = branch(machine, self.side)
        self.own = self.q[:, self.axes]
        direction = np.asarray(self.state.direction)[:, self.axes]
        self.lengths = measurement.column("tool_length")
        self.own_state = State(self.lengths, direction, {**self._other_axes(), **self.state.inputs})
        self.names, self.index = groups(measurement.labels["target"])
        self.first_tip = self.body.tool.tip(self.lengths[np.unique(self.index, return_index=True)[1]])
        self.poses = self._base_from_body(self.body.nominal(self.own, self.lengths))
        self.set_names, self.set_index = groups(measurement.sets)
        stated = self._stated()
        known = np.array([name in stated for name in self.names])
        self.sights = Sights(self.poses, self.index, self.set_index, known)
        self.stands, self.places = self._first_guess(stated)

    def _other_axes(self) -> dict[str, Array]:
        """The axes of the other branch, which errors of this one may depend on, as inputs in the file's units."""
        others = [k for k in range(len(self.machine.axes)) if k not in self.axes]
        return {self.machine.axes[k].name: self.q[:, k] / self.machine.axes[k].unit for k in others}

    @property
    def components(self) -> tuple[str, ...]:
        """The instrument's x y z."""
        return READ

    @cached_property
    def unknowns(self) -> Unknowns:
        """Places of the targets on their body; stand of the instrument per set, as a shift and a small turn."""
        return Unknowns.joined(
            [
                Unknowns.vectors("place of target ", self.names, self.places, spread=1.0),
                Unknowns.vectors("place of the instrument in set ", self.set_names, self.stands[:, :3, 3], spread=50.0),
                Unknowns.vectors("turn of the instrument in set ", self.set_names, spread=STOOD),
            ]
        )

    def predict(self, machine: Machine, unknowns: Array) -> Array:
        """See `Observation`."""
        places, shifts, turns = self._parts(unknowns)
        body, _ = branch(machine, self.side)
        poses = self._base_from_body(body.actual(self.own, self.own_state))
        turned = se3.rotation(turns) @ self.stands[:, :3, :3]
        return replace(self.sights, poses=poses).seen(places, turned, shifts).ravel()

    def design(self, effects: Sequence[Effect]) -> Array:
        """See `Observation`; the errors of the other branch are not seen."""
        joints = {axis.name for axis in self.body.axes} | (set() if self.side == WORKPIECE else {"S"})
        parts = [np.zeros((3 * len(self.measurement), 0))]
        for effect in effects:
            seen = effect.joint in joints
            size = effect.basis.size
            parts.append(self._columns(effect) if seen else np.zeros((3 * len(self.measurement), size)))
        return np.concatenate(parts, axis=1)

    def unknown_design(self, unknowns: Array) -> Array:
        """See `Observation`."""
        places, _, turns = self._parts(unknowns)
        return self.sights.design(places, se3.rotation(turns) @ self.stands[:, :3, :3])

    def doubts(self, machine: Machine) -> Iterator[Message]:
        """See `Observation`: angles act by levers, which no reading shows where only linear axes move."""
        start, perfect = self.unknowns.start, machine.replace(effects=())

        def shown(unknowns: Array) -> Array:
            return self.predict(machine, unknowns) - self.predict(perfect, unknowns)

        changes = self.sights.left_open(self.places, self.stands[:, :3, :3])
        levers = [shown(start + change) - shown(start) for change in changes]
        size = max((float(np.linalg.norm(each / self.sigma)) for each in levers), default=0.0)
        if size > 1:
            most = 1e3 * max(float(np.abs(each).max()) for each in levers)
            text = (
                f"the readings do not tell where the targets are on what carries them; {LEVER:g} mm elsewhere, "
                f"the estimated angles would move them by up to {most:.1f} um more or less"
            )
            yield Message("NCF643", text, self.measurement.place(0), "a line `# target: NAME x y z` in the header")

    def _parts(self, unknowns: Array) -> tuple[Array, Array, Array]:
        t, s = len(self.names), len(self.set_names)
        parts = np.split(unknowns.reshape(-1, 3), [t, t + s])
        return parts[0], parts[1], parts[2]

    def _base_from_body(self, poses: Array) -> Array:
        """base_from_body of poses (n, 4, 4) of each row's tip; with all axes at zero places are those in the base."""
        tips = self.first_tip[self.index] if self.side == TOOL else self.body.tool.tip(self.lengths)
        shifted: Array = poses @ se3.shift(-tips)
        return se3.inverse(shifted) if self.side == WORKPIECE else shifted

    def _columns(self, effect: Effect) -> Array:
        """What one effect moves, seen from the instrument at its first guess: (m, k)."""
        error = self.body.design(self.own, self.own_state, [effect])
        places = self.places[self.index]
        at = self.body.nominal(self.own, self.lengths)[:, :3, 3]
        if self.side == WORKPIECE:
            moved = error[:, :3] + np.einsum("nij,njk->nik", -se3.skew(places - at), error[:, 3:])
            base = -np.einsum("nij,njk->nik", self.poses[:, :3, :3], moved)
        else:
            points = np.einsum("nij,nj->ni", self.poses[:, :3, :3], places) + self.poses[:, :3, 3]
            base = error[:, :3] + np.einsum("nij,njk->nik", -se3.skew(points - at), error[:, 3:])
        seen = np.einsum("nij,njk->nik", self.stands[self.set_index][:, :3, :3], base)
        result: Array = seen.reshape(-1, seen.shape[-1])
        return result

    def _stated(self) -> dict[str, list[float]]:
        """Where targets are nearly, by name, mm, as the header has it."""
        lines = [text.split() for text in self.measurement.all_headers("target")]
        return {name: [float(each) for each in numbers] for name, *numbers in lines}

    def _first_guess(self, stated: dict[str, list[float]]) -> tuple[Array, Array]:
        """Stand per set (s, 4, 4) and places (t, 3): from the header, and from a perfect machine's motions."""
        likely = self.first_tip if self.side == TOOL else np.zeros_like(self.first_tip)
        places = np.array([stated.get(name, place) for name, place in zip(self.names, likely.tolist(), strict=True)])
        if not all(name in self.measurement.columns for name in READ):
            return np.broadcast_to(np.eye(4), (len(self.set_names), 4, 4)).copy(), places
        along_base = self.measurement.header("frame") == "base"
        found = first_guess(self.sights, self.measurement.stacked(*READ), places, along_base)
        return found.stands, found.places
