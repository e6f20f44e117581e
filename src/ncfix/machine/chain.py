"""The exact kinematic chain of nominal motions and error motions from the tool to the workpiece, many poses at a time.

Each joint moves its body by B = Lc L E M(q + offset) inverse(L), in base coordinates with all axes at zero: M nominal
motion, E error motion, L location errors of the axis line, Lc location errors that carry the body (`carried`). The
tool branch is the product of its joints from the foundation outward, then the spindle; so is the workpiece branch.

The chain carries columns (3, m, n): m points or directions at n poses. `weight`, shape () or (m, 1), is 1 for a point
and 0 for a direction. A pose is carried as four columns, three directions and an origin; a tool tip as one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ncfix import core
from ncfix.arrays import Array
from ncfix.machine import se3
from ncfix.machine.axes import Axis, GaugeLine, Vector
from ncfix.machine.error_model import ErrorModel, Slot, SmallMotionKind
from ncfix.machine.state import Poses
from ncfix.machine.steps import dot
from ncfix.values import frozen

Weight = float | Array

SMALL = 0.08
"""Largest component of a rotation vector, rad, for which the power series is exact."""


def columns(*vectors: Sequence[float]) -> Array:
    """Constant vectors as columns, shape (3, m, 1)."""
    return np.array(vectors, dtype=np.float64).T[:, :, None]


def cross(a: Array, b: Array) -> Array:
    """The vector product along the first dimension, (3, ...) each."""
    ax, ay, az = a
    bx, by, bz = b
    x = ay * bz - az * by
    out = np.empty((3, *x.shape))
    out[0] = x
    np.subtract(az * bx, ax * bz, out=out[1])
    np.subtract(ax * by, ay * bx, out=out[2])
    return out


def advance(axis: Axis, position: Array, moved: Array, weight: Weight = 1.0) -> Array:
    """The columns after the nominal motion M of the axis to `position` (n,), mm or rad."""
    direction = np.asarray(axis.direction)
    if not axis.rotary:
        return moved + direction[:, None, None] * position * weight if np.any(weight) else moved
    if _is_many(moved) and position.shape == moved.shape[2:]:
        from ncfix.core import points

        constants = np.array(axis.direction, dtype=np.float64), np.array(axis.point, dtype=np.float64)
        out = np.empty_like(moved)
        points.advanced(*constants, *turn(position), moved, _weights(moved, weight), out)
        return out
    arm = moved - np.asarray(axis.point)[:, None, None] * weight
    once = cross_with(axis.direction, arm)
    sine, versine = turn(position)
    return moved + sine * once + versine * cross_with(axis.direction, once)


def _is_many(moved: Array) -> bool:
    """Whether the columns are for many poses, so that the compiled core is used."""
    return core.engaged() and moved.shape[2] > 1 and moved.flags.c_contiguous


def _weights(moved: Array, weight: Weight) -> Array:
    """(m,) the weight of each column."""
    found = np.empty(moved.shape[1])
    found[:] = weight if isinstance(weight, float) else weight.reshape(-1)
    return found


def turn(angle: Array) -> tuple[Array, Array]:
    """Sine and versine (1 - cosine) of angles, accurate to about 1e-16; the versine without loss of digits if small.

    Both come from the tangent of half the angle, which numpy can evaluate eight at a time.
    """
    half = np.tan(angle / 2)
    sine: Array = 2 * half / (1 + half * half)
    return sine, half * sine


def cross_with(direction: Sequence[float], arm: Array) -> Array:
    """The vector products of a constant direction, often a base axis, with arms (3, ...)."""
    x, y, z = direction
    out = np.empty_like(arm)
    for place, (first, second) in enumerate(((y, z), (z, x), (x, y))):
        following, last = arm[(place + 2) % 3], arm[(place + 1) % 3]
        if first == 0.0:
            np.multiply(last, -second, out=out[place])
        elif second == 0.0:
            np.multiply(following, first, out=out[place])
        else:
            np.subtract(first * following, second * last, out=out[place])
    return out


@frozen
class SmallMotion:
    """A rigid motion near the identity: a rotation about `center`, then a translation; None: without that part.

    rotation     (3, 1, n) rotation vector, rad
    translation  (3, 1, n) mm
    center       (3, 1, n) mm
    """

    rotation: Array | None
    translation: Array | None
    center: Array

    def forth(self, moved: Array, weight: Weight = 1.0) -> Array:
        """The columns after this motion."""
        if (found := self._compiled(moved, weight, forwards=True)) is not None:
            return found
        if self.rotation is not None:
            moved = _turned(self.rotation, self.center, moved, weight)
        return moved if self.translation is None else moved + self.translation * weight

    def back(self, moved: Array, weight: Weight = 1.0) -> Array:
        """The columns after the inverse of this motion."""
        if (found := self._compiled(moved, weight, forwards=False)) is not None:
            return found
        if self.translation is not None:
            moved = moved - self.translation * weight
        return moved if self.rotation is None else _turned(-self.rotation, self.center, moved, weight)

    def _compiled(self, moved: Array, weight: Weight, forwards: bool) -> Array | None:
        """The columns moved by the compiled core; None unless rotation and translation differ from pose to pose."""
        rotation, translation = self.rotation, self.translation
        if rotation is None or translation is None or not _is_many(moved):
            return None
        if not rotation.shape == translation.shape == (3, 1, moved.shape[2]) or not np.abs(rotation).max() < SMALL:
            return None
        from ncfix.core import points

        center, out = np.broadcast_to(self.center, rotation.shape), np.empty_like(moved)
        r, t, c = (np.ascontiguousarray(each[:, 0]) for each in (rotation, translation, center))
        points.moved_small(r, t, c, not forwards, moved, _weights(moved, weight), out)
        return out


def _turned(vector: Array, center: Array, moved: Array, weight: Weight) -> Array:
    """The columns after a small rotation `vector` about a centre."""
    if vector.size == 3 and center.size == 3 and _is_many(moved):
        from ncfix.core import points

        first, second = (factor.item() for factor in se3.rotation_factors((vector * vector).sum(0)))
        out = np.empty_like(moved)
        points.turned(vector.ravel(), first, second, center.ravel(), moved, _weights(moved, weight), out)
        return out
    return moved + rotated_by(vector, moved - center * weight)


def rotated_by(vector: Array, arm: Array) -> Array:
    """(R - 1) arm: the motion of the end of an arm (3, ...) by a rotation vector (3, ...), without loss of digits."""
    first, second = se3.rotation_factors((vector * vector).sum(0))
    once = cross(vector, arm)
    return first * once + second * cross(vector, once)


def composed(motions: Sequence[tuple[Array, Array]], rotates: bool) -> SmallMotion:
    """One small motion from several about different reference points: (small motion (6, n), reference (3, 1, n)) each.

    Translations, rotation vectors, and the velocities that the rotations cause are summed, and the exponential of the
    sum is the motion. With one reference point it is exactly a rotation about that point and a translation.
    """
    values, center = motions[0]
    translation, rotation = values[:3, None], values[3:, None]
    rest: Array | None = None
    for other, reference in motions[1:]:
        translation = translation + other[:3, None]
        rotation = rotation + other[3:, None]
        moment = cross(reference - center, other[3:, None])
        rest = moment if rest is None else rest + moment
    if not rotates:
        return SmallMotion(None, translation, center)
    if rest is not None:
        translation = translation + _integrated(rotation, rest)
    return SmallMotion(rotation, translation if np.any(translation) else None, center)


def _integrated(vector: Array, velocity: Array) -> Array:
    """The translation of the screw with this rotation vector and velocity of the centre."""
    squared = (vector * vector).sum(0)
    second, third = se3.rotation_factors(squared)[1], se3.screw_factor(squared)
    once = cross(vector, velocity)
    return velocity + second * once + third * cross(vector, once)


FRAME_AXES = columns((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
OF_FRAME = np.array([0.0, 0.0, 0.0, 1.0])[:, None]
"""Weights of the columns of a frame: three directions, which translations do not change, and a point."""


@frozen
class JointModel:
    """A joint with the slots of its small motions, by kind; `rotating`: those with angles. The spindle has no axis."""

    axis: Axis | None
    motion: tuple[Slot, ...] = ()
    location: tuple[Slot, ...] = ()
    carried: tuple[Slot, ...] = ()
    rotating: frozenset[Slot] = frozenset()

    def at(self, position: Array, small: Mapping[Slot, Array]) -> JointPose:
        """The joint at axis positions (n,), mm or rad, with the small motions of these poses."""
        location, offset = self.axis_line(small)
        error = self.together(self.motion, small, position)
        carried = self.together(self.carried, small, None)
        return JointPose(self.axis, position if offset is None else position + offset, error, location, carried)

    def together(
        self, slots: tuple[Slot, ...], small: Mapping[Slot, Array], position: Array | None
    ) -> SmallMotion | None:
        """The small motion of several slots together; `position` (n,): moved along with the axis, None: at zero."""
        if not slots:
            return None
        terms = []
        for slot in slots:
            own, point = small[slot], columns(slot.reference)
            if self.axis is not None and position is not None:
                own = turned_with(self.axis, position, own)
                point = point if lies_on_axis(self.axis, point) else advance(self.axis, position, point)
            terms.append((own, point))
        return composed(terms, any(slot in self.rotating for slot in slots))

    def axis_line(self, small: Mapping[Slot, Array]) -> tuple[SmallMotion | None, Array | None]:
        """The small motion of the axis line, and the zero offset (n,) or (1,): the part along or about the axis."""
        if not self.location or self.axis is None:
            return None, None
        along = slice(3, 6) if self.axis.rotary else slice(0, 3)
        terms, offset = [], np.zeros(1)
        for slot in self.location:
            own, across = dot(self.axis.direction, small[slot][along]), small[slot].copy()
            across[along] -= np.multiply.outer(self.axis.direction, own)
            terms.append((across, columns(slot.reference)))
            offset = offset + self.axis.zero_sense * own
        return composed(terms, any(slot in self.rotating for slot in self.location)), offset


def turned_with(axis: Axis, position: Array, small: Array) -> Array:
    """A small motion (6, n) in base axes, turned with the axis to positions (n,) if its error frame moves with it."""
    if not (axis.moving_frame and axis.rotary):
        return small
    turned = advance(axis, position, np.stack([small[:3], small[3:]], axis=1), weight=0.0)
    return np.concatenate([turned[:, 0], turned[:, 1]])


@frozen
class JointPose:
    """A joint at its positions, with its errors."""

    axis: Axis | None
    position: Array
    error: SmallMotion | None = None
    location: SmallMotion | None = None
    carried: SmallMotion | None = None

    def forth(self, moved: Array, weight: Weight = 1.0) -> Array:
        """The columns after B: points of bodies outward of the joint, from its zero position to the actual one."""
        if self.location is not None:
            moved = self.location.back(moved, weight)
        if self.axis is not None:
            moved = advance(self.axis, self.position, moved, weight)
        for small in (self.error, self.location, self.carried):
            if small is not None:
                moved = small.forth(moved, weight)
        return moved

    def back(self, moved: Array, weight: Weight = 1.0) -> Array:
        """The columns after the inverse of B."""
        for small in (self.carried, self.location, self.error):
            if small is not None:
                moved = small.back(moved, weight)
        if self.axis is not None:
            moved = advance(self.axis, -self.position, moved, weight)
        return moved if self.location is None else self.location.forth(moved, weight)


@frozen
class JointChain:
    """All joints of a machine with their errors.

    joints  in machine order (from the workpiece to the foundation, then to the tool), then the spindle
    """

    joints: tuple[JointModel, ...]

    def at(self, poses: Poses, model: ErrorModel | None) -> tuple[JointPose, ...]:
        """The joints at these poses; without a model, without errors."""
        if model is None:
            nominal = [JointPose(joint.axis, poses.positions[i]) for i, joint in enumerate(self.joints[:-1])]
            return (*nominal, JointPose(None, np.zeros(1)))
        small = model.small_motions(poses)
        moving = [joint.at(poses.positions[i], small) for i, joint in enumerate(self.joints[:-1])]
        return (*moving, self.joints[-1].at(np.zeros(1), small))


def carry(joints: tuple[JointPose, ...], moved: Array, weight: Weight = 1.0) -> Array:
    """The columns carried from the end of the tool branch to the end of the workpiece branch."""
    for joint in reversed(joints):
        if joint.axis is None or not joint.axis.workpiece_side:
            moved = joint.forth(moved, weight)
    for joint in reversed(joints):
        if joint.axis is not None and joint.axis.workpiece_side:
            moved = joint.back(moved, weight)
    return moved


def carried_tips(joints: tuple[JointPose, ...], tool: GaugeLine, lengths: Array, offset: Vector) -> Array:
    """(3, 1, n) the tip of a tool of `lengths` (n,) or (1,), mm, in the frame at `offset` on the workpiece branch."""
    start = np.moveaxis(tool.tip(lengths), -1, 0)[:, None, :]
    return carry(joints, start) - columns(offset)


def carried_frames(joints: tuple[JointPose, ...], tool: GaugeLine, lengths: Array, offset: Vector) -> Array:
    """(3, 4, n) the frame at the tip: the directions of its axes, and its origin as in `carried_tips`."""
    tip = np.moveaxis(tool.tip(lengths), -1, 0)[:, None, :]
    axes = np.broadcast_to(FRAME_AXES, (3, 3, tip.shape[-1]))
    return carry(joints, np.concatenate([axes, tip], axis=1), OF_FRAME) - columns(offset) * OF_FRAME


def build_chain(axes: tuple[Axis, ...], model: ErrorModel) -> JointChain:
    """The joints of the machine, each with its slots."""
    slots = list(dict.fromkeys(slot for group in model.groups for slot in group.slots))
    rotating = frozenset(slot for slot in slots if model.rotates(slot))
    joints = []
    for index, axis in enumerate((*axes, None)):
        own = {sort: tuple(s for s in slots if s.joint == index and s.sort is sort) for sort in SmallMotionKind}
        joints.append(
            JointModel(
                axis, own[SmallMotionKind.MOTION], own[SmallMotionKind.LOCATION], own[SmallMotionKind.CARRIED], rotating
            )
        )
    return JointChain(tuple(joints))


def lies_on_axis(axis: Axis, point: Array) -> bool:
    """Whether the axis is rotary and the point lies on its line."""
    direction = np.asarray(axis.direction)[:, None, None]
    arm = cross(direction, point - np.asarray(axis.point)[:, None, None])
    return axis.rotary and float(np.abs(arm).max()) < 1e-12
