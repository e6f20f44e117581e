"""Rewritten programs as "tables", on any control: the control `gcode`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.plugin import Register, hookimpl, made_by

if TYPE_CHECKING:
    from collections.abc import Callable

    from ncfix.plugin import Control


@hookimpl
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Bring the control `gcode`: programs that are rewritten."""
    register(made_by("ncfix_gcode.control:Gcode"), name="gcode")
