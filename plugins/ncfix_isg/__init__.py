"""The ISG kernel (also Beckhoff TwinCAT CNC): volumetric compensation files."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from ncfix.hookspecs import Register, hookimpl

if TYPE_CHECKING:
    from collections.abc import Callable

    from ncfix.tables.control import Control


@hookimpl
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Bring the control `isg`: VOLCOMP configuration and grid."""
    register(lambda: import_module("ncfix_isg.control").Isg(), name="isg")
