"""Heidenhain controls: axis compensation tables (`.COM`, `.CMA`) and KinematicsComp."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.hookspecs import Register, hookimpl

if TYPE_CHECKING:
    from collections.abc import Callable

    from ncfix.tables.control import Control


@hookimpl
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Bring the controls `heidenhain`, axis tables, and `heidenhain-kinematics`, KinematicsComp."""
    register(axis_tables, name="heidenhain")
    register(whole_chain, name="heidenhain-kinematics")


def axis_tables() -> Control:
    """The control with axis tables, imported when tables are asked for."""
    from ncfix_heidenhain.control import Heidenhain

    return Heidenhain()


def whole_chain() -> Control:
    """The control with KinematicsComp."""
    from ncfix_heidenhain.kinematics import KinematicsComp

    return KinematicsComp()
