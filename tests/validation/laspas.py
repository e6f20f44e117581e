"""T. Laspas (KTH 2014): his three-axis machine with curves of the sizes that he prints, and his first tool path.

The error tables themselves are not printed, only their statistics: the curves here are smooth, random, and have the
printed systematic deviation E (for straightness the mean deviation M) as their range.
"""

from __future__ import annotations

import numpy as np

from ncfix.machine import Axis, Effect, GaugeLine, Machine, State
from ncfix.machine.piecewise import PiecewiseLinear

PLACES = {"X": np.arange(-800.0, -49.0, 50), "Y": np.arange(-400.0, -24.0, 25), "Z": np.arange(-300.0, -24.0, 25)}
# um, mrad: Tables 4 to 6
RANGES = {
    "EXX": 17.1, "EYX": 5.62, "EZX": 4.51, "EBX": 0.0179, "ECX": 0.01, "EYY": 18.96, "EXY": 3.04, "EZY": 2.45,
    "EAY": 0.0252, "ECY": 0.0232, "EZZ": 21.5, "EXZ": 1.25, "EYZ": 0.72, "EAZ": 0.0138, "EBZ": 0.028,
}  # fmt: skip
MEASURED_AT = {"X": (-800.0, -256.0, -478.0), "Y": (0.0, 0.0, -500.0), "Z": (0.0, 0.0, -130.0)}
"""Measurement points, base frame with all axes at home: machine coordinates and stick-out, mm."""
LENGTH = 200.0
PRINTED = (8.5, 24.3, 26.7)
"""Table 10, path 1: largest deviations in X, Y and Z, um."""
HOME = Machine(
    "Laspas",
    "w X F Y Z t",
    (
        Axis("X", False, True, (-1.0, 0.0, 0.0), range=(-990.0, 0.0)),
        Axis("Y", False, False, (0.0, 1.0, 0.0), range=(-500.0, 0.0)),
        Axis("Z", False, False, (0.0, 0.0, 1.0), range=(-460.0, 0.0)),
    ),
    GaugeLine((0.0, 0.0, 1.0), (0.0, 0.0, 0.0)),
)


def drawn(seed: int, y_to_z: float) -> Machine:
    """The machine with random curves and his three squarenesses, that of Y to Z as given, um/m."""
    random = np.random.default_rng(seed)
    squareness = {"EC0X": 14.569, "EB0X": -24.362, "EA0Y": y_to_z}
    effects = [Effect(name, (float(random.choice([-1, 1])) * 1e-6 * value,)) for name, value in squareness.items()]
    for name, size in RANGES.items():
        places = PLACES[name[2]]
        curve = _curve(random, len(places), name[1] == name[2]) * size * 1e-3
        table = PiecewiseLinear(tuple(places.tolist()))
        effects.append(Effect(name, tuple(curve.tolist()), table, reference=MEASURED_AT[name[2]]))
    return HOME.replace(effects=tuple(effects))


def _curve(random: np.random.Generator, count: int, slope: bool) -> np.ndarray:
    """A few waves, with a slope for positioning; zero at the home end, of range one."""
    u = np.linspace(0, 1, count)
    waves = sum(
        random.standard_normal() / k * np.sin(np.pi * k * u + random.uniform(0, 2 * np.pi)) for k in (1, 2, 3, 4)
    )
    curve = waves + (2 * random.standard_normal() * u if slope else 0.0)
    return (curve - curve[-1]) / np.ptp(curve)


def path_1() -> np.ndarray:
    """The rectangle X -350 .. -650, Y -150 .. -350 at Z -280, every 5 mm."""
    x, y = np.arange(-650.0, -349.0, 5), np.arange(-350.0, -149.0, 5)
    sides = [(x, -350.0), (x, -150.0), (-650.0, y), (-350.0, y)]
    corners = [np.stack(np.broadcast_arrays(a, b), axis=-1) for a, b in sides]
    flat = np.concatenate(corners)
    return np.column_stack([flat, np.full(len(flat), -280.0)])


def largest_um(machine: Machine) -> np.ndarray:
    """Largest deviations along path 1 in X, Y and Z, um."""
    return 1e3 * np.abs(machine.error(path_1(), State(LENGTH))[:, :3]).max(axis=0)
