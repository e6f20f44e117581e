"""The shared corpus of public programs and what its manifest says LinuxCNC's interpreter makes of them."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

BY_RULE = re.compile(r"G(?:53(?!\.)|28(?:\.1)?(?!\d)|30(?:\.1)?(?!\d)|38\.\d)")
"""Words of blocks whose motions are not the program's to move: machine coordinates, reference points, probing."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One program; `motions` is 0 where the interpreter refuses it, `rotary` the rotary axes that it moves."""

    path: Path
    dialect: str
    accepted: bool
    motions: int
    rotary: str


def entries(folder: Path) -> list[Entry]:
    """All the programs of the manifest."""
    with open(folder / "manifest.csv", newline="") as file:
        return [
            Entry(
                path=folder / row["file"],
                dialect=row["dialect"],
                accepted=row["rs274_rc"] == "0",
                motions=int(row["rs274_motions"] or 0),
                rotary=row["rotary_axes"],
            )
            for row in csv.DictReader(file)
        ]


def passed_by_rule(source: bytes) -> Callable[[int], bool]:
    """Tells of a line (from 1) whether its motion must not be touched."""
    lines = [_bare(line) for line in source.decode("latin-1").split("\n")]
    return lambda line: 0 < line <= len(lines) and BY_RULE.search(lines[line - 1]) is not None


def _bare(line: str) -> str:
    return re.sub(r"\([^)]*\)|;.*|\s", "", line).upper()
