"""How a number is written in a block, and how another value is written in the same style.

One rule for all output: a value is printed with a fixed number of decimals, correctly rounded from the double
(an exact half goes to the even digit, as the C library does), and minus zero is zero.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


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
        sign = self._sign(value, whole, fraction)
        if not self.leading_zero and whole == "0" and fraction:
            whole = ""
        whole = whole.zfill(self.width)
        return sign + whole + ("." + fraction if fraction or self.point else "")

    def _sign(self, value: float, whole: str, fraction: str) -> str:
        is_zero = not (whole + fraction).strip("0")
        if value < 0 and not is_zero:
            return "-"
        return "+" if self.plus else ""


def decimals_for(step: float) -> int:
    """How many decimals the control's least increment needs: 0.001 -> 3, 0.0005 -> 4, 1/25400 -> 5.

    `step` is in the unit of the word.
    """
    return max(0, math.ceil(-math.log10(step) - 1e-9))
