"""Short programs on LinuxCNC's interpreter and here: accepted or not, and where every motion leads.

`rs274` prints four decimals of program units, so positions agree to 1e-3 mm (inches: 0.0001 * 25.4 for each of the
offsets that are added), centres of arcs likewise.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from conftest import missing, some
from ncfix.control.moves import MotionKind, Moves
from ncfix.control.trace import trace
from ncfix.diagnostics import NcfixError
from ncfix.text.reader import read
from program import interpreter
from program.generated import Generator
from program.tracing import KNOWN

AXES = ("X", "Y", "Z", "A", "B", "C")
BLUR = 0.01
"""mm and degrees: four decimals of an inch, three times added, and some for the centres of flat R arcs."""


@pytest.fixture(scope="module", autouse=True)
def installed() -> None:
    if not interpreter.available():
        missing("rs274 (Debian: linuxcnc-uspace) is not installed", "NCFIX_REQUIRE_TOOLS")


def followed(text: str) -> Moves | None:
    """The motions, or None where the program is refused."""
    try:
        return trace(read(text.encode(), "part.ngc"), KNOWN, AXES, frozenset("ABC")).moves
    except NcfixError:
        return None


def positions(moves: Moves) -> list[tuple[MotionKind, np.ndarray, np.ndarray]]:
    """Kind, end in mm and degrees, and centre of the motions, those without a length left out."""
    ends = moves.end * np.where(moves.rotary, 180 / np.pi, 1.0)
    rows = zip(map(MotionKind, moves.kind.tolist()), ends, moves.centre, strict=True)
    return [row for row in rows if row[0] != MotionKind.DWELL]


def assert_agrees(text: str) -> None:
    code, stops = interpreter.run(text)
    moves = followed(text)
    assert (code == 0) == (moves is not None), text
    if moves is None:
        return
    at = 0
    before = np.zeros(len(AXES))
    for kind, end, centre in positions(moves):
        if kind != MotionKind.ARC and np.abs(end - before).max() < BLUR:
            continue
        here = next(i for i in itertools.count(at) if i >= len(stops) or matches(stops[i], kind, end))
        assert here < len(stops), f"nothing leads to {end}:\n{text}"
        if kind != MotionKind.CYCLE and MotionKind.CYCLE not in moves.kind:
            assert all(np.abs(np.array(stop.end) - before).max() < BLUR for stop in stops[at:here]), text
        if kind == MotionKind.ARC and not any(frame.rotation[0, 1] for frame in moves.frames):
            assert np.sort(np.abs(np.array(stops[here].centre) - centre))[1] < 10 * BLUR, text
        at, before = here + 1, end


def matches(stop: interpreter.Stop, kind: MotionKind, end: np.ndarray) -> bool:
    """Whether a motion of the interpreter is this one."""
    return (kind == MotionKind.ARC) == (stop.centre is not None) and float(
        np.abs(np.array(stop.end) - end).max()
    ) < BLUR


ROUNDING = 42
"""There an R arc ends where it starts but for rounding errors, which differ."""


@pytest.mark.parametrize("seed", [seed for seed in range(some(60)) if seed != ROUNDING])
def test_generated_programs(seed: int) -> None:
    assert_agrees(Generator(seed).program())


PROGRAMS = (
    "G0 X1\nG10 L2 P1 R90\nG0 X2\nG0 Y1\nG91 X1",
    "G10 L2 P1 R78\nG28 X11\nG0 Y5",
    "F100 G0 Z10\nG99 G90 G81 X1 R2 Z-1\nG91 X1\nG90 X1",
    "F100 G91 G81 X1 R2 Z-1 L2\nX1\nX1 Z-2\nX1 R1",
    "T1 M6\nG10 L1 P1 Z10\nG43\nG43.2 H1\nG0 Z0",
    "G7 G0 X10\nG8 X10\nG7\nG0 @5 ^30",
    "G7 G91 G0 X10\nF9 G3 X4 I1",
    "G0 X5 Y5\nG92 X1 Y2\nG0 X0\nG92.2\nG0 X0\nG92.3\nG0 X0\nG52 X3\nX0\nG92.1\nX0",
    "F100 G18 G81 X1 Z3 Y-1 R1\nX2",
    "F9 S100\nG95 F1 G1 X1\nG93 G1 X2 F3\nG94 F10 G1 X3",
    "G20 F5\nG2 X2.0028 Y0 I1 J0\nG1 X5",
    "F9 G2 X200.11 Y0 I100 J0",
    "F9 G2 X20002.82 Y0 I10000 J0",
    "F9 G3 I2 P2\nG2 X1 Y1 R-3 P4",
    "G90.1 F9 G2 X2 Y0 I1 J0",
    "G53 G0 G91 X1",
    "M3 M5",
    "G0 X1 R5",
    "G1 X1",
    "o1 sub\nG0 X#1\no1 endsub\n#1=9\no1 call [2]\nG0 X#1",
    "o1 sub\no1 call\no1 endsub\no1 call",
    "o1 if [1]\no1 endif\no1 if [1]\no1 endif",
    "#1=0\no1 while [1]\n#1=[#1+1]\no2 if [#1 gt 3]\no1 break\no2 endif\no1 endwhile\nG0 X#1",
    "#1=0\no1 while [#1 lt 3]\n#1=[#1+1]\no1 break\no1 endwhile\no2 do\n#1=[#1+1]\no2 while [#1 lt 9]\nG0 X#1",
    "G0 X#<_feed> Y#<_plane> Z#<_coord_system>",
    "G0 X[2+3*4**2] Y[-7 mod 3] Z[5-3 gt 1 and 2]",
    "G0 Xround[-2.5] Yfix[-2.5] Zatan[1]/[-1]",
    "G43.1 Z3\nG0 Z0\nG49\nG0 Z0",
    "F9\no1 sub\nG1 X#1 Y#2\no1 endsub\no1 call (first) [1] (second) (of two) [2] (end)\no1 call [3] (y) [4] ; end",
    "F9 M3 S1\nG33 Z-5 K1\nG0 X1",
)


@pytest.mark.parametrize("text", PROGRAMS)
def test_single_cases(text: str) -> None:
    assert_agrees(f"{text}\nM2\n")
