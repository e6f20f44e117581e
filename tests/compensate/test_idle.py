"""Pieces that do not move: a jump that the control's digits do not show leaves no empty block."""

from __future__ import annotations

import re

import numpy as np
import pytest

from ncfix.compensate.driver import fix_program
from ncfix.compensate.plan.written import standing_still, without_idle
from ncfix.control.setup import Setup
from ncfix.machine import loads
from ncfix.text.reader import read
from ncfix.writer.emit import Emission
from ncfix.writer.pieces import Pieces

MACHINE = """
topology = "w C B F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [0, 500] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [0, 450] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [0, 400] }
axis.B = { type = "rotary", direction = [0, -0.7071067811865476, 0.7071067811865476], point = [0, 0, 155] }
axis.C = { type = "rotary", direction = [0, 0, -1] }
[[effect]]
name = "EZX"
basis = "step"
positions = [250]
coefficients = [0.0, STEP]
"""
TURNING = b"G21 G90 G94 G54\nG0 X10 Y10 Z10 B0 C0\nG1 X210 Y60 F600\nG1 X480 C40\nM2\n"


@pytest.mark.parametrize("step", [0.0001, 0.0009, 0.002, 0.05])
@pytest.mark.parametrize("mode", ["G94", "G93"])
def test_a_jump_on_the_way_of_a_turning_axis_leaves_no_block_without_a_word(step: float, mode: str) -> None:
    source = TURNING.replace(b"G94", mode.encode()).replace(b"C40", b"C40 F2" if mode == "G93" else b"C40")
    source = source.replace(b"F600", b"F6") if mode == "G93" else source
    machine = loads(MACHINE.replace("STEP", str(step)))
    fixed = fix_program(read(source, "p.ngc", "linuxcnc"), machine, Setup(assume_zero=True))
    assert not fixed.report.refused
    lines = fixed.text.decode().splitlines()
    assert all(line.strip() for line in lines)
    if mode == "G93":  # the pieces take the time of the motion together
        times = [1 / float(found[1]) for line in lines if (found := re.search(r"C.*F([\d.]+)", line))][-2:]
        assert sum(times) == pytest.approx(1 / 2, rel=1e-3)


def written(*ends: float, start: float = 0.0, move: tuple[int, ...] = ()) -> tuple[Pieces, Emission]:
    n = len(ends)
    end = np.array(ends)[:, None]
    which = np.array(move or (0,) * n)
    starts = np.full((int(which[-1]) + 1, 1), start)
    no, nowhere = np.zeros(n, dtype=bool), np.full((n, 3), np.nan)
    pieces = Pieces(which, np.linspace(0, 1, n + 1)[1:], end, no, nowhere, no, np.arange(1.0, n + 1))
    return pieces, Emission(None, end, nowhere, starts, {}, 0)  # type: ignore[arg-type]


def idle(pieces: Pieces, emission: Emission) -> np.ndarray:
    return standing_still(pieces, emission.end, emission.start)


def test_what_does_not_move_is_dropped_and_the_last_piece_stays() -> None:
    assert idle(*written(1.0, 2.0, 3.0)).tolist() == [False, False, False]
    assert idle(*written(0.0, 2.0, 3.0)).tolist() == [True, False, False]
    assert idle(*written(1.0, 1.0, 3.0)).tolist() == [False, True, False]
    assert idle(*written(1.0, 3.0, 3.0)).tolist() == [False, True, False]
    assert idle(*written(0.0)).tolist() == [False], "a motion has a block, whatever it does"


def test_the_time_of_what_is_dropped_goes_to_the_next_piece() -> None:
    pieces, emission = written(1.0, 1.0, 3.0)
    left = without_idle([None], pieces, emission)  # type: ignore[arg-type]
    assert left.end[:, 0].tolist() == [1.0, 3.0]
    assert left.share is not None
    assert left.share.tolist() == [1.0, 5.0]
    pieces, emission = written(1.0, 2.0)
    assert without_idle([None], pieces, emission) is pieces  # type: ignore[arg-type]
