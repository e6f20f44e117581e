"""LinuxCNC (RS274NGC): the dialect `linuxcnc`, and screw compensation files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.hookspecs import Register, hookimpl
from ncfix.program.dialect import FOREIGN, Dialect

if TYPE_CHECKING:
    from collections.abc import Callable

    from ncfix.tables.control import Control

LINUXCNC = Dialect(
    name="linuxcnc",
    title="LinuxCNC (RS274NGC)",
    grammar="linuxcnc.lark",
    suffixes=(".ngc",),
    signature=(
        rb"(?im)^[ \t]*o[ \t]*(<[^>\n]+>|\d+)[ \t]*(sub|call|if|while|do|repeat)\b",
        rb"#[ \t]*<[ \t]*_?\w+[ \t]*>",
    ),
    line_limit=252,
    needs_end=True,
    foreign=FOREIGN,
    semantics="linuxcnc",
    feed_of="linear",
)


@hookimpl
def register_dialects(register: Register[Dialect]) -> None:
    """Bring the dialect `linuxcnc`."""
    register(LINUXCNC)


@hookimpl
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Bring the control `linuxcnc`: `.comp` files."""
    register(control, name="linuxcnc")


def control() -> Control:
    """The control, imported when tables are asked for."""
    from ncfix_linuxcnc.control import LinuxCnc

    return LinuxCnc()
