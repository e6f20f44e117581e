"""Canned cycles under every strategy, in every language: what comes out can be read, and what went in is accounted for.

SINUMERIK's are in `tests/differential/test_siemens_holes.py`. `NCFIX_CYCLES=200` takes as many programs of each.
"""

from __future__ import annotations

import os
import random
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from compensate.cycles_at_random import LANGUAGES
from conftest import some
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import follow
from ncfix.control.moves import MotionKind, Rule
from ncfix.control.setup import Setup, Tool
from ncfix.diagnostics import NcfixError
from ncfix.machine import load
from ncfix.text.reader import read

PROGRAMS = int(os.environ.get("NCFIX_CYCLES") or some(12))
SETUP = Setup(
    tools={1: Tool(80.0, 3.0)},
    initial={"X": 0.0, "Y": 0.0, "Z": 250.0, "A": 0.0, "C": 0.0},
    assume_zero=True,
    no_point="calculator",
)
LEFT = 0.5
"""um: the digits of three linear axes, and what half a step of a rotary axis moves the tip by."""


@pytest.mark.parametrize("strategy", ["full", "position"])
@pytest.mark.parametrize("dialect", LANGUAGES)
def test_every_hole_is_corrected_or_refused(
    dialect: str, strategy: str, root: Path, figures: Callable[[str], None]
) -> None:
    machine, options = load(str(root / "examples/machines/wCAYFXZSt.toml")), FixOptions(strategy=strategy)
    fates, reasons, stopped, worst = Counter[str](), Counter[str](), Counter[str](), 0.0
    for seed in range(PROGRAMS):
        text = LANGUAGES[dialect](dialect, random.Random(f"{dialect} {seed}"))
        program = read(text.encode(), f"{seed}", dialect)
        try:
            fixed = fix_program(program, machine, SETUP, options)
        except NcfixError as error:
            stopped[f"{error.messages[0].code} {error.messages[0].text}"] += 1
            continue
        moves = follow(program, machine, SETUP).trace.moves
        holes = moves.kind == MotionKind.CYCLE
        assert not (moves.rule[holes] == Rule.PASS).any(), text
        lines = program.lines(moves.block[holes])
        refused = {each.line: each.reason for each in fixed.report.refused}
        kept = np.isin(lines, list(refused))
        fates["refused"] += int(kept.sum())
        fates["corrected"] += int((~kept).sum())
        reasons.update(refused.values())
        most = float(fixed.report.error_after_um["max"] or 0.0)
        assert most < LEFT, f"{text}\n{fixed.text.decode()}"
        worst = max(worst, most)
    counts = ", ".join(f"{count} {fate}" for fate, count in sorted(fates.items()))
    why = "".join(f"\n    {count} {reason}" for reason, count in [*reasons.most_common(4), *stopped.most_common()])
    figures(f"cycles, {dialect}, {strategy}: {PROGRAMS} programs, {counts}, worst {worst:.2f} um{why}")
    assert sum(stopped.values()) <= PROGRAMS // 4
    assert fates["corrected"] > fates["refused"]
