"""Play goes where a control has a place for it, and the rest of it is said."""

from __future__ import annotations

import numpy as np
import pytest

from ncfix.machine import Effect, Machine
from ncfix.machine.basis import Backlash
from ncfix.tables.axis_tables import reversal_note, reversals
from ncfix.tables.control import Request, get_control
from ncfix.tables.correction import ranges_of
from ncfix.tables.export import Exported, export
from ncfix.testing import single_error

CONTROLS = {"isg": {}, "fanuc": {"sign": "error"}, "fanuc-rotary": {"sign": "correction"}}
"""Those that have a place for it besides grids."""


def with_play(*coefficients: float, name: str = "EXX", topology: str = "w F X Y Z t") -> Machine:
    play = Effect(name, coefficients, Backlash(tuple(range(len(coefficients)))), scale=200.0)
    return single_error("EYX", topology=topology).replace(effects=(play,))


def exported(control: str, machine: Machine, **settings: str) -> Exported:
    chosen = get_control(control)
    options = chosen.settings({**CONTROLS[control], **settings})
    return export(chosen, Request(machine, ranges_of(machine), 0.0, 0.001, options), 500)


@pytest.mark.parametrize("topology", ["w F X Y Z t", "w X F Y Z t"])
def test_the_play_of_an_axis_on_either_side(topology: str) -> None:
    """Its body stands 2 um towards plus of the base while X grows: too far with the tool, too near with the work."""
    machine = with_play(0.004, topology=topology)
    (found,) = reversals(machine, ranges_of(machine), 0.0, 0.001, 10)
    assert (found.axis, len(found.nodes)) == ("X", 2)
    sense = 1 if topology.startswith("w F") else -1
    assert found.whole == pytest.approx(-0.004 * sense, abs=1e-9)
    ways = np.array([[1.0, 0, 0], [-1.0, 0, 0], [0.0, 0, 0]])
    taken = sum(term.at(("X", "Y", "Z"), np.zeros((3, 3)), ways) for term in found.terms())
    assert taken[:, 0] == pytest.approx([-0.002 * sense, 0.002 * sense, 0.0], abs=1e-9)


def test_play_that_changes_along_the_axis_takes_nodes() -> None:
    machine = with_play(0.002, 0.0, 0.004)
    (found,) = reversals(machine, ranges_of(machine), 0.0, 0.001, 100)
    assert 4 < len(found.nodes) < 30
    half = -(0.002 + 0.004 * (found.nodes / 200) ** 2) / 2
    assert found.half == pytest.approx(half, abs=1e-7)


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("topology", ["w F X Y Z t", "w X F Y Z t"])
@pytest.mark.parametrize("size", [0.004, -0.004])
def test_controls_take_it_off(control: str, topology: str, size: float) -> None:
    made = exported(control, with_play(size, topology=topology))
    assert made.left.before.max() == pytest.approx(0.002, abs=1e-12)
    assert made.left.after.max() < 1.1e-4  # a tenth of a micrometre is a detection unit
    assert not any("(play) are not corrected" in note for note in made.notes)
    assert not made.messages


def test_golden_axis_list() -> None:
    """The form of the documentation's example, with errors in tenths of a micrometre: too far towards plus."""
    entries = {
        "kopf.achs_nr": 1,
        "kopf.log_achs_name": "X",
        "kw.ssfk.interval": 0,
        "kw.ssfk.kw_startpos": -2_000_000,
        "kw.ssfk.kw_nr_max": 2,
        "kw.ssfk.unit": 1,
        "kw.ssfk.bilateral": 1,
        "kw.ssfk.table[0].setpoint": -2_000_000,
        "kw.ssfk.table[0].pos": 20,
        "kw.ssfk.table[0].neg": -20,
        "kw.ssfk.table[1].setpoint": 3_000_000,
        "kw.ssfk.table[1].pos": 20,
        "kw.ssfk.table[1].neg": -20,
    }
    expected = "".join(f"{name:<32}{value}\n" for name, value in entries.items())
    assert exported("isg", with_play(0.004)).native["leadscrew_X.lis"].decode() == expected


@pytest.mark.parametrize("control", CONTROLS)
def test_it_can_be_left(control: str) -> None:
    made = exported(control, with_play(0.004), play="no")
    assert made.left.after.max() == pytest.approx(0.002, abs=1e-12)
    assert any("(play) are not corrected: up to 2.00 um" in note for note in made.notes)


@pytest.mark.parametrize("home", ["", "X"])
def test_the_grid_of_fanuc_makes_up_for_the_way_home(home: str) -> None:
    """Nothing is added on the way home: half of the play is in the grid, with the sign of that way."""
    made = exported("fanuc", with_play(0.004), home_minus=home)
    assert made.native["backlash.txt"] == b"%\nN01851A1P-40;\n%\n"
    ways = np.array([[1.0, 0, 0], [-1.0, 0, 0]])
    found = made.tables.at(("X", "Y", "Z"), np.zeros((2, 3)), ways)
    assert found[:, 0] == pytest.approx([-0.002, 0.002], abs=1e-9)
    (grid,) = (each for each in made.tables.grids if len(each.inputs) == 3)
    assert grid.values[..., 0].ravel() == pytest.approx(0.002 if home else -0.002, abs=1e-9)


def test_play_of_rotary_axes_and_across_is_said() -> None:
    machine = with_play(0.004, name="EYX")
    assert not reversals(machine, ranges_of(machine), 0.0, 0.001, 10)
    assert list(reversal_note(machine, ranges_of(machine), 0.0)) == [
        "Errors that depend on the direction of motion (play) are not corrected: up to 2.00 um remain."
    ]


FANUC_BROKEN = {
    "another parameter": (b"N01851", b"N01850", "parameter 1850 does not belong in this file"),
    "a fraction": (b"P-40", b"P-40.5", "whole numbers"),
    "too large": (b"P-40", b"P-40000", "whole numbers from -9999"),
    "a fourth axis": (b";\n%", b"A4P7;\n%", "axes 1 to 3"),
    "cut off": (b";\n%\n", b";\n", "begin and end with a line %"),
}


@pytest.mark.parametrize("control", ["fanuc", "fanuc-rotary"])
@pytest.mark.parametrize("name", FANUC_BROKEN)
def test_the_linter_names_what_is_wrong_with_backlash(control: str, name: str) -> None:
    old, new, said = FANUC_BROKEN[name]
    files = dict(exported(control, with_play(0.004)).native)
    assert old in files["backlash.txt"]
    files["backlash.txt"] = files["backlash.txt"].replace(old, new)
    assert any(said in f"{each.text} {each.hint}" for each in get_control(control).lint(files))


ISG_BROKEN = {
    "another axis": (b"log_achs_name              X", b"log_achs_name              Q", "log_achs_name is Q"),
    "another number": (b"achs_nr                    1", b"achs_nr                    3", "the configuration says 1"),
    "one way only": (b"bilateral               1", b"bilateral               0", "never used, since"),
    "a point more": (b"kw_nr_max               2", b"kw_nr_max               3", "there are 2 points"),
    "a comma": (b"table[0].pos            20", b"table[0].pos            20,5", "a whole number of tenths"),
    "too large": (b"table[0].pos            20", b"table[0].pos            20000", "which no machine has"),
    "backwards": (b"setpoint       -2000000", b"setpoint       4000000", "must ascend"),
    "twice": (b"kw.ssfk.unit                    1", b"kw.ssfk.unit  1\nkw.ssfk.unit 1", "appears twice"),
    "a point cut off": (b"kw.ssfk.table[1].neg            -20\n", b"", "without setpoint, pos and neg"),
}


@pytest.mark.parametrize("name", ISG_BROKEN)
def test_the_linter_names_what_is_wrong_with_axis_lists(name: str) -> None:
    old, new, said = ISG_BROKEN[name]
    files = dict(exported("isg", with_play(0.004)).native)
    assert old in files["leadscrew_X.lis"], files["leadscrew_X.lis"].decode()
    files["leadscrew_X.lis"] = files["leadscrew_X.lis"].replace(old, new)
    assert any(said in each.text + each.hint for each in get_control("isg").lint(files))


def test_two_lists_for_one_axis() -> None:
    files = dict(exported("isg", with_play(0.004)).native)
    files["more.lis"] = files["leadscrew_X.lis"]
    assert any("two lists are for axis X" in each.text for each in get_control("isg").lint(files))
