"""Many numbers as text at once: the manner of written numbers as columns, and other values written in it.

What `number_style` does for one number, for all numbers of a text, byte for byte. A value that lies so close to the
middle between two outputs that a product of doubles cannot tell which of them is nearer is marked, and left to it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.program.numbers import NUMERIC, POINT, SIGN

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Mask = NDArray[np.bool_]

MOST_DECIMALS = 9
"""Decimals that are written in bulk; a number with more goes one by one."""
LARGEST = 1e9
"""Values of that many output steps go one by one: their products with powers of ten are not exact enough."""
TIE = 1e-5
"""So close to the middle between two outputs (in output steps) a value counts as on it; a hundred times the rounding of
the largest."""

ZERO, MINUS, PLUS = ord("0"), ord("-"), ord("+")


@dataclass(frozen=True, slots=True)
class Styles:
    """The manner of m written numbers, as in `NumberStyle`; `clear` (m,): nothing but a sign, digits and a point."""

    decimals: IntArray
    point: Mask
    plus: Mask
    leading_zero: Mask
    width: IntArray
    clear: Mask

    def rows(self, rows: IntArray) -> Styles:
        """Some of them."""
        return Styles(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


def styles_of(text: NDArray[np.uint8], spans: IntArray) -> Styles:
    """The styles of the numbers at `spans` (m, 2)."""
    starts, stops = spans[:, 0], spans[:, 1]
    decimals, point = _decimals(text, starts, stops)
    first = starts + SIGN[text[starts]]
    whole = stops - first - decimals - point
    padded = (whole > 1) & (text[first] == ZERO)
    return Styles(
        decimals=decimals,
        point=point,
        plus=text[starts] == PLUS,
        leading_zero=whole > 0,
        width=np.where(padded, whole, 0),
        clear=_pure(text, starts, stops) & (stops - starts <= MOST_DECIMALS + 8),
    )


def _decimals(text: NDArray[np.uint8], starts: IntArray, stops: IntArray) -> tuple[IntArray, Mask]:
    """Digits after the point of each number, and whether it has one; at most `MOST_DECIMALS` are looked at."""
    decimals, point = np.zeros(len(starts), dtype=np.int64), np.zeros(len(starts), dtype=np.bool_)
    for count in range(MOST_DECIMALS + 1):
        at = stops - 1 - count
        here = (at >= starts) & (text[np.maximum(at, 0)] == POINT) & ~point
        decimals[here] = count
        point |= here
        if count == 0 and point.all():
            break
    return decimals, point


def _pure(text: NDArray[np.uint8], starts: IntArray, stops: IntArray) -> Mask:
    """Which numbers have no blanks inside, and a sign only in front."""
    if not len(starts):
        return np.ones(0, dtype=np.bool_)
    low, high = int(starts.min()), int(stops.max())
    odd = np.flatnonzero(~NUMERIC[text[low:high]]) + low
    inside = np.searchsorted(odd, stops) - np.searchsorted(odd, starts)
    result: Mask = inside == SIGN[text[starts]]
    return result


@dataclass(frozen=True, slots=True)
class Texts:
    """Numbers as text.

    data    their bytes, one number after the other
    length  (m,) bytes of each
    value   (m,) what a reader makes of them
    """

    data: bytes
    length: IntArray
    value: FloatArray


def is_plain(values: FloatArray, decimals: IntArray) -> Mask:
    """Which values can be written in bulk with so many decimals: not too large, and clearly nearer to one output."""
    with np.errstate(invalid="ignore"):
        steps = np.abs(values) * 10.0**decimals
        off = np.abs(steps - np.floor(steps) - 0.5)
        plain: Mask = (steps < LARGEST) & (off > TIE)
    return plain


def rounded(values: FloatArray, decimals: IntArray | int) -> FloatArray:
    """What a reader makes of values written with so many decimals (for those that are `is_plain`)."""
    scale = 10.0 ** np.asarray(decimals)
    result: FloatArray = np.rint(values * scale) / scale + 0.0
    return result


def in_style(values: FloatArray, styles: Styles, decimals: IntArray) -> Texts:
    """Values in the styles of written numbers, as `NumberStyle.write` does it; all `is_plain`, all `clear`."""
    digits = np.maximum(decimals, styles.decimals)
    steps = np.rint(np.abs(values) * 10.0**digits).astype(np.int64)
    value = np.copysign(steps / 10.0**digits, values) + 0.0
    kept = digits.copy()
    for _ in range(int(digits.max(initial=0))):
        zero = (kept > styles.decimals) & (steps % 10 == 0)
        if not zero.any():
            break
        steps[zero] //= 10
        kept[zero] -= 1
    sign = np.where((values < 0) & (steps != 0), MINUS, np.where(styles.plus, PLUS, 0))
    return _laid_out(steps, kept, sign, styles.width, styles.leading_zero, styles.point, value)


def plain(values: FloatArray, decimals: IntArray, heads: NDArray[np.uint8]) -> Texts:
    """Values with exactly so many decimals, as `f"{value:.{decimals}f}"` does it; all `is_plain`.

    heads  (m, 2) bytes to put before each, 0 for none
    """
    steps = np.rint(np.abs(values) * 10.0**decimals).astype(np.int64)
    sign = np.where(np.signbit(values), MINUS, 0)
    everywhere = np.ones(len(values), dtype=np.bool_)
    value = np.copysign(steps / 10.0**decimals, values)
    return _laid_out(steps, decimals, sign, np.zeros_like(steps), everywhere, ~everywhere, value, heads)


def _laid_out(
    steps: IntArray,
    decimals: IntArray,
    sign: IntArray,
    width: IntArray,
    leading_zero: Mask,
    point: Mask,
    value: FloatArray,
    heads: NDArray[np.uint8] | None = None,
) -> Texts:
    """Sign, whole digits, point and decimals in fixed columns, of which those that are wanted are taken."""
    power = 10**decimals
    whole, fraction = np.divmod(steps, power)
    most = int(decimals.max(initial=0))
    fraction = (fraction * 10 ** (most - decimals)).astype(np.int64)
    columns = max(len(str(int(whole.max(initial=0)))), int(width.max(initial=0)))
    digits = np.maximum(np.searchsorted(10 ** np.arange(1, 18), whole, side="right") + 1, width)
    digits[(whole == 0) & ~leading_zero & (decimals > 0)] = 0
    cells = np.empty((len(steps), columns + most + 2), dtype=np.uint8)
    wanted = np.empty(cells.shape, dtype=np.bool_)
    cells[:, 0], wanted[:, 0] = sign, sign != 0
    for place in range(columns):
        column = columns - place
        whole, digit = np.divmod(whole, 10)
        cells[:, column], wanted[:, column] = digit + ZERO, digits > place
    cells[:, columns + 1], wanted[:, columns + 1] = POINT, point | (decimals > 0)
    for place in range(most - 1, -1, -1):
        column = columns + 2 + place
        fraction, digit = np.divmod(fraction, 10)
        cells[:, column], wanted[:, column] = digit + ZERO, decimals > place
    if heads is not None:
        cells, wanted = np.hstack((heads, cells)), np.hstack((heads != 0, wanted))
    return Texts(cells[wanted].tobytes(), wanted.sum(axis=1, dtype=np.int64), value)
