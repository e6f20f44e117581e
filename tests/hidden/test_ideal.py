"""The ideal observer, and what it lets be asked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hidden import designs, workshop
from hidden.climate import draw_climate
from hidden.designs import Design
from hidden.ideal import Observer, observer
from hidden.motion import Array
from hidden.physics import catalogue
from hidden.situation import Situation
from hidden.visibility import first_order, sensitivities, view
from hidden.world import rms

NAMES = ("EYZ", "EAZ", "lateral play EYZ", "drift Z", "spindle growth", "backlash X")


def look(topology: str, design: Design, seed: int = 5) -> tuple[Observer, Situation, Array]:
    rng = np.random.default_rng(seed)
    machine = workshop.draw_machine(rng, topology)
    s = designs.lay_out(rng, machine, topology, draw_climate(rng), machine.lengths, design)
    sight = view(s, workshop.draw_model(rng, machine, topology), np.ones(len(s), dtype=bool), "tcp")
    entries = [e for e in catalogue(machine) if e.name in NAMES]
    seen_from = sensitivities(s)
    return observer(rng, s, sight, seen_from, entries, 0.003, 1e-4), s, seen_from


def specimen(name: str, s: Situation, seen_from: Array, size: float = 0.01) -> Array:
    entry = next(e for e in catalogue(s.machine) if e.name == name)
    moved = first_order(seen_from, entry.draw(np.random.default_rng(11))(s))
    return size * moved / rms(moved)


@pytest.mark.parametrize("name", NAMES)
def test_with_a_good_design_the_true_name_stands_alone(name: str) -> None:
    eye, s, seen_from = look("wXFYZSt", designs.FREE)
    truth = specimen(name, s, seen_from)
    assert next(iter(eye.evidence(truth))) == name
    assert not eye.fellows(name, truth)


def test_one_tool_hardly_tells_a_tilt_from_the_shift_that_it_makes() -> None:
    """By the shift along the tool alone, which comes with a tilt whose pivot is not quite above the tip."""
    odds = []
    for tools in (1, 2):
        eye, s, seen_from = look("wXFYZSt", replace(designs.FREE, tools=tools))
        found = eye.evidence(specimen("EYZ", s, seen_from))
        odds.append(found["EYZ"] - found["EAZ"])
    assert odds[0] < 0.2 * odds[1]


def test_evidence_of_nothing_is_negative_and_grows_with_the_effect() -> None:
    eye, s, seen_from = look("wXFYZSt", designs.FREE)
    truth = specimen("backlash X", s, seen_from)
    weights = [eye.evidence(size * truth)["backlash X"] for size in (0.0, 0.5, 1.0)]
    assert weights[0] < 0 < weights[1] < weights[2]


def test_evidence_is_the_mean_over_noise_of_gaussian_log_odds() -> None:
    """Against densities written out, for one effect in a size that dominates the mean over sizes."""
    eye, s, seen_from = look("wXFYZSt", replace(designs.FREE, count=60))
    truth = specimen("backlash X", s, seen_from)
    values = eye.sight.left(eye.sight.observed(truth))
    columns = eye.seen["backlash X"]
    noise = 0.003**2 * np.eye(len(values)) + sum(1e-8 / c.shape[1] * c @ c.T for c in eye.seen.values())
    weights = []
    for size in (0.0025, 0.005, 0.01, 0.02):
        both = noise + size**2 / columns.shape[1] * columns @ columns.T
        gain = np.linalg.inv(noise) - np.linalg.inv(both)
        expected = values @ gain @ values + np.trace(gain @ noise)
        weights.append(0.5 * expected - 0.5 * (np.linalg.slogdet(both)[1] - np.linalg.slogdet(noise)[1]))
    mean = np.logaddexp.reduce(weights) - np.log(4)
    assert eye.evidence(truth)["backlash X"] == pytest.approx(mean, rel=1e-6)
