"""Siemens SINUMERIK: sag and angularity compensation (CEC, sums and products of tables) and encoder tables (EEC)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.hookspecs import Register, hookimpl

if TYPE_CHECKING:
    from collections.abc import Callable

    from ncfix.tables.control import Control


@hookimpl
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Bring the control `siemens`: CEC and EEC tables."""
    register(control, name="siemens")


def control() -> Control:
    """The control, imported when tables are asked for."""
    from ncfix_siemens.control import Siemens

    return Siemens()
