"""What these data would have shown: how large an effect has to be so that it is found. Silence means no more than that.

The numbers behind an effect of size s have variance s^2. With d the squares that each of its independent parts shows at
a size of one, over the variance of noise and background, its log odds are 1/2 sum(s^2 d - ln(1 + s^2 d)) on average.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ncfix.diagnose.evidence import SIZES, Court
from ncfix.diagnose.weighing import Scale, margin
from ncfix.measure.measurement import Array

HARDLY = 0.5
"""Share of all names that data must be able to show at the largest size, to show more than hardly anything."""


def findable(scale: Scale) -> dict[str, float]:
    """The smallest of the sizes, um rms, at which an effect of each name would be found; inf where it is at none."""
    share = scale.court.share([])
    return {name: _smallest(scale.court, name, share, scale.price(name) + margin(1)) for name in scale.names}


def _smallest(court: Court, name: str, share: float, needed: float) -> float:
    """Of the form that shows best."""
    strengths = [court.strength(group, share) for group in court.forms[name]]
    enough = (size for size in SIZES if max(mean_odds(size**2 * each) for each in strengths) >= needed)
    return next(enough, float("inf"))


def mean_odds(shown: Array) -> float:
    """The log odds that an effect has on average, by the variances (k,) that it shows over those of noise: s^2 d."""
    return 0.5 * float((shown - np.log1p(shown)).sum())


def blind(sizes: Mapping[str, float], count: int) -> bool:
    """Whether the data can show hardly any of so many effects."""
    return sum(size <= SIZES[-1] for size in sizes.values()) < HARDLY * count


def said(sizes: Mapping[str, float], count: int) -> str:
    """How many of so many names would have been found, at which size."""
    found = [(size, sum(own <= size for own in sizes.values())) for size in SIZES]
    steps = [(size, number) for k, (size, number) in enumerate(found) if number > (found[k - 1][1] if k else 0)]
    if not steps:
        return f"none of {count} effects would have been found, were it {SIZES[-1]:g} um rms"
    first, *others = [f"from {size:g} um rms on {number}" for size, number in steps]
    return f"what would have been found: {', '.join([f'{first} of {count} effects', *others])}"
