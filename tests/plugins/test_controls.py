"""Every control that comes with ncfix passes the contract that any plugin must pass."""

from __future__ import annotations

from pathlib import Path

import pytest

from conftest import FULL
from ncfix.diagnostics import UsageError
from ncfix.tables.control import controls, get_control
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
