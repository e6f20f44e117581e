"""Rewritten programs as "tables", on any control: the control `gcode`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.hookspecs import Register, hookimpl

if TYPE_CHECKING:
    from collections.abc import Callable

    from ncfix.tables.control import Control


@hookimpl
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Bring the control `gcode`: programs that are rewritten."""
    register(programs, name="gcode")


def programs() -> Control:
    """The control, imported when tables are asked for."""
    from ncfix_gcode.control import Gcode

    return Gcode()
