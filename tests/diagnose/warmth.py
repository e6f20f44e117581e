"""How machines warm, and what their thermometers make of it: bodies with their own heat and lags, sensors that sit
elsewhere, are late, and read a share of something else.

Nothing of this is how the catalogue has it: lags are drawn from a continuum, what heats a body comes and goes in blocks
of its own, and the air has a day that is no sine.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from ncfix.measure.measurement import Array

DAY = 86400.0
BODIES: Mapping[str, tuple[float, float]] = {
    "spindle": (480.0, 2400.0),
    "frame": (2400.0, 9000.0),
    "table": (1200.0, 7200.0),
    "slide": (900.0, 5400.0),
}
"""Body -> (least, largest) time constant, s."""
SENSORS: Mapping[str, tuple[str, float]] = {
    "spindle": ("spindle", 12.0),
    "column": ("frame", 5.0),
    "bed": ("frame", 3.5),
}
"""Sensor -> the body on which it sits, and how warm that gets, K."""
STEP = 30.0
"""s: in which heat comes and goes."""
LATE = (60.0, 1800.0)
"""s: by how much a sensor lags its body."""
ELSEWHERE = 0.35
"""Largest share of its reading that comes from another body or the air."""
READ_K = 0.05
FOLLOWED = {"spindle growth": "spindle", "drift": "frame", "rotary centre drift": "table", "ambient swing": "air"}
"""What an effect follows; slides follow bodies of their own."""


@dataclass(frozen=True, repr=False)
class Warmth:
    """One day of a machine.

    clock    (k,) s, evenly spaced; air (k,) K about its mean
    bodies   name -> (k,) warmth; sensors name -> (k,) degree Celsius
    """

    clock: Array
    air: Array
    bodies: Mapping[str, Array]
    sensors: Mapping[str, Array]

    @classmethod
    def drawn(cls, last: float, random: Generator) -> Warmth:
        """A day up to this time; some machines have fewer sensors."""
        clock = np.arange(0.0, last + STEP, STEP)
        phase, second = random.uniform(0, 2 * np.pi, 2)
        turn = 2 * np.pi * clock / DAY
        doors = _lagged(_blocks(clock, random), clock, 1800.0)
        air = 1.5 * np.sin(turn + phase) + 0.4 * np.sin(2 * turn + second) + 0.2 * doors
        bodies = {name: _body(name, clock, random) for name in BODIES}
        kept = [name for name in SENSORS if name == "spindle" or random.random() < 0.7]
        sensors = {name: _read(name, bodies, air, clock, random) for name in kept}
        if random.random() < 0.85:
            sensors["ambient"] = _lagged(air, clock, _between(LATE, random)) + READ_K * random.normal(size=len(clock))
        return cls(clock, air, bodies, {f"temp_{name}": values + 22 for name, values in sensors.items()})

    def at(self, time: Array, values: Array) -> Array:
        """Values at these times."""
        return np.interp(time, self.clock, values)

    def course(self, name: str, time: Array, random: Generator) -> Array:
        """What an effect follows in the course of time, (n,), of any size."""
        key = next((body for kind, body in FOLLOWED.items() if name.startswith(kind)), "slide")
        if key == "air":
            return self.at(time, _lagged(self.air, self.clock, _between((1200.0, 9000.0), random)))
        own = self.bodies[key] if key != "slide" else _body("slide", self.clock, random)
        other = self.bodies[random.choice(list(self.bodies))]
        mixed = own / own.std() + random.uniform(0, 0.25) * other / other.std()
        return self.at(time, mixed)


def _between(limits: tuple[float, float], random: Generator) -> float:
    """Log-uniform."""
    return float(np.exp(random.uniform(*np.log(limits))))


def _blocks(clock: Array, random: Generator) -> Array:
    """Heat that comes and goes in blocks of 10 to 90 minutes, off in a third of them."""
    found, at = np.zeros(len(clock)), 0
    while at < len(clock):
        long = int(random.uniform(600, 5400) / STEP)
        found[at : at + long] = random.uniform(0.2, 1.0) * (random.random() > 0.33)
        at += long
    return found


def _body(name: str, clock: Array, random: Generator) -> Array:
    """The warmth of a body, about one where it runs all the time."""
    return _lagged(_blocks(clock, random), clock, _between(BODIES[name], random))


def _read(name: str, bodies: Mapping[str, Array], air: Array, clock: Array, random: Generator) -> Array:
    """What a sensor says of its body."""
    body, warm = SENSORS[name]
    other = warm * bodies[random.choice(list(bodies))] if random.random() < 0.5 else air
    share = random.uniform(0, ELSEWHERE)
    seen = _lagged((1 - share) * warm * bodies[body] + share * other, clock, _between(LATE, random))
    return seen * random.uniform(0.7, 1.3) + READ_K * random.normal(size=len(clock))


def _lagged(values: Array, clock: Array, constant: float) -> Array:
    """First-order lag, at rest at the start."""
    share, found = 1 - np.exp(-STEP / constant), np.empty_like(values)
    found[0] = values[0] if constant < STEP else share * values[0]
    for k in range(1, len(values)):
        found[k] = found[k - 1] + share * (values[k] - found[k - 1])
    return found
