"""Where the axes stand between plain motions: where the program says, or what follows under TCP.

With tool-centre-point control (TCP) X Y Z of a command are the tip's, the linear axes follow it and do not go straight
from one end to the other; a bound of how far they stray tells whether they may leave their travel on the way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ncfix.compensate.plan.arrays import Array, Index, lengths
from ncfix.compensate.plan.ends import led_as_commands
from ncfix.compensate.plan.kinematics import moves_as_one, reached_joints
from ncfix.compensate.plan.limits import FUZZ, excess
from ncfix.compensate.plan.segments import Segments, accelerations, skew, stays_within
from ncfix.machine import Machine


@dataclass(frozen=True, slots=True)
class Poses:
    """Axis positions and commands at the ends of motions that go on from each other, (n + 1, n_axes) each.

    machine      with the workpiece in its place
    tool_length  mm
    led          under TCP
    commands     of the program
    meant        axis positions of the program
    """

    machine: Machine
    tool_length: float
    led: bool
    commands: Array
    meant: Array

    @classmethod
    def of(cls, machine: Machine, tool_length: float, commands: Array, led: bool) -> Poses | None:
        """From the commands of a program; None where axes under TCP may not reach every point, or stray by no bound."""
        if led and not (moves_as_one(machine) and skew(machine) is not None):
            return None
        poses = cls(machine, tool_length, led, commands, commands)
        return replace(poses, meant=poses.joints(commands)) if led else poses

    def joints(self, commands: Array) -> Array:
        """The axis positions that follow from commands (k, n_axes)."""
        return reached_joints(self.machine, commands, np.full(len(commands), self.led), self.tool_length)[0]

    def corrected(self, done: Array) -> Array:
        """The commands that lead to corrected axis positions, (n + 1, n_axes)."""
        if not self.led:
            return done
        tcp = np.ones(len(done), dtype=bool)
        return led_as_commands(self.machine, self.commands, (self.meant, done), tcp, self.tool_length)

    def accelerations(self, segments: Segments, begin: Array, end: Array) -> Array:
        """What no linear axis exceeds along motions under TCP, (k,) mm per motion squared, see `segments`.

        begin, end  (k, n_axes) axis positions there
        """
        way = lengths((segments.end - segments.start) @ self.machine.at_zero[1])
        found = accelerations(self.machine, begin, end, self.tool_length, way)
        assert found is not None
        return found

    def leave_travel(self, segments: Segments, begin: Array, end: Array, acceleration: Array) -> bool:
        """Whether an axis leaves its travel along motions under TCP: looked at where it is not sure that none does."""
        rows = np.flatnonzero(~stays_within(self.machine, begin, end, acceleration))

        def joints(rows: Index, fraction: Array) -> Array:
            return self.joints(segments.at(rows, fraction))

        return bool((excess(self.machine, joints, rows, np.ones(len(rows), dtype=bool)) > FUZZ).any())
