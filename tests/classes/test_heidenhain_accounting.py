"""What becomes of the motion blocks of the Klartext programs at hand, each on a machine that has its axes."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from classes.accounting import Account
from ncfix.compensate.fix import FixOptions, fix_program
from ncfix.compensate.flat import fix_flat
from ncfix.diagnostics import NcfixError
from ncfix.machine import Machine, load
from ncfix.program.reader import read
from ncfix.program.setup import Setup, Tool

NO_KLARTEXT = "antlr__75f6ad_sapf-bif-examples.txt"
LARGE = ("DigiLiner__91853f_5axis_BC.ptp", "DigiLiner__50c4a7_xg_model3.h")
"""Nine tenths of all blocks. The first only with `NCFIX_CORPUS=1`; the other does not need --flatten."""

EXCERPTS = ("DigiLiner__fb97f0_xiaojiubei-123.H", "DigiLiner__a6f35c_xiaojiubei-11.H")
"""Pieces of one program for a machine whose A axis turns the other way; lines that switch M128 are cut out of it."""

TWIN = "DigiLiner__d9e9a9_YL-01.h"
"""The same program as another one under another name."""

CALLED = {"100": "ailtonbsj__7bb66a_100.nc", "Plan.h": "jstjst__835ef3_Plan.h"}
SETUP = Setup(assume_zero=True, tools={number: Tool(0.0, 8.0) for number in range(1, 20)})
MOST, MOST_FLAT = 0.05, 0.01


def machine_for(source: bytes, root: Path) -> Machine:
    """A machine of the examples that has the rotary axes of a program."""
    turns = {letter for letter in "AB" if re.search(rb"(?m)^[ \d]*L?[^;\n]*[ ]%c[+-]?\d" % ord(letter), source)}
    name = "wCAYFXZSt" if "A" in turns else "wCBXFZYSt" if turns else "three_axis"
    return load(str(root / f"examples/machines/{name}.toml"))


def account(folder: Path, root: Path, left_out: tuple[str, ...], *, flat: bool) -> Account:
    """Correct every program but those left out and keep the books."""
    books = Account()
    fix = fix_flat if flat else fix_program
    options = FixOptions(verify=False, tolerance_um=50.0)
    for path in sorted(folder.iterdir()):
        if path.name in (NO_KLARTEXT, TWIN, *left_out):
            continue
        source = path.read_bytes()

        def resolve(name: str) -> bytes | None:
            return (folder / CALLED[name]).read_bytes() if name in CALLED else None

        try:
            report = fix(read(source, path.name), machine_for(source, root), SETUP, options, resolve).report
        except NcfixError as error:
            books.files["not followed"] += 1
            books.stopped[f"{path.name}: {error.messages[0].code} {error.messages[0].text}"] += 1
            continue
        books.files["followed"] += 1
        refused = {each.line: each.reason for each in report.refused}
        books.blocks.update(corrected=report.compensated, passed=report.passed, refused=len(refused))
        books.reasons.update(Counter(re.sub(r"[\d.]+", "#", reason) for reason in refused.values()))
    return books


@pytest.mark.parametrize("flat", [False, True], ids=["", "flatten"])
def test_few_motions_are_refused(
    flat: bool, root: Path, shared: Callable[[str], Path], figures: Callable[[str], None]
) -> None:
    """Without the large ones; with --flatten without the excerpts, too, of which most is refused for good reason."""
    large = () if os.environ.get("NCFIX_CORPUS") else LARGE if flat else LARGE[:1]
    books = account(shared("corpus") / "heidenhain", root, (*large, *(EXCERPTS if flat else ())), flat=flat)
    figures("\n".join([*books.lines(f"refusals, heidenhain{', --flatten' if flat else ''}"), *map(str, books.stopped)]))
    assert books.refused <= (MOST_FLAT if flat else MOST)
