"""Errors of axis lines (catalogue rows 7 and 20) as effects, for scenarios whose machine file lacks one."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from ..chain import COMPONENTS, Machine
from ..motion import Array, turned
from ..situation import Situation
from .entry import Entry, Field


def entry(machine: Machine, name: str) -> Entry:
    """The location error of that name, EC0Y or EX0B: one constant."""
    axis, component = name[3], COMPONENTS.index(name[1])

    def draw(rng: Generator) -> Field:
        return lambda s: twists(s, axis, component)

    row = 20 if machine.joint(axis).rotary else 7
    return Entry(name, row, "curve", axis, (name,), f"{axis} location", draw)


def twists(s: Situation, axis: str, component: int) -> Array:
    """L E M inverse(L) as the error motion that does the same to first order: the line's motion before and after M."""
    joint, index = s.machine.joint(axis), s.machine.axes.index(axis)
    triad = np.asarray(joint.triad)
    shift, turn = np.zeros(3), np.zeros(3)
    (shift if component < 3 else turn)[:] = triad[component % 3]
    motion = joint.motion(s.q[:, index])
    result = np.zeros((len(s), len(s.machine.frames), 6))
    if joint.rotary:
        back = motion[:, :3, :3]
        parts = shift - turned(back, np.tile(shift, (len(s), 1))), turn - turned(back, np.tile(turn, (len(s), 1)))
    else:
        parts = np.cross(turn, motion[:, :3, 3]), np.zeros((len(s), 3))
    result[:, index, :3], result[:, index, 3:] = (part @ triad.T for part in parts)
    return result
