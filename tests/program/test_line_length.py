"""A corrected line that grows beyond what the control takes: the block is left as it was, and said so."""

from __future__ import annotations

import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.control.setup import Setup, Tool
from ncfix.testing.judging import shifted_machine
from ncfix.text.reader import read

LIMIT = 252
SETUP = Setup(work_offsets={"G54": {}}, tools={0: Tool(0.0)}, initial={"X": 0.0, "Y": 0.0, "Z": 200.0})


def padded(block: str, length: int) -> str:
    return f"{block} ({'-' * (length - len(block) - 3)})"


@pytest.mark.parametrize("length", range(244, LIMIT + 1))
@pytest.mark.parametrize("block", ["G1 X5 F100", "G0 X5", "G2 X3 Y5 R3 F100"])
def test_no_line_grows_beyond_what_the_control_takes(block: str, length: int) -> None:
    text = f"G21 G90 G17 G54 G94\nG0 X1 Y2 Z3\n{padded(block, length)}\nG1 X7 Y7 Z3 F100\nM2\n"
    fixed = fix_program(
        read(text.encode(), "c.ngc"), shifted_machine(), SETUP, FixOptions(tolerance_um=50.0, figures=False)
    )
    assert max(map(len, fixed.text.splitlines())) <= LIMIT
    refused = {each.line for each in fixed.report.refused}
    assert (3 in refused) == (padded(block, length) in fixed.text.decode())
    assert all("characters" in each.reason for each in fixed.report.refused if each.line == 3)
    assert (3 in refused) or length < LIMIT
