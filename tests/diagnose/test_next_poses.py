"""Poses that tell two names apart: exchanged ones tell more than any dozen by chance, and the shortcut is exact."""

from __future__ import annotations

import numpy as np
import pytest

from measure.poses import machine, plan
from ncfix.diagnosis.discrimination import COUNT, TOLD_APART, Discrimination, chance, climbed, exchanged, worst
from ncfix.diagnosis.next_poses import (
    SURE_CHANCE,
    SURE_SQUARES,
    Proposal,
    axes_beyond,
    marked,
    new_tools,
    one_tool_more,
    poses_on_offer,
    stays_where_it_was,
    travels_of,
)
from ncfix.diagnosis.residual_data import residual_data
from ncfix.measure.instruments import Faults, simulate
from ncfix.measure.measurement import dumps
from ncfix.measure.plan import skeleton
from ncfix.measure.reader import reads

OFFERED, HEIGHT, WIDTH = 60, 3, 9
ROUNDING = 1e-8


@pytest.fixture(scope="module")
def contest() -> Discrimination:
    """An effect of which the old rows show only what the other can imitate."""
    random = np.random.default_rng(4)
    columns = random.normal(size=(OFFERED, HEIGHT, WIDTH)) * random.gamma(1.0, size=(OFFERED, 1, 1))
    signal = columns @ np.ones(WIDTH) + random.normal(size=(OFFERED, HEIGHT)) * random.gamma(0.5, size=(OFFERED, 1))
    old = random.normal(size=(200, WIDTH))
    seen = old @ np.ones(WIDTH)
    return Discrimination(old.T @ old + np.eye(WIDTH), old.T @ seen, float(seen @ seen), columns, signal)


def test_one_pose_more_is_what_a_new_fit_says(contest: Discrimination) -> None:
    rows = list(range(11))
    found = contest.told_with(rows)
    assert np.allclose(found[20:30], [contest.told([*rows, k]) for k in range(20, 30)], rtol=ROUNDING)


def test_more_poses_never_tell_less(contest: Discrimination) -> None:
    assert (contest.told_with([3, 5]) >= contest.told([3, 5]) - ROUNDING).all()


def test_exchanged_poses_beat_a_thousand_random_dozens(contest: Discrimination) -> None:
    rows = exchanged([[contest]], OFFERED)
    random = np.random.default_rng(0)
    by_chance = [contest.told(random.permutation(OFFERED)[:COUNT].tolist()) for _ in range(1000)]
    assert len(set(rows)) == COUNT
    assert contest.told(rows) > max(by_chance)


@pytest.fixture(scope="module")
def harder(contest: Discrimination) -> Discrimination:
    """Another, of which the same dozen tells little."""
    weak = 0.05
    return Discrimination(
        contest.matrix, weak * contest.vector, weak**2 * contest.square, contest.columns, weak * contest.signal[::-1]
    )


def test_the_worst_rival_of_a_name_counts(contest: Discrimination, harder: Discrimination) -> None:
    one, both = climbed([[contest]], list(range(COUNT))), climbed([[contest, harder]], list(range(COUNT)))
    assert worst([[contest, harder]], both)[0] > worst([[contest, harder]], one)[0]


def test_whichever_name_is_true(contest: Discrimination, harder: Discrimination) -> None:
    """Poses that tell the first name from the second surely, and the second from the first hardly, leave half open."""
    rounds = [[contest], [harder]]
    one, both = climbed([[contest]], list(range(COUNT))), climbed(rounds, list(range(COUNT)))
    assert chance(worst(rounds, both)).mean() > chance(worst(rounds, one)).mean() + 0.1


def test_poses_beyond_the_travels_measured_are_marked_in_the_file() -> None:
    known = machine("three_axis")
    poses = plan(known, "tcp", 20)
    measured = {"X": (100.0, 120.0), "Y": (-500.0, 500.0), "Z": (-500.0, 500.0)}
    travels = travels_of(known, measured)
    low, high = known.axes[known.axis_names.index("X")].range
    assert travels["X"] == (low, high)
    assert travels_of(known, measured, {"X"})["X"] == (100.0, 120.0)
    beyond = axes_beyond(poses, measured)
    assert beyond == ("X",)
    text = dumps(marked(poses, beyond), ("dx",))
    assert "# note: X beyond the travels measured so far" in text
    assert reads(text.replace(",\n", ",0\n").encode(), known).headers[-1][0] == "note"
    assert "(X BEYOND THE TRAVELS MEASURED SO FAR" in skeleton(marked(poses, beyond), known)
    assert marked(poses, ()) is poses


def test_one_tool_more_differs_as_much_as_tools_do() -> None:
    assert one_tool_more((114.0,)) == (114.0, 300.0)
    assert one_tool_more((275.0,)) == (275.0, 100.0)
    assert one_tool_more((114.0, 180.0)) == (114.0, 180.0, 300.0)
    assert one_tool_more((90.0, 280.0)) == (90.0, 280.0)  # neither a short nor a long one would tell more
    assert one_tool_more((0.0,)) == (0.0, 100.0)  # nobody said how long it is


def test_a_tool_that_was_not_used_is_marked_in_the_file() -> None:
    poses = plan(machine("three_axis"), "tcp", 20)
    used = np.unique(poses.column("tool_length"))
    assert new_tools(poses, used) == ()
    assert new_tools(poses, used[:1]) == tuple(used[1:])
    text = dumps(marked(poses, ("X",), (300.0,)), ("dx",))
    assert "check the clearance; tool of 300 mm: or another one that differs as much" in text


def test_the_chance_of_one_name_is_that_of_odds_that_scatter() -> None:
    random = np.random.default_rng(0)
    for told in (TOLD_APART, 12.0, SURE_SQUARES):
        # the log odds of two names whose predictions are told apart by t: half the difference of two sums of squares
        apart = np.sqrt(told / 36) * np.ones(36)
        noise = random.normal(size=(20_000, 36))
        odds = ((noise - apart) ** 2 - noise**2).sum(axis=1) / 2
        assert chance(told) == pytest.approx(float((odds > np.log(20)).mean()), abs=0.015)  # 4 s of 20 000 draws
    assert chance(SURE_SQUARES) == pytest.approx(SURE_CHANCE, abs=0.005)
    assert Proposal("EYZ", None, 1.0, 11.0, 0.7, "", ()).times == 2
    assert Proposal("EYZ", None, 1.0, 25.0, 0.9, "", ()).times == 1
    assert Proposal("EYZ", None, 1.0, 25.0, 0.5, "", (), stuck=("EAZ",)).times is None


def test_the_tip_stays_where_it_was_whatever_the_tool() -> None:
    """With a tool so much longer the same axis positions would lead into the table."""
    known = machine("wCBXFZYSt")
    short = plan(known, "tcp", 60)
    short = short.with_columns({"tool_length": np.full(60, 100.0)})
    seen = residual_data([simulate(short, known, Faults(1.0), 1)], known)
    offered = poses_on_offer(seen, seen.measured.spans, (100.0, 300.0))
    assert set(offered.column("tool_length")) == {100.0, 300.0}
    assert stays_where_it_was(seen, offered).all()
    tips = known.tip(offered.positions(known), offered.column("tool_length"))
    been = known.tip(short.positions(known), short.column("tool_length"))
    assert (tips.min(axis=0) >= been.min(axis=0) - 0.05).all()  # what the file's errors make of a pose, and more
    assert "the tool tip beyond the travels" in dumps(marked(short, (), (), True), ("dx",))


def test_the_tip_of_a_shorter_tool_may_go_wherever_these_travels_lead() -> None:
    """Where it was, half of Z is out of its reach; no shorter tool hits what a longer one did not."""
    known = machine("wCBXFZYSt")
    long = plan(known, "tcp", 60).with_columns({"tool_length": np.full(60, 250.0)})
    seen = residual_data([simulate(long, known, Faults(1.0), 1)], known)
    low, high = seen.measured.spans["Z"]
    offered = poses_on_offer(seen, seen.measured.spans, (100.0, 250.0), roaming=True)
    short = offered.column("tool_length") == 100.0
    assert np.ptp(offered.column("Z")[short]) > 0.95 * (high - low)
    assert stays_where_it_was(seen, offered.rows(np.flatnonzero(~short))).all()
    assert not stays_where_it_was(seen, offered).all()
