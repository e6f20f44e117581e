"""Fewest pieces: known minima of analytic cases, an exhaustive search on small grids, and symmetry."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from compensate.machines_at_random import perfect
from compensate.motions import Arc, changed, dense_errors, motions, plan
from ncfix.compensate.plan.splitting import PathNodes, fewest
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.machine import Effect, Machine, State
from ncfix.machine.basis import Backlash, Polynomial
from ncfix.machine.piecewise import PiecewiseLinear

TOLERANCE = 1e-3
USED = 0.98 * TOLERANCE
"""Two hundredths are held back for what happens between samples."""


def x_axis(*effects: Effect) -> Machine:
    return perfect("w F X Y Z t").replace(effects=effects)


def bow(size: float) -> Machine:
    """X has a positioning error that is a parabola: `size` mm at the ends of +-250 mm, 0 in the middle."""
    return x_axis(Effect("EXX", (size,), Polynomial((2,)), 0.0, 250.0))


@pytest.mark.parametrize("size", [0.003, 0.01, 0.05, 0.2])
def test_a_parabola_takes_as_many_pieces_as_it_must(size: float) -> None:
    """A chord over a part h of the whole way is off by h^2 times the arrow of the whole, which is `size` over +-250.

    The straight piece deviates from the corrected path (the mirrored parabola) by that, so h = sqrt(tolerance / size).
    """
    machine = bow(size)
    moves = motions(machine, (-250, 0, 0), [(-250, 0, 0), (250, 0, 0)])
    pieces = plan(machine, moves, get_strategy("position"), TOLERANCE).pieces
    least = int(np.ceil(1 / np.sqrt(USED / size)))
    assert np.count_nonzero(pieces.move == 1) == least


def test_a_kink_takes_one_more_piece_at_the_kink() -> None:
    machine = x_axis(Effect("EXX", (0.0, 0.05, 0.0), PiecewiseLinear((-250.0, 37.0, 250.0))))
    moves = motions(machine, (-250, 0, 0), [(-250, 0, 0), (250, 0, 0)])
    pieces = plan(machine, moves, get_strategy("position"), TOLERANCE).pieces
    last = pieces.fraction[pieces.move == 1]
    assert len(last) == 2
    assert abs(last[0] * 500 - 250 - 37) < 500 * (2 * USED / 0.05), "as near to the kink as the tolerance asks"


def test_a_reversal_with_play_takes_one_piece_to_take_it_up() -> None:
    machine = x_axis(Effect("EXX", (0.01,), Backlash()))
    moves = motions(machine, (0, 0, 0), [(10, 0, 0), (20, 0, 0), (5, 0, 0), (0, 0, 0)])
    result = plan(machine, moves, get_strategy("position"), TOLERANCE)
    counts = np.bincount(result.pieces.move)
    assert counts.tolist() == [2, 1, 2, 1]
    taking_up = np.flatnonzero(result.pieces.fraction < 1e-6)
    np.testing.assert_allclose(result.pieces.end[taking_up[1], 0] - 20, 0.005, atol=1e-5)
    shares = np.bincount(result.pieces.move, result.pieces.share)
    np.testing.assert_allclose(shares, 1.0)
    assert (result.pieces.share > 1e-6).all(), "no feed runs away in inverse time"


def test_within_the_tolerance_nothing_is_split() -> None:
    machine = bow(0.9 * USED)
    moves = motions(machine, (-250, 0, 0), [(-250, 0, 0), (250, 0, 0)])
    assert len(plan(machine, moves, get_strategy("position"), TOLERANCE).pieces) == 2


def test_a_circle_that_has_to_be_straightened_has_the_pieces_of_its_arrow() -> None:
    """Where the control accepts no arc: chords that leave a circle of 50 mm by the tolerance."""
    machine = x_axis(Effect("EXX", (0.05,), Polynomial((1,)), 0.0, 250.0))
    moves = motions(machine, (50, 0, 0), [(50, 0, 0), Arc((0, 0, 0), (0, 0, 1), 2 * np.pi)])
    from ncfix.compensate.plan.arcs import Closure

    pieces = plan(machine, moves, get_strategy("position"), TOLERANCE, Closure(-1.0, 0.0)).pieces
    angle = 2 * np.arccos(1 - USED / 50)
    least = int(np.ceil(2 * np.pi / angle))
    assert least <= np.count_nonzero(pieces.move == 1) <= 1.04 * least + 1, "ends stand on a grid of 32 to a piece"
    assert not pieces.arc.any()


def test_reversing_a_path_takes_as_many_pieces() -> None:
    machine = x_axis(
        Effect("EXX", (0.02, -0.05, 0.03), Polynomial((2, 3, 5)), 0.0, 250.0),
        Effect("EYX", (0.03, 0.02), Polynomial((2, 4)), 30.0, 250.0),
    )
    points = [(-240, 0, 0), (230, 10, 0), (-100, 60, 20)]
    there = plan(machine, motions(machine, points[0], points), get_strategy("position"), TOLERANCE)
    back = plan(machine, motions(machine, points[-1], points[::-1]), get_strategy("position"), TOLERANCE)
    counts = [np.bincount(each.pieces.move)[1:] for each in (there, back)]
    assert np.abs(counts[0] - counts[1][::-1]).max() <= 1
    assert counts[0].max() > 5


# -- the search itself ------------------------------------------------------------------------------------------------


def grid_of(curves: list[np.ndarray]) -> PathNodes:
    """One-axis motions with these exact corrections at even nodes."""
    counts = np.array([len(curve) for curve in curves], dtype=np.intp)
    fraction = np.concatenate([np.linspace(0, 1, n) for n in counts])
    follow = np.zeros((len(fraction), 3, 1))
    follow[:, 0, 0] = 1.0
    return PathNodes(counts, fraction, np.concatenate(curves)[:, None], follow)


def exhaustive(curve: np.ndarray, tolerance: float) -> int:
    """The fewest pieces by trying everything."""
    n = len(curve)
    x = np.arange(n, dtype=float)

    def fits(a: int, b: int) -> bool:
        line = np.interp(x[a : b + 1], [a, b], curve[[a, b]])
        return bool(np.abs(line - curve[a : b + 1]).max() <= tolerance)

    for count in range(1, n):
        for inner in itertools.combinations(range(1, n - 1), count - 1):
            cuts = [0, *inner, n - 1]
            if all(fits(a, b) for a, b in itertools.pairwise(cuts)):
                return count
    raise AssertionError


def test_no_way_with_fewer_pieces_exists_on_small_grids_of_convex_and_wavy_curves() -> None:
    rng = np.random.default_rng(0)
    x = np.linspace(0, 1, 12)
    curves = [a * x**2 + b * x**3 for a, b in rng.uniform(0, 1, (15, 2))]
    curves += [np.sin(w * x + p) for w, p in rng.uniform(1, 6, (15, 2))]
    ends, _ = fewest(grid_of(curves), 0.02)
    found = [int(part.sum()) for part in np.split(ends, np.cumsum([12] * 29))]
    assert found == [exhaustive(curve, 0.02) for curve in curves]


def test_every_piece_keeps_the_tolerance_or_has_no_node_inside() -> None:
    rng = np.random.default_rng(1)
    curves = [np.cumsum(rng.normal(size=200)) for _ in range(20)]
    grid = grid_of(curves)
    ends, worst = fewest(grid, 1.0)
    assert worst.max() <= 1.0
    for curve, part in zip(curves, np.split(ends, 20), strict=True):
        cuts = np.concatenate([[0], np.flatnonzero(part)])
        assert cuts[-1] == 199
        line = np.interp(np.arange(200), cuts, curve[cuts])
        assert np.abs(line - curve).max() <= 1.0


def test_deviations_in_command_space_are_those_of_the_machine() -> None:
    """The search judges by commands; the exact model agrees."""
    machine = bow(0.05)
    moves = motions(machine, (-250, 0, 0), [(-250, 0, 0), (250, 0, 0)])
    result = plan(machine, moves, get_strategy("position"), TOLERANCE, state=State())
    measured = np.nanmax(dense_errors(machine, moves, result)[1:])
    assert abs(result.deviation[1] - measured) < 0.02 * TOLERANCE


def test_nothing_is_split_under_cutter_compensation() -> None:
    machine = bow(0.05)
    moves = motions(machine, (-250, 0, 0), [(-250, 0, 0), (250, 0, 0)])
    moves = changed(moves, whole=np.ones(2, dtype=bool))
    result = plan(machine, moves, get_strategy("position"), TOLERANCE)
    assert len(result.pieces) == 2
    assert [(finding.code, finding.moves.tolist()) for finding in result.findings] == [("NCF413", [1])]
