"""A machine without an error: every program, in a usual run every second, comes back byte for byte, or its first
unreadable line is named."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import FULL
from differential import corpus, product

DIALECTS = ("linuxcnc", "iso", "grbl")


@pytest.mark.parametrize("dialect", DIALECTS)
def test_programs_come_back_byte_for_byte(
    dialect: str,
    shared: Callable[[str], Path],
    machine_file: Callable[[str], Path],
    tmp_path: Path,
    figures: Callable[[str], None],
) -> None:
    same, unreadable, faults = 0, [], []
    entries = [entry for entry in corpus.entries(shared("corpus")) if entry.dialect == dialect]
    for entry in entries[:: 1 if FULL else 2]:
        outcome = product.fix(entry.path, machine_file("perfect"), tmp_path)
        name = entry.path.name
        if outcome.code == product.DONE and outcome.text == entry.path.read_bytes():
            same += 1
        elif outcome.code == product.UNREADABLE and outcome.text is None:
            unreadable.append((name, entry.accepted, outcome))
        else:
            faults.append(f"{name}: exit {outcome.code}, {outcome.errors[:200]}")
    faults += [f"{name}: no line named: {o.errors[:200]}" for name, _, o in unreadable if not any(o.places)]
    faults += [f"{name}: rs274 reads it: {o.errors[:300]}" for name, accepted, o in unreadable if accepted]
    figures(f"identity, {dialect}: {same} byte for byte, {len(unreadable)} unreadable, {len(faults)} at fault")
    assert not faults, "\n".join(faults)
    assert same > 0
