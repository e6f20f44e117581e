"""Heat in a machine over a day: bodies that nobody measures, and sensors that follow them late and with a flaw.

All values are kelvin above the state at the start. Time is in seconds from the start of the measurement.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from scipy.signal import lfilter

from .motion import Array

BODIES = ("spindle", "column", "bed", "table", "ambient")
STEP, SPAN = 20.0, 16 * 3600.0
SENSORS_LATE = 0.5, 10.0
"""minutes"""


@dataclass(frozen=True, slots=True)
class Climate:
    """Temperature rises on a time grid: what the bodies have, and what the sensors beside them show; how long the
    measurement takes, s.
    """

    grid: Array
    bodies: dict[str, Array]
    sensors: dict[str, Array]
    level: float
    session: float = 6 * 3600.0

    def body(self, name: str, time: Array) -> Array:
        """True mean rise of a body."""
        result: Array = np.interp(time, self.grid, self.bodies[name])
        return result

    def sensor(self, name: str, time: Array) -> Array:
        """What the sensor shows, degree C."""
        result: Array = self.level + np.interp(time, self.grid, self.sensors[name])
        return result

    def guessed(self, rng: Generator) -> Climate:
        """As it may have been for all that the sensors tell: they are late, and nobody knows by how much."""
        bodies = {}
        for name, values in self.bodies.items():
            late, believed = (_minutes(rng, *SENSORS_LATE) for _ in range(2))
            bodies[name] = np.interp(self.grid + believed - late, self.grid, values)
        return replace(self, bodies=bodies)


def lagged(signal: Array, time_constant: float, step: float = STEP) -> Array:
    """First-order answer to a signal on an even grid, starting at its first value."""
    gain = -np.expm1(-step / time_constant)
    result: Array = lfilter([gain], [1.0, gain - 1.0], signal - signal[0]) + signal[0]
    return result


def draw_climate(rng: Generator) -> Climate:
    """A working day: the spindle runs and rests, the drives work, the hall warms and cools, a chiller cuts in and
    out.
    """
    grid = np.arange(0.0, SPAN, STEP)
    hall = _hall(rng, grid)
    spindle = lagged(_duty(rng, grid) * rng.uniform(5, 16), _minutes(rng, 8, 40)) + _chiller(rng, grid)
    drives = lagged(_duty(rng, grid) * rng.uniform(1.5, 5), _minutes(rng, 10, 50))
    bodies = {
        "spindle": spindle + rng.uniform(0.2, 0.8) * hall,
        "column": lagged(rng.uniform(0.1, 0.4) * spindle + hall, _minutes(rng, 25, 120)) + 0.2 * drives,
        "bed": lagged(0.8 * drives + hall, _minutes(rng, 20, 90)),
        "table": lagged(_duty(rng, grid) * rng.uniform(1.5, 5) + hall, _minutes(rng, 15, 70)),
        "ambient": hall,
    }
    bodies = {name: values - values[0] for name, values in bodies.items()}
    sensors = {name: _sensed(rng, values) for name, values in bodies.items()}
    return Climate(grid, bodies, sensors, rng.uniform(18, 25), 3600 * rng.uniform(4, 8))


def _chiller(rng: Generator, grid: Array) -> Array:
    """A saw of some tenths of a kelvin, on every other machine."""
    size = rng.uniform(0.2, 0.8) if rng.random() < 0.5 else 0.0
    phase = (grid / _minutes(rng, 4, 20) + rng.random()) % 1.0
    saw: Array = size * np.where(phase < 0.7, phase / 0.7, (1 - phase) / 0.3)
    return saw


def _minutes(rng: Generator, low: float, high: float) -> float:
    return 60.0 * float(rng.uniform(low, high))


def _hall(rng: Generator, grid: Array) -> Array:
    """The air: part of a day's swing, a faster one from doors and heating, a little wandering."""
    day = rng.uniform(0.6, 2.5) * np.sin(2 * np.pi * grid / 86400 + rng.uniform(0, 2 * np.pi))
    fast = rng.uniform(0.05, 0.4) * np.sin(2 * np.pi * grid / _minutes(rng, 40, 150) + rng.uniform(0, 2 * np.pi))
    walk = lagged(np.cumsum(rng.normal(size=len(grid))) * rng.uniform(0.005, 0.015), _minutes(rng, 3, 20))
    result: Array = day + fast + walk
    return result


def _duty(rng: Generator, grid: Array) -> Array:
    """Load between 0 and 1: idle at first, then levels that hold for 8 to 75 minutes, some of them idle."""
    level, until = np.zeros(len(grid)), _minutes(rng, 5, 40)
    rests, current = rng.uniform(0.15, 0.45), 0.0
    for i, t in enumerate(grid):
        if t > until:
            current = 0.0 if rng.random() < rests else float(rng.uniform(0.3, 1.0))
            until = t + _minutes(rng, 8, 75)
        level[i] = current
    return level


def _sensed(rng: Generator, body: Array) -> Array:
    """The sensor: its own lag, a gain that is off by up to a sixth, its noise."""
    slow = lagged(body, _minutes(rng, *SENSORS_LATE))
    result: Array = slow * rng.uniform(0.85, 1.15) + rng.normal(scale=rng.uniform(0.02, 0.06), size=len(body))
    return result
