"""Against another interpreter of SINUMERIK programs: CEAD's `nc-gcode-interpreter` (PyPI, MIT).

It knows frames that shift, IC, variables, branches and loops; what it does not know (G91, AC, functions, jumps) is not
in these programs. Nor is what it does otherwise than the manual: it adds a frame's shift again to an increment, keeps
the shifts of axes that TRANS does not name, and works `3+R1*2` out from the left. It computes in single precision.
"""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from conftest import missing, some
from ncfix.control.trace import trace
from ncfix.text.reader import read
from program.siemens.following import KNOWN

PROGRAMS = some(80)
TOLERANCE = 2e-7
"""Relative to the largest number: single precision has 6e-8."""


@pytest.fixture(scope="module")
def other() -> ModuleType:
    """The other interpreter."""
    try:
        import nc_gcode_interpreter
    except ImportError:
        missing("nc-gcode-interpreter is not installed", "NCFIX_REQUIRE_TOOLS")
        raise
    return nc_gcode_interpreter  # type: ignore[no-any-return]


def theirs(other: ModuleType, text: str) -> np.ndarray:
    """X Y Z after each block with a motion, as the other has it; it starts at nothing, which is zero here."""
    table, _ = other.nc_to_dataframe("G0 X0 Y0 Z0\n" + text)
    return np.array(table.select(["X", "Y", "Z"]).rows(), dtype=np.float64)[1:]


def ours(text: str) -> np.ndarray:
    """The same here."""
    program = read(("G0 X0 Y0 Z0\n" + text + "M30\n").encode(), "part.mpf", "siemens")
    return trace(program, KNOWN, ("X", "Y", "Z"), frozenset()).moves.end[1:]


class Author:
    """Writes programs of what both understand; every block that moves names an axis."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.lines = ["DEF REAL DEEP=-2.5", "DEF INT COUNT=0", "DEF INT COUNT1=0", "DEF INT COUNT2=0", "DEF REAL WIDE"]
        self.depth = 0
        self.shifts = self.chance.random() < 0.5

    def number(self) -> str:
        """A plain number."""
        return f"{self.chance.uniform(-200, 200):.{self.chance.randint(0, 3)}f}"

    def value(self) -> str:
        """A value after an equals sign."""
        pool = ["DEEP", "WIDE", "COUNT", "R[1]", "R[2]", self.number().lstrip("-")]
        first, second = self.chance.choice(pool), self.chance.choice(pool)
        forms = (first, f"{first}+{second}", f"{first}*2-{second}", f"({first}-{second})/4", f"3+({first}*2)")
        return self.chance.choice(forms)

    def word(self, letter: str) -> str:
        """One axis word in one of its forms."""
        forms = [f"{letter}{self.number()}", f"{letter}={self.value()}", f"{letter}=IC({self.number()})"]
        return self.chance.choice(forms[:2] if self.shifts else forms)

    def motion(self) -> str:
        """A block that moves."""
        letters = [letter for letter in "XYZ" if self.chance.random() < 0.6] or ["X"]
        words = [self.word(letter) for letter in letters]
        return self.chance.choice(("G0 ", "G1 ", "")) + " ".join(words)

    def statement(self) -> None:
        """One block, or a structure with blocks in it."""
        kind = self.chance.random()
        if kind < 0.55 or self.depth > 2:
            self.lines.append(self.motion())
        elif kind < 0.7:
            name = self.chance.choice(("WIDE", "DEEP", "R[1]", "R[2]"))
            self.lines.append(f"{name}={self.value()}")
        elif kind < 0.8 and self.shifts:
            shift = f"X{self.number()} Y{self.number()} Z{self.number()}"
            self.lines.append(self.chance.choice((f"TRANS {shift}", f"ATRANS {shift}")))
        elif kind < 0.9:
            self.structure(f"IF WIDE>{self.number()}", "ENDIF", otherwise=self.chance.random() < 0.5)
        else:
            name = f"COUNT{self.depth or ''}"
            self.structure(f"FOR {name}=1 TO {self.chance.randint(1, 3)}", "ENDFOR")

    def structure(self, begin: str, end: str, otherwise: bool = False) -> None:
        """A control structure."""
        self.depth += 1
        self.lines.append(begin)
        self.statement()
        if otherwise:
            self.lines.append("ELSE")
            self.statement()
        self.lines.append(end)
        self.depth -= 1

    def program(self) -> str:
        """A program of some length."""
        self.lines += ["R[1]=1.5", "R[2]=-20"]
        for _ in range(self.chance.randint(8, 25)):
            self.statement()
        return "\n".join(self.lines) + "\n"


def test_both_interpreters_come_to_the_same_positions(other: ModuleType, figures: Callable[[str], None]) -> None:
    worst, motions = 0.0, 0
    for seed in range(PROGRAMS):
        text = Author(seed).program()
        mine, reference = ours(text), theirs(other, text)
        assert mine.shape == reference.shape, f"program {seed}"
        off = np.abs(mine - reference).max(initial=0.0) / np.abs(reference).max(initial=1.0)
        worst, motions = max(worst, float(off)), motions + len(mine)
        assert off <= TOLERANCE, f"program {seed}"
    figures(f"nc-gcode-interpreter: {PROGRAMS} programs, {motions} motions, worst relative difference {worst:.1e}")


def test_a_program_of_the_world(
    other: ModuleType, shared: Callable[[str], Path], figures: Callable[[str], None]
) -> None:
    """The positions of a CAM program; arcs as lines, since what is left out between them would not let them close."""
    (path,) = (shared("corpus") / "siemens").glob("*CAM_TEST.MPF")
    allowed = re.compile(r"N\d+|G[0123]|G9[04]|[IJ]-?[\d.]+|F[\d.]+|(?P<position>[XYZ]-?[\d.]+)")
    text = ""
    for line in path.read_text("latin-1").splitlines():
        words = [allowed.fullmatch(word) for word in line.split()]
        positions = [word["position"] for word in words if word and word["position"]]
        text += f"{' '.join(positions)}\n" if positions and all(words) else ""
    mine, reference = ours(text), theirs(other, text)
    off = float(np.abs(mine - reference).max() / np.abs(reference).max())
    figures(f"nc-gcode-interpreter: CAM program of {len(mine)} motions, worst relative difference {off:.1e}")
    assert len(mine) > 900
    assert off <= TOLERANCE
