"""What becomes of the motion blocks of public SINUMERIK programs, and why."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from classes import accounting
from classes.accounting import Account, account
from conftest import FULL
from ncfix.machine import Machine, load

MOST = 0.01
"""The share of motion blocks of part programs that may be refused, with and without --flatten."""

OF_A_MACHINE = re.compile(rb"(?im)^[ \t]*(?:N\d+[ \t]*)?(?:PROC\b|M17\b|RET\b|CGTECH_MACRO\b)")
"""Shows a subprogram: the axes go where its parameters and the machine's global data say, at run time."""

ZERO_ON_TABLE: Mapping[str, tuple[float, float]] = {"CAM_TEST": (-150.0, -100.0)}
"""Where the zero point of a part lies beside the middle of the table, mm: the program with this in its name is made
for a part of 300 by 200 mm from its corner; others count from the middle, as one of them says."""


def offset_of(name: str) -> dict[str, float]:
    """The work offset of a program."""
    x, y = next((place for key, place in ZERO_ON_TABLE.items() if key in name), (0.0, 0.0))
    return {"X": x, "Y": y, "Z": 0.0, "A": 0.0, "C": 0.0}


def by_file(folder: Path, machine: Machine, kind: str, *, flat: bool) -> Iterator[tuple[str, Account]]:
    """The books of each program of a kind, `part` or `sub`, each with its own zero point; calls lead to its folder."""
    for path in sorted(folder.iterdir())[:: 1 if FULL else 3]:
        if bool(OF_A_MACHINE.search(path.read_bytes())) == (kind == "sub"):
            setup = replace(accounting.SETUP, work_offsets={"G54": offset_of(path.name)})
            yield path.name, account(folder, "siemens", machine, flat=flat, only=path.name, setup=setup)


def together(books: list[Account]) -> Account:
    """Several books as one."""
    sums = [
        sum((getattr(each, name) for each in books), Counter()) for name in ("files", "blocks", "reasons", "stopped")
    ]
    return Account(*sums)


@pytest.mark.parametrize("flat", [False, True] if os.environ.get("NCFIX_CORPUS") else [False])
def test_few_motions_of_part_programs_are_refused(
    flat: bool, root: Path, shared: Callable[[str], Path], figures: Callable[[str], None]
) -> None:
    machine, folder = load(str(root / "examples/machines/wCAYFXZSt.toml")), shared("corpus") / "siemens"
    title = "refusals, siemens{}, {}"
    parts = dict(by_file(folder, machine, "part", flat=flat))
    for name, books in parts.items():
        figures("\n".join(books.lines(title.format(", --flatten" if flat else "", name))))
        figures("\n".join(f"    stopped: {why}" for why in books.stopped))
    subprograms = together([books for _, books in by_file(folder, machine, "sub", flat=flat)])
    figures("\n".join(subprograms.lines(title.format(", --flatten" if flat else "", "subprograms of machines"))))
    figures("\n".join(f"    stopped: {count} {why}" for why, count in subprograms.stopped.most_common(5)))
    assert together(list(parts.values())).refused <= MOST
