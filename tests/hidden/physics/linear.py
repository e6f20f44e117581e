"""Errors of linear axes that depend on position and direction: catalogue rows 2, 3, 5, 6, 8 to 12."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from .. import curves
from ..chain import Joint, Machine
from ..motion import Array, inverse, moved
from ..situation import Situation
from .entry import Entry, Field, Signal, field, symbol

PIVOTS = (3.0, 40.0)
LEVER = 60.0
_TURNS = {"A": ("Y", "Z"), "B": ("Z", "X"), "C": ("X", "Y")}


def entries(machine: Machine) -> list[Entry]:
    """All of them for one machine."""
    result = []
    for joint in machine.joints:
        if not joint.rotary:
            components = [c for c in "XYZABC" if c in "XYZ" or _has_lever(machine, joint, c)]
            result += [motion(joint, component) for component in components]
            result += [_pitch(joint), _backlash(joint)]
            result += [play(joint, component) for component in components if component != joint.name]
    return result


def _has_lever(machine: Machine, joint: Joint, component: str) -> bool:
    """Whether a rotation of the slide moves the tip at all: the roll of a quill about the tool's own line does not."""
    q = np.random.default_rng(0).uniform(
        [j.low * j.unit for j in machine.joints], [j.high * j.unit for j in machine.joints], (20, len(machine.joints))
    )
    carriers = machine.carriers(q)
    tip = moved(carriers["S"][0], np.asarray(machine.tool_point) - 200.0 * np.asarray(machine.tool_direction))
    pose, reference = carriers[joint.name]
    lever = np.cross(np.eye(3)["ABC".index(component)], moved(inverse(pose), tip) - reference)
    return bool(np.max(np.linalg.norm(lever, axis=1)) > LEVER)


def motion(joint: Joint, component: str) -> Entry:
    """EXX, EYX, EAX: a smooth curve, one in six a local dent; a rotation has its pivot some millimetres off."""

    def draw(rng: Generator) -> Field:
        shape = curves.bump(rng) if rng.random() < 1 / 6 else curves.smooth(rng)
        signal: Signal = lambda s: shape(s.u(joint.name))  # noqa: E731
        return field(_pivoted(rng, joint.name, component, signal))

    row = 6 if component in "ABC" else 2 if component == joint.name else 5
    name = symbol(component, joint.name)
    return Entry(name, row, "curve", joint.name, (name,), f"{joint.name} geometry", draw)


def _pivoted(rng: Generator, frame: str, component: str, signal: Signal) -> dict[tuple[str, str], Signal]:
    """The motion, and for a rotation the shifts that come with a pivot some millimetres beside the stated reference."""
    parts = {(frame, component): signal}
    if component in "ABC":
        first, second = _TURNS[component]
        a, b = np.exp(rng.uniform(*np.log(PIVOTS))) * rng.uniform(-1, 1, 2)
        parts[frame, first] = lambda s: a * signal(s)
        parts[frame, second] = lambda s: b * signal(s)
    return parts


def _pitch(joint: Joint) -> Entry:
    """Screw pitch cyclic."""

    def draw(rng: Generator) -> Field:
        wave = curves.pitch_wave(rng, joint.pitch)
        return field({(joint.name, joint.name): lambda s: wave(s.column(joint.name))})

    name = symbol(joint.name, joint.name)
    return Entry(f"pitch {joint.name}", 3, "pitch", joint.name, (name,), f"{joint.name} geometry", draw)


def _lost(joint: Joint, rng: Generator) -> Signal:
    size = curves.play(rng)
    return lambda s: size(s.u(joint.name), s.moving(joint.name))


def _backlash(joint: Joint) -> Entry:
    """Backlash with wind-up: its size depends on the place and a little on the side. The slide lags behind; on one
    machine of four its control takes out too much.
    """

    def draw(rng: Generator) -> Field:
        lost, way = _lost(joint, rng), sense(joint) * lagging(rng)
        return field({(joint.name, joint.name): lambda s: way * lost(s)})

    name = symbol(joint.name, joint.name)
    family = f"{joint.name} reversal"
    return Entry(f"backlash {joint.name}", 9, "backlash", joint.name, (name,), family, draw, one_way=True)


def sense(joint: Joint) -> float:
    """-1 where the axis counts against the direction of its triad: going too far is then an error in minus."""
    return float(np.sign(np.sum(np.asarray(joint.triad) @ np.asarray(joint.direction))))


def lagging(rng: Generator) -> float:
    """-1 where a drive lags behind, 1 where more than its play is taken out."""
    return 1.0 if rng.random() < 0.25 else -1.0


def play(joint: Joint, component: str) -> Entry:
    """Lateral play (EYX) or angular play (ECX): the carriage shifts or yaws at reversal."""

    def draw(rng: Generator) -> Field:
        return field(_pivoted(rng, joint.name, component, _lost(joint, rng)))

    kind, row = ("angular play", 12) if component in "ABC" else ("lateral play", 11)
    name = symbol(component, joint.name)
    return Entry(f"{kind} {name}", row, kind, joint.name, (name,), f"{joint.name} reversal", draw)


def crossed(first: str, second: str) -> Signal:
    """Product of two positions, each -1 .. 1."""

    def signal(s: Situation) -> Array:
        return s.u(first) * s.u(second)

    return signal
