"""Programs as shops have them, with what becomes of each line worked out by hand in a comment behind it.

`;@ X10 Y-2.5` (Fanuc: `(@ X10 Y-2.5)`): the block is corrected, and its motion ends there, mm and degrees, in the
coordinates of the work offset; `;@ passed` and `;@ refused`: its bytes stay. Lines with a motion and without such a
comment do not occur. `;@ flatten` anywhere: the program is corrected flat, and nothing of it is refused.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_flat, fix_program
from ncfix.compensate.following import follow
from ncfix.control.moves import MotionKind, Moves, Rule
from ncfix.control.setup import Setup, Tool
from ncfix.machine import Machine
from ncfix.text.reader import read

Lines = np.typing.NDArray[np.int64]

MARK = re.compile(r"[;(]@ *(?P<what>[^)\n]*)")
DIALECT = re.compile(r"[;(]@ *dialect (?P<name>\w+)")
FLAT = "flatten"
NEAR = 1e-3
"""mm and degrees: what is worked out by hand has so many digits."""

SYSTEMS = ("G54", "G55", "G500", "G505", "G54.1P1", "G54.1P2", "PRESET", "PRESET1", "PRESET2")
NAMES = ("CUTTER 10", "DRILL 8", "PROBE_6", "2 D2")
SETUP = Setup(
    work_offsets={name: dict.fromkeys("XYZAC", 0.0) for name in SYSTEMS},
    tools={number: Tool(0.0, 3.0) for number in range(10)},
    named_tools={name: Tool(0.0, 3.0) for name in NAMES},
    initial={"X": 0.0, "Y": 0.0, "Z": 290.0, "A": 0.0, "C": 0.0},
    references={code: {"X": 0.0, "Y": 0.0, "Z": 290.0, "A": 0.0, "C": 0.0} for code in ("G28", "G30")},
    no_point="calculator",
)
"""No offsets and tools of no length, so that a command is what the program says."""


def marks(text: str) -> dict[int, str]:
    """What the comments say, by line."""
    found = ((line, MARK.search(words)) for line, words in enumerate(text.splitlines(), 1))
    pairs = {line: match["what"].strip() for line, match in found if match}
    return {line: what for line, what in pairs.items() if what != FLAT and not what.startswith("dialect")}


def faults(path: Path, dialect: str, machine: Machine) -> list[str]:
    """What became of a program otherwise than its comments say; empty if all is as they do."""
    source = path.read_bytes()
    text = source.decode()
    named = DIALECT.search(text)
    program = read(source, path.name, named["name"] if named else dialect)
    assert program.source == source
    flat = f"@ {FLAT}" in text
    moves = follow(program, machine, SETUP).trace.moves
    options = FixOptions(figures=False)
    report = (fix_flat if flat else fix_program)(program, machine, SETUP, options).report
    refused = {each.line: each.reason for each in report.refused}
    if flat:
        return [f"{line}: {why}" for line, why in refused.items()]
    lines = np.array([program.line(int(block)) for block in moves.block])
    return [*lines_left_out(moves, lines, text), *wrong_lines(moves, lines, text, refused)]


def refused(path: Path, dialect: str, machine: Machine, setup: Setup) -> list[int]:
    """The lines of which a motion is refused."""
    source = path.read_bytes()
    named = DIALECT.search(source.decode())
    program = read(source, path.name, named["name"] if named else dialect)
    moves = follow(program, machine, setup).trace.moves
    return sorted({program.line(int(block)) for block in moves.block[moves.rule == Rule.REFUSE]})


def lines_left_out(moves: Moves, lines: Lines, text: str) -> list[str]:
    """Lines with a motion of which no comment says what becomes of it."""
    known = marks(text)
    moving = {int(line) for line, kind in zip(lines, moves.kind, strict=True) if kind != MotionKind.DWELL}
    return [f"{line}: a motion, and no comment" for line in sorted(moving - known.keys())]


def wrong_lines(moves: Moves, lines: Lines, text: str, refused: dict[int, str]) -> list[str]:
    """Lines of which the comment says something else."""
    return [
        f"{line}: {what}: {found}"
        for line, what in marks(text).items()
        if (found := difference(moves, np.flatnonzero(lines == line), what, refused.get(line, "")))
    ]


def difference(moves: Moves, rows: np.typing.NDArray[np.int64], what: str, refused: str) -> str:
    """What became of the motions of a line, if it is not what the comment says."""
    rules = [Rule(int(moves.rule[row])) for row in rows]
    if not rules:
        return "no motion"
    if what in ("refused", "passed"):
        wanted = Rule.REFUSE if what == "refused" else Rule.PASS
        found = wanted in rules or (what == "refused" and bool(refused))
        return "" if found and Rule.CORRECT not in rules[1:] else f"{rules}"
    if refused:
        return refused
    row = rows[rules.index(Rule.CORRECT)] if Rule.CORRECT in rules else rows[0]
    end = np.where(moves.rotary, np.degrees(moves.end[row]), moves.end[row])
    wanted = {word[0]: float(word[1:]) for word in what.split()}
    off = {letter: end[moves.axes.index(letter)] - value for letter, value in wanted.items()}
    off |= {letter: (value + 180.0) % 360.0 - 180.0 for letter, value in off.items() if letter in "AC"}
    return "" if all(abs(value) < NEAR for value in off.values()) else f"{dict(zip(moves.axes, end, strict=True))}"
