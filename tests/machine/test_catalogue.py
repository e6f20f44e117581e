"""What the names mean, and that what is said of their senses is so."""

from __future__ import annotations

import numpy as np
import pytest

from machine import chains
from ncfix.machine import Axis, Effect, Machine
from ncfix.machine.axes import IDLE, GaugeLine, component_names, component_title, squareness_meaning
from ncfix.machine.codes import CODES
from ncfix.machine.state import State


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


def odd() -> Machine:
    """A quill W along Z that counts outwards, a table B at 45 degrees with error axes of its own, a joint J about X."""
    s = float(np.sqrt(0.5))
    triad = (1.0, 0.0, 0.0), (0.0, s, s), (0.0, -s, s)
    axes = (
        Axis("B", True, True, (0.0, -s, s), (0.0, 0.0, 155.0), error_axes=triad),
        Axis("X", False, True, (-1.0, 0.0, 0.0)),
        Axis("Y", False, False, (0.0, 1.0, 0.0)),
        Axis("J", True, False, (1.0, 0.0, 0.0), (0.0, 10.0, 60.0)),
        Axis("W", False, False, (0.0, 0.0, -1.0)),
    )
    return Machine("odd", "w B X F Y J W t", axes, GaugeLine((0.0, 0.0, 1.0), (0.0, 0.0, 80.0)))


MACHINES = (chains.four_kinds()["w X F Y Z C A t"], odd())


@pytest.mark.parametrize("machine", MACHINES, ids=lambda machine: str(machine.topology))
def test_components_that_are_said_to_do_nothing_do_nothing(machine: Machine) -> None:
    q = chains.random_positions(np.random.default_rng(0), machine, 5)
    for name in component_names(machine.axis_names):
        if len(name) == 4:
            idle = IDLE in component_title(name, machine.axis(name[-1]))
            error = machine.replace(effects=(Effect(name, (1e-4,)),)).error(q)
            assert idle == bool(np.abs(error).max() < 1e-10), name


@pytest.mark.parametrize("machine", MACHINES, ids=lambda machine: str(machine.topology))
def test_positioning_moves_the_tip_as_the_axis_does(machine: Machine) -> None:
    """An error motion is called positioning, and the location error beside it zero offset, where it does just that."""
    q = chains.random_positions(np.random.default_rng(0), machine, 5)
    for column, axis in enumerate(machine.axes):
        own = machine.axis_jacobian(q, 100.0)[..., column]
        for name in component_names([axis.name]):
            error = machine.replace(effects=(Effect(name, (1e-6,)),)).error(q, State(100.0)) * 1e6
            alike = min(np.abs(error - own).max(), np.abs(error + own).max()) < 1e-2  # second order: 1e-6 of metres
            assert alike == (component_title(name, axis).removeprefix("angular ").split()[0] in ("positioning", "zero"))
            assert machine.is_positioning(name) == (alike and len(name) == 3)


def test_every_code_is_explained() -> None:
    assert all(code.title and len(code.text) > 30 and code.hint for code in CODES.values())


def test_a_skewed_axis_has_motions_that_are_neither_axial_nor_radial() -> None:
    skewed = Axis("B", True, True, (0.0, -(0.5**0.5), 0.5**0.5))
    assert component_title("EXB", skewed) == "radial motion of B in X"
    assert component_title("EYB", skewed) == "motion of B in Y"


def test_the_axis_says_what_the_letter_does_not() -> None:
    assert component_title("EZB", Axis("B", True, True, (0.0, 0.0, 1.0))) == "axial motion of B in Z"
    assert component_title("EXW", Axis("W", True, True, (0.0, 0.0, 1.0))) == "radial motion of W in X"
