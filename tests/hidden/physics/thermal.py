"""What heat does: catalogue rows 39 to 44 and 47. Bodies are warm, late and unmeasured; sensors only hint at them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.random import Generator

from ..chain import Joint, Machine
from ..climate import lagged
from ..motion import Array
from ..situation import Situation
from .entry import Entry, Field, field, spread, symbol
from .linear import sense

FAMILY = "thermal"


def entries(machine: Machine) -> list[Entry]:
    """All of them for one machine."""
    linear = [joint for joint in machine.joints if not joint.rotary]
    result = [_growth(machine), _artefact()]
    result += [_drift(letter) for letter in "XYZ"]
    result += [_swing(letter) for letter in "XYZ"]
    result += [_scale(joint) for joint in linear]
    result += [bend(joint, "AB"[i % 2]) for i, joint in enumerate(linear) if joint.tool_side]
    for joint in machine.joints:
        carrier = carrying(machine, joint)
        if joint.rotary and carrier is not None:
            result.append(centre(joint, _common_normal(joint, carrier)))
    return result


def carrying(machine: Machine, joint: Joint) -> Joint | None:
    """The rotary axis that carries another; a centre that none carries drifts like the column."""
    branch = machine.outwards(joint.tool_side)
    turning = [other for other in branch[: branch.index(joint)] if other.rotary]
    return turning[-1] if turning else None


def _common_normal(joint: Joint, carrier: Joint) -> str:
    """The direction across both axes, in the triad of the carried one: a shift along it turns with the carrier. (Along
    the carrier's line it would be the drift of the frame, and no data could tell.)
    """
    normal = np.cross(joint.direction, carrier.direction)
    return "XYZ"[int(np.argmax(np.abs(np.asarray(joint.triad) @ normal)))]


def heated(rng: Generator, body: str) -> Callable[[Situation], Array]:
    """A length that follows a body's heat: a quick part and a late part, growing less as it gets warmer.

    Zero is its mean over a session, since a constant is the set-up's.
    """
    late, share, soft = np.exp(rng.uniform(np.log(300), np.log(6000))), rng.uniform(0.0, 0.7), rng.uniform(0.0, 0.25)

    def signal(s: Situation) -> Array:
        quick = s.climate.bodies[body]
        both = (1 - share) * quick + share * lagged(quick, late)
        size = np.max(np.abs(both)) + 1e-9
        bent = both * (1 - soft * np.abs(both) / size)
        bent -= np.mean(bent[s.climate.grid < s.climate.session])
        result: Array = np.interp(s.time, s.climate.grid, bent)
        return result

    return signal


def _growth(machine: Machine) -> Entry:
    """A warm spindle is longer: its nose pushes the tool away, against `tool_direction` (from tip to spindle)."""
    part = int(np.argmax(np.abs(machine.tool_direction)))
    way = -float(machine.tool_direction[part])

    def draw(rng: Generator) -> Field:
        warm = heated(rng, "spindle")
        return field({("S", "XYZ"[part]): lambda s: way * warm(s)})

    symbols = (symbol("XYZ"[part], "S"),)
    return Entry("spindle growth", 39, "spindle growth", "", symbols, FAMILY, draw, one_way=True)


def _drift(letter: str) -> Entry:
    """Column and bed walk apart along one base direction."""

    def draw(rng: Generator) -> Field:
        return field({("F", letter): heated(rng, "column")})

    return Entry(f"drift {letter}", 40, "drift", letter, (f"E{letter}0F",), FAMILY, draw)


def _swing(letter: str) -> Entry:
    """The hall's air moves the machine along one base direction, some hours late."""

    def draw(rng: Generator) -> Field:
        return field({("F", letter): heated(rng, "ambient")})

    return Entry(f"ambient swing {letter}", 44, "ambient swing", letter, (f"E{letter}0F",), FAMILY, draw)


def _scale(joint: Joint) -> Entry:
    """A warm screw or scale: positioning in proportion to travel from where it is held, somewhere about its middle."""

    way = sense(joint)

    def draw(rng: Generator) -> Field:
        warm, held, bow = heated(rng, "bed"), rng.uniform(-0.5, 0.5), spread(rng, 0.02, 0.3)

        def signal(s: Situation) -> Array:
            u = s.u(joint.name)
            result: Array = way * warm(s) * (u - held + bow * u**2)
            return result

        return field({(joint.name, joint.name): signal})

    name = symbol(joint.name, joint.name)
    return Entry(f"thermal scale {joint.name}", 41, "thermal scale", joint.name, (name,), FAMILY, draw, one_way=True)


def bend(joint: Joint, component: str) -> Entry:
    """A column warmer in front than behind leans: a rotation, so the lever decides."""

    def draw(rng: Generator) -> Field:
        warm, more = heated(rng, "column"), spread(rng, 0.0, 0.35)
        return field({(joint.name, component): lambda s: warm(s) * (1 + more * s.u(joint.name))})

    name = symbol(component, joint.name)
    return Entry(f"thermal bend {name}", 42, "thermal bend", joint.name, (name,), FAMILY, draw)


def centre(joint: Joint, letter: str) -> Entry:
    """The seat of a rotary axis grows out of the middle of what carries it: a table, or a head beside the spindle."""
    body = "spindle" if joint.tool_side else "table"

    def draw(rng: Generator) -> Field:
        return field({(joint.name, letter): heated(rng, body)})

    name = f"rotary centre drift {joint.name}"
    return Entry(name, 43, "rotary centre drift", joint.name, (f"E{letter}0{joint.name}",), FAMILY, draw)


def _artefact() -> Entry:
    """The plate that carries the balls grows from its middle: the workpiece moves, in proportion to the place on it."""

    def draw(rng: Generator) -> Field:
        warm = heated(rng, "table")
        parts = {("W", letter): _outward(warm, i) for i, letter in enumerate("XYZ")}
        return field(parts)

    return Entry("artefact growth", 47, "artefact growth", "", ("W",), FAMILY, draw, one_way=True)


def _outward(warm: Callable[[Situation], Array], index: int) -> Callable[[Situation], Array]:
    return lambda s: warm(s) * s.ball()[:, index]
