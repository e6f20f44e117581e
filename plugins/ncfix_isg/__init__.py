"""The ISG kernel (also Beckhoff TwinCAT CNC): volumetric compensation files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.plugin import Register, hookimpl

if TYPE_CHECKING:
    from collections.abc import Callable

    from ncfix.plugin import Control


def make_isg() -> Control:
    """The control `isg`."""
    from ncfix_isg.control import Isg

    return Isg()


@hookimpl
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Bring the control `isg`: VOLCOMP configuration and grid."""
    register(make_isg, name="isg")
