"""The account of a correction: what became of blocks, what has no figure, and what is left, by hand-made motions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from compensate.machines_at_random import perfect
from compensate.motions import motions
from ncfix.arrays import in_stretches
from ncfix.compensate.account import (
    BY_RULE,
    HINT,
    LEFT,
    MEASURED,
    REFUSED,
    UNKNOWN,
    Account,
    LeftAxis,
    NoFigureReason,
    Reason,
    either,
    in_sequence,
    merged,
    not_looked_at,
    rule_of,
    said_of,
    without_figure,
)
from ncfix.control.moves import PASS_RULES, MotionKind, Moves, Pass, Rule

FEED, RAPID, DWELL = MotionKind.FEED, MotionKind.RAPID, MotionKind.DWELL
MACHINE = perfect("w F X Y Z t")


def moved(kinds: list[MotionKind], **more: Any) -> Moves:
    steps = [(float(row + 1), 0.0, 0.0) for row in range(len(kinds))]
    return replace(motions(MACHINE, (0, 0, 0), steps, kinds), **more)


def rules(*rows: Rule) -> np.ndarray:
    return np.array(rows, dtype=np.int8)


def mask(*rows: int) -> np.ndarray:
    return np.array(rows, dtype=bool)


def left(axis: str = "X", motions: int = 1, cuts: int = 0, lines: Any = ((4, 4),), most: float = 0.002) -> LeftAxis:
    return LeftAxis(axis, axis in "ABC", motions, cuts, tuple(lines), most)


def test_a_block_is_refused_before_it_is_passed_before_it_is_corrected() -> None:
    why = Reason("NCF405", "far")
    moves = moved(
        [FEED, FEED, FEED, FEED, DWELL, FEED],
        block=np.array([0, 0, 1, 1, 2, 3], dtype=np.int32),
        rule=rules(Rule.CORRECT, Rule.CORRECT, Rule.PASS, Rule.CORRECT, Rule.PASS, Rule.CORRECT),
        reasons=("", "probing"),
        reason=np.array([0, 0, 1, 0, 1, 0], dtype=np.int16),
    )
    found = Account.of(moves, mask(0, 1, 1, 0, 1, 0), {0: why, 3: why})
    assert (found.compensated, found.passed, found.refused) == (frozenset({3}), {1: "probing"}, {0: why})
    assert found.rules == {1: BY_RULE}
    assert found.total == 3
    assert found.reasons() == {"far": 1}
    assert Account.of(moves, mask(0, 0, 1, 0, 1, 0), {}).compensated == {0, 3}
    assert Account.of(moved([FEED, FEED]), mask(0, 1), {}).compensated == {0}


def test_of_several_ways_through_a_program_the_worst_counts() -> None:
    one = Account(frozenset({1, 2, 3, 4}), {5: "a"}, {6: Reason("NCF405", "x")}, {5: "rule"})
    two = Account(
        frozenset({1, 5, 7}), {2: "b", 6: "c"}, {3: Reason("NCF406", "y"), 6: Reason("NCF404", "z")}, {2: "r", 6: "s"}
    )
    found = Account.together([one, two])
    assert found.compensated == {1, 4, 7}
    assert found.passed == {5: "a", 2: "b"}
    assert {block: why.code for block, why in found.refused.items()} == {3: "NCF406", 6: "NCF405"}
    assert found.rules == {5: "rule", 2: "r"}
    assert Account.together([one]) is one


@pytest.mark.parametrize("rule", [rule for rule in Pass if rule is not Pass.NONE])
def test_the_rule_of_a_motion_is_named(rule: Pass) -> None:
    moves = moved([FEED, FEED], passing=np.array([Pass.NONE, rule], dtype=np.int8))
    assert rule_of(moves, 1) == (PASS_RULES[rule].name, PASS_RULES[rule].cuts)
    assert rule_of(moves, 0) == rule_of(moved([FEED]), 0) == NoFigureReason(BY_RULE, True)


def test_each_motion_without_a_figure_is_counted_once_by_its_first_reason() -> None:
    measured = np.zeros((7, 3), dtype=bool)
    measured[[1, 2, 3], 0] = True
    lacking = np.zeros((7, 3), dtype=bool)
    lacking[[2, 4, 5], 1] = True
    moves = moved(
        [FEED, FEED, FEED, FEED, FEED, RAPID, DWELL],
        rule=rules(Rule.PASS, Rule.CORRECT, Rule.CORRECT, Rule.CORRECT, Rule.CORRECT, Rule.PASS, Rule.PASS),
        measured=measured,
    )
    unchanged = mask(1, 1, 0, 0, 0, 0, 0)
    assert without_figure(moves, unchanged, lacking) == {BY_RULE: 1, REFUSED: 1, MEASURED: 2, LEFT: 1}
    assert without_figure(moves, unchanged, None) == {BY_RULE: 1, REFUSED: 1, MEASURED: 2}
    assert without_figure(moves, unchanged, lacking, mask(0, 1, 0, 1, 1, 1, 1)) == {REFUSED: 1, MEASURED: 1, LEFT: 1}


def test_a_turn_that_is_left_takes_no_figure_away() -> None:
    machine = perfect("w C F X Y Z t")
    moves = motions(machine, (0, 0, 0, 0), [(0.1, 1, 0, 0)])
    for column in range(4):
        lacking = np.zeros((1, 4), dtype=bool)
        lacking[0, column] = True
        assert (without_figure(moves, mask(0), lacking) == {LEFT: 1}) == (not moves.rotary[column])


def test_what_a_look_along_the_path_leaves_out() -> None:
    measured = np.zeros((6, 3), dtype=bool)
    measured[[1, 3], 2] = True
    moves = moved(
        [FEED, FEED, RAPID, FEED, MotionKind.CYCLE, FEED],
        rule=rules(Rule.PASS, *[Rule.CORRECT] * 5),
        measured=measured,
    )
    moves.start[4] = moves.end[3] = moves.start[2] = np.nan
    found = {why: rows.tolist() for why, rows in not_looked_at(moves).items()}
    assert found == {
        NoFigureReason(BY_RULE, True): [0],
        NoFigureReason(MEASURED, False): [1],
        NoFigureReason(UNKNOWN, True): [3],
    }
    moves.end[4] = moves.start[5] = np.nan
    assert not_looked_at(moves)[NoFigureReason(UNKNOWN, True)].tolist() == [3, 4, 5]


@pytest.mark.parametrize(
    ("lines", "stretches"),
    [
        ([1], ((1, 1),)),
        ([1, 2, 4], ((1, 2), (4, 4))),
        ([3, 5, 6, 7, 9], ((3, 3), (5, 7), (9, 9))),
    ],
)
def test_lines_become_stretches(lines: list[int], stretches: object) -> None:
    assert in_stretches(np.array(lines, dtype=np.int64)) == stretches


def test_stretches_of_two_parts_are_put_together_where_they_meet() -> None:
    assert merged(((1, 2), (4, 6)), ((7, 8), (10, 11))) == ((1, 2), (4, 8), (10, 11))
    assert merged(((4, 6),), ((6, 8),)) == ((4, 8),)
    assert merged(((4, 6),), ((8, 8),)) == ((4, 6), (8, 8))
    assert merged(((40, 60),), ((70, 80),)) == ((40, 60), (70, 80))


def test_what_is_left_in_parts_adds_up_and_of_ways_the_most_counts() -> None:
    one = {"Y": left("Y", 2, 1, ((3, 5),), 0.001), "X": left("X", 1, 1, ((9, 9),), 0.004)}
    two = {"X": left("X", 5, 3, ((10, 14), (16, 16)), 0.002), "Z": left("Z", 1, 0, ((2, 2),), 0.1)}
    found = in_sequence(one, two)
    assert list(found) == ["Z", "Y", "X"]
    assert found["X"] == left("X", 6, 4, ((9, 14), (16, 16)), 0.004)
    found = either([one, two])
    assert list(found) == ["Z", "Y", "X"]
    assert found["X"] == left("X", 5, 3, ((9, 14), (16, 16)), 0.004)
    assert either([two, one])["X"] == found["X"]


def test_what_is_left_is_said_with_lines_and_size() -> None:
    said = left(cuts=1, most=0.0023456).message("part.nc")
    assert (
        said.code,
        said.advice,
        str(said.place.path if said.place else ""),
        said.place.line if said.place else 0,
    ) == ("NCF439", HINT, "part.nc", 4)
    assert "X gets no word in this motion, which cuts, and is up to 2.35 um from" in said.text
    nothing = left().message("part.nc")
    assert "this motion, which cuts nothing, and is up to" in nothing.text
    assert nothing.hint == ""
    many = left("B", 7, 0, ((4, 4), (6, 9)), np.radians(0.25)).message("part.nc")
    assert "B gets no word in 7 motions (lines 4, 6 to 9), none of which cut, and is up to 0.25 degrees" in many.text
    more = left("X", 9, 2, [(row, row) for row in (1, 3, 5, 7, 9)]).message("part.nc")
    assert "9 motions (between lines 1 and 9), 2 of which cut" in more.text
    four = left("X", 9, 2, [(row, row) for row in (1, 3, 5, 7)]).message("part.nc")
    assert "(lines 1, 3, 5, 7)" in four.text


def test_axes_left_in_the_same_motions_are_one_message() -> None:
    same = [left(axis, 2, 1, ((4, 4), (9, 9)), most) for axis, most in zip("XYZ", (0.001, 0.003, 0.002), strict=True)]
    said = [each.text for each in said_of([*same, left("B", 2, 1, ((4, 4), (9, 9))), left("Y")], "part.nc")]
    assert [text.partition(" no word")[0] for text in said] == ["X, Y and Z get", "B gets", "Y gets"]
    assert "get no word in 2 motions (lines 4, 9), 1 of which cut, and are up to 3.00 um from" in said[0]


def test_what_is_left_as_plain_data() -> None:
    assert left(lines=((4, 6),)).as_dict() == {"axis": "X", "motions": 1, "cuts": 0, "lines": [[4, 6]], "max_um": 2.0}
    assert left("B", most=np.radians(2.0)).as_dict()["max_deg"] == pytest.approx(2.0)
