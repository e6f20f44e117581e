"""Lines that are scanned by an example are scanned as any text is, to the last bit."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest

from ncfix.text import shapes
from ncfix.text.shapes import Scan, scan_any, split_blocks, with_others
from ncfix.text.uniform_lines import FEWEST, LINE, SHARE, Example, find_uniform_lines

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

    lines = [other() if random.random() < others else usual() for _ in range(2 * FEWEST)]
    lines[FEWEST] = usual()
    return "".join(each + random.choice(("\n", "\n", "\r\n")) for each in lines).encode("latin-1")


def assert_same(found: Scan, meant: Scan) -> None:
    found, meant = found.expanded(), meant.expanded()
    assert found.shapes == meant.shapes
    for name in ("comment", "first_number", "spans"):
        assert np.array_equal(getattr(found, name), getattr(meant, name)), name
    assert np.array_equal(found.values, meant.values, equal_nan=True)
    assert np.array_equal(np.signbit(found.values), np.signbit(meant.values))


@pytest.mark.parametrize("pointless", [False, True])
@pytest.mark.parametrize("others", [0.0, 0.02, 0.3])
@pytest.mark.parametrize("line", USUAL)
def test_lines_by_an_example_are_scanned_as_any_text(line: str, others: float, pointless: bool) -> None:
    random = Random(line + str(others))
    for numbers in (NUMBERS, NUMBERS[:2], NUMBERS[:6], ("5.0625",), ("-17", "4")):
        source = text_of(random, line, numbers, others)
        blocks = split_blocks(source)
        same = find_uniform_lines(source, blocks, pointless=pointless)
        if same is not None:
            assert_same(with_others(source, blocks, pointless, same), scan_any(source, blocks, pointless))
        assert same is not None or (pointless and len(numbers) > SHARE)


@pytest.mark.parametrize(
    "line", [b"G-1 X5", b"X1 (2)", b"/X1", b"X", b"", b"N+5 X1", b"G 1 X1", b"X[1]", b"#1=2", b"O100 X"]
)
def test_what_is_no_example(line: bytes) -> None:
    assert not LINE.fullmatch(line)
    assert Example.of(line) is None


def test_what_an_example_says() -> None:
    example = Example.of(b"N10 G01.1X-5. Y7 F.25")
    assert example is not None
    assert example.gaps == [b"N", b" G01.1X", b" Y", b" F", b""]
    assert (example.runs, example.count, example.tails) == ([0, 2, 3, 4], 5, [0, 1, 0, 3])
    assert example.key(b"\1", b"\3") == b"N\3 G01.1X\1 Y\3 F\1"


def test_a_text_in_slices_is_scanned_as_in_one(monkeypatch: pytest.MonkeyPatch) -> None:
    source = text_of(Random(1), USUAL[0], NUMBERS, 0.3)
    blocks = split_blocks(source)
    whole = scan_any(source, blocks, pointless=False)
    for size in (100, 1000, len(source)):
        monkeypatch.setattr(shapes, "SLICE_BYTES", size)
        assert_same(shapes.in_slices(source, blocks, lambda *part: scan_any(*part, pointless=False)), whole)
