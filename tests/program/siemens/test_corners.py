"""Corners that the control rounds or breaks: the motions that meet there stay whole and in their plane."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import follow
from ncfix.control.moves import Moves
from ncfix.control.setup import Setup, Tool
from ncfix.machine import Machine, load
from ncfix.text.reader import read

SETUP = Setup(assume_zero=True, tools={0: Tool(80.0, 3.0), 1: Tool(80.0, 3.0)})
HEAD = "G710 G17 G90 G94 G54\nT1 D1 M6\nG0 X-100 Y-150 Z50 A0 C0\nG1 F500\n"


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(str(root / "examples/machines/wCAYFXZSt.toml"))


def corrected(body: str, machine: Machine, head: str = HEAD) -> tuple[Moves, Moves, str]:
    """The motions of a program and of what it is corrected to, and that text."""
    program = read(f"{head}{body}\nM30\n".encode(), "part.mpf", "siemens")
    fixed = fix_program(program, machine, SETUP, FixOptions(tolerance_um=0.5, figures=False))
    assert not fixed.report.refused
    both = (follow(each, machine, SETUP).trace.moves for each in (program, read(fixed.text, "part.mpf", "siemens")))
    before, after = both
    return before, after, fixed.text.decode()


@pytest.mark.parametrize("word", ["RND=80", "CHF=60", "CHR=60"])
def test_the_motions_at_a_corner_stay_whole_and_in_the_plane(word: str, machine: Machine) -> None:
    """A piece of 20 mm before a rounding of 80 would make it a smaller one, a word for Z none at all."""
    _, after, text = corrected(f"X100 {word}\nY150\nX-100", machine)
    lines = text.splitlines()
    at = next(row for row, line in enumerate(lines) if word in line)
    assert "Y-149.99" in lines[at]
    assert "Z" not in lines[at] + lines[at + 1]
    z = after.axes.index("Z")
    assert np.all(after.end[1:3, z] == after.end[0, z])
    assert len(after) > 5  # the third motion is split
    assert after.end[-1, z] != after.end[0, z]


def test_modal_rounding_goes_on_until_it_is_switched_off(machine: Machine) -> None:
    before, after, text = corrected("RNDM=5\nX100\nY150\nX-100\nRNDM=0\nY-150\nX100", machine)
    assert len(before) == 6
    assert "Z" not in text[text.index("RNDM=5") : text.index("RNDM=0")]
    z = after.axes.index("Z")
    assert len(after) > len(before)
    assert after.end[-1, z] != after.end[0, z]


def test_an_arc_at_a_corner(machine: Machine) -> None:
    before, after, _ = corrected("X60 RND=5\nG3 X60 Y-50 CR=50\nG1 X-100", machine)
    z = before.axes.index("Z")
    assert np.all(after.end[1:3, z] == after.end[0, z])


def test_a_motion_that_leaves_the_plane_by_itself_is_corrected_there(machine: Machine) -> None:
    before, after, _ = corrected("X100 Z40 RND=5\nY150", machine)
    z = before.axes.index("Z")
    assert after.end[1, z] != before.end[1, z]
    assert after.end[2, z] == after.end[1, z]


def test_both_lanes_agree(machine: Machine) -> None:
    """Behind a corner, many blocks at once and one by one."""
    blocks = [f"X{n} Y{n % 7} Z{n % 3}\n" for n in range(40)]
    many, single = (corrected("X90 RND=5\n" + other.join(blocks), machine)[0] for other in ("", "M8\n"))
    assert np.array_equal(many.whole, single.whole)
    assert many.whole.tolist() == [False, True, True] + [False] * 39
