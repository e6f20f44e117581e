"""The same machine measured again, at poses that the code under test proposed, or at random ones for comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from . import designs, files, instruments
from .motion import Array
from .scenario import Scenario
from .situation import Situation

Pose = Mapping[str, float]
NEW_SETS = 50


def at_poses(scene: Scenario, poses: Sequence[Pose], seed: int) -> str:
    """A tcp file of the scenario's machine at poses in the file's units (mm, degree); later on the same day, newly
    set up.

    A pose is a row of a measurement file without its values: axis letters, and where it says so `tool_length`,
    `dir_<axis>`, `load_kg`. What is not said: axis at zero, the first tool and load of the scenario, an approach by
    chance.
    """
    return _measured(scene, _situation(scene, poses, seed), seed)


def at_random(scene: Scenario, count: int, seed: int) -> str:
    """The same at `count` random poses within the travels, with all tools."""
    rng, draft = np.random.default_rng([seed, 1]), scene.draft
    design = replace(designs.FREE, count=count, repeated=0)
    lengths = draft.world.machine.lengths
    s = designs.lay_out(rng, draft.world.machine, draft.topology, draft.situation.climate, lengths, design)
    times = _later(scene, count)
    sets = NEW_SETS + np.searchsorted(np.unique(s.length), s.length)
    return _measured(scene, replace(s, time=times, set_id=sets, load=0 * s.load + scene.draft.situation.load[0]), seed)


def _later(scene: Scenario, count: int) -> Array:
    result: Array = scene.draft.situation.time[-1] + 120.0 * (1 + np.arange(count))
    return result


def _situation(scene: Scenario, poses: Sequence[Pose], seed: int) -> Situation:
    s, rng = scene.draft.situation, np.random.default_rng([seed, 2])
    machine, n = s.machine, len(poses)
    q = np.array([[pose.get(name, 0.0) for name in machine.axes] for pose in poses]) * machine.units
    length = np.array([pose.get("tool_length", s.length[0]) for pose in poses], dtype=float)
    chance = rng.choice((-1.0, 1.0), q.shape)
    direction = [
        [pose.get(f"dir_{a}", chance[i, k]) for k, a in enumerate(machine.axes)] for i, pose in enumerate(poses)
    ]
    sets = np.searchsorted(np.unique(length), length)
    nothing, zero = np.full(n, np.nan), np.zeros(n, dtype=int)
    load = np.array([pose.get("load_kg", s.load[0]) for pose in poses], dtype=float)
    return Situation(
        machine, s.climate, q, np.array(direction), _later(scene, n), length, load, NEW_SETS + sets, zero, zero,
        np.full((n, 3), np.nan), nothing,
    )  # fmt: skip


def _measured(scene: Scenario, s: Situation, seed: int) -> str:
    """Balls newly set up, one set a tool; a tool that was there before has the stylus it had."""
    rng = np.random.default_rng([seed, 3])
    setup = instruments.draw_setup(rng, s, "tcp")
    before = scene.draft.situation
    had = {float(x): scene.setup.stylus[int(k)] for x, k in zip(before.length, before.set_id, strict=True)}
    lengths = {int(k): float(x) for k, x in zip(s.set_id, s.length, strict=True)}
    stylus = {k: had[x] if x in had else rng.uniform(-0.03, 0.03, 3) for k, x in lengths.items()}
    values = instruments.tcp(s, scene.draft.world.tips, replace(setup, stylus=stylus))
    drawn, _ = instruments.draw_noise(rng, replace(scene.noise, outliers=0.0), s.time, 3)
    return files.measurement(s, "tcp", values + drawn)
