"""What instruments show of a tip that is not where it should be, with the set-up's unknowns and the noise in it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from .motion import Array, Ints, turned
from .situation import Situation

Tips = Callable[[Situation], tuple[Array, Array]]


@dataclass(frozen=True, slots=True)
class Noise:
    """Of one coordinate, micrometre: standard deviation of all of it, degrees of freedom of its tails (inf: normal),
    the share of rows that are wrong by 5 to 15 times that, the part that wanders with time (first order) and how long
    it remembers, s; and the share of outliers that are wrong in one coordinate only.
    """

    sigma_um: float = 3.0
    tails: float = 5.0
    outliers: float = 0.01
    wander_um: float = 0.3
    memory: float = 900.0
    lonely: float = 0.0


CUT = 6.0
SILENT = Noise(sigma_um=0.0, outliers=0.0, wander_um=0.0)


def draw_instrument(rng: Generator, clean: bool) -> Noise:
    """Three micrometres in every case; tails, outliers and wandering are the instrument's own. A clean one has tails
    only.
    """
    tails = float(np.exp(rng.uniform(np.log(4.5), np.log(30.0))))
    if clean:
        return Noise(tails=tails, outliers=0.0, wander_um=0.0)
    memory = float(np.exp(rng.uniform(np.log(240), np.log(5400))))
    return Noise(3.0, tails, rng.uniform(0.004, 0.016), rng.uniform(0.1, 0.6), memory, rng.uniform(0.0, 0.6))


@dataclass(frozen=True, slots=True)
class Setup:
    """What nobody knows: where the balls really are (workpiece frame) and where the stylus tip is (tool frame), mm,
    per set.
    """

    balls: dict[int, Array]
    stylus: dict[int, Array]

    def offsets(self, s: Situation) -> tuple[Array, Array]:
        """Both for every row, (n, 3) each."""
        return np.array([self.balls[int(k)] for k in s.set_id]), np.array([self.stylus[int(k)] for k in s.set_id])


def draw_setup(rng: Generator, s: Situation, kind: str) -> Setup:
    """Offsets of some hundredths for an R-test, of up to a millimetre for probed balls.

    A stylus belongs to its tool (number % 2) whatever the set; a bar's cup has none. Probed balls (number // 2) keep
    their place for both tools; else every set is set up anew.
    """
    size = rng.uniform(0.2, 1.0) if kind == "probe" else rng.uniform(0.01, 0.05)
    sets = [int(k) for k in np.unique(s.set_id)]
    tools = {k: np.zeros(3) if kind == "length" else rng.uniform(-size, size, 3) for k in range(2)}
    places = {k: rng.uniform(-size, size, 3) for k in sets}
    balls = {k: places[min(j for j in sets if j // 2 == k // 2)] for k in sets} if kind == "probe" else places
    return Setup(balls, {k: tools[k % 2] for k in sets})


def draw_noise(rng: Generator, noise: Noise, time: Array, width: int) -> tuple[Array, Ints]:
    """(n, width) in mm, tails cut at six sigma, and the rows that are outliers beyond that."""
    n = len(time)
    drawn = np.clip(rng.standard_t(noise.tails, (n, width)) / np.sqrt(noise.tails / (noise.tails - 2)), -CUT, CUT)
    drawn *= np.sqrt(max(noise.sigma_um**2 - noise.wander_um**2, 0.0))
    drawn += noise.wander_um * _wander(rng, time, width, noise.memory)
    bad = np.flatnonzero(rng.random(n) < noise.outliers)
    away = rng.normal(size=(len(bad), width))
    alone = rng.random(len(bad)) < noise.lonely
    away[alone] *= np.arange(width) == rng.integers(width, size=(int(alone.sum()), 1))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    drawn[bad] += away * noise.sigma_um * rng.uniform(5, 15, (len(bad), 1))
    return drawn * 1e-3, bad


def _wander(rng: Generator, time: Array, width: int, memory: float) -> Array:
    """A first-order wandering with variance 1."""
    keep = np.exp(-np.diff(time, prepend=time[0]) / memory)
    state, result = rng.normal(size=width), np.empty((len(time), width))
    for i, k in enumerate(keep):
        state = k * state + np.sqrt(1 - k * k) * rng.normal(size=width)
        result[i] = state
    return result


def tcp(s: Situation, tips: Tips, setup: Setup) -> Array:
    """kind tcp: where the tool's reference point is, minus where it should be, workpiece frame (n, 3), mm."""
    actual, turn = tips(s)
    balls, stylus = setup.offsets(s)
    result: Array = actual + turned(turn, stylus) - balls - s.machine.nominal_tip(s.q, s.length)
    return result


def probe(s: Situation, tips: Callable[[Situation, Array], tuple[Array, Array]], setup: Setup) -> Array:
    """kind probe: positions of the linear axes (n, 3) X Y Z with which the stylus tip sits in the ball's centre, mm.

    `tips(s, q)` gives the true tip with other axis positions than the situation's.
    """
    balls, stylus = setup.offsets(s)
    target = s.machine.nominal_tip(s.q, s.length) + balls
    columns = [i for i, joint in enumerate(s.machine.joints) if not joint.rotary]
    steps = s.machine.linear_steps(s.q, s.length)
    q = s.q.copy()
    for _ in range(6):
        actual, turn = tips(s, q)
        q[:, columns] += turned(steps, target - actual - turned(turn, stylus))
    return np.stack([q[:, s.machine.axes.index(letter)] for letter in "XYZ"], axis=1)


def length(s: Situation, tips: Tips, setup: Setup) -> Array:
    """kind length: distance from the ball-bar's centre to the ball in the spindle (n, 1), mm."""
    actual, turn = tips(s)
    balls, stylus = setup.offsets(s)
    result: Array = np.linalg.norm(actual + turned(turn, stylus) - s.centre - balls, axis=1, keepdims=True)
    return result
