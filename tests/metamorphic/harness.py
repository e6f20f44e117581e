"""One path written in two ways must be corrected to one path: the harness for all dialects.

A `Route` is a path without a language. A relation is a pair of functions that write it as a program; both programs are
corrected, read and followed again, and the axis positions at the ends of all motions are compared. The number of pairs
is small unless `NCFIX_PAIRS` says otherwise (`make metamorphic`: 500).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import kinematics_of, rotary_names, with_workpiece
from ncfix.compensate.plan.kinematics import joints_from_commands
from ncfix.control.moves import MotionKind, Moves
from ncfix.control.setup import Setup, Tool
from ncfix.control.trace import trace
from ncfix.machine import Machine
from ncfix.text.reader import read

PAIRS = int(os.environ.get("NCFIX_PAIRS", "3"))
TOGETHER = 10
"""So many routes make one program where there are more of them."""

LENGTH = 80.0
SETUP = Setup(
    work_offsets={"G54": {"X": 0.0, "Y": 0.0, "Z": 60.0, "A": 0.0, "B": 0.0, "C": 0.0}},
    tools={0: Tool(LENGTH, 3.0), 1: Tool(LENGTH, 3.0)},
    initial={"X": 0.0, "Y": 0.0, "Z": 290.0, "A": 0.0, "B": 0.0, "C": 0.0},
    no_point="IS-B",
)
OPTIONS = FixOptions(tolerance_um=50.0, figures=False)
"""So wide that nothing is split, and the motions of both programs are the same ones."""


@dataclass(frozen=True, slots=True)
class Step:
    """One motion: 0 rapid, 1 straight, 2 and 3 arcs about `centre` in the plane XY; mm and degrees."""

    code: int
    x: float
    y: float
    z: float
    centre: tuple[float, float] = (0.0, 0.0)
    a: float = 0.0
    c: float = 0.0


Route = Sequence[Step]
Write = Callable[[Route], str]


@dataclass(frozen=True, slots=True)
class Relation:
    """Two ways to write a route, and how far (mm, degrees) the corrected ends may be apart for their rounding alone.

    joins  routes may be written one behind the other, which many are
    """

    name: str
    left: Write
    right: Write
    apart: float
    rotary: bool = False
    joins: bool = True


def route(rng: np.random.Generator, rotary: bool) -> Route:
    """A path of a dozen motions in the middle of the machine, on whole hundredths."""
    x, y, z = (round(v, 2) for v in rng.uniform(-40, 40, 3))
    steps = [Step(0, x, y, 60 + z)]
    for _ in range(11):
        a, c = (round(v, 1) for v in rng.uniform((-40, -90), (40, 90))) if rotary else (0.0, 0.0)
        if not rotary and rng.random() < 0.3:
            steps.append(arc(rng, steps[-1]))
        else:
            x, y, z = (round(v, 2) for v in rng.uniform(-40, 40, 3))
            steps.append(Step(int(rng.integers(2)), x, y, 60 + z, a=a, c=c))
    return steps


def arc(rng: np.random.Generator, before: Step) -> Step:
    """A quarter of a circle in the plane XY from where a step ends, its centre towards the middle."""
    radius = round(float(rng.uniform(2, 15)), 2)
    side = -1.0 if before.x > 0 else 1.0
    clockwise = bool(rng.integers(2))
    centre = round(before.x + side * radius, 2), before.y
    up = side if clockwise else -side
    return Step(2 if clockwise else 3, centre[0], round(before.y + up * radius, 2), before.z, centre)


def corrected(text: str, dialect: str, machine: Machine) -> Moves:
    """The motions of the corrected program."""
    program = read(text.encode(), "part", dialect)
    fixed = fix_program(program, machine, SETUP, OPTIONS)
    assert not fixed.report.refused, (fixed.report.refused, text)
    assert fixed.changed
    again = read(fixed.text, "part", dialect)
    names, rotary = machine.axis_names, rotary_names(machine)
    return trace(again, SETUP, names, rotary, kinematics=kinematics_of(machine)).moves


def ends(moves: Moves, machine: Machine) -> NDArray[np.float64]:
    """Axis positions at the ends of the motions, mm and degrees."""
    rows = np.flatnonzero(moves.kind != MotionKind.DWELL)
    lengths = np.nan_to_num(moves.length_under_tcp[rows])
    q = joints_from_commands(with_workpiece(machine, SETUP), moves.end[rows], moves.tcp[rows], lengths)
    return np.where(machine.rotary, np.degrees(q), q)


_known: dict[tuple[str, str, str], NDArray[np.float64]] = {}
"""Corrected ends by text, dialect and machine: many relations have one side in common."""


def known_ends(text: str, dialect: str, machine: Machine) -> NDArray[np.float64]:
    """`ends` of a corrected program, worked out once."""
    key = text, dialect, machine.hash
    if key not in _known:
        _known[key] = ends(corrected(text, dialect, machine), machine)
    return _known[key]


def worst(relation: Relation, dialect: str, machine: Machine, pairs: int = PAIRS) -> float:
    """The largest distance between corrected ends over generated pairs, mm or degrees."""
    rng = np.random.default_rng(20261121)
    found, together = 0.0, TOGETHER if relation.joins and pairs > TOGETHER else 1
    for first in range(0, pairs, together):
        count = min(together, pairs - first)
        path = [step for _ in range(count) for step in route(rng, relation.rotary)]
        left, right = (known_ends(write(path), dialect, machine) for write in (relation.left, relation.right))
        assert left.shape == right.shape, (relation.left(path), relation.right(path))
        found = max(found, float(np.abs(left - right).max()))
    return found
