"""The compiled effects of a machine: the small motions of each joint at given poses, their kinks, and bounds of bends.

Effects of the same signal with bases of one family are evaluated together: one table of functions, one matrix product.
Their sums are kept in *slots*: the six components of a small motion of one joint, of one kind, about one reference
point.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from enum import Enum
from functools import cached_property, reduce

import numpy as np

from ncfix.arrays import Array, Mask
from ncfix.machine.axes import BASE_AXES, SPINDLE, Axis, Effect, GaugeLine, Vector
from ncfix.machine.basis import Basis
from ncfix.machine.state import Poses, Signal, inputs_of, middle_of_gap, signal_called
from ncfix.values import frozen


class SmallMotionKind(Enum):
    """The kinds of small motions of a joint."""

    MOTION = "moves the body"
    LOCATION = "moves the axis line"
    CARRIED = "moves the axis line and what it carries"


@frozen
class Slot:
    """A sum of small motions of one joint.

    joint      index of the joint; n_axes: the spindle
    sort       kind of the small motion
    reference  reference point in the base frame with all axes at zero, mm
    """

    joint: int
    sort: SmallMotionKind
    reference: Vector


@frozen
class Dependence:
    """The dependence of an error on the state: functions of one signal, perhaps times a second signal.

    basis           the functions
    signal          the signal that they see; None: constant
    factor          the signal that multiplies them; None: none
    direction_axis  index of the axis whose direction of motion they need; -1: none
    """

    basis: Basis
    signal: Signal | None
    factor: Signal | None
    direction_axis: int

    @property
    def signals(self) -> frozenset[Signal]:
        """The signals on which the error depends."""
        return frozenset(each for each in (self.signal, self.factor) if each is not None)

    @property
    def inputs(self) -> frozenset[str]:
        """The state inputs that must be given."""
        return inputs_of(self.signals)

    def changes_with(self, axes: Sequence[int]) -> bool:
        """Whether the functions depend on the position of any of these axes."""
        return any(axis in axes for signal in self.signals for axis in signal.axes)

    def arguments(self, poses: Poses) -> tuple[Array, Array]:
        """u and the direction of motion (-1, 0, 1) for the basis: (n,), or (1,) if neither varies."""
        u = np.zeros(1) if self.signal is None else self.signal.u(poses, self.basis.domain)
        way = poses.direction[self.direction_axis] if self.direction_axis >= 0 else np.zeros(1)
        shape = np.broadcast_shapes(u.shape, way.shape)
        return np.broadcast_to(u, shape), np.broadcast_to(way, shape)

    def times_factor(self, values: Array, poses: Poses) -> Array:
        """Values (..., n) or (..., 1) at these poses, multiplied by the factor's u if there is a factor."""
        return values if self.factor is None else values * self.factor.u(poses, (-np.inf, np.inf))

    def rows(self, poses: Poses) -> Array:
        """(k, n) the functions at these poses, multiplied by the factor."""
        u, way = self.arguments(poses)
        shape = (poses.positions.shape[1],)
        return self.times_factor(self.basis.rows(np.broadcast_to(u, shape), np.broadcast_to(way, shape)), poses)


@frozen
class EffectGroup(Dependence):
    """Effects that are evaluated together: `gains[s, 6, k] @ basis(u)`, times the factor's u, is added to `slots[s]`.

    The gains give the small motion [x y z a b c] along and about the base axes; if the error frame turns with the axis,
    along and about its directions with this axis at zero.
    """

    slots: tuple[Slot, ...]
    gains: Array


@frozen(slots=False)
class ErrorModel:
    """The compiled effects of a machine."""

    groups: tuple[EffectGroup, ...]

    @cached_property
    def signals(self) -> frozenset[Signal]:
        """All signals on which an effect depends."""
        return frozenset().union(*(group.signals for group in self.groups))

    @property
    def inputs(self) -> frozenset[str]:
        """The state inputs that must be given."""
        return inputs_of(self.signals)

    def small_motions(self, poses: Poses) -> Mapping[Slot, Array]:
        """Slot -> (6, n or 1) its small motion, mm and rad."""
        slots: dict[Slot, Array] = {}
        for group in self.groups:
            sums = group.basis.combine(group.gains.reshape(-1, group.gains.shape[-1]), *group.arguments(poses))
            values = group.times_factor(sums, poses).reshape(len(group.slots), 6, -1)
            for slot, value in zip(group.slots, values, strict=True):
                slots[slot] = slots[slot] + value if slot in slots else value
        return slots

    def rotates(self, slot: Slot) -> bool:
        """Whether any effect in this slot is an angle."""
        return any(group.gains[group.slots.index(slot), 3:].any() for group in self.groups if slot in group.slots)


def compile_effects(axes: tuple[Axis, ...], tool: GaugeLine, effects: Iterable[Effect]) -> ErrorModel:
    """The error model of all effects that are not zero, in groups."""
    together: dict[tuple[object, ...], list[tuple[Effect, Dependence]]] = {}
    for effect in effects:
        if effect.active:
            on = dependence_of(axes, effect)
            together.setdefault((on.signal, on.factor, on.direction_axis, on.basis.family), []).append((effect, on))
    groups = []
    for members in together.values():
        on = members[0][1]
        basis = reduce(lambda basis, member: basis.merged(member[1].basis), members[1:], on.basis)
        slots = tuple(dict.fromkeys(slot_of(axes, tool, effect) for effect, _ in members))
        gains = np.zeros((len(slots), 6, basis.size))
        places = {label: index for index, label in enumerate(basis.labels)}
        for effect, _ in members:
            columns = [places[label] for label in effect.basis.labels]
            unit = unit_motion(axes, effect)
            gains[slots.index(slot_of(axes, tool, effect))][:, columns] += np.outer(unit, effect.coefficients)
        groups.append(EffectGroup(basis, on.signal, on.factor, on.direction_axis, slots, gains))
    return ErrorModel(tuple(groups))


def joint_index(axes: tuple[Axis, ...], effect: Effect) -> int:
    """The index of the effect's joint: that of its axis, or the number of axes for the spindle."""
    names = [axis.name for axis in axes]
    return len(axes) if effect.joint == SPINDLE else names.index(effect.joint)


def slot_of(axes: tuple[Axis, ...], tool: GaugeLine, effect: Effect) -> Slot:
    """The slot of the effect's small motion. A location error of the spindle, which has no axis, moves its body."""
    joint = joint_index(axes, effect)
    default = tool.point if joint == len(axes) else axes[joint].reference
    sort = SmallMotionKind.MOTION
    if effect.location:
        sort = SmallMotionKind.CARRIED if effect.carried or joint == len(axes) else SmallMotionKind.LOCATION
    return Slot(joint, sort, effect.reference if effect.reference is not None else default)


def unit_motion(axes: tuple[Axis, ...], effect: Effect) -> Array:
    """(6,) the small motion [x y z a b c] of an effect of 1 mm or 1 rad, along and about the base axes."""
    joint = joint_index(axes, effect)
    triad = BASE_AXES if joint == len(axes) else axes[joint].error_axes
    unit = np.zeros(6)
    start = 3 if effect.rotational else 0
    unit[start : start + 3] = triad[effect.component % 3]
    return unit


def dependence_of(axes: tuple[Axis, ...], effect: Effect) -> Dependence:
    """The dependence of an effect on the state."""
    return Dependence(effect.basis, *signals_of(axes, effect), direction_axis(axes, effect))


def signals_of(axes: tuple[Axis, ...], effect: Effect) -> tuple[Signal | None, Signal | None]:
    """The signal that the effect's basis sees, and the one that multiplies it."""
    signal = factor = None
    if effect.signal is not None:
        lag = effect.time_constant_s or 0.0
        plain = signal_called(axes, effect.signal)
        low, high = effect.range or (plain.low, plain.high)
        low, high = max(low, plain.low), min(high, plain.high)
        signal = replace(plain, low=low, high=high, center=effect.center, scale=effect.scale, constant_s=lag)
    if effect.times is not None:
        center = effect.center if effect.times_center is None else effect.times_center
        scale = effect.scale if effect.times_scale is None else effect.times_scale
        factor = replace(signal_called(axes, effect.times), center=center, scale=scale)
    return signal, factor


def direction_axis(axes: tuple[Axis, ...], effect: Effect) -> int:
    """Index of the axis whose direction of motion the effect needs: its input if that is an axis, else its joint."""
    names = [axis.name for axis in axes]
    if not effect.basis.needs_direction:
        return -1
    return names.index(effect.input) if effect.input in names else names.index(effect.joint)


UNKNOWN_RANGE = 1000.0
"""Assumed travel of a linear axis without a range, mm."""


def feature_lengths(axes: tuple[Axis, ...], effects: tuple[Effect, ...]) -> Array:
    """See `Machine.feature_lengths`."""
    lengths = np.full(len(axes), np.inf)
    for effect, index, signal, is_factor in _dependencies(axes, effects):
        travel = 360.0 if axes[index].rotary else UNKNOWN_RANGE
        if np.isfinite(signal.low) and np.isfinite(signal.high):
            travel = signal.high - signal.low
        span = travel / abs(signal.scale)
        feature = span / 4 if is_factor else effect.basis.feature(span)
        lengths[index] = min(lengths[index], feature * abs(signal.scale) * signal.unit)
    return lengths


def breakpoints(axes: tuple[Axis, ...], effects: tuple[Effect, ...]) -> tuple[Array, ...]:
    """For each axis, see `Machine.breakpoints`."""
    places = [set[float]() for _ in axes]
    ends = [{limit / axis.unit for limit in axis.range} for axis in axes]
    for effect, index, signal, is_factor in _dependencies(axes, effects):
        held = {signal.low, signal.high} - ends[index]
        kinks = () if is_factor else effect.basis.kinks
        places[index].update(x * signal.unit for x in held if np.isfinite(x))
        places[index].update((signal.center + signal.scale * u) * signal.unit for u in kinks)
        if signal.endless:
            low, high = sorted(signal.center + signal.scale * end for end in effect.basis.domain)
            ranges = [(signal.low, signal.high)] if is_factor else [(signal.low, signal.high), (low, high)]
            jumps = (middle_of_gap(*each) for each in ranges if np.isfinite(each).all())
            places[index].update(jump * signal.unit for jump in jumps)
    return tuple(np.array(sorted(own), dtype=np.float64) for own in places)


def kinks(
    axes: tuple[Axis, ...], effects: tuple[Effect, ...], points: tuple[Array, ...]
) -> tuple[tuple[int, Array], ...]:
    """The axes (columns) with kinks or jumps of their errors, and their positions, ascending, mm and rad.

    These are the breakpoints (`points`, for each axis), and the ends of the domain of a basis, beyond which its end
    values hold.
    """
    places = {axis.name: set(own.tolist()) for axis, own in zip(axes, points, strict=True)}
    units = {axis.name: axis.unit for axis in axes}
    for effect in effects:
        if effect.active and effect.signal in places:
            ends = [end for end in effect.basis.domain if np.isfinite(end)]
            places[effect.signal].update((effect.center + effect.scale * end) * units[effect.signal] for end in ends)
    return tuple((j, np.array(sorted(places[axis.name]))) for j, axis in enumerate(axes) if places[axis.name])


def needs_tool_length(axes: tuple[Axis, ...], effect: Effect) -> bool:
    """Whether the motion of the tip by an effect depends on the tool length.

    Angles depend on it, except the location errors of a linear axis: they change its direction, and shift its body
    without turning it.
    """
    if "tool_length" in (effect.input, effect.times):
        return True
    if effect.joint == SPINDLE:
        return effect.rotational
    axis = next(each for each in axes if each.name == effect.joint)
    return effect.rotational and (axis.rotary or effect.carried or not effect.location)


def _dependencies(axes: tuple[Axis, ...], effects: tuple[Effect, ...]) -> Iterator[tuple[Effect, int, Signal, bool]]:
    """(effect, axis, signal, whether it is the factor) for every axis on whose position an effect depends."""
    for effect in effects:
        if effect.active:
            for signal, is_factor in zip(signals_of(axes, effect), (False, True), strict=True):
                for axis in () if signal is None else signal.axes:
                    assert signal is not None
                    yield effect, axis, signal, is_factor


MORE = 1.1
"""Safety factor of bounds, for products of errors."""
TWICE = 2.0
"""Number of times that a location error acts: before the motion of its axis and, inversely, behind it."""


@frozen
class DeviationBounds:
    """Bounds of the small motions of a machine, and of how far the tip error leaves its chord on straight motions.

    Along a motion the tip error is the sum over all joints of Q (t + r x a): t and r the small motion of the joint, a
    the arm from its reference point to the tip, Q the rotation from there to the workpiece. The second derivative of a
    product is bounded by the derivatives of its factors, so the second derivative of the error is bounded by the ways
    of the axes. A curve with a second derivative of at most b leaves its chord by at most b / 8. Linear axes that do
    not move evenly are temporarily faster, by at most their acceleration; the acceleration also bends the error in
    proportion to its slopes. Products of errors are parts in ten thousand of errors, and are covered by `MORE`.

    shift, turn  bound of the sum of all translations, mm, and of all rotations, rad
    slopes       (2, n_axes) bound of the derivatives of translations and rotations by each axis, per mm or rad
    curvatures   (2, n_axes) bound of their second derivatives, per mm or rad squared
    reach        largest distance, mm, of a reference point from the tip with all axes at zero and no tool
    """

    shift: float
    turn: float
    slopes: Array
    curvatures: Array
    reach: float

    def arm(self, farthest: Array, tool_length: float, rotary: Mask) -> float:
        """Largest distance of the tip from any reference point, mm; arguments as in `of`."""
        return self.reach + abs(tool_length) + float(farthest[~rotary].sum())

    def of(
        self,
        ways: Array,
        farthest: Array,
        tool_length: float,
        rotary: Mask,
        acceleration: Array | None = None,
    ) -> tuple[Array, Array]:
        """(k,) bound of how far the tip error leaves its chord, mm, and (k,) the angles turned, rad.

        ways          (k, n_axes) ways of the axes in the motions, not negative, mm and rad
        farthest      (n_axes,) largest distance of the axes from zero in them, mm and rad
        tool_length   the largest tool length, mm
        acceleration  (k,) bound of the acceleration of each linear axis, mm per motion squared; None: axes move evenly
        """
        arm: Array | float = self.arm(farthest, tool_length, rotary)
        bent: Array | float = 0.0
        if acceleration is not None:
            linear = ~rotary
            ways = ways + np.where(linear, acceleration[:, None], 0.0)
            arm = arm + linear.sum() * acceleration / 8
            bent = acceleration * ((self.slopes[0] + self.turn)[linear].sum() + arm * self.slopes[1, linear].sum())
        way, angle = ways[:, ~rotary].sum(axis=1), ways[:, rotary].sum(axis=1)
        shifting, turning = ways @ self.slopes.T[:, 0], ways @ self.slopes.T[:, 1]
        swing = way + arm * angle
        first = shifting + arm * turning + self.turn * swing
        second = (ways * ways) @ self.curvatures[0] + arm * ((ways * ways) @ self.curvatures[1])
        second += 2 * turning * swing + self.turn * (2 * way * angle + arm * angle * angle)
        whole = second + 2 * first * angle + (self.shift + arm * self.turn) * angle * angle
        bow: Array = MORE * (whole + bent) / 8
        return bow, angle


def bow_of(axes: tuple[Axis, ...], tool: GaugeLine, effects: tuple[Effect, ...]) -> DeviationBounds | None:
    """The bounds of a machine; None if an effect has no bounds, depends on several signals, or acts with a lag."""
    sizes, slopes, curvatures = np.zeros(2), np.zeros((2, len(axes))), np.zeros((2, len(axes)))
    for effect in effects:
        if not effect.active:
            continue
        signal, factor = signals_of(axes, effect)
        span = (0.0, 0.0) if signal is None else (signal.low, signal.high)
        ends = sorted((x - effect.center) / effect.scale for x in span) if signal is not None else span
        bounds = effect.basis.bounds(effect.coefficients, *ends)
        if bounds is None or factor is not None or (signal is not None and (signal.constant_s or signal.summed)):
            return None
        kind, double = int(effect.rotational), TWICE if effect.location else 1.0
        sizes[kind] += double * bounds[0]
        if signal is not None and signal.axis is not None:
            if effect.location:
                return None
            rate = 1 / abs(signal.scale * signal.unit)
            slopes[kind, signal.axis] += bounds[1] * rate
            curvatures[kind, signal.axis] += bounds[2] * rate * rate
    return DeviationBounds(float(sizes[0]), float(sizes[1]), slopes, curvatures, _reach(axes, tool, effects))


def _reach(axes: tuple[Axis, ...], tool: GaugeLine, effects: tuple[Effect, ...]) -> float:
    """`DeviationBounds.reach`: the way from a reference point over the rotary axes between it and the tool.

    A rotary axis does not change the distance of the following points from itself.
    """
    slots = {slot_of(axes, tool, effect) for effect in effects if effect.active}
    ways = [[slot.reference, *(axis.point for axis in axes[slot.joint :] if axis.rotary), tool.point] for slot in slots]
    return max((sum(float(np.linalg.norm(step)) for step in np.diff(way, axis=0)) for way in ways), default=0.0)
