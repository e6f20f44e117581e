"""Two programs compared on a machine with play, against the play of guideways followed by brute force.

As an axis turns round, its body stays until the play is taken up, so that between both sides it is where it was. That
is followed here from point to point of both paths, so dense that none is missed.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compensate.side import compared
from compensate.test_comparison import farthest, fixed, moves_of
from ncfix.machine import Machine, State, load
from ncfix.machine.effect import Effect
from ncfix.machine.smooth import Backlash
from ncfix.program.moves import Moves

PLAY = {"X": 7.2e-3, "Y": -7.2e-3, "Z": -4e-3}
"""mm: what the error changes by as the axis turns from minus to plus; the body of X, a table, goes the other way."""
DENSE = 0.05
"""mm from point to point."""
AGREED = 0.1 * max(map(abs, PLAY.values()))
"""mm: a tenth of the play, which a step that takes it up may leave, counts as taken up."""
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


def made(machine: Machine, moves: Moves) -> np.ndarray:
    """The real path of what is cut behind the first motion: a body follows its axis as soon as the play is taken up."""
    places, cut = [moves.end[0]], [False]
    for row in range(1, len(moves)):
        way = moves.end[row] - moves.start[row]
        steps = int(np.abs(way).max() / DENSE) + 20
        places += list(moves.start[row] + np.linspace(0, 1, steps + 1)[1:, None] * way)
        cut += [bool(moves.cuts[row])] * steps
        cut[-1 - steps] |= cut[-1]
    q, sides = np.array(places), np.zeros((len(places), len(machine.axes)))
    for axis, play in PLAY.items():
        column, side = machine.axis_names.index(axis), 0.0
        for k, way in enumerate(np.diff(q[:, column]) * 2 / abs(play)):
            side = min(1.0, max(-1.0, side + way))
            sides[k + 1, column] = side
    tip: np.ndarray = machine.actual_tip(q, State(direction=sides))
    return tip[np.array(cut)]


def meant(machine: Machine, moves: Moves) -> np.ndarray:
    return made(machine.replace(effects=()), moves)


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
    for row in range(3, len(after) - 1, 9):
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
    for at in steps[::6]:
        after = moves_of("\n".join(lines[:at] + lines[at + 1 :]) + "\n", machine)
        _, there, back = compared(machine, before, after, LIMIT)
        expected = truth(machine, before, after)
        assert (there.max, back.max) == pytest.approx(expected, abs=AGREED)
        assert max(expected) > LIMIT
