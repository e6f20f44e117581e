"""Klartext motions written many at a time come out, byte for byte, as the renderer writes them one by one."""

from __future__ import annotations

from dataclasses import replace
from random import Random
from unittest import mock

import numpy as np
import pytest

from conftest import some
from ncfix.control.moves import MotionKind, Moves
from ncfix.control.setup import Setup
from ncfix.control.trace import trace
from ncfix.text.dialect import get
from ncfix.text.reader import read
from ncfix.text.tree import Program
from ncfix.writer import bulk, emit
from ncfix_heidenhain.klartext.language import in_bulk
from program.arcs import full_of_klartext_arcs
from program.klartext.tnc import KNOWN, program
from program.test_bulk import AXES, ROTARY, STEPS, assert_same, moved

OTHERS = (
    "; remark 12",
    "* - part 3",
    "L IX+1 Y-.5 F100",
    "L X+Q1 Y+2",
    "RND R0.5",
    "CHF 1",
    "L M5",
    "CC X+0 Y+0",
    "CC X+10 Y+10\nC X+12 Y+10 DR+",
    "M128",
    "M129",
    "L X+5 Y+5 R0 FMAX M30",
    "LN X+1 Y+1 Z+1 NX+0 NY+0 NZ+1 TX+0 TY+0 TZ+1",
    "Q1 = 3",
    "PLANE SPATIAL SPA+0 SPB+20 SPC+0 STAY\nPLANE RESET STAY",
    "/ L X+3",
)
ODD_NUMBERS = ("0", "+0.0", "-.25", ".5", "007.5", "-012", "+5.00000", "+ 2.5", "359.9999", "+360", "-0.0")
DWELL = "CYCL DEF 9.0\nCYCL DEF 9.1 V.ZEIT 0.5"
MANY = some(24)
"""Programs of each kind."""


def number(random: Random, comma: bool) -> str:
    """A number as somebody might write it."""
    text = random.choice(
        (
            f"{random.uniform(-400, 400):+.{random.randint(0, 5)}f}",
            f"{random.randint(-400, 400) / 8:+g}",
            f"{random.randint(-4, 4):+d}",
            random.choice(ODD_NUMBERS),
        )
    )
    return text.replace(".", ",") if comma != (random.random() < 0.02) else text


def motion(random: Random, comma: bool) -> str:
    """A straight motion."""
    letters = [letter for letter in AXES if random.random() < 0.6] or ["X"]
    words = [letter + number(random, comma) for letter in letters]
    function = random.choice(("L", "L", "L", "", "LN", "l"))
    normal = ["NX+0.6 NY+0 NZ+0.8"] if function == "LN" else []
    tail = random.choice(("", "", "F500", "FMAX", "R0 FMAX", "R0 F100 M3", "FMAX M9", "RL"))
    block = random.choice(("", f"{random.randint(1, 99999)} ", f" {random.randint(1, 99)}  "))
    blank = random.choice((" ", " ", " ", "\t", "  "))
    return block + blank.join(filter(None, (function, *words, *normal, tail))) + random.choice(("", "", " ; more 1.5"))


def generated(seed: int, comma: bool, odd: float) -> bytes:
    """A program of such motions, with other things in between."""
    random = Random(seed)
    blocks = [random.choice(OTHERS) if random.random() < odd else motion(random, comma) for _ in range(40)]
    source = program("\n".join(["TOOL CALL 1 Z S1000", "L X+0 Y+0 Z+0 B+0 C+0 R0 FMAX", *blocks]))
    return source.replace(b"\n", b"\r\n") if seed % 4 == 0 else source


def followed(source: bytes, numbers: str, setup: Setup = KNOWN) -> tuple[Program, Moves]:
    dialect = replace(get("heidenhain"), block_numbers=numbers)
    found = read(source, "generated.h", dialect)
    return found, trace(found, setup, AXES, ROTARY).moves


@pytest.mark.parametrize("odd", [0.0, 0.1])
@pytest.mark.parametrize("comma", [False, True])
def test_many_at_a_time_as_one_by_one(comma: bool, odd: float) -> None:
    for seed in range(MANY):
        found, moves = followed(generated(seed, comma, odd), ("same", "none")[seed % 2])
        assert_same(found, moves, moved(moves, seed, (0.0, 0.0003, 0.01, 0.7)[seed % 4]))


@pytest.mark.parametrize("size", [0.0, 0.0003, 0.01, 0.7])
@pytest.mark.parametrize("comma", [False, True])
def test_arcs_among_many_at_a_time_as_one_by_one(comma: bool, size: float) -> None:
    for seed in range(MANY):
        random, blocks = Random(seed), full_of_klartext_arcs(seed, 40, comma=comma)
        for place, block in enumerate(blocks):
            if "CC" not in block and random.random() < 0.1 * (seed % 3):
                blocks[place] = random.choice([motion(random, comma), DWELL, *OTHERS[:-1]])
        source = program("\n".join(["TOOL CALL 1 Z S1000", "L X+0 Y+0 Z+0 B+0 C+0 R0 F1000", *blocks]))
        found, moves = followed(source, ("same", "none")[seed % 2])
        pieces = moved(moves, seed, size)
        arcs = (moves.kind == MotionKind.ARC)[pieces.move] & (np.arange(len(pieces)) % 3 > 0)
        assert_same(found, moves, replace(pieces, arc=pieces.arc | arcs))


def test_motions_between_arcs_are_written_at_once() -> None:
    arcs = (f"L X{n} Y0 Z{n % 3}\nCR X{n + 3} Y4 R+9 DR-\nCC X{n} Y0\nC X{n} Y5 DR+" for n in range(1, 60))
    found, moves = followed(program("\n".join(["L X+0 Y+0 Z+0 B+0 C+0 R0 F1000", *arcs])), "same")
    with mock.patch.object(emit._Emitter, "_write", autospec=True, side_effect=emit._Emitter._write) as one_by_one:
        emit.emit(found, moves, moved(moves, 3, 0.0003), STEPS)
    assert {MotionKind(moves.kind[call.args[1]]) for call in one_by_one.call_args_list[1:]} == {MotionKind.ARC}


def test_most_are_written_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    taken, take = [], bulk.Bulk.take

    def noting(self: bulk.Bulk, *given: object) -> bulk.FloatArray | None:
        found = take(self, *given)  # type: ignore[arg-type]
        taken.append(0 if found is None else len(found))
        return found

    monkeypatch.setattr(bulk.Bulk, "take", noting)
    source = program("\n".join(f"{n} L X{n / 7:+.4f} Y{n / 9:+.4f} Z+1.5 B+0.25 C+0.5 F500" for n in range(1, 200)))
    found, moves = followed(source, "same")
    assert_same(found, moves, moved(moves, 3, 0.01))
    assert sum(taken) > 300


@pytest.mark.parametrize(
    "block",
    [
        "L IX+1",
        "LP PR+1 PA+2",
        "L X+Q1",
        "CR X+1 R+5 DR+",
        "CP IPA+5 DR+",
        "CT X+1 Y+1",
        "/ L X+1",
        "L X+1  Y+1",
        "LN X+1 TX+0 TY+0 TZ+1",
        "L R0",
    ],
)
def test_what_needs_the_renderer(block: str) -> None:
    assert in_bulk(read(program(block), "t.h", "heidenhain"), 1) is None


def test_numbers_of_further_pieces() -> None:
    for numbers, expected in (("same", b"\n12 L X"), ("none", b"\nL X")):
        found, moves = followed(program("12 L X+10 Y+20 Z+3 F500"), numbers)
        pieces = moved(moves, 1, 0.0)
        pieces = replace(
            pieces,
            move=np.array([0, 0]),
            fraction=np.array([0.5, 1.0]),
            end=np.vstack((moves.end / 2, moves.end)),
            arc=np.zeros(2, dtype=bool),
            centre=np.repeat(pieces.centre[:1], 2, axis=0),
            unchanged=np.zeros(2, dtype=bool),
        )
        assert_same(found, moves, pieces)
        from program.test_bulk import in_all_ways, spliced

        for each in in_all_ways(found, moves, pieces):
            assert expected in spliced(found.source, each.splices)
