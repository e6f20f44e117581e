"""Two programs compared, against the same by brute force: points of both paths so dense that none is missed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree

from compensate.side import compared
from conftest import FULL, some
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import follow
from ncfix.control.moves import Moves
from ncfix.control.setup import Setup
from ncfix.machine import Machine, load
from ncfix.text.reader import read

SETUP = Setup(assume_zero=True)
HEAD = "G21 G90 G94 G17\nG0 X117.0 Y0 Z60\nG1 X117.05 Y0 Z7.15 B4.53 C{c} F2000\n"
DENSE = 0.06
"""mm from point to point on a path, at most."""
AT_ONCE = 500
"""Points, of those that may be the farthest."""
LEVER = 250.0
"""mm from the axes to the tip, at most."""
AGREED = 3e-5
"""mm: the parabolas are within 0.02 um of the path, and the distance between lines
from point to point, 0.06 mm apart on circles of 200 mm, and what they stand for, is less than 3e-6 mm."""


def unwinding(step: float = 1.7) -> str:
    """Short blocks, one in which C unwinds, short blocks, one that turns the other way for half a turn."""
    c = [5.1 - step * i for i in range(4)] + [358.4 - step * i for i in range(6)]
    c += [c[-1] - 180.0 - step * i for i in range(4)]
    lines = [
        f"X{117.05 + 0.36 * i:.4f} Z{7.15 - 0.03 * i:.4f} B{4.53 - 0.07 * i:.4f} C{at:.4f}" for i, at in enumerate(c)
    ]
    return HEAD.format(c=c[0]) + "\n".join(lines[1:]) + "\nM2\n"


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(str(root / "benchmarks/five_axis.toml"))


def moves_of(text: str, machine: Machine) -> Moves:
    return follow(read(text.encode(), "part", "linuxcnc"), machine, SETUP).trace.moves


def fixed(text: str, machine: Machine) -> str:
    return fix_program(read(text.encode(), "part", "linuxcnc"), machine, SETUP, FixOptions()).text.decode()


def dense(moves: Moves, rows: list[int]) -> np.ndarray:
    """Axis positions along straight motions."""
    found = []
    for row in rows:
        way = np.abs(moves.end[row] - moves.start[row]) * np.where(moves.rotary, LEVER, 1.0)
        at = np.linspace(0, 1, int(way.sum() / DENSE) + 10)[1 if found else 0 :, None]
        found.append(moves.start[row] + at * (moves.end[row] - moves.start[row]))
    return np.concatenate(found)


def farthest(path: np.ndarray, other: np.ndarray) -> float:
    """The largest distance of points of one path from the other, as lines from point to point, mm."""
    tree = KDTree(other)

    def distances(points: np.ndarray, lines: int) -> np.ndarray:
        _, near = tree.query(points, k=lines)
        found = np.full(len(points), np.inf)
        for each in (*near.T, *(near.T - 1)):
            a, b = (other[np.clip(each + k, 0, len(other) - 1)] for k in (0, 1))
            square = np.maximum(((b - a) ** 2).sum(axis=1), 1e-30)
            share = np.clip(((points - a) * (b - a)).sum(axis=1) / square, 0, 1)
            found = np.minimum(found, np.linalg.norm(points - a - share[:, None] * (b - a), axis=1))
        return found

    return largest(distances, path, 2, 8)


def largest(distances: Callable[[np.ndarray, int], np.ndarray], points: np.ndarray, few: int, lines: int) -> float:
    """The largest distance of points from the lines that are near to them, so many each.

    More lines bring a point only nearer: of most points a few say that they are not the farthest.
    """
    bounds = distances(points, few)
    order, found = np.argsort(-bounds), 0.0
    for k in range(0, len(order), AT_ONCE):
        if bounds[order[k]] <= found:
            break
        found = max(found, float(distances(points[order[k : k + AT_ONCE]], lines).max()))
    return found


def truth(machine: Machine, original: Moves, other: Moves) -> tuple[float, float]:
    """What `compared` has to find: the same by dense points. Both only turn, and cut from their second motion on."""
    meant = machine.tip(dense(original, list(range(1, len(original)))))
    done = machine.actual_tip(dense(other, list(range(1, len(other)))))
    return farthest(done, meant), farthest(meant, done)


def test_a_motion_in_which_an_axis_turns_far(machine: Machine) -> None:
    text = unwinding()
    before, after = moves_of(text, machine), moves_of(fixed(text, machine), machine)
    assert len(after) > len(before) + 10
    alone, there, back = compared(machine, before, after)
    assert (there.max, back.max) == pytest.approx(truth(machine, before, after), abs=AGREED)
    assert max(there.max, back.max) < 1e-3
    assert alone.max == pytest.approx(truth(machine, before, before)[0], abs=AGREED)


@pytest.mark.parametrize("axis", range(5))
def test_a_fault_in_any_piece_of_such_a_motion_is_seen(machine: Machine, axis: int) -> None:
    text = unwinding()
    before, after = moves_of(text, machine), moves_of(fixed(text, machine), machine)
    fault = np.where(after.rotary, 2e-5, 2e-3)[axis]
    for row in range(4 + axis, len(after) - 1, 10 if FULL else 20):
        end, start = after.end.copy(), after.start.copy()
        end[row, axis] += fault
        start[row + 1, axis] += fault
        wrong = replace(after, start=start, end=end)
        _, *found = compared(machine, before, wrong)
        assert tuple(each.max for each in found) == pytest.approx(truth(machine, before, wrong), abs=AGREED)


@pytest.mark.parametrize("near", [1e-5, 1e-3])
def test_a_fault_of_a_micrometre_is_found_wherever_it_is(machine: Machine, near: float) -> None:
    """On a machine without errors, square to the path: on short blocks and long ones, with corners of all angles."""
    rng = np.random.default_rng(5)
    perfect = replace_errors(machine)
    way = np.cumsum(rng.choice([0.02, 0.3, 4.0], 300))
    xy = np.column_stack([100 + 60 * np.cos(way / 9), 100 + 80 * np.sin(way / 23)])
    text = "G21 G90 G94 G17\nG0 X100 Y100 Z5\n" + "".join(f"G1 X{x:.4f} Y{y:.4f} Z1 F900\n" for x, y in xy) + "M2\n"
    meant, z = moves_of(text, perfect), machine.axis_names.index("Z")
    for row in range(2, len(meant) - 1, 7):
        end, start = meant.end.copy(), meant.start.copy()
        end[row, z] += 1.5e-3
        start[row + 1, z] += 1.5e-3
        _, there, _ = compared(perfect, meant, replace(meant, start=start, end=end), near)
        assert there.max == pytest.approx(1.5e-3, rel=1e-4)
        assert there.where in (row, row + 1)


def replace_errors(machine: Machine) -> Machine:
    """The machine without its errors."""
    return machine.replace(effects=())


@pytest.mark.parametrize(
    ("change", "least_mm"),
    [
        (lambda lines: lines[:150] + lines[151:], 2e-3),
        (lambda lines: [*lines[:150], lines[151], lines[150], *lines[152:]], 0.005),
        (lambda lines: lines[:150] + [lines[149]] * 3 + lines[150:], 0.0),
        (lambda lines: [*lines[:150], lines[149], lines[148], lines[149], *lines[150:]], 0.0),
    ],
    ids=["left out", "exchanged", "said again", "gone over again"],
)
def test_blocks_that_are_missing_or_too_many(machine: Machine, change: object, least_mm: float) -> None:
    perfect = replace_errors(machine)
    lines = [f"G1 X{100 + 40 * np.cos(i / 60):.4f} Y{100 + 40 * np.sin(i / 60):.4f} Z1 F900\n" for i in range(300)]
    head = "G21 G90 G94 G17\nG0 X140 Y100 Z5\n"
    texts = [head + "".join(each) + "M2\n" for each in (lines, change(lines))]  # type: ignore[operator]
    meant, done = (moves_of(text, perfect) for text in texts)
    _, *found = compared(perfect, meant, done)
    # the distance rises by up to 0.006 mm in half a block of 0.67 mm: by so much between two dense points at the peak
    assert tuple(each.max for each in found) == pytest.approx(truth(perfect, meant, done), abs=3e-4)
    assert max(each.max for each in found) >= least_mm


@pytest.mark.parametrize("seed", range(some(6)))
def test_blocks_exchanged_on_a_line_give_the_same_in_any_parts(machine: Machine, seed: int) -> None:
    """Rows to and fro, so near to each other that the next one is mistaken for the one that is meant."""
    rng, perfect = np.random.default_rng(seed), replace_errors(machine)
    row, place = np.divmod(np.arange(3000), 60)
    x = 0.4 * np.where(row % 2, 59 - place, place)
    lines = [f"G1 X{x:.4f} Y{y:.4f} F900\n" for x, y in zip(x, 0.05 * row, strict=True)]
    other = list(lines)
    for at in rng.integers(2, 2995, 5).tolist():
        other[at : at + 4] = [*other[at + 2 : at + 4], *other[at : at + 2]]
    head = "G21 G90 G94 G17\nG0 X0 Y0 Z1\n"
    meant, done = (moves_of(head + "".join(each) + "M2\n", perfect) for each in (lines, other))
    whole = compared(perfect, meant, done)
    for parts in (2, 5, 17):
        for found, expected in zip(compared(perfect, meant, done, parts=parts), whole, strict=True):
            assert found.max == pytest.approx(expected.max, abs=1e-9)
            assert found.rms == pytest.approx(expected.rms, rel=1e-9, abs=1e-10)
            assert found.lines_beyond == expected.lines_beyond


def test_a_peak_between_two_places_that_are_near_enough(machine: Machine) -> None:
    """Blocks of some micrometres, two of them exchanged: all ends and middles are within half a micrometre."""
    steps = [(-2, 4), (4, 0), (2, -4), (0, -6), (-4, 0)]
    texts = []
    for order in ((0, 1, 2, 3, 4), (0, 2, 1, 3, 4)):
        places = [(101 + steps[k][0] / 1000, 100 + steps[k][1] / 1000) for k in order]
        lines = "".join(f"G1 X{x:.4f} Y{y:.4f} F900\n" for x, y in [(101, 100), *places, (102, 100.3), (103, 110)])
        texts.append(f"G21 G90 G94 G17\nG0 X100 Y100 Z5\n{lines}M2\n")
    perfect = replace_errors(machine)
    _, there, back = compared(perfect, *(moves_of(text, perfect) for text in texts), 1e-3)
    assert max(there.max, back.max) > 1e-3
    assert there.lines_beyond or back.lines_beyond
