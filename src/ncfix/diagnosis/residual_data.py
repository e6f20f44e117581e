"""What several measurement files show of one machine: residuals, what explains them already, and where each came from.

All values in um, angles as what they move at half the reach of the machine; one entry per measured value, m in all.
`base` are the columns of what is free anyway: the unknowns of the set-ups, and the constants of the machine file
(lines, squareness, gains), which a day and a set-up change.

How well a machine file as it stands agrees with data: its constants nearly fixed, only the set-up free.
"""

from __future__ import annotations

from collections.abc import Sequence
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
FAR = 1.0
"""How far from the middle of what was measured a workpiece is held, in times its size."""
UNTELLABLE = 1e-5
"""Singular values below this, of the largest, are taken for what cannot be told."""
LEAST_UM, DOUBLED = 1.5, 4
"""The least size of an effect that is considered, and how often that is doubled on a machining centre of a metre."""
USUAL_NOISE_UM = 3.0
"""Noise of a value for which the least sizes that matter are stated."""
TIGHT_UM = 4.0
"""How far each constant of a machine file may have moved since, at the tool tip; as the next ones of a machining
centre, and more on larger machines and arms."""
AS_IT_STANDS_UM = 0.01
"""The same where the file itself is judged."""
USUAL_UM = 50.0
"""How far the constants of another machine are from none."""
FREE_UM = 500.0
"""The same where they are free: no more, or what cannot be told runs away."""
LOOSE_UM = 200.0
"""How far effects go that are loose besides, in one step: what the set-up may do as well is the set-up's."""
WIDE_UM = 1e5
TRIM = 0.97
"""Share of the values that count: the rest may be outliers."""
EXACT_STEPS = 4
"""Most steps of least squares on the exact model."""
EXACT_SETTLED_UM = 0.05
"""A step that changes no prediction by so much is the last one."""


@frozen(repr=False, slots=False)
class ResidualData:
    """One entry per value.

    problem   the stacked observations with the free constants as unknown effects
    coefficients, unknowns  least squares of those and of the set-up, at which everything is taken to first order
    y         (m,) values minus what the machine file and the fitted set-up say, um
    base      (m, k) columns of what is free
    row       (m,) number of the row among the rows of all files; -1 for calibrated distances
    relative  (m,) standard deviation against that of a plain value
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
        """Standard deviation of a plain value as the files tell it, um."""
        return usual_noise(self.problem)

    @property
    def noise_stated(self) -> bool:
        """Whether all files state it."""
        return all(each.noise_stated for each in self.problem.observations)

    @cached_property
    def sizes(self) -> tuple[float, ...]:
        """Sizes of an effect at the tool tip that are considered, um."""
        return tuple(LEAST_UM * 2.0**k for k in range(DOUBLED + 1 + round(np.log2(self.large))))

    @cached_property
    def large(self) -> float:
        """How many times as large errors are as on a machining centre of a metre."""
        return times_a_machining_centre(self.machine)

    @cached_property
    def little(self) -> float:
        """The scale of what is too small to matter: no more than the noise makes it."""
        return little_of(self.machine, self.sigma)

    @property
    def machine(self) -> Machine:
        """The machine file as it was given."""
        return self.problem.machine

    @property
    def measurements(self) -> list[Measurement]:
        """The files."""
        return [each.measurement for each in self.problem.observations]

    @property
    def count(self) -> int:
        """How many rows there are."""
        return sum(len(each) for each in self.measurements)

    def design(self, effects: Sequence[Effect]) -> Array:
        """The derivative of all values by the coefficients of effects, um, (m, k)."""
        return np.concatenate([each.um[:, None] * each.design(effects) for each in self.problem.observations])

    def expansion(self, drive: Sequence[Effect]) -> Array:
        """What is seen when things on the table expand, um, (m, 4 k): the effects say with what, k coefficients.

        In turn by the tip's distance from the middle of what was measured, and by the x, y and z of the point at which
        they are held, which nobody knows.
        """
        parts = []
        for each in self.problem.observations:
            nominal = each.machine.nominal(each.q, each.state.tool_length)
            arm = nominal[:, :3, 3] - nominal[:, :3, 3].mean(axis=0)
            far = float(np.sqrt((arm**2).sum(axis=1).mean()))
            ways = np.stack([arm, *(np.broadcast_to(FAR * far * way, arm.shape) for way in np.eye(3))], axis=-1)
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
        """What least squares of values (m,) give each of some columns, beside all that is free, (k, m)."""
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
        """A state column (n,) of all rows, zero where a file lacks it; directions as the kind of measurement says."""
        axis = name.removeprefix("dir_")
        if axis != name and axis in self.machine.axis_names:
            return self.directions[:, self.machine.axis_names.index(axis)]
        return np.concatenate([each.column(name) for each in self.measurements])

    @cached_property
    def directions(self) -> Array:
        """(n, n_axes) in which the axes came to all rows, zero where that is not known."""
        own = [np.broadcast_to(each.state.direction, each.q.shape) for each in self.problem.observations]
        return np.concatenate(own).astype(np.float64)

    @cached_property
    def component(self) -> Ints:
        """Number of the component of each value in its row; -1 for calibrated distances."""
        parts = []
        for each in self.problem.observations:
            own = np.tile(np.arange(len(each.components)), len(each.measurement))
            parts.append(np.concatenate([own, np.full(len(each.extra_values), -1)]))
        return np.concatenate(parts)

    @cached_property
    def names(self) -> list[str]:
        """The name of what each value is."""
        return [
            name
            for each in self.problem.observations
            for name in [*each.value_names, *["distance"] * len(each.extra_values)]
        ]

    @cached_property
    def file(self) -> Ints:
        """Number of the file of each row."""
        return np.repeat(np.arange(len(self.measurements)), [len(each) for each in self.measurements])

    @cached_property
    def sets(self) -> tuple[str, ...]:
        """File and set of each row."""
        many = len(self.measurements) > 1
        return tuple(
            f"{each.path} set {name}" if many else f"set {name}" for each in self.measurements for name in each.sets
        )

    @cached_property
    def views(self) -> Ints:
        """Number of the sort of row of each value, (m,): rows of one file in which the same was read."""
        sorts = [f"{file} {name}" for file, name in zip(self.file, self._first_names, strict=True)]
        return groups(sorts)[1][np.maximum(self.row, 0)]

    @property
    def _first_names(self) -> list[str]:
        """Of each row what its first value is."""
        seen = self.problem.observations
        return [name for each in seen for name in each.value_names[:: len(each.components)]]

    def size(self, values: Array, keep: Mask | None = None) -> float:
        """How large something is that is shown like this, um: `rms` over the sort of rows in which it is largest.

        Rows of another sort do not make it smaller, however many there are.
        """
        return float(self.size_by_view(values, keep).max(initial=0.0))

    def size_by_view(self, values: Array, keep: Mask | None = None) -> Array:
        """`rms` over each sort of rows by itself, (views,); zero where no row is in `keep`."""
        inside = self._inside if keep is None else self._inside & keep
        squares = (values**2).reshape(len(values), -1).sum(axis=1)
        rows = np.unique(self.row[inside], return_index=True)[1] if keep is not None else self._firsts
        count = self.views.max(initial=-1) + 1
        total = np.bincount(self.views[inside], squares[inside], minlength=count)
        return np.sqrt(total / np.maximum(np.bincount(self.views[inside][rows], minlength=count), 1))

    def rms(self, values: Array, keep: Mask | None = None) -> float:
        """Root mean square over rows of the length of what each shows; values (m, ...), um, those in `keep` (m,)."""
        inside = self._inside if keep is None else self._inside & keep
        rows = len(self._firsts) if keep is None else len(np.unique(self.row[inside]))
        return float(np.linalg.norm(values if inside.all() else values[inside]) / np.sqrt(max(rows, 1)))

    @cached_property
    def _inside(self) -> Mask:
        """(m,) whether a value is of a row."""
        return self.row >= 0

    @cached_property
    def _firsts(self) -> Ints:
        """Of the values of rows the first of each row."""
        return np.unique(self.row[self._inside], return_index=True)[1]

    @cached_property
    def measured(self) -> MeasuredRange:
        """What was measured."""
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
        """The files that moved an axis and do not say from where it came, where others do."""
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
    """Fit what is free, and take everything else to first order about it.

    Constants that the data cannot tell are held as `calibrate` holds them, with the Jacobian at the first guess: else
    what cannot be told at all would be told by second order, and run away.
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
    """Standard deviation of a plain value as the files tell it, um; of those that do not only where none does."""
    known = [each.um * each.sigma for each in problem.observations if each.noise_known]
    return float(np.median(np.concatenate(known) if known else problem.um * problem.sigma))


def little_of(machine: Machine, noise_um: float) -> float:
    """How many times as large as on a machining centre an error is that does not matter, measured with this noise."""
    return min(times_a_machining_centre(machine), max(1.0, noise_um / USUAL_NOISE_UM))


def relative_noise(problem: Problem) -> Array:
    """Standard deviation of each value against the usual one, (m,); files that do not tell are like those that do."""
    usual = usual_noise(problem)
    noise = [(each.um * each.sigma, each.noise_known) for each in problem.observations]
    sigma = np.concatenate([own if known else own * usual / np.median(own) for own, known in noise])
    relative: Array = sigma / np.median(sigma)
    return relative


def damped(columns: Array, y: Array) -> Array:
    """Least squares of columns (m, k) to y (m,), in which what the data hardly tell stays zero: (k,)."""
    size = np.sqrt((columns**2).mean(axis=0))
    size = np.where(size > 0, size, 1.0)
    left, values, right = np.linalg.svd(columns / size, full_matrices=False)
    kept = values > UNTELLABLE * values.max(initial=1e-300)
    found: Array = right[kept].T @ ((left[:, kept].T @ y) / values[kept]) / size
    return found


def is_free(effect: Effect) -> bool:
    """Whether an effect is a constant of the set-up and the day: where an axis lies, or a gain."""
    if effect.input is not None or effect.times is not None:
        return False
    if isinstance(effect.basis, ConstantBasis):
        return True
    return type(effect.basis) is Polynomial and max(effect.basis.degree) <= 1


def rows_of(problem: Problem) -> Ints:
    """(m,) the row of each value among those of all files; -1 for calibrated distances."""
    rows, first = [], 0
    for each in problem.observations:
        rows.append(np.where(each.rows < 0, -1, each.rows + first))
        first += len(each.measurement)
    return np.concatenate(rows)


@frozen(slots=False)
class Misfit:
    """A machine file against data.

    problem   what is fitted: the set-up, constants of the file, and effects that are `loose` besides
    relative  (m,) standard deviation of each value against that of a plain one
    noise     of the instrument, um
    loose     how many coefficients are free besides
    fits      what is left and the constants for each prior that was asked, computed once
    """

    problem: Problem
    relative: Array
    noise: float
    loose: int
    fits: dict[float, tuple[float, Array]] = field(default_factory=dict)

    def left(self, prior_um: float = TIGHT_UM) -> float:
        """Root mean square of residual values, um, without the largest; what constants moved is counted as misfit."""
        return self._fitted(prior_um)[0]

    @property
    def count(self) -> int:
        """How many values count."""
        return int(TRIM * len(self.relative))

    @property
    def free(self) -> float:
        """What is left with the constants free."""
        return self.left(FREE_UM)

    @property
    def constants(self) -> Array:
        """The constants of the file where the data have them."""
        return self._fitted(USUAL_UM)[1]

    @property
    def coefficients(self) -> Array:
        """The constants that are loose."""
        every = self._fitted(TIGHT_UM)[1]
        return every[len(every) - self.loose :]

    def _fitted(self, prior_um: float) -> tuple[float, Array]:
        """What is left and the constants, held as far as errors of this machine are larger than of others."""
        if prior_um not in self.fits:
            large = times_a_machining_centre(self.problem.machine)
            self.fits[prior_um] = _fitted(
                self.problem, self.relative, self.noise, large * prior_um, self.loose, large * LOOSE_UM
            )
        return self.fits[prior_um]


def misfit(measurements: Sequence[Measurement], machine: Machine, loose: Sequence[Effect] = ()) -> Misfit:
    """Ready to be asked."""
    selection = Selection((*machine.effects, *loose), tuple(map(is_free, (*machine.effects, *loose))))
    problem = Problem.of(measurements, machine, selection)
    free = sum(effect.basis.size for effect in loose)
    return Misfit(problem, relative_noise(problem), usual_noise(problem), free)


def _fitted(
    problem: Problem, relative: Array, sigma: float, prior_um: float, free: int, loose_um: float
) -> tuple[float, Array]:
    """Least squares with a prior on the constants, on the exact model."""
    start, k, scale = problem.selection.start, len(problem.start), problem.um / relative
    held: Array

    def step(at: tuple[Array, Array]) -> tuple[tuple[Array, Array], float]:
        nonlocal held
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
        return (coefficients + change[k:], unknowns + change[:k]), float(np.abs(columns @ change).max(initial=0.0))

    (coefficients, unknowns), _ = gauss_newton(step, (start, problem.start), EXACT_STEPS, EXACT_SETTLED_UM)
    y = np.abs(scale * problem.residual(coefficients, unknowns))
    y = np.sort(np.where(np.isfinite(y), y, 1e12))[: int(TRIM * len(y))]
    moved = held[k:] * (coefficients - start)
    return float(np.sqrt(((y**2).sum() + (moved**2).sum()) / len(y))), coefficients
