"""What is left is said where it is more than was asked for, and only there."""

from __future__ import annotations

import pytest

from ncfix.compensate.report import FixReport


def report(left: float | None) -> FixReport:
    figures = {} if left is None else {"max": left, "rms": 0.1, "where": 7}
    return FixReport("part.nc", 9, 9, 9, 0, True, error_after_um=figures, rounding_um=0.5)


@pytest.mark.parametrize("left", [None, 0.0, 1.0, 1.5])
def test_nothing_is_said_within_tolerance_and_rounding(left: float | None) -> None:
    assert report(left).with_what_is_left(1.0).warnings == ()


def test_the_worst_place_is_named_beyond_it() -> None:
    (warning,) = report(5.346).with_what_is_left(1.0).warnings
    assert warning.code == "NCF416"
    assert warning.text == (
        "a tip error of 5.35 um is left here, more than the tolerance of 1 um and the 0.50 um of the control's digits"
    )
    assert warning.place is not None
    assert (warning.place.path, warning.place.line) == ("part.nc", 7)
    assert report(5.346).with_what_is_left(4.0).warnings
    assert report(5.346).with_what_is_left(4.9).warnings == ()
