"""Fanuc and its like: the dialects `fanuc`, `haas`, `mitsubishi`, and Fanuc's three-dimensional error compensation."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ncfix.hookspecs import Register, hookimpl
from ncfix.program.dialect import FOREIGN, Dialect

if TYPE_CHECKING:
    from collections.abc import Callable

    from ncfix.tables.control import Control

VERICUT = ("the subroutine language of VERICUT", rb"(?im)^[ \t]*CGTECH_MACRO\b")
O_WORDS = (
    "LinuxCNC code",
    rb"(?im)^[ \t]*o[ \t]*(?:<[^>\n]+>|\d+)[ \t]*(?:sub|call|if|while|do|repeat)\b|#[ \t]*<[ \t]*_?\w",
)

FANUC = Dialect(
    name="fanuc",
    title="Fanuc (ISO with Macro B)",
    grammar="fanuc.lark",
    suffixes=(".fan", ".fnc"),
    signature=(
        rb"(?im)^[^(;\n]*(?<![A-Z])(?:IF|WHILE)[ \t]*\[[^\n]*\][ \t]*(?:GOTO|THEN|DO)[ \t]*[\d#\[]",
        rb"(?im)^[ \t/]*(?:N\d+[ \t]*)?GOTO[ \t]*[\d#]",
        rb"(?im)^[^(;\n]*(?<![A-Z])G[ \t]*(?:6[56][ \t]*P|66\.1|68\.2|43\.[45]|54\.1|53\.1|5\.1[ \t]*Q)(?![\d.]\d)",
        rb"(?im)^[^(;\n]*(?<![A-Z])M[ \t]*98[ \t]*<",
    ),
    foreign=(*FOREIGN, VERICUT, O_WORDS),
    closure_mm=0.01,
    language="ncfix.program.fanuc.language:FANUC",
    semantics="fanuc",
)

HAAS = replace(
    FANUC,
    name="haas",
    title="Haas (mill)",
    suffixes=(),
    signature=(
        rb"(?im)^[^(;\n]*(?<![A-Z])G[ \t]*(?:(?:187|150)(?!\d)|154[ \t]*P|47[ \t]*[PE]|103[ \t]*P)",
        rb"(?im)^[^(;\n]*(?<![A-Z])M[ \t]*97[ \t]*P",
    ),
    semantics="haas",
)

MITSUBISHI = replace(FANUC, name="mitsubishi", title="Mitsubishi (M700/M800, ISO)", suffixes=(), signature=())


@hookimpl
def register_dialects(register: Register[Dialect]) -> None:
    """Bring the dialects."""
    for dialect in (FANUC, HAAS, MITSUBISHI):
        register(dialect)


@hookimpl
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Bring the controls `fanuc` and `fanuc-rotary`, grids in space, and `fanuc-pitch`, stored pitch errors."""
    register(grid, name="fanuc")
    register(grid_with_angles, name="fanuc-rotary")
    register(pitch_errors, name="fanuc-pitch")


def grid() -> Control:
    """The grid, imported when tables are asked for."""
    from ncfix_fanuc.control import Fanuc

    return Fanuc()


def grid_with_angles() -> Control:
    """The grid with angles."""
    from ncfix_fanuc.rotary import FanucRotary

    return FanucRotary()


def pitch_errors() -> Control:
    """Stored pitch errors."""
    from ncfix_fanuc.pitch import FanucPitch

    return FanucPitch()
