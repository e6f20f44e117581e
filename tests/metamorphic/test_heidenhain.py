"""Metamorphic relations of Heidenhain Klartext."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from metamorphic import klartext_writers as write
from metamorphic.harness import PAIRS, Relation, Route, worst
from metamorphic.siemens_writers import calm
from ncfix.machine import Machine, load

STEP = 1e-4
"""mm and degrees: the least increment of the machine. Corrections are those of one path, each rounded to it."""

ONCE, TWICE = 1.01 * STEP, 2.01 * STEP
FLAT = [
    Relation("block numbers", write.numbered, write.full, 0.0),
    Relation("decimal comma and point", write.with_commas, write.full, 0.0),
    Relation("modal and full words", write.modal, write.full, ONCE),
    Relation("incremental and absolute", write.increments, write.full, TWICE),
    Relation("MM and INCH", write.inches, write.full, TWICE),
    Relation("CR and CC with C", write.radii, write.full, TWICE),
    Relation("polar and Cartesian", write.polar, write.full, TWICE),
    Relation("Q parameters and numbers", write.formulas, write.full, ONCE),
]


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(str(root / "examples/machines/wCAYFXZSt.toml"))


def check(relation: Relation, machine: Machine, figures: Callable[[str], None]) -> None:
    found = worst(relation, "heidenhain", machine)
    figures(f"metamorphic, heidenhain, {relation.name}: {PAIRS} pairs, worst {found * 1e3:.3f} um or mdeg")
    assert found <= relation.apart + 1e-9


@pytest.mark.parametrize("relation", FLAT, ids=lambda each: each.name)
def test_one_path(relation: Relation, machine: Machine, figures: Callable[[str], None]) -> None:
    check(relation, machine, figures)


def calmly(writer: Callable[[Route], str]) -> Callable[[Route], str]:
    """The route with the tool always on one side of upright."""
    return lambda path: writer(calm(path))


FIVE: dict[str, Callable[[Machine], Relation]] = {
    "M128": lambda m: Relation("M128 and machine axes", write.by_tip(m), write.in_axes, 3 * STEP, rotary=True),
    "TCPM": lambda m: Relation("FUNCTION TCPM and M128", write.by_function(m), write.by_tip(m), 0.0, rotary=True),
    "PLANE": lambda m: Relation("PLANE and none", write.in_plane(m), write.by_tip(m), 3 * STEP, rotary=True),
    "LN": lambda m: Relation(
        "LN and rotary words", calmly(write.by_vector(m)), calmly(write.by_tip(m)), 3 * STEP, rotary=True
    ),
}


@pytest.mark.parametrize("name", FIVE)
def test_one_path_with_five_axes(name: str, machine: Machine, figures: Callable[[str], None]) -> None:
    check(FIVE[name](machine), machine, figures)
