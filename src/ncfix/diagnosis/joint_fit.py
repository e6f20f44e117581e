"""The joint fit of all constants and named effects, the machine file with the result, and its cross-validation.

Cross-validation leaves out whole regions of the poses, a quarter of the regions at a time. A name is kept only if it
improves the prediction of held-out poses and is large enough to matter (`passing`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ncfix.arrays import Array, Ints, Mask
from ncfix.diagnosis.effect_form import EffectForm
from ncfix.diagnosis.evidence import Background, Comparison, Evidence, Member
from ncfix.diagnosis.forms import scaled_axes
from ncfix.diagnosis.noise import ASIDE
from ncfix.diagnosis.residual_data import ResidualData
from ncfix.diagnosis.selection import Selected, with_alternatives
from ncfix.machine import Effect, Machine
from ncfix.machine.basis import Basis, Fourier, Polynomial
from ncfix.measure.least_squares import orthonormal, without
from ncfix.values import frozen

WIDE = 1e3
"""Prior standard deviation of a constant, um at the tool tip: hardly a prior, but unseen constants stay unchanged."""
TRACE = 1e-12
"""Share of a loading below which a coefficient counts as unused."""
REGIONS = 16
FOLDS = 4
BLIND = 1e2
"""A held-out value whose prediction is less certain than this many times the noise is ignored: its set-up is not
determined by the other values."""
SHARP = 6.0
"""An effect of the drives, which acts at a few places only, counts with its rms or its largest value over this."""
MATERIAL_UM = 0.8
"""An effect that moves the tool tip by less than this, um rms, is not worth a name."""
RATHER = 0.5
"""An effect smaller than this share of the unnamed remainder may as well be part of that."""


@frozen(slots=False)
class JointFit:
    """Result of fitting constants and members together.

    constants   (k,) changes of the free constants, mm or rad, from `ResidualData.coefficients`
    sigmas      (k,) their standard deviations
    numbers     for each member (p,) its independent numbers (before the loading); covariances: (p, p) of them
    shown       for each member (m,) its effect on the values, um
    before      (m,) residual with the constants alone, um; after: with the members
    """

    constants: Array
    sigmas: Array
    numbers: tuple[Array, ...]
    covariances: tuple[Array, ...]
    shown: tuple[Array, ...]
    before: Array
    after: Array

    @property
    def together(self) -> Array:
        """Effect of all members together on the values, (m,) um."""
        whole: Array = np.sum([np.zeros(len(self.before)), *self.shown], axis=0)
        return whole


def fitted(evidence: Evidence, members: Sequence[Member], share: float, stay: Mask | None = None) -> JointFit:
    """Fit constants and members together, by maximum posterior probability.

    stay  (k,) constants that keep the value of the machine file; None: all are fitted
    """
    data, free = evidence.background.data, evidence.background.data.base
    back = data.problem.selection.start - data.coefficients
    loose = np.ones(len(back), dtype=bool) if stay is None else ~stay
    kept = np.concatenate([np.ones(free.shape[1] - len(back), dtype=bool), loose])
    y = data.y - free[:, ~kept] @ back[~loose]
    lengths = _lengths(free[:, kept])
    base, parts_of = free[:, kept] / lengths, [evidence.groups[m.group].columns for m in members]
    columns, n = np.concatenate([base, *parts_of], axis=1), base.shape[1]
    widths = [part.shape[1] for part in parts_of]
    own = [np.full(width, m.size**-2) for m, width in zip(members, widths, strict=True)]
    prior = np.concatenate([np.full(n, WIDE**-2), *own])
    precision = evidence.background.precision(share)
    z, spread = _solved(columns, y, precision, prior)
    alone, _ = _solved(base, y, precision, prior[:n])
    parts = [slice(a, b) for a, b in pairwise(n + np.cumsum([0, *widths]))]
    numbers = tuple(z[part] for part in parts)
    shown = tuple(part @ own_numbers for part, own_numbers in zip(parts_of, numbers, strict=True))
    constants, sigmas = back.copy(), np.zeros(len(back))
    constants[loose] = (z[:n] / lengths)[n - loose.sum() :]
    sigmas[loose] = (np.sqrt(np.diag(spread)[:n]) / lengths)[n - loose.sum() :]
    covariances = tuple(spread[part, part] for part in parts)
    return JointFit(constants, sigmas, numbers, covariances, shown, y - base @ alone, y - columns @ z)


def _lengths(columns: Array) -> Array:
    """Root mean square of each column; 1 for columns of zeros."""
    size = np.sqrt((columns**2).mean(axis=0))
    return np.where(size > 0, size, 1.0)


def _solved(columns: Array, y: Array, precision: Array, prior: Array) -> tuple[Array, Array]:
    weighed = precision @ columns
    spread = np.linalg.inv(columns.T @ weighed + np.diag(prior))
    found: Array = spread @ (weighed.T @ y)
    return found, np.asarray(spread)


def machine_with(
    evidence: Evidence, members: Sequence[Member], joint: JointFit
) -> tuple[Machine, list[tuple[Effect, ...]]]:
    """The machine with the fitted constants and effects; and the effects that each member added."""
    data = evidence.background.data
    start = data.problem.selection.start
    coefficients = data.coefficients + joint.constants
    coefficients = np.where(np.isclose(coefficients, start, rtol=1e-9, atol=0.0), start, coefficients)
    machine = data.problem.selection.machine(data.machine, coefficients.tolist())
    added = [
        effects_of(evidence.groups[m.group], numbers, spread)
        for m, numbers, spread in zip(members, joint.numbers, joint.covariances, strict=True)
    ]
    every = (*machine.effects, *(effect for each in added for effect in each))
    return machine.replace(effects=every), added


def effects_of(group: EffectForm, numbers: Array, spread: Array) -> tuple[Effect, ...]:
    """The effects of a form with fitted coefficients, unused ones left out; empty if it is no error of the machine."""
    if group.owner.kept_out:
        return ()
    values = group.loading @ numbers
    covariance = group.loading @ spread @ group.loading.T
    found, start = [], 0
    for effect in group.owner.effects:
        part = slice(start, start + effect.basis.size)
        start = part.stop
        own = np.abs(group.loading[part]).sum(axis=1) > TRACE * np.abs(group.loading).sum()
        if own.any():
            found.append(_trimmed(effect, values[part], covariance[part, part], own))
    return tuple(found)


def _trimmed(effect: Effect, values: Array, covariance: Array, own: Array) -> Effect:
    """The effect with coefficients and covariance; orders and powers that the form does not use are left out."""
    basis, keep = _fewer(effect.basis, own)
    even = (covariance + covariance.T)[np.ix_(keep, keep)] / 2
    return replace(
        effect, basis=basis, coefficients=tuple(float(v) for v in values[keep]),
        covariance=tuple(tuple(float(v) for v in row) for row in even),
    )  # fmt: skip


def _fewer(basis: Basis, own: Array) -> tuple[Basis, Array]:
    if isinstance(basis, Fourier):
        pairs = [bool(pair.any()) for pair in own.reshape(-1, 2)]
        orders = tuple(k for k, kept in zip(basis.order, pairs, strict=True) if kept)
        return replace(basis, order=orders), np.repeat(pairs, 2)
    if isinstance(basis, Polynomial):
        return replace(basis, degree=tuple(k for k, kept in zip(basis.degree, own, strict=True) if kept)), own
    return basis, np.ones(len(own), dtype=bool)


@frozen(slots=False)
class HeldOut:
    """Prediction errors of held-out values, um, (m,); NaN where no prediction was possible.

    without, with_all  without any member, and with all; less: for each member, with all others
    cell               (m,) region of poses of each value
    """

    without: Array
    with_all: Array
    less: tuple[Array, ...]
    cell: Ints


def held_out_as_given(evidence: Evidence, from_file: Array, setup: Array, share: float) -> Array:
    """Prediction errors (m,) um of the unchanged machine file, its set-up fitted to the other regions.

    from_file  (m,) values minus the file's prediction, um; setup (m, j): derivatives by the unknowns of the set-up
    """
    background = evidence.background
    columns = WIDE * setup / _lengths(setup)
    return _predicted(background, from_file, columns, share, _folds(background.data)[1])


def _folds(data: ResidualData) -> tuple[Ints, list[Mask]]:
    """The region of each value, (m,), and for each fold a mask of the values that it holds out."""
    cell = pose_regions(scaled_axes(data))[np.maximum(data.row, 0)]
    return cell, [(cell % FOLDS == fold) & (data.row >= 0) for fold in range(FOLDS)]


@frozen(slots=False)
class Gap:
    """Root mean square of residual lengths, um.

    before, after  with the constants alone, and with the findings; holdout_...: the same on held-out poses
    floor          the noise
    given, holdout_given  with the unchanged machine file: only the set-up is fitted
    """

    before: float
    after: float
    floor: float
    holdout_before: float
    holdout_after: float
    given: float = float("nan")
    holdout_given: float = float("nan")


def held_out(evidence: Evidence, members: Sequence[Member], share: float) -> HeldOut:
    """Predict each fold of regions from the others: without members, with all, and with all but one in turn."""
    background = evidence.background
    data = background.data
    cell, tests = _folds(data)
    base = WIDE * data.base / _lengths(data.base)
    shown = [evidence.groups[m.group].columns * m.size for m in members]
    models = [[], shown, *([*shown[:out], *shown[out + 1 :]] for out in range(len(shown)))]
    errors = [_predicted(background, data.y, np.concatenate([base, *model], axis=1), share, tests) for model in models]
    return HeldOut(errors[0], errors[1], tuple(errors[2:]), cell)


def _predicted(background: Background, y: Array, signal: Array, share: float, tests: Sequence[Mask]) -> Array:
    """Errors of predicting each fold of the values y from the others. The columns of `signal` have unit variance.

    With Q the inverse covariance of all values, the block of Q that belongs to a fold gives the fold's prediction from
    the others. With the fold's values replaced by it, Q y weighs the others, and only the signal is carried over.
    """
    precision = background.precision(share)
    weighed = precision @ signal
    inner = np.eye(signal.shape[1]) + signal.T @ weighed
    carried = np.linalg.solve(inner, weighed.T)  # the inverse with the signal in it is precision - weighed @ carried
    solved, error = precision @ y - weighed @ (carried @ y), np.full(len(y), np.nan)
    for test in tests:
        if test.any() and not test.all():
            spread = np.linalg.inv(precision[np.ix_(test, test)] - weighed[test] @ carried[:, test])
            missed = np.where(test, 0.0, y)
            missed[test] = y[test] - spread @ solved[test]
            others = np.where(test, 0.0, precision @ missed - weighed @ (carried @ missed))
            told = np.diag(spread) < (BLIND * background.sigma * background.relative[test]) ** 2
            error[test] = np.where(told, y[test] - signal[test] @ (signal.T @ others), np.nan)
    error[background.relative > 0.1 * ASIDE] = np.nan
    return error


def pose_regions(u: Array, count: int = REGIONS) -> Ints:
    """The region (n,) of each pose u (n, k): equal counts, by repeated halving at the median of the widest axis."""
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


def prediction_gain(held: HeldOut, worse: Array) -> tuple[float, float]:
    """Mean increase per region of the squared prediction errors with another model; and its standard error.

    worse  (m,) prediction errors of the other model, um
    """
    known = np.isfinite(held.with_all) & np.isfinite(worse)
    per = [
        float((worse[k] ** 2 - held.with_all[k] ** 2).sum())
        for c in np.unique(held.cell)
        if (k := known & (held.cell == c)).any()
    ]
    return float(np.mean(per)), float(np.std(per) / np.sqrt(max(len(per) - 1, 1)))


def passing(scale: Comparison, selected: Selected) -> Selected:
    """Drop the names that do not improve held-out predictions by more than one standard error, or are immaterial.

    One is dropped at a time, the least likely first, since the others may then be needed more.
    """
    while failed := _failed(scale, selected):
        weakest = min(failed, key=lambda name: selected.odds[name])
        selected = with_alternatives(scale, {name: each for name, each in selected.members.items() if name != weakest})
    return selected


def _failed(scale: Comparison, selected: Selected) -> list[str]:
    members, evidence = list(selected.members.values()), scale.evidence
    if not selected.named:
        return []
    share = evidence.share(members)
    held = held_out(evidence, members, share)
    joint = fitted(evidence, members, share)
    data, found = evidence.background.data, []
    least = np.maximum(data.little * MATERIAL_UM, RATHER * unnamed_by_view(evidence, selected, joint))
    for k, name in enumerate(selected.members):
        mean, error = prediction_gain(held, held.less[k])
        predicts = mean > error or _stands_behind(scale, selected, name)
        shown = joint.shown[k]
        size = data.size_by_view(visible(data, shown))
        if evidence.groups[members[k].group].owner.dynamic:
            size = np.maximum(size, float(np.abs(shown).max()) / SHARP)
        matters = (size >= least).any()
        if name in selected.named and not (matters and predicts):
            found.append(name)
    return found


def unnamed_by_view(evidence: Evidence, selected: Selected, whole: JointFit, keep: Mask | None = None) -> Array:
    """Size, um rms per sort of rows, of the part of the residual that only unnamed alternatives explain.

    whole  the fit with names and alternatives
    """
    data, every = evidence.background.data, list(selected.members.values())
    left = whole.after
    if selected.unnamed:
        left = fitted(evidence, [selected.members[name] for name in selected.named], evidence.share(every)).after
    squares = data.size_by_view(left, keep) ** 2 - data.size_by_view(whole.after, keep) ** 2
    return np.sqrt(np.maximum(squares, 0.0))


def _stands_behind(scale: Comparison, selected: Selected, name: str) -> bool:
    """Whether a name is a constant beside other effects, which can imitate it when it is left out."""
    return scale.evidence.constant(name) and not all(scale.evidence.constant(each) for each in selected.named)


def visible(data: ResidualData, shown: Array) -> Array:
    """The part (m,) um of an effect on the values that set-up and constants cannot absorb."""
    free = orthonormal(data.base / data.relative[:, None])
    return without(free, (shown / data.relative)[:, None])[:, 0] * data.relative
