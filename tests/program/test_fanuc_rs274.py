"""Fanuc programs without macros against LinuxCNC's interpreter: where both mean the same, so do the motions."""

from __future__ import annotations

import random
from collections.abc import Callable

import numpy as np
import pytest

from conftest import missing, some
from ncfix.control.moves import MotionKind
from ncfix.control.trace import trace
from ncfix.text.reader import read
from program import interpreter
from program.tracing import KNOWN

AXES = ("X", "Y", "Z", "A", "B", "C")
BLUR = 0.01
"""mm and degrees; `rs274` prints four decimals, of inches too, and positions are sums of a few."""


@pytest.fixture(scope="module", autouse=True)
def installed() -> None:
    if not interpreter.available():
        missing("rs274 (Debian: linuxcnc-uspace) is not installed", "NCFIX_REQUIRE_TOOLS")


def number(rng: random.Random, low: float = -30.0, high: float = 30.0) -> str:
    return f"{rng.uniform(low, high):.3f}"


def straight(rng: random.Random) -> str:
    words = "".join(f"{letter}{number(rng)}" for letter in "XYZAC" if rng.random() < 0.5)
    return rng.choice(("G0", "G1")) + words


def arc(rng: random.Random) -> str:
    """Half a circle or a helix in the plane XY, or a full circle."""
    radius = rng.uniform(1.0, 9.0)
    if rng.random() < 0.3:
        return f"{rng.choice(('G2', 'G3'))}I{radius:.3f}J0."
    lift = f"Z{number(rng)}" if rng.random() < 0.4 else ""
    return f"G91{rng.choice(('G2', 'G3'))}X{2 * radius:.3f}Y0.{lift}I{radius:.3f}J0.\nG90"


def cycle(rng: random.Random) -> str:
    """Holes with the levels named in the first block."""
    code = rng.choice(("G81", "G82P1", "G83Q1.", "G85", "G86P1", "G89P1"))
    holes = "".join(f"\nX{number(rng)}Y{number(rng)}" for _ in range(rng.randint(0, 2)))
    levels = f"Z{number(rng, -9, -1)}R{number(rng, 1, 9)}"
    return f"{rng.choice(('G98', 'G99'))}{code}X{number(rng)}Y{number(rng)}{levels}{holes}\nG80"


def setting(rng: random.Random) -> str:
    shift = f"X{number(rng)}Y{number(rng)}Z{number(rng)}"
    return rng.choice(
        (f"G10L2P{rng.randint(1, 6)}{shift}", f"G5{rng.randint(4, 9)}", f"G52{shift}", "G20", "G21", "G28Z0.", "G4P1.")
    )


def program(seed: int) -> str:
    rng = random.Random(seed)
    parts: tuple[Callable[[random.Random], str], ...] = (straight, straight, straight, straight, arc, cycle, setting)
    lines = [rng.choice(parts)(rng) for _ in range(25)]
    return "G21G17G90G94G98F500.S500M3\nG0X0.Y0.Z50.\n" + "\n".join(lines) + "\nM30\n"


@pytest.mark.parametrize("seed", range(some(25)))
def test_the_interpreter_moves_where_the_trace_does(seed: int) -> None:
    text = program(seed)
    code, stops = interpreter.run(text)
    assert code == 0, text
    moves = trace(read(text.encode(), "part", "fanuc"), KNOWN, AXES, frozenset("ABC")).moves
    ends = (moves.end * np.where(moves.rotary, 180 / np.pi, 1.0))[moves.kind != MotionKind.DWELL]
    at = 0
    for end in ends:
        away = [float(np.abs(np.array(stop.end) - end).max()) for stop in stops[at:]]
        here = next((place for place, distance in enumerate(away) if distance < BLUR), None)
        assert here is not None, (end, text)
        at += here
    assert len(ends) > 10
