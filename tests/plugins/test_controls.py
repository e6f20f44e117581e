"""Every control that comes with ncfix passes the contract that any plugin must pass."""

from __future__ import annotations

import pytest

from ncfix.diagnostics import UsageError
from ncfix.tables.control import controls, get_control
from ncfix.testing import check_control


@pytest.mark.parametrize("name", ["linuxcnc", "isg"])
def test_the_contract(name: str) -> None:
    check_control(get_control(name))


def test_actual_positions_are_the_same_tables_in_another_form() -> None:
    check_control(get_control("linuxcnc"), {"type": "0"})


def test_all_are_found() -> None:
    assert {"fanuc", "linuxcnc", "isg"} <= set(controls())


def test_an_unknown_control_is_refused() -> None:
    with pytest.raises(UsageError) as caught:
        get_control("abacus")
    assert caught.value.code == "NCF480"
