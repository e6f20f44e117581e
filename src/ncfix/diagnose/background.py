"""The noise in which an effect must show: of the instrument, and a little of everything that machines do.

A real machine has many small effects at once, and an instrument wanders. So the residual is taken as base columns, plus
noise, plus noise that lasts for some minutes, plus a little of every candidate together. In the coordinates `rotation`
(orthogonal to the base, error contrasts of restricted likelihood; then principal axes of "everything") the covariance
is diagonal for every share of that background: sigma^2 (1 + share^2 `spectrum`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import eigh, lapack, qr, solve_triangular

from ncfix.diagnose.groups import Group, apart
from ncfix.diagnose.view import View
from ncfix.measure.measurement import Array
from ncfix.measure.solve import orthonormal

LASTING = 900.0
"""s: how long an instrument's wandering lasts."""
WANDER = (0.0, 0.15, 0.35, 0.7)
"""Its size against the noise."""
SHARES = (0.05, 0.2, 0.4, 0.8, 2.5)
"""Size of everything else together, against the noise of one value."""
PRIOR = (0.3, 0.3, 0.25, 0.12, 0.03)
"""How likely these are beforehand."""
SOME = 0.35
"""The same while it is asked how much the instrument wanders."""
BLOCK = 64
"""Reflections that are carried out together."""
WEAK = 1.0
"""Degrees of freedom of what is known of the noise where nothing is."""
KNOWN = 200.0
"""The same where the header of a file states it."""


@dataclass(frozen=True, repr=False)
class Background:
    """The coordinates and the likelihoods in them.

    view      the data
    relative  (m,) standard deviation of each value against that of a plain one, outliers very large
    rotation  (m, n) to the n coordinates; its columns are in units of the noise
    spectrum  (n,) variance of everything at a size of one noise, along the coordinates
    sigma     um, standard deviation of one plain value before anything was looked at
    freedom   degrees of freedom of that; the data have n of their own
    wander    size of the instrument's wandering against the noise
    everything  (m, m) covariance of a little of everything at 1 um, um^2
    slow      (m, m) correlation of the wandering, in units of each value's noise
    """

    view: View
    relative: Array
    rotation: Array
    spectrum: Array
    sigma: float
    freedom: float
    wander: float
    everything: Array
    slow: Array | None
    precisions: dict[float, Array] = field(default_factory=dict)

    def precision(self, share: float) -> Array:
        """The inverse of the covariance of all values with this share of everything, um^-2, (m, m); computed once."""
        if share not in self.precisions:
            inner = np.eye(len(self.relative)) + share**2 * in_noise(self.everything, self.relative)
            if self.slow is not None:
                inner = inner + self.wander**2 * self.slow
            scale = self.sigma * self.relative
            self.precisions[share] = np.linalg.inv(inner) / scale[:, None] / scale
        return self.precisions[share]

    def seen(self, columns: Array) -> Array:
        """Columns (m, p) or values (m,) um in the coordinates, in units of `sigma`."""
        scaled: Array = self.rotation.T @ columns / self.sigma
        return scaled

    def variance(self, share: float) -> Array:
        """Variance along the coordinates in units of sigma^2, (n,)."""
        return 1.0 + share**2 * self.spectrum


def in_noise(covariance: Array, relative: Array) -> Array:
    """A covariance in units of each value's noise."""
    scaled: Array = covariance / relative[:, None] / relative
    return scaled


def background(view: View, everything: Array, relative: Array) -> Background:
    """Estimate how much the instrument wanders and find the coordinates."""
    sigma, freedom = _noise(view)
    contrasts = _contrasts(view.base / relative[:, None])
    left = contrasts.columns
    slow, wander = _wandering(view, relative), 0.0
    little = in_noise(everything, relative)
    inner = contrasts.of(little)
    if slow is not None:
        seen, own = contrasts.of(slow), np.eye(left.shape[1]) + SOME**2 * inner
        y = left.T @ (view.y / relative) / sigma
        wander = max(WANDER, key=lambda size: _likelihood(y, own + size**2 * seen, freedom))
    if wander and slow is not None:
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


@dataclass(frozen=True, repr=False)
class Contrasts:
    """An orthonormal basis of what is orthogonal to the base: `columns` (m, n), and as the reflections that make it."""

    columns: Array
    reflections: tuple[Array, Array]

    def of(self, covariance: Array) -> Array:
        """The covariance (m, m) of values as one of contrasts, (n, n); far quicker by a few reflections."""
        once = self._reflected(np.asfortranarray(covariance))
        last = len(covariance) - self.columns.shape[1]
        turned: Array = self._reflected(np.asfortranarray(once.T))[last:, last:]
        return turned

    def _reflected(self, columns: Array) -> Array:
        turned: Array = lapack.dormqr("L", "T", *self.reflections, columns, BLOCK * len(columns))[0]
        return turned


def _contrasts(base: Array) -> Contrasts:
    size = np.linalg.norm(base, axis=0)
    scaled = base[:, size > 0] / size[size > 0]
    basis = orthonormal(scaled)
    reflections, _ = qr(basis, mode="raw", check_finite=False)
    whole = lapack.dormqr("L", "N", *reflections, np.eye(len(basis), order="F"), BLOCK * len(basis))[0]
    return Contrasts(whole[:, basis.shape[1] :], reflections)


def everything_of(view: View, named: Sequence[Group]) -> Array:
    """The covariance of a little of every candidate, of 1 um together, each name with the same share, um^2, (m, m).

    But nothing of the constants that the machine file lacks: those are looked for, not taken for granted.
    """
    groups = [group for group in named if not group.owner.constant]
    forms = Counter(group.owner.name for group in groups)
    parts = [group.columns / np.sqrt(forms[group.owner.name] * len(forms)) for group in groups]
    columns = apart(view, np.concatenate([np.zeros((len(view.y), 0)), *parts], axis=1), named)
    covariance: Array = columns @ columns.T
    return covariance


def _wandering(view: View, relative: Array) -> Array | None:
    """The correlation of values of one component by the time between them; None without a clock."""
    time = view.column("time_s")
    if np.ptp(time) == 0:
        return None
    own = time[np.maximum(view.row, 0)]
    alike = (view.component[:, None] == view.component) & (view.row[:, None] >= 0)
    lasting = np.where(alike, np.exp(-np.abs(own[:, None] - own) / LASTING), 0.0)
    return in_noise(lasting, relative)


def _likelihood(y: Array, covariance: Array, freedom: float) -> float:
    """Log likelihood with the scale integrated out."""
    factor = np.linalg.cholesky(covariance)
    white = solve_triangular(factor, y, lower=True)
    return marginal(float(white @ white), 2 * float(np.log(np.diag(factor)).sum()), len(y), freedom)


def marginal(squares: float, log_determinant: float, count: int, freedom: float) -> float:
    """Log likelihood of `count` values, sum of squares in units of a variance known with `freedom`."""
    return -0.5 * log_determinant - 0.5 * (count + freedom) * float(np.log((squares + freedom) / (count + freedom)))
