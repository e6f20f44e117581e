"""Planned poses tell more than random ones, and go where the machine can go."""

from __future__ import annotations

import re

import numpy as np
import pytest

from measure.poses import machine
from ncfix.diagnostics import UsageError
from ncfix.machine import Machine
from ncfix.measure.candidates import Room, candidates
from ncfix.measure.estimate import Problem
from ncfix.measure.least_squares import solve
from ncfix.measure.measurement import Measurement
from ncfix.measure.plan import appended, plan, skeleton
from ncfix.measure.selection import select

LOCATIONS = "EC0Y,EA0Z,EB0Z,EXX,EYY,EZZ,EYX,EZX,EXY,EZY,EXZ,EYZ"
ROOM = Room(tool_lengths=(100.0, 200.0))


def worst(known: Machine, poses: Measurement, places: Measurement, effects: str) -> float:
    """The largest standard deviation of the predicted tip error, per um of noise; inf if anything is not determined."""
    selection = select(known, effects)
    problem = Problem.of([poses.with_header("noise_um", "1")], known, selection)
    nuisance = problem.nuisance(problem.start) / problem.sigma[:, None]
    found = solve(problem.design / problem.sigma[:, None], nuisance, np.zeros(len(problem.values)))
    tip = known.design(places.positions(known), places.state(known), selection.estimated)[:, :3]
    if len(found.kept) < len(selection.labels):
        return np.inf
    return float(np.sqrt(np.einsum("nik,kl,nil->ni", tip, found.covariance, tip).max())) * 1e3


def _random(known: Machine, count: int, seed: int) -> Measurement:
    """Poses drawn evenly over the travels."""
    random = np.random.default_rng(seed)
    columns = {axis.name: random.uniform(*ROOM.of(axis), count) for axis in known.axes}
    columns["tool_length"] = random.choice(ROOM.tool_lengths, count)
    return Measurement("tcp", (), columns, {"set": ("1",) * count})


def test_poses_are_within_the_ranges_that_were_given():
    known = machine("wCBXFZYSt")
    room = Room({"B": (-30.0, 30.0)}, (100.0,))
    found = plan(known, "tcp", 20, room, "EX0B,EC0Y").plan
    assert np.abs(found.columns["B"]).max() <= 30
    for axis in known.axes:
        low, high = (limit / axis.unit for limit in axis.range)
        assert (found.columns[axis.name] >= low).all()
        assert (found.columns[axis.name] <= high).all()


def test_probing_reaches_its_balls():
    known = machine("wCAYFXZSt")
    found = plan(known, "probe", 20, Room(), "EB0A,EC0A,EA0C,EB0C").plan
    q = found.positions(known)
    for axis, column in zip("XYZ", ("mx", "my", "mz"), strict=True):
        q[:, known.axis_names.index(axis)] = found.columns[column]
    tips = known.tip(q, found.column("tool_length"))
    for ball in set(found.labels["ball"]):
        mine = tips[np.array(found.labels["ball"]) == ball]
        assert np.ptp(mine, axis=0).max() < 3e-3  # positions are rounded to 1 um in each of three axes


def test_a_second_tool_separates_straightness_from_tilt():
    known = machine("three_axis").replace(effects=())
    with pytest.raises(UsageError) as caught:
        plan(known, "tcp", 20, Room(tool_lengths=(100.0,)), "EXZ,EBZ", ["EXZ", "EBZ"])
    assert caught.value.code == "NCF636"
    found = plan(known, "tcp", 20, ROOM, "EXZ,EBZ", ["EXZ", "EBZ"])
    assert set(found.plan.columns["tool_length"]) == {100.0, 200.0}


def test_new_poses_complete_what_was_measured():
    known = machine("three_axis").replace(effects=())
    flat = _random(known, 30, 1)
    flat = flat.with_columns({"Z": np.zeros(30)})
    places = candidates(known, "tcp", 200, ROOM, seed=77)
    more = plan(known, "tcp", 10, ROOM, LOCATIONS, existing=flat).plan
    assert np.isinf(worst(known, flat, places, LOCATIONS))
    assert np.isfinite(worst(known, appended(flat, more), places, LOCATIONS))


def test_poses_keep_the_tip_within_reach():
    known = machine("wCBXFZYSt")
    room = Room(tool_lengths=(100.0,), reach={"x": (-100.0, 100.0), "z": (50.0, 200.0)})
    found = plan(known, "tcp", 20, room, "EX0B,EC0Y").plan
    tip = known.tip(found.positions(known), found.column("tool_length"))
    assert np.abs(tip[:, 0]).max() <= 100
    assert tip[:, 2].min() >= 50
    assert tip[:, 2].max() <= 200
    with pytest.raises(UsageError, match="have their tip within 5000 < x < 6000"):
        plan(known, "tcp", 20, Room(reach={"x": (5000.0, 6000.0)}), "EX0B")


def test_no_two_poses_repeat_a_step():
    """An error of the screw's pitch or of any other period cannot hide between them (Soons, section 2.3)."""
    known = machine("three_axis").replace(effects=())
    found = plan(known, "tcp", 30, ROOM, "EXX,EYY,EZZ").plan
    for axis in "XYZ":
        places = np.sort(found.columns[axis])
        wave = np.exp(2j * np.pi * places[:, None] / np.array([5.0, 10.0, 20.0]))
        assert np.abs(wave.mean(axis=0)).max() < 0.6, axis  # on a common grid it is 1, at random about 0.16
        assert len(np.unique(places)) > 24


def test_two_effects_of_one_component_are_told_apart_by_their_names():
    known = machine("three_axis").replace(effects=())
    found = plan(known, "tcp", 20, ROOM, "EXX,backlash-X,screw-X", ["backlash-X", "screw-X"])
    sides = found.plan.columns["dir_X"]
    assert abs(sides.sum()) <= 4
    with pytest.raises(UsageError, match="wind-up-X is not among the effects"):
        plan(known, "tcp", 20, ROOM, "EXX", ["wind-up-X"])


def test_what_cannot_be_planned_is_refused_in_words():
    known = machine("three_axis").replace(effects=())
    with pytest.raises(UsageError, match="EZS follows temp_spindle with a time constant"):
        plan(known, "tcp", 20, ROOM, "spindle-growth-late")
    with pytest.raises(UsageError, match="the effects depend on load_kg, whose values") as caught:
        plan(known, "tcp", 20, ROOM, "load-X")
    assert "--input load_kg=LOW,HIGH" in str(caught.value.messages[0].hint)
    with pytest.raises(UsageError, match="no plans of kind 'points'"):
        plan(known, "points", 20, ROOM, "EXX")


def test_inputs_that_can_be_set_are_planned():
    known = machine("three_axis").replace(effects=())
    room = Room(tool_lengths=(100.0, 200.0), inputs={"load_kg": (0.0, 300.0)})
    found = plan(known, "tcp", 30, room, "EXX,load-X")
    load = found.plan.columns["load_kg"]
    assert load.min() < 30
    assert load.max() > 270
    with pytest.raises(UsageError, match="has no column load_kg"):
        plan(known, "tcp", 30, room, "EXX,load-X", existing=_random(known, 30, 1))


def test_a_plan_says_what_it_leaves_nearly_open():
    many = plan(machine("three_axis"), "length", 40)
    assert many.worst_um > 100
    assert {"EZZ u^2", "EXZ u^2"} <= set(many.open) <= set(many.seen)
    few = plan(machine("three_axis"), "length", 40, effects="EC0Y,EA0Z,EB0Z,EXX,EYY")
    assert few.worst_um < 10
    assert few.open == ()


def test_a_plan_can_be_too_large():
    with pytest.raises(UsageError) as caught:
        plan(machine("three_axis"), "tcp", 0)
    assert caught.value.code == "NCF636"


def test_the_skeleton_comes_from_the_planned_side():
    known = machine("three_axis")
    columns = {"X": np.array([10.0]), "dir_X": np.array([1.0]), "tool_length": np.array([100.0])}
    text = skeleton(Measurement("tcp", (), columns), known)
    assert "G53 G0 X8 Y0 Z0" in text
    assert "G53 G0 X10 Y0 Z0" in text


@pytest.mark.parametrize(("name", "kind"), [("wCBXFZYSt", "tcp"), ("wCAYFXZSt", "probe")])
def test_the_skeleton_stays_within_the_travels(name, kind):
    """Also where an axis goes back before it comes from the wanted side."""
    known = machine(name)
    text = skeleton(candidates(known, kind, 400, ROOM, seed=3), known)
    for axis in known.axes:
        if np.isfinite(axis.range).all():
            words = np.array(
                [float(value) for value in re.findall(rf"^G53 .*\b{axis.name}(-?[\d.]+)", text, re.MULTILINE)]
            )
            low, high = (limit / axis.unit for limit in axis.range)
            assert len(words) > 300
            assert words.min() >= low - 1e-9
            assert words.max() <= high + 1e-9


def test_few_poses_are_planned_too():
    """Two poses leave much open; what is worked out of them must not break down over it."""
    found = plan(machine("three_axis"), "tcp", 2, Room(inputs={"load_kg": (0.0, 50.0)}), "load-X")
    assert len(found.plan) == 2


def test_a_kind_that_sees_nothing_is_refused():
    with pytest.raises(UsageError, match="no pose of this kind distinguishes any"):
        plan(machine("three_axis"), "probe", 5, effects="EXX")


@pytest.mark.parametrize("name", ["wCBXFZYSt", "wCAYFXZSt", "dmu50"])
@pytest.mark.parametrize("reach", [{}, {"z": (-50.0, 250.0)}])
def test_an_r_test_has_one_ball_a_set(name: str, reach: dict[str, tuple[float, float]]) -> None:
    """The rotary axes turn, the linear ones follow, and the tip stays where the ball of the set is."""
    known = machine(name)
    room = Room(tool_lengths=(100.0, 160.0), reach=reach)
    found = plan(known, "tcp", 24, room, "EX0C,EY0C,EA0C,EB0C").plan
    assert len(found) == 24
    tips = known.tip(found.positions(known), found.column("tool_length"))
    sets = np.array(found.labels["set"])
    assert 1 < len(set(sets)) <= 4
    for each in set(sets):
        assert np.ptp(tips[sets == each], axis=0).max() < 3e-3  # positions are rounded to 1 um in each of three axes
    for axis in known.axes:
        low, high = (limit / axis.unit for limit in axis.range)
        assert (found.columns[axis.name] >= low).all()
        assert (found.columns[axis.name] <= high).all()
    for side, (low, high) in reach.items():
        assert (tips[:, "xyz".index(side)] >= low - 3e-3).all()
        assert (tips[:, "xyz".index(side)] <= high + 3e-3).all()
    turned = [axis.name for axis in known.axes if axis.rotary]
    assert all(np.ptp(found.columns[axis]) > 40 for axis in turned)


def test_an_r_test_at_a_ball_that_is_given():
    """Positions of the rotary axes that the travels do not allow are drawn again, not refused."""
    known = machine("wCBXFZYSt")
    room = Room(balls={"here": (150.0, 100.0, 120.0)})
    found = plan(known, "tcp", 300, room, "EX0C,EY0C,EA0C,EB0C").plan
    assert (len(found), set(found.labels["set"])) == (300, {"here"})
    tips = known.tip(found.positions(known), found.column("tool_length"))
    assert np.abs(tips - (150.0, 100.0, 120.0)).max() < 3e-3
    with pytest.raises(UsageError, match="the ball here is outside the --reach of the tip"):
        plan(known, "tcp", 20, Room(balls=room.balls, reach={"x": (-50.0, 50.0)}), "EX0C")
    with pytest.raises(UsageError, match="no ball can be reached"):
        plan(known, "tcp", 20, Room(balls={"far": (9000.0, 0.0, 0.0)}), "EX0C")
