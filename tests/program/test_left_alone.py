"""What stands between the edits of a text is compared with the text that it was made from."""

from __future__ import annotations

import random

import numpy as np
import pytest

from conftest import require_core
from ncfix import core
from ncfix.core import edits
from ncfix.text.writer import Edit, Splices, left_alone, spliced

SOURCE = b"".join(b"N%d G1 X%.3f Y-%.4f (AT %d)\n" % (10 * k, 1.5 * k, 0.25 * k, k) for k in range(40))


@pytest.fixture(autouse=True)
def _compiled() -> None:
    require_core()
    core.use("compiled")


def edited(seed: int) -> Splices:
    """Some bytes replaced, some put in, some left out."""
    rng = random.Random(seed)
    places = sorted(rng.sample(range(len(SOURCE)), 60))
    pairs = zip(places[::2], places[1::2], strict=True)
    return Splices.of([Edit(a, rng.choice((a, min(a + 5, b))), b"7" * rng.randrange(9)) for a, b in pairs])


@pytest.mark.parametrize("seed", range(3))
def test_every_byte_between_the_edits_counts(seed: int) -> None:
    splices = edited(seed)
    text = spliced(SOURCE, splices)
    assert left_alone(SOURCE, splices, text)
    stops = splices.stop + np.cumsum(splices.length - (splices.stop - splices.start))
    new = np.zeros(len(text), dtype=bool)
    for start, stop in zip((stops - splices.length).tolist(), stops.tolist(), strict=True):
        new[start:stop] = True
    for place in range(len(text)):
        wrong = text[:place] + bytes([text[place] ^ 1]) + text[place + 1 :]
        assert left_alone(SOURCE, splices, wrong) == new[place]


def test_a_text_of_another_length_is_another() -> None:
    splices = edited(5)
    text = spliced(SOURCE, splices)
    assert not left_alone(SOURCE, splices, text + b" ")
    assert not left_alone(SOURCE, splices, text[:-1])


@pytest.mark.parametrize("compiled", [False, True])
def test_edits_that_do_not_go_together_are_refused(compiled: bool) -> None:
    """Behind the checks the compiled loops look at no index."""
    form = edits if compiled else core.interpreted("edits")
    text, data = (np.frombuffer(each, dtype=np.uint8) for each in (b"abcdef", b"xy"))
    one, two, out = np.array([1]), np.array([2, 3]), np.empty(7, dtype=np.uint8)
    form.spliced(text, one, one + 1, one + 1, data, out)
    assert out.tobytes() == b"axycdef"
    for start, stop, length, room in (
        (two, one + 1, one, 8),
        (one, two, one, 8),
        (two, two, one, 8),
        (one, one + 1, one + 1, 6),
        (one, one + 1, one + 1, 8),
        (one, one + 1, one + 2, 8),
        (one, one - 1, one, 8),
        (one - 2, one, one, 8),
        (one, one + 6, one, 8),
        (np.array([3, 1]), np.array([4, 2]), np.array([1, 1]), 6),
    ):
        with pytest.raises(IndexError):
            form.spliced(text, start, stop, length, data, np.empty(room, dtype=np.uint8))
    with pytest.raises(IndexError):
        form.left_alone(text, out, two, one, one)
