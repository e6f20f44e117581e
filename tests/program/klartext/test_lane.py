"""The fast lane of Klartext and the interpreter, block by block, give the same motions, to the last bit."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from random import Random

import numpy as np
import pytest

from conftest import some
from ncfix import core
from ncfix.control.builder import Circles
from ncfix.control.moves import Moves
from ncfix.control.setup import Setup
from ncfix.diagnostics import NcfixError
from ncfix_heidenhain.klartext import lane
from ncfix_heidenhain.klartext.control import KlartextControl
from ncfix_heidenhain.klartext.units import KlartextUnit
from program.arcs import full_of_klartext_arcs
from program.klartext.tnc import KNOWN, follow

ALWAYS, NEVER, COMPILED = 1, 10**9, -1
MANY = some(30)
"""Programs of each kind."""

OTHERS = (
    "L R0 FMAX",
    "L F500",
    "M3",
    "; a comment",
    "* - a part",
    "",
    "M126",
    "M127",
    "M128",
    "M129",
    "M136",
    "L M140 MB+5",
    "M89",
    "M99",
    "M91",
    "L X+1 M91",
    "L IX+1 Y+2",
    "L X+Q1 Y+2",
    "Q1 = 3.5",
    "RND R2",
    "CHF 1",
    "CC X+0 Y+0",
    "LP PR+5 PA+30",
    "CR X+1 Y+1 R+99 DR+",
    "APPR LT X+1 Y+1 LEN 5 RL",
    "DEP LT LEN 5",
    "LN X+1 Y+1 Z+1 NX+0 NY+0 NZ+1",
    "TOOL CALL 2 Z S500 F300",
    "L X+1 FAUTO",
    "L Y+1 FU 0.2",
    "CYCL DEF 7.0 DATUM\nCYCL DEF 7.1 X+5",
    "CYCL DEF 10.1 ROT+30",
    "CYCL DEF 10.1 ROT+0",
    "PLANE SPATIAL SPA+0 SPB+20 SPC+0 STAY",
    "PLANE RESET STAY",
    "LBL 1",
    "CALL LBL 1 REP 1",
    "/ L X+3",
    "FUNCTION TCPM F TCP AXIS SPAT PATHCTRL AXIS",
    "FUNCTION RESET TCPM",
)


@contextmanager
def stretches_of(shortest: int) -> Iterator[None]:
    """Which stretches go through the fast lane; `COMPILED`: all of them, compiled if that is installed."""
    before, lane.MIN_STRETCH_BLOCKS = lane.MIN_STRETCH_BLOCKS, abs(shortest)
    core.use(None if shortest == COMPILED else "plain")
    try:
        yield
    finally:
        lane.MIN_STRETCH_BLOCKS = before
        core.use(None)


def columns(body: str, shortest: int, setup: Setup, unit: str) -> dict[str, object] | str:
    """All columns of the trace and what is said, or the error."""
    with stretches_of(shortest):
        try:
            found = follow(body, "XYZBC", setup, unit=unit)
        except NcfixError as error:
            return str(error)
    moves = found.moves
    table = {
        field.name: getattr(moves, field.name) for field in fields(Moves) if field.name not in ("frames", "reasons")
    }
    table["offsets"] = [moves.frames[index].offset.tolist() for index in moves.frame]
    table["why"] = [moves.reasons[index] for index in moves.reason]
    table["said"] = [str(message) for message in found.messages]
    return table


def assert_same(body: str, setup: Setup = KNOWN, unit: str = "MM") -> None:
    other = columns(body, NEVER, setup, unit)
    for one in (columns(body, ALWAYS, setup, unit), columns(body, COMPILED, setup, unit)):
        if isinstance(one, str) or isinstance(other, str):
            assert one == other, body
            continue
        for name, values in one.items():
            if name not in ("frame", "reason", "pointing"):
                np.testing.assert_array_equal(values, other[name], err_msg=f"{name}\n{body}")


def motion(random: Random) -> str:
    """A block of the kind that the lane takes."""
    words = [f"{letter}{random.uniform(-99, 99):+.{random.choice([0, 1, 3])}f}" for letter in random_letters(random)]
    if random.random() < 0.1:
        words = [word.replace(".", ",") for word in words]
    normal = ["NX+0.6 NY+0 NZ+0.8"] if words and random.random() < 0.1 else []
    function = "LN" if normal else random.choice(("L", "L", "L", ""))
    tail = random.choice(("", "", "", "F500", "F1200.5", "FMAX", "R0 FMAX", "R0", "RL", "M8", "R0 F100 M3"))
    number = f"{random.randint(1, 999)} " if random.random() < 0.5 else ""
    return number + " ".join(filter(None, (function, *words, *normal, tail))) + random.choice(("", "", " ; more"))


def random_letters(random: Random) -> list[str]:
    """Some axes; now and then one that the machine lacks."""
    found = [letter for letter in "XYZBC" if random.random() < 0.5]
    return found + ["W"] * (random.random() < 0.0005)


def body(seed: int, odd: float) -> str:
    """A program of plain motions with other things in between."""
    random = Random(seed)
    blocks = [random.choice(OTHERS) if random.random() < odd else motion(random) for _ in range(40)]
    return "\n".join(["TOOL CALL 1 Z S1000", "L X+0 Y+0 Z+0 B+0 C+0 R0 FMAX", *blocks])


@pytest.mark.parametrize("odd", [0.0, 0.05, 0.2])
def test_both_ways_give_the_same(odd: float) -> None:
    for seed in range(MANY):
        setup = KNOWN if seed % 3 else replace(KNOWN, tcp=True)
        assert_same(body(seed, odd), setup, "INCH" if seed % 5 == 0 else "MM")


def test_nothing_is_known_at_the_start() -> None:
    for seed in range(some(20)):
        assert_same(body(seed, 0.1), Setup(assume_zero=True))
        assert_same(body(seed, 0.1), Setup())


@pytest.mark.parametrize("odd", [0.0, 0.1])
def test_arcs_of_both_ways_are_the_same(odd: float) -> None:
    for seed in range(MANY):
        random, blocks = Random(seed), full_of_klartext_arcs(seed, 40)
        blocks = [random.choice(OTHERS) if random.random() < odd else block for block in blocks]
        begin = "TOOL CALL 1 Z S1000\nL X+0 Y+0 Z+0 B+0 C+0 R0 F1000"
        setup = KNOWN if seed % 3 else replace(KNOWN, tcp=True)
        assert_same("\n".join([begin, *blocks]), setup, "INCH" if seed % 5 == 0 else "MM")


def test_stretches_are_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    taken, take = [], lane.take

    def noting(
        control: KlartextControl, stage: lane.KlartextBlockRows, unit: KlartextUnit, block: int, circles: Circles
    ) -> None:
        taken.append(len(stage.feed))
        take(control, stage, unit, block, circles)

    monkeypatch.setattr(lane, "take", noting)
    columns(body(1, 0.0), ALWAYS, KNOWN, "MM")
    assert sum(taken) >= 35
    taken.clear()
    blocks = full_of_klartext_arcs(1, 60)
    columns("\n".join(["TOOL CALL 1 Z S1000", "L X+0 Y+0 Z+0 B+0 C+0 R0 F1000", *blocks]), ALWAYS, KNOWN, "MM")
    assert sum(taken) >= 0.8 * len(blocks)
