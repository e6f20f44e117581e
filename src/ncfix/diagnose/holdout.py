"""Does it predict what was not used to find it? Whole regions of the poses are left out, one quarter at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.diagnose.addition import WIDE
from ncfix.diagnose.background import Background
from ncfix.diagnose.evidence import Court, Member
from ncfix.diagnose.fields import scaled
from ncfix.diagnose.outliers import ASIDE
from ncfix.measure.measurement import Array, Index

CELLS = 16
FOLDS = 4
BLIND = 1e2
"""Times the noise: a value predicted no better than this has a set-up that nothing else shares; it does not count."""


@dataclass(frozen=True)
class HeldOut:
    """Prediction errors of all values while they were held out, um, (m,); NaN where none was possible."""

    without: Array
    with_all: Array
    less: tuple[Array, ...]
    cell: Index


def held_out(court: Court, members: Sequence[Member], share: float) -> HeldOut:
    """Predict each region from the others: without members, with all, and with all but each one."""
    ground = court.background
    view = ground.view
    cell = cells(scaled(view))[np.maximum(view.row, 0)]
    base = WIDE * view.base / np.where((s := np.sqrt((view.base**2).mean(axis=0))) > 0, s, 1.0)
    shown = [court.groups[m.group].columns * m.size for m in members]
    models = [[], shown, *([*shown[:out], *shown[out + 1 :]] for out in range(len(shown)))]
    tests = [(cell % FOLDS == fold) & (view.row >= 0) for fold in range(FOLDS)]
    errors = [_predicted(ground, np.concatenate([base, *model], axis=1), share, tests) for model in models]
    return HeldOut(errors[0], errors[1], tuple(errors[2:]), cell)


def _predicted(ground: Background, signal: Array, share: float, tests: Sequence[NDArray[np.bool_]]) -> Array:
    """Errors of the predictions of each fold from the others, for a signal whose columns are there at unit size.

    With Q the inverse of the covariance of all values, the block of Q of a fold says what the others tell of it: with
    the fold's values so replaced, Q y are the weights of the others, and the signal alone is carried over to the fold.
    """
    precision, y = ground.precision(share), ground.view.y
    weighed = precision @ signal
    inner = np.eye(signal.shape[1]) + signal.T @ weighed
    inverse = precision - weighed @ np.linalg.solve(inner, weighed.T)
    solved, error = inverse @ y, np.full(len(y), np.nan)
    for test in tests:
        if test.any() and not test.all():
            spread = np.linalg.inv(inverse[np.ix_(test, test)])
            missed = np.where(test, 0.0, y)
            missed[test] = y[test] - spread @ solved[test]
            others = np.where(test, 0.0, inverse @ missed)
            told = np.diag(spread) < (BLIND * ground.sigma * ground.relative[test]) ** 2
            error[test] = np.where(told, y[test] - signal[test] @ (signal.T @ others), np.nan)
    error[ground.relative > 0.1 * ASIDE] = np.nan
    return error


def cells(u: Array, count: int = CELLS) -> Index:
    """Regions (n,) of poses u (n, k), with equally many rows: halved at the median of the widest way over and over."""
    label = np.zeros(len(u), dtype=np.int64)
    for _ in range(int(np.log2(count))):
        new = np.empty_like(label)
        for each in np.unique(label):
            rows = np.flatnonzero(label == each)
            wide = int(np.ptp(u[rows], axis=0).argmax())
            order = np.argsort(u[rows, wide], kind="stable")
            upper = np.zeros(len(rows), dtype=np.int64)
            upper[order[len(rows) // 2 :]] = 1
            new[rows] = 2 * each + upper
        label = new
    # neighbours go to different folds
    return np.random.default_rng(0).permutation(count)[label] if count else label


def gain(held: HeldOut, worse: Array) -> tuple[float, float]:
    """How much larger the squares are with another model, per region, and the standard error of that."""
    known = np.isfinite(held.with_all) & np.isfinite(worse)
    per = [
        float((worse[k] ** 2 - held.with_all[k] ** 2).sum())
        for c in np.unique(held.cell)
        if (k := known & (held.cell == c)).any()
    ]
    return float(np.mean(per)), float(np.std(per) / np.sqrt(max(len(per) - 1, 1)))
