"""The variables of a chain: each is Large (a position, a dimension) or Small (an error). Freeman and Ford (2003), 3.

Small ones are what the formulas are expanded in. An error may be a function of axis positions: `EXX(X)`.
"""

from __future__ import annotations

import keyword
import re
from dataclasses import dataclass
from enum import Enum

import sympy as sp

from ncfix.diagnostics import ConfigError

TAKEN = (
    "np",
    "shape",
    "map",
    "v",
    "locals",
    "float",
    "pi",
    "sin",
    "cos",
    "tan",
    "sqrt",
    "branch",
    *"xyzijk",
    "dx",
    "dy",
    "dz",
    "rx",
    "ry",
    "rz",
)
RESERVED = {*keyword.kwlist, *keyword.softkwlist, *TAKEN}
GREEK = re.compile(r"(Theta|theta|phi|psi|alpha|beta|gamma|delta)(\w*)")
LETTER = re.compile(r"([A-Za-z])_?(\w+)")


class Size(Enum):
    """Whether the formulas are exact in a variable or expanded in it."""

    LARGE = "large"
    SMALL = "small"


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable of a chain.

    name        a name that programming languages accept, too
    size        Large or Small
    definition  what it is, in words
    axis        it is the position of an axis: what a command sets
    rotary      it is an angle, rad; else mm
    arguments   of an error that changes with the state: the names of what it depends on
    value       its number if it has one, mm or rad
    sign        -1 if the angle is defined clockwise, as older work may have it; chains are built with it
    """

    name: str
    size: Size = Size.LARGE
    definition: str = ""
    axis: bool = False
    rotary: bool = False
    arguments: tuple[str, ...] = ()
    value: float | None = None
    sign: int = 1

    def __post_init__(self) -> None:
        if self.name in RESERVED or not all(name.isidentifier() for name in (self.name, *self.arguments)):
            hint = "letters, digits and underscores; no word that Python reserves, no name of a result such as x or dx"
            raise ConfigError.of("NCF391", f"{self.name!r} cannot be the name of a variable", hint=hint)

    @property
    def small(self) -> bool:
        """Whether it is an error."""
        return self.size is Size.SMALL

    @property
    def plain(self) -> sp.Symbol:
        """The bare symbol."""
        return sp.Symbol(self.name, real=True)

    @property
    def symbol(self) -> sp.Expr:
        """What stands for it in formulas: a symbol, or a function of what it depends on."""
        if not self.arguments:
            return self.plain
        return sp.Function(self.name, real=True)(*(sp.Symbol(name, real=True) for name in self.arguments))

    @property
    def latex(self) -> str:
        """Its name in LaTeX, without arguments."""
        if self.name == "tool_length":
            return "L"
        if match := GREEK.fullmatch(self.name):
            return rf"\{match[1]}_{{{match[2]}}}" if match[2] else rf"\{match[1]}"
        if match := LETTER.fullmatch(self.name):
            return rf"{match[1]}_{{\mathrm{{{match[2]}}}}}"
        return self.name
