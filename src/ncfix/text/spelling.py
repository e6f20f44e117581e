"""Spelling of numbers: in the style of the number that is replaced, or as new numbers are written for the control.

One rule for all output: a value is printed with a fixed number of decimals, correctly rounded from the double (an
exact half goes to the even digit, as in the C library). A rewritten number is never a minus zero.

`ncfix.core.words` writes most numbers of a long program, with identical bytes. A value so close to the middle between
two outputs that a product of doubles cannot decide which is nearer is left to the functions here.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from ncfix import core
from ncfix.text.numbers import POWERS, WORD_BYTES
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.core.words import NumberRules


def value_of(text: str) -> float:
    """The value of a number as written, with a point or a comma, blanks inside it ignored; raises ValueError."""
    return float("".join(text.split()).replace(",", "."))


def decimals_for(step: float) -> int:
    """Number of decimals that the least increment of a control needs: 0.001 -> 3, 0.0005 -> 4, 1/25400 -> 5.

    `step` is in the unit of the word.
    """
    return max(0, math.ceil(-math.log10(step) - 1e-9))


@frozen(kw_only=True)
class NumberStyle:
    """The style of one written number.

    decimals       digits after the point
    point          whether there is a decimal point even without digits after it
    plus           whether there is a plus sign
    leading_zero   whether numbers below one have a zero before the point
    width          number of digits before the point, if padded with zeros (`X007.5` -> 3), else 0
    """

    decimals: int = 0
    point: bool
    plus: bool
    leading_zero: bool = True
    width: int = 0

    @classmethod
    def of(cls, text: str) -> NumberStyle:
        """The style of a number as written, blanks inside it ignored."""
        compact = "".join(text.split())
        digits = compact.lstrip("+-")
        whole, point, fraction = digits.partition(".")
        padded = len(whole) > 1 and whole.startswith("0")
        return cls(
            decimals=len(fraction),
            point=bool(point),
            plus=compact.startswith("+"),
            leading_zero=bool(whole),
            width=len(whole) if padded else 0,
        )

    def write(self, value: float, decimals: int) -> str:
        """`value` in this style, with at most `decimals` digits but never fewer than the style's own.

        Zeros beyond the style's own decimals are dropped: `X50.` moved by 12 um is `X50.012`, not `X50.0120`.
        """
        text = f"{abs(value):.{max(decimals, self.decimals)}f}"
        whole, _, fraction = text.partition(".")
        fraction = fraction.rstrip("0").ljust(self.decimals, "0")
        is_zero = not (whole + fraction).strip("0")
        sign = "-" if value < 0 and not is_zero else "+" if self.plus else ""
        if not self.leading_zero and whole == "0" and fraction:
            whole = ""
        whole = whole.zfill(self.width)
        return sign + whole + ("." + fraction if fraction or self.point else "")


@frozen
class Spelling:
    """How a control, or one program for it, spells text that is inserted into a program.

    signed  numbers have a sign, also plus
    comma   numbers have a decimal comma
    point   a number that replaces an expression has a point even if it is whole
    trimmed  such a number has no trailing zeros
    modal   whether increments are a mode; else only a word itself says that it is an increment
    all_blanks  removing a word removes all blanks before it, not just one
    vector  addresses of the tool direction, each with the text before its number; empty: there are none
    vector_digits  smallest number of decimals of a unit vector's component: 1e-6 rad is 6e-5 degrees
    vector_length  a direction keeps its programmed length; else it is written as a unit vector
    """

    signed: bool = False
    comma: bool = False
    point: bool = True
    trimmed: bool = True
    modal: bool = True
    all_blanks: bool = False
    vector: tuple[str, ...] = ()
    vector_digits: int = 6
    vector_length: bool = False

    def number(self, value: float, decimals: int) -> str:
        """A new number, with all its decimals: `12.340`, `+12.340`."""
        if not self.signed:
            return self._marked(f"{value:.{decimals}f}", comma=self.comma)
        text = f"{value:+.{decimals}f}"
        return self._marked(text if text.strip("+-0.") else text.replace("-", "+"), comma=self.comma)

    def short(self, value: float, decimals: int) -> str:
        """A number without trailing zeros: `12.34`, `12.`."""
        return self._marked(NumberStyle(point=self.point, plus=self.signed).write(value, decimals), comma=self.comma)

    def instead(self, value: float, decimals: int) -> str:
        """A number that replaces an expression."""
        return self.short(value, decimals) if self.trimmed else self.number(value, decimals)

    def like(self, was: str, value: float, decimals: int) -> str:
        """A number that replaces another one, in its style; if numbers are signed, one that had a sign keeps a sign."""
        style = NumberStyle.of(was.replace(",", "."))
        if self.signed and was.strip()[:1] == "-":
            style = replace(style, plus=True)
        return self._marked(style.write(value, decimals), comma="," in was or (self.comma and "." not in was))

    @staticmethod
    def _marked(text: str, *, comma: bool) -> str:
        return text.replace(".", ",") if comma else text


MOST_DECIMALS = 9
"""Largest number of decimals written in bulk; a number with more is written by itself."""
MAX_BULK_BYTES = 2 * WORD_BYTES
"""Largest number of bytes, without the sign, of a number that is rewritten in bulk."""
MAX_BULK_STEPS = 1e9
"""Output steps from which on values are written by themselves: their products with powers of ten are too inexact."""
TIE_TOLERANCE = 1e-14
"""Relative distance from the middle between two outputs within which a value counts as on it; a hundred times the
rounding error of a product of doubles."""
MAX_ROUNDING_HALF_STEPS = 1.01
"""Largest distance from its position, in half output steps, by which rounding alone can displace an axis."""


def rules() -> NumberRules:
    """These limits, in the form that the core takes."""
    return core.loops("words").NumberRules(
        POWERS, MAX_BULK_BYTES, MOST_DECIMALS, MAX_BULK_STEPS, TIE_TOLERANCE, MAX_ROUNDING_HALF_STEPS
    )
