"""Holes of SINUMERIK, where they really are: each is corrected, at its bottom, or refused; none is passed in silence.

Judged by an interpreter and a model of the machine that share nothing with the product.
`NCFIX_SIEMENS_HOLES=20 pytest tests/differential/test_siemens_holes.py -s` takes as many programs of each kind; a usual
run takes a quarter of the kinds for each strategy, in which any two choices, and most three, stand together.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from conftest import FULL
from differential import errors, sinumerik
from differential.sinumerik_frames import Floats
from differential.sinumerik_holes import BEHIND, CALLS, COMBINATIONS, HEAD, NAMED, PLANES, program
from differential.test_siemens import AT_ENDS, LENGTHS, MACHINE, OFFSETS, SETUP, START
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import Fixed, fix_program
from ncfix.machine import Machine, load
from ncfix.text.reader import read

EACH = int(os.environ.get("NCFIX_SIEMENS_HOLES", "0"))
FIRST = int(os.environ.get("NCFIX_SEED", "0"))
CHOICES = {word: number for words in (PLANES, BEHIND, CALLS, NAMED) for number, word in enumerate(words)}
FIGURE = 0.1e-3
"""mm: two models of a machine, and figures with four decimals of a micrometre."""


@dataclass(slots=True)
class Tally:
    """What became of holes, and the worst of those that were corrected, mm."""

    holes: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    worst: float = 0.0
    before: float = 0.0


def bottoms(model: errors.Machine, text: str, actual: bool) -> tuple[Floats, list[int]]:
    """The bottoms of the holes of a program, (k, 3), in the order in which they are drilled, and their lines."""
    ways = sinumerik.control_of(model, START, offsets=OFFSETS, tools=LENGTHS).run(text)
    holes = [way for way in ways if way.sort == "hole"]
    tips = sinumerik.tips(model, holes, actual)
    return np.array([tip[-1] for tip in tips]).reshape(-1, 3), [way.line for way in holes]


def judged(text: str, strategy: str, model: errors.Machine, machine: Machine, tally: Tally) -> Fixed:
    """Correct a program, and see where its holes are."""
    fixed = fix_program(read(text.encode(), "part.mpf", "siemens"), machine, SETUP, FixOptions(strategy=strategy))
    report = fixed.report
    (meant, lines), (raw, _) = (bottoms(model, text, actual) for actual in (False, True))
    done, _ = bottoms(model, fixed.text.decode(), True)
    if len(meant) != len(done):
        tally.wrong.append(f"{len(meant)} holes became {len(done)}")
        return fixed
    refused = {each.line: each.reason for each in report.refused}
    left: dict[int, float] = {}
    for axis in report.left:
        for first, last in axis.stretches:
            left |= {line: left.get(line, 0.0) + axis.most for line in range(first, last + 1)}
    seen = {"before": 0.0, "after": 0.0}
    for line, aim, old, new in zip(lines, meant, raw, done, strict=True):
        before, after = float(np.linalg.norm(old - aim)), float(np.linalg.norm(new - aim))
        if line in refused:
            tally.holes["refused"] += 1
            tally.reasons[refused[line]] += 1
            continue
        tally.holes["left in part, and said" if line in left else "corrected"] += 1
        tally.before = max(tally.before, before)
        if line not in left:
            tally.worst = max(tally.worst, after)
            seen = {"before": max(seen["before"], before), "after": max(seen["after"], after)}
        if after > AT_ENDS + left.get(line, 0.0):
            tally.wrong.append(f"line {line} is {after * 1e3:.2f} um off, and was {before * 1e3:.2f}")
    for name, said in (("before", report.error_before_um), ("after", report.error_after_um)):
        if seen[name] > float(said.get("max") or 0.0) / 1e3 + FIGURE:
            tally.wrong.append(f"figures say {said.get('max')} um {name}, and it is {seen[name] * 1e3:.2f}")
    return fixed


def taken(strategy: str, root: Path, shift: int) -> Tally:
    """What becomes of programs of every kind, or of a quarter of them."""
    model, machine, tally = errors.load(root / MACHINE), load(str(root / MACHINE)), Tally()
    for number, kind in enumerate(COMBINATIONS):
        if not (EACH or FULL) and sum(CHOICES[word] for word in kind) % 4 != shift:
            continue
        for seed in range(FIRST, FIRST + max(EACH, 1)):
            text = program(1000 * number + seed, *kind)
            wrong = len(tally.wrong)
            judged(text, strategy, model, machine, tally)
            tally.wrong[wrong:] = [f"{kind} {seed}: {fault}\n{text}" for fault in tally.wrong[wrong:]]
    return tally


def test_every_hole_is_corrected_or_refused(root: Path, figures: Callable[[str], None]) -> None:
    for shift, strategy in enumerate(("rotary-then-linear", "full")):
        tally = taken(strategy, root, shift)
        assert not tally.wrong, "\n".join(tally.wrong)
        assert tally.holes["corrected"] > 3 * tally.holes["refused"]
        counts = ", ".join(f"{count} {what}" for what, count in sorted(tally.holes.items()))
        why = "".join(f"\n    {count} {reason}" for reason, count in tally.reasons.most_common())
        figures(
            f"siemens holes, {strategy}: {counts}, silently wrong 0; worst {tally.worst * 1e3:.3f} um, "
            f"before {tally.before * 1e3:.1f} um{why}"
        )


ARCS = (
    "G2 X10 Y0 I5 J0\nCYCLE81(40,0,2,-8)\nX0 Y0 I-5 J0\nG1 X3",
    "G2 X10 Y0 I5 J0\nCYCLE81(40,0,2,-8)\nG93\nG1 X5 F2\nCYCLE81(40,0,2,-9)\nX7 F3\nG94\nG1 F500",
    "ROT X20 Y10\nG0 X0 Y0 Z50\nG2 X10 Y0 I5 J0\nCYCLE81(40,0,2,-8)\nG2 X0 Y0 I-5 J0",
    "MCALL CYCLE81(40,0,2,-8)\nX10 Y10\nTRANS X5 Y5\nX10 Y10\nROT Z30\nX20 Y5\nTRANS\nMCALL",
    "MCALL CYCLE81(40,0,2,-8)\nG111 X0 Y0\nAP=30 RP=20\nAP=60\nAP=90\nMCALL",
    "MCALL CYCLE81(40,0,2,-8)\nG111 X0 Y0\nN40 AP=30 RP=20\nN50 AP=60\nMCALL",
    "MCALL CYCLE81(40,0,2,-8)\nX10 Y10\nC90\nA10 C=DC(100)\nMCALL",
    "TRAORI\nG54\nG0 X0 Y0 Z50 A3=0.1 B3=0.1 C3=1\nMCALL CYCLE81(40,0,2,-8)\nX10 Y10 A3=0.2 B3=0.1 C3=1\nX20\nMCALL",
)
"""What the generator does not have: codes other than G0 and G1 in force at a call, frames and turns under MCALL."""


def test_increments_in_turned_coordinates_that_hide_them(root: Path) -> None:
    """Where the tool stands across the plane nobody has said, so nobody can say from where the increment counts."""
    body = (
        'CYCLE800(1,"T",200000,57,-6,-3,0.4,15.5,-24,-27.7,0,0,0,-1)\nG1 X30 Y30\nMCALL CYCLE85(40,0,2,-4,,0,100,300)'
    )
    text = "\n".join([*HEAD, body, "X=-28 Y=IC(19) Z45", "G0 X16 Y=IC(3)", "MCALL", "G0 X1 Y2 Z60", "M30"]) + "\n"
    tally = Tally()
    judged(text, "position", errors.load(root / MACHINE), load(str(root / MACHINE)), tally)
    assert not tally.wrong
    assert tally.holes.keys() == {"refused"}


@pytest.mark.parametrize("strategy", ["rotary-then-linear", "full"])
@pytest.mark.parametrize("body", ARCS)
def test_none_is_refused(body: str, strategy: str, root: Path) -> None:
    text = "\n".join([*HEAD, body, "G0 X1 Y2 Z60", "M30"]) + "\n"
    tally = Tally()
    judged(text, strategy, errors.load(root / MACHINE), load(str(root / MACHINE)), tally)
    assert not tally.wrong
    assert tally.holes.keys() == {"corrected"}
