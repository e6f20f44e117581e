"""What becomes of the motion blocks of the world's programs, by dialect: corrected, passed, refused and why.

`python -m classes.accounting` (with `tests` on the path) prints the table of all dialects, or of those named;
`--flatten` with flat programs. The corpus is beside the project, or where NCFIX_SHARED says.
"""

from __future__ import annotations

import csv
import os
import re
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_flat, fix_program
from ncfix.control.setup import Setup
from ncfix.diagnostics import NcfixError
from ncfix.machine import Machine, load
from ncfix.text.dialect import detect
from ncfix.text.reader import read

FAMILIES = {
    "linuxcnc": "linuxcnc",
    "iso": "iso",
    "grbl": "iso",
    "fanuc": "fanuc",
    "siemens": "siemens",
    "heidenhain": "heidenhain",
}
"""Folder of the corpus -> the dialect with which it is read, unless a near relative shows itself."""

RELATIVES = {"fanuc": ("haas",)}
FOREIGN = frozenset({"NCF101", "NCF102", "NCF103"})
BEYOND = "beyond the range in which its errors are known"
SETUP = Setup(assume_zero=True, no_point="calculator")


@dataclass(slots=True)
class Account:
    """The books of one folder.

    files      read, of another family, unreadable, and those that the control would stop in
    blocks     corrected, passed, refused
    rules      by which blocks were passed
    unseen     motions at feed without a figure, by reason
    reasons    of refused blocks
    stopped    why the control would stop, or what is not given
    """

    files: Counter[str] = field(default_factory=Counter)
    blocks: Counter[str] = field(default_factory=Counter)
    rules: Counter[str] = field(default_factory=Counter)
    unseen: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)
    stopped: Counter[str] = field(default_factory=Counter)

    @property
    def beyond(self) -> int:
        """Motion blocks that leave the travel of the machine: that is no machine for their programs."""
        return sum(count for reason, count in self.reasons.items() if BEYOND in reason)

    @property
    def refused(self) -> float:
        """The share of the motion blocks within the travel that are refused."""
        return (self.blocks["refused"] - self.beyond) / max(1, sum(self.blocks.values()) - self.beyond)

    def lines(self, name: str) -> list[str]:
        """The account in words."""
        files = ", ".join(f"{count} {what}" for what, count in sorted(self.files.items()))
        blocks = ", ".join(f"{self.blocks[what]} {what}" for what in ("corrected", "passed", "refused"))
        kept = [each for each in self.reasons.most_common() if BEYOND not in each[0]]
        reasons = [f"    {count} {reason}" for reason, count in kept[:10]]
        passed = ", ".join(f"{count} {rule}" for rule, count in self.rules.most_common())
        unseen = ", ".join(f"{count} {reason}" for reason, count in self.unseen.most_common())
        far = f"{self.beyond} of them beyond the travel, {100 * self.refused:.2f} % of the others"
        return [
            f"{name}: files: {files}; motion blocks: {blocks} ({far})",
            f"  passed by rule: {passed or 'none'}",
            f"  at feed without a figure: {unseen or 'none'}",
            *reasons,
        ]


def dialect_of(source: bytes, name: str, dialect: str) -> str:
    """The dialect of a folder, or a near relative that the file shows."""
    found = detect(source, name).name
    return found if found in RELATIVES.get(dialect, ()) else dialect


STORED = re.compile(r".*?__[0-9a-f]{6}_(?P<name>.*)", re.DOTALL)
"""How files of the corpus are named: owner, hash, and the name that the file had."""


def beside(folder: Path) -> Callable[[str], bytes | None]:
    """The text of a subprogram by the name by which programs call it: a file of the folder."""
    names = {
        (found["name"] if (found := STORED.fullmatch(path.name)) else path.name): path for path in folder.iterdir()
    }
    return lambda name: names[name].read_bytes() if name in names else None


def account(
    folder: Path, dialect: str, machine: Machine, *, flat: bool = False, only: str = "", setup: Setup = SETUP
) -> Account:
    """Correct every program of a folder, or one of them, and keep the books; subprograms are found in the folder."""
    books = Account()
    fix = fix_flat if flat else fix_program
    resolve = beside(folder)
    for path in sorted(folder.iterdir()):
        if only not in ("", path.name):
            continue
        source = path.read_bytes()
        try:
            program = read(source, path.name, dialect_of(source, path.name, dialect))
        except NcfixError as error:
            books.files["of another family" if error.messages[0].code in FOREIGN else "unreadable"] += 1
            continue
        try:
            report = fix(program, machine, setup, FixOptions(figures=False, tolerance_um=5.0), resolve).report
        except NcfixError as error:
            books.files["not followed"] += 1
            books.stopped[f"{error.messages[0].code} {error.messages[0].text}"] += 1
            continue
        books.files["followed"] += 1
        refused = {each.line: each.reason for each in report.refused}
        books.blocks.update(corrected=report.compensated, passed=report.passed, refused=len(refused))
        books.rules.update(report.passed_by_rule)
        books.unseen.update(report.no_figure)
        books.reasons.update(refused.values())
    return books


def main() -> None:
    """Print the table."""
    root = Path(__file__).resolve().parents[2]
    corpus = Path(os.environ.get("NCFIX_SHARED") or root.parent / "shared") / "corpus"
    machine = load(str(root / "examples/machines/three_axis.toml"))
    with (corpus / "manifest.csv").open(newline="", encoding="utf-8") as manifest:
        present = {row["dialect"] for row in csv.DictReader(manifest)}
    wanted = [name for name in FAMILIES if name in present and (not sys.argv[1:] or name in sys.argv)]
    for name in wanted:
        books = account(corpus / name, FAMILIES[name], machine, flat="--flatten" in sys.argv)
        print("\n".join(books.lines(name)))
        print("\n".join(f"  stopped: {count} {why}" for why, count in books.stopped.most_common(10)), flush=True)


if __name__ == "__main__":
    main()
