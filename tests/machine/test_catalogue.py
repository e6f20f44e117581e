"""What the names mean, and that what is said of their senses is so."""

from __future__ import annotations

import numpy as np
import pytest

from machine import chains
from ncfix.machine import Axis, Effect
from ncfix.machine.axes import IDLE, component_names, component_title, squareness_meaning
from ncfix.machine.codes import CODES


@pytest.mark.parametrize(
    ("name", "title"),
    [
        ("EXX", "positioning of X"),
        ("EYX", "straightness of X in Y"),
        ("EAX", "roll of X"),
        ("ECC", "angular positioning of C"),
        ("EZC", "axial motion of C in Z"),
        ("EXC", "radial motion of C in X"),
        ("EC0Y", "direction of Y, turned about Z"),
        ("EX0C", "offset of the axis line of C in X"),
        ("EC0C", "zero offset of C"),
    ],
)
def test_titles(name: str, title: str) -> None:
    assert component_title(name) == title


def test_every_name_has_a_title_of_its_own() -> None:
    titles = [component_title(name) for name in component_names()]
    assert len(titles) == 7 * 12
    assert len(set(titles)) == len(titles)


def test_the_stated_sense_of_squareness_is_what_the_machine_does() -> None:
    """ "+X to +Y is 90 deg + EC0Y": the angle between the directions in which the axes really run."""
    plain = chains.four_kinds()["w C F X Y Z B t"]
    stated = 0
    for name in component_names("XYZ"):
        sentence = squareness_meaning(name)
        if not sentence:
            continue
        stated += 1
        first, _, second, _, _, _, sign, effect = (
            sentence.replace("+X", "X").replace("+Y", "Y").replace("+Z", "Z").split()
        )
        assert effect == name
        machine = plain.replace(effects=(Effect(name, (1e-5,)),))
        ways = [machine.actual_tip(100 * np.eye(5)[machine.axis_names.index(axis)]) for axis in (first, second)]
        ways = [(way - machine.actual_tip(np.zeros(5))) / 100 for way in ways]
        beyond = np.arccos(ways[0] @ ways[1]) - np.pi / 2
        assert beyond == pytest.approx(1e-5 if sign == "+" else -1e-5, abs=1e-14)  # its cube is 1e-15
    assert stated == 6


def test_components_that_are_said_to_do_nothing_do_nothing() -> None:
    machine = chains.four_kinds()["w X F Y Z C A t"]
    q = chains.random_positions(np.random.default_rng(0), machine, 5)
    for name in component_names("XYZAC"):
        if len(name) == 4:
            idle = IDLE in component_title(name)
            error = machine.replace(effects=(Effect(name, (1e-4,)),)).error(q)
            assert idle == bool(np.abs(error).max() < 1e-10), name


def test_every_code_is_explained() -> None:
    assert all(code.title and len(code.text) > 30 and code.hint for code in CODES.values())


def test_a_skewed_axis_has_motions_that_are_neither_axial_nor_radial() -> None:
    skewed = Axis("B", True, True, (0.0, -(0.5**0.5), 0.5**0.5))
    assert component_title("EXB", skewed) == "radial motion of B in X"
    assert component_title("EYB", skewed) == "motion of B in Y"


def test_the_axis_says_what_the_letter_does_not() -> None:
    assert component_title("EZB", Axis("B", True, True, (0.0, 0.0, 1.0))) == "axial motion of B in Z"
    assert component_title("EXW", Axis("W", True, True, (0.0, 0.0, 1.0))) == "radial motion of W in X"
