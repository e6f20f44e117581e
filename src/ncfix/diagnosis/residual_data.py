"""Residuals of several measurement files of one machine, and the misfit of a machine file to data.

One entry per measured value, m in all, in um; angles as the displacement that they cause at half the machine's reach.
`base` holds the columns of the parameters that are always free: the unknowns of the set-ups, and the constants of the
machine file (location errors, squareness, gains), which vary with the day and the set-up.

`Misfit` tells how well a machine file agrees with data while its constants are held near the file's values.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field
from functools import cached_property

import numpy as np

from ncfix.arrays import Array, Ints, Mask
from ncfix.diagnosis.catalogue.candidate import MeasuredRange
from ncfix.machine import Effect, Machine
from ncfix.machine.axes import SPINDLE, Axis
from ncfix.machine.basis import ConstantBasis, Polynomial
from ncfix.machine.plausible import times_a_machining_centre
from ncfix.measure.estimate import Problem
from ncfix.measure.least_squares import gauss_newton, solve
from ncfix.measure.measurement import Measurement, groups
from ncfix.measure.selection import Selection
from ncfix.values import frozen

STEPS = 6
SETTLED_UM = 1e-3
HOLD_REACH = 1.0
"""Unit of the distance of a workpiece's fixed point from the middle of the measured points: their rms distance."""
UNTELLABLE = 1e-5
"""Singular values below this share of the largest count as zero: the data do not determine the combination."""
LEAST_UM, DOUBLED = 1.5, 4
"""The smallest size of an effect that is considered, um rms, and how often it is doubled for a machine of one metre."""
USUAL_NOISE_UM = 3.0
"""Noise of a value, um, for which the smallest sizes that matter are stated."""
TIGHT_UM = 4.0
"""Prior standard deviation of each constant, um at the tool tip, for a file that was right once.

All prior standard deviations here are for a machining centre of one metre; larger machines and arms have more.
"""
AS_IT_STANDS_UM = 0.01
"""Prior standard deviation of each constant if the unchanged file is judged, um."""
USUAL_UM = 50.0
"""Prior standard deviation about zero of each constant of another machine, um."""
FREE_UM = 500.0
"""Prior standard deviation of free constants, um: finite, else undetermined combinations would run away."""
LOOSE_UM = 200.0
"""Prior standard deviation of the additional `loose` effects, um: the set-up takes what both could explain."""
WIDE_UM = 1e5
"""Prior standard deviation of the unknowns of the set-up, um."""
TRIM = 0.97
"""Share of the values that count, the smallest residuals first: the rest may be outliers."""
BENT_UM = 1e5
"""A change of a prediction by so much changes it by half as much again in second order, um: a tenth of a metre, less
than the reach of any machine."""
EXACT_STEPS = 4
"""Most steps of least squares on the exact model."""
EXACT_SETTLED_UM = 0.05
"""Largest change of a prediction, um, at which the iteration ends."""
Hopeless = Callable[[float], bool]
"""Whether a residual, um, is too large to be of interest."""


@frozen(repr=False, slots=False)
class ResidualData:
    """Residuals and their linearization; one entry per measured value.

    problem   the stacked observations with the free constants as unknown effects
    coefficients, unknowns  fitted constants and set-up, about which everything is linearized
    y         (m,) values minus the prediction of machine file and fitted set-up, um
    base      (m, k) derivatives by the free parameters: set-up first, then constants
    row       (m,) index of the row among the rows of all files; -1 for calibrated distances
    relative  (m,) standard deviation of each value, relative to the median one
    """

    problem: Problem
    coefficients: Array
    unknowns: Array
    y: Array
    base: Array
    row: Ints
    relative: Array

    @property
    def sigma(self) -> float:
        """Standard deviation of a usual value (`relative` 1) according to the files, um."""
        return usual_noise(self.problem)

    @property
    def noise_stated(self) -> bool:
        """Whether all files state their noise."""
        return all(each.noise_stated for each in self.problem.observations)

    @cached_property
    def sizes(self) -> tuple[float, ...]:
        """The sizes of an effect at the tool tip that are considered, um rms."""
        return tuple(LEAST_UM * 2.0**k for k in range(DOUBLED + 1 + round(np.log2(self.large))))

    @cached_property
    def large(self) -> float:
        """How many times larger errors are than on a machining centre of one metre."""
        return times_a_machining_centre(self.machine)

    @cached_property
    def little(self) -> float:
        """Factor on the sizes that are too small to matter; 1 for a machining centre of one metre. See `little_of`."""
        return little_of(self.machine, self.sigma)

    @property
    def machine(self) -> Machine:
        """The machine file as it was given."""
        return self.problem.machine

    @property
    def measurements(self) -> list[Measurement]:
        """The measurement files."""
        return [each.measurement for each in self.problem.observations]

    @property
    def count(self) -> int:
        """Number of rows of all files."""
        return sum(len(each) for each in self.measurements)

    def design(self, effects: Sequence[Effect]) -> Array:
        """The derivative of all values by the coefficients of effects, um, (m, k)."""
        return np.concatenate([each.um[:, None] * each.design(effects) for each in self.problem.observations])

    def expansion(self, drive: Sequence[Effect]) -> Array:
        """Derivative of all values by an expansion of the part on the table, um, (m, 4 k).

        drive  effects of k coefficients that give the course of the expansion
        The first k columns are an expansion about the middle of the measured points; the next three groups of k shift
        the unknown fixed point in x, y and z.
        """
        parts = []
        for each in self.problem.observations:
            nominal = each.machine.nominal(each.q, each.state.tool_length)
            arm = nominal[:, :3, 3] - nominal[:, :3, 3].mean(axis=0)
            far = float(np.sqrt((arm**2).sum(axis=1).mean()))
            ways = np.stack([arm, *(np.broadcast_to(HOLD_REACH * far * way, arm.shape) for way in np.eye(3))], axis=-1)
            turned = np.einsum("nji,njw->niw", nominal[:, :3, :3], ways)[np.maximum(each.rows, 0)]
            tip = each.design([Effect(f"E{letter}{SPINDLE}", (0.0,)) for letter in "XYZ"])
            seen = np.einsum("mk,mkw->mw", tip, turned) * (each.rows >= 0)[:, None]
            driven = each.machine.design(each.q, each.state, drive)[:, :3]
            along = each.machine.design(each.q, each.state, [Effect(drive[0].name, (0.0,))])[:, :3]
            course = np.einsum("nik,ni->nk", driven, along[:, :, 0]) / (along[:, :, 0] ** 2).sum(axis=1)[:, None]
            shown = seen[:, :, None] * course[np.maximum(each.rows, 0)][:, None]
            parts.append(-each.um[:, None] * shown.reshape(len(shown), -1))
        return np.concatenate(parts)

    def shares(self, of: Sequence[Array]) -> Array:
        """Least-squares operator (k, m): values (m,) -> coefficients of the k columns, with the base fitted as well."""
        free = np.concatenate([self.base, *of], axis=1) / self.relative[:, None]
        size = np.linalg.norm(free, axis=0)
        size = np.where(size > 0, size, 1.0)
        own = slice(self.base.shape[1], None)
        shares: Array = np.linalg.pinv(free / size, rcond=UNTELLABLE)[own] / self.relative / size[own, None]
        return shares

    @cached_property
    def q(self) -> Array:
        """Axis positions of all rows, (n, n_axes)."""
        return np.concatenate([each.q for each in self.problem.observations])

    def column(self, name: str) -> Array:
        """A state column (n,) of all rows, zero for files without it; directions of approach as in `directions`."""
        axis = name.removeprefix("dir_")
        if axis != name and axis in self.machine.axis_names:
            return self.directions[:, self.machine.axis_names.index(axis)]
        return np.concatenate([each.column(name) for each in self.measurements])

    @cached_property
    def directions(self) -> Array:
        """Direction of approach of each axis in each row, (n, n_axes): 1, -1, or 0 if unknown."""
        own = [np.broadcast_to(each.state.direction, each.q.shape) for each in self.problem.observations]
        return np.concatenate(own).astype(np.float64)

    @cached_property
    def component(self) -> Ints:
        """Index of the component of each value within its row; -1 for calibrated distances."""
        parts = []
        for each in self.problem.observations:
            own = np.tile(np.arange(len(each.components)), len(each.measurement))
            parts.append(np.concatenate([own, np.full(len(each.extra_values), -1)]))
        return np.concatenate(parts)

    @cached_property
    def names(self) -> list[str]:
        """Name of the measured quantity of each value."""
        return [
            name
            for each in self.problem.observations
            for name in [*each.value_names, *["distance"] * len(each.extra_values)]
        ]

    @cached_property
    def file(self) -> Ints:
        """Index of the file of each row."""
        return np.repeat(np.arange(len(self.measurements)), [len(each) for each in self.measurements])

    @cached_property
    def sets(self) -> tuple[str, ...]:
        """Name of the set of each row, with its file if there are several."""
        many = len(self.measurements) > 1
        return tuple(
            f"{each.path} set {name}" if many else f"set {name}" for each in self.measurements for name in each.sets
        )

    @cached_property
    def views(self) -> Ints:
        """Index of the sort of row of each value, (m,): a sort is the rows of one file with the same quantities."""
        sorts = [f"{file} {name}" for file, name in zip(self.file, self._first_names, strict=True)]
        return groups(sorts)[1][np.maximum(self.row, 0)]

    @property
    def _first_names(self) -> list[str]:
        """Name of the first quantity of each row."""
        seen = self.problem.observations
        return [name for each in seen for name in each.value_names[:: len(each.components)]]

    def size(self, values: Array, keep: Mask | None = None) -> float:
        """Size of an effect on the values, um: `rms` over the sort of rows in which it is largest.

        Rows of other sorts, however many, do not make it smaller.
        """
        return float(self.size_by_view(values, keep).max(initial=0.0))

    def size_by_view(self, values: Array, keep: Mask | None = None) -> Array:
        """`rms` over each sort of rows, (views,); zero for sorts without a row in `keep`."""
        squares = (values**2).reshape(len(values), -1).sum(axis=1)
        if keep is None:
            views, counts = self._sorted
            squares = squares if self._whole else squares[self._inside]
        else:
            inside = self._inside & keep
            views, squares = self.views[inside], squares[inside]
            rows = np.unique(self.row[inside], return_index=True)[1]
            counts = np.bincount(views[rows], minlength=self.views.max(initial=-1) + 1)
        return np.sqrt(np.bincount(views, squares, minlength=len(counts)) / np.maximum(counts, 1))

    def rms(self, values: Array, keep: Mask | None = None) -> float:
        """Root mean square over rows of the length of each row's vector of values (m, ...), um, of those in `keep`."""
        inside = self._inside if keep is None else self._inside & keep
        rows = len(self._firsts) if keep is None else len(np.unique(self.row[inside]))
        return float(np.linalg.norm(values if inside.all() else values[inside]) / np.sqrt(max(rows, 1)))

    @cached_property
    def _whole(self) -> bool:
        """Whether all values belong to rows."""
        return bool(self._inside.all())

    @cached_property
    def _sorted(self) -> tuple[Ints, Ints]:
        """The sort of each value of the rows, and the number of rows of each sort, (views,)."""
        views = self.views[self._inside]
        return views, np.bincount(views[self._firsts], minlength=self.views.max(initial=-1) + 1)

    @cached_property
    def _inside(self) -> Mask:
        """(m,) whether a value belongs to a row: all but calibrated distances."""
        return self.row >= 0

    @cached_property
    def _firsts(self) -> Ints:
        """Index of the first value of each row, among the values of rows."""
        return np.unique(self.row[self._inside], return_index=True)[1]

    @cached_property
    def measured(self) -> MeasuredRange:
        """The range of axes, inputs and time that was measured."""
        units = np.array([axis.unit for axis in self.machine.axes])
        places = np.concatenate([*self._ends, self.q]) / units
        spans = dict(
            zip(self.machine.axis_names, zip(places.min(0).tolist(), places.max(0).tolist(), strict=True), strict=True)
        )
        shared = set.intersection(*(set(each.columns) for each in self.measurements))
        shared = {name for name in shared if not name.startswith("dir_")}
        stated = {f"dir_{axis.name}" for axis in self.machine.axes if not self.unstated(axis)}
        moving = {name for name in shared | stated if np.ptp(self.column(name)) > 0}
        time = self.column("time_s")
        sensors = {name: self.column(name) for name in moving if name.startswith("temp_")}
        warmth = {name: (float(values.mean()), float(values.std())) for name, values in sensors.items()}
        return MeasuredRange(self.machine, spans, frozenset(moving), (float(time.min()), float(time.max())), warmth)

    def unstated(self, axis: Axis) -> list[str]:
        """Paths of the files that moved an axis without stating its direction of approach, if other files state it."""
        index = self.machine.axis_names.index(axis.name)
        if not self.directions[:, index].any():
            return []
        own = [(each, each.q[:, index], each.state.direction) for each in self.problem.observations]
        return [
            each.measurement.path
            for each, q, direction in own
            if np.ptp(q) > 0 and not np.broadcast_to(direction, each.q.shape)[:, index].any()
        ]

    @property
    def _ends(self) -> list[Array]:
        return [end for each in self.problem.observations for end in getattr(each, "ends", [])]


def residual_data(measurements: Sequence[Measurement], machine: Machine) -> ResidualData:
    """Fit set-up and constants, and linearize about the fit.

    Constants that the data cannot determine are held, as in `calibrate`, by the Jacobian at the first guess. Otherwise
    second-order terms would seem to determine them, and they would run away.
    """
    selection = Selection(machine.effects, tuple(is_free(effect) for effect in machine.effects))
    problem = Problem.of(measurements, machine, selection)
    relative = relative_noise(problem)
    scale = usual_noise(problem) * relative
    base = problem.um[:, None] * np.concatenate([problem.nuisance(problem.start), problem.design], axis=1)
    free, seen = np.split(base / scale[:, None], [len(problem.start)], axis=1)

    def step(at: tuple[Array, Array]) -> tuple[tuple[Array, Array], float]:
        coefficients, unknowns = at
        target = problem.um * problem.residual(coefficients, unknowns) / scale
        change = solve(seen, free, target, problem.limits).change
        moved = damped(free, target - seen @ change)
        size = float(np.abs((seen @ change + free @ moved) * scale).max(initial=0.0))
        return (coefficients + change, unknowns + moved), size

    (coefficients, unknowns), _ = gauss_newton(step, (selection.start, problem.start), STEPS, SETTLED_UM)
    residual = problem.um * problem.residual(coefficients, unknowns)
    return ResidualData(problem, coefficients, unknowns, residual, base, rows_of(problem), relative)


def usual_noise(problem: Problem) -> float:
    """Median standard deviation of the values, um, of the files whose noise is known; of all files if none is."""
    known = [each.um * each.sigma for each in problem.observations if each.noise_known]
    return float(np.median(np.concatenate(known) if known else problem.um * problem.sigma))


def little_of(machine: Machine, noise_um: float) -> float:
    """Factor on the sizes that are too small to matter: grows with the machine, but no further than with the noise."""
    return min(times_a_machining_centre(machine), max(1.0, noise_um / USUAL_NOISE_UM))


def relative_noise(problem: Problem) -> Array:
    """Standard deviation of each value relative to the median, (m,); files of unknown noise count like the others."""
    usual = usual_noise(problem)
    noise = [(each.um * each.sigma, each.noise_known) for each in problem.observations]
    sigma = np.concatenate([own if known else own * usual / np.median(own) for own, known in noise])
    relative: Array = sigma / np.median(sigma)
    return relative


def damped(columns: Array, y: Array) -> Array:
    """Least squares of columns (m, k) to y (m,), (k,); combinations that the data hardly determine stay zero."""
    size = np.sqrt((columns**2).mean(axis=0))
    size = np.where(size > 0, size, 1.0)
    left, values, right = np.linalg.svd(columns / size, full_matrices=False)
    kept = values > UNTELLABLE * values.max(initial=1e-300)
    found: Array = right[kept].T @ ((left[:, kept].T @ y) / values[kept]) / size
    return found


def is_free(effect: Effect) -> bool:
    """Whether an effect is a constant that set-up and day may change: a location error, or a gain."""
    if effect.input is not None or effect.times is not None:
        return False
    if isinstance(effect.basis, ConstantBasis):
        return True
    return type(effect.basis) is Polynomial and max(effect.basis.degree) <= 1


def rows_of(problem: Problem) -> Ints:
    """(m,) index of the row of each value among the rows of all files; -1 for calibrated distances."""
    rows, first = [], 0
    for each in problem.observations:
        rows.append(np.where(each.rows < 0, -1, each.rows + first))
        first += len(each.measurement)
    return np.concatenate(rows)


@frozen(slots=False)
class Misfit:
    """The misfit of a machine file to data.

    problem   the fit: set-up, constants of the file, and additional `loose` effects
    relative  (m,) standard deviation of each value relative to the median
    noise     noise of the instrument, um
    loose     number of coefficients of the loose effects, the last ones
    fits      cache: prior, um -> (residual, um; constants)
    """

    problem: Problem
    relative: Array
    noise: float
    loose: int
    fits: dict[float, tuple[float, Array]] = field(default_factory=dict)

    def left(self, prior_um: float = TIGHT_UM, hopeless: Hopeless | None = None) -> float:
        """Root mean square residual, um, without the largest; changes of constants, against the prior, count as misfit.

        prior_um  standard deviation of the constants at the tool tip, for a machining centre of one metre
        hopeless  whether a residual is too large to be of interest; the fit ends as soon as it is known to become so
                  large, with infinity
        """
        return self._fitted(prior_um, hopeless)[0]

    @property
    def count(self) -> int:
        """Number of values that count."""
        return int(TRIM * len(self.relative))

    @property
    def free(self) -> float:
        """Residual with free constants, um."""
        return self.left(FREE_UM)

    @property
    def constants(self) -> Array:
        """The constants as the data have them, mm or rad."""
        return self._fitted(USUAL_UM)[1]

    @property
    def coefficients(self) -> Array:
        """The fitted coefficients of the loose effects."""
        every = self._fitted(TIGHT_UM)[1]
        return every[len(every) - self.loose :]

    def _fitted(self, prior_um: float, hopeless: Hopeless | None = None) -> tuple[float, Array]:
        """Residual, um, and constants, with a prior scaled to this machine's size."""
        if prior_um not in self.fits:
            large = times_a_machining_centre(self.problem.machine)
            found = _fitted(
                self.problem, self.relative, self.noise, large * prior_um, self.loose, large * LOOSE_UM, hopeless
            )
            if not np.isfinite(found[0]):
                return found
            self.fits[prior_um] = found
        return self.fits[prior_um]


def misfit(measurements: Sequence[Measurement], machine: Machine, loose: Sequence[Effect] = ()) -> Misfit:
    """The misfit of a machine to measurements, to be fitted when asked; `loose`: additional effects to fit."""
    selection = Selection((*machine.effects, *loose), tuple(map(is_free, (*machine.effects, *loose))))
    problem = Problem.of(measurements, machine, selection)
    free = sum(effect.basis.size for effect in loose)
    return Misfit(problem, relative_noise(problem), usual_noise(problem), free)


def _fitted(
    problem: Problem, relative: Array, sigma: float, prior_um: float, free: int, loose_um: float,
    hopeless: Hopeless | None = None,
) -> tuple[float, Array]:  # fmt: skip
    """Residual, um, and coefficients by least squares on the exact model, with priors on all but the set-up.

    hopeless  see `Misfit.left`. A step leaves what is expected to first order, within the second-order part, which is
              no larger than that of the step before, or than the square of the step over `BENT_UM`
    """
    start, k, scale = problem.selection.start, len(problem.start), problem.um / relative
    held: Array
    expected = np.full(len(scale), np.inf)
    given_up = False

    def step(at: tuple[Array, Array]) -> tuple[tuple[Array, Array], float]:
        nonlocal held, expected, given_up
        coefficients, unknowns = at
        columns = np.concatenate([problem.nuisance(unknowns), problem.design], axis=1) * scale[:, None]
        size = np.sqrt((columns**2).mean(axis=0))
        size = np.where(size > 0, size, 1.0)
        allowed = np.full(columns.shape[1], WIDE_UM)
        allowed[k:] = prior_um
        allowed[len(allowed) - free :] = loose_um
        held = sigma / allowed * size
        y = scale * problem.residual(coefficients, unknowns)
        back = -held * np.concatenate([np.zeros(k), coefficients - start])
        stacked = np.concatenate([columns / size, np.diag(sigma / allowed)])
        change = np.linalg.lstsq(stacked, np.concatenate([y, back]), rcond=1e-9)[0] / size
        after, moved = (coefficients + change[k:], unknowns + change[:k]), columns @ change
        most = float(np.abs(moved).max(initial=0.0))
        if hopeless is not None:
            bent = min(most**2 / BENT_UM, float(np.abs(y - expected).max(initial=0.0)))
            expected = y - moved
            given_up = hopeless(_trimmed(expected, held[k:] * (after[0] - start)) - bent)
        return after, 0.0 if given_up else most

    (coefficients, unknowns), _ = gauss_newton(step, (start, problem.start), EXACT_STEPS, EXACT_SETTLED_UM)
    if given_up:
        return np.inf, coefficients
    left = scale * problem.residual(coefficients, unknowns)
    return _trimmed(left, held[k:] * (coefficients - start)), coefficients


def _trimmed(left: Array, moved: Array) -> float:
    """Root mean square, um, of a residual (m,) without its largest values, and of the changes `moved` of constants."""
    sizes = np.abs(left)
    kept = np.sort(np.where(np.isfinite(sizes), sizes, 1e12))[: int(TRIM * len(sizes))]
    return float(np.sqrt(((kept**2).sum() + (moved**2).sum()) / len(kept)))
