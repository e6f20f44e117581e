"""Numbers are found where they are, and converted as Python converts them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ncfix.text.numbers import NUMERIC, find_numbers, table
from ncfix.text.shapes import FIXED

DECIMALS = st.from_regex(r"[0-9]{1,25}\.?[0-9]{0,25}|\.[0-9]{1,25}", fullmatch=True)


def numbers(text: bytes) -> list[tuple[str, float]]:
    """The numbers of a text, as written and as converted."""
    characters = np.frombuffer(text, dtype=np.uint8)
    found = find_numbers(characters, NUMERIC[characters], FIXED)
    return [(text[start:stop].decode(), value) for (start, stop), value in zip(found.spans, found.values, strict=True)]


@given(st.lists(st.tuples(st.sampled_from(["", "+", "-"]), DECIMALS), max_size=5))
def test_values_are_exactly_those_of_python(written: list[tuple[str, str]]) -> None:
    text = "X".join(["", *(sign + digits for sign, digits in written)])
    assert numbers(text.encode()) == [(sign + digits, float(sign + digits)) for sign, digits in written]


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
