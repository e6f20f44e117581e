"""docs/conventions.md, docs/formats.md and the shipped machines say what the code does."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from ncfix.machine import Effect, State, dumps, load, loads
from ncfix.machine.axes import squareness_meaning
from ncfix.machine.effects import kinds

MACHINES = ("dmu50", "three_axis", "wCAYFXZSt", "wCBXFZYSt")


@pytest.fixture(scope="module")
def formats(root: Path) -> str:
    """The section on the machine file."""
    text = (root / "docs/formats.md").read_text(encoding="utf-8")
    return text.split("## Machine file")[1].split("\n## ")[0]


def test_the_example_of_the_document_is_a_machine(formats: str) -> None:
    text = re.search(r"```toml\n(.*?)```", formats, re.DOTALL)
    assert text is not None
    machine = loads(text[1])
    assert machine.axis_names == ("C", "B", "X", "Y", "Z")
    assert [effect.name for effect in machine.effects] == ["EXX", "EC0Y", "EZS"]
    assert loads(dumps(machine)) == machine


def test_every_key_of_an_effect_is_documented(formats: str) -> None:
    for field in fields(Effect):
        assert f"`{field.name}`" in formats, field.name


def test_every_basis_and_its_keys_are_documented(formats: str) -> None:
    rows = dict(re.findall(r"^\| `(\w+)` \|(.*)$", formats, re.MULTILINE))
    for name, kind in kinds().items():
        if kind.__module__.startswith("ncfix.machine."):
            for field in fields(kind):  # type: ignore[arg-type]
                assert f"`{field.name}" in rows[name], (name, field.name)


def test_the_squareness_table_is_the_catalogue_s(root: Path) -> None:
    text = (root / "docs/conventions.md").read_text(encoding="utf-8")
    rows = re.findall(
        r"^\| `(E[ABC]0[XYZ])` \|.*\| (\+[XYZ]) and (\+[XYZ]) is 90° ([+-]) (E[ABC]0[XYZ]) \|$", text, re.MULTILINE
    )
    assert len(rows) == 6
    for name, first, second, sign, effect in rows:
        assert squareness_meaning(name) == f"{first} to {second} is 90 deg {sign} {effect}"


def test_the_figure_is_well_formed_and_has_a_description(root: Path) -> None:
    picture = ElementTree.parse(root / "docs/figures/frames.svg").getroot()
    assert picture.find("{http://www.w3.org/2000/svg}desc") is not None
    assert "figures/frames.svg" in (root / "docs/conventions.md").read_text(encoding="utf-8")


def test_all_shipped_machines_are_here(root: Path) -> None:
    assert {path.stem for path in (root / "examples/machines").glob("*.toml")} >= set(MACHINES)


@pytest.mark.parametrize("name", MACHINES)
def test_shipped_machines(root: Path, name: str) -> None:
    """They load, come back, say that they are illustrative, and err by a believable amount within their travel."""
    path = root / f"examples/machines/{name}.toml"
    machine = load(path)
    assert loads(dumps(machine)) == machine
    assert "illustrative" in path.read_text(encoding="utf-8")
    limits = np.where(np.isfinite(machine.ranges), machine.ranges, [-np.pi, np.pi])
    q = np.random.default_rng(0).uniform(limits[:, 0], limits[:, 1], (2000, len(machine.axes)))
    size = np.linalg.norm(machine.error(q, State(100.0, direction=1))[:, :3], axis=1)
    assert 0.005 < size.mean() < 0.06
    assert size.max() < machine.max_correction[0]
    spans = machine.ranges[:, 1] - machine.ranges[:, 0]
    assert (spans[~machine.rotary] >= 240).all()
    assert all(effect.active for effect in machine.effects)
