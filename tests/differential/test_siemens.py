"""Corrected SINUMERIK programs against an interpreter and a model of the machine that share nothing with the product.

`NCFIX_SIEMENS=300 pytest tests/differential/test_siemens.py` judges as many programs.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest

from conftest import FULL
from differential import errors, sinumerik
from differential.sinumerik_frames import Floats
from differential.sinumerik_motions import Path as Way
from differential.sinumerik_programs import Author, looped, patterned
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_flat, fix_program
from ncfix.control.setup import Setup, Tool
from ncfix.machine import load
from ncfix.text.reader import read

PROGRAMS = int(os.environ.get("NCFIX_SIEMENS", "4" if FULL else "2"))
OFFSETS = {54: (0.0, 0.0, 60.0), 55: (5.0, -7.0, 70.0), 505: (-3.0, 4.0, 65.0)}
LENGTHS = {1: 80.0, 2: 95.0}
START = {"X": 0.0, "Y": 0.0, "Z": 250.0, "A": 0.0, "C": 0.0}
SETUP = Setup(
    work_offsets={f"G{n}": dict(zip("XYZ", shift, strict=True)) for n, shift in OFFSETS.items()} | {"G500": {}},
    tools={number: Tool(length, 3.0) for number, length in LENGTHS.items()},
    initial=START,
    variables={"$SC_TOOL_LENGTH_CONST": 17.0},
)
MACHINE = "examples/machines/wCAYFXZSt.toml"
AT_ENDS = 0.3e-3
"""mm: rounding of three linear axes and what half a step of a rotary axis moves the tip by."""
ON_THE_WAY = 1.6e-3
"""mm: the tolerance asked for, rounding, and the chords of the samples."""
TURNED = 0.2
"""Degrees that a rotary axis may be corrected by."""


def judged(text: str, root: Path, strategy: str, flat: bool = False) -> tuple[float, float, int]:
    """The worst distance of ends and of ways from where they should be, mm, and how many lines were judged.

    Where an axis had to be left, as across the plane at a rounded corner, it may be off by as much as was said.
    """
    text = sinumerik.marked(text)
    program = read(text.encode(), "part.mpf", "siemens")
    options = FixOptions(strategy=strategy, figures=False, flatten=flat)
    fixed = (fix_flat if flat else fix_program)(program, load(str(root / MACHINE)), SETUP, options)
    left = {refusal.line for refusal in fixed.report.refused}
    left |= {note.place.line for note in fixed.report.warnings if note.place and "must not be split" in note.text}
    said: dict[int, float] = {}
    for axis in fixed.report.left:
        for first, last in axis.stretches:
            said |= {line: said.get(line, 0.0) + axis.most for line in range(first, last + 1) if not axis.rotary}
    model = errors.load(root / MACHINE)
    meant, done = (by_mark(model, each, actual=n == 1) for n, each in enumerate((text, fixed.text.decode())))
    assert list(meant) == list(done)
    worst, judged_lines, fresh = [0.0, 0.0], 0, True
    for mark, (ways, tips) in meant.items():
        kind, line = ways[0].sort, ways[0].line
        if kind != "cut" or line in left:
            fresh = True  # what follows may begin where nothing was corrected
        if kind == "fixed" or line in left:
            continue
        turned = (ways[-1].q[-1] - done[mark][0][-1].q[-1])[3:]
        assert np.abs((turned + 180.0) % 360.0 - 180.0).max() < TURNED, f"line {line}"
        off = said.get(line, 0.0)
        worst[0] = max(worst[0], float(np.linalg.norm(tips[-1] - done[mark][1][-1])) - off)
        if kind == "cut" and not fresh:
            worst[1] = max(worst[1], apart(tips, done[mark][1][1:]) - off, apart(done[mark][1], tips[1:]) - off)
        fresh, judged_lines = False, judged_lines + 1
    return worst[0], worst[1], judged_lines


def by_mark(model: errors.Machine, text: str, actual: bool) -> dict[tuple[int, int], tuple[list[Way], Floats]]:
    """The motions of a program and the way of the tip (n, 3), by the mark they belong to, in order of execution."""
    ways = sinumerik.control_of(model, START, offsets=OFFSETS, tools=LENGTHS).run(text)
    pairs = zip(ways, sinumerik.tips(model, ways, actual), strict=True)
    groups = [list(group) for _, group in groupby(pairs, key=lambda pair: pair[0].mark)]
    return {
        (place, group[0][0].mark[0]): ([way for way, _ in group], np.concatenate([tip for _, tip in group]))
        for place, group in enumerate(groups)
    }


def apart(path: Floats, points: Floats) -> float:
    """How far the farthest of points (k, 3) is from a polygon (n, 3)."""
    start, way = path[:-1], np.diff(path, axis=0)
    size = np.maximum((way**2).sum(axis=1), 1e-30)
    worst = 0.0
    for point in points:
        along = np.clip(((point - start) * way).sum(axis=1) / size, 0.0, 1.0)
        worst = max(worst, float(((start + along[:, None] * way - point) ** 2).sum(axis=1).min()))
    return worst**0.5


@pytest.mark.parametrize("strategy", ["rotary-then-linear", "full"])
def test_corrected_programs_do_what_was_meant(strategy: str, root: Path, figures: Callable[[str], None]) -> None:
    ends, ways, lines = 0.0, 0.0, 0
    for seed in range(PROGRAMS):
        at_end, on_way, count = judged(Author(seed).program(), root, strategy)
        assert at_end < AT_ENDS, f"program {seed}"
        assert on_way < ON_THE_WAY, f"program {seed}"
        ends, ways, lines = max(ends, at_end), max(ways, on_way), lines + count
    figures(
        f"siemens judged, {strategy}: {PROGRAMS} programs, {lines} lines with motions, "
        f"worst end {ends * 1e3:.3f} um, worst on the way {ways * 1e3:.3f} um"
    )


def test_flat_programs_do_what_was_meant(root: Path, figures: Callable[[str], None]) -> None:
    ends, ways, lines = 0.0, 0.0, 0
    for seed in range(max(PROGRAMS // 4, 1)):
        at_end, on_way, count = judged(looped(seed), root, "rotary-then-linear", flat=True)
        assert at_end < AT_ENDS, f"program {seed}"
        assert on_way < ON_THE_WAY, f"program {seed}"
        ends, ways, lines = max(ends, at_end), max(ways, on_way), lines + count
    figures(
        f"siemens judged, --flatten: {lines} motions, worst end {ends * 1e3:.3f} um, on the way {ways * 1e3:.3f} um"
    )


def test_patterns_of_holes_are_written_out(root: Path, figures: Callable[[str], None]) -> None:
    """Every bottom of every pattern, in its order; one block leads to all places of its pattern."""
    model, worst, places = errors.load(root / MACHINE), 0.0, 0
    for seed in range(PROGRAMS // 2):
        text = sinumerik.marked(patterned(seed))
        program = read(text.encode(), "part.mpf", "siemens")
        fixed = fix_flat(program, load(str(root / MACHINE)), SETUP, FixOptions(figures=False, flatten=True))
        assert not fixed.report.refused
        meant, done = (by_mark(model, each, actual=n == 1) for n, each in enumerate((text, fixed.text.decode())))
        for mark, (ways, tips) in meant.items():
            if "HOLES" not in text.splitlines()[ways[0].line - 1]:
                continue
            last = np.cumsum([len(way.q) for way in ways]) - 1
            last = last[[way.sort == "hole" for way in ways]]
            off = np.linalg.norm(tips[last] - done[mark][1][last], axis=1)
            worst, places = max(worst, float(off.max())), places + len(off)
    assert worst < AT_ENDS
    figures(f"siemens judged, patterns, --flatten: {places} bottoms of holes, worst {worst * 1e3:.3f} um")


def test_the_judge_tells_what_is_wrong(root: Path) -> None:
    """A program that is left as it is is off by some micrometres everywhere."""
    model = errors.load(root / MACHINE)
    text = sinumerik.marked(Author(1).program())
    meant, real = (by_mark(model, text, actual) for actual in (False, True))
    assert all(np.linalg.norm(meant[mark][1][-1] - real[mark][1][-1]) > 1e-3 for mark in meant)
