"""Real plates, drilled by a mill and measured on a CMM: what is named, what is not, and that it predicts."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from diagnose.plates import PLATES, clear_patterns, mill, plain, plate
from ncfix.diagnosis.diagnosis import UNKNOWN, Diagnosis, diagnose
from ncfix.diagnosis.presentation import text

README = {
    "D2130A1": (5.4, 4.3, 4.1),
    "D1396A1": (4.5, 4.5, 4.5),
    "D1597A, 2003": (6.4, 6.2, 5.7),
    "D8131": (5.8, 5.8, 5.0),
}
"""What the data's own page says that least squares leave: set-up, one scale, scales and shear; um."""
EXPECTED = {"D2130A1": {"temperature"}, "D1597A, 2003": {"scale Y"}, "D8131": {"EC0Y"}}


@pytest.mark.parametrize("name", PLATES)
def test_least_squares_are_those_of_the_page(name: str, shared: Callable[[str], Path]) -> None:
    found = plain(plate(shared("measurements"), name))
    assert found == pytest.approx(README[name], abs=0.11)  # printed to 0.1; D8131 is 5.84 there


def test_a_clear_pattern_without_a_name_is_said_whatever_the_noise(shared: Callable[[str], Path]) -> None:
    """Bent by 11 um along Y, F = 40: no name of the catalogue explains it, and noise does not do it."""
    found = diagnose([plate(shared("measurements"), "D1396A1")], mill())
    assert (found.verdict, found.findings) == (UNKNOWN, ())
    assert "without a name: 3.3 um rms" in text(found)
    assert "dx is cubic along Y" in text(found)


@pytest.fixture(scope="module")
def diagnosed(shared: Callable[[str], Path]) -> Callable[[str], Diagnosis]:
    """What is found on a plate, by its name."""
    return cache(lambda name: diagnose([plate(shared("measurements"), name)], mill()))


def test_a_bow_is_not_taken_for_a_little_of_everything(
    shared: Callable[[str], Path], diagnosed: Callable[[str], Diagnosis]
) -> None:
    """Bowed by 11 um along Y, F = 47."""
    data, found = plate(shared("measurements"), "D8131"), diagnosed("D8131")
    assert clear_patterns(data) == ["dy by YY (F = 47)"]
    assert found.rest.pattern_um > 4.0


@pytest.mark.parametrize("name", EXPECTED)
def test_scales_and_squareness_are_named(name: str, diagnosed: Callable[[str], Diagnosis]) -> None:
    found = diagnosed(name)
    names = {each.candidate.name for each in found.findings}
    assert (found.verdict == UNKNOWN) == (name == "D1597A, 2003")  # whose rest is larger than the scale
    assert names >= EXPECTED[name] or ("EC0X" in names and "EC0Y" in EXPECTED[name])
    assert found.gap.holdout_after < found.gap.holdout_before
