"""Many numbers as text at once: the manner of written numbers as columns, and other values written in it.

What `number_style` does for one number, for all numbers of a text, byte for byte. A value that lies so close to the
middle between two outputs that a product of doubles cannot tell which of them is nearer is marked, and left to it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.program.numbers import EIGHT, POINT, POWERS, SIGN, digits_of

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Mask = NDArray[np.bool_]

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


def styles_of(text: NDArray[np.uint8], spans: IntArray, *, signed: bool = False) -> Styles:
    """The styles of the numbers at `spans` (m, 2); `signed`: what had a sign keeps one, whichever."""
    low, high = (int(spans[:, 0].min()), int(spans[:, 1].max())) if len(spans) else (0, 0)
    text, spans = text[low:high], spans - low
    starts, stops = spans[:, 0], spans[:, 1]
    signs = text[starts]
    first = starts + SIGN[signs]
    found = digits_of(text, np.stack((first, stops), axis=1), valued=False)
    decimals = found.tail - found.pointed
    whole = stops - first - found.tail
    return Styles(
        decimals=decimals,
        point=found.pointed,
        plus=(signs == PLUS) | (signs == MINUS) if signed else signs == PLUS,
        leading_zero=whole > 0,
        width=np.where((whole > 1) & (text[first] == ZERO), whole, 0),
        clear=found.pure & ~found.several & (stops - first <= LONGEST) & (decimals <= MOST_DECIMALS),
    )


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
        steps = np.abs(values) * POWERS[decimals]
        off = np.abs(steps - np.floor(steps) - 0.5)
        plain: Mask = (steps < LARGEST) & (off > TIE * steps)
    return plain


def rounded(values: FloatArray, decimals: IntArray | int) -> FloatArray:
    """What a reader makes of values written with so many decimals (for those that are `is_plain`)."""
    scale = POWERS[decimals]
    result: FloatArray = np.rint(values * scale) / scale + 0.0
    return result


def in_style(values: FloatArray, styles: Styles, decimals: IntArray) -> Texts:
    """Values in the styles of written numbers, as `NumberStyle.write` does it; all `is_plain`, all `clear`."""
    digits = np.maximum(decimals, styles.decimals)
    steps = np.rint(np.abs(values) * POWERS[digits]).astype(np.int64)
    value = np.copysign(steps / POWERS[digits], values) + 0.0
    kept = digits.copy()
    for _ in range(int(digits.max(initial=0))):
        longer = kept > styles.decimals
        if not longer.any():
            break
        zero = longer & (steps % 10 == 0)
        if not zero.any():
            break
        steps[zero] //= 10
        kept[zero] -= 1
    sign = np.where((values < 0) & (steps != 0), MINUS, np.where(styles.plus, PLUS, 0))
    return _laid_out(steps, kept, sign, styles.width, styles.leading_zero, styles.point, value)


def plain(values: FloatArray, decimals: IntArray, heads: NDArray[np.uint8], *, signed: bool = False) -> Texts:
    """Values with exactly so many decimals, as `f"{value:.{decimals}f}"` does it; all `is_plain`.

    heads   (m, 2) bytes to put before each, 0 for none
    signed  with a plus sign, too, which zero has as well
    """
    steps = np.rint(np.abs(values) * POWERS[decimals]).astype(np.int64)
    sign = np.where(np.signbit(values), MINUS, 0)
    if signed:
        sign = np.where((values < 0) & (steps != 0), MINUS, PLUS)
    everywhere = np.ones(len(values), dtype=np.bool_)
    value = np.copysign(steps / POWERS[decimals], values)
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
    right = int(decimals.max(initial=0))
    alike = int(decimals.min(initial=right)) == right
    power = TENS[right] if alike else TENS[decimals]  # numpy divides by one number much faster than by many
    whole = steps // power
    fraction = steps - whole * power
    most = len(str(int(whole.max(initial=0))))
    left = max(most, int(width.max(initial=0)))
    digits = np.ones_like(steps)
    for place in range(1, most):
        digits += whole >= TENS[place]
    digits = np.maximum(digits, width)
    digits[(whole == 0) & ~leading_zero & (decimals > 0)] = 0
    pointed = point | (decimals > 0)
    signs, points = sign[:, None].astype(np.uint8), np.full((len(steps), 1), POINT, dtype=np.uint8)
    parts = [
        signs,
        _in_quads(whole, left),
        points,
        _in_quads(fraction if alike else fraction * TENS[right - decimals], right),
    ]
    masks = [signs != 0, AT_END[left][digits], pointed[:, None], AT_START[right][decimals]]
    if heads is not None:
        parts, masks = [heads, *parts], [heads != 0, *masks]
    length = digits + decimals + pointed + (sign != 0) + (0 if heads is None else (heads != 0).sum(axis=1))
    return Texts(np.concatenate(parts, axis=1)[np.concatenate(masks, axis=1)].tobytes(), length, value)


TENS = 10 ** np.arange(19)
WIDEST = 19
AT_END = [np.arange(n) >= n - np.arange(WIDEST)[:, None] for n in range(WIDEST)]
"""The last k of n cells."""
AT_START = [np.arange(n) < np.arange(WIDEST)[:, None] for n in range(WIDEST)]
"""The first k of n cells."""
QUADS = (np.arange(10_000)[:, None] // (1000, 100, 10, 1) % 10 + ZERO).astype(np.uint8)
"""The numbers of four digits as text."""


def _in_quads(values: IntArray, digits: int) -> NDArray[np.uint8]:
    """Whole numbers as so many digits, four at a time, (m, digits)."""
    cells = np.empty((len(values), 4 * -(-digits // 4)), dtype=np.uint8)
    for stop in range(cells.shape[1], 0, -4):
        cells[:, stop - 4 : stop] = QUADS[values % 10_000 if digits > 4 else values]
        values = values // 10_000
    return cells[:, cells.shape[1] - digits :]
