"""Two programs compared on a machine with play, against the play of guideways followed by brute force.

As an axis turns round, its body stays until the play is taken up, so that between both sides it is where it was. That
is followed here from point to point of both paths, so dense that none is missed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree

from compensate.side import compared
from compensate.test_comparison import fixed, largest, moves_of
from conftest import some
from ncfix.compensate.figures.backlash import BacklashBodies
from ncfix.compensate.figures.curve import Stretches
from ncfix.compensate.plan.intent import Intent
from ncfix.control.moves import MotionKind, Moves
from ncfix.machine import Machine, State, load
from ncfix.machine.axes import Effect
from ncfix.machine.basis import Backlash

PLAY = {"X": 7.2e-3, "Y": -7.2e-3, "Z": -4e-3}
"""mm: what the error changes by as the axis turns from minus to plus; the body of X, a table, goes the other way."""
DENSE, CLOSE = 0.05, 1e-3
"""mm from point to point, and where an axis may take up its play."""
AGREED = 3e-5
"""mm: the parabolas are within 0.02 um of the path; the corner of a path that is cut off by the points of the brute
force, where it is taken up that an axis has play, is less than a hundredth of `CLOSE`."""
AROUND, FIRST = 150, 10
"""Lines near to a point that are looked at: those of three steps that take up play, and of two cuts; and at first."""
LARGEST = 25.0
"""mm: the largest radius."""
HALF_A_PER_CENT = 5e-3
"""Share of distances beyond the tolerance by which they may be missed."""
LIMIT = 1e-3
"""mm: the tolerance; distances below are upper bounds."""


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    straight = load(str(root / "examples/machines/wCBXFZYSt.toml"))
    effects = [each for each in straight.effects if not each.basis.needs_direction]
    plays = [Effect(f"E{axis}{axis}", (play,), Backlash()) for axis, play in PLAY.items()]
    return straight.replace(effects=(*effects, *plays))


@pytest.fixture(scope="module")
def texts(machine: Machine) -> tuple[str, str]:
    """A zigzag in which axes turn round in each corner, or rest, and what is made of it."""
    corners = [f"G1 X{20 + 20 * (k % 2)} Y{10 + 0.5 * k + 3 * (k % 3)} Z{-(k % 5)}" for k in range(24)]
    rests = [f"G1 Y{30 + 8 * (k % 3)}\nG1 X{20 + 3 * k}" for k in range(8)]
    text = "\n".join(["G21 G90 G94 G17 F900", "G0 X20 Y5 Z5", *corners, *rests, "M2", ""])
    return text, fixed(text, machine)


@dataclass(frozen=True)
class Dense:
    """Points (n, 3) mm of a path, and which of the lines that lead to them from the one before are cut, (n,)."""

    points: np.ndarray
    cut: np.ndarray


def made(machine: Machine, moves: Moves) -> Dense:
    """The real path of what is cut behind the first motion: a body follows its axis as soon as the play is taken up."""
    places, cut, segments = [moves.end[:1]], [False], Intent(machine, moves, State()).segments
    for row in range(1, len(moves)):
        length = np.abs(moves.end[row] - moves.start[row]).max()
        if moves.kind[row] == MotionKind.ARC:
            share = np.linspace(0, 1, int(abs(moves.sweep[row]) * LARGEST / CLOSE / 20) + 20)
        else:
            close = np.arange(0, min(length, 10 * CLOSE), CLOSE) / max(length, CLOSE)
            share = np.union1d(np.linspace(0, 1, int(length / DENSE) + 20), close)
        places.append(segments.at(np.full(len(share) - 1, row), share[1:]))
        cut += [bool(moves.cutting[row])] * (len(share) - 1)
    q = np.concatenate(places)
    sides = np.zeros(q.shape)
    for axis, play in PLAY.items():
        column, side = machine.axis_names.index(axis), 0.0
        for k, way in enumerate(np.diff(q[:, column]) * 2 / abs(play)):
            side = min(1.0, max(-1.0, side + way))
            sides[k + 1, column] = side
    tip = machine.actual_tip(q, State(direction=sides))
    rests = np.append(False, np.linalg.norm(np.diff(tip, axis=0), axis=1) < 1e-9) & np.array(cut)
    return Dense(tip[~rests], np.array(cut)[~rests])


def meant(machine: Machine, moves: Moves) -> Dense:
    return made(machine.replace(effects=()), moves)


def farthest(path: Dense, other: Dense) -> float:
    """The largest distance of points of what is cut of one path from the lines that are cut of the other, mm."""
    points = path.points[path.cut | np.append(path.cut[1:], False)]
    begin, end = other.points[:-1][other.cut[1:]], other.points[1:][other.cut[1:]]
    way = end - begin
    square = np.maximum((way**2).sum(axis=1), 1e-30)
    tree = KDTree((begin + end) / 2)

    def distances(points: np.ndarray, lines: int) -> np.ndarray:
        found = np.full(len(points), np.inf)
        for each in tree.query(points, k=lines)[1].T:
            share = np.clip(((points - begin[each]) * way[each]).sum(axis=1) / square[each], 0, 1)
            found = np.minimum(found, np.linalg.norm(points - begin[each] - share[:, None] * way[each], axis=1))
        return found

    return largest(distances, points, FIRST, AROUND)


def truth(machine: Machine, original: Moves, other: Moves) -> tuple[float, float]:
    path, done = meant(machine, original), made(machine, other)
    return farthest(done, path), farthest(path, done)


def test_what_is_corrected_is_right(machine: Machine, texts: tuple[str, str]) -> None:
    before, after = (moves_of(text, machine) for text in texts)
    _, there, back = compared(machine, before, after, LIMIT)
    expected = truth(machine, before, after)
    assert max(expected) < LIMIT
    assert there.max < LIMIT
    assert back.max < LIMIT
    assert not there.lines_beyond


@pytest.mark.parametrize("size", [-3e-3, 3e-3])
def test_a_fault_is_found_wherever_it_is(machine: Machine, texts: tuple[str, str], size: float) -> None:
    """Square to the path, of less than the play, on a motion and at its ends."""
    before, after = (moves_of(text, machine) for text in texts)
    column = machine.axis_names.index("Z")
    for row in range(3 if size > 0 else 30, len(after) - 1, 54):
        end, start = after.end.copy(), after.start.copy()
        end[row, column] += size
        start[row + 1, column] += size
        wrong = replace(after, start=start, end=end)
        _, there, back = compared(machine, before, wrong, LIMIT)
        expected = truth(machine, before, wrong)
        found = max(there.max, back.max)
        assert found < LIMIT if max(expected) < LIMIT else found == pytest.approx(max(expected), abs=AGREED)


def test_steps_that_take_up_play_are_missed(machine: Machine, texts: tuple[str, str]) -> None:
    """Without one of them an axis is off by its play, from there to where it turns round again."""
    lines = texts[1].splitlines()
    steps = [k for k, line in enumerate(lines) if line.startswith("G1 X") and 6 < k < 50]
    before = moves_of(texts[0], machine)
    for at in steps[::12]:
        after = moves_of("\n".join(lines[:at] + lines[at + 1 :]) + "\n", machine)
        _, there, back = compared(machine, before, after, LIMIT)
        expected = truth(machine, before, after)
        assert (there.max, back.max) == pytest.approx(expected, abs=AGREED)
        assert max(expected) > LIMIT


@pytest.mark.parametrize("seed", range(some(3)))
def test_arcs_and_rapids_and_several_axes_that_turn_at_once(machine: Machine, seed: int) -> None:
    """Arcs on which axes turn round, just behind their begin, too, and rapids in which corrections turn axes round."""
    rng, at = np.random.default_rng(seed), np.array([20.0, 20.0, 0.0])
    lines = ["G21 G90 G94 G17 F900", "G0 X20 Y20 Z5", "G1 Z0"]
    for turn in range(5):
        radius, angle, sweep = rng.uniform(2, LARGEST), rng.uniform(0, 2 * np.pi), rng.choice([0.05, 0.4, 3.0])
        centre = at[:2] - radius * np.array([np.cos(angle), np.sin(angle)])
        end = centre + radius * np.array([np.cos(angle + sweep), np.sin(angle + sweep)])
        (i, j), (x, y) = centre - at[:2], end
        lines.append(f"G3 X{x:.4f} Y{y:.4f} I{i:.4f} J{j:.4f}")
        at = np.array([x, y, 0.0]) + rng.uniform(2, 9, 3) * rng.choice([-1, 1]) * rng.choice([1, 1, -1], 3)
        at = np.round(np.clip(at, [0, 0, -20], [40, 40, 20]), 3)
        x, y, z = at
        lines.append(f"G1 X{x:.3f} Y{y:.3f} Z{z:.3f}")
        lines += [f"G0 Z{z + 4:.3f}", f"G0 X{x + 3:.3f} Y{y:.3f}", f"G1 Z{z:.3f}", f"X{x:.3f}"] if turn % 3 == 2 else []
    text = "\n".join([*lines, "M2", ""])
    before, after = (moves_of(each, machine) for each in (text, fixed(text, machine)))
    first, there, back = compared(machine, before, after, LIMIT)
    assert max(truth(machine, before, after)) < LIMIT
    assert max(there.max, back.max) < LIMIT
    assert first.max == pytest.approx(truth(machine, before, before)[0], rel=HALF_A_PER_CENT)


def test_a_lift_within_one_cut_is_missed(machine: Machine) -> None:
    """A tenth of a millimetre, at 30 per cent of a straight cut, between two places at which a cut is looked at."""
    head, lift = ["G21 G90 G94 G17 F900", "G0 X5 Y5 Z5", "X10 Y20", "G1 Z0"], ["G1 X52", "G0 Z5", "X52.1", "Z0"]
    plain, lifted = ("\n".join([*head, *cuts, "G1 X150", "Y120", "X50", "M2", ""]) for cuts in ([], lift))
    before, after = moves_of(lifted, machine), moves_of(fixed(plain, machine), machine)
    _, there, _ = compared(machine, before, after, LIMIT)
    assert there.max == pytest.approx(0.05, abs=LIMIT), "half of it, from where the cut ends"
    where, column = there.where, machine.axis_names.index("X")
    assert after.start[where, column] < 52 < after.end[where, column]


def test_play_that_is_taken_up_where_a_motion_ends_divides_none(machine: Machine) -> None:
    """Steps as long as the play, of a machine without other errors, at places of all sizes."""
    alone = machine.replace(effects=tuple(each for each in machine.effects if each.basis.needs_direction))
    steps = [f"G1 X{at}\nX{at - 0.0072:.4f}\nY{k}\nX{at - 3}" for k, at in enumerate((20, 30, 7, 45, 100, 17))]
    intent = Intent(
        alone, moves_of("\n".join(["G21 G90 G94 G17 F900", "G0 X5 Y5 Z5", *steps, "M2", ""]), alone), State()
    )
    stretches = BacklashBodies.of(intent, Stretches.of(intent), None).divided()
    assert (stretches.stop - stretches.start).min() > 1e-6
