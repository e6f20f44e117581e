"""The studies of docs/accuracy.md in small: the page has them in full, `make accuracy` works them out."""

from __future__ import annotations

import os

import numpy as np
import pytest

from conftest import FULL
from diagnose.tables import put
from validation import accuracy, plans, random_chains, round_trips

QUICK = (0, 1, 2, 3, 4, 5, 6, 7, 9, 10, 11)
"""Chains whose formulas take a second or so; some of four revolute joints, or three skew ones, take a minute."""
CHAINS = range(int(os.environ["NCFIX_CHAINS"])) if "NCFIX_CHAINS" in os.environ else QUICK
DRAWS = int(os.environ.get("NCFIX_DRAWS", "4" if FULL else "2"))
EXACT = 1e-12
"""Relative: a few dozen products in double precision."""


def test_round_trips_of_all_instruments(figures):
    """Of normal errors 99.73 % are within 3 sigma; of 2,000 to 6,000 estimates at least 99 % are."""
    found = [round_trips.round_trip("wCBXFZYSt", kind, DRAWS) for kind in round_trips.KINDS]
    errors = np.concatenate([each.errors for each in found])
    squares = np.array([each.squares.mean() for each in found])
    figures(f"round trips: {len(errors)} estimates, {100 * (np.abs(errors) < 3).mean():.2f} % within 3 sigma")
    assert (np.abs(errors) < 3).mean() > 0.99
    assert 0.9 < squares.mean() < 1.1


@pytest.mark.parametrize("seed", CHAINS)
def test_random_chains(seed):
    found = random_chains.compare(seed)
    assert max(found.composed, found.turned, found.nominal, found.first, found.rotated) < EXACT
    assert np.isnan(found.ratio) or abs(found.ratio - 4) < 0.05


def test_forty_planned_poses_of_an_r_test_beat_all_random_ones(figures):
    """The linear axes follow from the rotary ones, so there is less to choose from: better than the luckiest draw."""
    case = plans.CASES[5]
    found = plans.compared(case)
    figures(f"R-test of 40 poses, {case.machine}: variance {found.ratio:.1f} times lower than at random")
    assert found.planned < found.luckiest


def test_forty_planned_poses_beat_forty_random_ones(figures):
    """Worst prediction variance at least 3 times lower, median over 20 draws."""
    case = plans.CASES[0]
    found = plans.compared(case)
    figures(f"plan of 40 poses, {case.machine}: variance {found.ratio:.1f} times lower than at random")
    assert found.ratio > 3
    # within a quarter of the best that there can be
    assert found.planned < 1.25 * found.bound


def test_a_study_writes_its_table_into_the_page_and_nothing_else(tmp_path, root):
    text = (root / "docs" / "accuracy.md").read_text()
    page = tmp_path / "accuracy.md"
    page.write_text(text)
    for name in accuracy.STUDIES:
        put(str(page), name, ["| another |"])
    again = page.read_text()
    assert again.count("| another |") == len(accuracy.STUDIES)
    for name in accuracy.STUDIES:
        begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
        put(str(page), name, [text[text.index(begin) + len(begin) + 1 : text.index(end) - 1]])
    assert page.read_text() == text
