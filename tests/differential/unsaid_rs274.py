"""Programs of LinuxCNC for `differential.unsaid`, and its interpreter as their second control.

LinuxCNC has no tilted planes and no tool-centre-point control. What leads its axes elsewhere than the words say are the
plane of arcs and cycles, turned work offsets (G10 L2 R), shifts (G92) and a table that is turned.
"""

from __future__ import annotations

import random
import re
from itertools import groupby
from typing import NamedTuple

import numpy as np

from differential import canon, errors, paths
from differential.segment import CYCLES
from differential.sinumerik_frames import Floats

FRAMES = ("plane", "rotation", "shift", "table")
OFFSETS = {"G54": (12.0, -7.5, 20.0)}
LENGTHS = {0: 0.0, 1: 64.0, 2: 81.5}
START = (0.0, 0.0, 250.0, 0.0, 0.0, 0.0)
CONTROLS = canon.Controls(
    offsets=OFFSETS,
    references={"G28": (0.0, 0.0, 300.0), "G30": (10.0, 20.0, 320.0)},
    tools={number: (length, 0.0) for number, length in LENGTHS.items() if number},
    initial=START,
)
SAMPLES = np.linspace(0.0, 1.0, 25)
ACROSS = {"G17": 2, "G18": 1, "G19": 0}


class Motion(NamedTuple):
    """A motion: its mark, line, sort (rapid, cut, hole, fixed), and the tip (n, 3) mm."""

    mark: int
    line: int
    sort: str
    tip: Floats


def number(dice: random.Random, low: float = -25.0, high: float = 25.0) -> str:
    """A number with three decimals."""
    return f"{dice.uniform(low, high):.3f}"


def place(dice: random.Random, letters: str) -> dict[str, str]:
    """Places of some axes; heights are above the part."""
    return {letter: number(dice, 12.0, 30.0) if letter == "Z" else number(dice) for letter in letters}


def words(given: dict[str, str]) -> str:
    """Axis words."""
    return " ".join(f"{letter}{value}" for letter, value in given.items())


def text(frame: str, event: str, many: str, dice: random.Random) -> list[str]:
    """A program."""
    plane = dice.choice(("G18", "G19")) if frame == "plane" and event != "side" else "G17"
    deep = "XYZ"[ACROSS[plane]]
    over = "XYZ".replace(deep, "")
    frames = {
        "plane": [plane],
        "rotation": [f"G10 L2 P1 R{number(dice, -80, 80)}"],
        "shift": [f"G92 {dice.choice(('X3. Y-4. Z61.', 'X2.', 'Z58.5', 'X1. Y1.'))}"],
        "table": ["G0 A12. C20."],
    }
    elsewhere = dice.choice(("Z", "XY", "X", "Y", "XYZ"))
    machine = " ".join({"X": "X20.", "Y": "Y-15.", "Z": "Z250."}[letter] for letter in elsewhere)
    hole = f"{dice.choice(('G98', 'G99'))} {dice.choice(('G81', 'G82 P0.1', 'G83 Q7.', 'G85'))}"
    hole += f" {words(place(dice, over))} {deep}-32.5 R32.5"
    events = {
        "cycle": [f"G0 {deep}40.", hole, words(place(dice, dice.choice(over))), "G80"],
        "side": [f"G41 D2 G1 {words(place(dice, 'XY'))}", f"X{number(dice)}", dice.choice(("G40 Z25.", "G40"))],
        "machine": [f"G53 G{dice.choice('01')} {machine}"],
        "tool": ["T2 M6", "G43 H2"],
    }
    one = [dice.choice("XYZ") for _ in range(4)] + ["X", "Y"]
    tail = [f"G{dice.choice('0111')} {words(place(dice, each))}" for each in (one if many == "one" else ["XYZ"] * 3)]
    if event == "cycle" or dice.random() < 0.3:
        again = f"G0 {deep}40.\n{hole if many == 'all' else f'G98 G81 {over[0]}7. {deep}-32. R36.'}\nG80"
        tail.insert(dice.randint(0, len(tail)), again)
    head = ["G17 G21 G40 G49 G80 G90 G94 G98", "T1 M6", "G54", "G43 H1", "G0 X0. Y0. Z60. A5. C10.", "F1000."]
    start = f"G0 {words(place(dice, 'XY'))} Z30."
    lines = [*head, *frames[frame], start, "G1 Z26.", *events[event], *tail, "M2"]
    return "\n".join(lines).split("\n")


def steps(model: errors.Machine, program: str, actual: bool) -> list[Motion]:
    """What LinuxCNC makes of a program on a machine, as meant or as it does it; the radius of the cutter is zero.

    Of a cycle its deepest place counts. Raises `NotImplementedError` where LinuxCNC stops.
    """
    followed = canon.interpret(program.encode(), CONTROLS)
    if not followed.accepted:
        raise NotImplementedError(followed.error)
    lines = program.splitlines()
    marks, mark = [0], 0
    for line in lines:
        mark = int(found[1]) if (found := re.search(r"\(#(\d+)\)", line)) else mark
        marks.append(mark)
    plane, planes = "G17", ["G17"]
    for line in lines:
        plane = found[0] if (found := re.search(r"G1[789](?!\d)", line)) else plane
        planes.append(plane)
    rows = np.repeat(np.arange(len(followed)), len(SAMPLES))
    q = paths.at(followed, rows, np.tile(SAMPLES, len(followed)))
    length = np.array([LENGTHS[int(each)] for each in followed.tool[rows]])
    tips = (model.actual_tip(q, length) if actual else model.tip(q, length)).reshape(-1, len(SAMPLES), 3)

    def sort(row: int) -> str:
        if int(followed.mode[row]) in CYCLES:
            return "hole"
        if "G53" in lines[followed.line[row] - 1]:
            return "fixed"
        return "rapid" if followed.kind[row] == canon.RAPID else "cut"

    found = []
    groups = groupby(range(len(followed)), key=lambda row: (marks[followed.line[row]], sort(row)))
    for (mark, kind), group in groups:
        members = list(group)
        if kind == "hole":
            across = ACROSS[planes[followed.line[members[0]]]]
            members = [min(members, key=lambda row: followed.end[row, across])]
        line = int(followed.line[members[0]])
        found.append(Motion(mark, line, kind, np.concatenate([tips[row] for row in members])))
    return found
