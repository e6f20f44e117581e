"""What became of each block of a short program, judged without the product's own bookkeeping.

The machine is off by a constant shift, so a block that is corrected ends exactly by that much beside where it ended
before, in whatever frame it is written; a block that is passed or refused has the bytes that it had.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import Fixed, fix_flat, fix_program
from ncfix.compensate.following import kinematics_of
from ncfix.control.moves import MotionKind, Moves
from ncfix.control.setup import Setup, Tool
from ncfix.control.trace import trace
from ncfix.diagnostics import NcfixError
from ncfix.machine import Machine, loads
from ncfix.text.reader import read

SHIFT = {"X": -0.0124, "Y": 0.0213, "Z": 0.0085}
"""mm, added to commands: minus the errors of the machine."""

AXIS = """
[axis.{0}]
type = "linear"
direction = [{1}]
[[effect]]
name = "E{0}{0}"
basis = "constant"
coefficients = [{2}]
"""
MACHINE = 'name = "shifted"\ntopology = "w F X Y Z t"\n' + "".join(
    AXIS.format(axis, direction, -SHIFT[axis])
    for axis, direction in (("X", "1, 0, 0"), ("Y", "0, 1, 0"), ("Z", "0, 0, 1"))
)
STEP = 0.001
SYSTEMS = ("G54", "G55", "G54.1P2", "G500", "preset")

SETUP = Setup(
    work_offsets={name: {"X": 10.0 * n, "Y": -5.0 * n, "Z": 3.0 * n} for n, name in enumerate(SYSTEMS)},
    tools={n: Tool(20.0 * n, 3.0) for n in range(10)},
    initial={"X": 0.0, "Y": 0.0, "Z": 200.0},
    references={"G28": {"X": 0.0, "Y": 0.0, "Z": 300.0}, "G30": {"X": 1.0, "Y": 1.0, "Z": 290.0}},
    no_point="calculator",
)


@dataclass(frozen=True, slots=True)
class Case:
    """A class of block, a program that has one, and what shall become of its lines.

    expected  line -> "right", "passed" or "refused"; lines not named hold no motion, or lead to the place
    """

    name: str
    text: str
    expected: dict[int, str]
    flat: bool = False


def machine() -> Machine:
    """Three axes, each off by its share of the shift."""
    return loads(MACHINE + "\n[tool]\ndirection = [0, 0, 1]\npoint = [0, 0, 0]\n")


def judged(case: Case, dialect: str) -> dict[int, str]:
    """What became of each line that has a motion: "right", "passed", "refused", or what is wrong."""
    known = machine()
    program = read(case.text.encode(), "part", dialect)
    options = FixOptions(tolerance_um=50.0, verify=False)
    try:
        fixed = (fix_flat if case.flat else fix_program)(program, known, SETUP, options)
    except NcfixError as error:
        place = error.messages[0].place
        return {place.line if place else 0: "refused"}
    before = followed(case.text.encode(), known, dialect)
    after = followed(fixed.text, known, dialect)
    refused = {each.line for each in fixed.report.refused}
    if case.flat:
        return {} if refused else by_motion(before, after)
    return by_line(case, fixed, before, after, refused)


def followed(source: bytes, known: Machine, dialect: str) -> Moves:
    """The motions of a text."""
    program = read(source, "part", dialect)
    return trace(program, SETUP, known.axis_names, frozenset(), kinematics=kinematics_of(known)).moves


def by_motion(before: Moves, after: Moves) -> dict[int, str]:
    """Motion by motion, where the lines are others: all of them or none."""
    rows, flat = (np.flatnonzero(moves.kind != MotionKind.DWELL) for moves in (before, after))
    if len(rows) != len(flat):
        return {0: f"{len(rows)} motions became {len(flat)}"}
    off = after.end[flat] - before.end[rows] - np.array(list(SHIFT.values()))
    return {0: "right" if np.abs(off).max() <= STEP else f"off by {np.abs(off).max():.4f} mm"}


def by_line(case: Case, fixed: Fixed, before: Moves, after: Moves, refused: set[int]) -> dict[int, str]:
    """Line by line."""
    lines, new = case.text.splitlines(), fixed.text.decode().splitlines()
    if fixed.changed:
        stamp = next(n for n, line in enumerate(new) if "ncfix" in line.lower())
        del new[stamp]
    if len(lines) != len(new):
        return {0: f"{len(lines)} lines became {len(new)}"}
    found = {}
    ends = [{int(block): moves.end[row] for row, block in enumerate(moves.block)} for moves in (before, after)]
    for row, block in enumerate(before.block.tolist()):
        line = block + 1
        if before.kind[row] == MotionKind.DWELL:
            continue
        shifted = ends[1].get(block + (1 if fixed.changed and block >= stamp else 0))
        off = np.inf if shifted is None else shifted - ends[0][block] - np.array(list(SHIFT.values()))
        if line in refused:
            found[line] = "refused" if lines[block] == new[block] else "refused and changed"
        elif np.abs(off).max() <= STEP:
            found[line] = "right"
        else:
            found[line] = "passed" if lines[block] == new[block] else f"off by {np.abs(off).max():.4f} mm"
    return found
