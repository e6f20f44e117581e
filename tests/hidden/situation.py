"""Everything that holds when something is measured: poses, how they were reached, when, how warm, with which tool."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from .chain import Machine
from .climate import Climate
from .motion import Array, Ints, Mask


@dataclass(frozen=True, slots=True)
class Situation:
    """One row a measurement, in the order of time. `q` (n, n_axes) mm and rad; `direction` the same shape, -1 0 1.

    `set_id` numbers the set-ups (ball, tool, load); `block` the regions of which some are held out; `centre` and
    `radius` belong to length measurements and are NaN elsewhere.
    """

    machine: Machine
    climate: Climate
    q: Array
    direction: Array
    time: Array
    length: Array
    load: Array
    set_id: Ints
    repeat: Ints
    block: Ints
    centre: Array
    radius: Array

    def __len__(self) -> int:
        return len(self.q)

    def column(self, axis: str) -> Array:
        """Positions of one axis, mm or rad."""
        return self.q[:, self.machine.axes.index(axis)]

    def moving(self, axis: str) -> Array:
        """Approach direction of one axis."""
        return self.direction[:, self.machine.axes.index(axis)]

    def u(self, axis: str) -> Array:
        """Position of one axis as -1 .. 1 of its travel."""
        joint = self.machine.joint(axis)
        position = self.column(axis) / joint.unit
        return (2 * position - joint.low - joint.high) / (joint.high - joint.low)

    def warm(self, body: str) -> Array:
        """True rise of a body's temperature."""
        return self.climate.body(body, self.time)

    def ball(self) -> Array:
        """Nominal tip, workpiece frame (n, 3)."""
        return self.machine.nominal_tip(self.q, self.length)

    def rows(self, index: Ints | Mask) -> Situation:
        """Some of the rows."""
        kept = {f.name: getattr(self, f.name)[index] for f in fields(self) if f.name not in ("machine", "climate")}
        return replace(self, **kept)


def joined(parts: list[Situation]) -> Situation:
    """Rows of several situations on one machine and day, in the order of time."""
    names = [f.name for f in fields(Situation) if f.name not in ("machine", "climate")]
    columns: dict[str, Any] = {name: np.concatenate([getattr(p, name) for p in parts]) for name in names}
    whole = replace(parts[0], **columns)
    return whole.rows(np.argsort(whole.time, kind="stable"))
