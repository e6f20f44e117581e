"""How much the instrument wanders, and the background that goes with that.

A drift of hours looks like an instrument that wanders, as long as nothing else may explain it, and a wandering of that
size then hides the drift. So each size of the wandering is weighed together with the names that act in the course of
time and nothing else: the likeliest one after another, at the price of a name, as long as they pay. The course of a
real effect is never quite what the catalogue says (`MISSHAPEN`), and what a name misses of it wanders, too.

Values that neither the model nor any smooth effect explains: found by leaving each one out.

The model that is asked is the base with a generous amount of everything, so that an effect that is really there makes
no outliers. One that is many times the noise makes them all the same; so where more rows stand out than instruments
fail, the effect that explains the data best is taken to be there as well, and it is asked again. Rows beyond `GROSS`
are put aside and named; those beyond `TAIL` count less (long tails of the noise).

How large the noise is, from what, and whether anything is left beyond it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, eigh, qr, solve_triangular
from scipy.special import chdtrc, fdtrc

from ncfix.diagnosis.evidence import MISSHAPEN, TOGETHER, Background, entry_price, in_noise, log_odds, marginal
from ncfix.diagnosis.forms import (
    EffectForm,
    shape_variations,
    side_by_side,
    without_lacking_constants,
)
from ncfix.diagnosis.residual_data import ResidualData
from ncfix.measure.least_squares import inverse, orthonormal
from ncfix.measure.measurement import Array, Measurement, groups
from ncfix.values import frozen

DRIFT_TIME = 900.0
"""s: how long an instrument's wandering lasts."""
DRIFT_SIZES = (0.0, 0.15, 0.35, 0.7)
"""Its size against the noise."""
EVERYTHING_SHARE = 0.35
"""Size of everything else together, against the noise, while it is asked how much the instrument wanders."""
MOST_COURSES = 4
"""Names that are added at most."""
UNKNOWN_NOISE = 1.0
"""Degrees of freedom of what is known of the noise where nothing is."""
STATED_NOISE = 200.0
"""The same where the header of a file states it."""
GROSS, TAIL = 5.0, 3.0
GENEROUS_SHARE = 2.5
"""Size of everything, against the noise, that may be there."""
ASIDE = 1e3
"""Factor on the standard deviation of what is put aside."""
FAILED = 0.02
"""Share of the rows that an instrument may spoil; where more stand out, an effect may be why. What drives do for a
moment only may be why in any case."""
LARGE = 8.0
"""The sizes of effects times this, in noise, are those of effects that make rows stand out."""
LIKELY = 10.0
"""Log odds that such an effect must have."""
MOST_EFFECTS = 5
"""So many of them at most."""
TAILS = 2.0
"""Variance of a standard deviation from repeats, times their freedom, over its square: Student's t with 5 degrees."""
TRUSTED = 0.1
"""How far a noise that was given may be off."""
USUAL_UM = 1.0
"""rms of the little of everything that all machining centres of a metre have."""
ASTRAY = 5.0
"""Standard deviations beyond which a repeat is not noise."""
ENOUGH_REPEATS = 10
"""Degrees of freedom of repeats from which on they say something."""


@frozen(repr=False, slots=False)
class Contrasts:
    """An orthonormal basis of what is orthogonal to the base, (m, n), as the last columns of 1 - V T V': of the
    reflections that make it V (m, k) are the vectors, and T (k, k) is what makes one product of them.
    """

    vectors: Array
    joined: Array

    @property
    def columns(self) -> Array:
        """The basis itself, (m, n)."""
        m, k = self.vectors.shape
        return np.eye(m, m - k, -k) - self.vectors @ (self.joined @ self.vectors[k:].T)

    def seen(self, values: Array) -> Array:
        """Columns of values (m, p) as contrasts, (n, p); far quicker by a few reflections."""
        k = self.vectors.shape[1]
        return values[k:] - self.vectors[k:] @ (self.joined.T @ (self.vectors.T @ values))

    def of(self, covariance: Array) -> Array:
        """The covariance (m, m) of values as one of contrasts, (n, n)."""
        return self.seen(self.seen(covariance).T)


def error_contrasts(base: Array) -> Contrasts:
    """Those of what is free."""
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
    """The covariance of a little of every candidate, of 1 um together, each name with the same share, um^2, (m, m).

    But nothing of the constants that the machine file lacks: those are looked for, not taken for granted.
    """
    columns = without_lacking_constants(
        data, _everything(named, [group.columns for group in named], len(data.y)), named
    )
    return columns @ columns.T


def everything_at(data: ResidualData, named: Sequence[EffectForm], ahead: Sequence[Array]) -> tuple[Array, Array]:
    """The same of v values at further poses, of which each form shows `ahead` (v, p) um: (v, v), and with the old
    values, (v, m).
    """
    new = _everything(named, ahead, len(ahead[0]) if ahead else 0)
    old = _everything(named, [group.columns for group in named], len(data.y))
    lacking = [k for k, group in enumerate(named) if group.owner.constant]
    if lacking:
        constants = [named[k].columns for k in lacking]
        shares = data.shares(old, constants)
        old = old - np.concatenate(constants, axis=1) @ shares
        new = new - np.concatenate([ahead[k] for k in lacking], axis=1) @ shares
    return new @ new.T, new @ old.T


def _everything(named: Sequence[EffectForm], shown: Sequence[Array], count: int) -> Array:
    """Columns (count, p) of a little of every name: what each form shows, each name with the same share."""
    kept = [(group, own) for group, own in zip(named, shown, strict=True) if not group.owner.constant]
    forms = Counter(group.owner.name for group, _ in kept)
    parts = [own / np.sqrt(forms[group.owner.name] * len(forms)) for group, own in kept]
    return side_by_side([np.zeros((count, 0)), *parts])


def estimated_background(
    data: ResidualData, everything: Array, relative: Array, named: Sequence[EffectForm] = ()
) -> Background:
    """Estimate how much the instrument wanders, where these names may act besides, and find the coordinates."""
    sigma, freedom = _noise(data)
    free = error_contrasts(data.base / relative[:, None])
    left = free.columns
    slow, drift = _drift_correlation(data, relative), 0.0
    inner = free.of(in_noise(everything, relative))
    if slow is not None:
        seen = free.of(slow)
        drift = _likeliest_drift(
            DriftLikelihood(free, sigma * relative, data.y, inner, seen, freedom), named, data.sizes
        )
    if drift:
        factor = np.linalg.cholesky(np.eye(left.shape[1]) + drift**2 * seen)
        left = solve_triangular(factor, left.T, lower=True).T
        inner = solve_triangular(factor, solve_triangular(factor, inner, lower=True).T, lower=True)
    spectrum, vectors = eigh(inner, driver="evd")
    rotation = (left @ vectors) / relative[:, None]
    return Background(data, relative, rotation, np.maximum(spectrum, 0.0), sigma, freedom, drift, everything, slow)


def _noise(data: ResidualData) -> tuple[float, float]:
    """Noise of a plain value, um, and how well it is known."""
    return data.sigma, STATED_NOISE if data.noise_stated else UNKNOWN_NOISE


def _drift_correlation(data: ResidualData, relative: Array) -> Array | None:
    """The correlation of values of one component by the time between them; None without a clock."""
    time = data.column("time_s")
    if np.ptp(time) == 0:
        return None
    row = np.maximum(data.row, 0)
    own, file = time[row], data.file[row]
    alike = (data.component[:, None] == data.component) & (data.row[:, None] >= 0) & (file[:, None] == file)
    lasting = np.where(alike, np.exp(-np.abs(own[:, None] - own) / DRIFT_TIME), 0.0)
    return in_noise(lasting, relative)


@frozen(repr=False, slots=False)
class DriftLikelihood:
    """How much does it wander?

    free        contrasts, n of m values
    scale       (m,) standard deviations of the values, um
    y           (m,) the values, um
    everything  (n, n) covariance of a little of everything at 1 um; slow: of the wandering at the size of the noise
    freedom     of what is known of the noise; factors of the covariances, each computed once
    """

    free: Contrasts
    scale: Array
    y: Array
    everything: Array
    slow: Array
    freedom: float
    factors: dict[float, Array] = field(default_factory=dict)

    def likelihood(self, size: float) -> float:
        """Log likelihood of the data with a wandering of this size, that of the noise integrated out."""
        white = self.white(size, self.seen([self.y]))[:, 0]
        determinant = 2 * float(np.log(np.diag(self._factor(size))).sum())
        return marginal(float(white @ white), determinant, len(white), self.freedom)

    def white(self, size: float, seen: Array) -> Array:
        """Contrasts of values (n, p) where noise, everything and such a wandering are one."""
        white: Array = solve_triangular(self._factor(size), seen, lower=True, check_finite=False)
        return white

    def seen(self, columns: Sequence[Array]) -> Array:
        """Contrasts of columns of values, one beside the other, in units of each value's noise, (n, p)."""
        return self.free.seen(np.column_stack(columns) / self.scale[:, None])

    def _factor(self, size: float) -> Array:
        if size not in self.factors:
            covariance = EVERYTHING_SHARE**2 * self.everything + size**2 * self.slow
            covariance[np.diag_indices_from(covariance)] += 1.0
            self.factors[size] = cholesky(covariance, lower=True, overwrite_a=True, check_finite=False)
        return self.factors[size]


def _likeliest_drift(asked: DriftLikelihood, named: Sequence[EffectForm], sizes: Sequence[float]) -> float:
    """The size that explains most; with names no more of it than without, and no less than what their courses miss."""
    plain = [asked.likelihood(size) for size in DRIFT_SIZES]
    most = int(np.argmax(plain)) + 1
    courses = [group for group in named if group.owner.slow]
    seen = asked.seen([asked.y, *(group.columns for group in courses)]) if most > 1 else np.zeros((0, 1))
    whites = (asked.white(size, seen) for size in DRIFT_SIZES[:most] if most > 1)
    beside = [_beside_names(white, asked.freedom, courses, named, sizes) for white in whites] or [(0.0, 0.0)]
    best = int(np.argmax([own + gained for own, (gained, _) in zip(plain, beside, strict=False)]))
    missed = MISSHAPEN * beside[best][1] / float(np.median(asked.scale))
    return max(size for size in DRIFT_SIZES[:most] if size <= max(DRIFT_SIZES[best], missed))


def _beside_names(
    white: Array, freedom: float, courses: Sequence[EffectForm], named: Sequence[EffectForm], sizes: Sequence[float]
) -> tuple[float, float]:
    """How much log likelihood names that act by time alone add to a wandering, less what they pay; and how much the
    largest shows, um rms. `white` are the data and the columns of those names, (n, 1 + p).
    """
    forms = Counter(group.owner.name for group in named)
    prices = np.log([len(forms) * forms[group.owner.name] * len(sizes) for group in courses])
    ends = np.cumsum([0, *(group.columns.shape[1] for group in courses)])
    gained, shown = 0.0, 0.0
    for count in range(1, MOST_COURSES + 1 if courses else 1):
        y, columns = white[:, 0], white[:, 1:]
        odds = _odds(columns, columns, y, float(y @ y) + freedom, len(y) + freedom, ends, sizes) - prices[:, None]
        best, large = (int(k) for k in np.unravel_index(int(odds.argmax()), odds.shape))
        helped = float(odds[best, large]) - entry_price(count) + entry_price(count - 1)
        if helped <= 0:
            break
        gained, shown = gained + helped, max(shown, sizes[large])
        white = _beside(white, sizes[large] * columns[:, ends[best] : ends[best + 1]])
    return gained, shown


def _odds(
    columns: Array, weighed: Array, y: Array, total: float, count: float, ends: Array, sizes: Sequence[float]
) -> Array:
    """The log odds of every form in every size, (forms, sizes), for values y (n,) of `total` squares.

    columns  (n, p) of the forms, one beside the other, which begin and end at `ends`; weighed: the same times the
             inverse of the covariance
    """
    widths = np.diff(ends)
    found = np.empty((len(widths), len(sizes)))
    for width in np.unique(widths):
        alike = np.flatnonzero(widths == width)
        own, other = (np.stack([each[:, ends[k] : ends[k + 1]].T for k in alike]) for each in (columns, weighed))
        found[alike] = log_odds(own @ np.swapaxes(other, 1, 2), other @ y, total, count, sizes)
    return found


def _beside(white: Array, there: Array) -> Array:
    """The same, white where these columns are there at unit size besides."""
    own, sizes, _ = np.linalg.svd(there, full_matrices=False)
    less: Array = white - own @ ((1 - 1 / np.sqrt(1 + sizes**2))[:, None] * (own.T @ white))
    return less


def downweighted(
    data: ResidualData, everything: Array, groups: Sequence[EffectForm]
) -> tuple[Array, NDArray[np.bool_]]:
    """Standard deviations against that of a plain value with outliers put aside, and which rows those are, (rows,).

    `everything` is the covariance of a little of everything, um^2; `groups` are all effects that may be there.
    """
    there = GENEROUS_SHARE**2 * in_noise(everything, data.relative)
    z = np.abs(leave_one_out(data, there))
    for _ in range(MOST_EFFECTS):
        few = _standing_out(data, z).mean() <= FAILED
        offered = [group for group in groups if group.owner.dynamic] if few else groups
        effect = _likeliest_effect(data, there, np.maximum(1.0, z / TAIL), offered) if len(offered) else None
        if effect is None:
            break
        there = there + effect @ effect.T
        z = np.abs(leave_one_out(data, there))
    gross, row = _standing_out(data, z), data.row
    relative = data.relative * np.maximum(1.0, z / TAIL)
    return np.where((row >= 0) & gross[np.maximum(row, 0)], ASIDE * data.relative, relative), gross


def leave_one_out(data: ResidualData, there: Array) -> Array:
    """For every value: what it is, minus what all others predict of it, over its standard deviation; (m,).

    `there` is the covariance of what is there besides noise and base, in units of each value's noise, (m, m).
    """
    precision = _precision(data, np.eye(len(there)) + there)
    z = precision @ (data.y / data.relative) / np.sqrt(np.maximum(np.diag(precision), 1e-12))
    spread = float(np.median(np.abs(z))) / 0.6745
    return z / (spread or 1.0)


def _precision(data: ResidualData, covariance: Array) -> Array:
    """The inverse of a covariance in units of each value's noise, with the base free, (m, m)."""
    base = orthonormal(data.base / data.relative[:, None])
    precision = inverse(covariance)
    solved = precision @ base
    return np.asarray(precision - solved @ np.linalg.solve(base.T @ solved, solved.T), dtype=np.float64)


def _standing_out(data: ResidualData, z: Array) -> NDArray[np.bool_]:
    """Rows with a value beyond `GROSS`."""
    gross = np.zeros(data.count, dtype=bool)
    gross[data.row[(z > GROSS) & (data.row >= 0)]] = True
    return gross


def _likeliest_effect(data: ResidualData, there: Array, wide: Array, groups: Sequence[EffectForm]) -> Array | None:
    """The likeliest effect in its likeliest size, and what it may differ in shape: columns in units of each value's
    noise, (m, k); None if none is likely.

    Values count less as their noise is `wide`: what stands out for other reasons shall not bring an effect.
    """
    precision, y = _precision(data, np.diag(wide**2) + there), data.y / data.relative
    total, count = float(y @ precision @ y), float(len(y) - data.base.shape[1])
    best, found = LIKELY, None
    for start in range(0, len(groups), TOGETHER):
        some = groups[start : start + TOGETHER]
        columns = LARGE * side_by_side(group.columns for group in some) / data.relative[:, None]
        ends = np.cumsum([0, *(group.columns.shape[1] for group in some)])
        odds = _odds(columns, precision @ columns, y, total, count, ends, data.sizes)
        form, size = (int(k) for k in np.unravel_index(int(odds.argmax()), odds.shape))
        if odds[form, size] > best:
            best, found = float(odds[form, size]), data.sizes[size] * columns[:, ends[form] : ends[form + 1]]
    if found is None:
        return None
    solved = precision @ found
    shown = found @ np.linalg.solve(np.eye(found.shape[1]) + found.T @ solved, solved.T @ y)
    return np.concatenate([found, MISSHAPEN * shown[:, None] * shape_variations(data)], axis=1)


@frozen(slots=False)
class NoiseFloor:
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


def noise_floor(data: ResidualData, background: Background, sigma_um: float, keep: NDArray[np.bool_]) -> NoiseFloor:
    """From repeats if there are enough, else as given, else as estimated from neighbouring poses."""
    squares, freedom = repeat_scatter(data, keep)
    if freedom >= ENOUGH_REPEATS:
        return NoiseFloor(float(np.sqrt(squares / freedom)), "repeats", freedom, squares)
    if data.noise_stated:
        return NoiseFloor(background.sigma, "given", 0)
    return NoiseFloor(sigma_um, "neighbours", 0)


def beyond_noise(
    data: ResidualData, noise_floor: NoiseFloor, noise: Array, left: Array, keep: NDArray[np.bool_]
) -> float:
    """What is left beyond the noise (m,) and what machines have of everything, um rms, in the rows of the worst sort.

    Noise that comes from repeats with long tails is known to two standard deviations only, a given one to a tenth, and
    no better than so many rows tell it.
    """
    known = 2 * np.sqrt(TAILS / noise_floor.freedom) if noise_floor.freedom else TRUSTED
    counts = np.bincount(data.views[keep], minlength=data.views.max(initial=0) + 1)
    doubt = np.maximum(known, 2 / np.sqrt(np.maximum(counts, 1)))
    expected = data.size_by_view(noise, keep) ** 2 * (1 + doubt) ** 2 + (data.little * USUAL_UM) ** 2
    beyond: Array = np.sqrt(np.maximum(data.size_by_view(left, keep) ** 2 - expected, 0.0))
    return float(beyond.max(initial=0.0))


def repeat_scatter(data: ResidualData, keep: NDArray[np.bool_]) -> tuple[float, int]:
    """Sum of squares of plain values about the means of those taken at one commanded state one after another, um^2, and
    its freedom.
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
    """Number of the commanded state of each row; rows of one state follow one another."""
    seen: list[int] = []
    number, before = -1, None
    for each in measurements:
        names = [name for name in each.columns if name not in each.measured and not varying(name)]
        labels = [value for name, value in each.labels.items() if name != "repeat"]
        for i in range(len(each)):
            key = (each.path, *(label[i] for label in labels), *(round(float(each.columns[n][i]), 4) for n in names))
            number += key != before
            before = key
            seen.append(number)
    return seen


def lack_of_fit(noise_floor: NoiseFloor, residual: Array, parameters: float) -> float | None:
    """How likely residuals so much larger than the noise are by chance; None without repeats or a given noise.

    residual  um, each by how many times its noise is that of a plain value
    """
    n = len(residual)
    squares = float((residual**2).sum())
    if noise_floor.source == "repeats":
        left = n - parameters - noise_floor.freedom
        ratio = ((squares - noise_floor.squares) / left) / (noise_floor.squares / noise_floor.freedom)
        return float(fdtrc(left, noise_floor.freedom, ratio)) if left > 0 else None
    if noise_floor.source == "given":
        return float(chdtrc(max(n - parameters, 1), squares / noise_floor.sigma_um**2))
    return None


def varying(name: str) -> bool:
    """Whether a column may change between repeats."""
    return name.startswith("temp_") or name in ("time_s", "run")
