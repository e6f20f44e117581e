"""The fast lane and the steps of single blocks give the same motions, to the last bit."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields
from random import Random
from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import some
from ncfix import core
from ncfix.control.lanes import lane
from ncfix.control.moves import MotionKind, Moves, Rule
from ncfix.control.setup import Setup
from ncfix.control.state import ControlState
from ncfix.diagnostics import NcfixError
from program.arcs import full_of_arcs
from program.tracing import KNOWN, ZERO, follow

ALWAYS, NEVER = 1, 10**9
ASSUMED = Setup(assume_zero=True)


@contextmanager
def stretches_of(shortest: int) -> Iterator[None]:
    """Which stretches go through the fast lane; a negative number: compiled if that is installed."""
    before, lane.MIN_STRETCH_BLOCKS = lane.MIN_STRETCH_BLOCKS, abs(shortest)
    core.use(None if shortest < 0 else "plain")
    try:
        yield
    finally:
        lane.MIN_STRETCH_BLOCKS = before
        core.use(None)


def columns(text: str, shortest: int, dialect: str, setup: Setup = KNOWN) -> dict[str, object] | str:
    """All columns of the trace, or the error."""
    with stretches_of(shortest):
        try:
            moves = follow(text, "XYZBC", setup, dialect).moves
        except NcfixError as error:
            return str(error)
    table = {
        field.name: getattr(moves, field.name) for field in fields(Moves) if field.name not in ("frames", "reasons")
    }
    table["offsets"] = [moves.frames[index].offset.tolist() for index in moves.frame]
    table["why"] = [moves.reasons[index] for index in moves.reason]
    return table


def assert_same(text: str, dialect: str = "linuxcnc", setup: Setup = KNOWN, shortest: int = ALWAYS) -> None:
    """The same motions, or the same error; `shortest` stretch that goes through the lane, compiled or not."""
    other = columns(text, NEVER, dialect, setup)
    for one in (columns(text, shortest, dialect, setup), columns(text, -shortest, dialect, setup)):
        if isinstance(one, str) or isinstance(other, str):
            assert one == other
            continue
        for name, values in one.items():
            if name not in ("frame", "reason"):
                np.testing.assert_array_equal(values, other[name], err_msg=name)
            if name in ("start", "end"):
                np.testing.assert_array_equal(np.signbit(values), np.signbit(other[name]), err_msg=name)


SETTINGS = ["G91", "G90", "G20", "G21", "G55", "G92 X3", "G93", "G94 F50", "G43 H1", "S5", "G10 L2 P1 R30"]
IN_BETWEEN = ["G4 P1", "G2 X1 Y1 R900", "G3 X-0. Y2 Z3 R900 F70", "G0 Z[5-2]", "G1 X[0-0] Y[0*-1]", "F[2*20]", "/G4 P1"]


def line(random: Random) -> str:
    """A block, most often of the kind that the lane takes."""
    if random.random() < 0.14:
        return random.choice(random.choice([SETTINGS, IN_BETWEEN]))
    words = [
        letter + f"{random.uniform(-99, 99):.{random.choice([0, 1, 3])}f}"
        for letter in "XYZBC"
        if random.random() < 0.5
    ]
    words += [f"F{random.randint(0, 500)}"] * (random.random() < 0.15)
    words += [random.choice(["G0", "G1"])] * (random.random() < 0.4)
    random.shuffle(words)
    head = f"N{random.randint(1, 999)} " if random.random() < 0.3 else ""
    return head + " ".join(words) + random.choice(["", "", " (comment)", " ; more"])


LEADING_ELSEWHERE = {
    "linuxcnc": (
        ("o1 repeat [3]", "o1 endrepeat"),
        ("o2 sub", "o2 endsub\no2 call\nX1\no2 call"),
        ("#9=0\no3 while [#9 LT 3]", "#9=[#9+1]\no3 endwhile"),
    ),
    "fanuc": (
        ("#9=0\nN7001", "#9=#9+1\nIF[#9LT3]GOTO7001"),
        ("#9=0\nWHILE[#9LT3]DO1", "#9=#9+1\nEND1"),
        ("GOTO7002\nX7.\nX8.\nN7002", ""),
        ("M98P100L2\nX7.\nM98P100\nM30\nO100", "M99"),
    ),
}
"""What stands before and behind blocks that are come to more than once, or passed over."""


@settings(max_examples=some(150), deadline=None)
@given(st.integers(0, 2**32), st.sampled_from(["linuxcnc", "iso", "fanuc"]))
def test_both_lanes_are_the_same(seed: int, dialect: str) -> None:
    random = Random(seed)
    parts = [[line(random) for _ in range(random.randint(1, 25))] for _ in range(3)]
    if dialect in LEADING_ELSEWHERE and random.random() < 0.5:
        before, behind = random.choice(LEADING_ELSEWHERE[dialect])
        parts[1:2] = [[before], parts[1], [behind]]
    head = "G0 F100 X0 Y0 Z0 B0 C0" if random.random() < 0.8 else "G0 X1"
    text = "\n".join([head, *(block for part in parts for block in part)])
    setup = random.choice([KNOWN, Setup(assume_zero=True, no_point="calculator")])
    assert_same(text, dialect, setup, random.choice([ALWAYS, 4, lane.MIN_STRETCH_BLOCKS]))


def without_a_word(random: Random, block: str) -> str:
    """A block that lacks one of its words, or has it with another letter."""
    words = block.split(" ")
    at = random.randrange(len(words))
    words[at] = random.choice(["", random.choice("XYZIJKR") + words[at][1:]])
    return " ".join(words)


@settings(max_examples=some(200), deadline=None)
@given(st.integers(0, 2**32), st.sampled_from(["linuxcnc", "iso", "fanuc", "haas", "mitsubishi"]))
def test_both_lanes_make_the_same_arcs(seed: int, dialect: str) -> None:
    random = Random(seed)
    body = full_of_arcs(seed, 60)
    for place in random.sample(range(60), random.randint(0, 5)):
        body.insert(place, random.choice([*SETTINGS, "G41 D1", "G40", "F0", "G90.1", "G91.1", "M5", "G2", "X1 Y1 Z1"]))
    if random.random() < 0.5:
        body[-5] = without_a_word(random, body[-5])
    assert_same("\n".join(["G0 F100 X0 Y0 Z0 B0 C0" if random.random() < 0.9 else "X0 Y0", *body]), dialect)


SIEMENS = ["G91", "G90", "G70", "G71", "G55", "G94 F50", "G41 D1", "G40", "M5", "X1 Y1 Z1", "G2 I1 CR=2", "TRANS X3"]
TANGENT = ["CT X9.5 Y3.25 Z1", "MIRROR Y0", "DIAMON", "DIAMOF", "G3 X1 Y9 CR=-30", "G2 X1 Y1 AR=90", "TRAORI", "R1=2"]


@settings(max_examples=some(150), deadline=None)
@given(st.integers(0, 2**32))
def test_both_lanes_make_the_same_arcs_of_sinumerik(seed: int) -> None:
    random = Random(seed)
    body = full_of_arcs(seed, 60, sinumerik=True)
    for place in random.sample(range(60), random.randint(0, 5)):
        body.insert(place, random.choice([*SIEMENS, *TANGENT]))
    setup = Setup(work_offsets={"G54": ZERO, "G55": dict.fromkeys("XYZABC", 1.5)}, assume_zero=True, initial=ZERO)
    head = "G0 X0 Y0 Z0 B0 C0" if random.random() < 0.9 else "X0 Y0"
    assert_same("\n".join([head, "F100", *body]), "siemens", setup)


@pytest.mark.parametrize("dialect", ["linuxcnc", "iso", "fanuc", "siemens"])
@pytest.mark.parametrize("odd", ["0.", "-0.", ".5"])
def test_centre_words_across_the_plane(odd: str, dialect: str) -> None:
    radius = "CR=" if dialect == "siemens" else "R"
    for plane, second, one, across in (("G17", "Y", "J", "K"), ("G18", "Z", "K", "J")):
        arcs = [
            f"G2 X{n}. {second}1. I.5 {one}0. {across}0.\nX{n + 0.5} {radius}.25\nX{n}. {radius}.25"
            for n in range(1, 30)
        ]
        arcs[20] = arcs[20].replace(f"{across}0.", across + odd)
        text = "\n".join([f"{plane} G90 G0 X0. Y1. Z1. B0. C0.", "F100.", *arcs])
        assert_same(text, dialect, Setup(assume_zero=True, initial=ZERO))


@pytest.mark.parametrize("dialect", ["iso", "fanuc", "siemens"])
def test_the_lane_takes_arcs_with_all_of_i_j_and_k(dialect: str) -> None:
    arcs = [f"G2 X{n}. Y1. I.5 J0. K0." for n in range(1, 40)]
    with mock.patch.object(lane, "take", side_effect=lane.take) as taken:
        follow("\n".join(["G17 G90 F100.", "G0 X0. Y1. Z0. B0. C0.", *arcs]), "XYZBC", ASSUMED, dialect)
    assert sum(len(call.args[1].mask) for call in taken.call_args_list) >= len(arcs)


def test_what_is_in_the_way_again_and_again_is_not_looked_for_in_all_that_comes() -> None:
    """Arcs that the lane leaves alone, among blocks that it would take: these are gone through a few times only."""
    blocks = 400 * (["G1 X2. Y1."] * 20 + ["G1 X0. Y0.", "G2 X1. Y0. I.5 J0. K.5"])
    text = "\n".join(["G17 G90 F100.", "G0 X0. Y0. Z0. B0. C0.", *blocks])
    with mock.patch.object(lane, "count_allowed", side_effect=lane.count_allowed) as looked:
        follow(text, "XYZBC", ASSUMED, "fanuc")
    assert sum(len(call.args[1].mask) for call in looked.call_args_list) < 50 * len(blocks)


def test_arcs_with_centres_that_count_from_zero() -> None:
    blocks = [f"G3 X{math.cos(turn):.4f} Y{math.sin(turn):.4f} I0 J0" for turn in np.linspace(0.5, 6, 12)]
    assert_same("\n".join(["G90.1 G55 F100 G0 X1 Y0 Z0 B0 C0", *blocks, "X1 Y0 I0 J.2", *blocks]))


@pytest.mark.parametrize(
    "text",
    [
        "F1 G81 X1 Z-1 R1\nX2\nX3\nX4",
        "G2 F1 X1 I1\nX2\nX3",
        "F1 G38.2 Z-1\nX1\nX2\nZ3\nG1 X3\nX4",
        "G41 D1 F1\nG1 X1\nX2\nG40 X3",
        "o1 repeat [3]\nG91 G1 F1 X1\nY1\nX-1\no1 endrepeat\nG90\nX0\nX1",
        "G0 X1\nG0 X2 A5\nX3",
        "F1 G1 X1\nX2 I1\nX3",
        "G18 F1 G2 X1 I.5\nX2 J.5\nX3",
        "F1 G2 X2 R1\nX2 R1\nX3 I1 J1 R1",
        "F1 G3 I1\nJ1\nI1 P2\nR1",
        "F0 G1 X1\nG2 X2 I.5\nG1 X3",
    ],
)
def test_what_is_not_for_the_lane_is_left_alone(text: str) -> None:
    assert_same(text)


def test_blocks_without_a_time_of_their_own_are_kept_whole_alike() -> None:
    """SINUMERIK: under G93 a block without F has the F of the one before; its pieces would need others."""
    body = [f"X{i} C{2 * i}" + " F3" * (i % 9 == 0) + " G0" * (i % 13 == 0) + " G1" * (i % 13 == 1) for i in range(60)]
    text = "\n".join(["G0 X0 Y0 Z0 B0 C0", "G1 G93 F3 X1", *body, "M30"])
    one, other = (columns(text, length, "siemens", Setup(assume_zero=True)) for length in (ALWAYS, NEVER))
    assert not isinstance(one, str)
    assert not isinstance(other, str)
    np.testing.assert_array_equal(one["whole"], other["whole"])
    assert np.any(one["whole"])


PLACED = "G90 G1 F100 X0. Y0."
MANY = [f"X{i}. Y{i}." for i in range(1, 25)]
"""Blocks that bring Z and B to their places go by themselves: behind `MANY` a stretch ends before the first of them."""
JUMPS = {
    "to where a stretch ended": [PLACED, *MANY, "N50 X77. Z3.", "X78.", "B1.", *MANY[:14]],
    "to what was looked at and not taken": [PLACED, "N50 X77. Z3.", *MANY[:5], "B1.", *MANY[:12]],
    "before what was looked at": [PLACED, "N50 X7. Y9.", *MANY[:9], "M8", "Z1. X3.", *MANY[:9], "B1.", *MANY[:6]],
}


@pytest.mark.parametrize("body", JUMPS.values(), ids=list(JUMPS))
@pytest.mark.parametrize("shortest", [4, lane.MIN_STRETCH_BLOCKS])
def test_jumps_back_lead_where_they_should(body: list[str], shortest: int) -> None:
    text = "\n".join(["#9=0", *body, "#9=#9+1", "IF[#9LT3]GOTO50"])
    one, other = (columns(text, length, "fanuc", Setup(assume_zero=True)) for length in (shortest, NEVER))
    assert not isinstance(one, str)
    assert not isinstance(other, str)
    np.testing.assert_array_equal(one["start"], other["start"])
    np.testing.assert_array_equal(one["end"], other["end"])


def test_a_subprogram_before_what_was_looked_at_is_taken_as_it_is_written() -> None:
    sub = ["o9 sub", *(f"X{i} Y{i}" for i in range(20)), "o9 endsub"]
    main = ["G1 F100 X5 Y6", "X1", "Z3 X1", *(f"X{100 + i}" for i in range(14)), "o9 call", "o9 call"]
    one, other = (
        columns("\n".join([*sub, *main]), length, "linuxcnc", Setup(assume_zero=True))
        for length in (lane.MIN_STRETCH_BLOCKS, NEVER)
    )
    assert not isinstance(one, str)
    assert not isinstance(other, str)
    np.testing.assert_array_equal(one["end"], other["end"])


CALLS = {"fanuc": ("M98 P8", "M99", "8"), "siemens": ("HOP", "M17", "hop")}


@pytest.mark.parametrize("dialect", CALLS)
def test_motions_of_subprogram_files_and_behind_their_calls(dialect: str) -> None:
    call, end, file = CALLS[dialect]
    lines = [f"X{i}." for i in range(20)]
    text, sub = "\n".join(["G1 F100. X5. Y6.", *lines, call, *lines]), "\n".join([*lines, end, ""])
    with stretches_of(lane.MIN_STRETCH_BLOCKS):
        moves = follow(text, setup=Setup(assume_zero=True), dialect=dialect, files={file: sub}).moves
    assert moves.block.tolist() == [*range(21), *[21] * 20, *range(22, 42)]
    assert [bool(rule == Rule.CORRECT) for rule in moves.rule] == [block != 21 for block in moves.block]


def test_the_lane_takes_what_it_should() -> None:
    text = "G0 X0 Y0 Z0 B0 C0\n" + "\n".join(f"G1 X{i} F100" for i in range(100))
    with stretches_of(lane.MIN_STRETCH_BLOCKS):
        moves = follow(text, "XYZBC").moves
    assert moves.end[1:, 0].tolist() == list(range(100))
    assert np.array_equal(moves.start[1:], moves.end[:-1])


@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc"])
def test_the_lane_takes_arcs(dialect: str) -> None:
    body = [f"G{2 + i % 2} X{i}. I.25\nX{i + 0.5} R.25" for i in range(1, 100)]
    with mock.patch.object(ControlState, "circle", autospec=True, side_effect=ControlState.circle) as one_by_one:
        moves = follow("\n".join(["G0 X0. Y0. Z0. B0. C0. F100\nG3 X.5 R.25", *body]), "XYZBC", dialect=dialect).moves
    assert np.count_nonzero(moves.kind == MotionKind.ARC) == 199
    assert not one_by_one.called
