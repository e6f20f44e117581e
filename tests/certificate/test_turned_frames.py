"""Turned coordinates and tilted planes: the second reader follows them as `fix` does, and finds what is wrong there."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

from certificate.planting import (
    ROOT,
    SETUP,
    Case,
    Writer,
    dropped_line,
    judged,
    machine,
    planted,
    swapped_axes,
    wrong_sign,
)
from conftest import some
from ncfix.certificate.model import TipModel
from ncfix.certificate.turning import PlaneBlock, SwivelCall, turned
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.machine import load
from ncfix.text.dialect import get
from ncfix.text.reader import read

FORMS = (
    *((language, "turned", "three") for language in ("fanuc", "iso", "siemens", "heidenhain")),
    *((language, "tilted", "table") for language in ("fanuc", "siemens", "heidenhain")),
)
WHOLE = 0.8
"""Of the motions at least: those behind a turn are not known until all of X, Y and Z have been named."""


@pytest.mark.parametrize(("language", "frame", "name"), FORMS)
def test_turns_are_followed_and_faults_in_them_found(language: str, frame: str, name: str) -> None:
    rng, known = random.Random(f"{language} {frame}"), machine(name)
    motions = proved = 0
    for _ in range(some(10)):
        text = Writer(language, rng, True, False, {}, [], frame).program(30)
        program, options = read(text, "part", get(language)), FixOptions(figures=False, allow_refused=True)
        case = Case(language, text, fix_program(program, known, SETUP, options).text, known, True)
        proof = judged(case, case.corrected)
        assert not proof.faults
        motions, proved = motions + proof.motions, proved + proof.proved_motions
        for fault in (wrong_sign, swapped_axes, dropped_line):
            wrong = planted(case, fault, rng)
            assert wrong is None or judged(case, wrong).faults
    assert proved >= WHOLE * motions


@pytest.mark.parametrize("name", ["table", "head", "dmu50"])
def test_rotary_axes_square_the_tool_to_a_plane(name: str) -> None:
    """Wherever they go, the tool points along the normal there; and they go the nearer way."""
    known = machine(name) if name != "dmu50" else load(str(ROOT / "examples" / "machines" / "dmu50.toml"))
    model = TipModel.of(known)
    assert model is not None
    way = model.rotary_way
    assert way is not None
    rng = np.random.default_rng(4)
    for here, there in rng.uniform(-1.4, 1.4, (some(40), 2, 2)):
        wanted = way.directions(there[None])[0]
        found = way.to(wanted, here, sense=0, sign=0, inside=False, stays=True)
        if found is not None:
            assert way.directions(found[None])[0] == pytest.approx(wanted, abs=1e-9)
            assert np.abs(found - here).sum() <= np.abs(there - here).sum() + 1e-6
        both = [way.to(wanted, here, sense=sense, sign=0, inside=False, stays=True) for sense in (-1, 1)]
        assert any(each is not None and each == pytest.approx(there, abs=1e-6) for each in both)


@pytest.mark.parametrize("sense", [-1, 0, 1])
def test_half_a_turn_may_be_made_either_way_round(sense: int) -> None:
    """From A-90 both A90 and A-270 are half a turn away: which of them the control takes this reader does not say."""
    model = TipModel.of(machine("table"))
    assert model is not None
    way = model.rotary_way
    assert way is not None
    wanted = way.directions(np.radians([[0.0, 90.0]]))[0]
    here = np.radians([0.0, -90.0])
    assert way.to(wanted, here, sense=sense, sign=0, inside=False, stays=True) is None


def test_the_plane_of_a_cycle800() -> None:
    """Mode 57 turns about X, then the new Y, then the new Z; the last zero point lies along the turned axes."""
    found = SwivelCall.of('CYCLE800(4,"TABLE",200000,57,1,2,3,90,0,90,0,0,5,-1,100,1)')
    assert found is not None
    assert found.rotation == pytest.approx(turned(("X", 90.0), ("Z", 90.0)))
    assert found.origin == pytest.approx([1.0, -3.0, 3.0])
    assert found.sense == -1
    assert SwivelCall.of('CYCLE800(0,"TABLE",200001,57,0,0,0,30,0,0,0,0,0,1)') is None  # on top of another one
    assert SwivelCall.of('CYCLE800(0,"TABLE",200000,192,0,0,0,30,0,0,0,0,0,1)') is None  # rotary axes themselves
    assert SwivelCall.of('CYCLE800(0,"TABLE",200000,57,R1,0,0,30,0,0,0,0,0,1)') is None


def test_the_plane_of_a_plane_spatial() -> None:
    """Spatial angles turn about the axes of the workpiece, which stand still: A first."""
    found = PlaneBlock.of("PLANE SPATIAL SPA+90 SPB+0 SPC+90 TURN MB MAX FMAX SEQ- TABLE ROT")
    assert found is not None
    assert found.rotation is not None
    x, y, z = found.rotation @ np.array([0.0, 0.0, 1.0])
    assert (x, y, z) == pytest.approx((math.cos(0.0), 0.0, 0.0), abs=1e-12)
    assert (found.positions, found.sign, found.table) == ("TURN", -1, True)
    assert PlaneBlock.of("PLANE SPATIAL SPA+Q5 SPB+0 SPC+0 STAY") is None
    assert PlaneBlock.of("PLANE SPATIAL SPA+5 SPB+0 SPC+0") is None
