"""Plain ISO 6983 G-code: the dialect `iso`, what the controls have in common; and rewritten programs as "tables"."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.hookspecs import Register, hookimpl
from ncfix.program.dialect import FOREIGN, Dialect

if TYPE_CHECKING:
    from collections.abc import Callable

    from ncfix.tables.control import Control

ISO = Dialect(
    name="iso",
    title="ISO 6983 (common G-code)",
    grammar="iso.lark",
    suffixes=(".nc", ".gcode", ".tap", ".cnc", ".ncc", ".iso", ".g", ".gc", ".din", ".eia", ".min"),
    foreign=FOREIGN,
    line_limit=65535,
)


@hookimpl
def register_dialects(register: Register[Dialect]) -> None:
    """Bring the dialect `iso`."""
    register(ISO)


@hookimpl
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Bring the control `gcode`: programs that are rewritten."""
    register(programs, name="gcode")


def programs() -> Control:
    """The control, imported when tables are asked for."""
    from ncfix_gcode.control import Gcode

    return Gcode()
