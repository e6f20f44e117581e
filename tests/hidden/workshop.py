"""Four machines, drawn a little different for every seed, and the errors that are known of them.

Sizes follow published calibrations: strokes of 500 to 900 mm, location errors of some 10 um and 10 to 40 urad, gains of
some 10 um/m (Esmaeili Marzdashti 2021, tables 4-3 and 7-2; Laspas 2014, tables 4 to 6).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.random import Generator

from .chain import Joint, Machine, Vec
from .model import Model, Term

TOPOLOGIES = ("wCBXFZYSt", "wCAYFXZSt", "wXFYZCBSt", "wXFYZSt")
_R = float(np.sqrt(0.5))
_TILTED: tuple[Vec, Vec, Vec] = ((_R, 0.0, _R), (0.0, 1.0, 0.0), (-_R, 0.0, _R))

HORIZONTAL = Machine(
    "horizontal centre, table rotates and swivels",
    (
        Joint("C", True, False, (0.0, 0.0, -1.0), -360.0, 360.0),
        Joint("B", True, False, (0.0, -1.0, 0.0), -100.0, 100.0),
        Joint("X", False, False, (-1.0, 0.0, 0.0), -305.0, 305.0, pitch=12.0),
        Joint("Z", False, True, (0.0, 0.0, 1.0), -620.0, 0.0, pitch=12.0),
        Joint("Y", False, True, (0.0, 1.0, 0.0), -280.0, 280.0, pitch=10.0),
    ),
    tool_point=(0.0, 0.0, 560.0),
    gravity=(0.0, -1.0, 0.0),
    ram="Z",
)
TRUNNION = Machine(
    "vertical centre with a tilted swivel",
    (
        Joint("C", True, False, (0.0, 0.0, -1.0), -360.0, 360.0),
        Joint("A", True, False, (_R, 0.0, _R), -10.0, 190.0, point=(0.0, 0.0, -20.0), triad=_TILTED),
        Joint("Y", False, False, (0.0, -1.0, 0.0), -350.0, 350.0, pitch=10.0),
        Joint("X", False, True, (1.0, 0.0, 0.0), -325.0, 325.0, pitch=10.0),
        Joint("Z", False, True, (0.0, 0.0, 1.0), -500.0, 0.0, pitch=8.0),
    ),
    tool_point=(0.0, 0.0, 520.0),
    gravity=(0.0, 0.0, -1.0),
    ram="X",
)
HEAD = Machine(
    "portal with a fork head",
    (
        Joint("X", False, False, (-1.0, 0.0, 0.0), -800.0, 800.0, pitch=20.0),
        Joint("Y", False, True, (0.0, 1.0, 0.0), -500.0, 500.0, pitch=16.0),
        Joint("Z", False, True, (0.0, 0.0, 1.0), -700.0, 0.0, pitch=12.0),
        Joint("C", True, True, (0.0, 0.0, 1.0), -200.0, 200.0),
        Joint("B", True, True, (0.0, 1.0, 0.0), -95.0, 95.0, point=(0.0, 0.0, 910.0)),
    ),
    tool_point=(0.0, 0.0, 700.0),
    gravity=(0.0, 0.0, -1.0),
    ram="Y",
)
THREE_AXES = Machine(
    "three-axis vertical centre",
    (
        Joint("X", False, False, (-1.0, 0.0, 0.0), -900.0, 0.0, pitch=10.0),
        Joint("Y", False, True, (0.0, 1.0, 0.0), -500.0, 0.0, pitch=10.0),
        Joint("Z", False, True, (0.0, 0.0, 1.0), -460.0, 0.0, pitch=8.0),
    ),
    tool_point=(0.0, 0.0, 0.0),
    gravity=(0.0, 0.0, -1.0),
    ram="Y",
)
_MACHINES = dict(zip(TOPOLOGIES, (HORIZONTAL, TRUNNION, HEAD, THREE_AXES), strict=True))
PITCHES = (5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0)
LENGTHS = {
    "wCBXFZYSt": (110.0, 300.0),
    "wCAYFXZSt": (90.0, 260.0),
    "wXFYZCBSt": (90.0, 240.0),
    "wXFYZSt": (110.0, 280.0),
}
_GAINS = ("EXX", "EYY", "EZZ")
_SQUARENESS = ("EC0Y", "EA0Y", "EB0Z")
_LINES = {
    "wCBXFZYSt": ("EA0B", "EC0B", "EX0B", "EZ0B", "EA0C", "EB0C", "EX0C", "EY0C"),
    "wCAYFXZSt": ("EB0A", "EC0A", "EY0A", "EZ0A", "EA0C", "EB0C", "EX0C", "EY0C"),
    "wXFYZCBSt": ("EA0C", "EB0C", "EX0C", "EY0C", "EA0B", "EC0B", "EX0B", "EZ0B"),
    "wXFYZSt": (),
}
_MOTIONS = ("EXX", "EYY", "EZZ", "EYX", "EZX", "EXY", "EZY", "EXZ", "EYZ")


def draw_machine(rng: Generator, topology: str) -> Machine:
    """A machine of that kind: larger or smaller, other screws, other tools, its swivel tilted a little otherwise.

    No two seeds share travels, levers or pitches.
    """
    plain, size = _MACHINES[topology], float(np.round(rng.uniform(0.85, 1.2), 3))
    tilt = _tilt(rng) if topology == "wCAYFXZSt" else None
    joints = tuple(_rotary(rng, j, size, tilt) if j.rotary else _linear(rng, j, size) for j in plain.joints)
    x, y, z = (round(size * v, 2) for v in plain.tool_point)
    short, long = LENGTHS[topology]
    tools = float(np.round(short * rng.uniform(0.8, 1.3))), float(np.round(long * rng.uniform(0.85, 1.15)))
    return replace(plain, joints=joints, tool_point=(x, y, z), size=size, lengths=tools)


def _tilt(rng: Generator) -> tuple[Vec, Vec, Vec]:
    """The triad of a swivel that is tilted by 35 to 55 degrees."""
    angle = np.deg2rad(np.round(rng.uniform(35, 55), 1))
    c, s = float(np.cos(angle)), float(np.sin(angle))
    return (c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c)


def _linear(rng: Generator, joint: Joint, size: float) -> Joint:
    """Travel to whole millimetres."""
    low, high = (float(np.round(size * rng.uniform(0.95, 1.08) * end)) for end in (joint.low, joint.high))
    return replace(joint, low=low, high=high, pitch=float(rng.choice(PITCHES)))


def _rotary(rng: Generator, joint: Joint, size: float, tilt: tuple[Vec, Vec, Vec] | None) -> Joint:
    """Its point within some centimetres, on the axis' normal plane, in hundredths of a millimetre."""
    if tilt is not None and joint.name == "A":
        joint = replace(joint, direction=tilt[0], triad=tilt)
    direction, shift = np.asarray(joint.direction), rng.uniform(-30, 30, 3)
    x, y, z = np.round(size * np.asarray(joint.point) + shift - direction * (direction @ shift), 2)
    return replace(joint, point=(float(x), float(y), float(z)))


def draw_model(rng: Generator, machine: Machine, topology: str, rich: bool = False) -> Model:
    """Known errors: gains, squareness, all lines of the rotary axes; with `rich` a table for each linear error
    motion.
    """
    angle, shift = rng.uniform(20e-6, 60e-6), rng.uniform(0.03, 0.08)
    terms = [_gain(rng, machine, name) for name in _GAINS]
    terms += [Term(name, (_angle(rng, angle),)) for name in _SQUARENESS]
    terms += [Term(name, (_angle(rng, angle) if name[1] in "ABC" else _mm(rng, shift),)) for name in _LINES[topology]]
    if rich:
        terms += [_table(rng, machine, name) for name in _MOTIONS]
    return Model(tuple(terms))


def _gain(rng: Generator, machine: Machine, name: str) -> Term:
    joint = machine.joint(name[2])
    half = (joint.high - joint.low) / 2
    return Term(name, (_mm(rng, 40e-6 * half),), "polynomial", (1,), (joint.low + joint.high) / 2, half)


def _table(rng: Generator, machine: Machine, name: str) -> Term:
    """A measured curve: a wandering line with the slope taken out, rms some 10 um (positioning) or 6 um
    (straightness).
    """
    joint = machine.joint(name[2])
    positions = np.round(np.linspace(joint.low, joint.high, int(rng.integers(11, 18))), 1)
    walk = np.cumsum(rng.normal(size=len(positions)))
    walk -= np.polyval(np.polyfit(positions, walk, 1), positions)
    size = 0.010 if name[1] == name[2] else 0.006
    values = np.round(size * walk / np.sqrt(np.mean(walk**2)), 5)
    return Term(name, tuple(map(float, values)), "table", positions=tuple(map(float, positions)))


def _angle(rng: Generator, size: float) -> float:
    """Not near zero: between a third of the size and the size, either sign, in tenths of a microradian."""
    return float(np.round(rng.choice((-1, 1)) * rng.uniform(size / 3, size), 7))


def _mm(rng: Generator, size: float) -> float:
    """The same for millimetres, in hundredths of a micrometre."""
    return float(np.round(rng.choice((-1, 1)) * rng.uniform(size / 3, size), 5))
