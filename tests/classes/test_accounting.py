"""How many motion blocks of the world's programs are refused, per dialect, and why."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from classes.accounting import FAMILIES, FOREIGN, account
from conftest import FULL
from ncfix.diagnostics import NcfixError
from ncfix.machine import load
from ncfix.text.reader import read

MOST, MOST_FLAT = 0.05, 0.01
"""The share of the motion blocks within the travel that may be refused, without and with --flatten."""

STUDIED = ("fanuc",) if not os.environ.get("NCFIX_CORPUS") else tuple(FAMILIES)
"""`NCFIX_CORPUS=1` takes all folders; the large ones take minutes."""


@pytest.mark.parametrize("family", STUDIED)
@pytest.mark.parametrize("flat", [False, True], ids=["", "flatten"])
def test_few_motions_are_refused(
    family: str, flat: bool, root: Path, shared: Callable[[str], Path], figures: Callable[[str], None]
) -> None:
    machine = load(str(root / "examples/machines/three_axis.toml"))
    books = account(shared("corpus") / family, FAMILIES[family], machine, flat=flat)
    figures("\n".join(books.lines(f"refusals, {family}{', --flatten' if flat else ''}")))
    assert books.refused <= (MOST_FLAT if flat else MOST)


def test_all_folders_are_read(shared: Callable[[str], Path], figures: Callable[[str], None]) -> None:
    """Each folder with its own dialect, every third of its files: the bytes come back, or a line is named."""
    for family, dialect in FAMILIES.items():
        read_, lines, unreadable, unnamed = 0, 0, 0, 0
        for path in sorted((shared("corpus") / family).iterdir())[:: 1 if FULL else 3]:
            source = path.read_bytes()
            try:
                program = read(source, path.name, dialect)
            except NcfixError as error:
                message = error.messages[0]
                unnamed += message.place is None
                unreadable += message.code not in FOREIGN
                continue
            assert program.source == source
            read_, lines = read_ + 1, lines + len(program)
        figures(f"reading, {family} as {dialect}: {read_} files, {lines} blocks; {unreadable} unreadable by line")
        assert read_ > 0
        assert unnamed == 0
