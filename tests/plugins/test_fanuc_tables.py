"""Fanuc's three-dimensional grid: records, sign, magnification, and what the linter says of broken files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from ncfix.diagnostics import ConfigError, RefusedError, UsageError
from ncfix.machine import Effect, load
from ncfix.machine.basis import Backlash
from ncfix.tables.control import Request, get_control
from ncfix.tables.correction import ranges_of
from ncfix.tables.export import Exported, export
from ncfix.testing import check_control, single_error

CONTROL = get_control("fanuc")
CORNER = "X-200,Y-150,Z-300"
"""The reference position at the lowest corner of the travel, so that two points an axis will do."""


def exported(sign: str = "correction", unit: str = "0.1", size: float = 0.01) -> Exported:
    machine = single_error("EXX").replace(effects=(Effect("EXX", (size,)),))
    settings = CONTROL.settings({"sign": sign, "detection_unit_um": unit, "reference": CORNER})
    return export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.001, settings), 100)


def test_the_contract() -> None:
    check_control(CONTROL, {"sign": "error"})


def test_golden_records() -> None:
    """X 0.010 mm too far everywhere: -100 units of 0.1 um at eight points."""
    found = json.loads(exported().native["volume.json"])
    record = {"start_no": 1, "start_ax": 1, "end_no": 8, "end_ax": 3, "num": 24, "type": 0, "data": [-100, 0, 0] * 8}
    assert found == {
        "sign": "correction",
        "first_mm": [-200.0, -150.0, -300.0],
        "interval_mm": [500.0, 400.0, 300.0],
        "counts": [2, 2, 2],
        "reference_mm": [-200.0, -150.0, -300.0],
        "reference_points": [1, 1, 1],
        "reference_number": 1,
        "detection_unit_um": 0.1,
        "magnification": 1,
        "first_number": 1,
        "order": "XYZ",
        "largest": 127,
        "template": "",
        "home_minus": "",
        "records": [record],
    }
    lines = exported().native["volume.csv"].splitlines()
    assert lines[:3] == [
        b"point,X,Y,Z,X_value,Y_value,Z_value",
        b"1,-200.000000,-150.000000,-300.000000,-100,0,0",
        b"2,300.000000,-150.000000,-300.000000,-100,0,0",
    ]


def test_the_sign_turns_every_value_and_leaves_the_same() -> None:
    one, other = exported("correction"), exported("error")
    data = [json.loads(each.native["volume.json"])["records"][0]["data"] for each in (one, other)]
    assert data[0] == [-value for value in data[1]]
    assert (one.left.after == other.left.after).all()


def test_the_sign_must_be_given() -> None:
    with pytest.raises(UsageError, match="sign"):
        CONTROL.settings({})


def test_magnification_and_its_rounding() -> None:
    """0.1 mm in units of 0.1 um is 1000: magnification 8, and rounding by at most 0.4 um."""
    made = exported(size=0.1)
    assert json.loads(made.native["volume.json"])["magnification"] == 8
    assert made.left.after.max() <= 0.0004 + 1e-9
    assert any("0.40 um" in note for note in made.notes)


def test_records_hold_24_points() -> None:
    machine = single_error("EXX", 0.02)
    settings = CONTROL.settings({"sign": "error"})
    made = export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.0001, settings), 500)
    found = json.loads(made.native["volume.json"])
    assert len(found["records"]) == -(-int(np.prod(found["counts"])) // 24) > 1
    assert max(len(record["data"]) for record in found["records"]) == 72


BROKEN = {
    "a value gone": (lambda found: found["records"][0]["data"].pop(), "23 values, but states 24"),
    "a value too many": (lambda found: found["records"][0]["data"].append(0), "25 values, but states 24"),
    "a record gone": (lambda found: found["records"].clear(), "0 values in the records, 24 expected"),
    "too large": (lambda found: found["records"][0]["data"].__setitem__(0, 128), "beyond -127 to 127"),
    "too many points": (lambda found: found.update(counts=[26, 2, 2]), "2 to 25 points"),
    "one point": (lambda found: found.update(counts=[1, 2, 4]), "2 to 25 points"),
    "no interval": (lambda found: found.update(interval_mm=[0, 400, 300]), "interval_mm is 0, not a number"),
    "no sign": (lambda found: found.update(sign=""), "the sign is"),
    "a wrong number": (lambda found: found["records"][0].update(start_no=2), "record of point 2"),
    "another value than the CSV": (
        lambda found: found["records"][0]["data"].__setitem__(0, 5),
        "has other values",
    ),
    "a key gone": (lambda found: found.pop("magnification"), "magnification"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_files(case: str) -> None:
    damage, expected = BROKEN[case]
    files = dict(exported().native)
    found = json.loads(files["volume.json"])
    damage(found)
    files["volume.json"] = json.dumps(found).encode()
    assert any(expected in message.text for message in CONTROL.lint(files)), CONTROL.lint(files)
    with pytest.raises(ConfigError):
        CONTROL.read(files)


def test_the_control_can_put_the_grid_by_what_it_is_given() -> None:
    """Parameters have no first position: how many points, how far apart, and which is at the reference position."""
    machine = single_error("EXX", 0.02)
    for reference in ("", "X-137.2, Y12.5", "X300 Y250 Z-299.9995"):
        settings = CONTROL.settings({"sign": "error", "reference": reference})
        made = export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.001, settings), 2000)
        found = json.loads(made.native["volume.json"])
        place, points, steps = found["reference_mm"], found["reference_points"], found["interval_mm"]
        assert place == {"": [0, 0, 0], "X-137.2, Y12.5": [-137.2, 12.5, 0]}.get(reference, [300, 250, -299.9995])
        line = made.native["volume.csv"].decode().splitlines()[found["reference_number"]].split(",")
        assert line[0] == str(found["reference_number"])
        assert [float(word) for word in line[1:4]] == pytest.approx(place, abs=1e-9)
        for low_high, at, number, step, count in zip(
            ranges_of(machine), place, points, steps, found["counts"], strict=True
        ):
            assert at - (number - 1) * step <= low_high[0] + 1e-9  # the grid reaches over the travel
            assert at + (count - number) * step >= low_high[1] - 1e-9
            assert step == round(step, 3)  # of what a parameter can say
        assert made.left.after.max() <= 0.001
        sheet = made.files["hand-over.md"].decode()
        assert f"the reference position X{place[0]:g} is point {points[0]}" in sheet
        assert "FANUC-7" in sheet
        nodes = CONTROL.read({**made.native}).grids[0].nodes
        assert [line[number - 1] for line, number in zip(nodes, points, strict=True)] == pytest.approx(place)


def test_the_grid_is_run_where_the_parameters_put_it() -> None:
    """Another point at the reference position is another place of the grid, and the files must agree on it."""
    found = json.loads(exported().native["volume.json"])
    found["reference_points"] = [2, 1, 1]
    files = {**exported().native, "volume.json": json.dumps(found).encode()}
    assert any("the grid begins at [-700.0, -150.0, -300.0]" in message.text for message in CONTROL.lint(files))
    with pytest.raises(ConfigError):
        CONTROL.read(files)
    del found["reference_points"]  # as files were written before: run, with a word
    old = {**exported().native, "volume.json": json.dumps(found).encode()}
    assert [message.code for message in CONTROL.lint(old)] == ["NCF492"]
    assert CONTROL.read(old).grids[0].nodes[0][0] == -200


def referred(reference: str) -> None:
    machine = single_error("EXX")
    settings = CONTROL.settings({"sign": "error", "reference": reference})
    CONTROL.write(Request(machine, ranges_of(machine), 0.0, 0.001, settings))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("Z5", "the reference position of Z, 5 is not between -300 and 0"),
        ("Z5,W3", "X0,Y0,Z-10.5"),
        ("B3", "reference names B"),
        ("X1 X2", "X0,Y0,Z-10.5"),
    ],
)
def test_a_reference_position_that_the_grid_cannot_have_is_asked_for(given: str, words: str) -> None:
    with pytest.raises(UsageError) as caught:
        referred(given)
    assert caught.value.code == "NCF485"
    assert words in str(caught.value)


def test_machine_zero_beyond_the_range_is_not_guessed_about() -> None:
    machine = single_error("EXX")
    space = ranges_of(machine, {"X": (100.0, 300.0)})
    with pytest.raises(UsageError, match="taken to be machine zero"):
        CONTROL.write(Request(machine, space, 0.0, 0.001, CONTROL.settings({"sign": "error"})))


def template(**settings: str) -> dict[str, bytes]:
    machine = single_error("EXX").replace(effects=(Effect("EXX", (0.01,)),))
    said = {"sign": "correction", "template": "N{no}A1P{dx}A2P{dy}A3P{dz};", "reference": CORNER}
    chosen = CONTROL.settings({**said, **settings})
    return dict(export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.001, chosen), 100).native)


def test_the_text_file_is_written_only_with_a_template_and_marked_assumed() -> None:
    assert set(exported().native) == {"volume.json", "volume.csv"}
    text = template()["volume-ASSUMED.txt"].splitlines()
    assert text[:2] == [b"%", b"N1A1P-100A2P0A3P0;"]
    assert text[-2:] == [b"N8A1P-100A2P0A3P0;", b"%"]


def test_numbering_can_be_told() -> None:
    found = template(order="ZYX", first_number="10001")
    lines = found["volume.csv"].splitlines()
    assert lines[1].startswith(b"10001,-200.000000,-150.000000,-300.000000,")
    assert lines[2].startswith(b"10002,-200.000000,-150.000000,0.000000,")
    assert not CONTROL.lint(found)


def test_numbering_does_not_change_what_the_grid_does() -> None:
    machine = single_error("EBX", 40e-6)
    kinds = [{"order": order} for order in ("XYZ", "ZYX", "YZX")]
    left = [
        export(
            CONTROL, Request(machine, ranges_of(machine), 0.0, 0.001, CONTROL.settings({"sign": "error", **kind})), 200
        )
        for kind in kinds
    ]
    assert all((each.left.after == left[0].left.after).all() for each in left)


@pytest.mark.parametrize("wrong", ["{no} {dx}", "{no}{dq}", "{"])
def test_wrong_templates_are_refused(wrong: str) -> None:
    with pytest.raises(UsageError) as caught:
        template(template=wrong)
    assert caught.value.code == "NCF485"


def test_a_text_file_that_says_something_else_is_named() -> None:
    found = template()
    found["volume-ASSUMED.txt"] = found["volume-ASSUMED.txt"].replace(b"-100", b"-90", 1)
    assert any("has other values" in message.text for message in CONTROL.lint(found))


def test_least_squares_leave_less_at_the_worst() -> None:
    machine = single_error("EXX", 0.05)
    kinds = [CONTROL.settings({"sign": "error", "fit": fit, "reference": CORNER}) for fit in ("nodes", "area")]
    made = [export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.004, kind)) for kind in kinds]
    assert made[1].tables.points < made[0].tables.points
    assert made[1].left.after.max() < 0.004 + 1e-4  # and the rounding


def test_the_target_includes_the_rounding() -> None:
    """Values up to 30 um in 127 steps are rounded by up to 0.12 um: the points are so many that 0.4 um hold anyway."""
    machine = single_error("EXX", 0.02)
    settings = CONTROL.settings({"sign": "error"})
    made = export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.0004, settings), 2000)
    assert json.loads(made.native["volume.json"])["magnification"] > 1
    assert made.left.after.max() <= 0.0004


def test_points_are_fitted_to_what_is_around_them_if_exact_ones_miss_too_much(root: Path) -> None:
    """The screw of the shipped machine: a wave of 12 mm along X, for which 25 exact points are too few."""
    machine = load(str(root / "examples" / "machines" / "three_axis.toml"))
    left = {}
    for fit in ("nodes", "auto"):
        settings = CONTROL.settings({"sign": "error", "fit": fit})
        made = export(CONTROL, Request(machine, ranges_of(machine), 120.0, 0.0008, settings), 2000)
        left[fit] = float(made.left.after.max())
    assert left["nodes"] > 0.0008
    assert left["auto"] < left["nodes"]


def test_play_that_the_parameter_cannot_hold_is_refused() -> None:
    """20 um of play are 20000 detection units of 0.001 um."""
    play = Effect("EXX", (-0.02,), Backlash())
    machine = single_error("EXX").replace(effects=(play,))
    request = Request(machine, ranges_of(machine), 0.0, 0.001, {"sign": "error", "detection_unit_um": "0.001"})
    with pytest.raises(RefusedError, match="20000 detection units, and parameter 1851 holds 9999"):
        CONTROL.write(request)
