"""How many blocks a correction puts into the programs of the corpus, by language, at a tolerance.

    make inserted-blocks                        shared programs (`NCFIX_SHARED`, else ../shared), tolerance 1 um
    make inserted-blocks TOLERANCE=1.9          another tolerance
    make inserted-blocks MOST=20000             only programs of up to so many bytes

Programs that cannot be followed are counted apart.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
from dataclasses import dataclass
from pathlib import Path

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.solve import SelfCheckError
from ncfix.control.setup import Setup
from ncfix.diagnostics import NcfixError
from ncfix.machine import Machine, load
from ncfix.text.reader import read

ROOT = Path(__file__).resolve().parent.parent
MACHINE = Path(__file__).with_name("five_axis.toml")
FOLDERS = {
    "fanuc": "fanuc",
    "grbl": "iso",
    "heidenhain": "heidenhain",
    "iso": "iso",
    "linuxcnc": "linuxcnc",
    "siemens": "siemens",
}
"""Of the corpus, and the dialect of its programs."""


@dataclass(slots=True)
class Row:
    """What there is to say of the programs of a folder.

    programs    corrected
    moves       motions in them
    split       programs that got blocks
    inserted    blocks that were put in
    impossible  programs that cannot be followed with a setup of zeros
    """

    name: str
    programs: int = 0
    moves: int = 0
    split: int = 0
    inserted: int = 0
    impossible: int = 0

    def add(self, source: Path, dialect: str, machine: Machine, tolerance_um: float) -> None:
        """Correct a program."""
        setup = Setup(assume_zero=True, no_point="calculator")
        options = FixOptions(tolerance_um=tolerance_um, allow_refused=True, force=True, figures=False)
        try:
            report = fix_program(read(source.read_bytes(), source.name, dialect), machine, setup, options).report
        except (NcfixError, SelfCheckError):
            self.impossible += 1
            return
        self.programs += 1
        self.moves += report.moves
        self.split += report.inserted_blocks > 0
        self.inserted += report.inserted_blocks

    def __str__(self) -> str:
        figures = (self.programs, self.moves, self.split, self.inserted, self.impossible)
        return f"{self.name:12}" + "".join(f"{each:12}" for each in figures)


def main() -> int:
    """Correct all, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tolerance-um", type=float, default=1.0)
    parser.add_argument("--step-um", type=float, default=1.0, help="least increment, also in 1/1000 degree; 0: its own")
    parser.add_argument("--machine", default=str(MACHINE), help="machine file")
    parser.add_argument("--most", type=int, default=200_000, help="bytes of a program")
    parser.add_argument("--only", choices=FOLDERS, help="one folder of the corpus")
    given = parser.parse_args()
    shared = Path(os.environ.get("NCFIX_SHARED") or ROOT.parent / "shared")
    machine = load(given.machine)
    if given.step_um:
        machine = machine.replace(least_increment=(given.step_um * 1e-3, math.radians(given.step_um * 1e-3)))
    titles = ("programs", "motions", "with more", "inserted", "impossible")
    print(f"{given.tolerance_um:g} um".ljust(12) + "".join(f"{title:>12}" for title in titles))
    total = Row("all")
    for name, dialect in FOLDERS.items():
        if given.only not in (None, name):
            continue
        row = Row(name)
        for path in sorted((shared / "corpus" / name).iterdir()):
            if 0 < path.stat().st_size <= given.most:
                row.add(path, dialect, machine, given.tolerance_um)
        print(row, flush=True)
        for figure in ("programs", "moves", "split", "inserted", "impossible"):
            setattr(total, figure, getattr(total, figure) + getattr(row, figure))
    print(total)
    return 0


if __name__ == "__main__":
    sys.exit(main())
