"""The branches of a machine by themselves, and the small algebra of points and rotations that instruments need."""

from __future__ import annotations

import numpy as np

from ncfix.machine import Machine, Tool, se3
from ncfix.machine.axes import SPINDLE
from ncfix.measure.measurement import Array

TOOL, WORKPIECE = "tool", "workpiece"


def base_from_workpiece(machine: Machine, q: Array) -> Array:
    """The nominal rotation of the workpiece's axes against the base, (n, n_axes) -> (n, 3, 3)."""
    turned = np.broadcast_to(np.eye(3), (len(q), 3, 3))
    for index in reversed(range(len(machine.axes))):
        if machine.axes[index].workpiece_side:
            turned = turned @ machine.axes[index].motion(q[:, index])[:, :3, :3]
    return np.array(turned)


def branch(machine: Machine, side: str) -> tuple[Machine, list[int]]:
    """The tool or the workpiece branch as a machine of its own, and which of the axes it has.

    The other end stands on the foundation: of the tool branch `nominal` is base_from_tool, of the workpiece branch
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
    tool = Tool() if held else machine.tool
    offset = machine.workpiece_offset if held else (0.0, 0.0, 0.0)
    return machine.replace(**changes, tool=tool, workpiece_offset=offset), keep


def spindle_turn(machine: Machine, angle_deg: Array) -> Array:
    """The rotation of what the spindle holds, about the tool direction, (n,) degree -> (n, 3, 3)."""
    return se3.rotation(np.deg2rad(angle_deg)[:, None] * np.asarray(machine.tool.direction))


def best_rotation(moved: Array, fixed: Array) -> Array:
    """The rotation R that takes vectors `fixed` nearest to `moved` (both (n, 3)), after Kabsch."""
    left, _, right = np.linalg.svd(moved.T @ fixed)
    sign = np.sign(np.linalg.det(left @ right))
    rotation: Array = left @ np.diag([1.0, 1.0, sign]) @ right
    return rotation
