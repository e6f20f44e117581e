"""What becomes of the motion blocks of public SINUMERIK programs, and why."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from classes import accounting
from classes.accounting import account
from ncfix.machine import load

MOST = 0.05
"""The share of motion blocks that may be refused in programs that stand by themselves."""

OF_A_MACHINE = re.compile(rb"(?im)^[ \t]*(?:N\d+[ \t]*)?(?:PROC\b|M17\b|RET\b|CGTECH_MACRO\b)")
"""Shows a subprogram: the axes go where its parameters and the machine's global data say, at run time."""

PART_ON_TABLE = {"G54": {"X": -150.0, "Y": -80.0, "Z": 0.0, "A": 0.0, "C": 0.0}}


@pytest.mark.parametrize("flat", [False, True] if os.environ.get("NCFIX_CORPUS") else [False])
def test_few_motions_of_part_programs_are_refused(
    flat: bool,
    root: Path,
    shared: Callable[[str], Path],
    tmp_path: Path,
    figures: Callable[[str], None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(accounting, "SETUP", replace(accounting.SETUP, work_offsets=PART_ON_TABLE))
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    for path in (shared("corpus") / "siemens").iterdir():
        kind = "sub" if OF_A_MACHINE.search(path.read_bytes()) else "part"
        (tmp_path / kind).mkdir(exist_ok=True)
        (tmp_path / kind / path.name).write_bytes(path.read_bytes())
    books = {kind: account(tmp_path / kind, "siemens", machine, flat=flat) for kind in ("part", "sub")}
    for kind, title in (("part", "part programs"), ("sub", "subprograms of machines")):
        figures("\n".join(books[kind].lines(f"refusals, siemens, {title}{', --flatten' if flat else ''}")))
    assert books["part"].refused <= MOST
