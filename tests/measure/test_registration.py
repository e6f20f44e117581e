"""A tracker may stand anywhere, any way round; targets may sit anywhere on the table or the head."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from measure.poses import TARGETS, machine, plan
from ncfix.machine import Effect, loads, se3
from ncfix.measure.calibrate import calibrate
from ncfix.measure.instruments import Faults, observe, simulate
from ncfix.measure.reader import reads

PLACES = np.array([[0.0, 0.0, 0.0], [180.0, 30.0, -60.0], [-90.0, 165.0, 30.0]])


def seen_from(turn: np.ndarray, shift: np.ndarray, side: str, name: str, targets: tuple[tuple[str, str], ...] = ()):
    """What a perfect machine shows an instrument that stands like this, with targets at PLACES, and the machine."""
    clean = machine(name).replace(effects=())
    aim = replace(plan(clean, "tool" if side == "tool" else "table", 90), headers=(("carried_by", side), *targets))
    rows = simulate(aim, clean, Faults(setup=0.0), seed=1)
    sights = observe(aim, clean).sights
    stands = np.broadcast_to(turn, (len(sights.poses), 3, 3))
    read = np.einsum("nij,nj->ni", stands, sights.base(PLACES)) + shift
    return replace(rows, columns={**rows.columns, **{axis: read[:, k] for k, axis in enumerate("xyz")}}), clean


@pytest.mark.parametrize("name", ["wCBXFZYSt", "wCAYFXZSt", "dmu50"])
@pytest.mark.parametrize("side", ["tool", "workpiece"])
def test_no_stand_of_a_tracker_is_missed(name, side):
    random = np.random.default_rng(7)
    for _ in range(3):
        turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
        turn = turn * np.linalg.det(turn)
        data, clean = seen_from(turn, random.uniform(-3000, 3000, 3), side, name)
        seen = observe(data, clean)
        left = seen.values - seen.predict(clean, seen.unknowns.start)
        assert np.abs(left).max() < 1e-6  # mm; the readings are exact, positions of some metres have 13 digits


def test_what_the_readings_leave_open_stays_where_the_header_says():
    """A tool branch of linear axes shows no place of a target, only how targets lie to each other."""
    turn = se3.rotation(np.array([0.3, -2.0, 1.1]))
    targets = tuple(("target", f"{k + 1} " + " ".join(map(str, place))) for k, place in enumerate(PLACES))
    data, clean = seen_from(turn, np.array([800.0, -900.0, 300.0]), "tool", "wCBXFZYSt", targets)
    seen = observe(data, clean)
    assert np.abs(seen.places - PLACES).max() < 1e-6
    assert np.abs(seen.instrument_from_base[0, :3, :3] - turn).max() < 1e-9


def test_one_target_that_the_header_has_places_the_others():
    """It stays where the header has it, and is not averaged with targets of which nobody said where they are."""
    turn = se3.rotation(np.array([0.3, -2.0, 1.1]))
    targets = (("target", "2 " + " ".join(map(str, PLACES[1]))),)
    data, clean = seen_from(turn, np.array([800.0, -900.0, 300.0]), "tool", "wCBXFZYSt", targets)
    assert np.abs(observe(data, clean).places - PLACES).max() < 0.1  # mm; what is known gives way by 1e-4 of the rest


@pytest.mark.parametrize(("targets", "said"), [((), True), (TARGETS, False)])
def test_targets_whose_levers_are_not_known_are_remarked_on(targets, said):
    """Angles of a slide cannot be told from its displacements unless it is known where on it the targets are."""
    truth = machine("three_axis")
    aim = replace(plan(truth, "tool", 90), headers=(("carried_by", "tool"), *targets, ("noise_um", "1")))
    found = calibrate([simulate(aim, truth, Faults(noise_um=1.0), seed=3)], truth, "E?Z")
    assert ("NCF643" in {message.code for message in found.remarks}) is said


def test_targets_are_not_remarked_on_where_no_angle_acts_on_them():
    """One target shows neither place nor turn of the instrument; without angles nothing depends on its place."""
    clean = machine("three_axis").replace(effects=())
    aim = plan(clean, "tool", 30)
    labels = {**aim.labels, "target": ("1",) * len(aim)}
    aim = replace(aim, headers=(("carried_by", "tool"), ("noise_um", "1")), labels=labels)
    found = calibrate([simulate(aim, clean, Faults(noise_um=1.0), seed=3)], clean, "EZZ")
    assert "NCF643" not in {message.code for message in found.remarks}


ARM = """
topology = "w F A B C D E G t"
[axis.A]
type = "rotary"
direction = [0, 0, 1]
range = [-160, 160]
[axis.B]
type = "rotary"
direction = [0, 1, 0]
point = [80, 0, 350]
range = [-100, 100]
[axis.C]
type = "rotary"
direction = [0, 1, 0]
point = [80, 0, 700]
range = [-100, 70]
[axis.D]
type = "rotary"
direction = [1, 0, 0]
point = [80, 0, 780]
range = [-180, 180]
[axis.E]
type = "rotary"
direction = [0, 1, 0]
point = [460, 0, 780]
range = [-115, 115]
[axis.G]
type = "rotary"
direction = [1, 0, 0]
point = [460, 0, 780]
range = [-180, 180]
[tool]
direction = [1, 0, 0]
point = [660, 1, 780.5]
"""


@pytest.mark.parametrize("noise", ["", "# noise_um: 200\n"])
def test_an_arm_whose_target_is_nearly_on_its_last_axis_is_calibrated(noise):
    """An offset of that axis and its tilt are seen apart by a millimetre's lever only, and would come out as metres."""
    arm = loads(ARM)
    random = np.random.default_rng(3)
    low, high = (np.rad2deg([axis.range[k] for axis in arm.axes]) * 0.6 for k in (0, 1))
    rows = (",".join(f"{each:.4f}" for each in pose) for pose in random.uniform(low, high, (40, 6)))
    head = f"# ncfix-measurement: 1\n# kind: points\n# carried_by: tool\n{noise}A,B,C,D,E,G,target\n"
    poses = reads("".join([head, *(f"{row},P\n" for row in rows)]).encode(), arm, plan=True)
    sizes = {"EX0B": 1.5, "EZ0C": -1.2, "EB0D": 4e-3, "EX0E": 0.8, "EA0B": -1e-3, "EB0E": 2e-3}
    real = arm.replace(effects=tuple(Effect(name, (size,)) for name, size in sizes.items()))
    found = calibrate([simulate(poses, real, Faults(noise_um=200.0), seed=2)], arm)
    assert found.before_um > 3 * found.after_um
    assert found.after_um == pytest.approx(200.0, rel=0.25)  # 120 values, 25 unknowns: 10 % by chance, 11 % by the fit
    assert np.nanmax(np.abs(found.estimate.coefficients)) < 20.0  # mm; all are known to a few
