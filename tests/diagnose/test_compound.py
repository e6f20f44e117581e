"""Names that say the same together: equal scales are a temperature, a squareness is of two axes, whoever carries it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from measure.poses import machine, plan
from ncfix.diagnosis.diagnosis import AMBIGUOUS, Diagnosis, diagnose
from ncfix.machine import Effect, Machine
from ncfix.machine.basis import Polynomial
from ncfix.measure.instruments import Faults, simulate

SHRUNK = -30e-6
SQUARE = 60e-6


@pytest.fixture(scope="module")
def bare() -> Machine:
    """Three axes of which nothing is known."""
    return machine("three_axis").replace(effects=())


def found(bare: Machine, effects: tuple[Effect, ...], setup: str) -> Diagnosis:
    poses = replace(plan(bare, "tcp", 100, 2)).with_header("setup", setup).with_header("noise_um", "1")
    return diagnose([simulate(poses, bare.replace(effects=effects), Faults(1.0), 2)], bare)


def test_equal_scales_are_a_temperature(bare: Machine) -> None:
    scales = tuple(Effect(f"E{letter}{letter}", (SHRUNK,), Polynomial(degree=(1,))) for letter in "XYZ")
    [only] = found(bare, scales, "ball").findings
    assert only.candidate.name == "temperature"
    assert "machine were 2.6 K colder than the part" in only.candidate.title
    assert len(only.effects) == 3


def test_squareness_is_of_two_axes_and_an_aligned_part_leaves_open_whose(bare: Machine) -> None:
    said = found(bare, (Effect("EC0Y", (SQUARE,)),), "rigid")
    [only] = said.findings
    assert said.verdict == AMBIGUOUS
    assert only.candidate.title.startswith("squareness of X and Y, carried by")
    assert said.proposal is not None
    assert said.proposal.plan is None
    assert "aligned" in said.proposal.reason
