"""Edits: replacements and insertions, and nothing else changes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ncfix.text.writer import Edit, apply


def test_replace_insert_remove() -> None:
    edits = [Edit(0, 0, b"("), Edit(0, 2, b"G1"), Edit(4, 5, b"22"), Edit(5, 5, b" Y3"), Edit(5, 6, b"")]
    assert apply(b"G0 X1\n", edits) == b"(G1 X22 Y3"


@given(st.binary(), st.lists(st.tuples(st.integers(0, 20), st.integers(0, 5), st.binary(max_size=3))))
def test_what_lies_between_edits_is_kept(source: bytes, gaps: list[tuple[int, int, bytes]]) -> None:
    edits, kept, at = [], [], 0
    for gap, length, text in gaps:
        start = min(at + gap, len(source))
        stop = min(start + length, len(source))
        kept += [source[at:start], text]
        edits.append(Edit(start, stop, text))
        at = stop
    assert apply(source, edits) == b"".join(kept) + source[at:]


@pytest.mark.parametrize("edits", [[Edit(2, 4, b""), Edit(3, 5, b"")], [Edit(5, 7, b"")], [Edit(3, 2, b"")]])
def test_edits_that_cannot_be_made_are_a_fault_of_the_caller(edits: list[Edit]) -> None:
    with pytest.raises(ValueError, match="overlaps"):
        apply(b"G0 X1\n", edits)
