"""Both lanes of the reader over many blocks: `NCFIX_MANY_BLOCKS=1000000` for a million of each dialect.

Shapes come back with other numbers all the time, as in real programs; each block is held against Lark alone.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from random import Random

import pytest

from ncfix import fast
from ncfix.program import dialects
from ncfix.program.reader import read
from ncfix.program.templates import shapes_of
from ncfix.program.tree import Literal, Template, Word
from program.lanes import assert_read_right

MANY = int(os.environ.get("NCFIX_MANY_BLOCKS", "600"))
AT_ONCE = 600

CODES = ("G0", "G1", "g01", "G2", "G90 G1", "M3", "G4", "G53 G0", "")
TAILS = ("", "", "", "(move 12)", " (a) (b 3)", ";tail 4.5", "F100.", " F 1 200", "M8")


def number(random: Random) -> str:
    """A number as somebody might write it."""
    digits = random.choice(
        (f"{random.uniform(-400, 400):.{random.randint(0, 5)}f}", str(random.randint(-9, 999)), ".5")
    )
    return (
        random.choice(("", "", "", "+")) * (digits[0] != "-")
        + digits
        + random.choice(("", "", ".")) * ("." not in digits)
    )


def blocks(random: Random) -> Iterator[str]:
    """Blocks that every dialect of the RS274 family takes."""
    while True:
        words = [
            letter + random.choice(("", "", " ")) + number(random)
            for letter in random.sample("XYZABC", random.randint(1, 5))
        ]
        start = random.choice(("", "", f"N{random.randint(1, 99999)} ", "/"))
        text = start + random.choice(("", " ")).join([random.choice(CODES), *words]) + random.choice(TAILS)
        yield text


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("name", ["iso", "linuxcnc", "fanuc"])
def test_many_blocks(name: str, compiled: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if compiled:
        pytest.importorskip("numba", reason="the `fast` extra is not installed")
        monkeypatch.delenv("NCFIX_NO_FAST", raising=False)
        assert fast.engage()
    random = Random(11)
    source = blocks(random)
    try:
        for _ in range(0, MANY, AT_ONCE):
            text = "\n".join(next(source) for _ in range(AT_ONCE)) + "\n"
            assert_read_right(read(text.encode(), "many.nc", name))
    finally:
        fast.disengage()


def test_a_broken_template_is_caught() -> None:
    text = b"G1 X1.5 Y-2.25 F100.\n"
    dialect = dialects.get("linuxcnc")
    program = read(text, "broken.nc", dialect)
    (shape,) = {key for key in (b"G1 X\x01 Y\x01 F\x01",) if shapes_of(dialect).recall(key) is not None}
    good = program.templates[int(program.template[0])]
    shapes_of(dialect).keep(shape, with_exchanged_slots(good))
    try:
        with pytest.raises(AssertionError):
            assert_read_right(read(text, "broken.nc", dialect))
    finally:
        shapes_of(dialect).keep(shape, good)
    assert_read_right(read(text, "broken.nc", dialect))


def with_exchanged_slots(template: Template) -> Template:
    """The template with the numbers of X and Y exchanged."""
    values = {"X": template.slots["Y"], "Y": template.slots["X"]}
    items = tuple(
        replace(item, value=Literal(values[item.address]))
        if isinstance(item, Word) and item.address in values
        else item
        for item in template.items
    )
    return Template(items, template.n_numbers)
