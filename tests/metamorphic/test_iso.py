"""Metamorphic relations of the RS274 and Fanuc families."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from metamorphic import iso_writers as write
from metamorphic.harness import PAIRS, Relation, worst
from ncfix.machine import Machine, load

STEP = 1e-4
"""mm and degrees: the least increment of the machine. Corrections are those of one path, each rounded to it."""

ONCE, TWICE = 1.01 * STEP, 2.01 * STEP
COMMON = [
    Relation("modal and full words", write.modal, write.full, ONCE),
    Relation("packed and spaced", write.packed, write.full, 0.0),
    Relation("lower and upper case", write.lower, write.full, 0.0),
    Relation("with and without N words", write.numbered, write.full, 0.0),
    Relation("G91 and G90", write.increments, write.full, TWICE),
    Relation("G20 and G21", write.inches, write.full, TWICE),
    Relation("R and I J K", write.radii, write.full, TWICE),
]
MACRO = [
    Relation("least increments and decimal points", write.pointless, write.full, 5.01 * STEP),
    Relation("expressions and numbers", write.macro, write.full, ONCE),
]


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(str(root / "examples/machines/wCAYFXZSt.toml"))


def check(relation: Relation, dialect: str, machine: Machine, figures: Callable[[str], None]) -> None:
    found = worst(relation, dialect, machine)
    figures(f"metamorphic, {dialect}, {relation.name}: {PAIRS} pairs, worst {found * 1e3:.3f} um or mdeg")
    assert found <= relation.apart + 1e-9


@pytest.mark.parametrize("dialect", ["linuxcnc", "iso", "fanuc"])
@pytest.mark.parametrize("relation", COMMON, ids=lambda each: each.name)
def test_one_path(relation: Relation, dialect: str, machine: Machine, figures: Callable[[str], None]) -> None:
    check(relation, dialect, machine, figures)


@pytest.mark.parametrize("relation", MACRO, ids=lambda each: each.name)
def test_one_path_in_fanuc(relation: Relation, machine: Machine, figures: Callable[[str], None]) -> None:
    check(relation, "fanuc", machine, figures)


def test_tip_control_on_and_off(machine: Machine, figures: Callable[[str], None]) -> None:
    relation = Relation("G43.4 and machine axes", write.by_tip(machine), write.in_axes, 3 * STEP, rotary=True)
    check(relation, "fanuc", machine, figures)


def test_tilted_plane_on_and_off(machine: Machine, figures: Callable[[str], None]) -> None:
    relation = Relation("G68.2 and G43.4", write.in_plane(machine), write.by_tip(machine), 3 * STEP, rotary=True)
    check(relation, "fanuc", machine, figures)
