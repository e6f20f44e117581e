"""The noise in which an effect must show: of the instrument, and a little of everything that machines do.

A real machine has many small effects at once, and an instrument wanders. So the residual is taken as base columns, plus
noise, plus noise that lasts for some minutes, plus a little of every candidate together. In the coordinates `rotation`
(orthogonal to the base, error contrasts of restricted likelihood; then principal axes of "everything") the covariance
is diagonal for every share of that background: sigma^2 (1 + share^2 `spectrum`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

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
NONE = 1e-9
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
    everything  (m, p) columns of a little of everything, in units of each value's noise
    slow      (m, m) correlation of the wandering in the same units
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

    def covariance(self, share: float) -> Array:
        """Covariance of all values with this share of everything, um^2, (m, m)."""
        inner = np.eye(len(self.relative)) + share**2 * (self.everything @ self.everything.T)
        if self.slow is not None:
            inner = inner + self.wander**2 * self.slow
        return self.sigma**2 * self.relative[:, None] * inner * self.relative

    def seen(self, columns: Array) -> Array:
        """Columns (m, p) or values (m,) um in the coordinates, in units of `sigma`."""
        scaled: Array = self.rotation.T @ columns / self.sigma
        return scaled

    def variance(self, share: float) -> Array:
        """Variance along the coordinates in units of sigma^2, (n,)."""
        return 1.0 + share**2 * self.spectrum


def background(view: View, groups: Sequence[Group], relative: Array, wanders: bool = True) -> Background:
    """Estimate how much the instrument wanders and find the coordinates."""
    sigma, freedom = _noise(view)
    left = _contrasts(view.base / relative[:, None])
    everything = _everything(view, groups, relative)
    y = left.T @ (view.y / relative) / sigma
    inner = left.T @ everything
    inner = inner @ inner.T
    slow, wander, chosen = (_wandering(view, relative) if wanders else None), 0.0, np.eye(left.shape[1])
    if slow is not None:
        seen = left.T @ slow @ left
        wander = max(WANDER, key=lambda size: _likelihood(y, chosen + size**2 * seen + _some(inner), freedom))
    if wander and slow is not None:
        factor = np.linalg.cholesky(chosen + wander**2 * seen)
        left = np.linalg.solve(factor, left.T).T
        inner = left.T @ everything
        inner = inner @ inner.T
    spectrum, vectors = np.linalg.eigh(inner)
    rotation = (left @ vectors) / relative[:, None]
    return Background(view, relative, rotation, np.maximum(spectrum, 0.0), sigma, freedom, wander, everything, slow)


def _some(inner: Array) -> Array:
    return 0.35**2 * inner


def _noise(view: View) -> tuple[float, float]:
    """Noise of a plain value, um, and how well it is known."""
    given = all(each.noise[0] is not None for each in view.measurements)
    return view.sigma, KNOWN if given else WEAK


def _contrasts(base: Array) -> Array:
    """An orthonormal basis of what is orthogonal to the base, (m, n)."""
    size = np.linalg.norm(base, axis=0)
    scaled = base[:, size > 0] / size[size > 0]
    basis = orthonormal(scaled)
    contrasts: Array = np.linalg.qr(basis, mode="complete")[0][:, basis.shape[1] :]
    return contrasts


def _everything(view: View, named: Sequence[Group], relative: Array) -> Array:
    """A little of every candidate: columns whose sum of squares is that of 1 um, each name with the same share.

    But nothing of the constants that the machine file lacks: those are looked for, not taken for granted.
    """
    groups = [group for group in named if not group.owner.constant]
    forms = Counter(group.owner.name for group in groups)
    parts = [group.columns / np.sqrt(forms[group.owner.name] * len(forms)) for group in groups]
    return apart(view, np.concatenate([np.zeros((len(relative), 0)), *parts], axis=1), named) / relative[:, None]


def _wandering(view: View, relative: Array) -> Array | None:
    """The correlation of values of one component by the time between them; None without a clock."""
    time = view.column("time_s")
    if np.ptp(time) == 0:
        return None
    own = time[np.maximum(view.row, 0)]
    alike = (view.component[:, None] == view.component) & (view.row[:, None] >= 0)
    lasting = np.where(alike, np.exp(-np.abs(own[:, None] - own) / LASTING), 0.0)
    slow: Array = lasting / relative[:, None] / relative
    return slow


def _likelihood(y: Array, covariance: Array, freedom: float) -> float:
    """Log likelihood with the scale integrated out."""
    factor = np.linalg.cholesky(covariance)
    white = np.linalg.solve(factor, y)
    return marginal(float(white @ white), 2 * float(np.log(np.diag(factor)).sum()), len(y), freedom)


def marginal(squares: float, log_determinant: float, count: int, freedom: float) -> float:
    """Log likelihood of `count` values, sum of squares in units of a variance known with `freedom`."""
    return -0.5 * log_determinant - 0.5 * (count + freedom) * float(np.log((squares + freedom) / (count + freedom)))
