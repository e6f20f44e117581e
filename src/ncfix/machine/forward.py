"""What the machine does with axis positions: the exact chain of nominal motions and error motions, out to the tip.

Each joint moves its body by B = Lc L E M(q + offset) inverse(L), in base coordinates with all axes at zero: M nominal
motion, E error motion, L location errors of the axis line, Lc location errors that carry the body (`carried`). The
tool branch is the product of its joints from the foundation outward, then the spindle; so is the workpiece branch.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ncfix.machine.axis import Axis, Tool, Vector
from ncfix.machine.error_model import ErrorModel, Slot, Sort
from ncfix.machine.se3 import Array
from ncfix.machine.state import Poses
from ncfix.machine.transport import SmallMotion, Weight, advance, columns, composed, cross, dot

BASE_AXES = columns((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
OF_FRAME = np.array([0.0, 0.0, 0.0, 1.0])[:, None]
"""Weights of the columns of a frame: three directions, which translations leave alone, and a point."""


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint with the slots of its small motions; the spindle has no axis."""

    axis: Axis | None
    motion: tuple[Slot, ...] = ()
    location: tuple[Slot, ...] = ()
    carried: tuple[Slot, ...] = ()
    rotating: frozenset[Slot] = frozenset()

    def at(self, position: Array, small: Mapping[Slot, Array]) -> JointPose:
        """The joint at a position (n,), with the small motions worked out for these poses."""
        location, offset = self.axis_line(small)
        error = self.together(self.motion, small, position)
        carried = self.together(self.carried, small, None)
        return JointPose(self.axis, position if offset is None else position + offset, error, location, carried)

    def together(
        self, slots: tuple[Slot, ...], small: Mapping[Slot, Array], position: Array | None
    ) -> SmallMotion | None:
        """The small motion that slots make together at positions (n,); None: with the axis at zero."""
        if not slots:
            return None
        terms = [(self._turned(small[slot], position), self._carried_along(slot, position)) for slot in slots]
        return composed(terms, any(slot in self.rotating for slot in slots))

    def _carried_along(self, slot: Slot, position: Array | None) -> Array:
        """The reference point, where the joint's nominal motion has carried it."""
        point = columns(slot.reference)
        if self.axis is None or position is None or lies_on_axis(self.axis, point):
            return point
        return advance(self.axis, position, point)

    def _turned(self, small: Array, position: Array | None) -> Array:
        """A small motion in base axes, where the error frame turns with the joint."""
        if self.axis is None or position is None or not (self.axis.moving_frame and self.axis.rotary):
            return small
        pair = np.stack([small[:3], small[3:]], axis=1)
        turned = advance(self.axis, position, pair, weight=0.0)
        return np.concatenate([turned[:, 0], turned[:, 1]])

    def axis_line(self, small: Mapping[Slot, Array]) -> tuple[SmallMotion | None, Array | None]:
        """The motion of the axis line, and the zero offset: the component along or about the axis itself."""
        if not self.location or self.axis is None:
            return None, None
        along, terms = self._along, []
        for slot in self.location:
            across = small[slot].copy()
            across[along] -= np.multiply.outer(self.axis.direction, dot(self.axis.direction, small[slot][along]))
            terms.append((across, columns(slot.reference)))
        return composed(terms, any(slot in self.rotating for slot in self.location)), self.zero_offset(small)

    @property
    def _along(self) -> slice:
        """The components of a small motion of which one is along or about the axis."""
        return slice(3, 6) if self.axis is not None and self.axis.rotary else slice(0, 3)

    def zero_offset(self, small: Mapping[Slot, Array]) -> Array | None:
        """What location errors along or about the axis add to its position, (n,) or (1,); None without any."""
        if not self.location or self.axis is None:
            return None
        offset = np.zeros(1)
        for slot in self.location:
            offset = offset + self.axis.zero_sense * dot(self.axis.direction, small[slot][self._along])
        return offset


@dataclass(frozen=True, slots=True)
class JointPose:
    """A joint at its positions, with its errors."""

    axis: Axis | None
    position: Array
    error: SmallMotion | None = None
    location: SmallMotion | None = None
    carried: SmallMotion | None = None

    def forth(self, moved: Array, weight: Weight = 1.0) -> Array:
        """Carry outward bodies' points by B: from the joint's zero position to where it really is."""
        if self.location is not None:
            moved = self.location.back(moved, weight)
        if self.axis is not None:
            moved = advance(self.axis, self.position, moved, weight)
        for small in (self.error, self.location, self.carried):
            if small is not None:
                moved = small.forth(moved, weight)
        return moved

    def back(self, moved: Array, weight: Weight = 1.0) -> Array:
        """Carry by the inverse of B."""
        for small in (self.carried, self.location, self.error):
            if small is not None:
                moved = small.back(moved, weight)
        if self.axis is not None:
            moved = advance(self.axis, -self.position, moved, weight)
        return moved if self.location is None else self.location.forth(moved, weight)


@dataclass(frozen=True, slots=True)
class Chain:
    """The joints from the tool back to the foundation, then out to the workpiece; all of them with their errors.

    joints  in machine order (workpiece side from the workpiece to the foundation, then tool side), then the spindle
    """

    joints: tuple[Joint, ...]

    def at(self, poses: Poses, model: ErrorModel | None) -> tuple[JointPose, ...]:
        """The joints at these poses; without a model the nominal ones."""
        if model is None:
            nominal = [JointPose(joint.axis, poses.positions[i]) for i, joint in enumerate(self.joints[:-1])]
            return (*nominal, JointPose(None, np.zeros(1)))
        small = model.small_motions(poses)
        moving = [joint.at(poses.positions[i], small) for i, joint in enumerate(self.joints[:-1])]
        return (*moving, self.joints[-1].at(np.zeros(1), small))


def carry(joints: tuple[JointPose, ...], moved: Array, weight: Weight = 1.0) -> Array:
    """From the end of the tool branch to the end of the workpiece branch."""
    for joint in reversed(joints):
        if joint.axis is None or not joint.axis.workpiece_side:
            moved = joint.forth(moved, weight)
    for joint in reversed(joints):
        if joint.axis is not None and joint.axis.workpiece_side:
            moved = joint.back(moved, weight)
    return moved


def carried_tips(joints: tuple[JointPose, ...], tool: Tool, lengths: Array, offset: Vector) -> Array:
    """The tip of a tool of `lengths` (n,) or (1,), (3, 1, n) mm, in the frame at `offset` on the workpiece branch."""
    start = np.moveaxis(tool.tip(lengths), -1, 0)[:, None, :]
    tip: Array = carry(joints, start) - columns(offset)
    return tip


def carried_frames(joints: tuple[JointPose, ...], tool: Tool, lengths: Array, offset: Vector) -> Array:
    """The frame at the tip, as `carried_tips`: the directions of its axes, and where it is, (3, 4, n)."""
    tip = np.moveaxis(tool.tip(lengths), -1, 0)[:, None, :]
    axes = np.broadcast_to(BASE_AXES, (3, 3, tip.shape[-1]))
    frame: Array = carry(joints, np.concatenate([axes, tip], axis=1), OF_FRAME) - columns(offset) * OF_FRAME
    return frame


def build_chain(axes: tuple[Axis, ...], model: ErrorModel) -> Chain:
    """The joints of the machine and the slots that each of them has."""
    slots = list(dict.fromkeys(slot for group in model.groups for slot in group.slots))
    rotating = frozenset(slot for slot in slots if model.rotates(slot))
    joints = []
    for index, axis in enumerate((*axes, None)):
        own = {sort: tuple(s for s in slots if s.joint == index and s.sort is sort) for sort in Sort}
        joints.append(Joint(axis, own[Sort.MOTION], own[Sort.LOCATION], own[Sort.CARRIED], rotating))
    return Chain(tuple(joints))


def lies_on_axis(axis: Axis, point: Array) -> bool:
    """Whether the axis, as a rotary one, leaves the point where it is."""
    direction = np.asarray(axis.direction)[:, None, None]
    arm = cross(direction, point - np.asarray(axis.point)[:, None, None])
    return axis.rotary and float(np.abs(arm).max()) < 1e-12
