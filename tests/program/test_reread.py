"""A second reading that looks only at what was written anew finds what a reader finds in the whole text."""

from __future__ import annotations

import random
from collections.abc import Iterator

import numpy as np
import pytest

from ncfix import fast
from ncfix.program import dialects
from ncfix.program.parts import PartReader
from ncfix.program.reread import NotAsWrittenError, reread
from ncfix.program.tree import Program
from ncfix.program.writer import Edit, Splices, spliced

NUMBERS = ("1.5", "-0.25", "+3.75", "12", "-7", ".5", "-.125", "1234567.125", "0.", "-0.0", "123456789012.3456")
"""What may stand for a number; the last ones are for the whole reader."""
ADDED = (" A1.25", "C-3.5 ", "\nX1.5 Y2.5", "\nX1.5\nX2.5 B1.", " (NOTE 3)")


@pytest.fixture(autouse=True)
def _compiled(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    pytest.importorskip("numba", reason="the `fast` extra is not installed")
    monkeypatch.delenv("NCFIX_NO_FAST", raising=False)
    assert fast.engage()
    yield
    fast.disengage()


def reader(dialect: str) -> PartReader:
    """Of a part that is not the first."""
    made = PartReader("p.nc", dialects.get(dialect))
    made.first_line = 7
    return made


def lines(rng: random.Random, count: int) -> bytes:
    end = rng.choice(("\n", "\r\n"))
    words = (
        "G1 X{:.3f} Y{:.4f}",
        "N{0:.0f}0 G1 X{1:.4f} Z-{0:.3f} F100.",
        "X{:.4f}Y{:.2f} (AT 5)",
        "",
        "(NOTE {:.1f})",
    )
    return end.join(rng.choice(words).format(rng.random() * 90, rng.random()) for _ in range(count)).encode() + b"\n"


def edited(rng: random.Random, program: Program, odd: float, numbers: tuple[str, ...]) -> list[Edit]:
    """Numbers with a point replaced, and now and then something put in behind the last one of a block."""
    edits, last = [], set((program.first_number[1:] - 1).tolist())
    for number, (start, stop) in enumerate(program.number_spans.tolist()):
        if b"." in program.source[start:stop] and rng.random() < 0.5:
            edits.append(Edit(start, stop, rng.choice(numbers).encode()))
        if number in last and rng.random() < odd:
            edits.append(Edit(stop, stop, rng.choice(ADDED).encode()))
    return edits


def assert_alike(found: Program, expected: Program) -> None:
    assert found.source == expected.source
    assert [found.templates[k] for k in found.template] == [expected.templates[k] for k in expected.template]
    for name in ("blocks", "first_number", "number_spans", "numbers"):
        assert np.array_equal(getattr(found, name), getattr(expected, name)), name
    assert np.array_equal(np.signbit(found.numbers), np.signbit(expected.numbers))


@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc"])
@pytest.mark.parametrize("odd", [0.0, 0.02])
def test_as_the_whole_reader(dialect: str, odd: float) -> None:
    rng, quick = random.Random(3), 0
    for count in (1, 3, 40, 400, 400):
        own = reader(dialect)
        program = own.read(lines(rng, count))
        plain = tuple(f"{rng.uniform(-90, 90):.{digits}f}" for digits in (3, 4, 2, 3, 4))
        splices = Splices.joined([Splices.of(edited(rng, program, odd, plain))])
        text = spliced(program.source, splices)
        found = reread(own, program, splices, text)
        quick += found is not None
        if found is not None:
            assert_alike(found, reader(dialect).read(text))
    assert quick >= 3


def test_numbers_of_all_kinds() -> None:
    """Those that are not clearly numbers like the ones before are read with their blocks."""
    rng, quick = random.Random(4), 0
    for _ in range(60):
        own = reader("linuxcnc")
        program = own.read(lines(rng, 200))
        spans = [(a, b) for a, b in program.number_spans.tolist() if b"." in program.source[a:b]]
        edits = [Edit(a, b, rng.choice(NUMBERS).encode()) for a, b in sorted(rng.sample(spans, 6))]
        splices = Splices.of(edits)
        text = spliced(program.source, splices)
        found = reread(own, program, splices, text)
        quick += found is not None
        if found is not None:
            assert_alike(found, reader("linuxcnc").read(text))
    assert quick > 40


def test_every_byte_between_the_edits_counts() -> None:
    rng = random.Random(5)
    program = reader("linuxcnc").read(lines(rng, 60))
    splices = Splices.of(edited(rng, program, 0.0, ("1.250", "-2.500")))
    text = spliced(program.source, splices)
    assert reread(reader("linuxcnc"), program, splices, text) is not None
    stops = splices.stop + np.cumsum(splices.length - (splices.stop - splices.start))
    new = np.zeros(len(text), dtype=bool)
    for start, stop in zip((stops - splices.length).tolist(), stops.tolist(), strict=True):
        new[start:stop] = True
    for place in np.flatnonzero(~new).tolist():
        wrong = text[:place] + bytes([text[place] ^ 1]) + text[place + 1 :]
        with pytest.raises(NotAsWrittenError):
            reread(reader("linuxcnc"), program, splices, wrong)
    with pytest.raises(NotAsWrittenError):
        reread(reader("linuxcnc"), program, splices, text + b" ")


def test_a_wrong_digit_is_read_as_it_stands() -> None:
    rng = random.Random(6)
    program = reader("linuxcnc").read(lines(rng, 60))
    splices = Splices.of(edited(rng, program, 0.0, ("1.250", "-2.500")))
    text = spliced(program.source, splices)
    stops = splices.stop + np.cumsum(splices.length - (splices.stop - splices.start))
    for stop in stops.tolist():
        wrong = text[: stop - 1] + b"7" + text[stop:]
        found = reread(reader("linuxcnc"), program, splices, wrong)
        assert found is not None
        assert_alike(found, reader("linuxcnc").read(wrong))
