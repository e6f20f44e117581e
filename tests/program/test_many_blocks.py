"""Both lanes of the reader over many blocks: `NCFIX_MANY_BLOCKS=1000000` for a million of each dialect.

Shapes come back with other numbers all the time, as in real programs; each block is held against Lark alone.
"""

from __future__ import annotations

import os
from dataclasses import replace
from random import Random

import pytest

from conftest import use_form
from ncfix.text.dialect import get
from ncfix.text.reader import read, shapes_of
from ncfix.text.tree import Literal, Template, Word
from program.lanes import assert_read_right

MANY = int(os.environ.get("NCFIX_MANY_BLOCKS", "600"))
AT_ONCE, SHAPES = 600, 150
"""Blocks of a program, and how many kinds of them there are."""

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


def rs274(shape: Random, random: Random) -> str:
    """A block that every dialect of the RS274 family takes."""
    letters = shape.sample("XYZABC", shape.randint(1, 5))
    words = [letter + shape.choice(("", "", " ")) + number(random) for letter in letters]
    start = shape.choice(("", "", f"N{random.randint(1, 99999)} ", "/"))
    return start + shape.choice(("", " ")).join([shape.choice(CODES), *words]) + shape.choice(TAILS)


def sinumerik(shape: Random, random: Random) -> str:
    """A block of SINUMERIK: words with and without `=`, names with digits, parameters, functions, strings."""
    values = ("{}", "{}", "={}", "=AC({})", "=IC({})", "=R1+{}")
    others = ("A3={}", "R12={}", "CR={}", "I1=AC({})", "F{}", "S1={}")
    letters = shape.sample("XYZABC", shape.randint(1, 5))
    words = [letter + shape.choice(values).format(number(random)) for letter in letters]
    words += [shape.choice(others).format(number(random))] * (shape.random() < 0.3)
    start = shape.choice(("", "", f"N{random.randint(1, 99999)}", f"/{shape.randint(1, 7)}"))
    code = shape.choice(("G0", "G1", "g01", "G90 G1", "SUPA G0", "G641", "M3", ""))
    tail = shape.choice(("", "", "", ";move 12", "M8", 'MSG("AT 5")', "D1"))
    return " ".join(filter(None, (start, code, *words, tail)))


def klartext(shape: Random, random: Random) -> str:
    """A block of Klartext: straight motions, poles, normals, parameters, comments, points and commas."""
    tails = ("", "", "R0 F500", "R0 FMAX M3", "F MAX", "RL F 1200", "M99", "FQ58", " ; move 12.5", "M140 MB MAX")
    kind = shape.choice(("L", "L", "L", "L", "CC", "LN", ""))
    letters = sorted(shape.sample("XYZABC", 3))
    words = [shape.choice(("", "", "I")) + letter + signed(shape, random) for letter in letters]
    if kind in ("CC", "LN"):
        words = ["X" + signed(shape, random), "Y" + signed(shape, random)]
        words += ["Z" + signed(shape, random), "NX+0.6", "NY+0", "NZ" + signed(shape, random)] * (kind == "LN")
    tail = shape.choice(tails) if kind == "L" else ""
    return " ".join(filter(None, (f"{random.randint(1, 99999)}", kind, *words, tail)))


def signed(shape: Random, random: Random) -> str:
    """A number with a sign, now and then with a decimal comma, or a parameter."""
    if shape.random() < 0.05:
        return shape.choice(("+Q5", "-Q12"))
    text = f"{random.uniform(-400, 400):+.{random.randint(0, 5)}f}"
    return text.replace(".", random.choice((".", ".", ",")))


FAMILIES = {"iso": rs274, "linuxcnc": rs274, "fanuc": rs274, "siemens": sinumerik, "heidenhain": klartext}
FRAMES = {"heidenhain": ("0 BEGIN PGM MANY MM", "9 END PGM MANY MM")}


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("name", list(FAMILIES))
def test_many_blocks(name: str, compiled: bool) -> None:
    use_form(compiled)
    random, block = Random(11), FAMILIES[name]
    first, last = FRAMES.get(name, ("", ""))
    for _ in range(0, MANY, AT_ONCE):
        body = (block(Random(random.randrange(SHAPES)), random) for _ in range(AT_ONCE))
        text = "\n".join([first, *body, last, ""])
        program = read(text.encode(), "many.nc", name)
        assert_read_right(program)
        assert len(program.templates) <= AT_ONCE - SHAPES


def test_a_broken_template_is_caught() -> None:
    text = b"G1 X1.5 Y-2.25 F100.\n"
    dialect = get("linuxcnc")
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
