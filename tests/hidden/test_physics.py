"""The catalogue of effects: names, shapes that no library holds, sizes, signs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from hidden import curves, workshop
from hidden.chain import Machine
from hidden.climate import BODIES, draw_climate, lagged
from hidden.designs import FREE, lay_out
from hidden.physics import catalogue, foreign, location
from hidden.situation import Situation
from hidden.visibility import first_order, sensitivities

TOPOLOGIES = workshop.TOPOLOGIES
GRID = np.linspace(-1, 1, 300)


def situation(topology: str, seed: int = 3) -> Situation:
    rng = np.random.default_rng(seed)
    machine = workshop.draw_machine(rng, topology)
    return lay_out(rng, machine, topology, draw_climate(rng), machine.lengths, FREE)


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_at_least_fifty_names_each_once(topology: str) -> None:
    machine = workshop.draw_machine(np.random.default_rng(1), topology)
    names = [entry.name for entry in catalogue(machine)]
    assert len(names) >= 50
    assert max(Counter(names).values()) == 1
    assert not set(names) & {entry.name for entry in foreign(machine)}


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_every_effect_moves_the_tip_and_two_draws_differ(topology: str) -> None:
    s = situation(topology)
    seen = sensitivities(s)
    rng = np.random.default_rng(7)
    for entry in (*catalogue(s.machine), *foreign(s.machine)):
        first, second = (first_order(seen, entry.draw(rng)(s)) for _ in range(2))
        assert np.all(np.isfinite(first)), entry.name
        likeness = abs(np.sum(first * second)) / np.linalg.norm(first) / np.linalg.norm(second)
        assert np.linalg.norm(first) > 0, entry.name
        assert likeness < 1 - 1e-9, entry.name


def share_left(values: np.ndarray, columns: np.ndarray) -> float:
    rest = values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]
    return float(np.linalg.norm(rest) / np.linalg.norm(values))


def test_smooth_curves_are_no_cubics() -> None:
    rng = np.random.default_rng(0)
    left = [share_left(curves.smooth(rng)(GRID), np.vander(GRID, 4)) for _ in range(200)]
    assert np.median(left) > 0.15  # of the curve's rms: more than a cubic leaves out of a measured straightness
    assert np.min(left) > 1e-3


@pytest.mark.parametrize("family", [curves.wavy, curves.bowed, curves.jointed, curves.hilly, curves.walked])
def test_every_family_of_shapes_is_unlike_a_cubic(family: Callable[[np.random.Generator], curves.Curve]) -> None:
    rng = np.random.default_rng(1)
    left = [share_left(curves.straightened(family(rng))(GRID), np.vander(GRID, 4)) for _ in range(60)]
    assert np.median(left) > 0.05
    assert all(np.isfinite(left))


def test_curves_of_an_angle_are_not_two_harmonics() -> None:
    rng = np.random.default_rng(0)
    angle = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    columns = np.stack([f(k * angle) for k in (0, 1, 2) for f in (np.cos, np.sin)], axis=1)
    assert np.min([share_left(curves.turning(rng, 1)(angle), columns) for _ in range(100)]) > 5e-3


def test_error_motions_have_no_mean_no_slope_and_size_one() -> None:
    rng = np.random.default_rng(2)
    for curve in (curves.smooth(rng), curves.bump(rng), curves.smooth(rng)):
        values = curve(np.linspace(-1, 1, 401))
        assert np.polyfit(np.linspace(-1, 1, 401), values, 1) == pytest.approx([0, 0], abs=1e-12)
        assert np.sqrt(np.mean(values**2)) == pytest.approx(1, abs=1e-12)


def test_play_follows_the_direction_and_the_place() -> None:
    size = curves.play(np.random.default_rng(3))
    ahead, back, still = (size(GRID, np.full_like(GRID, d)) for d in (1.0, -1.0, 0.0))
    assert np.all(ahead > back)
    assert np.ptp(ahead - back) > 0.05
    assert not still.any()


def test_pitch_is_a_little_off_the_stated_one() -> None:
    wave = curves.pitch_wave(np.random.default_rng(1), 10.0)
    far = np.array([0.0, 1000.0])
    assert wave(far)[0] != pytest.approx(wave(far)[1], abs=1e-3)


def test_sensors_are_late_and_bodies_later() -> None:
    climate = draw_climate(np.random.default_rng(4))
    time = np.linspace(0, 6 * 3600, 500)
    for body in BODIES:
        rise = climate.body(body, time)
        shown = climate.sensor(body, time) - climate.level
        assert 0.75 < np.corrcoef(rise, shown)[0, 1] < 1.0
        assert rise[0] == 0
    step = np.r_[np.zeros(5), np.ones(200)]
    assert lagged(step, 600.0, 20.0)[5 + 30 - 1] == pytest.approx(1 - np.exp(-1), abs=1e-9)


@pytest.mark.parametrize(
    ("topology", "name"), [("wCBXFZYSt", "EA0C"), ("wXFYZCBSt", "EX0B"), ("wXFYZSt", "EC0Y"), ("wCAYFXZSt", "EY0A")]
)
def test_location_as_an_effect_is_the_location_of_the_chain(topology: str, name: str) -> None:
    s = situation(topology)
    size = 1e-6
    twists = size * location.entry(s.machine, name).draw(np.random.default_rng(0))(s)
    errors = s.machine.no_errors(len(s))
    errors.located[s.machine.axes.index(name[3]), "XYZABC".index(name[1])] = size
    exact = s.machine.tips(s.q, s.length, errors)[0]
    # second order of 1e-6 with levers of 1000 mm
    assert np.max(np.abs(s.machine.tips(s.q, s.length, s.machine.no_errors(len(s)).plus(twists))[0] - exact)) < 1e-8


def own(machine: Machine, name: str) -> object:
    return next(e for e in catalogue(machine) if e.name == name)


def test_ten_micrometres_of_exx_show_as_ten_with_the_sign_of_the_side() -> None:
    for topology, sign in (("wCAYFXZSt", 1), ("wXFYZSt", -1)):
        s = situation(topology)
        turn = (
            s.machine.nominal(s.q, s.length)[1]
            if topology == "wCAYFXZSt"
            else np.broadcast_to(np.eye(3), (len(s), 3, 3))
        )
        field = own(s.machine, "EXX").draw(np.random.default_rng(1))(s)  # type: ignore[attr-defined]
        size = field[:, s.machine.frames.index("X"), 0]
        shown = first_order(sensitivities(s), 0.010 * field)
        assert np.einsum("ni,ni->n", turn[:, :, 0], shown) == pytest.approx(sign * 0.010 * size, abs=1e-12)


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_a_sagging_slide_stays_tangent_to_its_way(topology: str) -> None:
    """Turned as its way is: by the way's direction x the slope of the deflection, whichever way the axis counts."""
    s = situation(topology)
    entry = next(e for e in catalogue(s.machine) if e.kind == "bed sag")
    joint = s.machine.joint(entry.axis)
    _, order = np.unique(s.column(entry.axis), return_index=True)
    twists = entry.draw(np.random.default_rng(2))(s)[order, s.machine.frames.index(entry.axis)]
    down = np.asarray(s.machine.gravity)
    slope = np.gradient(twists[:, :3] @ down, s.column(entry.axis)[order])
    turned = twists[:, 3:] @ np.cross(joint.direction, down)
    assert np.corrcoef(slope, turned)[0, 1] > 0.9


def test_growth_pushes_the_tip_along_the_tool() -> None:
    s = situation("wXFYZCBSt")
    grown = np.zeros((len(s), len(s.machine.frames), 6))
    grown[:, s.machine.frames.index("S"), 2] = -0.010  # the spindle's nose moves down, towards the tip
    along = s.machine.nominal(s.q, s.length)[1][:, :, 2]
    assert np.einsum("ni,ni->n", along, first_order(sensitivities(s), grown)) == pytest.approx(-0.010, abs=1e-12)


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_what_is_warm_is_longer(topology: str) -> None:
    """The spindle pushes the tip away from itself; a longer scale carries its slide further, the way it goes."""
    s = situation(topology)
    warm = np.linspace(-1.0, 1.0, len(s.climate.grid))
    s = replace(s, climate=replace(s.climate, bodies=dict.fromkeys(BODIES, warm)))
    hot = s.time > np.quantile(s.time, 0.8)
    away = -np.asarray(s.machine.tool_direction)
    grown = own(s.machine, "spindle growth").draw(np.random.default_rng(1))(s)[:, s.machine.frames.index("S"), :3]  # type: ignore[attr-defined]
    assert np.mean((grown @ away)[hot]) > np.mean((grown @ away)[~hot])
    for joint in s.machine.joints:
        if not joint.rotary:
            twists = own(s.machine, f"thermal scale {joint.name}").draw(np.random.default_rng(1))(s)  # type: ignore[attr-defined]
            gone = twists[:, s.machine.frames.index(joint.name), :3] @ np.asarray(joint.direction)
            slope = np.polyfit(s.column(joint.name)[hot], gone[hot], 1)[0]
            assert slope > np.polyfit(s.column(joint.name)[~hot], gone[~hot], 1)[0]


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_most_drives_lag_behind_when_they_reverse(topology: str) -> None:
    s = situation(topology)
    for joint in s.machine.joints:
        entry = own(s.machine, f"backlash {joint.name}")
        late = 0
        for seed in range(40):
            twists = entry.draw(np.random.default_rng(seed))(s)[:, s.machine.frames.index(joint.name)]  # type: ignore[attr-defined]
            along = twists[:, 3:] if joint.rotary else twists[:, :3]
            gone = along @ np.asarray(joint.triad) @ np.asarray(joint.direction)
            late += float(np.mean(gone * s.moving(joint.name))) < 0
        assert 20 <= late < 40


def test_a_carried_centre_drifts_across_both_axes() -> None:
    """Along the carrier's own line it would be a drift of the frame, which turns with nothing."""
    for topology in TOPOLOGIES[:3]:
        s = situation(topology)
        entry = next(e for e in catalogue(s.machine) if e.kind == "rotary centre drift")
        shift = entry.draw(np.random.default_rng(0))(s)[:, s.machine.frames.index(entry.axis), :3]
        for joint in s.machine.joints:
            if joint.rotary:
                triad = np.asarray(s.machine.joint(entry.axis).triad)
                assert np.max(np.abs(shift @ triad @ np.asarray(joint.direction))) < 1e-12


def test_a_trunnion_twists_by_how_far_out_the_tip_is_along_it() -> None:
    """Two poses that differ by the table's turn and the linear axes alone have the same lever where X is the same."""
    s = situation("wCAYFXZSt")
    q = np.repeat(s.q[:1], 3, axis=0)
    q[1, s.machine.axes.index("C")] += 1.0
    q[2, s.machine.axes.index("X")] += 100.0
    three = replace(s.rows(np.zeros(3, dtype=int)), q=q)
    entry = own(s.machine, "trunnion twist A")
    turn = entry.draw(np.random.default_rng(3))(three)[:, s.machine.frames.index("A"), 3]  # type: ignore[attr-defined]
    assert turn[0] == pytest.approx(turn[1], rel=1e-12)
    assert abs(turn[2] - turn[0]) > 1e-3 * abs(turn[0])


def test_a_head_does_not_carry_the_workpiece() -> None:
    s = situation("wXFYZCBSt")
    entry = own(s.machine, "gravity sag B")
    light, heavy = (replace(s, load=np.full(len(s), load)) for load in (10.0, 300.0))
    draws = [entry.draw(np.random.default_rng(2))(x) for x in (light, heavy)]  # type: ignore[attr-defined]
    assert np.array_equal(*draws)
