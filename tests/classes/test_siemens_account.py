"""What becomes of the motion blocks of public SINUMERIK programs, and why."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import replace
from functools import reduce
from pathlib import Path

import pytest

from classes import accounting
from classes.accounting import account
from ncfix.machine import loads

MOST, MOST_IN_REACH = 0.05, 0.01
"""The share of motion blocks that may be refused in programs that stand by themselves: on a machine that some of them
leave the travel of, and on one that is large enough."""

WIDER = {"[-130, 130]": "[-260, 260]", "[-40, 300]": "[-100, 500]"}
"""Travels of X and Z of the machine, and of one that is as wrong, and larger."""

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
    text = (root / "examples/machines/wCAYFXZSt.toml").read_text()
    small, large = loads(text), loads(reduce(lambda known, wide: known.replace(*wide), WIDER.items(), text))
    for path in (shared("corpus") / "siemens").iterdir():
        kind = "sub" if OF_A_MACHINE.search(path.read_bytes()) else "part"
        (tmp_path / kind).mkdir(exist_ok=True)
        (tmp_path / kind / path.name).write_bytes(path.read_bytes())
    tables = (
        ("part", "part programs", small, MOST),
        ("part", "part programs on a machine that is large enough", large, MOST_IN_REACH),
        ("sub", "subprograms of machines", large, 1.0),
    )
    for kind, title, machine, most in tables:
        books = account(tmp_path / kind, "siemens", machine, flat=flat)
        figures("\n".join(books.lines(f"refusals, siemens, {title}{', --flatten' if flat else ''}")))
        assert books.refused <= most
