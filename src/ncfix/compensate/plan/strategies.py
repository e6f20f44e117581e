"""Strategies: ways to find the commands with which the erroneous machine does what the program means.

Each takes axis positions and returns corrected axis positions, many poses at a time, by the exact forward model of the
machine; each says which error it leaves. A strategy is stateless. `solve` tells for each pose whether it succeeded,
`correct` raises if it did not.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from ncfix.arrays import Array, Index, Mask
from ncfix.compensate.plan.findings import pose_error
from ncfix.compensate.plan.kinematics import (
    Correction,
    affine_tip,
    linear_columns,
    regular,
    rows_of,
    solve,
    steer,
    steered,
)
from ncfix.diagnostics import UsageError
from ncfix.machine import Axis, Effect, Machine, State
from ncfix.values import frozen

APART = 1.0
"""Allowed change, rad, of a rotary correction between separate stretches: above any correction, so no limit."""


@frozen
class PoseSequence:
    """The order and the distances of poses along a path, for limits on the rate of corrections.

    travel_mm   (n,) way of the tool tip in the workpiece from the pose before, mm
    travel_rad  (n,) way of the rotary axes from the pose before, rad
    begins      (n,) the pose begins a new stretch: the pose before puts no limit on it
    pinned      (n,) the correction of this pose is given by `decided`
    decided     (n, n_rotary) given rotary corrections of pinned poses, rad
    """

    travel_mm: Array
    travel_rad: Array
    begins: Mask
    pinned: Mask
    decided: Array

    def rows(self, rows: Index) -> PoseSequence:
        """The poses `rows`. Behind poses that are left out a new stretch begins."""
        begins = self.begins[rows].copy()
        begins[1:] |= np.diff(rows) != 1
        return PoseSequence(self.travel_mm[rows], self.travel_rad[rows], begins, self.pinned[rows], self.decided[rows])

    def allowance(self, per_mm: float, per_rad: float) -> Array:
        """(n,) largest change of a rotary correction since the first pose, rad, never descending.

        per_mm, per_rad  allowed change per way of the tip, rad/mm, and of the rotary axes, rad/rad
        """
        step = per_mm * self.travel_mm + per_rad * self.travel_rad
        return np.cumsum(np.where(self.begins, APART, step))


def limited(correction: Array, path: PoseSequence, per_mm: float, per_rad: float) -> Array:
    """Rotary corrections (n, k), rad, close to the given ones, that change no faster along the path than allowed.

    They are the mean of the largest function below and the smallest function above the given values that keep the rate
    (McShane's extensions), so values that keep the rate are unchanged. Pinned values are met exactly if they keep the
    rate among themselves.
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


class Strategy(ABC):
    """A way to correct poses.

    name                  its name in `--strategy`
    leaves                the error that it leaves, in one sentence
    corrects_orientation  the rotary axes are corrected too
    follows_path          motions may be split to keep the path between their ends
    """

    name: ClassVar[str]
    leaves: ClassVar[str]
    corrects_orientation: ClassVar[bool] = False
    follows_path: ClassVar[bool] = True

    @abstractmethod
    def solve(self, machine: Machine, q: Array, state: State, path: PoseSequence | None = None) -> Correction:
        """Corrected axis positions for poses q (n, n_axes), mm and rad, of a perfect machine.

        path   order and distances of the poses along the path, for strategies that limit rates
        state  tool length, direction and inputs; broadcast over the poses
        """

    def correct(self, machine: Machine, q: Array, state: State) -> Array:
        """Corrected axis positions (n, n_axes) such that the erroneous machine does what a perfect one does at q.

        Raises `PoseError` NCF403 if a pose cannot be corrected, `RefusedError` NCF401 if the machine cannot be.
        """
        correction = self.solve(machine, q, state)
        if not correction.converged.all():
            text = f"no command was found that moves the tool tip to its intended position (strategy {self.name})"
            raise pose_error("NCF403", text, ~correction.converged, "check the error model for a jump at this position")
        return correction.q


class PositionStrategy(Strategy):
    """Brings the tool tip to its exact place by Newton's method on the whole model; rotary axes keep their values."""

    name = "position"
    leaves = "The tool direction is not corrected; rotary axes keep their values."

    def solve(self, machine: Machine, q: Array, state: State, path: PoseSequence | None = None) -> Correction:
        """See `Strategy.solve`."""
        return untouched(q) if machine.is_perfect else steered(machine, q, None, state)


class RotaryThenLinear(PositionStrategy):
    """Ellingsdalen's order: the error of the rotary axes first, then that of the linear axes at the place so found.

    S. H. Ellingsdalen (NTNU, 2021), sections 3.5 and 3.6, with corrected signs, and iterated. A single pass moves X Y Z
    so that a machine with rotary errors only brings the tip to the intended point, and then subtracts the errors of all
    other joints at this place. Further passes subtract the error that the whole machine still leaves, until it is below
    1 nm. The linear errors are then those at the commanded coordinates, and products of rotary and linear errors are
    included. The result does not depend on the first pass, so the iteration begins at the program's position, as in
    `PositionStrategy`. It works on any chain, with rotary axes on either side.
    """

    name = "rotary-then-linear"


def untouched(q: Array) -> Correction:
    """The correction that leaves the poses as they are."""
    return Correction(q.copy(), np.isfinite(q.sum(axis=1)), np.ones(len(q), dtype=bool))


def strategies() -> dict[str, Strategy]:
    """All strategies by name, in the order in which the command line lists them."""

    found: tuple[Strategy, ...] = (RotaryThenLinear(), Full(), PositionStrategy(), Thesis())
    return {strategy.name: strategy for strategy in found}


def get_strategy(name: str) -> Strategy:
    """The strategy `name`. Raises `UsageError` NCF411 if there is none."""
    found = strategies()
    if name not in found:
        raise UsageError.of("NCF411", f"there is no strategy {name!r}", hint=f"one of {', '.join(found)}")
    return found[name]


SETTLED = 1e-9
"""Change of a rotary correction between passes, rad, below which it has converged. 1e-9 rad is 1 nm at 1 m."""
PASSES = 12
CONE = 0.02
"""Singular value, rad of tilt per rad of a rotary axis, below which a correction is always damped: about 1 degree from
the pole."""
GAIN = 1.2
"""Just above 2 / sqrt(3), the largest correction per error times the bound (at a singular value of bound / sqrt(3))."""


class Full(Strategy):
    """Corrects the position exactly, and the tool direction by least squares, damped and limited in size and rate.

    most      largest correction of a rotary axis, rad; None: the machine's `max_correction`
    per_mm    largest change of a rotary correction per way of the tip, rad/mm
    per_rad   the same per way of the rotary axes, rad/rad

    A correction never takes a rotary axis beyond its travel if the program stays within; the tip is right all the same.

    Near a pose in which a rotary axis turns the tool about itself, a small tilt needs a large turn of that axis. There
    its correction is damped (Nakamura and Hanafusa 1986: the damping grows as the smallest singular value falls below a
    bound), so that it vanishes at the pole and never exceeds the limit.
    """

    name = "full"
    leaves = (
        "The rotation of the tool about its own axis is not corrected. The tool direction is not or only partly "
        "corrected near poses in which a rotary axis turns the tool about its own axis, and where corrections would "
        "be too large or too fast."
    )
    corrects_orientation = True

    def __init__(self, most: float | None = None, per_mm: float = 5e-5, per_rad: float = 0.02) -> None:
        self.most = most
        self.per_mm = per_mm
        self.per_rad = per_rad

    def solve(self, machine: Machine, q: Array, state: State, path: PoseSequence | None = None) -> Correction:
        """See `Strategy.solve`. Rates are limited only if `path` is given."""
        if machine.is_perfect:
            return untouched(q)
        known = np.isfinite(q.sum(axis=1)) & np.isfinite(machine.tip(q, state.tool_length).sum(axis=1))
        if not known.all():
            return self._known_only(machine, q, state, path, known)
        most = machine.max_correction[1] if self.most is None else self.most
        corrected, free = self._tilted(machine, q, state, most)
        rotary = machine.rotary
        wanted = corrected[:, rotary] - q[:, rotary]
        held = wanted if path is None or not rotary.any() else limited(wanted, path, self.per_mm, self.per_rad)
        corrected[:, rotary] = _within_travel(machine, q[:, rotary], held)
        free &= (np.abs(corrected[:, rotary] - q[:, rotary] - wanted) < SETTLED).all(axis=1)
        target = machine.tip(q, state.tool_length)
        corrected, arrived = steer(machine, corrected, target, state)
        return Correction(corrected, arrived, free)

    def _known_only(
        self, machine: Machine, q: Array, state: State, path: PoseSequence | None, known: Mask
    ) -> Correction:
        """Solve for the `known` poses (n,). The others, which have NaN, stay as they are and divide the path."""
        rows = np.flatnonzero(known)
        rest = None if path is None else path.rows(rows)
        result = self.solve(machine, q[rows], rows_of(state, rows), rest)
        corrected, converged, oriented = q.copy(), known.copy(), known.copy()
        corrected[rows], converged[rows], oriented[rows] = result.q, result.converged, result.oriented
        return Correction(corrected, converged, oriented)

    def _tilted(self, machine: Machine, q: Array, state: State, most: float) -> tuple[Array, Mask]:
        """Positions with corrected rotary axes and nearly corrected X Y Z, and (n,) poses whose correction is undamped.

        Every pass takes the damped step from the error that remains without any rotary correction, because repeated
        damped steps would add up to an undamped one.
        """
        rotary, columns = machine.rotary, linear_columns(machine)
        corrected, free = q.copy(), np.zeros(len(q), dtype=bool)
        if not rotary.any():
            return corrected, free
        pose = machine.nominal(q, state.tool_length)
        jacobian = machine.jacobians(q, state.tool_length).axes
        across = _across(pose, machine)
        tilts, swings = across @ jacobian[:, 3:, rotary], jacobian[:, :3, rotary]
        maps = regular(jacobian[:, :3, columns])[0]
        turn = np.zeros((len(q), int(rotary.sum())))
        for _ in range(PASSES):
            actual = machine.actual(corrected, state)
            error = apply(across, small_turn(actual, pose)) - apply(tilts, turn)
            before, (turn, free) = turn, damped(tilts, error, most)
            corrected[:, rotary] = q[:, rotary] + turn
            gap = actual[:, :3, 3] - pose[:, :3, 3] + apply(swings, turn - before)
            corrected[:, columns] -= solve(maps, gap)
            if np.max(np.abs(turn - before), initial=0.0) < SETTLED:
                break
        return corrected, free


def _within_travel(machine: Machine, q: Array, turn: Array) -> Array:
    """(n, n_rotary) corrected rotary positions, rad, clipped to the travel, or to the position q if it is beyond."""
    low, high = machine.ranges[machine.rotary].T
    return np.clip(q + turn, np.minimum(low, q), np.maximum(high, q))


def apply(matrices: Array, vectors: Array) -> Array:
    """Matrices (n, i, j) times vectors (n, j)."""
    return (matrices @ vectors[..., None])[..., 0]


def damped(tilts: Array, error: Array, most: float) -> tuple[Array, Mask]:
    """Rotary corrections that remove a tilt of the tool, by damped least squares.

    tilts  (n, 2, k) tilt of the tool per turn of each rotary axis, rad/rad
    error  (n, 2) tilt to remove, rad
    most   largest correction of a rotary axis, rad

    Returns the corrections (n, k), rad, and (n,) whether they are undamped.
    """
    squares, ways = np.linalg.eigh(np.swapaxes(tilts, 1, 2) @ tilts)
    size = np.sqrt(np.einsum("ij,ij->i", error, error))
    bound = np.maximum(CONE, GAIN * size / most)[:, None]
    values = np.sqrt(np.maximum(squares, 0.0))
    damping = np.where(values < bound, (bound**2 - values**2) / 4, 0.0)
    possible = np.arange(values.shape[1]) >= values.shape[1] - tilts.shape[1]
    weight = np.where(possible, 1.0, 0.0) / np.maximum(squares + damping, 1e-300)
    along = np.einsum("nji,nj->ni", ways, np.einsum("nij,ni->nj", tilts, error))
    turn = -np.einsum("nij,nj->ni", ways, weight * along)
    return turn, ((damping == 0) | ~possible).all(axis=1)


def _across(nominal: Array, machine: Machine) -> Array:
    """Two directions across the tool in the workpiece frame, as rows, (n, 2, 3)."""
    tool = np.asarray(machine.tool.direction)
    first = np.cross(tool, np.eye(3)[np.argmin(np.abs(tool))])
    first /= np.linalg.norm(first)
    pair = np.stack([first, np.cross(tool, first)])
    return pair @ np.swapaxes(nominal[:, :3, :3], 1, 2)


def small_turn(actual: Array, nominal: Array) -> Array:
    """The small rotation from nominal to actual in the workpiece frame, (n, 3) rad, to third order."""
    relative = actual[:, :3, :3] @ np.swapaxes(nominal[:, :3, :3], 1, 2)
    return 0.5 * np.stack(
        [
            relative[:, 2, 1] - relative[:, 1, 2],
            relative[:, 0, 2] - relative[:, 2, 0],
            relative[:, 1, 0] - relative[:, 0, 1],
        ],
        axis=1,
    )


class Thesis(Strategy):
    """Ellingsdalen's compensation as printed, to reproduce its numbers: one pass, points only.

    For linear axes on the tool side and rotary axes under the workpiece. S. H. Ellingsdalen, "Improving the Accuracy of
    a Five-Axis Machine Tool by Laser Tracker Calibration" (NTNU, 2021), sections 3.5 and 3.6 and listings 3.3 and 3.4.
    It differs from a sound correction on purpose:

    - errors are read at the nearest whole millimetre or degree (halves to even), minus their value at zero;
    - angular error motions of linear axes have no effect, and the only location errors are the squarenesses of Y and Z
      with X as datum;
    - errors of the rotary axes act in base axes about the base origin, in whatever frame they were identified;
    - the listing reads the positioning error E_C. of a rotary axis from the file of E_B., and turns about Y the wrong
      way;
    - the first point is never touched, arcs are not done, nothing is repeated and nothing rounded.
    """

    name = "thesis"
    leaves = (
        "This strategy reproduces printed numbers and is not for machining. It does not correct angular errors of "
        "linear axes, the tool direction, errors between points, and the part of the error that rounding to whole "
        "millimetres and degrees misses."
    )
    follows_path = False

    def solve(self, machine: Machine, q: Array, state: State, path: PoseSequence | None = None) -> Correction:
        """See `Strategy.solve`. Raises `UsageError` NCF412 for machines of another kind."""
        if any(axis.workpiece_side is not axis.rotary for axis in machine.axes):
            raise UsageError.of(
                "NCF412",
                "the thesis' procedure is for linear axes on the tool side and rotary axes under the workpiece",
                hint="use `--strategy rotary-then-linear`, the same principle for any machine",
            )
        still = np.where(machine.rotary, 0.0, q)
        point = machine.tip(still, state.tool_length) + np.asarray(machine.workpiece_offset)
        errors = [motion_errors(machine, axis, q) for axis in reversed(machine.axes) if axis.rotary]
        rotary = rotary_shift(errors, point)
        axes_from_base = affine_tip(machine, still[:1])[0]
        shifted = q.copy()
        shifted[:, linear_columns(machine)] += solve(axes_from_base, rotary)
        corrected = shifted.copy()
        corrected[:, linear_columns(machine)] -= solve(axes_from_base, linear_deviation(machine, shifted))
        corrected[:1] = q[:1]
        return Correction(corrected, np.isfinite(corrected.sum(axis=1)), np.zeros(len(q), dtype=bool))


def motion_errors(machine: Machine, axis: Axis, q: Array) -> Array:
    """(n, 6) error motions of an axis at the nearest whole millimetre or degree, minus those at zero, mm and rad."""
    position = np.rint(q[:, machine.axis_names.index(axis.name)] / axis.unit)
    errors = np.zeros((len(q), 6))
    for effect in machine.effects:
        if effect.joint == axis.name and not effect.location:
            errors[:, effect.component] += _value(effect, position) - _value(effect, np.zeros(1))
    return errors


def linear_deviation(machine: Machine, q: Array) -> Array:
    """(n, 3) tip error by the translations of the linear axes and the squarenesses of Y and Z, mm, in base axes."""
    linear = [axis for axis in machine.axes if not axis.rotary]
    total: Array = sum((motion_errors(machine, axis, q)[:, :3] for axis in linear), np.zeros((len(q), 3)))
    x_y, x_z, y_z = (squareness(machine, name) for name in ("EC0Y", "EB0Z", "EA0Z"))
    _, y, z = linear_columns(machine)
    total[:, 0] += -x_y * q[:, y] + x_z * q[:, z]
    total[:, 1] -= y_z * q[:, z]
    return total


def squareness(machine: Machine, name: str) -> float:
    """Squareness (ISO 230-1 location error) `name`, rad; 0 if the machine does not define it."""
    return sum(sum(effect.coefficients) for effect in machine.effects if effect.name == name)


def rotary_shift(errors: list[Array], point: Array, as_printed: bool = True) -> Array:
    """(n, 3) the shift of X Y Z for the errors of the rotary axes: actual minus ideal point, mm.

    errors      for each rotary axis (n, 6) error motions, mm and rad, from the foundation to the workpiece
    point       (n, 3) ideal point in the base frame, mm
    as_printed  with the two slips of listing 3.3 (E_C. read from E_B.'s file, the wrong sense about Y)
    """
    actual = point
    for each in reversed(errors):
        actual = actual + each[:, :3]
    for each in reversed(errors):
        a, b, c = each[:, 3], each[:, 4], each[:, 5]
        actual = _about(actual, 2, b if as_printed else c)
        actual = _about(actual, 1, -b if as_printed else b)
        actual = _about(actual, 0, a)
    return actual - point


def _about(points: Array, axis: int, angle: Array) -> Array:
    """(n, 3) points turned about base axis 0, 1 or 2 (x, y, z) by angles (n,), rad, right-handed."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turned = points.copy()
    turned[:, first] = np.cos(angle) * points[:, first] - np.sin(angle) * points[:, second]
    turned[:, second] = np.sin(angle) * points[:, first] + np.cos(angle) * points[:, second]
    return turned


def _value(effect: Effect, position: Array) -> Array:
    """(n,) value of an effect at axis positions (n,), mm or degrees."""
    return effect.basis.design((position - effect.center) / effect.scale) @ np.asarray(effect.coefficients)
