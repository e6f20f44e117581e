"""What tables leave: the error of the tool tip over poses at random, with the tables off and with them on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ncfix.machine import Machine, State
from ncfix.tables.grid import Array
from ncfix.tables.neutral import Tables
from ncfix.tables.poses import random_poses, random_ways

POSES = 20_000
"""Random poses at which is looked what tables leave."""


@dataclass(frozen=True, slots=True)
class Residual:
    """Tip errors at poses q (n, n_axes), before and after (n,), mm; `largest` correction per axis (n_axes,)."""

    names: tuple[str, ...]
    rotary: NDArray[np.bool_]
    q: Array
    before: Array
    after: Array
    largest: Array

    def figures(self) -> dict[str, dict[str, Any]]:
        """As `--json` has it, um; `at` is the pose with the most left, mm and degree."""
        worst = int(np.argmax(self.after))
        pose = np.where(self.rotary, np.degrees(self.q[worst]), self.q[worst])
        at = {name: round(float(value), 3) for name, value in zip(self.names, pose, strict=True)}
        return {"before": _size(self.before), "after": {**_size(self.after), "at": at}}


def _size(error: Array) -> dict[str, float]:
    rms = float(np.sqrt(np.mean(error**2)))
    return {"max": 1e3 * float(error.max()), "rms": 1e3 * rms, "mean": 1e3 * float(error.mean())}


def residual(
    machine: Machine, tables: Tables, space: Array, tool_length: float, count: int = POSES, seed: int = 7
) -> Residual:
    """Run the machine with the tables active over `count` random poses of the space (n_axes, 2).

    The tables see the commanded position, as controls do with setpoint inputs; every axis comes from either side.
    """
    q = random_poses(space, count, seed)
    ways = random_ways(len(space), count, seed + 1)
    state = State(tool_length, ways)
    correction = tables.for_tool(tool_length).at(machine.axis_names, q, ways)
    meant = machine.tip(q, tool_length)
    return Residual(
        machine.axis_names,
        machine.rotary,
        q,
        np.linalg.norm(machine.actual_tip(q, state) - meant, axis=-1),
        np.linalg.norm(machine.actual_tip(q + correction, state) - meant, axis=-1),
        np.abs(correction).max(axis=0),
    )
