"""The judge is judged: a small fixer that is right passes, and every way of being wrong is caught."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from conftest import FULL
from differential.canon import Canon
from differential.errors import Machine
from differential.judge import Terms, Verdict, judge
from differential.naive import Flaws, Naive

PLAIN = """\
G21 G90 G17 G94
(start X1 Y2)
G0 X10 Y5 Z20
M3 S1000
G1 Z-1 F100
X15 Y9
X-12 Z-2
Y-30
(half way)
X-4 Y-31.5 Z3
G91
X1.0004 Y0.5003
X1.0004 Y0.5003
X1.0004 Z-0.2
X1.0004 Y0.5003
G90
X40 Y10
M5
M2
"""
ARCS = """\
G21 G90 G17 G94
G0 X20 Y0 Z5
G1 Z0 F100
G3 X0 Y20 I-20 J0
G2 X10 Y10 I0 J-10 (a quarter)
G2 X10 Y10 I5 J5
G3 X20 Y0 Z2 I0 J-10
G1 X0
M2
"""
LONG = "G21 G90 G17 G94\nG0 X0 Y0 Z10\nG1 X300 Y200 F100\nX-300 Z30\nM2\n"
INVERSE = "G21 G90 G17\nG0 X0 Y0 Z10\nG93\nG1 X100 Y20 F4\nX0 F2\nG94\nM2\n"


@pytest.fixture
def verdict_of(
    rs274: Callable[..., Canon], machine: Callable[[str], Machine]
) -> Callable[[str, Flaws, Terms], Verdict]:
    """Fix a program with a flawed fixer and judge it."""
    model = machine("three")

    def run(source: str, flaws: Flaws, terms: Terms) -> Verdict:
        fixed = Naive(model, flaws).fix(source)
        return judge(rs274(source.encode()), rs274(fixed.encode()), model, terms)

    return run


CASES = [(PLAIN, 3), (PLAIN, 5), (ARCS, 4), *([(PLAIN, 4), (ARCS, 3), (ARCS, 5)] if FULL else [])]


@pytest.mark.parametrize(("source", "decimals"), CASES)
def test_a_right_fixer_passes(verdict_of: Callable[..., Verdict], source: str, decimals: int) -> None:
    verdict = verdict_of(source, Flaws(decimals=decimals), Terms(tolerance=2e-3, step=10.0**-decimals, rapids=True))
    assert verdict.right, str(verdict)
    assert verdict.compensated == verdict.motions > 5


def test_splitting_is_understood_and_needed(verdict_of: Callable[..., Verdict]) -> None:
    assert verdict_of(LONG, Flaws(pieces=40), Terms()).right
    whole = verdict_of(LONG, Flaws(), Terms())
    assert not whole.right
    assert any("along the way" in complaint for complaint in whole.complaints)


WRONG = {
    "wrong sign": (PLAIN, Flaws(sign=-1.0), "off in"),
    "no correction": (PLAIN, Flaws(scale=0.0), "silence"),
    "a tenth too little": (PLAIN, Flaws(scale=0.9), "ends"),
    "skips G91": (PLAIN, Flaws(ignores_g91=True), ""),
    "drops a block": (PLAIN, Flaws(drops=5), ""),
    "drops the last": (PLAIN, Flaws(drops=16), ""),
    "repeats a block": (PLAIN, Flaws(repeats=11), ""),
    "leaves a block": (PLAIN, Flaws(leaves=7), "silence"),
    "forgets an axis": (PLAIN, Flaws(skips_axis="Z"), ""),
    "too coarse": (PLAIN, Flaws(decimals=2), "off in"),
    "another feed": (PLAIN, Flaws(changes_feed=True), "feed"),
    "a comment in another place": (PLAIN, Flaws(swaps=8), "COMMENT"),
    "a spindle start in another place": (PLAIN, Flaws(swaps=3), "S"),
    "arc ends without centres": (ARCS, Flaws(moves_arc_ends_only=True), "along the way"),
    "drops an arc": (ARCS, Flaws(drops=4), ""),
    "a crooked piece": (LONG, Flaws(pieces=40, piece_off=0.01), "inserted points"),
    "a piece in the wrong place": (LONG, Flaws(pieces=40, piece_off=3.0), ""),
    "split, F of inverse time kept": (INVERSE, Flaws(pieces=2), "inverse time"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_fixer_is_caught(verdict_of: Callable[..., Verdict], name: str) -> None:
    source, flaws, word = WRONG[name]
    verdict = verdict_of(source, flaws, Terms(tolerance=1e-3 if source is LONG else 2e-3))
    assert not verdict.right
    assert any(word in complaint for complaint in verdict.complaints), str(verdict)


@pytest.mark.parametrize(("feed", "said"), [("45", ""), ("90", "s for a turn")])
def test_a_turn_may_change_its_feed_mode_and_not_its_time(
    rs274: Callable[..., Canon], machine: Callable[[str], Machine], feed: str, said: str
) -> None:
    model = machine("five_bc")
    turn = "ABC"[model.rotary[0] - 3]
    start = f"G21 G90 G17\nG0 X0 Y0 Z10 {turn}0\nG93\n"
    slow = rs274(f"{start}G1 {turn}90 F0.5\nG94\nM2\n".encode())
    done = rs274(f"{start}G94 G1 {turn}90 F{feed}\nG93\nG94\nM2\n".encode())
    found = [
        each for each in judge(slow, done, model, Terms(passed=lambda _: True)).complaints if "COMMENT" not in each
    ]
    assert ["feed mode" in each or "s for " in each for each in found] == [True] * bool(said)
    assert all(said in each for each in found)


def test_motions_that_are_passed_by_rule_must_stay(verdict_of: Callable[..., Verdict]) -> None:
    assert verdict_of(PLAIN, Flaws(leaves=7), Terms(tolerance=2e-3, passed=lambda line: line == 8)).right
    touched = verdict_of(PLAIN, Flaws(), Terms(tolerance=2e-3, passed=lambda line: line == 8))
    assert any("passed by rule" in complaint for complaint in touched.complaints)


def test_refused_motions_are_counted_with_their_reason(verdict_of: Callable[..., Verdict]) -> None:
    verdict = verdict_of(PLAIN, Flaws(leaves=7), Terms(tolerance=2e-3, refused={8: "for a test"}))
    assert verdict.right, str(verdict)
    assert (verdict.refused, verdict.reasons["for a test"]) == (1, 1)
