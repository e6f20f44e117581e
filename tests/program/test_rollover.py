"""Rotary axes that may roll over: motions that might lead them the other way round stay whole, in both lanes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import follow
from ncfix.control.setup import Setup
from ncfix.machine import Machine, load
from ncfix.text.reader import read

SETUP = Setup(assume_zero=True, no_point="calculator")
HEAD = "G21 G90 G17 G54\nG0 X0. Y0. Z50. A0. C0.\nG1 F500.\n"


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(str(root / "examples/machines/wCAYFXZSt.toml"))


def whole(text: str, dialect: str, machine: Machine) -> tuple[list[bool], list[str]]:
    """Which motions must not be split, those of the head left out, and the codes of what is said."""
    trace = follow(read((HEAD + text + "M30\n").encode(), "part.nc", dialect), machine, SETUP).trace
    return trace.moves.whole[1:].tolist(), [message.code for message in trace.messages]


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "mitsubishi", "iso"])
def test_more_than_half_a_turn_stays_whole(dialect: str, machine: Machine) -> None:
    found, said = whole("X5. C170.\nX6. C359.5\nX7. C0.5\nC180.5\nG91 X1. C300.\nG0 G90 C0.\n", dialect, machine)
    assert found == [False, True, True, True, False, True]
    assert "NCF247" in said


def test_sinumerik_counts_from_zero_to_a_full_turn(machine: Machine) -> None:
    """Of plain words nobody knows which way a modulo axis goes (MD30455); ACP, DC and increments say it."""
    found, said = whole("X5. C170.\nX6. C359.5\nC=DC(0.5)\nC=ACP(300.)\nX9. C100.\nC=IC(-200.)\n", "siemens", machine)
    assert found == [False, True, True, False, True, True]
    assert said.count("NCF247") == 1


def test_back_from_beyond_a_full_turn(machine: Machine) -> None:
    """Increments lead to 380 or to 20 degrees; whichever it is, a plain word behind them is not split, the next is."""
    text = "X5. C170.\nG91 C90.\nC90.\nC30.\nG90 X7. C250.\nX9. C300.\n"
    found, said = whole(text, "siemens", machine)
    assert found == [False, False, False, False, True, False]
    assert said.count("NCF247") == 1
    found, said = whole(text, "fanuc", machine)
    assert not any(found)


def test_below_zero_as_written(machine: Machine) -> None:
    found, said = whole("X5. C-20.\nX6. C15.\nX7. C-100.\n", "siemens", machine)
    assert not any(found)
    assert "NCF247" not in said


@pytest.mark.parametrize(("text", "dialect"), [("C359.5\nC0.5\n", "linuxcnc"), ("A-50.\nA60.\n", "fanuc")])
def test_where_nothing_rolls_over(text: str, dialect: str, machine: Machine) -> None:
    found, said = whole(text, dialect, machine)
    assert not any(found)
    assert "NCF247" not in said


@pytest.mark.parametrize("dialect", ["fanuc", "iso", "siemens"])
def test_both_lanes_agree(dialect: str, machine: Machine) -> None:
    lines = ["G91 C390.\nG90\n"] + [f"X{n}. Y{n % 7}. C{(n * 97 + 250) % 360}.\n" for n in range(40)]
    many, _ = whole("".join(lines), dialect, machine)
    single, _ = whole("M8\n".join(lines), dialect, machine)
    assert many == single
    assert any(many)
    assert not all(many)


def test_no_piece_leads_the_axis_round(machine: Machine) -> None:
    text = HEAD + "X40. Y30. C350.\nX-40. Y-30. C5.\nX40. C100.\nM30\n"
    fixed = fix_program(read(text.encode(), "part.nc", "fanuc"), machine, SETUP, FixOptions(figures=False))
    angles = [float(word[1:]) for word in fixed.text.decode().split() if word[0] == "C" and word[1:2].isdigit()]
    assert angles[:3] == pytest.approx([0.0, 350.0, 5.0])
    assert np.all(np.abs(np.diff(angles[2:])) < 100.0)


def test_a_corrected_angle_leads_no_axis_round(machine: Machine) -> None:
    text = HEAD + "X10. A20. C30.\nX20. C40.\nX30. C219.995\nX40. C200.\nM30\n"
    options = FixOptions(strategy="full", figures=False)
    fixed = fix_program(read(text.encode(), "part.nc", "fanuc"), machine, SETUP, options).text.decode()
    assert "C219.995" in fixed
    assert "C40." in fixed
    assert "C30.00" in fixed


def at_zero(machine: Machine, dialect: str) -> list[str]:
    """The words for C of a program that goes to C0 sixty times, corrected in direction."""
    rng = np.random.default_rng(1)
    places = rng.uniform((-60, -60, -80), (60, 60, 80), (60, 3))
    text = HEAD + "".join(f"X{x:.0f}. Y{y:.0f}. A{a:.0f}. C0.\nA{a:.0f}. C340.\n" for x, y, a in places) + "M30\n"
    options = FixOptions(strategy="full", figures=False)
    fixed = fix_program(read(text.encode(), "part.nc", dialect), machine, SETUP, options).text.decode()
    return [word[1:] for word in fixed.split() if word[0] == "C" and word[1:2] in "-0123456789"]


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "iso", "siemens"])
def test_no_correction_leads_below_zero(dialect: str, machine: Machine) -> None:
    """C-0.001 would be 359.999 to an axis that counts from 0 to 360, and the next word might lead it round."""
    assert min(map(float, at_zero(machine, dialect))) == 0.0


def test_corrections_lead_below_zero_where_axes_go_on_counting(machine: Machine) -> None:
    assert min(map(float, at_zero(machine, "linuxcnc"))) < 0.0


@pytest.mark.parametrize("words", ["I10. J0. K5.", "I10. J0. L2", "I10. J0. P3", "I10. J0. Q2."])
def test_spirals_are_refused(words: str, machine: Machine) -> None:
    text = HEAD + f"G2 X20. Y0. Z-5. {words}\nG0 X0. Y0. Z50.\nM30\n"
    moves = follow(read(text.encode(), "part.nc", "fanuc"), machine, SETUP).trace.moves
    assert "has more turns" in moves.reasons[moves.reason[-2]]
