"""A machine as a chain of real bodies: where the tool tip is, seen from the workpiece.

Own reading of the machine file's rules (docs/formats.md), written without a look at the code under test.
Units: mm and rad. An axis on the workpiece side carries the workpiece, so its errors come out with a minus sign
by themselves: the tip is always taken through the inverse of the workpiece branch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .motion import Array, about, inverse, moved, rigid, turned

Vec = tuple[float, float, float]
COMPONENTS = "XYZABC"
EYE: tuple[Vec, Vec, Vec] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
EXTRA_FRAMES = ("F", "S", "W")


@dataclass(frozen=True, slots=True)
class Joint:
    """One axis: the line of its motion in the base frame with all axes at zero.

    `triad` holds the three directions (rows) along and about which its errors are named; `low`, `high` are its travel
    in mm or degree; `pitch` is the screw's, 0 if it has none.
    """

    name: str
    rotary: bool
    tool_side: bool
    direction: Vec
    low: float
    high: float
    point: Vec = (0.0, 0.0, 0.0)
    pitch: float = 0.0
    triad: tuple[Vec, Vec, Vec] = EYE

    @property
    def unit(self) -> float:
        """The file's unit in internal units: degree -> rad, or 1."""
        return float(np.pi / 180) if self.rotary else 1.0

    def motion(self, q: Array) -> Array:
        """The nominal motion of the body, (n,) -> (n, 4, 4)."""
        steps = q[:, None] * np.asarray(self.direction)
        if self.rotary:
            return about(self.point, steps)
        return rigid(np.eye(3), steps)


@dataclass(frozen=True, slots=True)
class Errors:
    """Small motions of the bodies: `twists` (n, n_frames, 6) of every frame, `located` (n_axes, 6) of the axis lines.

    Frames are the axes, then F (the foundation against the tool branch), S (the spindle) and W (the workpiece on its
    table).
    """

    twists: Array
    located: Array

    def plus(self, twists: Array) -> Errors:
        """The same with more twists on top."""
        return Errors(self.twists + twists, self.located)


@dataclass(frozen=True, slots=True)
class Machine:
    """A chain from the workpiece to the tool; `joints` in the order of the topology string, without F and S.

    `size` is how large it is beside the plain machine of its kind, `lengths` are the tools that belong to it, mm.
    """

    name: str
    joints: tuple[Joint, ...]
    tool_point: Vec
    gravity: Vec
    ram: str
    tool_direction: Vec = (0.0, 0.0, 1.0)
    size: float = 1.0
    lengths: tuple[float, float] = (110.0, 300.0)

    @property
    def axes(self) -> tuple[str, ...]:
        """The axis letters, in the order of the columns of q."""
        return tuple(joint.name for joint in self.joints)

    @property
    def frames(self) -> tuple[str, ...]:
        """Everything that can have an error motion of its own."""
        return (*self.axes, *EXTRA_FRAMES)

    @property
    def topology(self) -> str:
        """The string of the machine file."""
        work = [j.name for j in self.joints if not j.tool_side]
        tool = [j.name for j in self.joints if j.tool_side]
        return " ".join(["w", *work, "F", *tool, "S", "t"])

    @property
    def units(self) -> Array:
        """Of each axis: what one unit of the file is in mm or rad."""
        return np.array([joint.unit for joint in self.joints])

    def joint(self, name: str) -> Joint:
        """The axis of that letter."""
        return self.joints[self.axes.index(name)]

    def no_errors(self, n: int) -> Errors:
        """A perfect machine at n poses."""
        return Errors(np.zeros((n, len(self.frames), 6)), np.zeros((len(self.joints), 6)))

    def tips(self, q: Array, length: Array, errors: Errors) -> tuple[Array, Array]:
        """Tool tip in the workpiece frame (n, 3), and the rotation from the tool's to the workpiece's frame (n, 3,
        3).
        """
        work = self._branch(q, errors, tool_side=False) @ self._twist("W", errors, (0.0, 0.0, 0.0))
        tool = self._twist("F", errors, (0.0, 0.0, 0.0)) @ self._branch(q, errors, tool_side=True)
        tool = tool @ self._twist("S", errors, self.tool_point)
        tip = np.asarray(self.tool_point) - length[:, None] * np.asarray(self.tool_direction)
        chain = inverse(work) @ tool
        return moved(chain, tip), chain[:, :3, :3]

    def nominal_tip(self, q: Array, length: Array) -> Array:
        """Where the tip should be, workpiece frame (n, 3)."""
        return self.nominal(q, length)[0]

    def nominal(self, q: Array, length: Array) -> tuple[Array, Array]:
        """`tips` of the machine without errors, from the nominal motions alone."""
        ends = self.carriers(q)
        chain = inverse(ends["W"][0]) @ ends["S"][0]
        tip = np.asarray(self.tool_point) - length[:, None] * np.asarray(self.tool_direction)
        return moved(chain, tip), chain[:, :3, :3]

    def carriers(self, q: Array) -> dict[str, tuple[Array, Array]]:
        """Of every frame, nominal: the pose of the body that carries it (n, 4, 4) and its reference point there (n,
        3).
        """
        result = {}
        for side in (False, True):
            pose = np.broadcast_to(np.eye(4), (len(q), 4, 4))
            if side:
                result["F"] = pose, np.zeros((len(q), 3))
            for joint in self.outwards(side):
                motion = joint.motion(q[:, self.axes.index(joint.name)])
                result[joint.name] = pose, moved(motion, joint.point)
                pose = pose @ motion
            end = self.tool_point if side else (0.0, 0.0, 0.0)
            result["S" if side else "W"] = pose, np.tile(end, (len(q), 1))
        return result

    def outwards(self, tool_side: bool) -> list[Joint]:
        """The joints of one branch from the foundation outwards."""
        branch = [joint for joint in self.joints if joint.tool_side == tool_side]
        return branch if tool_side else branch[::-1]

    def _branch(self, q: Array, errors: Errors, tool_side: bool) -> Array:
        """base_from_body of the last body of a branch: product of L E M inverse(L)."""
        pose = np.broadcast_to(np.eye(4), (len(q), 4, 4))
        for joint in self.outwards(tool_side):
            index = self.axes.index(joint.name)
            nominal = joint.motion(q[:, index])
            reference = moved(nominal, joint.point)
            triad = np.asarray(joint.triad)
            line = small_motion(errors.located[index] @ block(triad), joint.point)
            error = small_motion(errors.twists[:, index] @ block(triad), reference)
            pose = pose @ line @ error @ nominal @ inverse(line)
        return pose

    def _twist(self, frame: str, errors: Errors, point: Vec) -> Array:
        return small_motion(errors.twists[:, self.frames.index(frame)], point)

    def linear_solve(self, q: Array, length: Array, target: Array) -> Array:
        """The same poses with the linear axes set so that the nominal tip is at `target` (n, 3): affine, exact."""
        q = q.copy()
        columns = [i for i, joint in enumerate(self.joints) if not joint.rotary]
        gap = target - self.nominal_tip(q, length)
        q[:, columns] += turned(self.linear_steps(q, length), gap)
        return q

    def linear_steps(self, q: Array, length: Array) -> Array:
        """d linear axes / d tip, nominal, (n, 3, 3)."""
        return np.asarray(np.linalg.inv(self.linear_jacobian(q, length)), dtype=np.float64)

    def linear_jacobian(self, q: Array, length: Array) -> Array:
        """d tip / d linear axes, nominal, (n, 3, 3)."""
        here = self.nominal_tip(q, length)
        columns = []
        for i, joint in enumerate(self.joints):
            if not joint.rotary:
                step = np.zeros(len(self.joints))
                step[i] = 1.0
                columns.append(self.nominal_tip(q + step, length) - here)
        return np.stack(columns, axis=-1)


def block(triad: Array) -> Array:
    """Rows of a triad as a 6x6 map for twists: components along the triad @ block = components in the base frame."""
    result = np.zeros((6, 6))
    result[:3, :3] = result[3:, 3:] = triad
    return result


def small_motion(twists: Array, point: Array | Vec) -> Array:
    """The finite motion of a twist [ex ey ez ea eb ec] about a point: no motion of the point by the rotations."""
    return about(point, twists[..., 3:], twists[..., :3])
