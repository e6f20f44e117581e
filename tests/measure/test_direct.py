"""Direct readings of lengths and of angles: each has noise of its own, and only lengths count as lengths."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ncfix.machine import load
from ncfix.measure.calibrate import calibrate, guesses, over_the_travels
from ncfix.measure.contradictions import misfit
from ncfix.measure.estimate import Calibration, Residuals
from ncfix.measure.measurement import Measurement
from ncfix.measure.reader import reads

ROOT = Path(__file__).parents[2]
MACHINE = load(ROOT / "examples" / "machines" / "three_axis.toml")
NOISE = {"EAX": 2e-6, "EYX": 1e-3}
"""rad, mm"""


def read(*components: str, head: str = "", runs: int = 4) -> Measurement:
    """X from 25 places, in `runs` runs."""
    random = np.random.default_rng(1)
    text = f"# ncfix-measurement: 1\n# kind: axis\n{head}axis,component,position,value\n"
    for name in components:
        places = 16.0 * np.tile(np.arange(25), runs) - 200
        values = NOISE[name] * (10 * (places / 200) ** 2 + random.standard_normal(len(places)))
        text += "".join(f"X,{name},{x:g},{value:.9f}\n" for x, value in zip(places, values, strict=True))
    return reads(text.encode(), MACHINE)


def found(*components: str, head: str = "", runs: int = 4) -> Calibration:
    return calibrate([read(*components, head=head, runs=runs)], MACHINE, ",".join(components))


@pytest.mark.parametrize("components", [("EAX",), ("EYX",), ("EAX", "EYX"), ("EYX", "EAX")])
def test_noise_from_repeats_is_that_of_angles_and_of_lengths_apart(components: tuple[str, ...]) -> None:
    """Standard deviations of 75 degrees of freedom are known to 8 %."""
    result = found(*components)
    sigma = result.problem.sigma.reshape(len(components), -1)
    for name, each in zip(components, sigma, strict=True):
        assert each == pytest.approx(NOISE[name], rel=0.25)
    assert result.problem.noise_known
    assert 0.6 < result.chi_square < 1.5
    assert "NCF634" not in {message.code for message in result.remarks}


@pytest.mark.parametrize(
    ("head", "known", "sigma"),
    [("# noise_urad: 3\n", True, 3e-6), ("# noise_um: 1\n", True, 1e-5), ("", False, 1e-5)],
)
def test_noise_of_angles_without_repeats(head: str, known: bool, sigma: float) -> None:
    """That of a length at 100 mm, if no other is given."""
    problem = found("EAX", head=head, runs=1).problem
    assert problem.noise_known == known
    assert problem.sigma == pytest.approx(sigma)


def test_angles_are_no_lengths_in_figures() -> None:
    both, lengths, angles = found("EAX", "EYX"), found("EYX"), found("EAX")
    assert both.before_um > 0.5
    assert lengths.after_um == pytest.approx(1.0, rel=0.3)
    assert both.after_um == pytest.approx(1.0, rel=0.3)
    (size,) = Residuals.of(both.problem, both.estimate).rms_by_set().values()
    assert size == pytest.approx(both.after_um)
    assert np.isnan([angles.before_um, angles.after_um]).all()
    assert not guesses(angles, over_the_travels(angles))
    assert misfit(angles) is None
    assert "rms_after_um" not in angles.machine.provenance


def test_an_angle_that_is_far_off_is_named_with_its_unit() -> None:
    seen = read("EAX", head="# noise_urad: 2\n")
    values = seen.columns["value"].copy()
    values[57] += 3e-4
    result = calibrate([seen.with_columns({"value": values})], MACHINE, "EAX")
    (said,) = (message.text for message in result.remarks if message.code == "NCF633")
    name, _, _, size, unit = said.split()[:5]
    assert (name, unit) == ("EAX", "urad")
    assert float(size) == pytest.approx(300, abs=15)
