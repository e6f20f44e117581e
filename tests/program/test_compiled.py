"""The compiled scan finds what the plain one finds, to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import some
from ncfix import core
from ncfix.text.shapes import Scan, scan, split_blocks

pytestmark = pytest.mark.usefixtures("plain_form")

LINES = st.lists(
    st.one_of(
        st.text("XYZGMNF0123456789.+-# ()[];%/\t", max_size=25),
        st.from_regex(r"\A(N[0-9]{1,3} )?G1( [XYZ]-?[0-9]{1,3}\.?[0-9]{0,5}){1,3}( ?\([A-Z 0-9]{0,5}\))?\Z"),
        st.sampled_from(["X1.2.3", "X.", "X12345678901234567890.5", "\x01", "G01.5X-  .5", "(a(b) 5", "X1;tail 7", ""]),
    ),
    min_size=1,
    max_size=20,
)


def both(source: bytes, pointless: bool) -> list[Scan]:
    blocks, found = split_blocks(source), []
    for compiled in (False, True):
        core.use("compiled" if compiled else "plain")
        found.append(scan(source, blocks, pointless=pointless).expanded())
    return found


def assert_same(source: bytes, pointless: bool = False) -> None:
    plain, compiled = both(source, pointless)
    assert plain.shapes == compiled.shapes
    for name in ("comment", "first_number", "spans"):
        assert np.array_equal(getattr(plain, name), getattr(compiled, name)), name
    assert np.array_equal(plain.values, compiled.values, equal_nan=True)
    assert np.array_equal(np.signbit(plain.values), np.signbit(compiled.values))


@settings(derandomize=True, deadline=None, max_examples=some(200))
@given(LINES, st.sampled_from(["\n", "\r\n"]), st.booleans())
def test_generated_texts(lines: list[str], end: str, pointless: bool) -> None:
    source = end.join([*lines, "M2", ""]).encode("latin-1")
    assert_same(source, pointless)


@settings(derandomize=True, deadline=None, max_examples=some(300))
@given(
    st.from_regex(r"\A(N[0-9]{1,3} )?G1( ?[XYZ] ?-?[0-9]{1,3}(\.[0-9]{0,5})?){1,3}( ?-5)?( ?\([A-Z 0-9]{0,5}\))?\Z"),
    st.lists(st.tuples(st.integers(0, 40), st.integers(0, 2), st.sampled_from("GX0123456789..+-- ()[;\x01"))),
    st.booleans(),
)
def test_blocks_like_the_ones_before(line: str, changes: list[tuple[int, int, str]], pointless: bool) -> None:
    lines = [line]
    for place, removed, added in changes:
        lines += [line, line[:place] + added + line[place + removed :]]
    assert_same("\n".join([*lines, line, "M2", ""]).encode("latin-1"), pointless)


def test_the_corpus(shared: Callable[[str], Path]) -> None:
    texts = [path.read_bytes() for path in sorted(shared("corpus").glob("*/*"))[::3]]
    texts = [source for source in texts if source.strip() and len(source) < 200_000]
    assert len(texts) > 100
    for source in texts:
        assert_same(source)


def test_shapes_that_begin_alike_are_told_apart() -> None:
    lines = [
        head + tail for head in ("G1 X", "G1 X1 Y", "G1", "G1 X-", "G1 X+ ") for tail in ("", "2", " Z3", "-4.", "#")
    ]
    assert_same("\n".join([*lines, *lines[::-1], *lines, "M2", ""]).encode("latin-1"))


@pytest.mark.parametrize("line", [lambda k: "X1Y2Z3", lambda k: f"X1 (row {k:x} of many) Y2"])
def test_many_numbers_or_shapes_for_the_length_of_the_text(line: Callable[[int], str]) -> None:
    assert_same("\n".join([*map(line, range(4000)), "M2", ""]).encode("latin-1"))
