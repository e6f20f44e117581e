"""Short programs followed on a machine whose offsets, tools and start position are known, and what came of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ncfix.control.moves import Trace
from ncfix.control.setup import Setup, Tool
from ncfix.control.trace import trace
from ncfix.text.reader import read

LETTERS = "XYZABC"
ZERO = dict.fromkeys(LETTERS, 0.0)
SYSTEMS = ("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")

KNOWN = Setup(
    work_offsets=dict.fromkeys(SYSTEMS, ZERO),
    tools={number: Tool(0.0, 5.0) for number in range(20)},
    initial=ZERO,
    references={"G28": ZERO, "G30": ZERO},
)
"""Everything is known and zero."""

NOTHING = Setup()
"""Nothing is known."""


def follow(
    text: str,
    axes: str = "XYZ",
    setup: Setup = KNOWN,
    dialect: str = "linuxcnc",
    files: Mapping[str, str] | None = None,
    **given: object,
) -> Trace:
    """The trace of a program; an M2 is put at its end. `given` replaces fields of the setup."""
    program = read(f"{text}\nM2\n".encode(), "part.ngc", dialect)
    texts = {name: content.encode() for name, content in (files or {}).items()}
    return trace(program, replace(setup, **given), tuple(axes), frozenset("ABC") & set(axes), texts.get)  # type: ignore[arg-type]


def ends(followed: Trace) -> list[list[float]]:
    """Where the motions end, mm and degrees, rounded to 1e-9."""
    moves = followed.moves
    degrees = np.where(moves.rotary, 180 / np.pi, 1.0)
    return [[round(value, 9) + 0.0 for value in row] for row in (moves.end * degrees).tolist()]


def last(followed: Trace) -> list[float]:
    """Where the last motion ends."""
    return ends(followed)[-1]


def reasons(followed: Trace) -> list[str]:
    """Why each motion is passed or refused; empty for those that may be corrected."""
    return [followed.moves.reasons[index] for index in followed.moves.reason]
