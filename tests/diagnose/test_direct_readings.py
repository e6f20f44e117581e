"""What a laser, a level or displacement probes say by themselves: names no wider than the data, units, signs, drift."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from measure.poses import machine
from ncfix.diagnosis import diagnosis
from ncfix.diagnosis.diagnosis import AMBIGUOUS, FOUND, NOTHING, Diagnosis, diagnose
from ncfix.diagnosis.mistakes.mistake import Mistake
from ncfix.diagnostics import UsageError
from ncfix.machine import Effect, Machine
from ncfix.machine.basis import Polynomial
from ncfix.measure.measurement import Array, Measurement
from ncfix.measure.reader import reads

MILL = machine("three_axis").replace(effects=())
BOW = {False: 8e-3, True: 30e-6}
NOISE = {False: 4e-4, True: 2e-6}
"""mm and rad, by whether it is an angle: what is usual of a machine of half a metre, and of a laser on a shop floor."""
ARCSEC = np.pi / 648000


def laser(
    name: str, course: Callable[[Array], Array] = lambda u: 1 - u**2, unit: float = 1.0, seed: int = 1
) -> Measurement:
    """Five runs both ways of one error motion of X, in a unit of so many mm or rad."""
    random, turns = np.random.default_rng(seed), name[1] in "ABC"
    rows = []
    for run in range(1, 6):
        for way in (1, -1):
            for place in np.linspace(-350, 350, 26)[::way]:
                value = BOW[turns] * course(place / 350) + NOISE[turns] * random.normal()
                rows.append(f"X,{name},{place:g},{value / unit:.9g},{run},{way}\n")
    head = "# ncfix-measurement: 1\n# kind: axis\n# sense: body\naxis,component,position,value,run,direction\n"
    return reads((head + "".join(rows)).encode(), MILL, f"{name}.csv")


def names(found: Diagnosis) -> list[str]:
    return [each.candidate.name for each in found.findings]


@pytest.mark.parametrize("name", ["EXX", "EYX", "EZX", "EAX", "EBX", "ECX"])
def test_a_bow_is_called_by_what_was_read(name: str):
    """A sag shifts across and tilts: it does not act along, and of one of both no data say that the other is there."""
    found = diagnose([laser(name)], MILL)
    assert names(found) == [name]
    assert found.findings[0].aliases in ((), ("bed sag X",))
    assert found.verdict == (FOUND if name in ("EXX", "EAX") else AMBIGUOUS)


@pytest.mark.parametrize(("unit", "said"), [(1.0, False), (25.4, True), (1e3, True)])
def test_repeats_that_agree_better_than_machines_come_back_are_remarked(unit: float, said: bool):
    """0.4 um in mm are 0.016 um in inches; where the file has no curve nothing else tells such a unit."""
    found = diagnose([laser("EXX", unit=unit)], MILL)
    assert ("NCF616" in {message.code for message in found.messages}) is said


def test_two_bows_that_have_nothing_to_do_with_each_other_are_no_sag():
    assert sorted(names(diagnose([laser("EXX"), laser("EYX", seed=2)], MILL))) == ["EXX", "EYX"]


def test_a_shift_with_its_slope_is_a_sag():
    """8 um over 350 mm lean by 46 urad at both ends; X is a table, so it moves against the base axis."""
    slope = BOW[False] / 350 / BOW[True]
    bent = laser("ECX", lambda u: 2 * slope * u, seed=2)
    found = diagnose([laser("EYX"), bent], MILL)
    assert names(found) == ["bed sag X"]


@pytest.mark.parametrize(
    ("name", "unit", "said"), [("EXX", 1e-3, "um"), ("EYX", 1e-3, "um"), ("EBX", 1e-3, "mrad")]
)  # fmt: skip
def test_a_unit_is_named_where_no_machine_errs_so(name: str, unit: float, said: str):
    """Nothing in the machine file is like it: only the sizes tell."""
    found = diagnose([laser(name, unit=unit)], MILL)
    right = diagnose([laser(name)], MILL)
    assert names(found) == ["unit of values", *names(right)]
    assert f"are in {said}, not in" in found.findings[0].candidate.title
    assert f"{unit:g}" in found.findings[0].candidate.remedy


def test_a_unit_of_one_file_beside_another_that_is_right():
    found = diagnose([laser("EXX"), laser("EYX", unit=1e-3, seed=2)], MILL)
    assert "EYX.csv only" in found.findings[0].candidate.title
    assert sorted(names(found)[1:]) == ["EXX", "EYX"]


@pytest.mark.parametrize("unit", [1e-6, ARCSEC])
def test_units_that_both_make_sense_are_asked_about(unit: float):
    with pytest.raises(UsageError) as refused:
        diagnose([laser("EBX", unit=unit)], MILL)
    assert refused.value.code == "NCF654"
    assert all(each in refused.value.messages[0].hint for each in ("urad", "seconds of arc"))


def test_a_sign_that_may_be_the_readings_changes_no_machine_file():
    bowed = Effect("EXX", (0.0, BOW[False]), Polynomial(degree=(1, 2)), scale=350.0)
    against = replace(bowed, coefficients=(0.0, -BOW[False]))
    wrong = diagnose([laser("EXX", lambda u: u**2)], MILL.replace(effects=(against,)))
    assert {*names(wrong)[:1], *wrong.findings[0].aliases} >= {"wrong sign", "sign of values"}
    assert wrong.machine is None
    assert "a table goes against its numbers" in wrong.findings[0].candidate.remedy


def probes(course: Callable[[Array], Array], columns: str = "time_s") -> Measurement:
    """Four hours of displacement probes at one pose, a row a minute; `course` of time in seconds (n,) to (n, 3) mm."""
    time = np.arange(0, 4 * 3600, 60.0)
    values = course(time) + 4e-4 * np.random.default_rng(5).normal(size=(len(time), 3))
    head = f"# ncfix-measurement: 1\n# kind: tcp\nX,Y,Z,{columns},tool_length,dx,dy,dz\n"
    rows = (f"200,0,100,{t:g},150,{x:.6f},{y:.6f},{z:.6f}\n" for t, (x, y, z) in zip(time, values, strict=True))
    return reads((head + "".join(rows)).encode(), MILL, "drift.csv")


def nothing(time: Array) -> Array:
    return np.zeros((len(time), 3))


def growth(time: Array) -> Array:
    return np.outer(1 - np.exp(-time / 2600), [0.004, 0.0, 0.035])


def test_a_pose_over_hours_is_a_test_of_drift():
    found = diagnose([probes(growth)], MILL)
    first = found.findings[0]
    assert {first.candidate.name, *first.aliases} == {"spindle growth", "drift Z"}
    assert "drift X" in names(found)
    assert found.floor.source == "neighbours"


def test_a_pose_over_hours_at_which_nothing_drifts():
    assert diagnose([probes(nothing)], MILL).verdict == NOTHING


def test_one_pose_without_time_or_warmth_is_refused():
    known: Machine = MILL
    data = probes(growth)
    bare = replace(data, columns={name: values for name, values in data.columns.items() if name != "time_s"})
    with pytest.raises(UsageError) as refused:
        diagnose([bare], known)
    assert refused.value.code == "NCF651"


def test_a_refusal_stands_where_a_suspected_mistake_explains_little(monkeypatch: pytest.MonkeyPatch) -> None:
    """Values in their unit that contradict each other, and a mistake once undone that leaves as much."""
    wrong = Mistake("sign of values", "", "", MILL, ())
    far = SimpleNamespace(gap=SimpleNamespace(given=50.0, floor=1.0), findings=())
    answers: Iterator[object] = iter((far, UsageError.of("NCF656", "the files contradict each other")))

    def explained(*_: object) -> object:
        answer = next(answers)
        if isinstance(answer, UsageError):
            raise answer
        return answer

    for name, given in (("find", wrong), ("in_usual_unit", None)):
        monkeypatch.setattr(diagnosis, name, lambda *_, given=given: given)
    for name in ("before", "bounded", "sensible"):
        monkeypatch.setattr(diagnosis.checks, name, lambda given, *_: given)
    monkeypatch.setattr(diagnosis, "_explained", explained)
    with pytest.raises(UsageError, match="NCF656"):
        diagnose([], MILL)
