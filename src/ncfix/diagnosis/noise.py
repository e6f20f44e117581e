"""Noise, drift of the instrument and outliers: the background of the evidence, and the noise floor of the report.

Drift of the instrument. A thermal drift of the machine looks like a drift of the instrument, which would then hide it.
So each size of the instrument's drift is weighed together with the names that act in time only, added one after another
as long as they pay the price of a name. A real effect never quite has the catalogue's course (`MISSHAPEN`); what a name
misses counts as drift of the instrument.

Outliers are found by predicting each value from all others. The model is the base with a generous background of small
effects, so that real effects make no outliers. Very large effects still do; so if more rows stand out than instruments
fail, the likeliest effect is added and the test repeated. Rows beyond `GROSS` are put aside and reported; those beyond
`TAIL` get less weight, for long tails of the noise.

The noise floor comes from repeats, from the file, or from neighbouring poses; the excess of the residual over it is
tested.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import field
from itertools import islice, pairwise

import numpy as np
from scipy.linalg import cholesky, eigh, qr, solve_triangular
from scipy.special import chdtrc, fdtrc

from ncfix.arrays import Array, Mask
from ncfix.diagnosis.effect_form import Blocks, EffectForm, block_odds, blocks_of, column_bounds, side_by_side
from ncfix.diagnosis.evidence import (
    BATCH,
    MISSHAPEN,
    Background,
    entry_price,
    in_noise,
    marginal,
    wandering_correlation,
    with_noise,
)
from ncfix.diagnosis.forms import shape_variations, without_lacking_constants
from ncfix.diagnosis.residual_data import ResidualData
from ncfix.measure.least_squares import inverse, orthonormal
from ncfix.measure.measurement import Measurement, groups
from ncfix.values import frozen

DRIFT_SIZES = (0.0, 0.15, 0.35, 0.7)
"""Sizes of the instrument's drift that are considered, in units of the noise."""
ROWS = 256
"""Rows of a large matrix product that are computed at once, to limit memory."""
EVERYTHING_SHARE = 0.35
"""Size of the background of small effects, in units of the noise, while the drift is estimated."""
MOST_COURSES = 4
"""Largest number of names that are added to explain a drift."""
UNKNOWN_NOISE = 1.0
"""Degrees of freedom of the prior noise if no file states it."""
STATED_NOISE = 200.0
"""Degrees of freedom of the prior noise if all files state it."""
GROSS, TAIL = 5.0, 3.0
"""Standard deviations from which on a value is an outlier, and from which on it gets less weight."""
GENEROUS_SHARE = 2.5
"""Size of the background of small effects, in units of the noise, in the search for outliers."""
ASIDE = 1e3
"""Factor on the standard deviation of outliers."""
FAILED = 0.02
"""Share of the rows that an instrument may spoil; if more stand out, an effect may be the reason. Brief effects of the
drives may be the reason in any case."""
LARGE = 8.0
"""Factor on the considered sizes of effects, for effects large enough to make rows stand out."""
LIKELY = 10.0
"""Log odds that such an effect must have."""
MOST_EFFECTS = 5
"""Largest number of such effects."""
TAILS = 2.0
"""Relative variance of a standard deviation from repeats, times its freedom, for Student's t with 5 degrees."""
TRUSTED = 0.1
"""Relative uncertainty of a stated noise."""
USUAL_UM = 1.0
"""Size of the small effects that every machining centre of one metre has, um rms."""
ASTRAY = 5.0
"""Standard deviations beyond which a repeat is an outlier."""
ENOUGH_REPEATS = 10
"""Degrees of freedom of repeats from which they determine the noise."""


@frozen(repr=False, slots=False)
class Contrasts:
    """An orthonormal basis (m, n) of the complement of the base: the last columns of 1 - V T V'.

    vectors  V (m, k), the Householder vectors of the base; joined: T (k, k) of their compact product
    """

    vectors: Array
    joined: Array

    def seen(self, values: Array) -> Array:
        """Values (m, p) transformed to contrasts, (n, p)."""
        k = self.vectors.shape[1]
        return values[k:] - self.vectors[k:] @ (self.joined.T @ (self.vectors.T @ values))

    def values(self, contrasts: Array) -> Array:
        """Contrasts (n, p) transformed to values, (m, p), orthogonal to the base."""
        k = self.vectors.shape[1]
        found = -self.vectors @ (self.joined @ (self.vectors[k:].T @ contrasts))
        found[k:] += contrasts
        return found

    def of(self, covariance: Array) -> Array:
        """A covariance of values (m, m) transformed to contrasts, (n, n)."""
        return self.seen(self.seen(covariance).T)


def error_contrasts(base: Array) -> Contrasts:
    """The contrasts orthogonal to the columns of `base` (m, k)."""
    size = np.linalg.norm(base, axis=0)
    scaled = base[:, size > 0] / size[size > 0]
    basis = orthonormal(scaled)
    (packed, scales), _ = qr(basis, mode="raw", check_finite=False)
    count = basis.shape[1]
    vectors = np.tril(packed[:, :count], -1) + np.eye(len(basis), count)
    products, joined = vectors.T @ vectors, np.diag(scales)
    for k in range(count):  # Schreiber and Van Loan 1989
        joined[:k, k] = -scales[k] * (joined[:k, :k] @ products[:k, k])
    return Contrasts(vectors, joined)


def everything_covariance(data: ResidualData, named: Sequence[EffectForm]) -> Array:
    """Covariance (m, m), um^2, of "everything": all names with equal shares, 1 um together.

    Constants that the machine file lacks are not part of it: they are sought, not assumed.
    """
    covariance, parts = np.zeros((len(data.y), len(data.y))), _everything(named, (group.columns for group in named))
    for columns in without_lacking_constants(data, parts, named):
        covariance += columns @ columns.T
    return covariance


def everything_at(data: ResidualData, named: Sequence[EffectForm], ahead: Sequence[Array]) -> tuple[Array, Array]:
    """As `everything_covariance`, for v values at further poses: (v, v), and with the old values, (v, m), um^2.

    ahead  for each form its effect on the further values, (v, p) um
    """
    new = side_by_side([np.zeros((len(ahead[0]) if ahead else 0, 0)), *_everything(named, ahead)])
    old = side_by_side([np.zeros((len(data.y), 0)), *_everything(named, (group.columns for group in named))])
    lacking = [k for k, group in enumerate(named) if group.owner.constant]
    if lacking:
        constants = [named[k].columns for k in lacking]
        shares = data.shares(constants) @ old
        old = old - np.concatenate(constants, axis=1) @ shares
        new = new - np.concatenate([ahead[k] for k in lacking], axis=1) @ shares
    return new @ new.T, new @ old.T


def _everything(named: Sequence[EffectForm], shown: Iterable[Array]) -> Iterator[Array]:
    """Columns of "everything" in batches: those of each form (`shown`), scaled so that names have equal shares."""
    forms = Counter(group.owner.name for group in named if not group.owner.constant)
    kept = ((group.owner, own) for group, own in zip(named, shown, strict=True) if not group.owner.constant)
    parts = (own / np.sqrt(forms[owner.name] * len(forms)) for owner, own in kept)
    while some := list(islice(parts, BATCH)):
        yield side_by_side(some)


def estimated_background(
    data: ResidualData, everything: Array, relative: Array, named: Sequence[EffectForm] = ()
) -> Background:
    """The background with the likeliest drift of the instrument; `named`: forms that may explain a drift instead."""
    sigma, freedom = _noise(data)
    free = error_contrasts(data.base / relative[:, None])
    inner = free.of(in_noise(everything, relative))
    slow, drift = wandering_correlation(data, relative), 0.0
    if slow is not None:
        noise = free.of(slow)
        del slow
        drift = _likeliest_drift(
            DriftLikelihood(free, sigma * relative, data.y, inner, noise, freedom), named, data.sizes
        )
        noise *= drift**2
        noise[np.diag_indices_from(noise)] += 1.0
    # both are symmetric: their transposes are Fortran-ordered, so LAPACK works in place
    if drift:
        spectrum, vectors = eigh(inner.T, noise.T, driver="gvd", overwrite_a=True, overwrite_b=True)
    else:
        spectrum, vectors = eigh(inner.T, driver="evd", overwrite_a=True)
    rotation = free.values(vectors)
    rotation /= relative[:, None]
    return Background(data, relative, rotation, np.maximum(spectrum, 0.0), sigma, freedom, drift, everything)


def _noise(data: ResidualData) -> tuple[float, float]:
    """Prior noise of a usual value, um, and its degrees of freedom."""
    return data.sigma, STATED_NOISE if data.noise_stated else UNKNOWN_NOISE


@frozen(repr=False, slots=False)
class DriftLikelihood:
    """Likelihood of the size of the instrument's drift.

    free        contrasts, n of m values
    scale       (m,) standard deviations of the values, um
    y           (m,) the values, um
    everything  (n, n) covariance of "everything" at 1 um; slow: of the drift at the size of the noise
    freedom     degrees of freedom of the prior noise
    """

    free: Contrasts
    scale: Array
    y: Array
    everything: Array
    slow: Array
    freedom: float

    def likelihood(self, size: float) -> float:
        """Log likelihood of the data with a drift of this size (in units of the noise)."""
        white, determinant = self.white(size, [])
        return marginal(float(white[:, 0] @ white[:, 0]), determinant, len(white), self.freedom)

    def white(self, size: float, groups: Sequence[EffectForm]) -> tuple[Array, float]:
        """Contrasts of the data and of the columns of some forms, (n, 1 + p), whitened by noise, background and a drift
        of this size; and the log determinant of that covariance.
        """
        covariance = size**2 * self.slow
        covariance += EVERYTHING_SHARE**2 * self.everything
        covariance[np.diag_indices_from(covariance)] += 1.0
        factor = cholesky(covariance.T, lower=True, overwrite_a=True, check_finite=False)
        seen = np.empty((len(covariance), 1 + column_bounds(groups)[-1]), order="F")
        seen[:, :1] = self.free.seen(self.y[:, None] / self.scale[:, None])
        for group, (start, stop) in zip(groups, pairwise(column_bounds(groups)), strict=True):
            seen[:, 1 + start : 1 + stop] = self.free.seen(group.columns / self.scale[:, None])
        white = solve_triangular(factor, seen, lower=True, overwrite_b=True, check_finite=False)
        return np.asarray(white), 2 * float(np.log(np.diag(factor)).sum())


def _likeliest_drift(asked: DriftLikelihood, named: Sequence[EffectForm], sizes: Sequence[float]) -> float:
    """The likeliest size of the drift: no larger with names than without, no smaller than what their courses miss."""
    plain = [asked.likelihood(size) for size in DRIFT_SIZES]
    most = int(np.argmax(plain)) + 1
    courses = [group for group in named if group.owner.slow]
    wandering = DRIFT_SIZES[:most] if most > 1 else ()
    beside = [_beside_names(asked.white(size, courses)[0], asked.freedom, courses, named, sizes) for size in wandering]
    beside = beside or [(0.0, 0.0)]
    best = int(np.argmax([own + gained for own, (gained, _) in zip(plain, beside, strict=False)]))
    missed = MISSHAPEN * beside[best][1] / float(np.median(asked.scale))
    return max(size for size in DRIFT_SIZES[:most] if size <= max(DRIFT_SIZES[best], missed))


def _beside_names(
    white: Array, freedom: float, courses: Sequence[EffectForm], named: Sequence[EffectForm], sizes: Sequence[float]
) -> tuple[float, float]:
    """Gain of log likelihood, less prices, by names that act in time only; and the size of the largest one, um rms.

    white  (n, 1 + p) the whitened data and columns of `courses`, the forms of those names
    """
    forms = Counter(group.owner.name for group in named)
    prices = np.log([len(forms) * forms[group.owner.name] * len(sizes) for group in courses])
    ends = column_bounds(courses)
    y, columns, length = white[:, 0], white[:, 1:], len(white) + freedom
    inner = blocks_of([part.T @ part for part in np.split(columns, ends[1:-1], axis=1)]) if courses else []
    gained, shown, beside = 0.0, 0.0, np.zeros((len(y), 0))
    for count in range(1, MOST_COURSES + 1 if courses else 1):
        less = _taken(beside, beside)
        left = y - less @ (less.T @ y)
        odds = block_odds(inner, columns.T @ left, less.T @ columns, float(y @ left) + freedom, length, sizes)
        odds -= prices[:, None]
        best, large = (int(k) for k in np.unravel_index(int(odds.argmax()), odds.shape))
        helped = float(odds[best, large]) - entry_price(count) + entry_price(count - 1)
        if helped <= 0:
            break
        gained, shown = gained + helped, max(shown, sizes[large])
        beside = np.concatenate([beside, sizes[large] * columns[:, ends[best] : ends[best + 1]]], axis=1)
    return gained, shown


def _taken(weighed: Array, columns: Array) -> Array:
    """A (m, k), such that adding columns of unit variance reduces the precision P by A A'; `weighed` is P columns."""
    factor = cholesky(np.eye(columns.shape[1]) + columns.T @ weighed, lower=True, check_finite=False)
    return np.asarray(solve_triangular(factor, weighed.T, lower=True, check_finite=False).T)


def downweighted(data: ResidualData, everything: Array, groups: Sequence[EffectForm]) -> tuple[Array, Mask]:
    """Relative standard deviations (m,) with outliers downweighted, and a mask (rows,) of the rows put aside.

    everything  (m, m) covariance of "everything" at 1 um, um^2
    groups      forms of all effects that may be there
    """
    plain = PlainModel.of(data, everything)
    beside = np.zeros((len(data.y), 0))
    z = np.abs(plain.leave_one_out(beside))
    for _ in range(MOST_EFFECTS):
        few = _standing_out(data, z).mean() <= FAILED
        effect = plain.likeliest_effect(groups, few, beside, np.maximum(1.0, z / TAIL))
        if effect is None:
            break
        beside = np.concatenate([beside, effect], axis=1)
        z = np.abs(plain.leave_one_out(beside))
    gross, row = _standing_out(data, z), data.row
    relative = data.relative * np.maximum(1.0, z / TAIL)
    return np.where((row >= 0) & gross[np.maximum(row, 0)], ASIDE * data.relative, relative), gross


@frozen(repr=False, slots=False)
class PlainModel:
    """The model of the outlier test: base, noise and a generous background; further effects enter as columns.

    y          (m,) the values, in units of each value's noise
    precision  (m, m) inverse covariance with the base free, in the same units
    inner      cache: (forms of drives only, index of the first form of a batch) -> weighted inner products
    """

    data: ResidualData
    y: Array
    precision: Array
    inner: dict[tuple[bool, int], Blocks] = field(default_factory=dict)

    @classmethod
    def of(cls, data: ResidualData, everything: Array) -> PlainModel:
        """The model for data with the covariance (m, m) of "everything" at 1 um, um^2."""
        base = orthonormal(data.base / data.relative[:, None])
        precision = inverse(with_noise(everything, GENEROUS_SHARE, data.relative))
        solved = precision @ base
        known = np.linalg.solve(base.T @ solved, solved.T)
        for start in range(0, len(precision), ROWS):
            precision[start : start + ROWS] -= solved[start : start + ROWS] @ known
        return cls(data, data.y / data.relative, precision)

    def less(self, beside: Array) -> Array:
        """A (m, k), such that adding columns `beside` (m, k) of unit variance reduces the precision by A A'."""
        return _taken(self.precision @ beside, beside)

    def leave_one_out(self, beside: Array) -> Array:
        """Each value minus its prediction from all others, over its standard deviation, (m,); robustly scaled."""
        less = self.less(beside)
        solved = self.precision @ self.y - less @ (less.T @ self.y)
        z = solved / np.sqrt(np.maximum(np.diag(self.precision) - (less**2).sum(axis=1), 1e-12))
        spread = float(np.median(np.abs(z))) / 0.6745
        return np.asarray(z / (spread or 1.0))

    def likeliest_effect(self, groups: Sequence[EffectForm], dynamic: bool, beside: Array, wide: Array) -> Array | None:
        """Columns (m, k) of the likeliest effect at its likeliest size, with changes of its shape; None if none is
        likely.

        dynamic  consider effects of the drives only
        beside   columns of the effects already there
        wide     (m,) factor on the noise of values that stand out, so that single outliers bring no effect
        """
        some = [group for group in groups if group.owner.dynamic or not dynamic]
        doubtful = np.flatnonzero(wide > 1)
        spoilt = np.zeros((len(wide), len(doubtful)))
        spoilt[doubtful, np.arange(len(doubtful))] = np.sqrt(wide[doubtful] ** 2 - 1)
        less = self.less(np.concatenate([beside, spoilt], axis=1))
        solved = self.precision @ self.y - less @ (less.T @ self.y)
        total, count = float(self.y @ solved), float(len(self.y) - self.data.base.shape[1])
        best, found = LIKELY, None
        for start in range(0, len(some), BATCH):
            part = some[start : start + BATCH]
            columns = side_by_side(group.single for group in part).astype(np.float64)
            columns *= LARGE / self.data.relative[:, None]
            inner = self._inner(dynamic, start, columns, column_bounds(part))
            odds = block_odds(inner, columns.T @ solved, less.T @ columns, total, count, self.data.sizes)
            form, size = (int(k) for k in np.unravel_index(int(odds.argmax()), odds.shape))
            if odds[form, size] > best:
                own = column_bounds(part)[form : form + 2]
                best, found = float(odds[form, size]), self.data.sizes[size] * columns[:, slice(*own)]
        if found is None:
            return None
        weighed = self.precision @ found - less @ (less.T @ found)
        shown = found @ np.linalg.solve(np.eye(found.shape[1]) + found.T @ weighed, weighed.T @ self.y)
        return np.concatenate([found, MISSHAPEN * shown[:, None] * shape_variations(self.data)], axis=1)

    def _inner(self, dynamic: bool, start: int, columns: Array, bounds: Sequence[int]) -> Blocks:
        """Weighted inner products of the batch of forms from index `start` on; cached."""
        key = dynamic, start
        if key not in self.inner:
            parts = (np.split(each, bounds[1:-1], axis=1) for each in (columns, self.precision @ columns))
            self.inner[key] = blocks_of([own.T @ weighed for own, weighed in zip(*parts, strict=True)])
        return self.inner[key]


def _standing_out(data: ResidualData, z: Array) -> Mask:
    """Mask of the rows with a value beyond `GROSS` standard deviations."""
    gross = np.zeros(data.count, dtype=bool)
    gross[data.row[(z > GROSS) & (data.row >= 0)]] = True
    return gross


@frozen(slots=False)
class NoiseFloor:
    """The noise floor.

    sigma_um  standard deviation of a usual value, um
    source    repeats, given, or neighbours (what smooth effects leave)
    freedom   degrees of freedom
    squares   sum of squares of the repeats about their means, um^2
    """

    sigma_um: float
    source: str
    freedom: int
    squares: float = 0.0


def noise_floor(data: ResidualData, background: Background, sigma_um: float, keep: Mask) -> NoiseFloor:
    """The noise floor from repeats if there are enough, else as stated, else as estimated with the fit (`sigma_um`)."""
    squares, freedom = repeat_scatter(data, keep)
    if freedom >= ENOUGH_REPEATS:
        return NoiseFloor(float(np.sqrt(squares / freedom)), "repeats", freedom, squares)
    if data.noise_stated:
        return NoiseFloor(background.sigma, "given", 0)
    return NoiseFloor(sigma_um, "neighbours", 0)


def beyond_noise(data: ResidualData, noise_floor: NoiseFloor, noise: Array, left: Array, keep: Mask) -> float:
    """Excess of the residual `left` (m,) over the noise (m,) and the usual small effects, um rms, worst sort of rows.

    The noise is increased by its uncertainty: two standard deviations of that from repeats (with long tails), a tenth
    if it was stated, and at least what the number of rows allows.
    """
    known = 2 * np.sqrt(TAILS / noise_floor.freedom) if noise_floor.freedom else TRUSTED
    counts = np.bincount(data.views[keep], minlength=data.views.max(initial=0) + 1)
    doubt = np.maximum(known, 2 / np.sqrt(np.maximum(counts, 1)))
    expected = data.size_by_view(noise, keep) ** 2 * (1 + doubt) ** 2 + (data.little * USUAL_UM) ** 2
    beyond: Array = np.sqrt(np.maximum(data.size_by_view(left, keep) ** 2 - expected, 0.0))
    return float(beyond.max(initial=0.0))


def repeat_scatter(data: ResidualData, keep: Mask) -> tuple[float, int]:
    """Sum of squares, um^2, of repeats about their means, and its degrees of freedom.

    Repeats are values of one quantity taken one after another at one commanded state.
    """
    same = states(data.measurements)
    keys = [
        f"{same[row]} {name}" for row, name, kept in zip(data.row, data.names, keep, strict=True) if row >= 0 and kept
    ]
    values = (data.y / data.relative)[(data.row >= 0) & keep]
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


def states(measurements: Sequence[Measurement]) -> list[int]:
    """Index of the commanded state of each row. Consecutive equal rows share it, except in a test of drift."""
    seen: list[int] = []
    number, before = -1, None
    for each in measurements:
        names = [name for name in each.columns if name not in each.measured and not varying(name)]
        labels = [value for name, value in each.labels.items() if name != "repeat"]
        for i in range(len(each)):
            key = (each.path, *(label[i] for label in labels), *(round(float(each.columns[n][i]), 4) for n in names))
            number += each.stays or key != before
            before = key
            seen.append(number)
    return seen


def lack_of_fit(noise_floor: NoiseFloor, residual: Array, parameters: float) -> float | None:
    """Probability by chance of residuals so much larger than the noise; None without repeats or a stated noise.

    residual    um, each divided by its relative standard deviation
    parameters  number of fitted parameters
    """
    n = len(residual)
    squares = float((residual**2).sum())
    if noise_floor.source == "repeats":
        left = n - parameters - noise_floor.freedom
        if left <= 0:
            return None
        ratio = ((squares - noise_floor.squares) / left) / (noise_floor.squares / noise_floor.freedom)
        return float(fdtrc(left, noise_floor.freedom, ratio))
    if noise_floor.source == "given":
        return float(chdtrc(max(n - parameters, 1), squares / noise_floor.sigma_um**2))
    return None


def varying(name: str) -> bool:
    """Whether a column may change between repeats."""
    return name.startswith("temp_") or name in ("time_s", "run")
