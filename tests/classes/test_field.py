"""Programs as shops have them: read, followed as worked out by hand, and corrected or refused with sense."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from classes.field import SETUP, faults, refused
from ncfix.machine import Machine, load

FOLDER = Path(__file__).parent / "field"
PROGRAMS = sorted(path for dialect in ("siemens", "fanuc", "heidenhain") for path in (FOLDER / dialect).iterdir())


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(str(root / "examples/machines/wCAYFXZSt.toml"))


@pytest.mark.parametrize("path", [path for path in PROGRAMS if path.parent.name == "fanuc"], ids=lambda path: path.stem)
def test_reference_points_need_not_be_given(path: Path, machine: Machine) -> None:
    assert refused(path, "fanuc", machine, SETUP) == refused(path, "fanuc", machine, replace(SETUP, references={}))


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_a_program_of_a_shop(path: Path, machine: Machine) -> None:
    assert faults(path, path.parent.name, machine) == []
