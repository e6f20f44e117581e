"""Corners that a Fanuc control rounds or breaks by itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.control.setup import Setup
from ncfix.machine import Machine, load
from ncfix.text.reader import read
from ncfix_fanuc.macro.blocks import axes_of_corner
from program.tracing import follow, reasons

HEAD = "G21 G90 G17 G94 G54\nG0 X-150. Y-120. Z5.\nG1 Z-1. F300.\n"
CONTOUR = "X150. ,R8.\nY110. ,C4.\nX-150. ,R8.\nG4 P10\nY-120.\n"


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(str(root / "examples/machines/three_axis.toml"))


def corrected(body: str, machine: Machine) -> list[str]:
    program = read(f"{HEAD}{body}G0 Z50.\nM30\n".encode(), "part", "fanuc")
    setup = Setup(assume_zero=True, no_point="calculator")
    found = fix_program(program, machine, setup, FixOptions(figures=False))
    assert not found.report.refused
    return found.text.decode().splitlines()[4:]


def test_a_corner_stays_one_block_in_its_plane(machine: Machine) -> None:
    lines = corrected(CONTOUR, machine)
    written = [line for line in lines if ",R" in line or ",C" in line]
    assert len(written) == 3
    assert not any("Z" in line for line in lines[:5])
    plain = corrected(CONTOUR.replace(" ,R8.", "").replace(" ,C4.", ""), machine)
    assert len(plain) > len(lines)


def test_what_comes_after_has_its_height_again(machine: Machine) -> None:
    lines = corrected("X150. ,R8.\nY110.\nX149.\nX-150.\n", machine)
    assert not any("Z" in line for line in lines[:2])
    assert any("Z" in line for line in lines[2:-2])


def test_the_axes_of_a_corner_are_those_of_its_two_motions() -> None:
    program = read(b"G1 X1.\nX2. ,R1.\n(here)\nG2 Z5. R2.\nY3.\nG4 X1.\n", "part", "fanuc")
    found = [axes_of_corner(program, block) for block in (0, 1, 3, 4)]
    assert found == [None, {"X", "Z"}, {"X", "Z"}, None]


def test_motions_at_a_corner_are_not_split() -> None:
    lines = "\n".join(f"X{n}." for n in range(1, 31))
    found = follow(f"F50.\nG1Y1.,R2.\n{lines}", dialect="fanuc")
    assert found.moves.whole.tolist() == [True, True] + [False] * 29
    assert not any(reasons(found))


def test_the_control_ends_where_the_text_says() -> None:
    found = follow("G1F50.X5.,R2.\nY4.,C1.\nX0.", dialect="fanuc")
    np.testing.assert_allclose(found.moves.end[:, :2], [[5, 0], [5, 4], [0, 4]])
