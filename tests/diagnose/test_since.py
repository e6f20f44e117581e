"""Two dates: what changed is found, what was there before is left alone."""

from __future__ import annotations

from dataclasses import replace

import pytest

from measure.poses import machine, plan
from ncfix.diagnosis.diagnosis import FOUND, NOTHING, Diagnosis, diagnose
from ncfix.diagnostics import UsageError
from ncfix.machine import Effect, Machine
from ncfix.machine.basis import Backlash, Polynomial
from ncfix.measure.instruments import Faults, simulate
from ncfix.measure.measurement import Measurement

BOW = Effect("EYX", (0.015,), Polynomial(degree=(2,)), scale=300.0)
WORN = Effect("EXX", (0.012,), Backlash())


@pytest.fixture(scope="module")
def known() -> Machine:
    lines = machine("wCBXFZYSt")
    return lines.replace(effects=tuple(effect for effect in lines.effects if effect.location))


def measured(known: Machine, seed: int, *effects: Effect) -> Measurement:
    true = known.replace(effects=(*known.effects, *effects))
    seen = simulate(plan(known, "tcp", 90, seed), true, Faults(1.5), seed)
    return replace(seen, path=f"{seed}.csv").with_header("noise_um", "1.5")


@pytest.fixture(scope="module")
def worn(known: Machine) -> Diagnosis:
    return diagnose([measured(known, 1, BOW), measured(known, 2, BOW, WORN)], known, since=True)


def test_what_came_since_is_named(worn: Diagnosis) -> None:
    assert worn.verdict == FOUND
    assert [each.candidate.name for each in worn.findings] == ["change of backlash X"]
    assert worn.steady == ("EYX",)
    assert worn.machine is not None


def test_what_was_there_before_is_no_change(known: Machine) -> None:
    same = diagnose([measured(known, 1, BOW), measured(known, 2, BOW)], known, since=True)
    assert (same.verdict, same.findings, same.machine) == (NOTHING, (), None)


def test_one_date_is_refused(known: Machine) -> None:
    with pytest.raises(UsageError, match="files of two dates"):
        diagnose([measured(known, 1)], known, since=True)
