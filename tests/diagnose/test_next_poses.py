"""Poses that tell two names apart: exchanged ones tell more than any dozen by chance, and the shortcut is exact."""

from __future__ import annotations

import numpy as np
import pytest

from measure.poses import machine, plan
from ncfix.diagnose.contest import COUNT, Contest, climbed, exchanged
from ncfix.diagnose.next_poses import _beyond, _marked, _travels
from ncfix.measure.program import skeleton
from ncfix.measure.reader import reads
from ncfix.measure.writer import dumps

OFFERED, HEIGHT, WIDTH = 60, 3, 9
ROUNDING = 1e-8


@pytest.fixture(scope="module")
def contest() -> Contest:
    """An effect of which the old rows show only what the other can imitate."""
    random = np.random.default_rng(4)
    columns = random.normal(size=(OFFERED, HEIGHT, WIDTH)) * random.gamma(1.0, size=(OFFERED, 1, 1))
    signal = columns @ np.ones(WIDTH) + random.normal(size=(OFFERED, HEIGHT)) * random.gamma(0.5, size=(OFFERED, 1))
    old = random.normal(size=(200, WIDTH))
    seen = old @ np.ones(WIDTH)
    return Contest(old.T @ old + np.eye(WIDTH), old.T @ seen, float(seen @ seen), columns, signal)


def test_one_pose_more_is_what_a_new_fit_says(contest: Contest) -> None:
    rows = list(range(11))
    found = contest.told_with(rows)
    assert np.allclose(found[20:30], [contest.told([*rows, k]) for k in range(20, 30)], rtol=ROUNDING)


def test_more_poses_never_tell_less(contest: Contest) -> None:
    assert (contest.told_with([3, 5]) >= contest.told([3, 5]) - ROUNDING).all()


def test_exchanged_poses_beat_a_thousand_random_dozens(contest: Contest) -> None:
    rows, told = exchanged([contest], OFFERED)
    random = np.random.default_rng(0)
    chance = [contest.told(random.permutation(OFFERED)[:COUNT].tolist()) for _ in range(1000)]
    assert len(set(rows)) == COUNT
    assert told == pytest.approx(contest.told(rows), rel=ROUNDING)
    assert told > max(chance)


def test_the_worst_of_two_contests_counts(contest: Contest) -> None:
    other = Contest(contest.matrix, contest.vector, contest.square, contest.columns, contest.signal[::-1])
    rows, told = climbed([contest, other], list(range(COUNT)))
    assert told == pytest.approx(min(contest.told(rows), other.told(rows)), rel=ROUNDING)


def test_poses_beyond_the_travels_measured_are_marked_in_the_file() -> None:
    known = machine("three_axis")
    poses = plan(known, "tcp", 20)
    measured = {"X": (100.0, 120.0), "Y": (-500.0, 500.0), "Z": (-500.0, 500.0)}
    travels = _travels(known, measured)
    low, high = known.axes[known.axis_names.index("X")].range
    assert travels["X"] == (low, high)
    beyond = _beyond(poses, measured)
    assert beyond == ("X",)
    text = dumps(_marked(poses, beyond), ("dx",))
    assert "# note: X beyond the travels measured so far" in text
    assert reads(text.replace(",\n", ",0\n").encode(), known).headers[-1][0] == "note"
    assert "(X BEYOND THE TRAVELS MEASURED SO FAR" in skeleton(_marked(poses, beyond), known)
    assert _marked(poses, ()) is poses
