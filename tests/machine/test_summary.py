"""The size of effects over the travel, against values worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from ncfix.machine import Machine, loads
from ncfix.machine.effects import extent

MACHINE = """
topology = "w C F X Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [-100, 300] }
axis.Z = { type = "linear", direction = [0, 0, 1] }
axis.C = { type = "rotary", direction = [0, 0, 1] }
"""


def extent_of(effect: str) -> tuple[float, float] | None:
    machine: Machine = loads(f"{MACHINE}\n[[effect]]\n{effect}\n")
    return extent(machine, machine.effects[0])


@pytest.mark.parametrize(
    ("effect", "expected"),
    [
        ('name = "EC0X"\ncoefficients = [12e-6]', (12e-6, 12e-6)),
        ('name = "EXX"\nbasis = "polynomial"\ndegree = [1]\nscale = 100\ncoefficients = [0.01]', (-0.01, 0.03)),
        ('name = "EXX"\nbasis = "backlash"\ncoefficients = [0.01]', (-0.005, 0.005)),
        ('name = "EXX"\nbasis = "table"\npositions = [0, 7, 8]\ncoefficients = [0, 0.5, 0]', (0, 0.5)),
        ('name = "EXC"\nbasis = "fourier"\norder = [1]\ncoefficients = [0.003, 0.004]', (-0.005, 0.005)),
        (
            'name = "EZX"\nbasis = "polynomial"\ndegree = [1]\ntimes = "C"\ncoefficients = [1.0]',
            (-100 * 360, 300 * 360),
        ),
        ('name = "EZC"\nbasis = "polynomial"\ndegree = [1]\ninput = "X"\ncoefficients = [1e-4]', (-0.01, 0.03)),
    ],
)
def test_extent(effect: str, expected: tuple[float, float]) -> None:
    assert extent_of(effect) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    "effect",
    [
        'name = "EZZ"\nbasis = "polynomial"\ndegree = [1]\ncoefficients = [1.0]',
        'name = "EZS"\nbasis = "polynomial"\ndegree = [1]\ninput = "temp_spindle"\ncoefficients = [1.0]',
    ],
    ids=["no range", "not an axis"],
)
def test_no_extent_without_a_travel(effect: str) -> None:
    assert extent_of(effect) is None


def test_a_kink_between_the_samples_is_seen() -> None:
    found = extent_of('name = "EXX"\nbasis = "table"\npositions = [0, 0.1, 0.2]\ncoefficients = [0, 1, 0]')
    assert found is not None
    assert np.isclose(found[1], 1.0)
