"""What the names mean, checked against what the machine does with them."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from ncfix.machine import Axis, Effect, Machine, catalogue

LETTERS = "XYZ"
EFFECT = 1e-4


def angle(effect: str, first: str, second: str) -> float:
    """The angle between two axis lines of a machine with this effect, rad: from where its tip really goes."""
    axes = tuple(Axis(name, False, False, tuple(np.eye(3)[i])) for i, name in enumerate(LETTERS))
    machine = Machine("square", "w F X Y Z t", axes, effects=(Effect(effect, (EFFECT,)),))
    lines = [
        machine.actual_tip(100.0 * np.eye(3)[LETTERS.index(name)]) - machine.actual_tip(np.zeros(3))
        for name in (first, second)
    ]
    a, b = (line / np.linalg.norm(line) for line in lines)
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


@pytest.mark.parametrize("name", ["EB0X", "EC0X", "EA0Y", "EC0Y", "EA0Z", "EB0Z"])
def test_squareness_is_as_stated(name: str) -> None:
    found = re.fullmatch(r"\+([XYZ]) to \+([XYZ]) is 90 deg ([+-]) (\w+)", catalogue.squareness(name))
    assert found
    first, second, sign, again = found.groups()
    assert again == name
    assert angle(name, first, second) - np.pi / 2 == pytest.approx(EFFECT if sign == "+" else -EFFECT, rel=1e-6)


@pytest.mark.parametrize("name", ["EXX", "EA0X", "EX0Y", "EA0C", "EC0S", "growth"])
def test_other_names_state_no_squareness(name: str) -> None:
    assert catalogue.squareness(name) == ""


@pytest.mark.parametrize(
    ("name", "title"),
    [
        ("EXX", "positioning of X"),
        ("EYX", "straightness of X in Y"),
        ("EAX", "roll of X"),
        ("ECX", "tilt of X about Z"),
        ("EXC", "radial motion of C in X"),
        ("EZC", "axial motion of C in Z"),
        ("ECC", "angular positioning of C"),
        ("EBC", "tilt of C about Y"),
        ("EX0C", "offset of the axis line of C in X"),
        ("EA0C", "tilt of the axis line of C, turned about X"),
        ("EC0Y", "direction of Y, turned about Z"),
        ("EX0X", "zero offset of X"),
        ("EZS", "motion of the spindle in Z"),
        ("EXW", "straightness of W in X"),
    ],
)
def test_titles(name: str, title: str) -> None:
    assert catalogue.title(name) == title


def test_every_name_has_a_title_of_its_own() -> None:
    titles = [catalogue.title(name) for name in catalogue.names()]
    assert len(titles) == 7 * 12 == len(set(titles))


@pytest.mark.parametrize("name", ["EXx", "X", "EX1X", "EDX"])
def test_what_is_no_component_has_no_title(name: Any) -> None:
    with pytest.raises(ValueError, match="ISO 230-1"):
        catalogue.title(name)
