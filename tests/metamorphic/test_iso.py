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

FIVE_AXES = ("wCAYFXZSt", "wCBXFZYSt")
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
    Relation("G51.1 and mirrored words", write.mirrored, write.full, ONCE),
]


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(str(root / "examples/machines/wCAYFXZSt.toml"))


def without_play(machine: Machine) -> Machine:
    """Tips that move alike do not come along each axis the same way."""
    return machine.replace(effects=tuple(each for each in machine.effects if not each.basis.needs_direction))


def check(relation: Relation, dialect: str, machine: Machine, figures: Callable[[str], None]) -> None:
    found = worst(relation, dialect, machine)
    figures(f"metamorphic, {dialect}, {relation.name}: {PAIRS} pairs, worst {found * 1e3:.3f} um or mdeg")
    assert found <= relation.apart + 1e-9


@pytest.mark.parametrize("dialect", ["linuxcnc", "iso", "fanuc", "haas", "mitsubishi"])
@pytest.mark.parametrize("relation", COMMON, ids=lambda each: each.name)
def test_one_path(relation: Relation, dialect: str, machine: Machine, figures: Callable[[str], None]) -> None:
    check(relation, dialect, machine, figures)


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "mitsubishi"])
@pytest.mark.parametrize("relation", MACRO, ids=lambda each: each.name)
def test_one_path_in_macros(relation: Relation, dialect: str, machine: Machine, figures: Callable[[str], None]) -> None:
    check(relation, dialect, machine, figures)


@pytest.mark.parametrize("dialect", ["fanuc", "mitsubishi"])
@pytest.mark.parametrize("name", FIVE_AXES)
def test_tip_control_on_and_off(dialect: str, name: str, root: Path, figures: Callable[[str], None]) -> None:
    found = without_play(load(str(root / f"examples/machines/{name}.toml")))
    relation = Relation(
        f"G43.4 and machine axes of {name}", write.by_tip(found), write.in_axes(found), 3 * STEP, rotary=True
    )
    check(relation, dialect, found, figures)


@pytest.mark.parametrize("name", FIVE_AXES)
def test_a_vector_and_rotary_words(name: str, root: Path, figures: Callable[[str], None]) -> None:
    found = without_play(load(str(root / f"examples/machines/{name}.toml")))
    ways = write.by_direction(found), write.by_angles(found)
    check(Relation(f"G43.5 and G43.4 of {name}", *ways, 3 * STEP, rotary=True), "fanuc", found, figures)


FORMS = {"G68.2": write.as_angles, "G68.2 P2": write.as_points, "G68.2 P3": write.as_vectors}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", FIVE_AXES)
def test_tilted_plane_on_and_off(name: str, form: str, root: Path, figures: Callable[[str], None]) -> None:
    found = without_play(load(str(root / f"examples/machines/{name}.toml")))
    ways = write.in_plane(found, FORMS[form]), write.by_tip(found)
    check(Relation(f"{form} and G43.4 of {name}", *ways, 3 * STEP, rotary=True), "fanuc", found, figures)
