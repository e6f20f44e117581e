"""The error along a path, against a machine whose error is known by hand."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from compensate.side import compared
from ncfix.compensate.figures.simulation import SimulatedErrors, TipError, tip_errors
from ncfix.compensate.following import follow
from ncfix.compensate.plan.intent import Intent
from ncfix.control.moves import Moves
from ncfix.control.setup import Setup
from ncfix.diagnostics import DifferenceError
from ncfix.machine import Machine, State, loads
from ncfix.text.reader import read

AXES = """
topology = "w F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [0, 500] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [0, 500] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-100, 100] }
"""
LONG = AXES + '[[effect]]\nname = "EXX"\nbasis = "polynomial"\ndegree = [1]\ncoefficients = [1e-4]\n'
STEP = (
    AXES
    + '[[effect]]\nname = "EYX"\nbasis = "table"\npositions = [0, 50, 50.5, 500]\ncoefficients = [0, 0, 0.01, 0.01]\n'
)


def followed(machine: str, text: str) -> tuple[Machine, Moves]:
    program = read(f"G21 G90 G94 G17 F600\n{text}M2\n".encode(), "part.ngc", "linuxcnc")
    found = follow(program, loads(machine), Setup(assume_zero=True))
    return found.machine, found.trace.moves


def errors(machine: str, text: str) -> list[TipError]:
    found, moves = followed(machine, text)
    return list(tip_errors(Intent(found, moves, State()), moves.block))


def error(machine: str, text: str) -> TipError:
    """At all samples of a short program, of which there are some."""
    (found,) = errors(machine, text)
    return found


def figures(machine: str, text: str) -> SimulatedErrors:
    return SimulatedErrors.of(errors(machine, text))


def test_the_error_at_every_sample_is_that_of_its_place() -> None:
    found = error(LONG, "G0 X10 Y0 Z0\nG1 X110\nY50\nG3 X110 Y70 J10\n")
    assert np.allclose(found.size, 1e-4 * found.intended[:, 0], atol=1e-12)
    assert np.allclose(found.actual - found.intended, found.size[:, None] * [1, 0, 0], atol=1e-12)
    assert SimulatedErrors.of([found]).max == pytest.approx(1e-4 * 120.0, rel=1e-3)


def test_weights_are_the_length_of_the_path() -> None:
    found = error(LONG, "G0 X10 Y0 Z0\nG1 X110\nG0 Z50\nG1 Y50\n")
    assert found.weight.sum() == pytest.approx(150.0)
    # 100 mm with x from 10 to 110, 50 mm at 110; the trapezoidal rule over 5 stretches is within 1 %
    assert SimulatedErrors.of([found]).rms == pytest.approx(
        1e-4 * np.sqrt(((110**3 - 10**3) / 3 + 50 * 110**2) / 150), rel=0.01
    )


def test_a_kink_is_not_stepped_over() -> None:
    found = error(STEP, "G0 X0 Y0 Z0\nG1 X50.5\n")
    assert SimulatedErrors.of([found]).max == pytest.approx(0.01, rel=1e-6)
    assert np.isclose(found.intended[:, 0], 50.0, atol=1e-6).any()


def test_rapids_do_not_count_and_cycles_count_at_their_end() -> None:
    found = error(LONG, "G0 X10 Y0 Z5\nG0 X400\nG98 G81 X100 Y10 Z-5 R2 F100\nG80\n")
    assert found.intended.tolist() == [[100.0, 10.0, -5.0]]
    assert SimulatedErrors.of([found]).max == pytest.approx(0.01)


def test_a_program_that_cuts_nothing_has_no_error() -> None:
    found = figures(LONG, "G0 X10 Y0 Z5\n")
    assert (found.max, found.rms, found.where) == (0.0, 0.0, None)
    assert figures(LONG, "G0 X10 Y0 Z5\nG1 X10\n").rms == pytest.approx(1e-3)


@pytest.mark.parametrize("unknown", [(), (170, 400)])
def test_figures_are_the_same_to_the_last_bit_in_whatever_parts(unknown: tuple[int, ...]) -> None:
    rng = np.random.default_rng(3)
    lines, size, weight = np.arange(1000) // 3, rng.exponential(size=1000), rng.random(1000)
    size[list(unknown)] = np.nan
    whole, parts = SimulatedErrors(1.0), SimulatedErrors(1.0)
    whole.add(lines, size, weight)
    cuts = [0, 0, 1, 250, 251, 600, 1000]
    for start, stop in pairwise(cuts):
        parts.add(lines[start:stop], size[start:stop], weight[start:stop])
    figures = [(each.where, each.count, str(each.max), str(each.rms)) for each in (whole, parts)]
    assert figures[0] == figures[1]
    assert whole.where == (lines[unknown[0]] if unknown else lines[np.argmax(size)])
    if not unknown:
        assert whole.rms == pytest.approx(np.sqrt(np.average(size**2, weights=weight)), rel=1e-13)
        assert whole.lines_beyond == parts.lines_beyond == np.unique(lines[size > 1.0]).tolist()


# -- two programs -----------------------------------------------------------------------------------------------------


def both(machine: str, original: str, other: str) -> tuple[float, float]:
    """The largest distance along the other program, and along the original, mm."""
    made, meant = followed(machine, original)
    _, there, back = compared(made, meant, followed(machine, other)[1])
    return there.max, back.max


WAVE = "G0 X0 Y0 Z0\n" + "".join(f"G1 X{x} Y{20 + 10 * np.sin(x / 20):.3f}\n" for x in range(0, 200, 7))


def test_splitting_motions_changes_nothing() -> None:
    lines = WAVE.splitlines()
    numbers = [[float(word[1:]) for word in line.split()[1:3]] for line in lines]
    split = [lines[0]]
    for (x0, y0), (x1, y1), line in zip(numbers, numbers[1:], lines[1:], strict=False):
        split += [f"G1 X{x0 + 0.3 * (x1 - x0):.9f} Y{y0 + 0.3 * (y1 - y0):.9f}", line]
    assert max(both(AXES, WAVE, "\n".join(split) + "\n")) < 1e-8


def test_an_arc_and_its_chords_differ_by_the_arrow() -> None:
    radius, n = 50.0, 12
    angles = np.linspace(np.pi, 0, n + 1)[1:]
    chords = "".join(f"G1 X{150 + radius * np.cos(a):.9f} Y{100 + radius * np.sin(a):.9f}\n" for a in angles)
    start = "G0 X100 Y100 Z0\n"
    arrow = radius * (1 - np.cos(np.pi / n / 2))
    there, back = both(AXES, f"{start}G2 X200 Y100 I50 J0\n", start + chords)
    assert (there, back) == pytest.approx((arrow, arrow), abs=2e-9)  # the chords end at nine decimals


@pytest.mark.parametrize("off", [1e-4, 0.01, 0.3])
def test_a_shifted_path_is_as_far_off_as_it_is_shifted(off: float) -> None:
    shifted = WAVE.replace("Z0\n", f"Z{off}\n", 1)
    there, back = both(AXES, WAVE, shifted)
    assert there == pytest.approx(off, rel=1e-6)
    assert back == pytest.approx(off, rel=1e-6)


def test_a_loop_that_is_missing_is_seen_on_the_way_back() -> None:
    loop = "G0 X0 Y0 Z0\nG1 X200\nX201\nX201 Y0.5\nX201 Y0\nX400\n"
    there, back = both(AXES, loop, "G0 X0 Y0 Z0\nG1 X200\nX201\nX400\n")
    assert there < 1e-9
    assert back == pytest.approx(0.5, abs=1e-9)  # the end of a motion is looked at itself


def test_another_cut_is_refused() -> None:
    with pytest.raises(DifferenceError, match="NCF420"):
        both(AXES, WAVE, WAVE + "G1 X0 Y0\n")
    with pytest.raises(DifferenceError, match="NCF420"):
        both(AXES, WAVE, "G0 X0 Y0 Z0\n")


def test_two_programs_that_cut_nothing_agree() -> None:
    assert both(AXES, "G0 X0 Y0 Z0\n", "G0 X5 Y0 Z0\n") == (0.0, 0.0)
