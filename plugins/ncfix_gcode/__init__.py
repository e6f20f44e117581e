"""Rewritten programs as "tables", on any control: the control `gcode`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.plugin import Register, hookimpl

if TYPE_CHECKING:
    from collections.abc import Callable

    from ncfix.plugin import Control


def make_gcode() -> Control:
    """The control `gcode`."""
    from ncfix_gcode.control import Gcode

    return Gcode()


@hookimpl
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Bring the control `gcode`: programs that are rewritten."""
    register(make_gcode, name="gcode")
