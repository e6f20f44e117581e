"""Numbers keep the manner in which they were written."""

from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ncfix.text.spelling import NumberStyle, Spelling, decimals_for, value_of


@pytest.mark.parametrize(
    ("written", "value", "decimals", "expected"),
    [
        ("50.", 50.012, 3, "50.012"),
        ("50.", 50.0, 3, "50."),
        ("50", 50.012, 3, "50.012"),
        ("50.000", 50.01, 3, "50.010"),
        ("50.0000", 50.01234, 3, "50.0123"),
        (".5", 0.4987, 3, ".499"),
        ("-.5", -0.4987, 3, "-.499"),
        ("+1.25", 1.2625, 4, "+1.2625"),
        ("+1.25", -1.2625, 4, "-1.2625"),
        ("007.5", 7.51, 3, "007.51"),
        ("1.0", -0.0001, 3, "0.0"),
        ("0", -0.0004, 3, "0"),
        (".5", 0.0, 3, ".0"),
        ("1 2.5", 12.51, 3, "12.51"),
        ("- 3", -3.002, 3, "-3.002"),
    ],
)
def test_a_value_is_written_in_the_style_of_the_number_it_replaces(written, value, decimals, expected):
    assert NumberStyle.of(written).write(value, decimals) == expected


KLARTEXT = Spelling(signed=True, comma=True, point=False, trimmed=False)


@pytest.mark.parametrize(
    ("spelling", "value", "new", "short", "instead"),
    [
        (Spelling(), 12.34, "12.3400", "12.34", "12.34"),
        (Spelling(), -12.0, "-12.0000", "-12.", "-12."),
        (Spelling(), 0.25, "0.2500", "0.25", "0.25"),
        (Spelling(point=False), -1e-9, "-0.0000", "0", "0"),
        (KLARTEXT, 12.34, "+12,3400", "+12,34", "+12,3400"),
        (KLARTEXT, -1e-9, "+0,0000", "+0", "+0,0000"),
    ],
)
def test_a_control_spells_new_numbers_in_its_own_way(spelling, value, new, short, instead):
    assert (spelling.number(value, 4), spelling.short(value, 4), spelling.instead(value, 4)) == (new, short, instead)


@pytest.mark.parametrize(
    ("spelling", "was", "value", "expected"),
    [
        (Spelling(), "-3.5", 3.5, "3.5"),
        (KLARTEXT, "-3,5", 3.5, "+3,5"),
        (KLARTEXT, "3.5", -3.512, "-3.512"),
        (KLARTEXT, "+3", 3.25, "+3,25"),
    ],
)
def test_what_had_a_sign_or_a_comma_keeps_it(spelling, was, value, expected):
    assert spelling.like(was, value, 3) == expected
    assert value_of(expected) == value


@pytest.mark.parametrize(
    ("step", "decimals"), [(0.001, 3), (0.0001, 4), (0.0005, 4), (0.001 / 25.4, 5), (1.0, 0), (20.0, 0)]
)
def test_decimals_that_a_least_increment_needs(step, decimals):
    assert decimals_for(step) == decimals


numbers = st.decimals(min_value=-99999, max_value=99999, allow_nan=False, allow_infinity=False, places=4)


@given(numbers, st.integers(0, 4), st.floats(-1e5, 1e5))
def test_what_is_written_is_the_value_to_half_a_step(original: Decimal, decimals: int, value: float):
    style = NumberStyle.of(str(original))
    text = style.write(value, decimals)
    # half a step of the last digit, plus the double's own resolution at 1e5
    assert abs(float(text) - value) <= 0.5 * 10.0 ** -max(decimals, style.decimals) + 2e-11
    assert not text.startswith("-0.") or float(text) != 0


@given(numbers)
def test_writing_the_number_itself_changes_nothing(original: Decimal):
    text = f"{original:f}"
    style = NumberStyle.of(text)
    assert style.write(float(text), style.decimals) == (text if float(text) else text.lstrip("-"))
