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
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest

from conftest import FULL
from differential import (
    errors,
    fanuc,
    fanuc_programs,
    product,
    setups,
    sinumerik,
    sinumerik_programs,
    test_fanuc_control,
    test_siemens,
    test_tnc,
    tnc_programs,
)
from differential.canon import Canon
from differential.errors import LETTERS, Machine
from differential.generated import MACHINES, SETUP, terms_of
from differential.generator import Generator
from differential.judge import judge
from differential.sinumerik_frames import Floats
from differential.test_fanuc import Fanuc
from differential.test_siemens import apart
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.control.setup import Setup
from ncfix.diagnostics import NcfixError
from ncfix.machine import load
from ncfix.text.reader import read

CASES = int(os.environ.get("NCFIX_DELETED", "2" if FULL else "0"))
"""Programs of each kind and strategy; 0: one, another for each strategy."""
FIRST = int(os.environ.get("NCFIX_SEED", "0"))
STRATEGIES = ("rotary-then-linear", "position", "full")
ARC = re.compile(r"(N?\d+ ?)?(G0?[23]\b|C[CRPT]? |CIP|RND|CHF|%|M30|O\d|END|LBL|L .*R[LR0] *M99)")
"""What is not put behind a block that may be skipped: most controls stop at an arc that starts elsewhere."""
DELETED = re.compile(r"^/\d?\s*")
SORTS = {"L": "cut", "C": "cut", "machine": "fixed"}
END, WAY = 0.9e-3, 1.2e-3
"""mm: what rounding leaves where motions end, and what more than that the tolerance and chords leave on the way."""
WITHOUT_ROTARY = ("three", "table")
"""Machines on which LinuxCNC's interpreter can judge what leads rotary axes elsewhere: there are none."""


def deletable(source: str, seed: int, share: float = 0.25, head: int = 3) -> str:
    """The program with `/` before some of its lines, but not the first `head` and the last ones, nor before arcs."""
    rng, lines = random.Random(seed), source.splitlines()
    behind = [*lines[1:], ""]
    chosen = [
        head <= n < len(lines) - 1 and rng.random() < share and bool(line) and not ARC.match(behind[n])
        for n, line in enumerate(lines)
    ]
    return "".join(f"{'/' if skipped else ''}{line}\n" for line, skipped in zip(lines, chosen, strict=True))


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
        terms = terms_of(source, outcome, model, self.options)
        for on, original in enumerate(originals):
            verdict = judge(original, self.rs274(outcome.text, controls[on]), model, terms)
            self.found["motions"] += verdict.motions
            self.found["refused"] += verdict.refused
            if not verdict.right:
                self.wrong.append(f"seed {seed} {name}, switch {('off', 'on')[on]}: {verdict}")


def seeds(strategy: str) -> range:
    """Of the programs by which a strategy is judged."""
    first = FIRST if CASES else FIRST + STRATEGIES.index(strategy)
    return range(first, first + max(CASES, 1))


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
    for seed in seeds(strategy):
        both.one(seed, names[seed % len(names)])
    figures(f"block delete, {dialect}, {strategy}: {dict(both.found)}, {len(both.wrong)} wrong")
    assert not both.wrong, "\n".join(both.wrong[:12])


# -- the second controls ----------------------------------------------------------------------------------------------


def in_position(text: str, on: bool) -> str:
    """The program as the control takes it in a position of the switch, every line where it was."""
    return "".join(f"{'' if on and DELETED.match(line) else DELETED.sub('', line)}\n" for line in text.splitlines())


@dataclass(slots=True)
class Family:
    """A language with a second control.

    source  seed -> a program, its lines marked
    groups  (text, actual) -> the ways of the tip by the marked line that makes them, in order of execution: the sort
            of motion, its line, and points (n, 3)
    """

    dialect: str
    source: Callable[[int], str]
    groups: Callable[[str, bool], list[tuple[int, str, Floats]]]
    machine: Path
    setup: Setup
    found: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    worst: float = 0.0

    def one(self, seed: int, strategy: str) -> None:
        """One program in both positions."""
        text = self.source(seed)
        self.found["programs"] += 1
        try:
            meant = [self.groups(in_position(text, on), False) for on in (False, True)]
        except Exception:
            self.found["not for the control"] += 1
            return
        program = read(text.encode(), "part", self.dialect)
        try:
            fixed = fix_program(program, load(str(self.machine)), self.setup, FixOptions(strategy=strategy))
        except NcfixError:
            self.found["refused as a whole"] += 1
            return
        report = fixed.report
        refused = {each.line for each in report.refused}
        loose = {each.place.line for each in report.warnings if each.place and "must not be split" in each.text}
        left = {line for each in report.left for a, b in each.stretches for line in range(a, b + 1)}
        for on in (False, True):
            done = self.groups(in_position(fixed.text.decode(), on), True)
            if [(line, sort) for line, sort, _ in meant[on]] != [(line, sort) for line, sort, _ in done]:
                self.wrong.append(f"seed {seed}, {('off', 'on')[on]}: other motions")
                continue
            fresh = True
            for (line, sort, path), (_, _, points) in zip(meant[on], done, strict=True):
                self.found["motions"] += 1
                self.found["refused"] += line in refused
                if sort == "fixed" or line in refused | left:
                    fresh = True
                    continue
                off = float(np.linalg.norm(path[-1] - points[-1]))
                if sort == "cut" and not fresh and line not in loose:
                    off = max(off, apart(path, points[1:]) - WAY, apart(points, path[1:]) - WAY)
                self.worst = max(self.worst, off)
                if off > END:
                    self.wrong.append(f"seed {seed}, {('off', 'on')[on]}, line {line}: {sort} {off:.4f} mm off")
                fresh = sort != "cut"


def marks(text: str) -> list[int]:
    """For each line the marked line to which it belongs: its own, or the one before it, from 1."""
    found, last = [], 0
    for line in text.splitlines():
        mark = re.search(r"[;(]#(\d+)", line)
        last = int(mark[1]) + 1 if mark else last
        found.append(last)
    return found


def fanuc_family(root: Path) -> Family:
    """Fanuc on a machine with a cradle: frames, holes, macros, TCP, vectors."""
    model = errors.load(root / test_fanuc_control.MACHINE)

    def groups(text: str, actual: bool) -> list[tuple[int, str, Floats]]:
        found = test_fanuc_control.by_mark(model, text, actual)
        return [(mark[1] + 1, ways[0].sort, points) for mark, (ways, points) in found.items()]

    def source(seed: int) -> str:
        return deletable(fanuc.marked(fanuc_programs.Author(seed).program()), seed, head=len(fanuc_programs.HEAD))

    return Family("fanuc", source, groups, root / test_fanuc_control.MACHINE, test_fanuc_control.SETUP)


def siemens_family(root: Path) -> Family:
    """SINUMERIK on the same machine: frames, TRAORI, CYCLE800, orientations, poles."""
    model = errors.load(root / test_siemens.MACHINE)

    def groups(text: str, actual: bool) -> list[tuple[int, str, Floats]]:
        found = test_siemens.by_mark(model, text, actual)
        return [(mark[1] + 1, ways[0].sort, points) for mark, (ways, points) in found.items()]

    def source(seed: int) -> str:
        return deletable(sinumerik.marked(sinumerik_programs.Author(seed).program()), seed, head=8)

    return Family("siemens", source, groups, root / test_siemens.MACHINE, test_siemens.SETUP)


def klartext_family(root: Path) -> Family:
    """Klartext on three axes: datum shifts, mirrors, rotation, holes, labels, parameters."""
    model = errors.load(test_tnc.FILE)

    def groups(text: str, actual: bool) -> list[tuple[int, str, Floats]]:
        ways, lines = test_tnc.control().run(text), marks(text)
        ways = test_tnc.seen(ways, model) if actual else ways
        pairs = [(lines[way.line - 1], SORTS.get(way.kind, "rapid"), way.points) for way in ways]
        together = [(key, list(group)) for key, group in groupby(pairs, key=lambda each: each[:2])]
        return [(line, sort, np.concatenate([each[2] for each in group])) for (line, sort), group in together]

    def source(seed: int) -> str:
        text = tnc_programs.Maker(seed, test_tnc.control()).program(8)
        return deletable("".join(f"{line} ;#{n}\n" for n, line in enumerate(text.splitlines())), seed, head=8)

    return Family("heidenhain", source, groups, test_tnc.FILE, test_tnc.SETUP)


@pytest.mark.parametrize(("family", "seed"), [("siemens", 125), *([("heidenhain", 121)] if FULL else [])])
def test_what_cannot_be_proven_in_all_positions_is_refused(family: str, seed: int, root: Path) -> None:
    study = {"siemens": siemens_family, "heidenhain": klartext_family}[family](root)
    program = read(study.source(seed).encode(), "part", study.dialect)
    with pytest.raises(NcfixError) as raised:
        fix_program(program, load(str(study.machine)), study.setup, FixOptions(figures=False))
    assert raised.value.code == "NCF453"


@pytest.mark.parametrize("strategy", STRATEGIES)
@pytest.mark.parametrize("family", [fanuc_family, siemens_family, klartext_family])
def test_both_positions_judged_by_the_second_controls(
    family: Callable[[Path], Family], strategy: str, root: Path, figures: Callable[[str], None]
) -> None:
    study = family(root)
    for seed in seeds(strategy):
        study.one(seed, strategy)
    said = f"{dict(study.found)}, worst {study.worst * 1e3:.2f} um, {len(study.wrong)} wrong"
    figures(f"block delete, second control, {study.dialect}, {strategy}: {said}")
    assert not study.wrong, "\n".join(study.wrong[:12])
