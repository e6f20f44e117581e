"""Programs as shops have them: read, followed as worked out by hand, and corrected or refused with sense."""

from __future__ import annotations

from pathlib import Path

import pytest

from classes.field import faults
from ncfix.machine import Machine, load

FOLDER = Path(__file__).parent / "field"
PROGRAMS = sorted(path for dialect in ("siemens", "fanuc", "heidenhain") for path in (FOLDER / dialect).iterdir())


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(str(root / "examples/machines/wCAYFXZSt.toml"))


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_a_program_of_a_shop(path: Path, machine: Machine) -> None:
    assert faults(path, path.parent.name, machine) == []
