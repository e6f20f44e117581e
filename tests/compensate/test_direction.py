"""Which way each axis came: along lines, round arcs, with tool-centre-point control, and where it rests."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compensate.machines_at_random import TOPOLOGIES, perfect
from compensate.motions import Arc, motions
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import follow
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.kinematics import carried, matters, signs
from ncfix.control.setup import Setup, Tool
from ncfix.machine import Effect, Machine, State
from ncfix.machine.basis import Backlash
from ncfix.machine.piecewise import PiecewiseConstant
from ncfix.text.reader import read


def with_play(topology: str) -> Machine:
    return perfect(topology).replace(effects=(Effect("EXX", (0.01,), Backlash()),))


def test_only_errors_that_depend_on_it_make_it_matter() -> None:
    machine = perfect(TOPOLOGIES["three-axis"])
    assert not matters(machine)
    assert not matters(machine.replace(effects=(Effect("EXX", (0.0,), Backlash()),)))
    assert not matters(machine.replace(effects=(Effect("EXX", (0.0, 0.1), PiecewiseConstant((5.0,))),)))
    assert matters(machine.replace(effects=(Effect("EXX", (0.0, 0.1), PiecewiseConstant((5.0,), "positive")),)))
    assert matters(with_play(TOPOLOGIES["three-axis"]))


def test_the_last_direction_is_kept_at_rest_and_unknown_before_the_first() -> None:
    motion = np.array([[0.0, 1.0], [2.0, 1e-12], [0.0, 0.0], [-0.1, np.nan], [0.0, 3.0]])
    assert carried(signs(motion)).tolist() == [[0, 1], [1, 1], [1, 1], [-1, 1], [-1, 1]]


def test_from_where_nobody_knows_an_axis_comes_from_neither_side() -> None:
    moves = motions(with_play("w F X Y Z t"), (0, 0, 0), [(5, 5, -5), (5, 5, np.nan), (5, 6, 9), (5, 5, 9), (5, 5, 8)])
    arrival = Intent(with_play("w F X Y Z t"), moves, State()).arrival
    assert arrival is not None
    assert arrival[:, 2].tolist() == [-1, 0, 0, 0, -1]


def test_the_way_in_which_axes_end_straight_motions() -> None:
    machine = with_play("w F X Y Z t")
    moves = motions(machine, (0, 0, 0), [(5, 0, 0), (5, 5, 0), (2, 5, 0), (2, 5, -1)])
    arrival = Intent(machine, moves, State()).arrival
    assert arrival is not None
    assert arrival.tolist() == [[1, 0, 0], [1, 1, 0], [-1, 1, 0], [-1, 1, -1]]


def test_round_a_circle_each_axis_turns_at_its_own_place() -> None:
    """Counter-clockwise from the right: X goes down to the left, then up; Y up, down, up."""
    machine = with_play("w F X Y Z t")
    moves = motions(machine, (10, 0, 0), [Arc((0, 0, 0), (0, 0, 1), 2 * np.pi)])
    intent = Intent(machine, moves, State())
    f = np.linspace(0.01, 0.99, 99)
    way = intent.direction(np.zeros(99, dtype=np.intp), f)
    assert (way[:, 0] == np.where(f < 0.5, -1, 1))[np.abs(f - 0.5) > 1e-6].all()
    assert (way[:, 1] == np.where((f < 0.25) | (f > 0.75), 1, -1))[np.abs(f % 0.5 - 0.25) > 1e-6].all()
    assert (way[:, 2] == 0).all()
    arrival = intent.arrival
    assert arrival is not None
    assert arrival[0].tolist() == [1, 1, 0]


def test_at_a_turning_point_it_is_the_direction_before_it() -> None:
    """A quarter circle that ends where X turns: the axis has come to its end from below."""
    machine = with_play("w F X Y Z t")
    moves = motions(machine, (0, -10, 0), [Arc((0, 0, 0), (0, 0, 1), np.pi / 2), (10, 5, 0)])
    arrival = Intent(machine, moves, State()).arrival
    assert arrival is not None
    assert arrival.tolist() == [[1, 1, 0], [1, 1, 0]]


def test_with_tcp_the_axes_count_not_the_words() -> None:
    """Only B is programmed, from -0.5 to 0.5 rad: to keep the tip, the head swings X up, Z up and down again."""
    machine = with_play("w F X Y Z B t")
    moves = motions(machine, (0, 0, 0, -0.5), [(0, 0, 0, 0.5)], tcp=True, tool_length=100.0)
    intent = Intent(machine, moves, State())
    f = np.array([0.1, 0.3, 0.7, 0.9])
    q = intent.joints_at(np.zeros(100, dtype=np.intp), np.linspace(0, 1, 100))
    expected = np.sign(np.diff(q, axis=0))[[10, 30, 70, 90]]
    way = intent.direction(np.zeros(4, dtype=np.intp), f)
    np.testing.assert_array_equal(way, expected)
    assert set(way[:, 2].tolist()) == {-1, 1}, "the case has a reversal inside"


BEGINS = "G21 G90 G94 G54\nG0 X5 Y5\nG0 Z9\n"


@pytest.mark.parametrize(
    ("cuts", "given", "tolerance", "said"),
    [
        ("G1 X9 F99\nX5\n", {}, 1.0, (4, "this cut begins", "10.0")),
        ("G1 Z1 F99\nY9\nX9\nX5\n", {}, 1.0, (4, "this cut and 2 more begin", "10.0")),
        ("G1 Z1 F99\n", {}, 1.0, (4, "this cut begins", "5.0")),
        ("G1 Z1 F99\n", {}, 6.0, None),
        ("G81 Z1 R2 F99\nX9\nY9\n", {}, 1.0, (4, "this cut begins", "5.0")),
        ("G1 Z1 F99\nX9\n", {"X": 0.0}, 1.0, None),
        ("G1 Z1 F99\nX9\n", {"X": 5.0}, 1.0, (4, "this cut and 1 more begin", "10.0")),
        ("G0 X9\nG1 Z1 F99\nX9\n", {}, 1.0, None),
        ("G28 X0\nG0 Y9\nX4\nG1 Z1 F99\n", {"X": 0.0}, 1.0, (7, "this cut begins", "5.0")),
    ],
)
def test_cuts_that_begin_on_a_side_nobody_knows_are_counted(
    cuts: str, given: dict[str, float], tolerance: float, said: tuple[int, str, str] | None
) -> None:
    """The tip is up to the play of 10 um off where X moves, and half of it where it rests in the middle."""
    setup = Setup(work_offsets={"G54": {}}, initial={"Y": 0.0, "Z": 100.0, **given}, tools={0: Tool(50.0)})
    program = read(f"{BEGINS}{cuts}M2\n".encode(), "part.ngc", "linuxcnc")
    report = fix_program(program, with_play("w X Y F Z t"), setup, FixOptions(tolerance_um=tolerance)).report
    found = [(each.place and each.place.line, each.text) for each in report.warnings if each.code == "NCF285"]
    words = "{} while the side of the backlash of X is not known: the tip may be up to {} um off there"
    assert found == ([] if said is None else [(said[0], words.format(*said[1:]))])


def test_a_cut_from_a_side_nobody_knows_may_be_refused_for_another_reason() -> None:
    """Its corrected end is beyond the travel of X: that is the reason, and the side of the play is none."""
    machine = with_play("w X Y F Z t")
    axes = tuple(replace(axis, range=(-9.0, 9.0)) if axis.name == "X" else axis for axis in machine.axes)
    setup = Setup(work_offsets={"G54": {}}, initial={"Y": 0.0, "Z": 100.0}, tools={0: Tool(50.0)})
    program = read(f"{BEGINS}G1 X-9 F99\nX5\nM2\n".encode(), "part.ngc", "linuxcnc")
    report = fix_program(program, machine.replace(axes=axes), setup, FixOptions(allow_refused=True)).report
    assert [(each.line, each.code) for each in report.refused] == [(4, "NCF404")]


@pytest.mark.parametrize(("turned", "aside"), [("", 1), ("G68.2 X0. Y0. Z0. I90. J30. K-90.\nG53.1\n", -1)])
def test_axes_go_out_of_holes_the_way_they_came_in(turned: str, aside: int) -> None:
    """To the second hole X goes on by 17 mm, down the hole, if the head stands askew, back by 11, and up it again."""
    machine = with_play("w F X Y Z C B S t")
    text = (
        f"G21 G90 G94 G17\nG54\nG43 H1\n{turned}G0 X0. Y0. Z50.\nG99 G81 X10. Z-20. R2. F100.\nX20.\nG80\nG1 Y5.\nM30\n"
    )
    setup = Setup(assume_zero=True, tools={1: Tool(80.0)}, initial=dict.fromkeys("XYZCB", 0.0))
    intent = Intent(machine, follow(read(text.encode(), "part", "fanuc"), machine, setup).trace.moves, State())
    assert intent.came is not None
    assert intent.arrival is not None
    assert intent.arrival[-2, [0, 2]].tolist() == [aside, -1]
    assert intent.came[-1, [0, 2]].tolist() == [1, 1]
    assert intent.arrival[-1].tolist() == [1, 1, 1, 0, intent.came[-1, 4]]
