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
from scipy.linalg import lapack, qr

from ncfix.diagnose.groups import Group, apart
from ncfix.diagnose.view import View
from ncfix.measure.measurement import Array
from ncfix.measure.solve import orthonormal

SHARES = (0.05, 0.2, 0.4, 0.8, 2.5)
"""Size of everything else together, against the noise of one value."""
PRIOR = (0.3, 0.3, 0.25, 0.12, 0.03)
"""How likely these are beforehand."""
BLOCK = 64
"""Reflections that are carried out together."""


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
    """A covariance (m, m) in units of each value's noise; `relative` (m,)."""
    scaled: Array = covariance / relative[:, None] / relative
    return scaled


@dataclass(frozen=True, repr=False)
class Contrasts:
    """An orthonormal basis of what is orthogonal to the base: `columns` (m, n), and as the reflections that make it."""

    columns: Array
    reflections: tuple[Array, Array]

    def seen(self, values: Array) -> Array:
        """Columns of values (m, p) as contrasts, (n, p); far quicker by a few reflections."""
        columns = np.asfortranarray(values)
        turned = lapack.dormqr("L", "T", *self.reflections, columns, BLOCK * columns.shape[1])[0]
        last: Array = turned[len(values) - self.columns.shape[1] :]
        return last

    def of(self, covariance: Array) -> Array:
        """The covariance (m, m) of values as one of contrasts, (n, n)."""
        return self.seen(self.seen(covariance).T)


def contrasts(base: Array) -> Contrasts:
    """Those of what is free."""
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


def marginal(squares: float, log_determinant: float, count: int, freedom: float) -> float:
    """Log likelihood of `count` values, sum of squares in units of a variance known with `freedom`."""
    return -0.5 * log_determinant - 0.5 * (count + freedom) * float(np.log((squares + freedom) / (count + freedom)))
