"""How numbers are spelled: one in the manner of the one that it replaces, or a new one as the control writes them.

One rule for all output: a value is printed with a fixed number of decimals, correctly rounded from the double
(an exact half goes to the even digit, as the C library does), and minus zero is zero where a number is rewritten.

Many numbers are written as columns, byte for byte the same. A value that lies so close to the middle between two
outputs that a product of doubles cannot tell which of them is nearer is marked, and written by itself.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ncfix import core
from ncfix.arrays import Array, Bytes, Ints, Mask
from ncfix.text.numbers import EIGHT, POINT, POWERS, SIGN, digits_of
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.core.words import NumberRules


def value_of(text: str) -> float:
    """The value of a number as written, with a point or a comma, blanks inside it ignored; raises ValueError."""
    return float("".join(text.split()).replace(",", "."))


def decimals_for(step: float) -> int:
    """How many decimals the control's least increment needs: 0.001 -> 3, 0.0005 -> 4, 1/25400 -> 5.

    `step` is in the unit of the word.
    """
    return max(0, math.ceil(-math.log10(step) - 1e-9))


@frozen(kw_only=True)
class NumberStyle:
    """The manner of one written number.

    decimals       digits after the point
    point          a decimal point is written even when no digit follows it
    plus           a plus sign is written
    leading_zero   a zero is written before the point of numbers below one
    width          digits before the point, where they were padded with zeros (`X007.5` -> 3), else 0
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


MOST_DECIMALS = 9
"""Decimals that are written in bulk; a number with more goes one by one."""
LONGEST = 2 * EIGHT
"""Bytes, but for its sign, of the longest number that is rewritten in bulk."""
LARGEST = 1e9
"""Values of that many output steps go one by one: their products with powers of ten are not exact enough."""
TIE = 1e-14
"""So close to the middle between two outputs, as a share of it, a value counts as on it; a hundred times the rounding
of a product of doubles."""
ROUNDED = 1.01
"""Half output steps by which an axis may stand off its place for nothing but rounding."""

ZERO, MINUS, PLUS = ord("0"), ord("-"), ord("+")


def rules() -> NumberRules:
    """These numbers, as the core takes them."""
    return core.loops("words").NumberRules(POWERS, LONGEST, MOST_DECIMALS, LARGEST, TIE, ROUNDED)


@frozen
class Styles:
    """The manner of m numbers, as in `NumberStyle`; `clear` (m,): nothing but a sign, digits and a point."""

    decimals: Ints
    point: Mask
    plus: Mask
    leading_zero: Mask
    width: Ints
    clear: Mask

    def rows(self, rows: Ints) -> Styles:
        """Some of them."""
        return Styles(*(getattr(self, name).take(rows) for name in self.__dataclass_fields__))


def styles_of(text: Bytes, spans: Ints, *, signed: bool = False) -> Styles:
    """The styles of the numbers at `spans` (m, 2); `signed`: what had a sign keeps one, whichever."""
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
        clear=found.pure & ~found.several & (stops - first <= LONGEST) & (decimals <= MOST_DECIMALS),
    )


@frozen
class NumberColumns:
    """How m numbers are to be written, columns.

    heads     four bytes that stand before each, as one number; a zero byte for none
    sign      a character, 0 for none
    steps     its size in units of 10^-decimals
    decimals  digits behind the point
    least     digits before the point that there are at least
    point     a point is written
    """

    heads: NDArray[np.uint32]
    sign: Bytes
    steps: NDArray[np.uint32]
    decimals: Ints
    least: Ints
    point: Mask

    def and_then(self, other: NumberColumns, order: Ints) -> NumberColumns:
        """These numbers and others behind them, all put in an order."""
        names = self.__dataclass_fields__
        return NumberColumns(*(np.concatenate((getattr(self, k), getattr(other, k))).take(order) for k in names))


@frozen
class Texts:
    """Numbers as text: their bytes, one number after the other, and how many each of them takes, (m,)."""

    data: bytes
    length: Ints


def is_plain(values: Array, decimals: Ints) -> Mask:
    """Which of values (n,) can be written in bulk with `decimals` (n,): not too large, clearly nearer to one output."""
    with np.errstate(invalid="ignore"):
        steps = np.abs(values) * POWERS.take(decimals)
        off = np.abs(steps - np.floor(steps) - 0.5)
        plain: Mask = (steps < LARGEST) & (off > TIE * steps)
    return plain


def rounded(values: Array, decimals: Ints | int) -> Array:
    """What a reader makes of values (n,) written with so many decimals (for those that are `is_plain`)."""
    scale = POWERS.take(decimals)
    return np.rint(values * scale) / scale + 0.0


def in_style(values: Array, styles: Styles, decimals: Ints) -> NumberColumns:
    """Values in the styles of written numbers, as `NumberStyle.write` does it; all `is_plain`, all `clear`."""
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
    """Values with exactly so many decimals, as `f"{value:.{decimals}f}"` does it; all `is_plain`.

    heads   (m, 4) bytes to put before each, 0 for none
    signed  with a plus sign, too, which zero has as well
    """
    steps = _steps(values, decimals)
    negative = (values < 0) & (steps != 0) if signed else np.signbit(values)
    sign = np.where(negative, MINUS, PLUS if signed else 0).astype(np.uint8)
    return NumberColumns(
        heads.view(np.uint32)[:, 0], sign, steps, decimals, np.ones(len(steps), np.int64), decimals > 0
    )


def _steps(values: Array, decimals: Ints) -> NDArray[np.uint32]:
    """How many output steps values are, the sign left out; all less than `LARGEST`."""
    return np.rint(np.abs(values) * POWERS.take(decimals)).astype(np.uint32)


def laid_out(numbers: NumberColumns) -> Texts:
    """Numbers as text: what stands before, sign, digits, point and decimals in columns, and zero where nothing is."""
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
    """How many digits whole numbers have; 0 has none."""
    found = np.zeros(len(values), dtype=np.int64)
    for place in range(len(str(int(values.max(initial=0))))):
        found += values >= TENS[place]
    return found


TENS = 10 ** np.arange(19)
QUAD = 4
QUADS = (np.arange(10_000)[:, None] // (1000, 100, 10, 1) % 10 + ZERO).astype(np.uint8).view(np.uint32).ravel()
"""The numbers of four digits as text, each as one number."""
FIRST = (np.tri(QUAD + 1, QUAD, -1) * 0xFF).astype(np.uint8).view(np.uint32).ravel()
LAST = (np.tri(QUAD + 1, QUAD, -1) * 0xFF).astype(np.uint8)[:, ::-1].copy().view(np.uint32).ravel()
"""What leaves of four characters the first so many, or the last so many."""


def _in_quads(values: NDArray[Any], digits: int) -> list[NDArray[np.uint32]]:
    """Whole numbers of up to so many digits as text, four characters each."""
    quads: list[NDArray[np.uint32]] = []
    for _ in range(-(-digits // QUAD)):
        above = values // 10_000
        quads.insert(0, QUADS.take(values - above * 10_000))
        values = above
    return quads


def without_zeros(columns: list[NDArray[Any]]) -> bytes:
    """The bytes of columns, row by row, but for zeros."""
    cells = np.empty((len(columns[0]), sum(column.itemsize for column in columns)), dtype=np.uint8)
    at = 0
    for column in columns:
        cells[:, at : at + column.itemsize].view(column.dtype)[:, 0] = column
        at += column.itemsize
    return cells.tobytes().translate(None, b"\0")
