"""Programs made up at random, corrected, and judged by LinuxCNC's interpreter: what all such studies share."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path

from differential import corpus, locality, product, setups
from differential.canon import Canon, Controls
from differential.errors import LETTERS, Machine
from differential.judge import Terms, judge

SETUP = Controls(
    offsets={"G54": (12.0, -7.5, 20.0), "G55": (-30.0, 4.0, 11.0), "G56": (5.0, 5.0, 5.0)},
    references={"G28": (0.0, 0.0, 100.0), "G30": (10.0, 20.0, 120.0)},
    tools={1: (64.0, 8.0)},
)
MACHINES = ("three", "table", "four_a", "five_ac", "five_bc")


DECIMAL_INCHES = {"fanuc", "haas", "mitsubishi"}
"""Dialects in which 0.001 mm are 0.0001 inch."""


@dataclass(slots=True)
class Study:
    """What is tried, and what it came to.

    source   (seed, rotary axes of the machine) -> a program
    options  of `ncfix fix`
    found    programs, those that the interpreter refuses, motions, refused motions
    wrong    what is wrong, by seed
    """

    rs274: Callable[..., Canon]
    machine: Callable[[str], Machine]
    machine_file: Callable[[str], Path]
    folder: Path
    source: Callable[[int, str], str]
    options: tuple[str, ...] = ()
    found: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)

    def run(self, seeds: Iterable[int]) -> None:
        """Try programs, each on the next machine."""
        for seed in seeds:
            self.one(seed, MACHINES[seed % len(MACHINES)])

    def one(self, seed: int, name: str) -> None:
        """Try one program on a machine."""
        model = self.machine(name)
        axes = "".join(LETTERS[column] for column in (*model.linear, *model.rotary))
        source = self.source(seed, "".join(axis for axis in axes if axis in "ABC"))
        original = self.rs274(source.encode(), SETUP)
        self.found["programs"] += 1
        if not original.accepted:
            self.found["not for the control"] += 1
            return
        setup = ("--setup", setups.write(self.folder, SETUP, axes), "--allow-refused")
        outcome = product.fix_text(source, self.machine_file(name), self.folder, *setup, *self.options)
        if outcome.text is None:
            self.complain(seed, name, outcome.errors)
            return
        terms = terms_of(source, outcome, model, self.options)
        verdict = judge(original, self.rs274(outcome.text, SETUP), model, terms)
        self.found["motions"] += verdict.motions
        self.found["refused"] += verdict.refused
        if not verdict.right:
            self.complain(seed, name, verdict)
        for text in locality.complaints(source.encode(), without_stamp(outcome.text))[:2]:
            self.complain(seed, name, text)

    def complain(self, seed: int, name: str, what: object) -> None:
        """Note what is wrong."""
        self.wrong.append(f"seed {seed} {name}: {what}")


def terms_of(source: str, outcome: product.Outcome, model: Machine, options: Iterable[str] = ()) -> Terms:
    """By what a program is judged that was corrected with these options."""
    return Terms(
        step=model.linear_step * (2.54 if "G20" in source and not DECIMAL_INCHES.isdisjoint(options) else 1.0),
        rotary_step=model.rotary_step,
        refused=outcome.refused,
        left=outcome.left,
        whole=outcome.whole,
        passed=corpus.passed_by_rule(source.encode()),
        tool_length={number: length for number, (length, _) in SETUP.tools.items()},
    )


def without_stamp(text: bytes) -> bytes:
    """A corrected program without the comment that says so."""
    return b"\n".join(line for line in text.split(b"\n") if b"NCFIX" not in line.upper())
