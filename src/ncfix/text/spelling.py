"""How numbers are spelled: one in the manner of the one that it replaces, or a new one as the control writes them.

One rule for all output: a value is printed with a fixed number of decimals, correctly rounded from the double
(an exact half goes to the even digit, as the C library does), and minus zero is zero where a number is rewritten.
`number_text` writes many numbers as columns by the same rule.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace


def value_of(text: str) -> float:
    """The value of a number as written, with a point or a comma, blanks inside it ignored; raises ValueError."""
    return float("".join(text.split()).replace(",", "."))


def decimals_for(step: float) -> int:
    """How many decimals the control's least increment needs: 0.001 -> 3, 0.0005 -> 4, 1/25400 -> 5.

    `step` is in the unit of the word.
    """
    return max(0, math.ceil(-math.log10(step) - 1e-9))


@dataclass(frozen=True, slots=True)
class NumberStyle:
    """The manner of one written number.

    decimals       digits after the point
    point          a decimal point is written even when no digit follows it
    plus           a plus sign is written
    leading_zero   a zero is written before the point of numbers below one
    width          digits before the point, where they were padded with zeros (`X007.5` -> 3), else 0
    """

    decimals: int = 0
    point: bool = True
    plus: bool = False
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


@dataclass(frozen=True, slots=True)
class Spelling:
    """How a control, or one program for it, spells what is put into a program.

    signed  numbers have a sign, plus as well
    comma   numbers have a decimal comma
    point   a number in the place of a formula has a point even when it is whole
    trimmed  such a number has no zeros at its end
    modal   whether axis words are increments is a mode; else only a word itself says so
    all_blanks  a word that is taken out takes all blanks before it along, not one
    vector  the addresses of the direction of the tool, each with what stands before its number; empty: it has none
    vector_digits  digits behind the point of a component of a unit vector, at least: 1e-6 rad is 6e-5 degrees
    vector_length  a direction keeps the length that it was programmed with; else it is a unit vector
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
        """A number without zeros at its end: `12.34`, `12.`."""
        return self._marked(NumberStyle(point=self.point, plus=self.signed).write(value, decimals), comma=self.comma)

    def instead(self, value: float, decimals: int) -> str:
        """A number in the place of a formula."""
        return self.short(value, decimals) if self.trimmed else self.number(value, decimals)

    def like(self, was: str, value: float, decimals: int) -> str:
        """A number in place of another one, in its manner; where numbers are signed, what had a sign keeps one."""
        style = NumberStyle.of(was.replace(",", "."))
        if self.signed and was.strip()[:1] == "-":
            style = replace(style, plus=True)
        return self._marked(style.write(value, decimals), comma="," in was or (self.comma and "." not in was))

    @staticmethod
    def _marked(text: str, *, comma: bool) -> str:
        return text.replace(".", ",") if comma else text
