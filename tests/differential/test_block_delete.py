"""Programs with blocks that may be skipped (`/`): right in each position of the switch, or refused with the line.

Programs made up at random get `/` before some of their blocks: motions, modes, offsets, tools, cycles. One corrected
text is then judged in both positions: of LinuxCNC and plain ISO code by LinuxCNC's interpreter, which skips such blocks
with `-b`; of the others by the second controls, which are given the text with these blocks, or without.

`NCFIX_DELETED=200 pytest tests/differential/test_block_delete.py` judges as many programs of each kind.
"""

from __future__ import annotations

import os
import random
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import pytest

from differential import product, setups
from differential.canon import Canon
from differential.errors import LETTERS, Machine
from differential.generated import MACHINES, SETUP, terms_of
from differential.generator import Generator
from differential.judge import judge
from differential.test_fanuc import Fanuc

CASES = int(os.environ.get("NCFIX_DELETED", "4"))
FIRST = int(os.environ.get("NCFIX_SEED", "0"))
STRATEGIES = ("rotary-then-linear", "position", "full")
ARC = re.compile(r"(N\d+ ?)?G0?[23]\b")
WITHOUT_ROTARY = ("three", "table")
"""Machines on which LinuxCNC's interpreter can judge what leads rotary axes elsewhere: there are none."""


def deletable(source: str, seed: int, share: float = 0.25, marks: tuple[str, ...] = ("/",)) -> str:
    """The program with `/` before some of its lines, but not the first and the last ones."""
    rng, lines = random.Random(seed), source.splitlines()
    behind = [*lines[1:], ""]
    chosen = [
        2 < n < len(lines) - 1 and rng.random() < share and bool(line) and not ARC.match(behind[n])
        for n, line in enumerate(lines)
    ]
    return "".join(
        f"{rng.choice(marks) if skipped else ''}{line}\n" for line, skipped in zip(lines, chosen, strict=True)
    )


class LinuxCnc(Generator):
    """No offsets from where the axes stand, which a correction moves, and no reference points without axes."""

    def offset(self) -> None:
        before = len(self.lines)
        super(type(self), self).offset()
        self.lines[before:] = ["G55" if line.startswith("G92") else line for line in self.lines[before:]]

    def machine(self) -> None:
        before = len(self.lines)
        super(type(self), self).machine()
        self.lines[before:] = ["G53 G0 Z0" if line in ("G28", "G30") else line for line in self.lines[before:]]


class Iso(Fanuc):
    """The same for plain ISO code and Fanuc."""

    offset, machine = LinuxCnc.offset, LinuxCnc.machine


def source_of(dialect: str, seed: int, rotary: str) -> str:
    """A program; centres are relative to the start on the others without saying so."""
    if dialect == "linuxcnc":
        return LinuxCnc(random.Random(seed), rotary).program(18)
    return Iso(random.Random(seed), rotary).program(18).replace(" G91.1", "")


@dataclass(slots=True)
class Both:
    """Programs judged by LinuxCNC's interpreter in both positions of the switch, and what they came to."""

    rs274: Callable[..., Canon]
    machine: Callable[[str], Machine]
    machine_file: Callable[[str], Path]
    folder: Path
    source: Callable[[int, str], str]
    options: tuple[str, ...]
    found: Counter[str]
    wrong: list[str]

    def one(self, seed: int, name: str) -> None:
        """One program on one machine."""
        model = self.machine(name)
        axes = "".join(LETTERS[column] for column in (*model.linear, *model.rotary))
        source = deletable(self.source(seed, "".join(axis for axis in axes if axis in "ABC")), seed)
        controls = [replace(SETUP, block_skip=on) for on in (False, True)]
        originals = [self.rs274(source.encode(), each) for each in controls]
        self.found["programs"] += 1
        if not all(each.accepted for each in originals):
            self.found["not for the control"] += 1
            return
        setup = ("--setup", setups.write(self.folder, SETUP, axes), "--allow-refused")
        outcome = product.fix_text(source, self.machine_file(name), self.folder, *setup, *self.options)
        if outcome.text is None:
            self.found["not corrected"] += 1
            if outcome.code in (product.FAULT, product.DONE):
                self.wrong.append(f"seed {seed} {name}: {outcome.errors}")
            return
        terms = terms_of(source, outcome, model)
        for on, original in enumerate(originals):
            verdict = judge(original, self.rs274(outcome.text, controls[on]), model, terms)
            self.found["motions"] += verdict.motions
            self.found["refused"] += verdict.refused
            if not verdict.right:
                self.wrong.append(f"seed {seed} {name}, switch {('off', 'on')[on]}: {verdict}")


@pytest.mark.parametrize("strategy", STRATEGIES)
@pytest.mark.parametrize("dialect", ["linuxcnc", "iso", "fanuc"])
def test_both_positions_judged_by_linuxcnc(
    dialect: str,
    strategy: str,
    rs274: Callable[..., Canon],
    machine: Callable[[str], Machine],
    machine_file: Callable[[str], Path],
    tmp_path: Path,
    figures: Callable[[str], None],
) -> None:
    options = ("--strategy", strategy, "--dialect", dialect, "--no-point", "calculator")
    names = WITHOUT_ROTARY if strategy == "full" else MACHINES
    both = Both(rs274, machine, machine_file, tmp_path, partial(source_of, dialect), options, Counter(), [])
    for seed in range(FIRST, FIRST + CASES):
        both.one(seed, names[seed % len(names)])
    figures(f"block delete, {dialect}, {strategy}: {dict(both.found)}, {len(both.wrong)} wrong")
    assert not both.wrong, "\n".join(both.wrong[:12])
