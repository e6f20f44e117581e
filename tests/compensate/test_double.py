"""A program that was corrected before is known by its numbers, also without its stamp; no other is taken for one."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compensate.streaming import run
from conftest import FULL, some
from ncfix.compensate import FixOptions, driver, report
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import Task
from ncfix.control.setup import Setup
from ncfix.diagnostics import RefusedError
from ncfix.machine import Machine, load
from ncfix.text.dialect import get
from ncfix.text.reader import read

SETUP = Setup(assume_zero=True, initial={"X": 0.0, "Y": 0.0, "Z": 100.0})
OPTIONS = FixOptions(tolerance_um=5.0)
"""Coarse: these motions are cut into few pieces."""


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(root / "examples/machines/wCBXFZYSt.toml")


def pocket(decimals: int, seed: int) -> bytes:
    """Sixty motions to places with so many decimals."""
    places = np.random.default_rng(seed).uniform(-90, 90, (60, 3))
    lines = (f"X{x:.{decimals}f} Y{y:.{decimals}f} Z{z:.{decimals}f}" for x, y, z in places)
    return ("G21 G90 G94\nG1 F800 X0 Y0 Z0\n" + "\n".join(lines) + "\nM2\n").encode()


def corrected(text: bytes, machine: Machine, force: bool = False) -> tuple[bytes, set[str]]:
    fixed = fix_program(read(text, "part.ngc", "linuxcnc"), machine, SETUP, replace(OPTIONS, force=force))
    return fixed.text, {warning.code for warning in fixed.report.warnings}


def unstamped(text: bytes) -> bytes:
    found = re.sub(rb"[;(][^\n]*ncfix[^\n]*\n", b"", text)
    assert b"ncfix" not in found
    return found


@pytest.fixture(scope="module")
def again(machine: Machine) -> bytes:
    """A program with two decimals that was corrected and has lost its stamp."""
    return unstamped(corrected(pocket(2, seed=1), machine)[0])


@pytest.mark.parametrize("decimals", [0, 2, 3])
def test_a_program_that_lost_its_stamp_is_refused(machine: Machine, decimals: int) -> None:
    once, codes = corrected(pocket(decimals, seed=1), machine)
    assert "NCF438" not in codes
    with pytest.raises(RefusedError) as caught:
        corrected(unstamped(once), machine)
    assert caught.value.code == "NCF438"
    _, codes = corrected(unstamped(once), machine, force=True)
    assert "NCF438" in codes


@pytest.mark.parametrize("seed", range(some(4)))
def test_numbers_with_all_digits_say_nothing(machine: Machine, seed: int) -> None:
    """Whether such a program was corrected cannot be told, and is not claimed: the first time, nor the second."""
    once, codes = corrected(pocket(4, seed), machine)
    assert "NCF438" not in codes
    _, codes = corrected(unstamped(once), machine)
    assert "NCF438" not in codes


def test_a_few_round_numbers_are_no_proof(machine: Machine) -> None:
    lines = pocket(2, seed=3).splitlines(keepends=True)
    once, _ = corrected(b"".join([*lines[:11], lines[-1]]), machine)
    _, codes = corrected(unstamped(once), machine)
    assert "NCF438" not in codes


@pytest.mark.parametrize("size", [500, 1500] if FULL else [500])
def test_a_program_in_parts_is_judged_by_more_than_the_first(machine: Machine, again: bytes, size: int) -> None:
    """Too little is in each part to tell; it is told before anything of the program is passed on."""
    task = Task(machine, SETUP, OPTIONS, None, "part.ngc", get("linuxcnc"), size)
    for jobs in (1, 2):
        with pytest.raises(RefusedError) as caught:
            run(task, again, jobs)
        assert caught.value.code == "NCF438"
    _, done = run(replace(task, options=replace(OPTIONS, force=True)), again, 1)
    whole = fix_program(read(again, "part.ngc", "linuxcnc"), machine, SETUP, replace(OPTIONS, force=True))
    assert [message.code for message in done.report.warnings] == [message.code for message in whole.report.warnings]


def test_the_beginning_of_a_long_program_is_judged(
    machine: Machine, again: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a whole and in parts: what comes behind those lines makes no difference."""
    monkeypatch.setattr(report, "LOOKED", 10)
    monkeypatch.setattr(driver, "LOOKED", 10)
    _, codes = corrected(again, machine)
    assert "NCF438" not in codes
    task = Task(machine, SETUP, OPTIONS, None, "part.ngc", get("linuxcnc"), 500)
    assert "NCF438" not in {message.code for message in run(task, again, 1)[1].report.warnings}
