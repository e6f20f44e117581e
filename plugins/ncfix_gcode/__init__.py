"""The control `gcode`: rewritten programs in the role of tables, for any control."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.plugin import Register, hookimpl, made_by

if TYPE_CHECKING:
    from collections.abc import Callable

    from ncfix.plugin import Control


@hookimpl
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Register the control `gcode`."""
    register(made_by("ncfix_gcode.control:Gcode"), name="gcode")
