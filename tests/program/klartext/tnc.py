"""Short Klartext programs: followed where everything is known and zero, and corrected on a small machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import Fixed, fix_program
from ncfix.control.moves import Moves, Trace
from ncfix.control.setup import Setup, Tool
from ncfix.control.trace import trace
from ncfix.machine import Machine, loads
from ncfix.text.reader import read
from program.tracing import ZERO

KNOWN = Setup(
    work_offsets={"PRESET": {}, "PRESET1": {"X": 5.0}}, tools=dict.fromkeys(range(9), Tool(0.0, 5.0)), initial=ZERO
)

THREE = loads(
    """
    ncfix = 1
    name = "three"
    topology = "w X F Y Z t"
    least_increment = { linear = 0.0001, rotary = 0.0001 }
    axis.X = { type = "linear", direction = [-1, 0, 0], range = [-900, 900] }
    axis.Y = { type = "linear", direction = [0, 1, 0], range = [-900, 900] }
    axis.Z = { type = "linear", direction = [0, 0, 1], range = [-900, 900] }
    tool = { direction = [0, 0, 1], point = [0, 0, 0] }
    effect = [
      { name = "EXX", basis = "polynomial", degree = [1, 2], scale = 300, coefficients = [0.03, 0.006] },
      { name = "EYX", basis = "polynomial", degree = [2], scale = 300, coefficients = [0.01] },
      { name = "EZY", basis = "polynomial", degree = [1, 2], scale = 300, coefficients = [-0.01, 0.004] },
      { name = "EC0Y", coefficients = [3e-5] },
    ]
    """
)
"""A machine with three axes and smooth errors of some tens of micrometres."""


def program(body: str, unit: str = "MM") -> bytes:
    """A Klartext program of these blocks."""
    lines = [line.strip() for line in body.strip().splitlines()]
    return "\n".join([f"BEGIN PGM T {unit}", *lines, f"END PGM T {unit}", ""]).encode("latin-1")


def follow(
    body: str,
    axes: str = "XYZ",
    setup: Setup = KNOWN,
    files: Mapping[str, str] | None = None,
    unit: str = "MM",
    **given: object,
) -> Trace:
    """The trace of these blocks."""
    texts = {name: text.encode() for name, text in (files or {}).items()}
    source = read(program(body, unit), "t.h", "heidenhain")
    return trace(source, replace(setup, **given), tuple(axes), frozenset("ABC") & set(axes), texts.get)  # type: ignore[arg-type]


def ends(body: str, axes: str = "XYZ", **more: object) -> list[list[float]]:
    """Where the motions end, mm and degrees, rounded to a millionth."""
    moves: Moves = follow(body, axes, **more).moves  # type: ignore[arg-type]
    values = np.where(moves.rotary, np.degrees(moves.end), moves.end)
    return [[round(float(value), 6) + 0.0 for value in row] for row in values]


def fixed(body: str, machine: Machine = THREE, setup: Setup = KNOWN, unit: str = "MM") -> Fixed:
    """The corrected program."""
    return fix_program(read(program(body, unit), "t.h", "heidenhain"), machine, setup, FixOptions(allow_refused=True))
