"""Files of several instruments together: none makes small what another sees, and each has its own noise."""

from __future__ import annotations

import numpy as np
import pytest

from measure.poses import machine, plan
from ncfix.diagnosis.checks import MOST_VALUES, bounded
from ncfix.diagnosis.diagnosis import FOUND, NOTHING, UNKNOWN, diagnose
from ncfix.diagnosis.ladder import NOISE, UNEXPLAINED, ladder
from ncfix.diagnosis.presentation import text
from ncfix.machine import Effect, Machine
from ncfix.machine.basis import Fourier, Periodic, Polynomial
from ncfix.measure.instruments import Faults, simulate
from ncfix.measure.measurement import Measurement
from ncfix.measure.reader import reads

FACE_RUN_OUT = Effect("EZC", (0.003, 0.001, 0.0015, 0.0), Fourier(order=(1, 2)))
HEAD = "# ncfix-measurement: 1\n# kind: axis\n"
COLUMNS = "axis,component,position,run,direction,value\n"


@pytest.fixture(scope="module")
def known() -> Machine:
    found = machine("wCBXFZYSt")
    return found.replace(effects=tuple(effect for effect in found.effects if effect.location))


def direct(of: Machine, names: str, noise_um: float, seed: int, places: int = 17, runs: int = 2) -> Measurement:
    """A laser or a level: both ways over half the travel, at places that are no multiples of a pitch."""
    rows = [
        f"{name[2]},{name},{place:.3f},{run},{side},0\n"
        for name in names.split()
        for run in range(1, runs + 1)
        for side in (1, -1)
        for place in 100.0 * np.sin(np.linspace(-1.4, 1.5, places))
    ]
    return simulate(
        reads((HEAD + COLUMNS + "".join(rows)).encode(), of), of, Faults(noise_um, noise_urad=noise_um), seed
    )


def test_an_effect_is_as_large_beside_many_rows_that_cannot_show_it(known: Machine) -> None:
    true = known.replace(effects=(*known.effects, FACE_RUN_OUT))
    rtest = simulate(plan(true, "tcp", 50, 3), true, Faults(0.8), 3)
    alone = diagnose([rtest], known)
    beside = diagnose([rtest, direct(true, "EXX EYY EZZ", 0.5, 4)], known)
    for found in (alone, beside):
        assert found.verdict == FOUND
        assert [each.candidate.name for each in found.findings] == ["axial C"]
    # from the same poses; how much of it the constants take differs with what is taken for a little of everything
    assert beside.findings[0].size_um == pytest.approx(alone.findings[0].size_um, rel=0.1)


@pytest.mark.parametrize(("rows", "again"), [((40, 900), 1), ((900, 700), 3), ((700, 10, 1000), 1)])
def test_of_very_many_rows_some_are_drawn(known: Machine, rows: tuple[int, ...], again: int) -> None:
    """Small files stay whole, repeats together, rows in their order; and it is said of which files."""
    files = [plan(known, "tcp", each // again, k) for k, each in enumerate(rows)]
    files = [each.rows(np.repeat(np.arange(len(each)), again)) for each in files]
    files = [each.with_columns({name: np.arange(len(each)) * 1.0 for name in ("dx", "dy", "dz")}) for each in files]
    drawn = bounded(files)
    assert sum(3 * len(each) for each in drawn) == pytest.approx(MOST_VALUES, abs=3 * again * len(files))
    for given, kept in zip(files, drawn, strict=True):
        numbers = kept.columns["dx"].astype(int)
        assert (np.diff(numbers) > 0).all()
        assert (np.bincount(numbers // again)[numbers // again] == again).all()
        assert [each.code for each in kept.remarks] == ["NCF660"] * (len(kept) < len(given))
        assert len(kept) == len(given) or len(given) >= max(map(len, drawn))
        assert kept.columns["X"] == pytest.approx(given.columns["X"][numbers], abs=0)


def test_angles_count_by_what_they_move_and_are_said_in_their_unit(known: Machine) -> None:
    bowed = Effect("EAY", (20e-6,), Polynomial(degree=(2,)), scale=100.0)
    found = diagnose([direct(known.replace(effects=(bowed,)), "EAY EBX", 2.0, 5)], known.replace(effects=()))
    (first,) = found.findings
    assert "EAY" in (first.candidate.name, *first.aliases)
    assert found.floor.source == "given"
    assert "urad" in found.patterns[0].text
    assert not found.rest.lacking


def test_each_file_is_judged_by_its_own_noise(known: Machine) -> None:
    fine, coarse = (direct(known, "EXX EYY", noise, seed) for noise, seed in ((0.3, 6), (6.0, 7)))
    found = diagnose([fine, coarse], known)
    assert found.verdict == NOTHING
    assert found.p_lack is not None
    assert found.p_lack > 1e-3


def test_what_exceeds_the_noise_is_not_called_noise(known: Machine) -> None:
    screw = Effect("EYY", (0.003, 0.0), Periodic(period=10.0, order=(1,)))
    found = diagnose(
        [direct(known.replace(effects=(*known.effects, screw)), "EXX EYY EZZ", 0.5, 8)], known, ["pitch Y"]
    )
    assert found.verdict == UNKNOWN
    rungs = {rung.name: rung for rung in ladder(found)}
    assert rungs[UNEXPLAINED].share > 0.5
    assert rungs[NOISE].share < 0.3
    assert "without a pattern" in text(found)
