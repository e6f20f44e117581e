"""Kind `axis`: one error motion of one axis, read directly (interferometer, autocollimator, straightedge, level).

A reading is the component of the body's error motion at the measured point, `# point:`, or else at the reference point
of the effect. The zero of the instrument is unknown, a constant per set and component; for straightness of a linear
axis the alignment of the reference line is unknown as well, a slope.

`positioning_figures` evaluates bidirectional positioning by ISO 230-2 and 230-3.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from ncfix.arrays import Array, Ints, Mask
from ncfix.machine import Effect, Machine
from ncfix.machine.axes import Axis
from ncfix.machine.error_model import dependence_of, unit_motion
from ncfix.machine.state import flatten, with_lags
from ncfix.measure.measurement import Measurement, component_of, groups
from ncfix.measure.observation import DEFAULT_NOISE, LEVER, Observation, Unknowns, repeatability
from ncfix.values import frozen

ANGLE = 1e-4
"""Standard deviation of an angle instrument's zero in simulations, rad."""
RUNS = 2
"""Smallest number of runs at a position for a standard deviation."""
K = 2.0
"""Coverage factor of the bands of ISO 230-2."""


class DirectReading(Observation):
    """Observation of kind `axis`: rows of axis, component, position, value."""

    def __init__(self, measurement: Measurement, machine: Machine) -> None:
        super().__init__(measurement, machine)
        names = list(machine.axis_names)
        pairs = zip(measurement.labels["axis"], measurement.labels["component"], strict=True)
        self.names = tuple(component_of(axis, component) or "" for axis, component in pairs)
        self.axis_index = np.array([names.index(axis) for axis in measurement.labels["axis"]])
        each = np.arange(len(measurement))
        units = np.array([axis.unit for axis in machine.axes])
        self.q[each, self.axis_index] = measurement.columns["position"] * units[self.axis_index]
        if "direction" in measurement.columns:
            direction = np.array(np.broadcast_to(self.state.direction, self.q.shape), dtype=np.float64)
            direction[each, self.axis_index] = measurement.columns["direction"]
            self.state = replace(self.state, direction=direction)
        texts = [f"{name} in set {group}" for name, group in zip(self.names, measurement.sets, strict=True)]
        self.series, self.series_index = groups(texts)
        point = measurement.header("point")
        self.point = np.array([float(part) for part in point.split()]) if point else None

    @property
    def components(self) -> tuple[str, ...]:
        """See `Observation`: one value per row."""
        return ("value",)

    @cached_property
    def sigma(self) -> Array:
        """See `Observation`; the noise of lengths and angles is estimated from repeats separately."""
        lengths, angles = self.measurement.noise
        if angles is None and lengths is None:
            angles = self._repeats(self.turns)
        if lengths is None:
            lengths = self._repeats(~self.turns) or DEFAULT_NOISE
        return np.where(self.turns, lengths / LEVER if angles is None else angles, lengths)

    @property
    def noise_known(self) -> bool:
        """See `Observation`; if all rows are angles, their noise suffices."""
        return self.noise_stated or self._repeats(self.turns if self.turns.all() else ~self.turns) is not None

    def _repeats(self, rows: Mask) -> float | None:
        """Standard deviation over repeats among the rows of a mask (n,), mm or rad; None if they are too few."""
        return repeatability(self.measurement, self.components, self.angular, rows)

    @property
    def value_names(self) -> tuple[str, ...]:
        """See `Observation`: the error motion of each row."""
        return self.names

    @property
    def turns(self) -> Mask:
        """See `Observation`: by the component of each row."""
        return np.array([name[1] in "ABC" for name in self.names])

    @cached_property
    def unknowns(self) -> Unknowns:
        """Zero of each series, and slope of each straightness series."""
        if self.measurement.header("setup") == "none":
            return Unknowns.joined([])
        first = [int(np.flatnonzero(self.series_index == k)[0]) for k in range(len(self.series))]
        spread = np.where(self.turns[first], ANGLE, ANGLE * LEVER)
        zero = Unknowns(tuple(f"zero of {name}" for name in self.series), np.zeros(len(first)), spread)
        sloped = [self.series[k] for k in self._sloped]
        slope = Unknowns(
            tuple(f"slope of {name}" for name in sloped), np.zeros(len(sloped)), np.full(len(sloped), ANGLE)
        )
        return Unknowns.joined([zero, slope])

    def predict(self, machine: Machine, unknowns: Array) -> Array:
        """See `Observation`; the errors of one joint act linearly."""
        effects = [effect for effect in machine.effects if effect.active]
        coefficients = np.concatenate([np.zeros(0), *(effect.coefficients for effect in effects)])
        return self.design(effects) @ coefficients + self.unknown_design(unknowns) @ unknowns

    def design(self, effects: Sequence[Effect]) -> Array:
        """See `Observation`."""
        parts = [np.zeros((len(self.measurement), 0)), *(self._columns(effect) for effect in effects)]
        return np.concatenate(parts, axis=1)

    def unknown_design(self, unknowns: Array) -> Array:
        """See `Observation`."""
        if not len(unknowns):
            return np.zeros((len(self.measurement), 0))
        zero = (self.series_index[:, None] == np.arange(len(self.series))).astype(np.float64)
        position = self.q[np.arange(len(self.q)), self.axis_index]
        return np.concatenate([zero, zero[:, self._sloped] * position[:, None]], axis=1)

    @cached_property
    def _sloped(self) -> Ints:
        """Indices of the series that are straightness of a linear axis."""
        linear = {axis.name for axis in self.machine.axes if not axis.rotary}
        names = [(name[:3], name[1] in "XYZ" and name[2] in linear) for name in self.series]
        return np.flatnonzero([shift and not self.machine.is_positioning(name) for name, shift in names])

    def _columns(self, effect: Effect) -> Array:
        """Derivatives (n, k) of the rows by the coefficients of one effect."""
        shares = self._shares(effect)
        if not shares.any():
            return np.zeros((len(self.measurement), effect.basis.size))
        course = dependence_of(self.machine.axes, effect)
        _, poses = flatten(self.q, self.state, self.machine.axes, course.inputs)
        return shares[:, None] * course.rows(with_lags(poses, course.signals)).T

    def _shares(self, effect: Effect) -> Array:
        """Factor (n,) from an effect to each row's component at the measured point."""
        same = np.array([name == effect.name for name in self.names], dtype=np.float64)
        if self.point is None or effect.location or effect.joint not in self.machine.axis_names:
            return same
        joint = self.machine.axis_names.index(effect.joint)
        shares = np.zeros(len(self.names))
        for name in {each for each in self.names if each[2] == effect.joint}:
            rows = np.array([each == name for each in self.names])
            shares[rows] = self._share(effect, name, self.machine.axes[joint], self.q[rows, joint])
        return shares

    def _share(self, effect: Effect, name: str, axis: Axis, position: Array) -> Array:
        component = "XYZABC".index(name[1])
        motion = unit_motion(self.machine.axes, effect)
        along = np.asarray(axis.error_axes[component % 3])
        if component >= 3:
            return np.full(len(position), along @ motion[3:])
        reference = effect.reference if effect.reference is not None else axis.reference
        arm = np.broadcast_to(np.asarray(self.point) - np.asarray(reference), (len(position), 3))
        if axis.rotary and not axis.moving_frame:
            arm = np.einsum("nij,nj->ni", axis.motion(position)[:, :3, :3], arm)
        return (motion[:3] + np.cross(motion[3:], arm)) @ along


# -- figures of ISO 230-2 and 230-3 ------------------------------------------------------------------------------------


@frozen
class Positioning:
    """Figures of ISO 230-2 for one error motion in one set, um, or urad for angles; bidirectional if both sides exist.

    A  accuracy: range of the means plus and minus two standard deviations
    R  repeatability: largest band at one position; NaN with fewer than two runs
    E  systematic positioning deviation: range of all means; M: range of the means of both directions
    B  largest reversal value; mean_reversal: mean over all positions; NaN if one direction only was measured
    A_up, A_down, R_up, ...  the same for approach in plus, or in minus, only; NaN if not measured
    runs  smallest number of runs per position and direction; ISO 230-2 requires five

    Values are errors of the body along the base axes. The body of a table axis moves towards minus as its position
    grows; the sign of its mean reversal is then opposite to that of its own deviations.
    """

    component: str
    name: str
    A: float
    R: float
    E: float
    M: float
    B: float
    mean_reversal: float
    A_up: float
    A_down: float
    R_up: float
    R_down: float
    E_up: float
    E_down: float
    runs: int


def positioning_figures(measurement: Measurement) -> Iterator[Positioning]:
    """The figures of each component and set of a measurement of kind `axis`; none for other kinds."""
    if measurement.kind != "axis" or "value" not in measurement.columns:
        return
    pairs = zip(measurement.labels["axis"], measurement.labels["component"], strict=True)
    names = [component_of(axis, component) or component for axis, component in pairs]
    keys, index = groups([f"{name}\n{group}" for name, group in zip(names, measurement.sets, strict=True)])
    for k, key in enumerate(keys):
        rows = index == k
        component, name = key.split("\n")
        unit = 1e6 if component[1] in "ABC" else 1e3
        value = unit * measurement.columns["value"][rows]
        side = measurement.column("direction")[rows]
        yield _series_figures(component, name, measurement.columns["position"][rows], side, value)


def _series_figures(component: str, name: str, position: Array, side: Array, value: Array) -> Positioning:
    places, index = np.unique(position, return_inverse=True)
    sides = [each for each in (1.0, -1.0) if (side == each).any()] or [0.0]
    mean = np.full((len(sides), len(places)), np.nan)
    sigma = np.full_like(mean, np.nan)
    for i, each in enumerate(sides):
        for j, place in enumerate(places):
            found = value[(side == each) & (position == place)]
            mean[i, j] = found.mean() if len(found) else np.nan
            sigma[i, j] = found.std(ddof=1) if len(found) >= RUNS else np.nan
    reversal = mean[0] - mean[1] if len(sides) == 2 else np.full(len(places), np.nan)
    centre = mean.mean(axis=0)
    alone = {side: _bands(mean[[i]], sigma[[i]], reversal * np.nan) for i, side in enumerate(sides)}
    A, R, E = _bands(mean, sigma, reversal)
    (A_up, R_up, E_up), (A_down, R_down, E_down) = (alone.get(side, (float("nan"),) * 3) for side in (1.0, -1.0))
    return Positioning(
        component,
        name,
        A=A,
        R=R,
        E=E,
        M=float(np.nanmax(centre) - np.nanmin(centre)) if np.isfinite(centre).any() else float("nan"),
        B=float(np.nanmax(np.abs(reversal))) if np.isfinite(reversal).any() else float("nan"),
        mean_reversal=float(np.nanmean(reversal)) if np.isfinite(reversal).any() else float("nan"),
        A_up=A_up,
        A_down=A_down,
        R_up=R_up,
        R_down=R_down,
        E_up=E_up,
        E_down=E_down,
        runs=min(int(np.bincount(index[side == each], minlength=len(places)).min()) for each in sides),
    )


def _bands(mean: Array, sigma: Array, reversal: Array) -> tuple[float, float, float]:
    """Accuracy, repeatability and systematic deviation, from means and standard deviations (sides, positions).

    Repeatability is the largest of 4 s of each direction and of 2 s + 2 s + |B| of both.
    """
    systematic = float(np.nanmax(mean) - np.nanmin(mean))
    if not np.isfinite(sigma).any():
        return float("nan"), float("nan"), systematic
    spread = np.nan_to_num(sigma)
    accuracy = float(np.nanmax(mean + K * spread) - np.nanmin(mean - K * spread))
    bands = [*(2 * K * sigma)]
    if len(sigma) == 2:
        bands.append(K * sigma.sum(axis=0) + np.abs(reversal))
    return accuracy, float(np.nanmax(np.concatenate(bands))), systematic
