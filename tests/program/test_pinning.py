"""A refused arc with an end of its own begins where it began; nothing else reaches back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import some
from ncfix.control.moves import MotionKind, Moves, Rule
from ncfix.control.setup import Setup
from ncfix.control.trace import trace
from ncfix.text.reader import read
from ncfix.writer.pieces import closure_of_refusals

HEAD = "G21 G90 G94 G17 F100\nG0 X0 Y0 Z0\n"


def moves_of(text: str, dialect: str = "linuxcnc") -> Moves:
    whole = text if "BEGIN PGM" in text else f"{HEAD}{text}\nM2\n"
    program = read(whole.encode(), "part.ngc", dialect)
    return trace(program, Setup(assume_zero=True), ("X", "Y", "Z"), frozenset()).moves


def pinned(text: str, refused: int, dialect: str = "linuxcnc") -> list[int]:
    """The motions (from 0, the one of the head) that stay unchanged because motion `refused` is."""
    moves = moves_of(text, dialect)
    unchanged = np.zeros(len(moves), dtype=bool)
    unchanged[refused] = True
    closure = closure_of_refusals(moves, unchanged)
    found, added = closure.unchanged, closure.added
    assert sorted(np.flatnonzero(found & ~unchanged).tolist()) == sorted(added)
    arcs = [row for row in np.flatnonzero(found).tolist() if row == refused or moves.kind[row] == MotionKind.ARC]
    assert all(cause == next(row for row in arcs if row > each) for each, cause in added.items())
    return sorted(added)


@pytest.mark.parametrize(
    ("text", "refused", "expected"),
    [
        ("G1 X5 Y5\nX1 Y1\nG2 X2 Y0 I1 J0", 3, [2]),
        ("G1 X5 Y5\nZ3\nX1\nG2 X2 Y4 I1 J0", 4, [1, 2, 3]),
        ("G1 X1 Y1\nG91 X5", 2, []),
        ("G1 X1 Y1\nG91 G2 X2 Y0 I1 J0", 2, []),
        ("G1 X1 Y1\nG90.1 G91 G2 X2 Y0 I2 J1", 2, [1]),
        ("G1 X1 Y1\nG2 I1", 2, []),
        ("G1 X1 Y1\nG2 I1 Z-1", 2, []),
        ("G1 X1 Y1\nG2 X2 R5", 2, [1]),
        ("G1 X1 Y1\nG91 X1\nG90 G2 X3 Y0 I1 J0", 3, [1, 2]),
        ("G1 X1 Y1\nG2 X3 Y1 I1 J0\nG3 X5 Y1 I1 J0", 3, [1, 2]),
        ("G1 X1 Y1\nG53 G0 X0 Y0\nG2 X2 Y0 I1 J0", 3, []),
        ("G1 X1 Y1\nG53 G0 X0\nG2 X2 Y1 I1 J0", 3, [1]),
        ("G18 G1 X1 Z1\nY4\nG2 X3 Z1 I1 K0", 3, [1, 2]),
        ("G10 L2 P1 R30\nG1 X1 Y1\nX2\nZ1\nG2 X4 Y1 I1 J0", 4, [1, 2, 3]),
    ],
)
def test_how_far_back_a_refusal_reaches(text: str, refused: int, expected: list[int]) -> None:
    assert pinned(text, refused) == expected


@pytest.mark.parametrize(
    ("text", "refused", "expected"),
    [
        ("G1 X1 Y1\nG91 G2 X2 Y0 I1 J0", 2, []),
        ("G1 X1 Y1\nG91 G2 X2 Y0 I=AC(2) J=AC(1)", 2, [1]),
        ("G1 X1 Y1\nG2 X=IC(2) Y=IC(0) I1 J0", 2, []),
        ("G1 X1 Y1\nG2 X=IC(2) Y1 I1 J0", 2, [1]),
        ("G1 X1 Y1\nX=IC(1)\nG2 X4 Y1 I1 J0", 3, [1, 2]),
        ("G91 G1 X1 Y1\nX=AC(1)\nY=AC(1)\nG90 G2 X3 Y1 I1 J0", 4, [2, 3]),
        ("G1 X1 Y1\nG111 X0 Y0\nG1 X1 Y0\nG3 AP=90 RP=1", 3, [2]),
    ],
)
def test_words_that_say_how_they_are_meant(text: str, refused: int, expected: list[int]) -> None:
    assert pinned(text, refused, "siemens") == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [("C IX+2 IY+0 DR-", [1]), ("CR IX+2 IY+0 R+1 DR-", []), ("CR X+3 Y+1 R+1 DR-", [1]), ("CP IPA-90 DR-", [])],
)
def test_arcs_of_klartext(text: str, expected: list[int]) -> None:
    body = f"BEGIN PGM A MM\nL X+0 Y+0 Z+0 FMAX\nL X+1 Y+1 F100\nCC X+2 Y+1\n{text}\nEND PGM A MM\n"
    assert pinned(body, 2, "heidenhain") == expected


@pytest.mark.parametrize("end", ["X10 Y10", "X=IC(10) Y=IC(10)", "X-10 Y0"])
def test_a_sinumerik_arc_without_a_direction_gets_none_from_a_corrected_motion(end: str) -> None:
    """A motion along Z that gets a word X of some um would be the direction in which CT goes on."""
    assert pinned(f"G1 X5 Y5\nZ3\nCT {end}", 3, "siemens") == [1, 2]


@pytest.mark.parametrize("end", ["X+10 Y+10", "IX+10 IY+10"])
def test_a_klartext_arc_without_a_direction_gets_none_from_a_corrected_motion(end: str) -> None:
    body = f"BEGIN PGM A MM\nL X+0 Y+0 Z+5 FMAX\nL X+5 Y+5 F100\nL Z+3\nCT {end}\nEND PGM A MM\n"
    assert pinned(body, 3, "heidenhain") == [1, 2]


def test_holes_are_drilled_where_their_blocks_say() -> None:
    assert pinned("G0 X1. Y1.\nG81 X2. Z-1. R1.\nX3.", 3, "fanuc") == []


def test_a_bound_increment_begins_where_it_began() -> None:
    moves = moves_of("G1 X1 Y1\nY2\nG91 X5")
    unchanged = np.array([False, False, False, True])
    added = closure_of_refusals(moves, unchanged, unchanged).added
    assert added == {2: 3, 1: 3}


def test_several_refusals_need_what_each_of_them_needs() -> None:
    moves = moves_of("G1 X5 Y5\nX1 Y1\nG2 X2 Y0 I1 J0\nG1 X9\nX5 Y3\nG2 X6 Y2 I1\nG1 X9\nX5\nY1\nG2 X6 Y2 I1\nG1 X0")
    arcs = np.flatnonzero(moves.kind == MotionKind.ARC).tolist()
    alone = [closure_of_refusals(moves, np.isin(np.arange(len(moves)), arc)).unchanged for arc in arcs]
    assert (
        closure_of_refusals(moves, np.isin(np.arange(len(moves)), arcs)).unchanged.tolist()
        == np.any(alone, axis=0).tolist()
    )
    assert [unchanged.sum() for unchanged in alone] == [2, 2, 3]


def test_where_tool_centre_point_control_goes_on_all_axes_stand_elsewhere() -> None:
    moves = moves_of("G1 X3 Y3 Z3\nX2 Y2\nG2 X4 Y2 I1 J0")
    refused, switched = np.array([0, 0, 0, 1], dtype=bool), replace(moves, tcp=np.array([0, 0, 0, 1], dtype=bool))
    assert sorted(closure_of_refusals(moves, refused).added) == [2]
    assert sorted(closure_of_refusals(switched, refused).added) == [1, 2]


LINES = (
    "G1 X1 Y2 Z3",
    "G1 X2",
    "G1 Y1 Z0",
    "G91 G1 X1\nG90",
    "G91 G2 X2 I1\nG90",
    "G2 X4 Y4 R50",
    "G2 I1",
    "G53 G0 X0",
)


@settings(max_examples=some(80), derandomize=True, deadline=None)
@given(st.lists(st.sampled_from(LINES), min_size=2, max_size=14), st.integers(0, 2**14 - 1))
def test_refused_arcs_close_whatever_is_before_them(lines: list[str], refused: int) -> None:
    try:
        moves = moves_of("\n".join(lines))
    except Exception:  # an arc that cannot reach its end
        return
    unchanged = (moves.rule != Rule.CORRECT) | np.array([refused >> row & 1 for row in range(len(moves))], dtype=bool)
    found = closure_of_refusals(moves, unchanged).unchanged
    off = np.zeros(3, dtype=bool)
    for row in range(len(moves)):
        own = moves.programmed[row].any() and not moves.incremental[row] and moves.kind[row] == MotionKind.ARC
        if found[row] and own:
            assert not off[:2].any()
        if found[row] and not moves.incremental[row]:
            off &= ~moves.programmed[row]
        elif not found[row]:
            off[:] = True


@pytest.mark.parametrize(
    ("text", "reaches_back"), [("G1 X1\nG2 X3 Y0 I1 J0", True), ("G1 X1 Y0\nG2 X3 Y0 I1 J0", False)]
)
def test_a_refusal_that_needs_what_was_before_the_first_motion_says_so(text: str, reaches_back: bool) -> None:
    program = read(f"G21 G90 G94 G17 F100\n{text}\nM2\n".encode(), "part.ngc", "linuxcnc")
    moves = trace(program, Setup(assume_zero=True), ("X", "Y", "Z"), frozenset()).moves
    assert closure_of_refusals(moves, np.array([True, True])).reaches_back is reaches_back
