"""Every public program that LinuxCNC accepts, corrected, and judged by what LinuxCNC then makes of it."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from conftest import FULL
from differential import corpus, locality, product, setups
from differential.canon import Canon, Controls
from differential.errors import LETTERS, Machine
from differential.judge import Terms, Verdict, judge

READABLE = ("linuxcnc", "iso", "fanuc")
MACHINES = {"": ("three", "table", "three"), "A": ("four_a",), "AC": ("five_ac",)}
MOVES_A_WITHOUT_TURNING_IT = ("LinuxCNC__310482_test.ngc",)  # the manifest lists the axes that really turn
SETUP = Controls(
    offsets={"G54": (110.0, -45.0, 60.5, 12.0, 0.0, -30.0), "G55": (-20.0, 30.25, 7.0), "G56": (3.0, 5.0, -9.0)},
    tools={number: (40.0 + 3.5 * number, 6.0) for number in range(1, 31)},
)


@dataclass(frozen=True, slots=True)
class Variant:
    """How the corpus is corrected: by which strategy, every so many files, and with what on the machine."""

    strategy: str
    every: int
    controls: Controls


SPARSER = int(os.environ.get("NCFIX_CORPUS", "3" if FULL else "7"))
"""Every seventh of the files that each strategy is for, or every third; `NCFIX_CORPUS=1`: all of them."""
VARIANTS = {
    "rotary-then-linear, all offsets zero": Variant("rotary-then-linear", SPARSER, Controls()),
    "position, with work offsets and tools": Variant("position", 4 * SPARSER, SETUP),
    "full": Variant("full", 6 * SPARSER, Controls()),
}
REFUSED_SHARE = 0.02


@dataclass(slots=True)
class Total:
    """The sums over all files."""

    files: int = 0
    blocks: Counter[str] = field(default_factory=Counter)
    inserted: int = 0
    reasons: Counter[str] = field(default_factory=Counter)
    not_corrected: Counter[str] = field(default_factory=Counter)
    worst: dict[str, tuple[float, str]] = field(default_factory=dict)
    wrong: list[str] = field(default_factory=list)

    def add(self, name: str, outcome: product.Outcome, verdict: Verdict) -> None:
        """Add what became of one file."""
        self.files += 1
        self.blocks["compensated"] += outcome.entry["compensated"]
        self.blocks["passed"] += outcome.entry["passed"]
        self.blocks["refused"] += len(outcome.entry["refused"])
        self.inserted += outcome.entry["inserted_blocks"]
        self.reasons.update(outcome.refused.values())
        for what, (value, line) in verdict.worst.items():
            if value > self.worst.get(what, (-1.0, ""))[0]:
                self.worst[what] = (value, f"{name}:{line}")
        if not verdict.right:
            self.wrong.append(f"{name}: {verdict}")

    def give_up(self, name: str, outcome: product.Outcome, motions: int) -> None:
        """A file that is not corrected at all: all its motions count as refused."""
        self.files += 1
        self.blocks["refused"] += motions
        self.not_corrected[f"exit {outcome.code} {','.join(outcome.codes)}"] += 1
        self.reasons[outcome.errors.split("\n")[0].split(": ", 1)[-1][:90]] += motions
        if outcome.code in (product.UNREADABLE, product.FAULT, product.USAGE):
            self.wrong.append(f"{name}: exit {outcome.code}\n{outcome.errors[:300]}")

    def __str__(self) -> str:
        share = self.blocks["refused"] / max(1, sum(self.blocks.values()))
        lines = [f"{self.files} files compared, {len(self.wrong)} wrong"]
        lines += [f"  motion blocks {dict(self.blocks)}, {self.inserted} inserted, {share:.2%} refused"]
        lines += [f"  files not corrected at all: {dict(self.not_corrected)}"]
        lines += [f"  worst {what}: {value * 1e3:.4f} um at {where}" for what, (value, where) in self.worst.items()]
        lines += [f"  refused {count}: {reason}" for reason, count in self.reasons.most_common(12)]
        return "\n".join(lines)


@pytest.mark.parametrize("name", VARIANTS)
def test_every_program_is_corrected_as_predicted(
    name: str,
    shared: Callable[[str], Path],
    rs274: Callable[..., Canon],
    machine: Callable[[str], Machine],
    machine_file: Callable[[str], Path],
    tmp_path: Path,
    figures: Callable[[str], None],
) -> None:
    variant, total = VARIANTS[name], Total()
    wanted = [e for e in corpus.entries(shared("corpus")) if e.accepted and e.motions and e.dialect in READABLE]
    wanted = wanted[:: variant.every]
    for number, entry in enumerate(wanted):
        names = MACHINES["A" if entry.path.name in MOVES_A_WITHOUT_TURNING_IT else entry.rotary]
        which = names[number % len(names)]
        model, source = machine(which), entry.path.read_bytes()
        options = ("--strategy", variant.strategy, "--allow-refused", *_setup(variant, model, tmp_path))
        outcome = product.fix(entry.path, machine_file(which), tmp_path, *options)
        original = rs274(entry.path, variant.controls)
        if outcome.text is None:
            total.give_up(entry.path.name, outcome, len(original))
            continue
        fixed = rs274(outcome.text, variant.controls, entry.path.parent)
        total.wrong += [f"{entry.path.name}: {text}" for text in locality.complaints(source, outcome.text)[:3]]
        terms = _terms(entry, outcome, model, variant)
        total.add(entry.path.name, outcome, judge(original, fixed, model, terms))
    figures(f"differential, {name}: {total}")
    assert not total.wrong, "\n".join(total.wrong)
    assert total.blocks["refused"] < REFUSED_SHARE * sum(total.blocks.values())


def _setup(variant: Variant, model: Machine, folder: Path) -> tuple[object, ...]:
    if not variant.controls.offsets:
        return ("--assume-zero",)
    axes = "".join(LETTERS[column] for column in (*model.linear, *model.rotary))
    return "--setup", setups.write(folder, variant.controls, axes)


def _terms(entry: corpus.Entry, outcome: product.Outcome, machine: Machine, variant: Variant) -> Terms:
    return Terms(
        step=machine.linear_step,
        rotary_step=machine.rotary_step,
        refused=outcome.refused,
        left=outcome.left,
        passed=corpus.passed_by_rule(entry.path.read_bytes()),
        rotary=0.5 if variant.strategy == "full" and machine.rotary else 0.0,
        tool_length={number: length for number, (length, _) in variant.controls.tools.items()},
    )
