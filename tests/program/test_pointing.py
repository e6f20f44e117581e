"""How two rotary axes point the tool: found from a machine's kinematics, and turned round."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate.following import kinematics_of
from ncfix.control.moves import TcpState
from ncfix.control.pointing import Pointing, nearest, nearest_turn
from ncfix.control.posture import within
from ncfix.machine import Machine, load

MACHINES = ("wCAYFXZSt", "wCBXFZYSt", "dmu50", "angle_head")
LENGTH = 128.0


def pointing_of(machine: Machine) -> tuple[Pointing, list[int]]:
    """How a machine points, from its own kinematics, and the columns of its rotary axes."""
    kinematics, names = kinematics_of(machine), list(machine.axis_names)
    assert kinematics is not None
    columns = np.flatnonzero(machine.rotary).tolist()

    def ask(first: float, second: float) -> np.ndarray:
        command = [0.0] * len(names)
        command[columns[0]], command[columns[1]] = first, second
        tips = [kinematics(command, TcpState(False, long), TcpState(True, long)) for long in (LENGTH, 0.0)]
        return np.array([(tips[1][names.index(c)] - tips[0][names.index(c)]) / LENGTH for c in "XYZ"])

    found = Pointing.of((columns[0], columns[1]), ask)
    assert found is not None
    return found, columns


@pytest.mark.parametrize("name", MACHINES)
def test_it_points_as_the_machine_does(root: Path, name: str) -> None:
    machine = load(str(root / f"examples/machines/{name}.toml"))
    pointing, columns = pointing_of(machine)
    rng = np.random.default_rng(7)
    for angles in rng.uniform(-math.pi, math.pi, (20, 2)):
        q = np.zeros(len(machine.axis_names))
        q[columns] = angles
        direction = machine.nominal(q, 0.0)[:3, :3] @ np.asarray(machine.tool.direction)
        assert pointing.direction(q) == pytest.approx(direction, abs=1e-9)


@pytest.mark.parametrize("name", MACHINES)
def test_angles_are_the_inverse_of_directions(root: Path, name: str) -> None:
    pointing, _ = pointing_of(load(str(root / f"examples/machines/{name}.toml")))
    rng = np.random.default_rng(8)
    for outer, inner in rng.uniform(-1.4, 1.4, (20, 2)):
        ways = pointing.angles(pointing.at(outer, inner), (outer, inner))
        assert ways[0] == pytest.approx((outer, inner), abs=1e-6)
        for way in ways:
            assert pointing.at(*way) == pytest.approx(pointing.at(outer, inner), abs=1e-9)


def test_where_the_machine_cannot_point_there_is_no_way(root: Path) -> None:
    """The B axis of the DMU 50 is tilted by 45 degrees: the tool never points below the table."""
    pointing, _ = pointing_of(load(str(root / "examples/machines/dmu50.toml")))
    assert pointing.angles(np.array([0.0, 0.0, -1.0]), (0.0, 0.0)) == []


def test_along_the_outer_axis_it_stays_where_it_is(root: Path) -> None:
    pointing, _ = pointing_of(load(str(root / "examples/machines/wCAYFXZSt.toml")))
    upright = np.array([0.0, 0.0, 1.0])
    assert pointing.at_pole(upright)
    assert pointing.angles(upright, (0.3, 0.1))[0] == pytest.approx((0.3, 0.0))


@pytest.mark.parametrize(
    ("ways", "travel", "near", "found"),
    [
        ([(10, 20), (190, -20)], [(-360, 360), (0, 90)], (0, 0), [(10, 20)]),
        ([(10, 20), (190, -20)], [(-math.inf, math.inf), (-30, 90)], (170, 0), [(190, -20), (10, 20)]),
        ([(-24, 5)], [(0, 360), (0, 90)], (0, 0), [(336, 5)]),
        ([(350, 5)], [(-180, 180), (0, 90)], (0, 0), [(-10, 5)]),
        ([(0, 95)], [(0, 360), (0, 90)], (0, 0), []),
        ([(-1e-5, 0)], [(0, 300), (0, 90)], (0, 0), [(-1e-5, 0)]),
    ],
)
def test_only_ways_within_the_travels_are_taken(ways: list, travel: list, near: tuple, found: list) -> None:
    turned = within(np.radians(ways).tolist(), np.radians(travel).tolist(), (math.radians(near[0]), 0.0))
    assert [tuple(np.degrees(way)) for way in turned] == [pytest.approx(way) for way in found]


@pytest.mark.parametrize("name", MACHINES)
def test_many_directions_are_solved_to_the_bit_as_one_is(root: Path, name: str) -> None:
    """Among them are both ends of the outer axis's line, where it may stand anywhere."""
    pointing, _ = pointing_of(load(str(root / f"examples/machines/{name}.toml")))
    poles = np.array([pointing.lines[0], [-each for each in pointing.lines[0]]])
    directions = np.vstack([np.random.default_rng(9).normal(size=(200, 3)), poles])
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    x, y, z = directions.T
    reached, both = pointing.ways_of_many((x, y, z))
    for direction, is_reached, ways in zip(directions, reached.tolist(), both, strict=True):
        single = pointing.angles(direction, (0.4, -0.2))
        many = list(dict.fromkeys(nearest(ways, (0.4, -0.2)))) if is_reached else []
        assert many == single


def test_an_angle_is_led_to_the_nearest_turn() -> None:
    turn = 2 * math.pi
    assert nearest_turn(0.25, 7.0) == 0.25 + turn
    assert nearest_turn(0.25, -0.5) == 0.25
    assert nearest_turn(math.pi, 0.0) == -math.pi
    assert nearest_turn(-math.pi, 0.0) == -math.pi
    assert nearest_turn(math.nan, 0.3) == 0.3
