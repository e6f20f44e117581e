"""The ISG kernel (also Beckhoff TwinCAT CNC): volumetric compensation files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.plugin import Register, hookimpl, made_by

if TYPE_CHECKING:
    from collections.abc import Callable

    from ncfix.plugin import Control


@hookimpl
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Register the control `isg`: VOLCOMP configuration and grids."""
    register(made_by("ncfix_isg.control:Isg"), name="isg")
