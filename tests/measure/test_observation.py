"""The design matrices of all instruments are the derivatives of what the instruments would read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from measure.poses import machine, plan
from ncfix.measure.instruments import Faults, observe, simulate

KINDS = ("tcp", "tcp6", "probe", "gauge", "bar", "tool", "table", "axis")
CASES = [
    (name, kind)
    for name in ("three_axis", "wCBXFZYSt", "dmu50")
    for kind in KINDS
    if (name, kind) != ("three_axis", "table")
]


@pytest.mark.parametrize(("name", "kind"), CASES)
def test_the_design_is_the_derivative_by_coefficients(name, kind):
    known = machine(name)
    clean = known.replace(effects=())
    seen = observe(simulate(plan(known, kind, 40), clean, Faults(setup=0.0), seed=2), clean)
    start, column = seen.unknowns.start, 0
    design, before = seen.design(known.effects), seen.predict(clean, seen.unknowns.start)
    for effect in known.effects:
        step = 1e-7 if effect.rotational else 1e-5
        for k in range(effect.basis.size):
            values = tuple(step if i == k else 0.0 for i in range(effect.basis.size))
            erring = clean.replace(effects=(replace(effect, coefficients=values),))
            found = (seen.predict(erring, start) - before) / step
            # second order in the step; a laser tracker's targets are known to what its own first guess leaves
            assert np.abs(found - design[:, column]).max() < 2e-3 * max(1.0, np.abs(found).max()), effect.name
            column += 1


@pytest.mark.parametrize(("name", "kind"), CASES)
def test_the_unknown_design_is_the_derivative_by_the_set_up(name, kind):
    known = machine(name)
    clean = known.replace(effects=())
    seen = observe(simulate(plan(known, kind, 40), clean, Faults(setup=0.2), seed=2), clean)
    start = seen.unknowns.start
    design = seen.unknown_design(start)
    for k, label in enumerate(seen.unknowns.labels):
        step = np.zeros(len(start))
        step[k] = 1e-6 if "turn" in label else 1e-4
        found = (seen.predict(clean, start + step) - seen.predict(clean, start - step)) / (2 * step[k])
        assert np.abs(found - design[:, k]).max() < 1e-4 * max(1.0, np.abs(found).max()), label


@pytest.mark.parametrize(("name", "kind"), CASES)
def test_without_faults_the_simulation_is_what_is_predicted(name, kind):
    known = machine(name)
    data = simulate(plan(known, kind, 30), known, Faults(setup=0.0), seed=1)
    seen = observe(data, known)
    if kind in ("tool", "table"):
        return  # the stand is guessed from the data, and not where it was
    residual = seen.values - seen.predict(known, observe(plan(known, kind, 30), known).unknowns.start)
    assert np.abs(residual).max() < 1e-9


def test_noise_is_told_from_repeats():
    known = machine("three_axis")
    once = plan(known, "tcp", 30)
    thrice = once.rows(np.repeat(np.arange(30), 4))
    thrice = replace(thrice, labels={**thrice.labels, "repeat": tuple("1234" * 30)})
    data = simulate(thrice, known, Faults(noise_um=2.0), seed=5)
    data = replace(data, headers=())
    seen = observe(data, known)
    assert seen.noise_known
    # 270 degrees of freedom: the standard deviation of a standard deviation is 4 %
    assert abs(seen.sigma[0] - 2e-3) < 4 * 0.043 * 2e-3


def test_a_simulated_scale_bar_is_as_long_as_its_certificate():
    """Otherwise gains would be estimated from a bar that is not the one that was measured."""
    known = machine("wCAYFXZSt")
    poses = plan(known, "probe", 60).with_header("distance", "1 2 150.000 0.0010")
    data = simulate(poses, known, Faults(noise_um=0.1), seed=3)
    seen = observe(data, known)
    left = seen.values - seen.predict(known, fitted(seen))
    assert abs(left[-1]) < 2e-3
    assert np.abs(left[:-1]).max() < 2e-3


def fitted(seen):
    """The set-up by least squares, the machine known."""
    guess = seen.unknowns.start
    for _ in range(5):
        rest = (seen.values - seen.predict(seen.machine, guess)) / seen.sigma
        guess = guess + np.linalg.lstsq(seen.unknown_design(guess) / seen.sigma[:, None], rest, rcond=None)[0]
    return guess
