"""Points spread evenly over a cube: Halton's sequence with the digits of every place shuffled (Owen 2017).

The n-th point has, along each side, the digits of n to a prime base, mirrored behind the point; shuffling the digits of
each place takes away the stripes that the larger primes have.
"""

from __future__ import annotations

import numpy as np

from ncfix.measure.measurement import Array

FINEST = 2.0**-54
"""Digits count down to this: below it a number next to one cannot be told from one."""


def halton(count: int, sides: int, random: np.random.Generator) -> Array:
    """So many points of the unit cube, (count, sides). `random` itself is drawn no number from."""
    own = random.spawn(1)[0]
    return np.stack([_mirrored(count, base, own) for base in _primes(sides)], axis=-1)


def _mirrored(count: int, base: int, random: np.random.Generator) -> Array:
    """The numbers 0 ... count - 1 as digits of this base behind the point, (count,)."""
    rest, place, found = np.arange(count), 1.0 / base, np.zeros(count)
    for digits in np.tile(np.arange(base), (_digits(base), 1)):
        random.shuffle(digits)
        found += digits[rest % base] * place
        rest, place = rest // base, place / base
    return found


def _digits(base: int) -> int:
    """How many places there are until one of them no longer counts."""
    return int(np.ceil(-np.log2(FINEST) / np.log2(base))) - 1


def _primes(count: int) -> list[int]:
    found: list[int] = []
    number = 2
    while len(found) < count:
        if all(number % each for each in found):
            found.append(number)
        number += 1
    return found
