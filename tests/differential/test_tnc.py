"""Corrected Klartext against a second control and a second model of the machine: frames, holes, labels, parameters.

Whatever the program is, the machine with its errors must do what a perfect one does with the original: at the ends of
rapids, at the bottoms of holes, and along the way of feeds and arcs.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from conftest import some
from differential import errors
from differential.tnc import Floats, Tnc, Way
from differential.tnc_programs import Maker
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import Fixed, fix_flat
from ncfix.control.setup import Setup, Tool
from ncfix.machine import load
from ncfix.text.reader import read

FILE = Path(__file__).parent / "machines" / "three.toml"
LENGTHS, PRESETS = {0: 0.0, 1: 50.0, 2: 81.5}, {0: (10.0, -5.0, 20.0), 1: (-12.0, 7.0, 15.0)}
SETUP = Setup(
    work_offsets={f"PRESET{row or ''}": dict(zip("XYZ", place, strict=True)) for row, place in PRESETS.items()},
    tools={number: Tool(length, 3.0) for number, length in LENGTHS.items()},
    initial={"X": 0.0, "Y": 0.0, "Z": 300.0},
)
HALF = 0.5e-3
"""mm: half an output step."""

ENDS = np.sqrt(2) * HALF + 1e-5
"""mm: half a step along two axes of a frame may come together along one of the machine."""

ALONG = 1e-3 + np.sqrt(3) * HALF + 2e-4
"""mm: the tolerance, rounding in three axes, and the chords by which the judge sees arcs."""

WINDOW = 6.0
"""mm of path within which the nearest point is looked for."""

SEEDS = range(some(8))


def control() -> Tnc:
    """The control before it starts."""
    return Tnc(dict(LENGTHS), dict(PRESETS), np.array([0.0, 0.0, 300.0]))


def seen(ways: list[Way], model: errors.Machine) -> list[Way]:
    """Where a perfect machine would go if it did what this one does."""
    found = []
    for way in ways:
        q = np.zeros((len(way.points), 9))
        q[:, :3] = way.points
        points = way.points if way.kind == "machine" else model.embedded(q, way.length)[:, :3]
        found.append(Way(way.kind, points, way.line, way.length))
    return found


def sections(ways: list[Way]) -> list[tuple[str, Floats, int]]:
    """Feeds and arcs one after another are one path; of rapids, holes and machine coordinates the end counts."""
    found: list[tuple[str, list[Floats], int]] = []
    for way in ways:
        if way.kind in ("L", "C") and found and found[-1][0] == "path":
            found[-1][1].append(way.points)
        elif way.kind in ("L", "C"):
            found.append(("path", [way.points], way.line))
        else:
            found.append((way.kind, [way.points[-1:]], way.line))
    return [(kind, np.concatenate(points), line) for kind, points, line in found]


def farthest(points: Floats, path: Floats) -> float:
    """The largest distance of points from a path, each from the stretch at about the same length of way."""
    start, way = path[:-1], np.diff(path, axis=0)
    square = np.maximum((way**2).sum(axis=1), 1e-30)
    length = np.append(0.0, np.cumsum(np.linalg.norm(way, axis=1)))
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    scale = length[-1] / along[-1] if along[-1] > 0 else 1.0
    worst = 0.0
    for point, place in zip(points, along * scale, strict=True):
        first, last = np.searchsorted(length, (place - WINDOW, place + WINDOW)).tolist()
        near = slice(max(first - 1, 0), max(last, first + 1))
        share = np.clip(((point - start[near]) * way[near]).sum(axis=1) / square[near], 0, 1)
        worst = max(worst, float(np.linalg.norm(start[near] + share[:, None] * way[near] - point, axis=1).min()))
    return worst


def judged(text: str, fixed: Fixed, model: errors.Machine) -> dict[str, float]:
    """The worst distance (mm) of each kind of section from where it should be; rapids in machine height are passed."""
    before, after = sections(control().run(text)), sections(seen(control().run(fixed.text.decode()), model))
    assert [kind for kind, _, _ in before] == [kind for kind, _, _ in after]
    worst: dict[str, float] = {}
    earlier = ""
    for (kind, meant, _), (_, done, _) in zip(before, after, strict=True):
        left_alone, earlier = kind == "machine" or (kind == "rapid" and earlier == "machine"), kind
        if left_alone:
            continue
        off = max(farthest(done, meant), farthest(meant, done)) if kind == "path" else np.abs(done - meant).max()
        worst[kind] = max(worst.get(kind, 0.0), float(off))
    return worst


def fix(text: str) -> Fixed:
    """The corrected program, written out flat where it has to be."""
    return fix_flat(read(text.encode(), "t.h", "heidenhain"), load(str(FILE)), SETUP, FixOptions())


@pytest.mark.parametrize("seed", SEEDS)
def test_generated_programs_do_what_was_meant(seed: int, figures: Callable[[str], None]) -> None:
    text = Maker(seed, control()).program(8)
    fixed = fix(text)
    assert fixed.report.refused == ()
    worst = judged(text, fixed, errors.load(FILE))
    figures(f"klartext, seed {seed}: " + ", ".join(f"{kind} {off * 1e3:.3f} um" for kind, off in worst.items()))
    assert worst.pop("path", 0.0) <= ALONG
    assert max(worst.values()) <= ENDS


def test_a_generated_program_in_inches_does_what_was_meant() -> None:
    text = Maker(200, control(), "INCH").program(5)
    assert max(judged(text, fix(text), errors.load(FILE)).values()) <= ALONG


def test_the_judge_sees_what_was_not_corrected() -> None:
    text = Maker(SEEDS[0], control()).program(8)
    untouched = replace(fix(text), text=text.encode())
    assert max(judged(text, untouched, errors.load(FILE)).values()) > 0.01


def main(first: int, last: int) -> None:
    """Judge programs and say what became of them."""
    fates: Counter[str] = Counter()
    most: dict[str, float] = {}
    for seed in range(first, last):
        text = Maker(seed, control()).program(8)
        fixed = fix(text)
        if fixed.report.refused:
            fates[f"refused: {fixed.report.refused[0].reason}"] += 1
            continue
        worst = judged(text, fixed, errors.load(FILE))
        right = worst.get("path", 0.0) <= ALONG and all(off <= ENDS for k, off in worst.items() if k != "path")
        fates["right" if right else f"wrong, seed {seed}"] += 1
        most = {kind: max(worst.get(kind, 0.0), most.get(kind, 0.0)) for kind in worst.keys() | most.keys()}
    print("\n".join(f"{count} {fate}" for fate, count in fates.most_common()))
    print(", ".join(f"{kind} {off * 1e3:.3f} um" for kind, off in sorted(most.items())))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
