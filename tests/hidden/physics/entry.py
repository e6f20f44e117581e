"""One effect of the benchmark's own catalogue: its name, and how to draw a new specimen of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from ..chain import COMPONENTS
from ..motion import Array
from ..situation import Situation

Signal = Callable[[Situation], Array]
Field = Callable[[Situation], Array]


@dataclass(frozen=True, slots=True)
class Entry:
    """A named effect. `row` is its row in the catalogue of the design; `symbols` its ISO 230-1 components.

    `kind` and `axis` are how a reported name is recognised (names.py); `family` is what counts as next of kin;
    `draw(rng)` gives a specimen: the small motions (n, n_frames, 6) of all frames in a situation, in arbitrary size.
    `one_way`: nature knows its sign (what is warm grows, what hangs goes down), and `draw` has it.
    """

    name: str
    row: int
    kind: str
    axis: str
    symbols: tuple[str, ...]
    family: str
    draw: Callable[[Generator], Field]
    one_way: bool = False

    def specimen(self, rng: Generator) -> Field:
        """A draw with either sign, where nature has no preference."""
        motion = self.draw(rng)
        if self.one_way or rng.random() < 0.5:
            return motion
        return lambda s: -motion(s)


def field(parts: dict[tuple[str, str], Signal]) -> Field:
    """Motions from signals: {(frame, component letter): signal}; EYX is ("X", "Y")."""

    def twists(s: Situation) -> Array:
        result = np.zeros((len(s), len(s.machine.frames), 6))
        for (frame, component), signal in parts.items():
            result[:, s.machine.frames.index(frame), COMPONENTS.index(component)] += signal(s)
        return result

    return twists


def symbol(component: str, frame: str) -> str:
    """ISO 230-1 name of an error motion: EYX."""
    return f"E{component}{frame}"


def spread(rng: Generator, low: float, high: float) -> float:
    """A size between low and high with either sign."""
    return float(rng.choice((-1, 1)) * rng.uniform(low, high))
