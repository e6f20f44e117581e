"""Effects without a name, as rivals of those with one: any smooth field of the pose, any smooth course of time.

They are random Fourier features of Gaussian processes (Rahimi and Recht 2007), over time regular ones (Solin and
Sarkka 2020), three independent components at the tool tip. Where such a rival explains the data better than every
named effect does, the effect is not in the catalogue.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ncfix.diagnose.catalogue import Candidate
from ncfix.diagnose.groups import Group, fewer
from ncfix.diagnose.view import View
from ncfix.machine import Effect
from ncfix.machine.effect import SPINDLE
from ncfix.measure.measurement import Array

POSE = Candidate("unknown by pose", "something that depends on where the axes are", "", "unknown", (), ())
TIME = Candidate("unknown by time", "something that happens in the course of time", "", "unknown", (), ())
RIVALS = (POSE, TIME)
FEATURES = 40
POSE_LENGTHS = (0.8, 1.6)
"""Of half the travel of every axis at once."""
TIME_LENGTHS = (300.0, 1500.0)
"""s"""


def rivals(view: View) -> tuple[Group, ...]:
    """Both rivals in two lengths each; none where the data do not show the tool tip."""
    tip = view.design([Effect(f"E{letter}{SPINDLE}", (0.0,)) for letter in "XYZ"]) / 1e3
    if not np.abs(tip).max() > 0:
        return ()
    return tuple(
        group for owner, features in _features(view) if (group := _group(view, owner, tip, features)) is not None
    )


def _features(view: View) -> Iterator[tuple[Candidate, Array]]:
    random = np.random.default_rng(1)
    u = scaled(view)
    for length in POSE_LENGTHS:
        yield POSE, _waves(u, length, random)
    time = view.column("time_s")
    if np.ptp(time) > 0:
        for length in TIME_LENGTHS:
            yield TIME, _harmonics(time, length)


def _harmonics(time: Array, length: float) -> Array:
    """Sines over the whole time, their sizes those of a smooth course with bends of this length, (n, k)."""
    rate = np.pi / (1.2 * np.ptp(time))
    orders = np.arange(1, 2 + int(2.5 / (rate * length)))
    phase = (time - time.min() + 0.1 * np.ptp(time))[:, None] * rate * orders
    waves: Array = np.sin(phase) * np.exp(-0.25 * (rate * length * orders) ** 2)
    return waves


def scaled(view: View) -> Array:
    """The axes that moved, -1 ... 1 each; full turns as points of a circle, (n, k)."""
    columns = []
    for index, axis in enumerate(view.machine.axes):
        values = view.q[:, index]
        if not view.reach.moved(axis):
            continue
        low, high = float(values.min()), float(values.max())
        if axis.rotary and high - low > 1.5 * np.pi:
            columns += [np.cos(values), np.sin(values)]
        else:
            columns.append((2 * values - low - high) / (high - low))
    return np.stack(columns, axis=-1) if columns else np.zeros((view.count, 1))


def _waves(u: Array, length: float, random: np.random.Generator) -> Array:
    """Features (n, FEATURES) whose inner products are a Gaussian kernel of this length."""
    frequency = random.normal(scale=1 / length, size=(u.shape[1], FEATURES))
    waves: Array = np.cos(u @ frequency + random.uniform(0, 2 * np.pi, FEATURES))
    return waves


def _group(view: View, owner: Candidate, tip: Array, features: Array) -> Group | None:
    own = features[np.maximum(view.row, 0)]
    columns = (tip[:, :, None] * own[:, None, :]).reshape(len(view.y), -1)
    size = view.rms(np.linalg.norm(columns, axis=1))
    if size == 0:
        return None
    seen = columns / size @ fewer(columns / size)
    return Group(owner, np.zeros((0, seen.shape[1])), seen)
