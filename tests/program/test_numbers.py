"""Numbers are found where they are, and converted as Python converts them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ncfix.text.numbers import NUMERIC, find_numbers, table
from ncfix.text.shapes import FIXED


def with_point(digits: str, at: int) -> str:
    """The digits with a point before the one at `at`; without one if there are fewer."""
    return digits if at > len(digits) else f"{digits[:at]}.{digits[at:]}"


LONG = st.integers(0, 10**30).map(str)
DIGITS = st.one_of(LONG, st.integers(0, 10**9).map(str), st.builds(str.zfill, LONG, st.integers(1, 30)))
DECIMALS = st.builds(with_point, DIGITS, st.integers(0, 40))


def numbers(text: bytes) -> list[tuple[str, float]]:
    """The numbers of a text, as written and as converted."""
    characters = np.frombuffer(text, dtype=np.uint8)
    found = find_numbers(characters, NUMERIC[characters], FIXED)
    return [(text[start:stop].decode(), value) for (start, stop), value in zip(found.spans, found.values, strict=True)]


@given(st.lists(st.tuples(st.sampled_from(["", "+", "-"]), DECIMALS), max_size=5))
def test_values_are_exactly_those_of_python(written: list[tuple[str, str]]) -> None:
    text = "X".join(["", *(sign + digits for sign, digits in written)])
    assert numbers(text.encode()) == [(sign + digits, float(sign + digits)) for sign, digits in written]


@pytest.mark.parametrize("digits", range(13, 19))
def test_as_many_digits_as_a_double_holds_and_more_are_rounded_once(digits: int) -> None:
    """Sixteen digits are more than a double holds: the whole number, and its quotient, would each be rounded."""
    rng = np.random.default_rng(digits)
    wholes = map(str, rng.integers(10 ** (digits - 1), 10**digits, 500).tolist())
    written = list(map(with_point, wholes, rng.integers(0, digits, 500).tolist()))
    assert numbers("X".join(["", *written]).encode()) == [(each, float(each)) for each in written]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (b"X1Y-2Z+.5", ["1", "-2", "+.5"]),
        (b"X - 1", ["- 1"]),
        (b"[#1-2]", ["1", "2"]),
        (b"[#1 - 2]", ["1", "2"]),
        (b"[#1--2]", ["1", "-2"]),
        (b"[#<a>-2]", ["2"]),
        (b"[[1]-2]", ["1", "2"]),
        (b"G1 G 2 M3 o100 X4", ["4"]),
        (b"N-5", ["5"]),
        (b"-1", ["-1"]),
        (b"1", ["1"]),
        (b"", []),
    ],
)
def test_a_sign_belongs_to_the_number_unless_it_is_an_operator(text: bytes, expected: list[str]) -> None:
    assert [written for written, _ in numbers(text)] == expected


@pytest.mark.parametrize("text", [b"1.2.3", b"..", b".", b"9" * 400, b".2345678.2345678", b"1..2345678"])
def test_what_is_no_number_is_marked(text: bytes) -> None:
    characters = np.frombuffer(text, dtype=np.uint8)
    assert find_numbers(characters, NUMERIC[characters], table(b"")).broken.tolist() == [True]
