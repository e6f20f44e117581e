"""Spelling of numbers: in the style of the number that is replaced, or as new numbers are written for the control.

One rule for all output: a value is printed with a fixed number of decimals, correctly rounded from the double (an
exact half goes to the even digit, as in the C library). A rewritten number is never a minus zero.

Many numbers are written as columns, with identical bytes. A value so close to the middle between two outputs that a
product of doubles cannot decide which is nearer is marked, and written by itself.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ncfix import core
from ncfix.arrays import Array, Bytes, Ints, Mask
from ncfix.text.numbers import POINT, POWERS, SIGN, WORD_BYTES, digits_of
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

ZERO, MINUS, PLUS = ord("0"), ord("-"), ord("+")


def rules() -> NumberRules:
    """These limits, in the form that the core takes."""
    return core.loops("words").NumberRules(
        POWERS, MAX_BULK_BYTES, MOST_DECIMALS, MAX_BULK_STEPS, TIE_TOLERANCE, MAX_ROUNDING_HALF_STEPS
    )


@frozen
class Styles:
    """The styles of m numbers, as in `NumberStyle`; `clear` (m,): sign, digits and a point only, not too many."""

    decimals: Ints
    point: Mask
    plus: Mask
    leading_zero: Mask
    width: Ints
    clear: Mask

    def rows(self, rows: Ints) -> Styles:
        """The styles of some of the numbers."""
        return Styles(*(getattr(self, name).take(rows) for name in self.__dataclass_fields__))


def styles_of(text: Bytes, spans: Ints, *, signed: bool = False) -> Styles:
    """The styles of the numbers at `spans` (m, 2); `signed`: a number that had a sign keeps one."""
    low, high = (int(spans[:, 0].min()), int(spans[:, 1].max())) if len(spans) else (0, 0)
    text, spans = text[low:high], spans - low
    starts, stops = spans[:, 0], spans[:, 1]
    signs = text.take(starts)
    first = starts + SIGN.take(signs)
    found = digits_of(text, first, stops, valued=False)
    decimals = found.tail - found.pointed
    whole = stops - first - found.tail
    return Styles(
        decimals=decimals,
        point=found.pointed,
        plus=(signs == PLUS) | (signs == MINUS) if signed else signs == PLUS,
        leading_zero=whole > 0,
        width=np.where((whole > 1) & (text.take(first) == ZERO), whole, 0),
        clear=found.pure & ~found.several & (stops - first <= MAX_BULK_BYTES) & (decimals <= MOST_DECIMALS),
    )


@frozen
class NumberColumns:
    """Instructions for writing m numbers, as columns.

    heads     four bytes before each number, as one integer; zero bytes are left out
    sign      a character; 0: none
    steps     the absolute value in units of 10^-decimals
    decimals  digits after the point
    least     smallest number of digits before the point
    point     whether a point is written
    """

    heads: NDArray[np.uint32]
    sign: Bytes
    steps: NDArray[np.uint32]
    decimals: Ints
    least: Ints
    point: Mask

    def and_then(self, other: NumberColumns, order: Ints) -> NumberColumns:
        """These numbers followed by others, reordered by `order`."""
        names = self.__dataclass_fields__
        return NumberColumns(*(np.concatenate((getattr(self, k), getattr(other, k))).take(order) for k in names))


@frozen
class Texts:
    """Numbers as text: the bytes of all numbers in sequence, and the number of bytes of each, (m,)."""

    data: bytes
    length: Ints


def is_plain(values: Array, decimals: Ints) -> Mask:
    """(n,) whether values can be written in bulk with `decimals` (n,): neither too large nor between two outputs."""
    with np.errstate(invalid="ignore"):
        steps = np.abs(values) * POWERS.take(decimals)
        off = np.abs(steps - np.floor(steps) - 0.5)
        plain: Mask = (steps < MAX_BULK_STEPS) & (off > TIE_TOLERANCE * steps)
    return plain


def rounded(values: Array, decimals: Ints | int) -> Array:
    """The values (n,) as read back after writing with so many decimals; for values that are `is_plain`."""
    scale = POWERS.take(decimals)
    return np.rint(values * scale) / scale + 0.0


def in_style(values: Array, styles: Styles, decimals: Ints) -> NumberColumns:
    """Values in the styles of written numbers, like `NumberStyle.write`; all must be `is_plain` and `clear`."""
    places = np.maximum(decimals, styles.decimals)
    steps = _steps(values, places)
    rows = np.flatnonzero(places > styles.decimals)
    while len(rows):
        rows = rows[(steps[rows] % 10 == 0) & (places[rows] > styles.decimals[rows])]
        steps[rows] //= 10
        places[rows] -= 1
    sign = styles.plus * np.uint8(PLUS)
    sign[(values < 0) & (steps != 0)] = MINUS
    least = np.maximum(styles.width, styles.leading_zero | (places == 0))
    return NumberColumns(np.zeros(len(steps), np.uint32), sign, steps, places, least, styles.point | (places > 0))


def plain(values: Array, decimals: Ints, heads: Bytes, *, signed: bool = False) -> NumberColumns:
    """Values with exactly so many decimals, as by `f"{value:.{decimals}f}"`; all must be `is_plain`.

    heads   (m, 4) bytes to put before each number, 0 for none
    signed  with a sign in any case, zero with a plus
    """
    steps = _steps(values, decimals)
    negative = (values < 0) & (steps != 0) if signed else np.signbit(values)
    sign = np.where(negative, MINUS, PLUS if signed else 0).astype(np.uint8)
    return NumberColumns(
        heads.view(np.uint32)[:, 0], sign, steps, decimals, np.ones(len(steps), np.int64), decimals > 0
    )


def _steps(values: Array, decimals: Ints) -> NDArray[np.uint32]:
    """The absolute values in output steps; all less than `MAX_BULK_STEPS`."""
    return np.rint(np.abs(values) * POWERS.take(decimals)).astype(np.uint32)


def laid_out(numbers: NumberColumns) -> Texts:
    """The numbers as text: columns of heads, signs, digits, points and decimals, without their zero bytes."""
    decimals, most = numbers.decimals, int(numbers.decimals.max(initial=0))
    if int(decimals.min(initial=most)) == most:
        decimals = np.array(most)  # numpy divides by one number much faster than by many
    steps: NDArray[Any] = numbers.steps if most <= 2 * QUAD else numbers.steps.astype(np.int64)
    power: NDArray[Any] = TENS.take(decimals).astype(steps.dtype)
    whole = steps // power
    fraction = (steps - whole * power) * TENS.take(-most % QUAD + most - decimals).astype(steps.dtype)
    digits = np.maximum(numbers.least, _digits(whole))
    before, behind = _in_quads(whole, int(digits.max(initial=0))), _in_quads(fraction, most)
    for place, quad in enumerate(reversed(before)):
        quad &= LAST.take(digits - QUAD * place, mode="clip")
    for place, quad in enumerate(behind):
        quad &= FIRST.take(decimals - QUAD * place, mode="clip")
    length = digits + decimals + numbers.point + (numbers.sign != 0)
    heads = [numbers.heads] if numbers.heads.any() else []
    for k in range(QUAD * len(heads)):
        length += heads[0] & np.uint32(0xFF << 8 * k) != 0
    point = numbers.point * np.uint8(POINT)
    return Texts(without_zeros([*heads, numbers.sign, *before, point, *behind]), length)


def _digits(values: NDArray[Any]) -> Ints:
    """Number of digits of whole numbers; 0 has none."""
    found = np.zeros(len(values), dtype=np.int64)
    for place in range(len(str(int(values.max(initial=0))))):
        found += values >= TENS[place]
    return found


TENS = 10 ** np.arange(19)
QUAD = 4
QUADS = (np.arange(10_000)[:, None] // (1000, 100, 10, 1) % 10 + ZERO).astype(np.uint8).view(np.uint32).ravel()
"""The numbers 0000 to 9999 as text, each as one integer."""
FIRST = (np.tri(QUAD + 1, QUAD, -1) * 0xFF).astype(np.uint8).view(np.uint32).ravel()
LAST = (np.tri(QUAD + 1, QUAD, -1) * 0xFF).astype(np.uint8)[:, ::-1].copy().view(np.uint32).ravel()
"""Masks that keep the first `count`, or the last `count`, of four characters."""


def _in_quads(values: NDArray[Any], digits: int) -> list[NDArray[np.uint32]]:
    """Whole numbers of up to `digits` digits as text, in columns of four characters."""
    quads: list[NDArray[np.uint32]] = []
    for _ in range(-(-digits // QUAD)):
        above = values // 10_000
        quads.insert(0, QUADS.take(values - above * 10_000))
        values = above
    return quads


def without_zeros(columns: list[NDArray[Any]]) -> bytes:
    """The bytes of the columns row by row, without zero bytes."""
    cells = np.empty((len(columns[0]), sum(column.itemsize for column in columns)), dtype=np.uint8)
    at = 0
    for column in columns:
        cells[:, at : at + column.itemsize].view(column.dtype)[:, 0] = column
        at += column.itemsize
    return cells.tobytes().translate(None, b"\0")
