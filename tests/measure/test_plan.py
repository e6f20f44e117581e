"""Planned poses tell more than random ones, and go where the machine can go."""

from __future__ import annotations

import numpy as np
import pytest

from measure.poses import machine
from ncfix.diagnostics import UsageError
from ncfix.machine import Machine
from ncfix.measure.calibrate import Problem
from ncfix.measure.candidates import Room, candidates
from ncfix.measure.measurement import Measurement
from ncfix.measure.plan import joined, plan
from ncfix.measure.program import skeleton
from ncfix.measure.selection import select
from ncfix.measure.solve import solve

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


def test_forty_planned_poses_beat_forty_random_ones():
    """Worst prediction variance at least 3 times lower, median over 20 random draws."""
    known = machine("three_axis").replace(effects=())
    places = candidates(known, "tcp", 300, ROOM, seed=77)
    found = plan(known, "tcp", 40, ROOM, LOCATIONS)
    assert len(found.plan) == 40
    chosen = worst(known, found.plan, places, LOCATIONS)
    draws = [worst(known, _random(known, 40, seed), places, LOCATIONS) for seed in range(20)]
    ratio = (np.median(draws) / chosen) ** 2
    assert ratio > 3, ratio


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
    assert np.isfinite(worst(known, joined(flat, more), places, LOCATIONS))


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
