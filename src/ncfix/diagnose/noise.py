"""How large the noise is, from what, and whether anything is left beyond it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, fdtrc

from ncfix.diagnose.background import Background
from ncfix.diagnose.view import View
from ncfix.measure.measurement import Array, groups

TAILS = 2.0
"""Variance of a standard deviation from repeats, times their freedom, over its square: Student's t with 5 degrees."""
TRUSTED = 0.1
"""How far a noise that was given may be off."""
USUAL_UM = 1.0
"""rms of the little of everything that all machines have."""
ASTRAY = 5.0
"""Standard deviations beyond which a repeat is not noise."""
ENOUGH = 10
"""Degrees of freedom of repeats from which on they say something."""


@dataclass(frozen=True)
class Floor:
    """The noise floor.

    sigma_um  standard deviation of one value
    source    repeats, given, or neighbours (what smooth effects leave)
    freedom   degrees of freedom
    squares   sum of squares of the repeats about their means, um^2
    """

    sigma_um: float
    source: str
    freedom: int
    squares: float = 0.0


def floor(view: View, ground: Background, sigma_um: float, keep: NDArray[np.bool_]) -> Floor:
    """From repeats if there are enough, else as given, else as estimated from neighbouring poses."""
    squares, freedom = repeats(view, keep)
    if freedom >= ENOUGH:
        return Floor(float(np.sqrt(squares / freedom)), "repeats", freedom, squares)
    if all(each.noise[0] is not None for each in view.measurements):
        return Floor(ground.sigma, "given", 0)
    return Floor(sigma_um, "neighbours", 0)


def beyond(floor: Floor, noise_um: float, left_um: float) -> float:
    """What is left beyond the noise and what machines have of everything, um rms.

    Noise that comes from repeats with long tails is known to two standard deviations only, a given one to a tenth.
    """
    doubt = 2 * np.sqrt(TAILS / floor.freedom) if floor.freedom else TRUSTED
    return float(np.sqrt(max(left_um**2 - (noise_um * (1 + doubt)) ** 2 - USUAL_UM**2, 0.0)))


def repeats(view: View, keep: NDArray[np.bool_]) -> tuple[float, int]:
    """Sum of squares about the means of values taken at one commanded state one after another, and its freedom."""
    same = states(view)
    keys = [
        f"{same[row]} {name}" for row, name, kept in zip(view.row, view.names, keep, strict=True) if row >= 0 and kept
    ]
    values = view.y[(view.row >= 0) & keep]
    if not keys:
        return 0.0, 0
    _, index = groups(keys)
    counts = np.bincount(index)
    apart = (values - np.bincount(index, values)[index] / counts[index]) * np.sqrt(counts / np.maximum(counts - 1, 1))[
        index
    ]
    several = counts[index] > 1
    if not several.any():
        return 0.0, 0
    usual = 1.4826 * float(np.median(np.abs(apart[several])))
    kept = several & (np.abs(apart) <= ASTRAY * usual)
    counts = np.bincount(index[kept], minlength=len(counts))
    mean = np.bincount(index[kept], values[kept], minlength=len(counts)) / np.maximum(counts, 1)
    return float(((values - mean[index])[kept] ** 2).sum()), int(np.maximum(counts - 1, 0).sum())


def states(view: View) -> list[int]:
    """Number of the commanded state of each row; rows of one state follow one another."""
    seen: list[int] = []
    number, before = -1, None
    for each in view.measurements:
        names = [name for name in each.columns if name not in each.measured and not varying(name)]
        labels = [value for name, value in each.labels.items() if name != "repeat"]
        for i in range(len(each)):
            key = (each.path, *(label[i] for label in labels), *(round(float(each.columns[n][i]), 4) for n in names))
            number += key != before
            before = key
            seen.append(number)
    return seen


def lack_of_fit(floor: Floor, residual: Array, parameters: float) -> float | None:
    """How likely residuals so much larger than the noise are by chance; None without repeats or a given noise."""
    n = len(residual)
    squares = float((residual**2).sum())
    if floor.source == "repeats":
        left = n - parameters - floor.freedom
        ratio = ((squares - floor.squares) / left) / (floor.squares / floor.freedom)
        return float(fdtrc(left, floor.freedom, ratio)) if left > 0 else None
    if floor.source == "given":
        return float(chdtrc(max(n - parameters, 1), squares / floor.sigma_um**2))
    return None


def varying(name: str) -> bool:
    """Whether a column may change between repeats."""
    return name.startswith("temp_") or name in ("time_s", "run")
