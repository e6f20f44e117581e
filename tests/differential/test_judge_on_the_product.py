"""Real corrected programs, damaged: whatever is done to one of their numbers or blocks, the judge sees it."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from differential import product, setups
from differential.canon import Canon, Controls
from differential.errors import Machine
from differential.judge import Terms, Verdict, judge

SOURCE = b"""\
G21 G90 G17 G94 G54
M3 S800
G0 X10 Y5 Z20
G1 Z-1.25 F300
X60 Y12
G2 X70 Y22 I10 J0
G3 X90 Y2 I0 J-20
G1 X90 Y-140 (down)
G91
X-31.007 Y3.125 Z-2
X0.5
Y0.5
G90
G4 P.2
G2 X29.493 Y-136.375 I-15 J0
G0 Z30
M2
"""
WORD = re.compile(rb"([XYZIJ])(-?\d+\.\d+)")


@pytest.fixture
def corrected(machine_file: Callable[[str], Path], tmp_path: Path) -> bytes:
    setup = setups.write(tmp_path, Controls(), "XYZ")
    outcome = product.fix_text(SOURCE, machine_file("three"), tmp_path, "--setup", setup, "--tolerance-um", "0.5")
    assert outcome.text is not None, outcome.errors
    return outcome.text  # of twice as many blocks as the judge would be content with


@pytest.fixture
def verdict(rs274: Callable[..., Canon], machine: Callable[[str], Machine]) -> Callable[[bytes], Verdict]:
    original, model = rs274(SOURCE), machine("three")
    return lambda text: judge(original, rs274(text), model, Terms(tolerance=1e-3))


def test_as_it_is_it_is_right(corrected: bytes, verdict: Callable[[bytes], Verdict]) -> None:
    found = verdict(corrected)
    assert found.right, str(found)


def test_every_number_matters(corrected: bytes, verdict: Callable[[bytes], Verdict]) -> None:
    rng = random.Random(3)
    unseen = []
    way = slice(
        corrected.index(b"(down)"), corrected.index(b"G91\n")
    )  # along Y: a point on the way may be anywhere on it
    words = [
        word for word in WORD.finditer(corrected) if not (word[1] == b"Y" and way.start - 30 < word.start() < way.stop)
    ]
    for word in rng.sample(words, 20):
        value = float(word[2]) + rng.choice((-1, 1)) * rng.choice((0.05, 0.3, 5.0))
        changed = corrected[: word.start(2)] + f"{value:.3f}".encode() + corrected[word.end(2) :]
        if verdict(changed).right:
            unseen.append((word[0], value))
    assert not unseen


def test_lost_blocks_are_seen(corrected: bytes, verdict: Callable[[bytes], Verdict]) -> None:
    lines, lost = corrected.splitlines(keepends=True), 8  # one piece of a finely cut arc may go within the tolerance
    unseen = []
    for n in random.Random(5).sample(range(1, len(lines) - lost - 1), 20):
        if verdict(b"".join(lines[:n] + lines[n + lost :])).right:
            unseen.append(lines[n : n + lost])
    assert not unseen


def test_swapped_blocks_are_seen(corrected: bytes, verdict: Callable[[bytes], Verdict]) -> None:
    lines = corrected.splitlines(keepends=True)
    unseen = []
    for n in random.Random(7).sample(range(1, len(lines) - 2), 15):
        swapped = [*lines[:n], lines[n + 1], lines[n], *lines[n + 2 :]]
        if verdict(b"".join(swapped)).right:
            unseen.append(lines[n : n + 2])
    assert len(unseen) <= 2, unseen
