"""Corrected five-axis Klartext against a second control and a second model of a machine with two rotary tables."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from differential import errors
from differential.test_tnc import ALONG, HALF, farthest
from differential.tnc import Floats
from differential.tnc_five import FiveAxisTnc, Travel, program
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import Fixed, fix_program
from ncfix.control.setup import Setup, Tool
from ncfix.machine import load
from ncfix.text.reader import read

FILE = Path(__file__).parent / "machines" / "five_bc.toml"
LENGTHS, PRESET = {0: 0.0, 1: 60.0, 2: 90.0}, (5.0, -3.0, 40.0)
SETUP = Setup(
    work_offsets={"PRESET": dict(zip("XYZ", PRESET, strict=True))},
    tools={number: Tool(length, 3.0) for number, length in LENGTHS.items()},
    initial={"X": 0.0, "Y": 0.0, "Z": 300.0, "B": 0.0, "C": 0.0},
)
ENDS = np.sqrt(3) * HALF + 1e-5
"""mm: half an output step along all three axes."""

SEEDS = (0, 1, 12)


def followed(text: str, model: errors.Machine) -> list[Travel]:
    """What the control makes of a program."""
    start = np.zeros(9)
    start[2] = 300.0
    return FiveAxisTnc(model, np.array(PRESET), LENGTHS, start).run(text)


def tips(travels: list[Travel], model: errors.Machine, *, real: bool) -> list[tuple[str, Floats]]:
    """Where the tip goes, as it should or as it does; paths one after another are one path."""
    found: list[tuple[str, list[Floats]]] = []
    tip = model.actual_tip if real else model.tip
    for travel in travels:
        points = tip(travel.axes, np.full(len(travel.axes), travel.length))
        if travel.kind == "path" and found and found[-1][0] == "path":
            found[-1][1].append(points)
        else:
            found.append((travel.kind, [points if travel.kind == "path" else points[-1:]]))
    return [(kind, np.concatenate(points)) for kind, points in found]


def judged(text: str, fixed: Fixed, model: errors.Machine) -> dict[str, float]:
    """The worst distance (mm) of the tip from where it should be.

    Rapids that leave an axis where offsets have put it are not corrected, nor is the beginning of a path behind them.
    """
    meant = tips(followed(text, model), model, real=False)
    done = tips(followed(fixed.text.decode(), model), model, real=True)
    assert len(meant) == len(done)
    worst = {"rapid": 0.0, "path": 0.0}
    before = ""
    for (kind, wanted), (_, found) in zip(meant, done, strict=True):
        if kind == "rapid":
            worst[kind] = max(worst[kind], float(np.linalg.norm(wanted - found)))
        elif kind == "path" and before not in ("machine", "positioning"):
            worst[kind] = max(worst[kind], farthest(found, wanted), farthest(wanted, found))
        before = kind
    return worst


def fix(text: str) -> Fixed:
    """The corrected program."""
    return fix_program(read(text.encode(), "t.h", "heidenhain"), load(str(FILE)), SETUP, FixOptions())


@pytest.mark.parametrize("seed", SEEDS)
def test_generated_five_axis_programs_do_what_was_meant(seed: int, figures: Callable[[str], None]) -> None:
    model = errors.load(FILE)
    text = program(seed, model)
    fixed = fix(text)
    assert fixed.report.refused == ()
    worst = judged(text, fixed, model)
    figures(f"klartext, five axes, seed {seed}: " + ", ".join(f"{k} {v * 1e3:.3f} um" for k, v in worst.items()))
    assert worst["path"] <= ALONG
    assert worst["rapid"] <= ENDS


def main(first: int, last: int) -> None:
    """Judge programs and say what became of them."""
    model = errors.load(FILE)
    for seed in range(first, last):
        text = program(seed, model)
        fixed = fix(text)
        print(seed, fixed.report.refused[:1], judged(text, fixed, model), flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
