"""The long programs of other controls: who writes them, and what `ncfix fix` is told about them."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

import fanuc_programs
import klartext_programs
import sinumerik_programs

OFFSET = ("--offset", "G54=0,0,0,0,0")


@dataclass(frozen=True, slots=True)
class OtherControl:
    """A control: its name for people, the module that writes programs for it, its dialect, and further options."""

    title: str
    programs: ModuleType
    dialect: str
    options: tuple[str, ...] = ()


OTHERS = (
    OtherControl("SINUMERIK", sinumerik_programs, "siemens", OFFSET),
    OtherControl("Fanuc", fanuc_programs, "fanuc", (*OFFSET, "--no-point", "calculator")),
    OtherControl("Klartext", klartext_programs, "heidenhain"),
)
