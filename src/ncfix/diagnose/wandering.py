"""How much the instrument wanders, and the background that goes with that.

A drift of hours looks like an instrument that wanders, as long as nothing else may explain it, and a wandering of that
size then hides the drift. So each size of the wandering is weighed together with the names that act in the course of
time and nothing else: the likeliest one after another, at the price of a name, as long as they pay. The course of a
real effect is never quite what the catalogue says (`MISSHAPEN`), and what a name misses of it wanders, too.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, eigh, solve_triangular

from ncfix.diagnose.background import Background, Contrasts, contrasts, in_noise, marginal
from ncfix.diagnose.evidence import SIZES, log_odds
from ncfix.diagnose.groups import Group
from ncfix.diagnose.view import View
from ncfix.diagnose.weighing import MISSHAPEN, margin
from ncfix.measure.measurement import Array

LASTING = 900.0
"""s: how long an instrument's wandering lasts."""
WANDER = (0.0, 0.15, 0.35, 0.7)
"""Its size against the noise."""
SOME = 0.35
"""Size of everything else together, against the noise, while it is asked how much the instrument wanders."""
MOST = 4
"""Names that are added at most."""
WEAK = 1.0
"""Degrees of freedom of what is known of the noise where nothing is."""
KNOWN = 200.0
"""The same where the header of a file states it."""


def background(view: View, everything: Array, relative: Array, named: Sequence[Group] = ()) -> Background:
    """Estimate how much the instrument wanders, where these names may act besides, and find the coordinates."""
    sigma, freedom = _noise(view)
    free = contrasts(view.base / relative[:, None])
    left = free.columns
    slow, wander = _wandering(view, relative), 0.0
    inner = free.of(in_noise(everything, relative))
    if slow is not None:
        seen = free.of(slow)
        wander = _likeliest(Question(free, sigma * relative, view.y, inner, seen, freedom), named)
    if wander:
        factor = np.linalg.cholesky(np.eye(left.shape[1]) + wander**2 * seen)
        left = solve_triangular(factor, left.T, lower=True).T
        inner = solve_triangular(factor, solve_triangular(factor, inner, lower=True).T, lower=True)
    spectrum, vectors = eigh(inner, driver="evd")
    rotation = (left @ vectors) / relative[:, None]
    return Background(view, relative, rotation, np.maximum(spectrum, 0.0), sigma, freedom, wander, everything, slow)


def _noise(view: View) -> tuple[float, float]:
    """Noise of a plain value, um, and how well it is known."""
    given = all(each.noise[0] is not None for each in view.measurements)
    return view.sigma, KNOWN if given else WEAK


def _wandering(view: View, relative: Array) -> Array | None:
    """The correlation of values of one component by the time between them; None without a clock."""
    time = view.column("time_s")
    if np.ptp(time) == 0:
        return None
    own = time[np.maximum(view.row, 0)]
    alike = (view.component[:, None] == view.component) & (view.row[:, None] >= 0)
    lasting = np.where(alike, np.exp(-np.abs(own[:, None] - own) / LASTING), 0.0)
    return in_noise(lasting, relative)


@dataclass(frozen=True, repr=False)
class Question:
    """How much does it wander?

    free        contrasts, n of m values
    scale       (m,) standard deviations of the values, um
    y           (m,) the values, um
    everything  (n, n) covariance of a little of everything at 1 um; slow: of the wandering at the size of the noise
    freedom     of what is known of the noise
    """

    free: Contrasts
    scale: Array
    y: Array
    everything: Array
    slow: Array
    freedom: float

    def likelihood(self, size: float) -> float:
        """Log likelihood of the data with a wandering of this size, that of the noise integrated out."""
        factor = self._factor(size)
        white = solve_triangular(factor, self._seen([self.y])[:, 0], lower=True, check_finite=False)
        determinant = 2 * float(np.log(np.diag(factor)).sum())
        return marginal(float(white @ white), determinant, len(white), self.freedom)

    def white(self, size: float, columns: Sequence[Array]) -> Array:
        """Columns of values, one beside the other, where noise, everything and such a wandering are one, (n, p)."""
        white: Array = solve_triangular(self._factor(size), self._seen(columns), lower=True, check_finite=False)
        return white

    def _seen(self, columns: Sequence[Array]) -> Array:
        return self.free.seen(np.column_stack(columns) / self.scale[:, None])

    def _factor(self, size: float) -> Array:
        covariance = np.eye(len(self.slow)) + SOME**2 * self.everything + size**2 * self.slow
        factor: Array = cholesky(covariance, lower=True, overwrite_a=True, check_finite=False)
        return factor


def _likeliest(asked: Question, named: Sequence[Group]) -> float:
    """The size that explains most; with names no more of it than without, and no less than what their courses miss."""
    plain = [asked.likelihood(size) for size in WANDER]
    most = int(np.argmax(plain)) + 1
    beside = [_beside_names(asked, size, named) for size in WANDER[:most] if most > 1] or [(0.0, 0.0)]
    best = int(np.argmax([own + gained for own, (gained, _) in zip(plain, beside, strict=False)]))
    missed = MISSHAPEN * beside[best][1] / float(np.median(asked.scale))
    return max(size for size in WANDER[:most] if size <= max(WANDER[best], missed))


def _beside_names(asked: Question, size: float, named: Sequence[Group]) -> tuple[float, float]:
    """How much log likelihood names that act by time alone add to a wandering of this size, less what they pay; and
    how much the largest shows, um rms.
    """
    courses = [group for group in named if group.owner.slow]
    forms = Counter(group.owner.name for group in named)
    prices = np.log([len(forms) * forms[group.owner.name] * len(SIZES) for group in courses])
    ends = np.cumsum([1, *(group.columns.shape[1] for group in courses)])
    white, gained, shown = asked.white(size, [asked.y, *(group.columns for group in courses)]), 0.0, 0.0
    for count in range(1, MOST + 1 if courses else 1):
        odds = _odds(white, ends, asked.freedom) - prices[:, None]
        best, large = np.unravel_index(int(odds.argmax()), odds.shape)
        helped = float(odds[best, large]) - margin(count) + margin(count - 1)
        if helped <= 0:
            break
        gained, shown = gained + helped, max(shown, SIZES[large])
        white = _beside(white, SIZES[large] * white[:, ends[best] : ends[best + 1]])
    return gained, shown


def _odds(white: Array, ends: Array, freedom: float) -> Array:
    """The log odds of every form in every size, (forms, sizes); data and columns are white, (n, 1 + p)."""
    y, widths = white[:, 0], np.diff(ends)
    found = np.empty((len(widths), len(SIZES)))
    total, count = float(y @ y) + freedom, len(y) + freedom
    for width in np.unique(widths):
        alike = np.flatnonzero(widths == width)
        stack = np.stack([white[:, ends[k] : ends[k + 1]] for k in alike])
        turned = np.swapaxes(stack, 1, 2)
        found[alike] = log_odds(turned @ stack, turned @ y, total, count)
    return found


def _beside(white: Array, there: Array) -> Array:
    """The same, white where these columns are there at unit size besides."""
    own, sizes, _ = np.linalg.svd(there, full_matrices=False)
    less: Array = white - own @ ((1 - 1 / np.sqrt(1 + sizes**2))[:, None] * (own.T @ white))
    return less
