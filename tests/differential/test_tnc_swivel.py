"""Arcs, holes, frames and turns in tilted planes, of programs written in any manner: judged by a second control."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from differential import errors, test_tnc
from differential.dressing import dressed
from differential.test_tnc import ALONG, PRESETS, farthest
from differential.test_tnc_five import ENDS, LENGTHS, tips
from differential.tnc_swivel import Swivel, SwivelMaker
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import Fixed, fix_flat
from ncfix.control.setup import Setup, Tool
from ncfix.machine import load
from ncfix.text.reader import read

FILE = Path(__file__).parent / "machines" / "five_bc.toml"
MODEL = errors.load(FILE)
SETUP = Setup(
    work_offsets={f"PRESET{row or ''}": dict(zip("XYZ", place, strict=True)) for row, place in PRESETS.items()},
    tools={number: Tool(length, 3.0) for number, length in LENGTHS.items()},
    initial={"X": 0.0, "Y": 0.0, "Z": 300.0, "B": 0.0, "C": 0.0},
    block_skip=False,
)
SEEDS = (100, 103, 105)


def control() -> Swivel:
    """The control before it starts."""
    return Swivel(dict(LENGTHS), dict(PRESETS), np.array([0.0, 0.0, 300.0]), model=MODEL)


def fix(text: str) -> Fixed:
    """The corrected program, written out flat where it has to be."""
    return fix_flat(read(text.encode("latin-1"), "t.h", "heidenhain"), load(str(FILE)), SETUP, FixOptions())


def judged(text: str, fixed: Fixed) -> dict[str, float]:
    """The worst distance (mm) of the tip from where it should be; paths that begin in machine coordinates pass."""
    before, after = control(), control()
    before.run(text)
    after.run(fixed.text.decode("latin-1"))
    meant, done = tips(before.travels, MODEL, real=False), tips(after.travels, MODEL, real=True)
    assert [kind for kind, _ in meant] == [kind for kind, _ in done]
    worst: dict[str, float] = {}
    earlier = ""
    for (kind, wanted), (_, found) in zip(meant, done, strict=True):
        left_alone, earlier = kind == "machine" or (earlier == "machine" and kind == "path"), kind
        if not left_alone:
            off = (
                max(farthest(found, wanted), farthest(wanted, found))
                if kind == "path"
                else np.abs(found - wanted).max()
            )
            worst[kind] = max(worst.get(kind, 0.0), float(off))
    return worst


@pytest.mark.parametrize("seed", SEEDS)
def test_generated_programs_in_planes_do_what_was_meant(seed: int, figures: Callable[[str], None]) -> None:
    text = dressed(SwivelMaker(seed, control()).program(2), seed)
    fixed = fix(text)
    assert fixed.report.refused == ()
    worst = judged(text, fixed)
    figures(f"klartext in planes, seed {seed}: " + ", ".join(f"{k} {v * 1e3:.3f} um" for k, v in worst.items()))
    assert worst.pop("path", 0.0) <= ALONG
    assert max(worst.values()) <= ENDS


def test_the_judge_in_planes_sees_what_was_not_corrected() -> None:
    text = SwivelMaker(SEEDS[0], control()).program(1)
    assert max(judged(text, fix_nothing(text)).values()) > 0.01


def fix_nothing(text: str) -> Fixed:
    """A program that is said to be corrected, and is not."""
    return replace(fix(text), text=text.encode())


def main(first: int, last: int) -> None:
    """Judge programs, of both makers, and say what became of them."""
    fates: Counter[str] = Counter()
    most: dict[str, float] = {}
    flat = errors.load(test_tnc.FILE)
    for seed in range(first, last):
        tilts = seed % 3 > 0
        maker = SwivelMaker(seed, control()) if tilts else test_tnc.Maker(seed, test_tnc.control())
        text = dressed(maker.program(3 if tilts else 8), seed)
        fixed = fix(text) if tilts else test_tnc.fix(text)
        if fixed.report.refused:
            fates[f"refused: {fixed.report.refused[0].reason}"] += 1
            continue
        worst = judged(text, fixed) if tilts else test_tnc.judged(text, fixed, flat)
        right = worst.get("path", 0.0) <= ALONG and all(v <= ENDS for kind, v in worst.items() if kind != "path")
        fates["right" if right else f"wrong, seed {seed}"] += 1
        most = {kind: max(worst.get(kind, 0.0), most.get(kind, 0.0)) for kind in worst.keys() | most.keys()}
    print("\n".join(f"{count} {fate}" for fate, count in fates.most_common()))
    print(", ".join(f"{kind} {off * 1e3:.3f} um" for kind, off in sorted(most.items())))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
