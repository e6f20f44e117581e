"""Every public program that LinuxCNC accepts, corrected, and judged by what LinuxCNC then makes of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from differential import corpus, locality, product
from differential.canon import Canon
from differential.errors import Machine
from differential.judge import Terms, Verdict, judge

READABLE = ("linuxcnc", "iso", "fanuc")
MACHINES = {"": ("three", "table", "three"), "A": ("four_a",), "AC": ("five_ac",)}
EVERY = {"rotary-then-linear": 1, "position": 5}  # which share of the files a strategy is tried on
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


@pytest.mark.parametrize("strategy", EVERY)
def test_every_program_is_corrected_as_predicted(
    strategy: str,
    shared: Callable[[str], Path],
    rs274: Callable[..., Canon],
    machine: Callable[[str], Machine],
    machine_file: Callable[[str], Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    total = Total()
    wanted = [e for e in corpus.entries(shared("corpus")) if e.accepted and e.motions and e.dialect in READABLE]
    wanted = wanted[:: EVERY[strategy]]
    for number, entry in enumerate(wanted):
        names = MACHINES[entry.rotary]
        name = names[number % len(names)]
        options = ("--strategy", strategy, "--assume-zero", "--allow-refused")
        outcome = product.fix(entry.path, machine_file(name), tmp_path, *options)
        original, source = rs274(entry.path), entry.path.read_bytes()
        if outcome.text is None:
            total.give_up(entry.path.name, outcome, len(original))
            continue
        fixed = rs274(outcome.text, folder=entry.path.parent)
        total.wrong += [f"{entry.path.name}: {text}" for text in locality.complaints(source, outcome.text)[:3]]
        total.add(
            entry.path.name, outcome, judge(original, fixed, machine(name), _terms(entry, outcome, machine(name)))
        )
    with capsys.disabled():
        print(f"\ndifferential, {strategy}: {total}")
    assert not total.wrong, "\n".join(total.wrong)
    assert total.blocks["refused"] < REFUSED_SHARE * sum(total.blocks.values())


def _terms(entry: corpus.Entry, outcome: product.Outcome, machine: Machine) -> Terms:
    return Terms(
        step=machine.linear_step,
        rotary_step=machine.rotary_step,
        refused=outcome.refused,
        passed=corpus.passed_by_rule(entry.path.read_bytes()),
    )
