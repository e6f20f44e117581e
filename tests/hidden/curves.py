"""Random curves that no library of bases holds exactly.

A curve of a travel comes from one of five families of shapes, each with its own spectrum, asymmetry and often
saturation; a slope and a mean are taken out where the base model or the definition of straightness carries them.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.random import Generator
from scipy.interpolate import CubicSpline

from .motion import Array

Curve = Callable[[Array], Array]
_GRID = np.linspace(-1.0, 1.0, 401)


def smooth(rng: Generator) -> Curve:
    """A curve on [-1, 1] of a drawn family, no mean, no slope, rms 1.

    Half of them are waves, the others bows, joints of rails, hills or walks; the argument is itself bent, and a
    saturation acts on one draw in three.
    """
    families = (wavy, bowed, jointed, hilly, walked)
    shape = families[int(rng.choice(len(families), p=(0.5, 0.125, 0.125, 0.125, 0.125)))](rng)
    bend, where, rate = rng.uniform(-0.2, 0.2), rng.uniform(0, 2 * np.pi), rng.uniform(1.5, 3.0)
    limit = rng.uniform(0.8, 1.8) if rng.random() < 1 / 3 else np.inf
    return straightened(saturated(lambda u: shape(u + bend * np.sin(rate * u + where)), limit))


def wavy(rng: Generator) -> Curve:
    """Waves of unrelated lengths, from six times the travel down to a fifth of it, falling with a drawn power."""
    count = int(rng.integers(6, 20))
    waves = np.exp(rng.uniform(np.log(0.5), np.log(rng.uniform(7.0, 16.0)), count))
    size = rng.normal(size=count) * waves ** -rng.uniform(0.9, 2.4)
    phase = rng.uniform(0, 2 * np.pi, count)
    return lambda u: np.sin(np.multiply.outer(u, waves) + phase) @ size


def bowed(rng: Generator) -> Curve:
    """A sagging or crowned way: a power of the distance from somewhere, unlike on both sides."""
    centre, left, right = rng.uniform(-0.5, 0.5), rng.uniform(1.5, 4.0), rng.uniform(1.5, 4.0)
    lean = rng.uniform(-1.0, 1.0)

    def curve(u: Array) -> Array:
        off = np.abs(u - centre)
        return np.where(u < centre, off**left, lean * off**right)

    return curve


def jointed(rng: Generator) -> Curve:
    """Rails screwed down in pieces: two to four bends, each rounded over a tenth of the travel or so."""
    count = int(rng.integers(2, 5))
    place, turn = rng.uniform(-0.8, 0.8, count), rng.normal(size=count)
    soft = rng.uniform(0.04, 0.15)
    return lambda u: np.logaddexp(0.0, (np.subtract.outer(u, place)) / soft) @ (soft * turn)


def hilly(rng: Generator) -> Curve:
    """Two to five hills and hollows of unlike widths."""
    count = int(rng.integers(2, 6))
    place, width, size = rng.uniform(-1, 1, count), rng.uniform(0.15, 0.6, count), rng.normal(size=count)
    return lambda u: (1 / (1 + (np.subtract.outer(u, place) / width) ** 2)) @ size


def walked(rng: Generator) -> Curve:
    """What scraping left: a walk that was smoothed over a drawn length."""
    knots = int(rng.integers(6, 14))
    shape = CubicSpline(np.linspace(-1.3, 1.3, knots), np.cumsum(rng.normal(size=knots)))
    return lambda u: np.asarray(shape(np.clip(u, -1.3, 1.3)))


def bump(rng: Generator) -> Curve:
    """Local wear: one dent, steeper on one side than on the other, straightened like a whole error motion."""
    centre, width = rng.uniform(-0.65, 0.65), rng.uniform(0.09, 0.25)
    skew, power = rng.uniform(0.5, 2.0), rng.uniform(1.3, 3.2)

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

    `share` is about the size of what is not the leading order; one draw in three has an argument that is bent (gear
    and disc run out together).
    """
    orders = first * np.arange(1, 7)
    share = share * rng.uniform(0.5, 1.5)
    size = np.r_[1.0, share * rng.uniform(0.4, 0.8) ** np.arange(5)] * rng.uniform(0.4, 1.3, 6)
    phase = rng.uniform(0, 2 * np.pi, 6)
    local, where, sharp = share * rng.uniform(-0.9, 0.9), rng.uniform(0, 2 * np.pi), fall * rng.uniform(1.5, 7.0)
    bend = rng.uniform(-0.2, 0.2) if rng.random() < 1 / 3 else 0.0

    def curve(angle: Array) -> Array:
        bent = angle + bend * np.sin(angle - where)
        waves: Array = np.sin(np.multiply.outer(bent, orders) + phase) @ size
        swelling = np.exp(sharp * (np.cos(angle - where) - 1.0))
        return waves + local * (swelling - 0.3)

    return curve


def pitch_wave(rng: Generator, pitch: float) -> Curve:
    """A screw's error over positions in mm: true pitch up to 0.1 % off, three higher orders, a size that wanders along
    the screw.
    """
    true = pitch * (1 + rng.uniform(-1e-3, 1e-3))
    size = np.array([1.0, rng.uniform(0.1, 0.6), rng.uniform(0.0, 0.3), rng.uniform(0.0, 0.15)])
    phase = rng.uniform(0, 2 * np.pi, 4)
    swell, at, length = rng.uniform(0.05, 0.45), rng.uniform(0, 2 * np.pi), rng.uniform(50.0, 250.0)

    def curve(position: Array) -> Array:
        turns = 2 * np.pi * position / true
        waves: Array = np.sin(np.multiply.outer(turns, np.arange(1, 5)) + phase) @ size
        return waves * (1 + swell * np.sin(position / length + at))

    return curve


def play(rng: Generator) -> Callable[[Array, Array], Array]:
    """Lost motion: of (u, direction); its size changes along the travel by slope and wave, differs by side, and one
    draw in three has a worn place.
    """
    slope, wave, phase = rng.uniform(-0.4, 0.4), rng.uniform(-0.25, 0.25), rng.uniform(0, 2 * np.pi)
    rate, lean = rng.uniform(2.0, 6.0), rng.uniform(-0.3, 0.3)
    worn, where = (rng.uniform(0.2, 0.8) if rng.random() < 1 / 3 else 0.0), rng.uniform(-0.7, 0.7)

    def curve(u: Array, direction: Array) -> Array:
        size = 1 + slope * u + wave * np.sin(rate * u + phase) + worn * np.exp(-(((u - where) / 0.3) ** 2))
        return 0.5 * size * (direction + lean * np.abs(direction))

    return curve


def bent(rng: Generator, power: float) -> Curve:
    """A one-sided deflection of s in [0, 1]: s ** power near the stated power, stiffening towards the end."""
    exponent, stiff = power * rng.uniform(0.8, 1.25), rng.uniform(0.0, 0.5)
    return lambda s: np.clip(s, 0, None) ** exponent * (1 - stiff * np.clip(s, 0, None) ** 2)
