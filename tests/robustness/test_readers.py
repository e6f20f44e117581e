"""Damaged files of all kinds are read or refused in words, and what went wrong once goes right: see `make fuzz`."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from conftest import some
from robustness import readers

CASES = int(os.environ.get("NCFIX_FUZZ_READERS") or some(12))


@pytest.mark.parametrize("path", readers.kept(), ids=lambda path: path.stem)
def test_what_was_found(path: Path) -> None:
    reader = path.name.rpartition("-")[0]
    assert readers.went(reader, path.read_bytes()) in ("read", "refused")


@pytest.mark.parametrize("reader", readers.READERS)
def test_sound_files_are_read(reader: str) -> None:
    outcomes = [readers.went(reader, text) for text in readers.seeds(reader)]
    assert set(outcomes) <= {"read", "refused"}, outcomes
    assert "read" in outcomes or reader == "certificate"


@pytest.mark.parametrize("reader", readers.READERS)
@settings(max_examples=CASES, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(chance=st.integers(0, 1 << 32))
def test_damaged_files(reader: str, chance: int) -> None:
    rng = random.Random(chance)
    text = readers.damaged(rng.choice(readers.seeds(reader)), rng)
    assert readers.went(reader, text) in ("read", "refused"), text
