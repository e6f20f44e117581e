"""KinematicsComp: the chain to the byte and as it is followed, tilted axes, limits, and broken files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ncfix.diagnostics import ConfigError, RefusedError, UsageError
from ncfix.machine import Effect, Machine, load, loads
from ncfix.machine.basis import Backlash
from ncfix.tables.control import Request, get_control
from ncfix.tables.correction import random_poses, ranges_of
from ncfix.tables.export import Exported, export
from ncfix.tables.table_files import Remarks
from ncfix.testing import check_control, single_error
from ncfix_heidenhain.chain import ChainRow, kinematics_text, over_limits, read_rows
from ncfix_heidenhain.table_files import read_table

CONTROL = get_control("heidenhain-kinematics")
SETTINGS = CONTROL.settings({"sign": "error", "angle_unit": "deg"})


def exported(machine: Machine, poses: int = 500, **settings: str) -> Exported:
    request = Request(machine, ranges_of(machine), 120.0, 0.001, {**SETTINGS, **settings})
    return export(CONTROL, request, poses)


def test_the_contract() -> None:
    check_control(CONTROL, {"sign": "error", "angle_unit": "rad"})


def test_golden_bytes() -> None:
    """EYX of 0.01 u + 0.005 u^2, u = x / 200: a column C2 over X that moves Y before X moves.

    Its second derivative is 2.5e-7; chords of h = 62.5 miss 2.5e-7 h^2 / 8 = 0.12 um, an eighth of the target.
    """
    made = exported(single_error("EYX"), 50).native
    assert made["kinematics.tab"] == (
        b"NR DOC KEY      AXIS COORD           COMPTAB\n0      Trans    Y                    X..C2\n"
        b"1      MachAxis X\n2      MachAxis Y\n3      MachAxis Z\n4      MachBase\n[END]\n"
    )
    lines = made["AXIS-X.COM"].splitlines()
    assert lines[0] == b"BEGIN AXIS-X.COM  DATUM:-200.0000 DISTANCE:+62.5000"
    assert lines[1] == b"NR   BACKLASH      C2            "
    assert float(lines[2].split()[2]) == pytest.approx(-0.005, abs=1e-4)  # fitted, so not the value at the node
    assert made["units.txt"] == b"error deg\n"


@pytest.mark.parametrize("name", ["three_axis", "wCAYFXZSt", "wCBXFZYSt", "dmu50"])
def test_the_shipped_machines(root: Path, name: str) -> None:
    """The B axis of dmu50 is tilted by 45 degrees. What is left is the mean of both ways, and the digits."""
    left = exported(load(root / "examples" / "machines" / f"{name}.toml")).left
    assert left.after.max() < 0.001
    assert left.before.max() > 0.025


@pytest.mark.parametrize("name", ["wCAYFXZSt", "dmu50"])
def test_the_chain_without_errors_is_the_machine(root: Path, name: str) -> None:
    """Both see the same tip, up to where the workpiece frame lies."""
    machine = load(root / "examples" / "machines" / f"{name}.toml")
    kinematics = CONTROL.read(exported(machine, 10).native).for_tool(70.0)
    q = random_poses(ranges_of(machine), 50)
    seen = kinematics.tip(machine.axis_names, q, False)  # type: ignore[attr-defined]
    offset = seen - machine.tip(q, 70.0)
    assert np.abs(offset - offset[0]).max() < 1e-6  # COORD has nine digits


def test_it_holds_for_any_tool() -> None:
    machine = single_error("EAX", 50e-6)
    tables = CONTROL.read(exported(machine).native)
    q = random_poses(ranges_of(machine), 20)
    short, long = (tables.for_tool(length).at(machine.axis_names, q) for length in (0.0, 200.0))
    assert np.abs(short - long).max() > 0.005


def test_the_sign_turns_every_value() -> None:
    one, other = (exported(single_error("EXX"), 50, sign=sign).native["AXIS-X.COM"] for sign in ("error", "correction"))
    value = [float(each.splitlines()[2].split()[2]) for each in (one, other)]
    assert value[0] == -value[1] != 0


@pytest.mark.parametrize("given", [{}, {"sign": "error"}, {"angle_unit": "deg"}])
def test_what_cannot_be_known_must_be_said(given: dict[str, str]) -> None:
    with pytest.raises(UsageError, match="needs the setting"):
        CONTROL.settings(given)


def test_the_mean_of_both_ways_is_said() -> None:
    text = 'ncfix = 1\nname = "play"\ntopology = "w F X Y Z t"\n' + "".join(
        f'[axis.{name}]\ntype = "linear"\ndirection = {np.eye(3, dtype=int)[i].tolist()}\nrange = [0, 100]\n'
        for i, name in enumerate("XYZ")
    )
    machine = loads(text + '[[effect]]\nname = "EYX"\nbasis = "backlash"\ncoefficients = [0.004]\n')
    written = CONTROL.write(Request(machine, ranges_of(machine), 0.0, 0.001, SETTINGS))
    assert any("(play) are not corrected: up to 2.00 um remain" in note for note in written.notes)
    assert not any("backlash=on" in note for note in written.notes)
    machine = single_error("EXX").replace(effects=(Effect("EXX", (0.004,), Backlash()),))
    written = CONTROL.write(Request(machine, ranges_of(machine), 0.0, 0.001, SETTINGS))
    assert any("backlash=on" in note for note in written.notes)


@pytest.mark.parametrize("topology", ["w F X Y Z t", "w X F Y Z t"])
@pytest.mark.parametrize("sign", ["error", "correction"])
def test_play_goes_into_backlash_if_asked_for(topology: str, sign: str) -> None:
    machine = single_error("EXX", topology=topology)
    play = Effect("EXX", (0.004,), Backlash((0,)))
    machine = machine.replace(effects=(*machine.effects, play))
    off, on = (exported(machine, backlash=each, sign=sign) for each in ("off", "on"))
    assert off.left.after.max() == pytest.approx(0.002, abs=2e-4)
    assert on.left.after.max() < 2e-4
    assert not on.messages


def test_a_rotary_axis_is_turned_right_both_ways(root: Path) -> None:
    """BACKLASH counts instead of the axis's own column towards minus: it repeats it, and is not left at zero."""
    made = exported(load(root / "examples" / "machines" / "dmu50.toml"), 10)
    rows = [line.split() for line in made.native["AXIS-C.COM"].decode().splitlines()[1:]]
    own = next(index for index, name in enumerate(rows[0]) if name.endswith("=F()"))
    assert any(float(row[own]) for row in rows[1:])
    assert all(row[1] == row[own] for row in rows[1:])


def test_the_sample_is_read_and_written_again_identically(shared: Callable[[str], Path]) -> None:
    content = (shared("tables") / "heidenhain" / "kinematics_COMPTAB_iTNC530.txt").read_bytes()
    remarks = Remarks.of("sample", content)
    rows = read_rows(remarks, content)
    table = read_table(remarks, content)
    assert not remarks.wrong
    assert table is not None
    assert table.text() == content
    assert rows == (
        ChainRow("Trans", "X", 0.016),
        ChainRow("MachAxis", "B"),
        ChainRow("Trans", "A", 0.0, 0.0015),
        ChainRow("MachBase"),
        ChainRow("Trans", "Y", None, ("A", "C2")),
    )


def test_a_table_beyond_the_limits_of_the_control_is_told() -> None:
    axis, trans = ChainRow("MachAxis", "X"), ChainRow("Trans", "Y", 1.0, 0.1)
    assert not list(over_limits([axis, *[trans] * 49]))
    assert "51 rows" in next(over_limits([axis, *[trans] * 50]))
    assert any("COMPTAB" in text for text in over_limits([axis, *[trans] * 100]))
    assert any("COORD" in text for text in over_limits([trans] * 51))


def test_axes_beyond_the_chain_are_refused(root: Path) -> None:
    machine = load(root / "examples" / "machines" / "three_axis.toml")
    renamed = machine.replace(axes=(*machine.axes[:2], machine.axes[2].__class__("W", False, False, (0, 0, 1))))
    space = np.array([[0.0, 1.0]] * 3)
    with pytest.raises(RefusedError, match="axes W: linear axes are X Y Z here"):
        CONTROL.write(Request(renamed.replace(effects=()), space, 0.0, 0.001, SETTINGS))


FILES = dict(exported(single_error("EYX"), 50).native)
BROKEN = {
    "no base": (("kinematics.tab", b"3      MachAxis Z\n4      MachBase", b"3      MachAxis Z"), "one row MachBase"),
    "cut short": (("kinematics.tab", b"[END]\n", b""), "[END] is missing"),
    "an unknown key": (("kinematics.tab", b"MachAxis Y", b"MachAxes Y"), "is not a key"),
    "an unknown axis": (("kinematics.tab", b"MachAxis Y", b"MachAxis Q"), "is not an axis"),
    "an axis twice": (("kinematics.tab", b"MachAxis Y", b"MachAxis X"), "an axis appears twice"),
    "a row gone": (("kinematics.tab", b"2      MachAxis Y\n", b""), "row 3 instead of row 2"),
    "a column that is not there": (("kinematics.tab", b"X..C2", b"X..C3"), "X..C3 is in no axis table"),
    "an error on an axis": (("kinematics.tab", b"MachAxis Y", b"MachAxis Y    1.0"), "neither COORD nor COMPTAB"),
    "a foreign column": (("AXIS-X.COM", b" C2 ", b" 2=F()"), "not that of the axis itself"),
    "no units": (("units.txt", b"deg", b""), "units.txt says"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_files(case: str) -> None:
    (name, old, new), expected = BROKEN[case]
    assert old in FILES[name]
    broken = {**FILES, name: FILES[name].replace(old, new)}
    found = CONTROL.lint(broken)
    assert any(expected in message.text for message in found), found
    with pytest.raises(ConfigError):
        CONTROL.read(broken)


def test_too_many_rows_are_refused() -> None:
    rows = [*[ChainRow("Trans", "X", 1.0)] * 51, ChainRow("MachBase")]
    remarks = Remarks.of("kinematics.tab", kinematics_text(rows))
    read_rows(remarks, kinematics_text(rows))
    assert any("51 rows" in message.text for message in remarks.messages)
