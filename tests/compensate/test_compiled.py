"""Compiled searches do what the plain ones do, and what is known of ends is what a look at them finds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compensate.motions import motions, path_error, plan
from compensate.test_stream import OPTIONS, program, whole
from conftest import require_core, some
from ncfix import core
from ncfix.compensate.figures.curve import Curve, CurvePoints, arc_lengths
from ncfix.compensate.figures.nearest import Search
from ncfix.compensate.plan.deviation import bounds, deviations_seen, samples, starts_to_check
from ncfix.compensate.plan.ends import corrected
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.sampling import bends, bends_closely, features
from ncfix.compensate.plan.segments import Segments
from ncfix.compensate.plan.splitting import STRETCH, PathNodes, fewest
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.compensate.plan.written import Known, WrittenPieces
from ncfix.machine import Machine, State, load
from ncfix.machine.se3 import Array

PM = 1e-9


def grid(rng: np.random.Generator, motions: int, most: int = 200) -> PathNodes:
    """Motions that bow to and fro, from 1 um to 0.1 mm."""
    counts = rng.integers(2, most, motions)
    fraction = np.concatenate([np.linspace(0, 1, count) for count in counts])
    phase = np.repeat(rng.uniform(0, 6, motions), counts)
    size = 10 ** np.repeat(rng.uniform(-3, -1, motions), counts)
    command = np.stack([size * np.sin(6 * k * fraction + phase) for k in range(1, 6)], axis=1)
    follow = np.zeros((len(fraction), 3, 5))
    follow[:, :, 2:] = np.linalg.qr(rng.normal(size=(len(fraction), 3, 3)))[0]
    return PathNodes(counts.astype(np.intp), fraction, command, follow)


@pytest.mark.parametrize("most", [200, 5 * STRETCH])
@pytest.mark.parametrize("seed", range(some(6)))
def test_fewest_pieces(seed: int, most: int) -> None:
    require_core()
    nodes = grid(np.random.default_rng(seed), 40, most)
    plain = fewest(nodes, 0.002)
    core.use("compiled")
    for found, expected in zip(fewest(nodes, 0.002), plain, strict=True):
        assert np.array_equal(found, expected)


def wandering(rng: np.random.Generator, k: int, off: float) -> Curve:
    """Parabolas of all lengths with holes among them and gaps between them, and up to `off` mm beside where it was."""
    shift = np.random.default_rng(7)
    size = shift.choice([0.0, 1e-4, 0.01, 0.3, 5.0], k, p=[0.2, 0.1, 0.2, 0.4, 0.1])
    way = np.cumsum(size[:, None] * shift.normal(size=(k, 3)), axis=0)
    end = way + off * rng.normal(size=(k, 3))
    begin = np.vstack([np.zeros((1, 3)), end[:-1]])
    opens = shift.random(k) < 0.2
    begin[opens] += 0.2
    hole = size == 0
    begin[hole], opens[hole] = end[hole], True
    middle = (begin + end) / 2 + 0.05 * size[:, None] * shift.normal(size=(k, 3))
    return Curve(np.arange(k), np.zeros(k), np.ones(k), begin, middle, end, opens, arc_lengths(begin, middle, end))


@pytest.mark.parametrize("near", [1e-5, 0.01, np.inf])
@pytest.mark.parametrize("seed", range(4))
def test_nearest_points(seed: int, near: float) -> None:
    require_core()
    rng = np.random.default_rng(seed)
    curve, other = wandering(rng, 500, 0.0), wandering(rng, 500, 10.0 ** -rng.integers(1, 6))
    at = CurvePoints.of(other)
    expected = other.way(at.piece, at.share)
    plain = Search(curve, near).around(at.points, expected)
    core.use("compiled")
    found = Search(curve, near).around(at.points, expected)
    for column in ("piece", "share", "gap"):
        assert np.array_equal(getattr(found, column), getattr(plain, column)), column


def winding(machine: Machine, n: int, step: float) -> Intent:
    """A path that winds about with steps of `step` mm and hundredths of them in rad."""
    rng = np.random.default_rng(n)
    ways = np.where(machine.rotary, 0.01, 1.0) * step * rng.uniform(-1, 1, (n, len(machine.axes)))
    low, high = np.where(np.isfinite(machine.ranges.T), machine.ranges.T, [[-3.0], [3.0]])
    places = np.clip((low + high) / 2 + np.cumsum(ways, axis=0), low + 1e-3, high - 1e-3)
    moves = motions(machine, tuple(places[0].tolist()), [tuple(row.tolist()) for row in places[1:]])
    return Intent(machine, moves, State())


@pytest.mark.parametrize(("step", "passing"), [(0.5, 0.95), (20.0, 0.0)])
def test_no_look_finds_more_than_the_bound(root: Path, step: float, passing: float) -> None:
    """Motions between exactly corrected ends; short ones are all within the tolerance by the bound alone."""
    machine = load(root / "benchmarks" / "five_axis.toml")
    intent = winding(machine, 300, step)
    moves = intent.moves
    done = get_strategy("position").solve(machine, moves.end, State(100.0)).q
    start = np.concatenate([moves.start[:1], done[:-1]])
    real = replace(Segments.of_moves(moves, intent.columns), start=start, end=done)
    rows, check_start = np.arange(1, len(moves)), starts_to_check(intent, np.zeros(len(moves), dtype=bool))
    bound, found = (
        bounds(intent, real, rows, check_start),
        deviations_seen(intent, real, rows, check_start, 8, 15, bends(intent, rows)),
    )
    assert (found <= bound).all()
    assert (bound < 2.5e-3).mean() >= passing
    assert found.max() > 1e-8


@pytest.mark.parametrize(
    "name", ["benchmarks/five_axis", "examples/machines/angle_head", "examples/machines/wCAYFXZSt"]
)
@pytest.mark.parametrize("step", [0.2, 3.0, 20.0])
def test_no_look_at_a_led_tip_finds_more_than_the_bound(root: Path, name: str, step: float) -> None:
    """The same under tool-centre-point control, where linear axes do not move evenly."""
    machine = load(root / f"{name}.toml")
    wound = winding(machine, 300, step)
    intent = replace(wound, moves=replace(wound.moves, tcp=np.ones(len(wound.moves), dtype=bool)))
    moves, rows = intent.moves, np.arange(1, len(wound.moves))
    done = corrected(intent, get_strategy("position"), np.arange(len(moves))).wanted
    real = replace(Segments.of_moves(moves, intent.columns), start=np.vstack((moves.start[:1], done[:-1])), end=done)
    check_start = starts_to_check(intent, np.zeros(len(moves), dtype=bool))
    bound, found = (
        bounds(intent, real, rows, check_start),
        deviations_seen(intent, real, rows, check_start, 8, 15, bends(intent, rows)),
    )
    assert np.isfinite(bound).mean() > 0.5
    assert (found <= bound).all()
    assert found.max() > 1e-8


@pytest.mark.parametrize(
    "name", ["benchmarks/five_axis", "examples/machines/angle_head", "examples/machines/wCAYFXZSt"]
)
@pytest.mark.parametrize("step", [3.0, 60.0, 300.0])
def test_a_led_tip_is_looked_at_as_often_as_its_axes_have_to_go(root: Path, name: str, step: float) -> None:
    """What `bends_closely` says is never less than the way that axes go, seen in 2,000 places of each motion.

    But for what `bends` says: that is rough, and counts the way of the tip, where the axes go along other directions.
    """
    machine = load(root / f"{name}.toml")
    wound = winding(machine, 40, step)
    intent = replace(wound, moves=replace(wound.moves, tcp=np.ones(len(wound.moves), dtype=bool)))
    rows, places = np.arange(1, len(wound.moves)), np.linspace(0.0, 1.0, 2001)
    on_way = intent.joints_at(np.repeat(rows, len(places)), np.tile(places, len(rows))).reshape(
        len(rows), len(places), -1
    )
    gone = (np.abs(np.diff(on_way, axis=1)).sum(axis=1) / features(machine)).sum(axis=1)
    closely, roughly = bends_closely(intent, rows), bends(intent, rows)
    assert (closely >= np.minimum(gone, roughly) - 1e-9).all()  # rounding, 2,000 times
    assert (closely <= roughly).all()
    if step == 300.0 and name == "benchmarks/five_axis":
        assert (closely < roughly / 2).mean() > 0.5


def largest_on_each(written: WrittenPieces, known: Known | None) -> Array:
    """The largest tip error on each motion (2, n), mm, of the program and corrected."""
    found = np.zeros((2, len(written.intent.moves)))
    for part in samples(written, np.flatnonzero(~written.pieces.unchanged), known):
        np.maximum.at(found[0], part.move, part.before)
        np.maximum.at(found[1], part.move, part.after)
    return found


@pytest.mark.parametrize("name", ["benchmarks/five_axis", "examples/machines/wCAYFXZSt", "examples/machines/dmu50"])
@pytest.mark.parametrize("led", [False, True])
def test_figures_from_what_is_known(root: Path, name: str, led: bool) -> None:
    """What the correction found at ends is what a look at the ends finds, to a hundredth of a nanometre."""
    machine = load(root / f"{name}.toml")
    intent = winding(machine, 200, 0.1 if led else 0.4)
    intent = replace(intent, moves=replace(intent.moves, tcp=np.full(len(intent.moves), led)))
    planned = plan(machine, intent.moves, get_strategy("rotary-then-linear"), 0.005)
    assert planned.known is not None
    pieces = replace(planned.pieces, end=np.round(planned.pieces.end, 4))
    pieces.end[:, machine.rotary] = planned.pieces.end[:, machine.rotary]
    given = machine, intent.moves, pieces, planned.start
    looked, known = (path_error(*given, known=each) for each in (None, planned.known))
    assert known.before.max == pytest.approx(looked.before.max, abs=10 * PM)
    assert known.after.max == pytest.approx(looked.after.max, abs=10 * PM)
    assert known.after.rms == pytest.approx(looked.after.rms, abs=10 * PM)
    written = WrittenPieces(intent, pieces, planned.start)
    on_each = [largest_on_each(written, known=each) for each in (None, planned.known)]
    np.testing.assert_allclose(on_each[0], on_each[1], rtol=0, atol=10 * PM)
    assert known.samples == looked.samples


@pytest.mark.parametrize("strategy", ["rotary-then-linear", "full"])
@pytest.mark.parametrize("name", ["benchmarks/five_axis", "examples/machines/dmu50", "examples/machines/wCBXFZYSt"])
def test_programs_come_out_the_same(root: Path, name: str, strategy: str) -> None:
    """With arcs, cycles, increments and refusals, on machines with tables and with play."""
    require_core()
    machine, source = load(root / f"{name}.toml"), program(5, 60, 0.1)
    plain = whole(source, machine, replace(OPTIONS, strategy=strategy))[0]
    core.use("compiled")
    assert whole(source, machine, replace(OPTIONS, strategy=strategy))[0] == plain != source
