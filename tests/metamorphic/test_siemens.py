"""Metamorphic relations of SINUMERIK."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from metamorphic import siemens_writers as write
from metamorphic.harness import PAIRS, Relation, Route, worst
from ncfix.machine import Machine, load

STEP = 1e-4
"""mm and degrees: the least increment of the machine. Corrections are those of one path, each rounded to it."""

ONCE, TWICE = 1.01 * STEP, 2.01 * STEP
RELATIONS = [
    Relation("words left out and all words", write.changed, write.full, ONCE),
    Relation("packed and spaced", write.packed, write.full, 0.0),
    Relation("lower and upper case", write.lower, write.full, 0.0),
    Relation("with and without N words", write.numbered, write.full, 0.0),
    Relation("X= and X", write.equals, write.full, 0.0),
    Relation("R parameters and numbers", write.variables, write.full, ONCE),
    Relation("G91 and G90", write.increments, write.full, TWICE),
    Relation("IC and G90", write.by_word, write.full, TWICE),
    Relation("AC in G91 and G90", write.absolute_in_g91, write.full, TWICE),
    Relation("G700 and G710", write.inches, write.full, TWICE),
    Relation("CR and I J", write.radii, write.full, TWICE),
    Relation("I=AC and I", write.centres, write.full, TWICE),
    Relation("TRANS and none", write.shifted, write.full, ONCE),
    Relation("MIRROR and none", write.mirrored, write.full, ONCE),
    Relation("SCALE and none", write.scaled, write.full, TWICE),
    Relation("ROT and none", write.rotated, write.full, ONCE),
    Relation("polar and Cartesian", write.polar, write.full, TWICE),
    Relation("polar words left out", write.sparing_polar, write.full, TWICE),
    Relation("CT and I J", write.tangents, write.tangents_by_centre, TWICE, joins=False),
]


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(str(root / "examples/machines/wCAYFXZSt.toml"))


def check(relation: Relation, machine: Machine, figures: Callable[[str], None]) -> None:
    found = worst(relation, "siemens", machine)
    figures(f"metamorphic, siemens, {relation.name}: {PAIRS} pairs, worst {found * 1e3:.3f} um or mdeg")
    assert found <= relation.apart + 1e-9


@pytest.mark.parametrize("relation", RELATIONS, ids=lambda each: each.name)
def test_one_path(relation: Relation, machine: Machine, figures: Callable[[str], None]) -> None:
    check(relation, machine, figures)


def test_tip_control_on_and_off(machine: Machine, figures: Callable[[str], None]) -> None:
    check(Relation("TRAORI and axes", write.by_tip(machine), write.in_axes, 3 * STEP, rotary=True), machine, figures)


def test_vectors_and_rotary_words(machine: Machine, figures: Callable[[str], None]) -> None:
    by_vector, by_words = write.by_vector(machine), write.by_tip(machine)

    def left(path: Route) -> str:
        return by_vector(write.calm(path))

    def right(path: Route) -> str:
        return by_words(write.calm(path))

    check(Relation("A3 B3 C3 and A C", left, right, 3 * STEP, rotary=True), machine, figures)


def test_angles_and_vectors(machine: Machine, figures: Callable[[str], None]) -> None:
    by_angles, by_vector = write.by_angles(machine), write.by_vector(machine)

    def left(path: Route) -> str:
        return by_angles(write.calm(path))

    def right(path: Route) -> str:
        return by_vector(write.calm(path))

    check(Relation("A2 B2 C2 and A3 B3 C3", left, right, 3 * STEP, rotary=True), machine, figures)


def test_turned_frames_on_and_off(machine: Machine, figures: Callable[[str], None]) -> None:
    left, right = write.in_frame(machine), write.by_tip(machine)
    check(Relation("TRANS AROT and none", left, right, 3 * STEP, rotary=True), machine, figures)


def test_tilted_plane_on_and_off(machine: Machine, figures: Callable[[str], None]) -> None:
    relation = Relation("CYCLE800 and TRAORI", write.in_plane(machine), write.in_plane_by_vector, 3 * STEP)
    check(relation, machine, figures)
