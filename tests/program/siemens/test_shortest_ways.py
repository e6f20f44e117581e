"""Words that go the shortest way, `C=DC(350)`, go through the fast lane and are written many at a time."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path
from unittest import mock

import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.control.lanes.lane import run_lane
from ncfix.control.setup import Setup
from ncfix.machine import load
from ncfix.text.dialect import Dialect
from ncfix.text.language import language_of
from ncfix.text.reader import read
from ncfix.writer.language import WrittenLanguage
from program.test_trace_lane import assert_same, columns

CRADLE = Path(__file__).parents[3] / "examples" / "machines" / "wCAYFXZSt.toml"


def wandering(seed: int, tilt: str) -> str:
    """A program whose table C turns a little at a time, past zero now and then, or far at once, or in other forms."""
    chance = random.Random(seed)
    lines, angle = ["G54 G17 G90 G94 G710", "T1 D1 M6", f"G0 X0 Y0 Z50 {tilt}0 C0", "G1 F2000"], 0.0
    for _ in range(300):
        far = chance.random() < 0.04
        angle = (angle + (chance.uniform(-360, 360) if far else chance.uniform(-6, 8))) % 360
        other = chance.choice((f"C={angle:.3f}", f"C=ACP({angle:.3f})", "", "C=IC(5)", "G91 Y1", "G90"))
        word = other if chance.random() < 0.02 else f"C=DC({angle:.3f})"
        lines.append(f"X{chance.uniform(-20, 20):.3f} {tilt}={chance.uniform(-9, 9):.2f} {word}")
    return "\n".join([*lines, "M30", ""])


@pytest.mark.parametrize("offset", [0.0, 30.0])
@pytest.mark.parametrize("seed", range(4))
def test_the_fast_lane_and_single_blocks_give_the_same_motions(seed: int, offset: float) -> None:
    setup = Setup(work_offsets={"G54": {"C": offset}}, assume_zero=True)
    assert_same(wandering(seed, "B"), "siemens", setup)


def test_most_of_them_go_through_the_fast_lane() -> None:
    taken = []
    with mock.patch("ncfix.control.interpreter.run_lane", lambda *given: taken.append(run_lane(*given)) or taken[-1]):
        columns(wandering(1, "B"), 16, "siemens", Setup(assume_zero=True))
    assert sum(taken) > 150


@pytest.mark.parametrize("offset", [0.0, 30.0])
@pytest.mark.parametrize("strategy", ["rotary-then-linear", "full"])
def test_many_at_a_time_they_are_written_as_one_by_one(strategy: str, offset: float) -> None:
    options = FixOptions(strategy=strategy, allow_refused=True, figures=False)
    setup = Setup(work_offsets={"G54": {"C": offset}}, assume_zero=True)
    program = read(wandering(2, "A").encode(), "part.mpf", "siemens")

    def written() -> bytes:
        return fix_program(program, load(CRADLE), setup, options).text

    def without_bulk(dialect: Dialect, kind: type[WrittenLanguage]) -> WrittenLanguage:
        return replace(language_of(dialect, kind), bulk=None)

    many = written()
    with mock.patch("ncfix.writer.emit.language_of", without_bulk):
        assert written() == many
    assert b"=DC(" in many
