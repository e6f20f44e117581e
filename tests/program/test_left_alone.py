"""What stands between the edits of a text is compared with the text that it was made from."""

from __future__ import annotations

import random

import numpy as np
import pytest

from conftest import require_core
from ncfix import core
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
