"""Rotary words on their side of zero and of a full turn."""

from __future__ import annotations

import pytest

from ncfix.program.klartext.turns import extremes, on_its_side

BELOW, PAST = b"L C-5\nL B+1 C+10 F100", b"L C+400\nL C0"


def test_the_angles_that_a_program_writes() -> None:
    assert extremes(BELOW, "C") == (-5, 10)
    assert extremes(b"L C+0\nL IC-3 C 350,5", "C") == (0, 350.5)
    assert extremes(b"7 L X-5 B-3 C359.9 ;C-9", "C") == (359.9, 359.9)
    assert extremes(b"CC X-5\nC X-3 Y-2 DR+", "C") == (0, 0)


@pytest.mark.parametrize(
    ("source", "nominal", "angle", "kept"),
    [
        (b"L C+0\nL C+90", 0.0, -0.002, 0.0),
        (b"L C+0\nL C+90", 0.0, 0.002, 0.002),
        (b"L C+0\nL C+90", 90.0, 89.998, 89.998),
        (BELOW, 0.0, -0.002, -0.002),
        (b"L C+359.999", 359.999, 360.001, 359.999),
        (PAST, 359.999, 360.001, 360.001),
        (b"L C+360", 360.0, 360.001, 360.001),
    ],
)
def test_a_correction_does_not_cross_what_the_program_never_crosses(
    source: bytes, nominal: float, angle: float, kept: float
) -> None:
    assert on_its_side(source, "C", nominal, angle, 0.001) == pytest.approx(kept)
