"""Plain ISO 6983 G-code: the dialect `iso`, what the controls have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.hookspecs import Register, hookimpl

if TYPE_CHECKING:
    from ncfix.program.dialect import Dialect


@hookimpl
def register_dialects(register: Register[Dialect]) -> None:
    """Bring the dialect `iso`."""
