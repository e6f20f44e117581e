"""What users get wrong with tables, and in which words they are told."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from ncfix.diagnostics import ConfigError, NcfixError, RefusedError, UsageError
from ncfix.machine import Effect, Machine, loads
from ncfix.machine.basis import Fourier
from ncfix.tables.control import Request, get_control
from ncfix.tables.correction import ranges_of
from ncfix.tables.export import Exported, emulate, export
from ncfix.testing import single_error

SETTINGS = {
    "fanuc": {"sign": "error"},
    "fanuc-pitch": {"sign": "error"},
    "heidenhain": {"sign": "error"},
    "heidenhain-kinematics": {"sign": "error", "angle_unit": "deg"},
    "siemens": {"value_sign": "error", "product_terms": "only"},
}
TABLE = """
ncfix = 1
name = "a table that turns"
topology = "w C F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [-200, 300] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [-150, 250] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-300, 0] }
axis.C = { type = "rotary", direction = [0, 0, -1] }
"""


def exported(control: str, machine: Machine, **settings: str) -> Exported:
    chosen = get_control(control)
    options = chosen.settings({**SETTINGS.get(control, {}), **settings})
    return export(chosen, Request(machine, ranges_of(machine), 100.0, 0.001, options), 200)


def words(error: NcfixError) -> str:
    return " ".join(f"{message.text} {message.hint}" for message in error.messages)


@pytest.mark.parametrize(
    ("control", "said"),
    [
        ("linuxcnc", "straightness, squareness, angular errors"),
        ("heidenhain", "cannot follow angular errors"),
        ("fanuc-pitch", "The opposite direction needs its own table"),
        ("gcode", "is not corrected"),
    ],
)
def test_a_model_that_the_format_cannot_express(control: str, said: str) -> None:
    """What remains is said in the notes, in the sheet, and as a figure."""
    made = exported(control, single_error("EBX", 40e-6))
    assert any(said in note for note in made.notes)
    sheet = made.files["hand-over.md"].decode()
    assert said in sheet
    assert f"max {made.left.figures()['after']['max']:.2f} um" in sheet
    assert "ISO/TR 16907" in sheet


def test_a_model_that_the_tables_would_make_worse() -> None:
    """Fanuc's grid is that of C at zero; an error that turns with C is doubled half a turn on."""
    turning = loads(TABLE).replace(effects=(Effect("EXC", (0.02, 0.0), Fourier((1,))),))
    with pytest.raises(RefusedError) as caught:
        exported("fanuc", turning)
    assert caught.value.code == "NCF490"
    assert "would increase the error" in words(caught.value)


def test_ranges_beyond_the_travel() -> None:
    with pytest.raises(UsageError) as caught:
        ranges_of(single_error("EXX"), {"X": (-200.0, 301.0)})
    assert caught.value.code == "NCF483"
    assert "exceeds its travel" in words(caught.value)


@pytest.mark.parametrize(
    ("control", "settings"),
    [("heidenhain", {"points": "257"}), ("linuxcnc", {"points": "1000"}), ("isg", {"points": "7"})],
)
def test_more_points_than_the_control_has(control: str, settings: dict[str, str]) -> None:
    with pytest.raises(UsageError) as caught:
        exported(control, single_error("EXX"), **settings)
    assert caught.value.code == "NCF485"
    assert "a whole number from" in words(caught.value)


def test_a_target_that_the_points_do_not_reach_is_said() -> None:
    machine = single_error("EXX", 0.02)
    chosen = get_control("isg")
    options = chosen.settings({"points": "12"})
    made = export(chosen, Request(machine, ranges_of(machine), 0.0, 1e-5, options), 100)
    assert any("is not reached" in note for note in made.notes)


@pytest.mark.parametrize("control", ["fanuc", "heidenhain"])
def test_values_beyond_the_format(control: str) -> None:
    machine = single_error("EXX").replace(effects=(Effect("EXX", (15.0,)),), max_correction=(50.0, 0.1))
    with pytest.raises(RefusedError) as caught:
        exported(control, machine)
    assert caught.value.code == "NCF484"
    assert "check that the error is in mm" in words(caught.value)


def test_corrections_beyond_what_the_machine_allows() -> None:
    with pytest.raises(RefusedError) as caught:
        exported("isg", single_error("EXX").replace(effects=(Effect("EXX", (0.7,)),)))
    assert caught.value.code == "NCF489"
    assert re.search(r"larger than this machine allows: 0.700 of 0.5 mm at X-?\d\S* Y\S+ Z\S+", words(caught.value))


def test_an_error_that_is_not_a_number() -> None:
    with pytest.raises(RefusedError, match="not a number"):
        exported("linuxcnc", single_error("EXX").replace(effects=(Effect("EXX", (float("nan"),)),)))


def test_tables_of_another_machine() -> None:
    made = exported("linuxcnc", single_error("EXX"))
    other = single_error("EXX", 0.02)
    with pytest.raises(RefusedError) as caught:
        emulate(get_control("linuxcnc"), made.files, other, "tables")
    assert caught.value.code == "NCF487"
    assert "another machine, or for other errors of it" in words(caught.value)


def test_tables_for_axes_that_are_not_there() -> None:
    made = exported("isg", loads(TABLE).replace(effects=(Effect("EXC", (0.01, 0.0), Fourier((1,))),)))
    with pytest.raises(RefusedError, match="axes that the machine does not have: C"):
        emulate(get_control("isg"), made.files, single_error("EXX"), "tables", any_machine=True)


def test_a_hand_edited_file_with_a_wrong_count() -> None:
    made = exported("fanuc", single_error("EXX"))
    files = dict(made.files)
    found = json.loads(files["volume.json"])
    found["records"][0]["data"].append(0)
    files["volume.json"] = json.dumps(found).encode()
    with pytest.raises(ConfigError, match="values, but states"):
        emulate(get_control("fanuc"), files, single_error("EXX"), "tables")


def test_a_file_that_is_gone() -> None:
    made = exported("heidenhain", single_error("EXX"))
    files = {name: content for name, content in made.files.items() if name != "AXIS_X.COM"}
    with pytest.raises(ConfigError, match=r"these files are missing: AXIS_X\.COM"):
        emulate(get_control("heidenhain"), files, single_error("EXX"), "tables")


def test_a_wrong_setting_is_named_with_those_that_there_are() -> None:
    with pytest.raises(UsageError, match="no setting 'sing'") as caught:
        get_control("fanuc").settings({"sing": "error"})
    assert "sign" in words(caught.value)


def test_settings_that_are_strange_or_missing_are_all_said_at_once() -> None:
    with pytest.raises(UsageError) as caught:
        get_control("fanuc").settings({"sing": "error", "ordre": "XYZ"})
    assert [message.code for message in caught.value.messages] == ["NCF485"] * 3


@pytest.mark.parametrize(
    ("control", "given", "asked"),
    [
        ("siemens", {}, ["value_sign", "product_terms"]),
        ("siemens", {"product_terms": "maybe", "model": "9", "tables": "x"}, ["maybe", "=9", "=x", "value_sign"]),
        ("heidenhain-kinematics", {"points": "1"}, ["points=1", "'sign'", "angle_unit"]),
        ("fanuc", {"sign": "plus", "order": "XYY", "largest": "no"}, ["plus", "XYY", "no"]),
        ("isg", {"steps": "odd", "points": "3", "play": ""}, ["odd", "=3", "play="]),
    ],
)
def test_all_settings_are_asked_for_at_once(control: str, given: dict[str, str], asked: list[str]) -> None:
    with pytest.raises(UsageError) as caught:
        get_control(control).settings(given)
    assert len(caught.value.messages) == len(asked)
    assert all(word in message.text for word, message in zip(asked, caught.value.messages, strict=True))


def test_a_sign_that_is_asked_for_comes_with_the_way_to_find_it_out() -> None:
    for control in ("fanuc", "fanuc-pitch", "fanuc-rotary", "heidenhain", "heidenhain-kinematics", "siemens"):
        with pytest.raises(UsageError, match="sign") as caught:
            get_control(control).settings({})
        assert "on the machine: " in caught.value.messages[0].hint, control


ENDLESS = {"fanuc-rotary": {"sign": "error"}, **{name: SETTINGS.get(name, {}) for name in ("isg", "linuxcnc")}}


@pytest.mark.parametrize("control", [*ENDLESS, "heidenhain", "heidenhain-kinematics"])
def test_tables_of_an_endless_axis_say_from_where_it_is_counted(control: str) -> None:
    """On a control that counts to 360 degree the value at 180 would be held for half of the turn."""
    turning = loads(TABLE).replace(effects=(Effect("ECC", (0.0, 4e-5), Fourier((1,))),))
    notes = " ".join(exported(control, turning, **ENDLESS.get(control, {})).notes)
    assert "C has no end of travel, and these tables do not repeat" in notes
    assert "from -180 to 180 degree" in notes


@pytest.mark.parametrize("control", ["siemens", "gcode"])
def test_what_repeats_after_a_turn_says_nothing(control: str) -> None:
    turning = loads(TABLE).replace(effects=(Effect("ECC", (0.0, 4e-5), Fourier((1,))),))
    assert "no end of travel" not in " ".join(exported(control, turning).notes)


def test_a_perfect_machine_gets_tables_that_do_nothing() -> None:
    for control in ("fanuc", "heidenhain", "heidenhain-kinematics", "isg", "linuxcnc", "gcode"):
        made = exported(control, single_error("EXX").replace(effects=()))
        assert float(np.abs(made.left.after).max()) < 1e-9, control
