"""Fanuc Series 30i: three-dimensional error compensation."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.hookspecs import Register, hookimpl

if TYPE_CHECKING:
    from collections.abc import Callable

    from ncfix.tables.control import Control


@hookimpl
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Bring the control `fanuc`: the three-dimensional grid."""
    register(control, name="fanuc")


def control() -> Control:
    """The control, imported when tables are asked for."""
    from ncfix_fanuc.control import Fanuc

    return Fanuc()
