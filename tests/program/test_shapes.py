"""The different shapes of a text's blocks, found many characters at a time: as when its lines are looked at in turn."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest

from ncfix.text import shapes
from ncfix.text.shapes import KINDS, MAX_KEY_BYTES, Scan, distinct, scan_any, split_blocks


def lines(rng: np.random.Generator, kinds: int, longest: int, n: int) -> list[bytes]:
    """Lines of a few kinds, which differ in one place only as often as not."""
    known = [bytes(rng.integers(65, 67, int(size)).astype(np.uint8)) for size in rng.integers(0, longest, kinds)]
    return [known[k] for k in rng.integers(0, kinds, n)]


@pytest.mark.parametrize("kinds", [1, 3, KINDS, 5 * KINDS])
@pytest.mark.parametrize("longest", [1, 7, 9, MAX_KEY_BYTES - 1, MAX_KEY_BYTES + 2, 3 * MAX_KEY_BYTES])
def test_each_line_is_its_kind(kinds: int, longest: int) -> None:
    given = lines(np.random.default_rng(kinds), kinds, longest, 500)
    shapes, group = distinct(b"".join(line + b"\n" for line in given))
    assert [shapes[k] for k in group.tolist()] == given
    assert set(group.tolist()) == set(range(len(shapes)))
    if kinds <= KINDS and longest <= MAX_KEY_BYTES + 1:
        assert len(shapes) == len(set(given))


def test_one_empty_line() -> None:
    shapes, group = distinct(b"\n")
    assert (shapes, group.tolist()) == ([b""], [0])


USUAL = ("N{n} G1 X{x} Y{y} Z{z} F{f}", "G01X{x}Y{y}Z{z}", "n{n} g1 x{x}\ty{y}", "T{n} M6", "X{x} E{n} D{y}")
NUMBERS = ("1.2345", "-0.0000", "+7.5", "123.4567", "-1234.5678", "0.0001", "98765.4321", "12.", "-3", ".5", "007.10")
RARE = (
    "X1.2.3",
    "N-5 G1 X1",
    "X",
    "G-1 X5.0",
    "X - 5.0",
    "X+-5",
    "(N1 G1 X2)",
    "X1.5 ; 7",
    "",
    "X.",
    "X12345678901234567.5",
    "\x01",
)
DAMAGES = (
    (" G1", " G2"),
    ("X", "X "),
    ("X", "X-"),
    ("Y", "Y("),
    ("Z", "/Z"),
    (".", ".."),
    (" ", "  "),
    ("N", "N+"),
    (".", ""),
)


def text_of(random: Random, line: str, numbers: tuple[str, ...], others: float) -> bytes:
    """Lines like one, with these numbers, and some that are not."""

    def usual() -> str:
        x, y, z, f = random.choices(numbers, k=4)
        return line.format(n=random.randrange(10**6), x=x, y=y, z=z, f=f)

    def other() -> str:
        return random.choice((random.choice(RARE), usual().replace(*random.choice(DAMAGES))))

    lines = [other() if random.random() < others else usual() for _ in range(512)]
    lines[256] = usual()
    return "".join(each + random.choice(("\n", "\n", "\r\n")) for each in lines).encode("latin-1")


def assert_same(found: Scan, meant: Scan) -> None:
    found, meant = found.expanded(), meant.expanded()
    assert found.shapes == meant.shapes
    for name in ("comment", "first_number", "spans"):
        assert np.array_equal(getattr(found, name), getattr(meant, name)), name
    assert np.array_equal(found.values, meant.values, equal_nan=True)
    assert np.array_equal(np.signbit(found.values), np.signbit(meant.values))


def test_a_text_in_slices_is_scanned_as_in_one(monkeypatch: pytest.MonkeyPatch) -> None:
    source = text_of(Random(1), USUAL[0], NUMBERS, 0.3)
    blocks = split_blocks(source)
    whole = scan_any(source, blocks, pointless=False)
    for size in (100, 1000, len(source)):
        monkeypatch.setattr(shapes, "SLICE_BYTES", size)
        assert_same(shapes.in_slices(source, blocks, lambda *part: scan_any(*part, pointless=False)), whole)
