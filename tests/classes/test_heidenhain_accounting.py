"""What becomes of the motion blocks of the Klartext programs at hand, each on a machine that has its axes."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from classes.accounting import Account
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_flat, fix_program
from ncfix.compensate.report import FixReport
from ncfix.control.setup import Setup, Tool
from ncfix.diagnostics import NcfixError
from ncfix.machine import Machine, load
from ncfix.text.reader import read

NO_KLARTEXT = "antlr__75f6ad_sapf-bif-examples.txt"
LARGE = "DigiLiner__91853f_5axis_BC.ptp"
"""More blocks than all others together, of an early postprocessor; only with `NCFIX_CORPUS=1`."""

TWIN = "DigiLiner__d9e9a9_YL-01.h"
"""The same program as another one under another name."""

CALLED = {"100": "ailtonbsj__7bb66a_100.nc", "Plan.h": "jstjst__835ef3_Plan.h"}
DEFINED = re.compile(rb"TOOL\s+DEF\s*(\d+)")
LENGTH, RADIUS = 80.0, 8.0
"""mm, of tools that a program does not define itself: with tools of no length spindles would stand in the table."""

STOPPING = ("the arc has no radius", "the arc does not close", "this line is unknown")
"""Why blocks are refused at which the control itself stops."""

MOST, MOST_FLAT = 0.05, 0.01


def setup_for(source: bytes) -> Setup:
    """All offsets zero; tools as the program defines them, and others of a usual length."""
    own = {int(number) for number in DEFINED.findall(source)}
    return Setup(assume_zero=True, tools={each: Tool(LENGTH, RADIUS) for each in range(1, 20) if each not in own})


def machine_for(source: bytes, root: Path) -> Machine:
    """A machine of the examples that has the rotary axes of a program."""
    turns = {letter for letter in "AB" if re.search(rb"(?m)^[ \d]*L?[^;\n]*[ ]%c[+-]?\d" % ord(letter), source)}
    name = "wCAYFXZSt" if "A" in turns else "wCBXFZYSt" if turns else "three_axis"
    return load(str(root / f"examples/machines/{name}.toml"))


def account(folder: Path, root: Path) -> tuple[Account, Account]:
    """Correct every program and keep the books: as it is, and with --flatten where something is refused."""
    plain, flat = Account(), Account()
    options = FixOptions(figures=False, tolerance_um=50.0)
    for path in sorted(folder.iterdir()):
        if path.name in (NO_KLARTEXT, TWIN) or (path.name == LARGE and not os.environ.get("NCFIX_CORPUS")):
            continue
        source = path.read_bytes()

        def resolve(name: str) -> bytes | None:
            return (folder / CALLED[name]).read_bytes() if name in CALLED else None

        try:
            program, machine, setup = read(source, path.name), machine_for(source, root), setup_for(source)
            report = fix_program(program, machine, setup, options, resolve).report
            again = fix_flat(program, machine, setup, options, resolve).report if report.refused else report
        except NcfixError as error:
            for books in (plain, flat):
                books.files["not followed"] += 1
                books.stopped[f"{path.name}: {error.messages[0].code} {error.messages[0].text}"] += 1
            continue
        enter(plain, report)
        enter(flat, again)
    return plain, flat


def enter(books: Account, report: FixReport) -> None:
    """Enter what became of one program."""
    refused = {each.line: each.reason for each in report.refused}
    books.files["followed"] += 1
    books.blocks.update(corrected=report.compensated, passed=report.passed, refused=len(refused))
    books.reasons.update(Counter(re.sub(r"[\d.]+", "#", reason) for reason in refused.values()))


def at_stops(books: Account) -> int:
    """Refused blocks at which the control itself stops."""
    return sum(count for reason, count in books.reasons.items() if reason.startswith(STOPPING))


def share(books: Account) -> float:
    """The share of refused blocks among those at which no control stops."""
    stops = at_stops(books)
    return (books.blocks["refused"] - stops) / (sum(books.blocks.values()) - stops)


def test_few_motions_are_refused(root: Path, shared: Callable[[str], Path], figures: Callable[[str], None]) -> None:
    plain, flat = account(shared("corpus") / "heidenhain", root)
    for name, books in (("", plain), (", --flatten", flat)):
        figures("\n".join(books.lines(f"refusals, heidenhain{name}") + list(map(str, books.stopped))))
        figures(
            f"at {at_stops(books)} of them the control itself stops; refused of all others: {100 * share(books):.2f} %"
        )
    assert plain.refused <= MOST
    assert share(flat) <= MOST_FLAT
