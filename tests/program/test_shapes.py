"""The different shapes of a text's blocks, found many characters at a time: as when its lines are looked at in turn."""

from __future__ import annotations

import numpy as np
import pytest

from ncfix.text.shapes import KINDS, LONG, distinct


def lines(rng: np.random.Generator, kinds: int, longest: int, n: int) -> list[bytes]:
    """Lines of a few kinds, which differ in one place only as often as not."""
    known = [bytes(rng.integers(65, 67, int(size)).astype(np.uint8)) for size in rng.integers(0, longest, kinds)]
    return [known[k] for k in rng.integers(0, kinds, n)]


@pytest.mark.parametrize("kinds", [1, 3, KINDS, 5 * KINDS])
@pytest.mark.parametrize("longest", [1, 7, 9, LONG - 1, LONG + 2, 3 * LONG])
def test_each_line_is_its_kind(kinds: int, longest: int) -> None:
    given = lines(np.random.default_rng(kinds), kinds, longest, 500)
    shapes, group = distinct(b"".join(line + b"\n" for line in given))
    assert [shapes[k] for k in group.tolist()] == given
    assert set(group.tolist()) == set(range(len(shapes)))
    if kinds <= KINDS and longest <= LONG + 1:
        assert len(shapes) == len(set(given))


def test_one_empty_line() -> None:
    shapes, group = distinct(b"\n")
    assert (shapes, group.tolist()) == ([b""], [0])
