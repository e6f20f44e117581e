"""The interface of observation models, by which calibration, plans and simulation see a measurement.

An observation has `values` (m,), the readings: all components of the first row, then of the second, ... `predict`
computes them for a machine and for assumed unknowns of the set-up. `design` and `unknown_design` are its derivatives by
coefficients of effects and by those unknowns. The design matrix `projection(q) . Jacobian(q) . basis(state)` is made by
observations only.

Also here: the tool and workpiece branch of a machine, and the algebra of points and rotations for instruments.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from ncfix.arrays import Array, Ints, Mask
from ncfix.diagnostics import ConfigError, Message
from ncfix.machine import Effect, GaugeLine, Machine, se3
from ncfix.machine.axes import SPINDLE
from ncfix.machine.plausible import reach
from ncfix.measure.measurement import Measurement, groups
from ncfix.values import frozen

LEVER = 100.0
"""Distance, mm, at which the noise of an angle is that of a length, if only the latter is given."""
FREEDOM_LEAST = 10
"""Smallest number of degrees of freedom at which repeats determine the noise (to about a quarter)."""
DEFAULT_NOISE = 1e-3
"""Noise of a length, mm, if neither header nor repeats determine it; only ratios of noises matter then."""
TOOL, WORKPIECE = "tool", "workpiece"


@frozen
class Unknowns:
    """The unknowns of the set-ups of a measurement.

    labels  names of the k unknowns, in words
    start   (k,) first guess, mm or rad
    spread  (k,) standard deviation of the truth from it, for simulated set-ups
    """

    labels: tuple[str, ...]
    start: Array
    spread: Array

    @staticmethod
    def joined(parts: Sequence[Unknowns]) -> Unknowns:
        """Concatenate several sets of unknowns."""
        labels = tuple(label for part in parts for label in part.labels)
        start = np.concatenate([np.zeros(0), *(part.start for part in parts)])
        return Unknowns(labels, start, np.concatenate([np.zeros(0), *(part.spread for part in parts)]))

    @staticmethod
    def vectors(what: str, names: Sequence[str], start: Array | float = 0.0, spread: float = 0.05) -> Unknowns:
        """Unknown vectors x y z, one for each name, labelled `what` + name; start (3,) or (names, 3), as `spread`."""
        labels = tuple(f"{what}{name} {axis}" for name in names for axis in "xyz")
        found = np.broadcast_to(np.asarray(start, dtype=np.float64), (len(names), 3)).reshape(-1)
        return Unknowns(labels, np.array(found), np.full(len(labels), spread))


class Observation(ABC):
    """Observation model of one measurement by one kind of instrument."""

    def __init__(self, measurement: Measurement, machine: Machine) -> None:
        self.measurement = measurement
        self.machine = machine
        self.q = measurement.positions(machine)
        self.state = measurement.state(machine)
        self.set_names, self.set_index = groups(measurement.sets)

    def __getstate__(self) -> dict[str, Any]:
        """The state without what is computed when it is wanted, and would be most of it."""
        state = self.__dict__.items()
        return {
            name: value for name, value in state if not isinstance(getattr(type(self), name, None), cached_property)
        }

    def doubts(self, machine: Machine) -> Iterator[Message]:
        """Remarks on assumptions about the set-up that matter with the errors of this machine."""
        yield from ()

    # -- what was read ------------------------------------------------------------------------------------------------

    @property
    @abstractmethod
    def components(self) -> tuple[str, ...]:
        """The names of the values of one row."""

    @property
    @abstractmethod
    def unknowns(self) -> Unknowns:
        """The unknowns of the set-up."""

    @abstractmethod
    def predict(self, machine: Machine, unknowns: Array) -> Array:
        """The exact readings of the instrument on this machine, (m,), mm or rad; unknowns (k,)."""

    @abstractmethod
    def design(self, effects: Sequence[Effect]) -> Array:
        """Derivative of `predict` by the coefficients of effects at zero error, (m, p)."""

    @abstractmethod
    def unknown_design(self, unknowns: Array) -> Array:
        """Derivative of `predict` by the unknowns, at `unknowns` (k,): (m, k)."""

    @cached_property
    def values(self) -> Array:
        """The readings, (m,), mm or rad; NaN for those still to be measured."""
        rows = np.full((len(self.measurement), len(self.components)), np.nan)
        for index, name in enumerate(self.components):
            if name in self.measurement.columns:
                rows[:, index] = self.measurement.columns[name]
        return np.concatenate([rows.ravel(), self.extra_values])

    @property
    def extra_values(self) -> Array:
        """Values that belong to no row, (e,): calibrated distances, mm."""
        return np.zeros(0)

    @property
    def extra_sigma(self) -> Array:
        """Standard deviations of the extra values, (e,), mm."""
        return np.zeros(0)

    @cached_property
    def rows(self) -> Ints:
        """Index of the row of each value, (m,); -1 for extra values."""
        own = np.repeat(np.arange(len(self.measurement)), len(self.components))
        return np.concatenate([own, np.full(len(self.extra_values), -1)])

    @property
    def angular(self) -> tuple[bool, ...]:
        """For each component, whether it is an angle."""
        return tuple(name in ("rx", "ry", "rz") for name in self.components)

    @property
    def value_names(self) -> tuple[str, ...]:
        """Name of each value of the rows."""
        return self.components * len(self.measurement)

    @property
    def turns(self) -> Mask:
        """Mask of the angles among the values of the rows."""
        return np.tile(np.array(self.angular, dtype=np.bool_), len(self.measurement))

    @property
    def um(self) -> Array:
        """Factor of each value to um, (m,); an angle counts as the displacement at half the machine's reach."""
        turns = np.concatenate([self.turns, np.zeros(len(self.extra_values), dtype=np.bool_)])
        return np.where(turns, 1e3 * max(LEVER, reach(self.machine) / 2), 1e3)

    @cached_property
    def sigma(self) -> Array:
        """Standard deviation of each value, (m,), mm or rad: from the header, else from repeats, else 1 um."""
        lengths, angles = self.measurement.noise
        if lengths is None:
            lengths = self._repeatability or DEFAULT_NOISE
        each = np.where(self.angular, lengths / LEVER if angles is None else angles, lengths)
        return np.concatenate([np.tile(each, len(self.measurement)), self.extra_sigma])

    @property
    def noise_stated(self) -> bool:
        """Whether the header states the noise: of lengths, or of angles if there are only angles."""
        lengths, angles = self.measurement.noise
        return lengths is not None or (angles is not None and bool(self.turns.all()))

    @property
    def noise_known(self) -> bool:
        """Whether the noise is stated or follows from repeats."""
        return self.noise_stated or self._repeatability is not None

    @cached_property
    def _repeatability(self) -> float | None:
        """Repeatability of the lengths, mm; None if repeats are too few; cached."""
        return repeatability(self.measurement, self.components, self.angular)

    def with_values(self, values: Array) -> Measurement:
        """The measurement with these readings (m,); extra values are ignored."""
        rows = values[: len(self.measurement) * len(self.components)].reshape(-1, len(self.components))
        return self.measurement.with_columns(dict(zip(self.components, rows.T, strict=True)))


def repeatability(
    measurement: Measurement, components: tuple[str, ...], angular: tuple[bool, ...], rows: Mask | None = None
) -> float | None:
    """Pooled standard deviation of the non-`angular` components over repeats; None below `FREEDOM_LEAST`.

    Repeats are rows of one set, pose, direction and tool, among `rows` (n,) if given; time and temperatures may differ.
    """
    found = [name for name, turn in zip(components, angular, strict=True) if name in measurement.columns and not turn]
    states = _states(measurement)
    among = np.arange(len(states)) if rows is None else np.flatnonzero(rows)
    if not found or not states or not among.size:
        return None
    _, group = groups([states[row] for row in among])
    counts = np.bincount(group)
    freedom = (counts - 1).clip(0).sum() * len(found)
    if freedom < FREEDOM_LEAST:
        return None
    squares = 0.0
    for name in found:
        values = measurement.columns[name][among]
        mean = np.bincount(group, values) / counts
        squares += float(((values - mean[group]) ** 2).sum())
    return float(np.sqrt(squares / freedom)) or None


def _states(measurement: Measurement) -> list[tuple[str | bytes, ...]]:
    """The state of each row that repeats share; empty for a test of drift, or if only readings were noted."""
    labels = [value for name, value in measurement.labels.items() if name != "repeat"]
    between = (*measurement.measured, "time_s", "run")
    names = [name for name in measurement.columns if name not in between and not name.startswith("temp_")]
    if measurement.stays or not (labels or names):
        return []
    numbers = np.column_stack([np.zeros(len(measurement)), *(measurement.columns[name] for name in names)])
    return list(zip(*labels, map(np.ndarray.tobytes, numbers), strict=True))


# -- geometry ----------------------------------------------------------------------------------------------------------


def vector_columns(index: Ints, count: int, matrices: Array) -> Array:
    """Derivatives (n, r, 3 count) by `count` vectors; row i depends on vector `index[i]` by `matrices[i]` (r, 3)."""
    columns, each = np.zeros((len(index), matrices.shape[1], 3 * count)), np.arange(len(index))
    for k in range(3):
        columns[each, :, 3 * index + k] = matrices[:, :, k]
    return columns


def linear_axes(measurement: Measurement, machine: Machine) -> list[int]:
    """Indices of the axes X, Y, Z; raises `ConfigError` NCF610 if the machine lacks one."""
    names = list(machine.axis_names)
    for axis in "XYZ":
        if axis not in names:
            raise ConfigError.of("NCF610", f"the machine has no axis {axis}", measurement.place(0))
    return [names.index(axis) for axis in "XYZ"]


def base_from_workpiece(machine: Machine, q: Array) -> Array:
    """Nominal rotation base_from_workpiece (n, 3, 3) for poses q (n, n_axes)."""
    turned = np.broadcast_to(np.eye(3), (len(q), 3, 3))
    for index in reversed(range(len(machine.axes))):
        if machine.axes[index].workpiece_side:
            turned = turned @ machine.axes[index].motion(q[:, index])[:, :3, :3]
    return np.array(turned)


def branch(machine: Machine, side: str) -> tuple[Machine, list[int]]:
    """The tool or workpiece branch as a machine of its own, and the indices of its axes.

    Its other end is the foundation: `nominal` of the tool branch is base_from_tool, of the workpiece branch
    workpiece_from_base.
    """
    held = side == WORKPIECE
    keep = [index for index, axis in enumerate(machine.axes) if axis.workpiece_side == held]
    axes = tuple(machine.axes[index] for index in keep)
    joints = {axis.name for axis in axes} | (set() if held else {SPINDLE})
    letters = " ".join(axis.name for axis in axes)
    order = f"w {letters} F t" if held else f"w F {letters} t"
    effects = tuple(effect for effect in machine.effects if effect.joint in joints)
    changes = {"topology": " ".join(order.split()), "axes": axes, "effects": effects}
    tool = GaugeLine() if held else machine.tool
    offset = machine.workpiece_offset if held else (0.0, 0.0, 0.0)
    return machine.replace(**changes, tool=tool, workpiece_offset=offset), keep


def spindle_turn(machine: Machine, angle_deg: Array) -> Array:
    """Rotation (n, 3, 3) of the spindle about the tool direction, by angles (n,) degree."""
    return se3.rotation(np.deg2rad(angle_deg)[:, None] * np.asarray(machine.tool.direction))


def best_rotation(moved: Array, fixed: Array) -> Array:
    """The rotation R (3, 3) that minimizes |moved - R fixed| for vectors (n, 3), by Kabsch."""
    left, _, right = np.linalg.svd(moved.T @ fixed)
    sign = np.sign(np.linalg.det(left @ right))
    return left @ np.diag([1.0, 1.0, sign]) @ right
