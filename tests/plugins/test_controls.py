"""Every control that comes with ncfix passes the contract that any plugin must pass."""

from __future__ import annotations

from pathlib import Path

import pytest

from conftest import FULL
from ncfix.diagnostics import RefusedError, UsageError
from ncfix.machine import Machine, loads
from ncfix.tables.control import Request, controls, get_control
from ncfix.tables.correction import linear_axes, ranges_of
from ncfix.tables.export import export
from ncfix.testing import check_control

IN_ACTUAL_POSITIONS = {"type": "0"}


@pytest.mark.parametrize(
    ("name", "settings"), [("linuxcnc", {}), ("isg", {}), *([("linuxcnc", IN_ACTUAL_POSITIONS)] if FULL else [])]
)
def test_the_contract(name: str, settings: dict[str, str]) -> None:
    check_control(get_control(name), settings)


def test_all_are_found() -> None:
    fanuc, heidenhain = {"fanuc", "fanuc-pitch", "fanuc-rotary"}, {"heidenhain", "heidenhain-kinematics"}
    assert fanuc | heidenhain | {"gcode", "isg", "linuxcnc", "siemens"} <= set(controls())


@pytest.mark.parametrize("name", sorted(controls()))
def test_what_is_assumed_can_be_checked_and_what_is_set_is_explained(name: str, root: Path) -> None:
    control = get_control(name)
    assert all((each.id and each.text and each.source and each.default and each.verify) for each in control.assumptions)
    assert len({each.id for each in control.assumptions}) == len(control.assumptions)
    assert control.steps
    assert control.switch_off
    assert all(option.text for option in control.options.values())
    assert f"| `{name}` |" in (root / "docs" / "controllers.md").read_text()


def test_a_sign_that_no_public_text_gives_has_no_default() -> None:
    for name in ("fanuc", "fanuc-pitch", "fanuc-rotary", "heidenhain", "heidenhain-kinematics", "siemens"):
        options = get_control(name).options
        assert options["value_sign" if name == "siemens" else "sign"].default is None


def test_an_unknown_control_is_refused() -> None:
    with pytest.raises(UsageError) as caught:
        get_control("abacus")
    assert caught.value.code == "NCF480"


BORING_MILL = """
[axis.W]
type = "linear"
direction = [0, 0, 1]
range = [-10, 300]

[[effect]]
name = "EZW"
basis = "polynomial"
degree = [1, 2]
scale = 300
coefficients = [0.02, -0.006]

[[effect]]
name = "EBW"
basis = "polynomial"
degree = [1]
scale = 300
coefficients = [12e-6]
"""
"""A quill along the spindle, and two of its errors: of a large machine, but for the sizes illustrative."""
LEAVES = {"siemens": 0.05, "gcode": 0.05, "heidenhain": 0.5, "linuxcnc": 0.7, "fanuc": 0.5, "fanuc-rotary": 0.5}
"""Share of the largest error, at most: sums of products over all axes, sums over one, tables over X, Y and Z only."""


@pytest.fixture(scope="module")
def boring_mill(root: Path) -> Machine:
    text = (root / "examples" / "machines" / "three_axis.toml").read_text()
    return loads(text.replace("F Z t", "F Z W t").replace("[tool]", BORING_MILL + "\n[tool]", 1))


@pytest.mark.parametrize("name", LEAVES)
def test_x_y_and_z_take_up_the_errors_of_a_fourth_linear_axis(name: str, boring_mill: Machine) -> None:
    control = get_control(name)
    given = {"sign": "error", "value_sign": "error", "product_terms": "only"}
    settings = control.settings({key: value for key, value in given.items() if key in control.options})
    made = export(control, Request(boring_mill, ranges_of(boring_mill), 120.0, 0.001, settings), 2000)
    figures = made.left.figures()
    assert figures["after"]["max"] < LEAVES[name] * figures["before"]["max"]
    if name.startswith("fanuc"):
        assert any("W at zero; at other angles the remaining error is larger" in note for note in made.notes)


def test_a_machine_without_three_of_them_is_refused(root: Path) -> None:
    text = (root / "examples" / "machines" / "three_axis.toml").read_text().split("# -- X")[0]
    text = text.replace("X Y F Z t", "X V F Z W t").replace("[axis.Y]", "[axis.V]").replace("[tool]", BORING_MILL, 1)
    with pytest.raises(RefusedError, match="tables need three linear axes") as caught:
        linear_axes(loads(text.split("[[effect]]")[0]))
    assert caught.value.code == "NCF481"
