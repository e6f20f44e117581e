"""What weight does: moving bodies, workpiece and tool bend the machine. Catalogue rows 28 to 36."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from .. import curves
from ..chain import Joint, Machine
from ..motion import Array, inverse, moved, turned
from ..situation import Situation
from .entry import Entry, Field, Signal, field, spread, symbol
from .linear import crossed
from .rotary import letters, tilts


def entries(machine: Machine) -> list[Entry]:
    """All of them for one machine."""
    down = np.asarray(machine.gravity)
    linear = [joint for joint in machine.joints if not joint.rotary]
    flat = [joint for joint in linear if abs(down @ np.asarray(joint.direction)) < 0.5]
    result = [
        bed_sag(machine, flat[0]),
        ram_droop(machine, machine.joint(machine.ram)),
        foundation_tilt(machine, flat[0]),
        _nod(machine),
    ]
    for joint in machine.joints:
        if joint.rotary and feels_gravity(machine, joint):
            result += _under_gravity(machine, joint)
    if any(joint.rotary and joint.tool_side for joint in machine.joints):
        result += [_tool_droop(machine)]
    return result


def feels_gravity(machine: Machine, joint: Joint) -> bool:
    """Whether weight across the axis ever changes: it lies, or something that turns carries it."""
    lying = abs(np.asarray(machine.gravity) @ np.asarray(joint.direction)) < 0.99
    names = [j.name for j in machine.outwards(joint.tool_side)]
    return lying or any(machine.joint(n).rotary for n in names[: names.index(joint.name)])


def _under_gravity(machine: Machine, joint: Joint) -> list[Entry]:
    on_table = not joint.tool_side
    carried = [j for j in machine.outwards(joint.tool_side) if j.rotary][-1] is joint
    if on_table and carried:
        return [_stiffness(joint), _unbalance(joint)]
    return [_torque(joint), _twist(joint)] if on_table else [_torque(joint)]


def local_gravity(s: Situation, joint: Joint) -> Array:
    """Direction of weight in the error triad of a joint (before it turns), (n, 3)."""
    carrier = s.machine.carriers(s.q)[joint.name][0][:, :3, :3]
    down = turned(np.swapaxes(carrier, -1, -2), np.broadcast_to(s.machine.gravity, (len(s), 3)))
    result: Array = down @ np.asarray(joint.triad).T
    return result


def across(s: Situation, joint: Joint) -> tuple[Array, Array, Array]:
    """Weight across the axis in the triad (two components), and the signed turn about the triad's row."""
    along, first, second, _ = letters(joint)
    down = local_gravity(s, joint)
    sign = np.sign(np.asarray(joint.triad)["XYZ".index(along)] @ np.asarray(joint.direction))
    return down[:, "XYZ".index(first)], down[:, "XYZ".index(second)], sign * s.column(joint.name)


def mass(s: Situation, joint: Joint, own: float) -> Array:
    """Turning mass in units of 300 kg: the body's own, and the workpiece on a table; a head carries a tool, and the
    longer it is the heavier.
    """
    return own + (s.length / 1000.0 if joint.tool_side else s.load / 300.0)


def _curved(rng: Generator, joint: Joint, power: float) -> tuple[curves.Curve, curves.Curve]:
    """A deflection of u and its derivative by the position in mm, with no slope over the whole travel."""
    bend = curves.bent(rng, power)
    end = float(rng.choice((-1, 1)))
    reach = (joint.high - joint.low) / 2
    shape = curves.straightened(lambda u: bend((1 + end * u) / 2))
    return shape, lambda u: (shape(u + 1e-4) - shape(u - 1e-4)) / (2e-4 * reach)


def _coupled(machine: Machine, joint: Joint, rng: Generator, power: float) -> Field:
    """Vertical deflection and the pitch that belongs to it: rotation vector = direction x slope of the deflection."""
    shape, slope = _curved(rng, joint, power)
    move, down = np.asarray(joint.direction), np.asarray(machine.gravity)
    tilt = np.cross(move, down) * rng.uniform(0.7, 1.3)
    parts: dict[tuple[str, str], Signal] = {}
    for i in range(3):
        if down[i]:
            parts[joint.name, "XYZ"[i]] = _along(joint, shape, float(down[i]))
        if tilt[i]:
            parts[joint.name, "ABC"[i]] = _along(joint, slope, float(tilt[i]))
    return field(parts)


def _along(joint: Joint, curve: curves.Curve, size: float) -> Signal:
    return lambda s: size * curve(s.u(joint.name))


def _components(machine: Machine, joint: Joint) -> tuple[str, ...]:
    """Symbols of the vertical straightness and the pitch of a travel."""
    vertical = "XYZ"[int(np.argmax(np.abs(machine.gravity)))]
    pitch = "ABC"[int(np.argmax(np.abs(np.cross(joint.direction, machine.gravity))))]
    return symbol(vertical, joint.name), symbol(pitch, joint.name)


def bed_sag(machine: Machine, joint: Joint) -> Entry:
    symbols = _components(machine, joint)
    return Entry(
        f"bed sag {joint.name}", 32, "bed sag", joint.name, symbols, f"{joint.name} geometry",
        lambda rng: _coupled(machine, joint, rng, 2.0),
    )  # fmt: skip


def ram_droop(machine: Machine, joint: Joint) -> Entry:
    symbols = _components(machine, joint)
    return Entry(
        f"ram droop {joint.name}", 33, "ram droop", joint.name, symbols, f"{joint.name} geometry",
        lambda rng: _coupled(machine, joint, rng, 2.7), one_way=True,
    )  # fmt: skip


def foundation_tilt(machine: Machine, joint: Joint) -> Entry:
    """A heavy slide tilts the bed against the column; more the further it is out."""
    axis = "ABC"[int(np.argmax(np.abs(np.cross(joint.direction, machine.gravity))))]

    def draw(rng: Generator) -> Field:
        stiff, skew = spread(rng, 0.05, 0.4), rng.uniform(-0.8, 0.8)
        return field(
            {("F", axis): lambda s: s.u(joint.name) + stiff * (s.u(joint.name) ** 3 + skew * s.u(joint.name) ** 2)}
        )

    return Entry(
        f"foundation tilt {joint.name}",
        35,
        "foundation tilt",
        joint.name,
        (f"E{axis}0F",),
        f"{joint.name} geometry",
        draw,
    )


def _nod(machine: Machine) -> Entry:
    """The column nods by a mass that moves out on it: a rotation of one tool axis by the product of two positions."""
    tool = [joint.name for joint in machine.joints if joint.tool_side and not joint.rotary]
    inner, outer = tool[0], tool[-1]

    def draw(rng: Generator) -> Field:
        product, lean = crossed(inner, outer), spread(rng, 0.05, 0.5)
        return field({(outer, "A"): lambda s: product(s) * (1 + lean * s.u(outer))})

    return Entry(f"column nod {outer}", 34, "column nod", outer, (symbol("A", outer),), f"{outer} geometry", draw)


def _stiffness(joint: Joint) -> Entry:
    """A table that is softer one way: weight across tilts it, twice per turn in its seat."""
    first, second = tilts(joint)

    def draw(rng: Generator) -> Field:
        at, ratio = rng.uniform(0, np.pi), rng.uniform(0.05, 0.4)

        def response(s: Situation, part: int) -> Array:
            a, b, turn = across(s, joint)
            two = 2 * (turn + at)
            pair = (a * np.cos(two) + b * np.sin(two), a * np.sin(two) - b * np.cos(two))
            soft: Array = pair[part] + ratio * np.sin(2 * two) * (a, b)[part]
            return soft

        return field({(joint.name, first): lambda s: response(s, 0), (joint.name, second): lambda s: response(s, 1)})

    symbols = (symbol(first, joint.name), symbol(second, joint.name))
    name = f"table stiffness {joint.name}"
    return Entry(name, 28, "table stiffness", joint.name, symbols, f"{joint.name} rotary", draw)


def _unbalance(joint: Joint) -> Entry:
    """A workpiece off the centre turns the table against its drive: needs two loads, else it is an encoder error."""
    about = letters(joint)[3]

    def draw(rng: Generator) -> Field:
        phase, limit = rng.uniform(0, 2 * np.pi), rng.uniform(0.7, 2.5)

        def signal(s: Situation) -> Array:
            a, b, turn = across(s, joint)
            torque = s.load / 150.0 * (a * np.cos(turn + phase) + b * np.sin(turn + phase))
            result: Array = limit * np.tanh(torque / limit)
            return result

        return field({(joint.name, about): signal})

    return _entry(joint, 29, "unbalanced load", (about,), draw)


def _torque(joint: Joint) -> Entry:
    """The swivelling body's own weight and the load twist its drive and press on its bearings."""
    _, first, _, about = letters(joint)

    def draw(rng: Generator) -> Field:
        phase, shift = rng.uniform(-0.8, 0.8), np.exp(rng.uniform(np.log(3.0), np.log(50.0)))
        bend, own = rng.uniform(-0.3, 0.3), rng.uniform(0.2, 0.8)

        def signal(s: Situation) -> Array:
            a, b, turn = across(s, joint)
            lever = a * np.cos(turn + phase) + b * np.sin(turn + phase)
            result: Array = mass(s, joint, own) * (lever + bend * lever**2)
            return result

        return field({(joint.name, about): signal, (joint.name, first): lambda s: shift * signal(s)})

    return _entry(joint, 30, "gravity sag", (about,), draw)


def _twist(joint: Joint) -> Entry:
    """A trunnion driven from one side: the further from the drive, the more its table lags under torque."""
    about = letters(joint)[3]

    def draw(rng: Generator) -> Field:
        phase, bend, own = rng.uniform(-0.8, 0.8), rng.uniform(-0.25, 0.25), rng.uniform(0.2, 0.8)

        def signal(s: Situation) -> Array:
            a, b, turn = across(s, joint)
            torque = mass(s, joint, own) * (a * np.cos(turn + phase) + b * np.sin(turn + phase))
            place = _along_the_axis(s, joint) / 200.0
            result: Array = torque * (place + bend * place**2)
            return result

        return field({(joint.name, about): signal})

    return _entry(joint, 31, "trunnion twist", (about,), draw)


def _along_the_axis(s: Situation, joint: Joint) -> Array:
    """How far along a rotary axis the tip is, from the axis' point, mm: whatever turns on it further out."""
    carriers = s.machine.carriers(s.q)
    tip = moved(carriers["S"][0], np.asarray(s.machine.tool_point) - np.outer(s.length, s.machine.tool_direction))
    pose, reference = carriers[joint.name]
    result: Array = (moved(inverse(pose), tip) - reference) @ np.asarray(joint.direction)
    return result


def _entry(joint: Joint, row: int, kind: str, components: tuple[str, ...], draw: object) -> Entry:
    symbols = tuple(symbol(c, joint.name) for c in components)
    return Entry(f"{kind} {joint.name}", row, kind, joint.name, symbols, f"{joint.name} rotary", draw)  # type: ignore[arg-type]


def of_weight(joint: Joint) -> tuple[Entry, ...]:
    """What weight does to a rotary axis, wherever it lies; what needs a workpiece, to those of a table only."""
    on_table = (_unbalance(joint), _twist(joint)) if not joint.tool_side else ()
    return _stiffness(joint), _torque(joint), *on_table


def _tool_droop(machine: Machine) -> Entry:
    """A swivelled head lets a long tool hang: a tilt by the weight across the tool, growing with its length."""

    def draw(rng: Generator) -> Field:
        power = rng.uniform(1.2, 2.6)

        def weight(s: Situation, axis: int) -> Array:
            _, turn = s.machine.nominal(s.q, s.length)
            down = turned(np.swapaxes(turn, -1, -2), np.broadcast_to(s.machine.gravity, (len(s), 3)))
            result: Array = (s.length / 150.0) ** power * down[:, axis]
            return result

        return field({("S", "A"): lambda s: weight(s, 1), ("S", "B"): lambda s: -weight(s, 0)})

    return Entry("tool droop", 36, "tool droop", "", ("EAS", "EBS"), "spindle", draw, one_way=True)
