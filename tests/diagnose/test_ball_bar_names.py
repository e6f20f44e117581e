"""Circles run at a feed: what the axes did, and the names of what their drives do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.hidden import ballbar

from conftest import FULL
from ncfix.diagnosis.catalogue.dynamic import with_motion
from ncfix.diagnosis.diagnosis import diagnose, weighed
from ncfix.diagnosis.selection import aliases, plainest, with_alternatives
from ncfix.machine import loads
from ncfix.measure.measurement import Measurement
from ncfix.measure.reader import reads

RADIUS, FEED = 150.0, 1800.0  # 30 mm/s


def circle(way: int) -> Measurement:
    angle = way * np.linspace(0, 2 * np.pi, 181)
    rows = [f"{RADIUS * np.cos(a)},{RADIUS * np.sin(a)},0,0,0,0,{RADIUS},{RADIUS},{FEED}" for a in angle]
    text = "# ncfix-measurement: 1\n# kind: length\n# noise_um: 1\nX,Y,Z,cx,cy,cz,radius,length,feed_mm_min\n"
    return reads((text + "\n".join(rows) + "\n").encode(), loads(ballbar.MACHINE))


@pytest.mark.parametrize("way", [1, -1])
def test_speed_acceleration_and_direction_are_those_of_a_circle(way: int) -> None:
    moved = with_motion(circle(way), loads(ballbar.MACHINE)).columns
    angle, inside = way * np.linspace(0, 2 * np.pi, 181), slice(2, -2)
    assert np.allclose(moved["speed_x_y"][inside], -30.0 * way * np.sin(angle)[inside], atol=0.02)
    assert np.allclose(moved["accel_x_y"][inside], -6.0 * np.cos(angle)[inside], atol=0.02)  # (30 mm/s)^2 / 150 mm
    assert (moved["dir_Y"][5:40] == way).all()
    assert (moved["dir_Y"][50:130] == -way).all()
    late_s = np.radians(2) * RADIUS / 30.0  # row 46 is 2 degrees behind 90, where Y turned round
    assert moved["spike_y"][46] * -way == pytest.approx(np.exp(-late_s / 0.1), rel=0.02)
    assert not moved["speed_x_z"].any()


def test_poses_of_a_ball_bar_are_no_circle() -> None:
    file, machine = circle(1), loads(ballbar.MACHINE)
    mixed = file.rows(np.random.default_rng(1).permutation(len(file)))
    assert with_motion(mixed, machine) is mixed


@pytest.mark.parametrize("kind", ["_mismatch", "_lag"])
def test_drives_are_named_and_nothing_is_added(kind: str, tmp_path: Path) -> None:
    rng, mill, machine = np.random.default_rng(4), ballbar.Mill(), loads(ballbar.MACHINE)
    [wanted] = getattr(ballbar, kind)(rng, mill)
    file = reads(ballbar.measured(mill, rng).encode(), machine)
    found = diagnose([file.rows(np.arange(0, len(file), 1 if FULL else 2))], machine)
    assert found.findings[0].candidate.name == wanted.strip("^")
    assert found.findings[0].effects == ()


@pytest.mark.parametrize("hold_s", [0.1, 0.17, 0.3])
def test_spikes_of_eight_micrometres_are_named_however_fast_they_fade(hold_s: float) -> None:
    """Samples are 0.13 or 0.38 s apart: a decay that none of the forms comes near leaves half of a spike."""
    rng, mill, machine = np.random.default_rng(5), ballbar.Mill(), loads(ballbar.MACHINE)
    mill.spike[1], mill.hold_s = 0.0085, hold_s
    found = diagnose([reads(ballbar.measured(mill, rng).encode(), machine)], machine)
    assert found.findings[0].candidate.name == "reversal spikes Y"


@pytest.mark.parametrize(("axis", "name", "play"), [(0, "backlash X", "EBX"), (1, "lateral play EXY", "EBY")])
def test_play_at_one_height_is_first_that_of_a_shift(axis: int, name: str, play: str) -> None:
    """A tilt at reversal, with the shift that it brings where the lever is always the same, is named beside it."""
    random, machine, rows = np.random.default_rng(2), loads(ballbar.MACHINE), []
    for number, way in enumerate([1, -1]):
        angle = way * np.linspace(0, 2 * np.pi, 181)
        came = np.sign(np.round(way * np.stack([-np.sin(angle), np.cos(angle)])[axis], 9))
        length = RADIUS - 3e-3 * came * np.cos(angle) + random.normal(scale=4e-4, size=len(angle))
        rows += [
            f"{number},{RADIUS * np.cos(a):.6f},{RADIUS * np.sin(a):.6f},150,0,0,150,{RADIUS},{own:.6f},{FEED}"
            for a, own in zip(angle, length, strict=True)
        ]
    head = "# ncfix-measurement: 1\n# kind: length\n# noise_um: 0.4\nset,X,Y,Z,cx,cy,cz,radius,length,feed_mm_min\n"
    file = with_motion(reads((head + "\n".join(rows) + "\n").encode(), machine), machine)
    _, scale = weighed([file], machine)
    tilt = f"angular play {play}"
    [member] = scale.candidate_odds({}).likeliest(scale.evidence.forms[tilt])
    found = plainest(scale, with_alternatives(scale, {tilt: member}))
    assert found.named == [name]
    assert tilt in aliases(found, name)
