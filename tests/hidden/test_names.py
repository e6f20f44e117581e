"""Reading of reported names: what counts as the hidden effect, and what does not."""

from __future__ import annotations

import numpy as np
import pytest

from hidden import mistakes, workshop
from hidden.names import KINDS, Named, matches
from hidden.physics import catalogue, foreign, vocabulary

EXX = Named("EXX", "curve", "X", ("EXX",), "X geometry")
EYX = Named("EYX", "curve", "X", ("EYX",), "X geometry")
PITCH = Named("pitch X", "pitch", "X", ("EXX",), "X geometry")
BACKLASH = Named("backlash X", "backlash", "X", ("EXX",), "X reversal")
PLAY = Named("angular play ECX", "angular play", "X", ("ECX",), "X reversal")
RADIAL = Named("radial C", "radial", "C", ("EXC", "EYC"), "C rotary")
STIFF = Named("table stiffness C", "table stiffness", "C", ("EAC", "EBC"), "C rotary")
DRIFT = Named("drift X", "drift", "X", ("EX0F",), "thermal")
GROWTH = Named("spindle growth", "spindle growth", "", ("EZS",), "thermal")
CENTRE = Named("rotary centre drift C", "rotary centre drift", "C", ("EX0C",), "thermal")
ACTIVE = Named("table active", "table active", "", (), "mistake")
SIGN = Named("rotary sign B", "rotary sign", "B", (), "mistake")


@pytest.mark.parametrize(
    ("truth", "name", "title", "axis", "right"),
    [
        (EXX, "EXX", "", None, True),
        (EXX, "EXX", "positioning of X", "X", True),
        (EXX, "EYX", "straightness of X in Y", "X", False),
        (EXX, "EXX pitch error", "", "X", False),
        (EXX, "backlash X", "", "X", False),
        (EXX, "EXX", "backlash of X", "X", False),
        (EYX, "EYX", "straightness", "X", True),
        (EYX, "EAX", "roll of X", "X", False),
        (PITCH, "pitch X", "", None, True),
        (PITCH, "EXX cyclic", "screw pitch", "X", True),
        (PITCH, "screw pitch cyclic", "", "X", True),
        (PITCH, "screw pitch cyclic", "", "Y", False),
        (PITCH, "EXX", "", "X", False),
        (BACKLASH, "backlash", "lost motion at reversal", "X", True),
        (BACKLASH, "backlash Y", "", None, False),
        (PLAY, "angular play ECX", "", None, True),
        (PLAY, "play ECX", "yaw play", "X", True),
        (PLAY, "play EBX", "", "X", False),
        (PLAY, "ECX", "", "X", False),
        (RADIAL, "EXC", "radial motion", "C", True),
        (RADIAL, "EYC", "", None, True),
        (RADIAL, "radial C order 2", "", "C", True),
        (RADIAL, "EXB", "", None, False),
        (RADIAL, "EAC", "wobble", "C", False),
        (STIFF, "wobble C", "", None, True),
        (STIFF, "radial C", "", None, False),
        (DRIFT, "column drift", "", "X", True),
        (DRIFT, "drift EX0F", "", None, True),
        (DRIFT, "drift Y", "", None, False),
        (DRIFT, "rotary centre drift C", "", "C", False),
        (GROWTH, "EZS", "spindle growth with temperature", "S", True),
        (GROWTH, "drift Z", "", "Z", False),
        (CENTRE, "rotary centre drift", "", "C", True),
        (ACTIVE, "table already active", "", None, True),
        (ACTIVE, "wrong sign", "", None, False),
        (SIGN, "wrong rotary sign", "", "B", True),
        (SIGN, "wrong rotary sign", "", "C", False),
        (SIGN, "wrong sign", "", "B", False),
    ],
)
def test_reading(truth: Named, name: str, title: str, axis: str | None, right: bool) -> None:
    assert matches(truth, name, title, axis) is right


@pytest.mark.parametrize("topology", workshop.TOPOLOGIES)
def test_the_catalogues_own_names_mean_one_effect_each(topology: str) -> None:
    machine = workshop.draw_machine(np.random.default_rng(1), topology)
    entries = [Named(e.name, e.kind, e.axis, e.symbols, e.family) for e in (*catalogue(machine), *foreign(machine))]
    for truth in entries:
        meant = [other.name for other in entries if matches(truth, other.name)]
        allowed = {truth.name, f"wobble {truth.axis}"} if truth.kind == "table stiffness" else {truth.name}
        assert truth.name in meant
        assert set(meant) <= allowed


@pytest.mark.parametrize("topology", workshop.TOPOLOGIES)
def test_the_vocabulary_says_more_and_each_name_is_its_own(topology: str) -> None:
    machine = workshop.draw_machine(np.random.default_rng(1), topology)
    said = vocabulary(machine)
    assert {e.name for e in said} > {e.name for e in catalogue(machine)}
    for entry in said:
        assert matches(Named(entry.name, entry.kind, entry.axis, entry.symbols, entry.family), entry.name), entry.name


def test_every_kind_can_be_read() -> None:
    machine = workshop.draw_machine(np.random.default_rng(1), "wCAYFXZSt")
    kinds = {e.kind for e in catalogue(machine)} - {"curve"}
    assert kinds | set(mistakes.KINDS) <= set(KINDS)
