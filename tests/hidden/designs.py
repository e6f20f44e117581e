"""Where and when it is measured: poses, approach directions, order, tools, loads, repeats, and what is held out.

A design is good when it lets every effect show: two tools, two loads, random order, random approach, irregular steps.
The others each spoil some of these, as real data do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from .chain import Machine, Vec
from .climate import Climate
from .motion import Array, Ints, Mask
from .situation import Situation

LEVELS = 7
LOOSE = ("balls", "bars", "free")


@dataclass(frozen=True, slots=True)
class Design:
    """How a measurement is laid out. `layout`: "balls" on the table, "bars" about them, "free" in the travels.

    `levels`: into how many cells the travel of a rotary axis is divided.
    """

    name: str
    layout: str = "balls"
    count: int = 330
    balls: int = 4
    tools: int = 2
    repeated: int = 12
    times: int = 4
    levels: int = LEVELS
    ordered: bool = False
    one_sided: bool = False
    on_pitch: bool = False


@dataclass(frozen=True, slots=True)
class Table:
    """Where balls stand, workpiece frame: a ring of radii about a point, heights above it; lengths of ball-bars."""

    middle: Vec
    radius: tuple[float, float]
    height: tuple[float, float]
    bars: tuple[float, float]


BALLS, BARS, FREE = Design("balls"), Design("bars", "bars", count=480), Design("free", "free")
ONE_TOOL = Design("one tool", tools=1)
ORDERED = Design("one tool, in order, one-sided", tools=1, ordered=True, one_sided=True)
SMALL = Design("small", count=110, balls=3, repeated=8)
FEW = Design("small, one tool", count=120, balls=3, tools=1, repeated=8)
ON_PITCH = Design("pitch multiples", "free", on_pitch=True)

TABLES = {
    "wCBXFZYSt": Table((0.0, 0.0, 0.0), (60.0, 200.0), (110.0, 260.0), (100.0, 150.0)),
    "wCAYFXZSt": Table((0.0, 0.0, 0.0), (50.0, 170.0), (60.0, 200.0), (100.0, 150.0)),
    "wXFYZCBSt": Table((0.0, 0.0, 0.0), (100.0, 400.0), (150.0, 350.0), (150.0, 300.0)),
    "wXFYZSt": Table((-450.0, -250.0, -420.0), (60.0, 150.0), (-60.0, 40.0), (150.0, 200.0)),
}
ROTARY = {"C": (0.0, 360.0), "B": (-75.0, 75.0), "A": (0.0, 150.0)}
HEAD_TURN = (-180.0, 180.0)


def lay_out(
    rng: Generator, machine: Machine, topology: str, climate: Climate, lengths: tuple[float, ...], design: Design
) -> Situation:
    """The rows of a design on a machine, in the order of time; positions as a file with four decimals gives them."""
    picked = _within_travel(machine, _dressed(rng, _poses(rng, machine, topology, lengths, design), design))
    picked = picked.rows(np.arange(min(design.count, len(picked))))
    order = np.lexsort(picked.q.T) if design.ordered else rng.permutation(len(picked))
    rows = _repeats(rng, len(picked), design)
    timed = picked.rows(order).rows(rows)
    return replace(timed, repeat=_count_repeats(rows), time=_times(rng, rows, climate.session), climate=climate)


def varied(rng: Generator, design: Design) -> Design:
    """A good design as somebody else would have laid it out; the poor ones are what they are."""
    if design.name not in LOOSE:
        return design
    often = {"repeated": int(rng.integers(10, 16)), "times": int(rng.integers(3, 6))}
    count = round(design.count * rng.uniform(0.95, 1.15))
    return replace(design, count=count, balls=int(rng.integers(4, 6)), levels=int(rng.integers(6, 10)), **often)


def span(machine: Machine, name: str) -> tuple[float, float]:
    """The part of a travel that is measured, in the file's unit."""
    joint = machine.joint(name)
    if joint.rotary:
        return HEAD_TURN if joint.tool_side and name == "C" else ROTARY[name]
    edge = 0.03 * (joint.high - joint.low)
    return joint.low + edge, joint.high - edge


def _poses(rng: Generator, machine: Machine, topology: str, lengths: tuple[float, ...], design: Design) -> Situation:
    """More rows than wanted: some will be out of reach."""
    n = 6 * design.count
    tool = rng.integers(min(design.tools, len(lengths)), size=n)
    ball = rng.integers(design.balls if design.layout != "free" else 2, size=n)
    s = _empty(machine, np.asarray(lengths)[tool], 2 * ball + tool)
    q, cells = _angles(rng, machine, n, design.levels)
    s = replace(s, q=q, block=cells)
    if design.layout == "free":
        return _free(rng, s, design)
    return _at_balls(rng, s, TABLES[topology], ball, design)


def _at_balls(rng: Generator, s: Situation, table: Table, ball: Ints, design: Design) -> Situation:
    """The linear axes follow so that the nominal tip is in a ball, or on the sphere of a bar about it."""
    place = np.round(s.machine.size * _ring(rng, table, design.balls), 4)[ball]
    if design.layout == "balls":
        return replace(s, q=_written(s.machine, s.machine.linear_solve(s.q, s.length, place)))
    way = rng.normal(size=place.shape)
    way[:, 2] = np.abs(way[:, 2])
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    bar = np.round(s.machine.size * np.asarray(table.bars))[ball % 2]
    q = _written(s.machine, s.machine.linear_solve(s.q, s.length, place + bar[:, None] * way))
    block = s.block if s.block.any() else 4 * (way[:, 0] > 0) + 2 * (way[:, 1] > 0) + (way[:, 2] > 0.5)
    return replace(s, q=q, centre=place, radius=bar, block=block)


def _ring(rng: Generator, table: Table, count: int) -> Array:
    """Ball centres on a machine of the plain size, workpiece frame (count, 3)."""
    turn = 2 * np.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
    radius = np.linspace(*table.radius, count) * rng.uniform(0.8, 1.15, count)
    height = rng.permutation(np.linspace(*table.height, count))
    ring = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
    result: Array = np.asarray(table.middle) + ring
    return result


def _angles(rng: Generator, machine: Machine, n: int, levels: int) -> tuple[Array, Ints]:
    """Rotary positions spread over the cells of their travels, never twice the same, and the number of the cell."""
    q, cells = np.zeros((n, len(machine.joints))), np.zeros(n, dtype=int)
    for i, joint in enumerate(machine.joints):
        if joint.rotary:
            low, high = span(machine, joint.name)
            level = rng.integers(levels, size=n)
            q[:, i] = np.round(low + (high - low) * (level + rng.uniform(0.1, 0.9, n)) / levels, 3) * joint.unit
            cells = cells * levels + level
    return q, cells


def _free(rng: Generator, s: Situation, design: Design) -> Situation:
    """Linear axes anywhere, evenly filled; cells of the linear axes where nothing turns."""
    q, cells = s.q.copy(), s.block
    for i, joint in enumerate(s.machine.joints):
        if not joint.rotary:
            low, high = span(s.machine, joint.name)
            q[:, i] = low + (high - low) * (rng.permutation(len(s)) + rng.uniform(size=len(s))) / len(s)
            if design.on_pitch:
                q[:, i] = joint.pitch * np.round(q[:, i] / joint.pitch)
            if not s.block.any():
                cells = cells * 3 + np.digitize(q[:, i], np.linspace(low, high, 4)[1:3])
    return replace(s, q=_written(s.machine, q), block=cells)


def _empty(machine: Machine, length: Array, set_id: Ints) -> Situation:
    n = len(length)
    blank, nothing, zero = np.zeros((n, len(machine.joints))), np.full(n, np.nan), np.zeros(n, dtype=int)
    none = Climate(np.zeros(1), {}, {}, 20.0)
    return Situation(
        machine, none, blank, blank, nothing, length, nothing, set_id, zero, zero, np.full((n, 3), np.nan), nothing
    )


def _dressed(rng: Generator, s: Situation, design: Design) -> Situation:
    """Approach directions, and the workpiece that lies on the table: every other set-up carries a heavy one."""
    direction = np.ones_like(s.q) if design.one_sided else rng.choice((-1.0, 1.0), s.q.shape)
    heavy = (s.set_id // 2 + s.set_id) % 2 if design.tools > 1 else np.zeros(len(s), dtype=int)
    loads = np.round(rng.uniform((10, 150), (70, 320)))
    return replace(s, direction=direction, load=loads[heavy])


def _written(machine: Machine, q: Array) -> Array:
    """Positions as a file with four decimals gives them."""
    return np.round(q / machine.units, 4) * machine.units


def _within_travel(machine: Machine, s: Situation) -> Situation:
    low = np.array([joint.low * joint.unit for joint in machine.joints])
    high = np.array([joint.high * joint.unit for joint in machine.joints])
    return s.rows(np.flatnonzero(np.all((s.q >= low) & (s.q <= high), axis=1)))


def _repeats(rng: Generator, n: int, design: Design) -> Ints:
    """Row numbers, some of them several times on end."""
    often = np.ones(n, dtype=int)
    often[rng.choice(n, min(design.repeated, n), replace=False)] += design.times
    return np.repeat(np.arange(n), often)


def _count_repeats(rows: Ints) -> Ints:
    """0, 1, 2 ... within a run of equal rows."""
    first = np.diff(rows, prepend=-1) != 0
    start = np.maximum.accumulate(np.where(first, np.arange(len(rows)), 0))
    return np.arange(len(rows)) - start


def _times(rng: Generator, rows: Ints, session: float) -> Array:
    """Some hours for the whole; a repeat takes 15 s, a new pose more."""
    fresh = np.diff(rows, prepend=-1) != 0
    steps = np.where(fresh, rng.uniform(0.5, 1.5, len(rows)), 0.0)
    pace = session / steps.sum()
    return np.round(np.cumsum(np.where(fresh, steps * pace, 15.0)), 1)


def held_out(rng: Generator, s: Situation, share: float = 0.25) -> Mask:
    """Rows of some whole cells of the pose space, none of them repeated poses: (n,) bool."""
    cells = rng.permutation(np.unique(s.block))
    chosen = cells[: max(1, round(share * len(cells)))]
    again = np.flatnonzero(s.repeat > 0)
    repeated = np.zeros(len(s), dtype=bool)
    repeated[again] = repeated[again - 1] = True
    result: Mask = np.isin(s.block, chosen) & ~repeated
    return result
