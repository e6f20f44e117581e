"""Errors of rotary axes that depend on angle and direction: catalogue rows 21 to 27 and 37."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.random import Generator

from .. import curves
from ..chain import Joint, Machine
from ..motion import Array
from ..situation import Situation
from .entry import Entry, Field, Signal, field, spread, symbol
from .linear import lagging, sense


def entries(machine: Machine) -> list[Entry]:
    """All of them for one machine."""
    result = []
    linear = [joint.name for joint in machine.joints if not joint.rotary]
    for joint in machine.joints:
        if joint.rotary:
            result += [_radial(joint), _axial(joint), _wobble(joint), _encoder(joint), _worm(joint), _backlash(joint)]
            carriers = [name for name in linear if machine.joint(name).tool_side == joint.tool_side]
            result += [_seat(joint, name) for name in carriers[:1]]
    return result


def letters(joint: Joint) -> tuple[str, str, str, str]:
    """(along, two across, turn about) in the joint's error triad: C gives ("Z", "X", "Y", "C")."""
    row = int(np.argmax(np.abs(np.asarray(joint.triad) @ np.asarray(joint.direction))))
    across = [c for i, c in enumerate("XYZ") if i != row]
    return "XYZ"[row], across[0], across[1], "ABC"[row]


def tilts(joint: Joint) -> tuple[str, str]:
    """The two rotations across the axis: C gives ("A", "B")."""
    about = letters(joint)[3]
    first, second = (c for c in "ABC" if c != about)
    return first, second


def _of_angle(joint: Joint, curve: curves.Curve, size: float = 1.0) -> Signal:
    return lambda s: size * curve(s.column(joint.name))


def _pair(rng: Generator, joint: Joint, names: tuple[str, str], first: int) -> Field:
    """Two components across the axis, of unlike size and shape: an oval whirl, not a circle."""
    a, b = curves.turning(rng, first), curves.turning(rng, first)
    size = rng.uniform(0.4, 1.6)
    return field(
        {(joint.name, names[0]): _of_angle(joint, a), (joint.name, names[1]): _of_angle(joint, b, size)},
    )


def _entry(
    joint: Joint, row: int, kind: str, components: tuple[str, ...], draw: Callable[[Generator], Field],
    one_way: bool = False,
) -> Entry:  # fmt: skip
    symbols = tuple(symbol(c, joint.name) for c in components)
    family = f"{joint.name} reversal" if kind == "backlash" else f"{joint.name} rotary"
    return Entry(f"{kind} {joint.name}", row, kind, joint.name, symbols, family, draw, one_way)


def _radial(joint: Joint) -> Entry:
    """Eccentric bearing: radial motion once per turn, one draw in four twice (oval race)."""
    across = letters(joint)[1:3]
    return _entry(joint, 21, "radial", across, lambda rng: _pair(rng, joint, across, 2 if rng.random() < 0.25 else 1))


def _axial(joint: Joint) -> Entry:
    """Face run-out of the bearing: axial motion."""
    along = letters(joint)[0]

    def draw(rng: Generator) -> Field:
        return field({(joint.name, along): _of_angle(joint, curves.turning(rng, 1, share=0.3))})

    return _entry(joint, 22, "axial", (along,), draw)


def _wobble(joint: Joint) -> Entry:
    """The axis' line nods as it turns: two tilts."""
    pair = tilts(joint)
    return _entry(joint, 23, "wobble", pair, lambda rng: _pair(rng, joint, pair, 1))


def _encoder(joint: Joint) -> Entry:
    """Eccentric encoder disc: angular positioning once per turn, and twice with two read heads."""
    about = letters(joint)[3]

    def draw(rng: Generator) -> Field:
        first = 2 if rng.random() < 0.25 else 1
        return field({(joint.name, about): _of_angle(joint, curves.turning(rng, first))})

    return _entry(joint, 24, "encoder", (about,), draw)


def _worm(joint: Joint) -> Entry:
    """Worm or gear: several waves per turn, swelling along the worm wheel."""
    about = letters(joint)[3]

    def draw(rng: Generator) -> Field:
        order = int(rng.integers(4, 15))
        phase, swell, at = rng.uniform(0, 2 * np.pi), rng.uniform(0.05, 0.45), rng.uniform(0, 2 * np.pi)
        second, behind = rng.uniform(0.05, 0.35), rng.uniform(0, 2 * np.pi)

        def wave(angle: Array) -> Array:
            shape = np.sin(order * angle + phase) + second * np.sin(2 * order * angle + behind)
            result: Array = shape * (1 + swell * np.sin(angle + at))
            return result

        return field({(joint.name, about): _of_angle(joint, wave)})

    return _entry(joint, 25, "worm", (about,), draw)


def _backlash(joint: Joint) -> Entry:
    """Lost motion of the rotary drive."""
    about = letters(joint)[3]

    def draw(rng: Generator) -> Field:
        size, way = curves.play(rng), sense(joint) * lagging(rng)
        return field({(joint.name, about): lambda s: way * size(np.sin(s.column(joint.name)), s.moving(joint.name))})

    return _entry(joint, 26, "backlash", (about,), draw, one_way=True)


def _seat(joint: Joint, linear: str) -> Entry:
    """The rotary's seat gives way differently along a linear axis: a sine of the angle times a travel."""
    along = letters(joint)[0]

    def draw(rng: Generator) -> Field:
        phase, lean = rng.uniform(0, 2 * np.pi), spread(rng, 0.05, 0.5)

        def signal(s: Situation) -> Array:
            u = s.u(linear)
            result: Array = (u + lean * u**2) * np.sin(s.column(joint.name) + phase)
            return result

        return field({(joint.name, along): signal})

    name = symbol(along, joint.name)
    return Entry(f"rotary seat {joint.name}", 37, "rotary seat", joint.name, (name,), f"{joint.name} rotary", draw)
