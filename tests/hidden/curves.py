"""Random curves that no library of bases holds exactly.

Every draw has its own spectrum, its own asymmetry and often saturation; a slope and a mean are taken out where the
base model or the definition of straightness carries them.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.random import Generator

from .motion import Array

Curve = Callable[[Array], Array]
_GRID = np.linspace(-1.0, 1.0, 401)


def smooth(rng: Generator) -> Curve:
    """A curve on [-1, 1] with a drawn spectrum, no mean, no slope, rms 1.

    Twelve waves of drawn, unrelated wavelengths (from five times the travel down to a fifth of it), amplitudes
    falling with a drawn power, on an argument that is itself bent; a saturation acts on one draw in three.
    """
    waves = np.exp(rng.uniform(np.log(0.6), np.log(14.0), 12))
    fall = rng.uniform(1.0, 2.2)
    size = rng.normal(size=12) * waves**-fall
    phase = rng.uniform(0, 2 * np.pi, 12)
    bend, where = rng.uniform(-0.15, 0.15), rng.uniform(0, 2 * np.pi)
    limit = rng.uniform(0.8, 1.6) if rng.random() < 1 / 3 else np.inf

    def raw(u: Array) -> Array:
        v = u + bend * np.sin(2.2 * u + where)
        result: Array = np.sin(np.multiply.outer(v, waves) + phase) @ size
        return result

    return straightened(saturated(raw, limit))


def bump(rng: Generator) -> Curve:
    """Local wear: one dent, steeper on one side than on the other, straightened like a whole error motion."""
    centre, width = rng.uniform(-0.6, 0.6), rng.uniform(0.1, 0.2)
    skew, power = rng.uniform(0.6, 1.7), rng.uniform(1.6, 2.6)

    def raw(u: Array) -> Array:
        side = np.where(u > centre, width * skew, width / skew)
        return np.exp(-(np.abs((u - centre) / side) ** power))

    return straightened(raw)


def saturated(raw: Curve, limit: float) -> Curve:
    """The curve pressed softly below `limit` times its rms."""
    if not np.isfinite(limit):
        return raw
    size = limit * float(np.sqrt(np.mean(raw(_GRID) ** 2)))
    return lambda u: size * np.tanh(raw(u) / size)


def straightened(raw: Curve) -> Curve:
    """Mean and slope over [-1, 1] taken out, rms 1."""
    values = raw(_GRID)
    slope, mean = np.polyfit(_GRID, values, 1)
    size = float(np.sqrt(np.mean((values - mean - slope * _GRID) ** 2)))
    return lambda u: (raw(u) - mean - slope * u) / size


def turning(rng: Generator, first: int, fall: float = 2.0, share: float = 0.2) -> Curve:
    """A curve of an angle that closes: order `first` leads, higher orders fall, a local swelling no order describes.

    `share` is the size of what is not the leading order.
    """
    orders = first * np.arange(1, 5)
    size = np.array([1.0, share, share / 2, share / 4]) * rng.uniform(0.5, 1.2, 4)
    phase = rng.uniform(0, 2 * np.pi, 4)
    local, where, sharp = share * rng.uniform(-0.7, 0.7), rng.uniform(0, 2 * np.pi), fall * rng.uniform(2.0, 5.0)

    def curve(angle: Array) -> Array:
        waves: Array = np.sin(np.multiply.outer(angle, orders) + phase) @ size
        swelling = np.exp(sharp * (np.cos(angle - where) - 1.0))
        return waves + local * (swelling - 0.3)

    return curve


def pitch_wave(rng: Generator, pitch: float) -> Curve:
    """A screw's error over positions in mm: true pitch 0.1 % off, two higher orders, a size that wanders along the
    screw.
    """
    true = pitch * (1 + rng.uniform(-1e-3, 1e-3))
    size = np.array([1.0, rng.uniform(0.1, 0.5), rng.uniform(0.0, 0.2)])
    phase = rng.uniform(0, 2 * np.pi, 3)
    swell, at = rng.uniform(0.1, 0.35), rng.uniform(0, 2 * np.pi)

    def curve(position: Array) -> Array:
        turns = 2 * np.pi * position / true
        waves: Array = np.sin(np.multiply.outer(turns, np.arange(1, 4)) + phase) @ size
        return waves * (1 + swell * np.sin(position / 90.0 + at))

    return curve


def play(rng: Generator) -> Callable[[Array, Array], Array]:
    """Lost motion: of (u, direction); its size changes along the travel by slope and wave, and differs by side."""
    slope, wave, phase = rng.uniform(-0.3, 0.3), rng.uniform(-0.15, 0.15), rng.uniform(0, 2 * np.pi)
    lean = rng.uniform(-0.2, 0.2)

    def curve(u: Array, direction: Array) -> Array:
        size = 1 + slope * u + wave * np.sin(4 * u + phase)
        return 0.5 * size * (direction + lean * np.abs(direction))

    return curve


def bent(rng: Generator, power: float) -> Curve:
    """A one-sided deflection of s in [0, 1]: s ** power near the stated power, stiffening towards the end."""
    exponent, stiff = power * rng.uniform(0.85, 1.15), rng.uniform(0.0, 0.35)
    return lambda s: np.clip(s, 0, None) ** exponent * (1 - stiff * np.clip(s, 0, None) ** 2)
