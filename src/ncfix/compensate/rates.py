"""Limits on how fast a rotary correction may change along the path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate.findings import Array, Index, Mask

APART = 1.0
"""rad of allowance between stretches that have nothing to do with each other; above any rotary correction."""


@dataclass(frozen=True, slots=True)
class Path:
    """How poses follow each other, for limits on rates.

    travel_mm   (n,) way of the tool tip in the workpiece from the pose before, mm
    travel_rad  (n,) way of the rotary axes from the pose before, rad
    begins      (n,) the pose begins a new stretch: what was before puts no limit on it
    pinned      (n,) the correction of this pose is decided already and stands in `decided`
    decided     (n, n_rotary) rad; read where pinned
    """

    travel_mm: Array
    travel_rad: Array
    begins: Mask
    pinned: Mask
    decided: Array

    def rows(self, rows: Index) -> Path:
        """Some of the poses; where poses are left out a new stretch begins."""
        begins = self.begins[rows].copy()
        begins[1:] |= np.diff(rows) != 1
        return Path(self.travel_mm[rows], self.travel_rad[rows], begins, self.pinned[rows], self.decided[rows])

    def allowance(self, per_mm: float, per_rad: float) -> Array:
        """By how much a correction may have changed since the first pose, (n,) rad, never descending."""
        step = per_mm * self.travel_mm + per_rad * self.travel_rad
        return np.cumsum(np.where(self.begins, APART, step))


def limited(correction: Array, path: Path, per_mm: float, per_rad: float) -> Array:
    """Rotary corrections (n, k) that change no faster along the path than allowed, near the given ones.

    The mean of the largest function below and the smallest above the given values that keep the rate (McShane's
    extensions): where the given values keep it, they come out as they are. Decided values are met exactly if they keep
    the rate among themselves.
    """
    travel = path.allowance(per_mm, per_rad)[:, None]
    smooth = (_lowest(correction, travel) - _lowest(-correction, travel)) / 2
    pinned = path.pinned[:, None]
    top = _lowest(np.where(pinned, path.decided, np.inf), travel)
    bottom = -_lowest(np.where(pinned, -path.decided, np.inf), travel)
    return np.where(pinned, path.decided, np.clip(smooth, np.minimum(bottom, top), top))


def _lowest(values: Array, travel: Array) -> Array:
    """The minimum over all j of values[j] + |travel - travel[j]|."""
    before = np.minimum.accumulate(values - travel) + travel
    after = np.minimum.accumulate((values + travel)[::-1])[::-1] - travel
    return np.minimum(before, after)
