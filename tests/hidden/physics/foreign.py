"""What no catalogue has: the right answer is "unknown effect". Two (cable drag, slip) have a row and may be named."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from ..chain import Machine
from ..motion import Array
from ..situation import Situation
from .entry import Entry, Field, spread


def entries(machine: Machine) -> list[Entry]:
    """All of them for one machine."""
    result = [_pose_field(), _creep(), _pulse(), _shove(machine), _wander(), _slip()]
    if sum(joint.rotary for joint in machine.joints) == 2:
        result += [_cable(machine)]
    return result


def _of_workpiece(vectors: Array, s: Situation, frame: str = "F") -> Array:
    """Shifts (n, 3) of one frame as twists."""
    result = np.zeros((len(s), len(s.machine.frames), 6))
    result[:, s.machine.frames.index(frame), :3] = vectors
    return result


def _features(s: Situation) -> Array:
    """All axes, -1 .. 1 each."""
    return np.stack([s.u(name) for name in s.machine.axes], axis=-1)


def _entry(name: str, row: int, draw: object) -> Entry:
    return Entry(name, row, name, "", (), "foreign", draw)  # type: ignore[arg-type]


def _pose_field() -> Entry:
    """Nothing rigid: every pose has its own smooth error vector."""

    def draw(rng: Generator) -> Field:
        reach, count = rng.uniform(0.5, 1.2), int(rng.integers(30, 120))
        seed = int(rng.integers(2**32))

        def twists(s: Situation) -> Array:
            own = np.random.default_rng(seed)
            x = _features(s)
            waves = own.normal(scale=1 / reach, size=(x.shape[1], count))
            parts = np.sin(x @ waves * 1.6 + own.uniform(0, 2 * np.pi, count))
            return _of_workpiece(parts @ own.normal(size=(count, 3)), s)

        return twists

    return _entry("pose field", 0, draw)


def _creep() -> Entry:
    """The structure settles after every move: the error follows where the axes were in the last half hour."""

    def draw(rng: Generator) -> Field:
        pull, slow = rng.normal(size=(8, 3)), np.exp(rng.uniform(np.log(600), np.log(3600)))

        def twists(s: Situation) -> Array:
            x = _features(s)
            state, last = x[0].copy(), s.time[0]
            memory = np.empty_like(x)
            for i in range(len(s)):
                state = state + (x[i] - state) * -np.expm1(-(s.time[i] - last) / slow)
                memory[i], last = state, s.time[i]
            return _of_workpiece(memory @ pull[: x.shape[1]], s)

        return twists

    return _entry("creep", 0, draw)


def _pulse() -> Entry:
    """Coolant comes and goes: a swing of ten minutes to an hour with uneven strokes, tied to no sensor or position."""

    def draw(rng: Generator) -> Field:
        period, phase = rng.uniform(500, 3000), rng.uniform(0, 2 * np.pi)
        way, skew, swell = rng.normal(size=3), rng.uniform(0.0, 0.9), rng.uniform(0.1, 0.6)

        def twists(s: Situation) -> Array:
            turn = 2 * np.pi * s.time / period + phase
            stroke = np.sin(turn + skew * np.sin(turn)) * (1 + swell * np.sin(turn / 5.3))
            return _of_workpiece(np.outer(stroke, way), s)

        return twists

    return _entry("pulse", 0, draw)


def _shove(machine: Machine) -> Entry:
    """In one region of the pose space a cover rubs and shoves the slide aside; elsewhere nothing."""
    count = len(machine.axes)

    def draw(rng: Generator) -> Field:
        centre, size = rng.uniform(-0.45, 0.45, count), rng.uniform(0.35, 0.65)
        way, edge, power = rng.normal(size=(1 + count, 3)), rng.uniform(0.1, 0.35), rng.uniform(0.5, 1.5)

        def twists(s: Situation) -> Array:
            off = (_features(s) - centre) / size
            region = np.exp(-np.mean(off**2, axis=1))
            strength = np.clip(region - edge, 0, None) ** power
            return _of_workpiece(strength[:, None] * (way[0] + 0.6 * np.tanh(off) @ way[1:]), s)

        return twists

    return _entry("shove", 0, draw)


def _wander() -> Entry:
    """The instrument's stand walks about at random, in all directions."""

    def draw(rng: Generator) -> Field:
        steps = np.cumsum(rng.normal(size=(2000, 3)), axis=0)
        kernel = np.hanning(2 * int(rng.integers(8, 40)) + 1)
        walk = np.stack([np.convolve(steps[:, k], kernel, "same") for k in range(3)], axis=1)
        rate = rng.uniform(25, 60)

        def twists(s: Situation) -> Array:
            index = np.minimum(s.time / rate, len(walk) - 1)
            now = np.stack([np.interp(index, np.arange(len(walk)), walk[:, k]) for k in range(3)], axis=1)
            return _of_workpiece(now - now.mean(axis=0), s, "W")

        return twists

    return _entry("wander", 0, draw)


def _slip() -> Entry:
    """Something slips once: before and after differ by a vector (catalogue row 49)."""

    def draw(rng: Generator) -> Field:
        at, way = rng.uniform(0.2, 0.8), rng.normal(size=3)

        def twists(s: Situation) -> Array:
            return _of_workpiece(np.outer(s.time > at * s.climate.session, way), s)

        return twists

    return _entry("slip", 49, draw)


def _cable(machine: Machine) -> Entry:
    """A hose to the swivelling part pulls by both angles at once (catalogue row 48)."""
    first, second = (joint.name for joint in machine.joints if joint.rotary)

    def draw(rng: Generator) -> Field:
        phase, lean = rng.uniform(0, 2 * np.pi, 2), spread(rng, 0.0, 0.6)
        way, rate = rng.normal(size=3), rng.uniform(0.7, 1.6)

        def twists(s: Situation) -> Array:
            pull = np.sin(s.column(first) + phase[0]) * np.sin(rate * s.column(second) + phase[1])
            return _of_workpiece(np.outer(pull + lean * pull * s.moving(first), way), s)

        return twists

    return _entry("cable drag", 48, draw)
