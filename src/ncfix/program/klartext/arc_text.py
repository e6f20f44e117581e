"""An arc put into words: CR where its radius says well enough where its centre is, C about a pole of its own where it
does not (near a half circle, and full circles), CP for helices and for more than one turn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.program.follow.arcs import sweep_angle
from ncfix.program.klartext.number_text import Style, value_of

FloatArray = NDArray[np.float64]

POLE_DIGITS, ANGLE_DIGITS = 4, 4
"""What a control takes after the point of a coordinate, and of an angle (TNC 640, "Technical information")."""

ASIDE = 1e-4
"""How far (in program units) an arc may pass beside its place so that an angle of so many digits leads to its end."""

FULL = 2 * math.pi - 1e-6


@dataclass(frozen=True, slots=True)
class PieceOfArc:
    """One arc, in program numbers.

    begin, end  (n_axes,) positions
    centre      (3,) of X Y Z
    plane       its two axes and the one across, as indices of X Y Z
    spatial     columns of X Y Z
    clockwise   its sense
    turn        the angle that it was meant to have, rad, where that may be more than a turn; else None
    decimals    (n_axes,) digits after the point
    """

    begin: FloatArray
    end: FloatArray
    centre: FloatArray
    plane: tuple[int, int, int]
    spatial: tuple[int, int, int]
    clockwise: bool
    turn: float | None
    decimals: NDArray[np.int64]

    @property
    def columns(self) -> list[int]:
        """The columns of the axes of its plane."""
        return [self.spatial[index] for index in self.plane[:2]]

    @property
    def digits(self) -> int:
        """Digits after the point of lengths in its plane."""
        return int(self.decimals[self.columns[0]])

    @property
    def middle(self) -> FloatArray:
        """The centre in its plane, (2,)."""
        found: FloatArray = self.centre[list(self.plane[:2])]
        return found


@dataclass(frozen=True, slots=True)
class ArcText:
    """An arc in words.

    function  CR, C or CP
    pole      the words of the CC before it; empty for CR
    words     R, or IPA
    sense     DR+ or DR-
    end       (n_axes,) where it ends: of CP as the control works it out
    centre    (3,) about what
    """

    function: str
    pole: tuple[str, ...]
    words: tuple[str, ...]
    sense: str
    end: FloatArray
    centre: FloatArray


def arc_text(arc: PieceOfArc, style: Style) -> ArcText:
    """Put an arc into words."""
    sense = "DR-" if arc.clockwise else "DR+"
    across = arc.spatial[arc.plane[2]]
    rises = across >= 0 and abs(arc.end[across] - arc.begin[across]) >= 0.5 * 10.0 ** -int(arc.decimals[across])
    if rises or (arc.turn is not None and abs(arc.turn) > FULL + 1e-3):
        return helix(arc, style, sense)
    found = by_radius(arc, style)
    if found is not None:
        text, middle = found
        return ArcText("CR", (), ("R" + text,), sense, arc.end, spatial(arc, middle))
    pole, texts = written_pole(arc, arc.middle, style, arc.digits)
    return ArcText("C", texts, (), sense, arc.end, spatial(arc, pole))


def swept(arc: PieceOfArc, middle: FloatArray, begin: FloatArray, end: FloatArray) -> float:
    """The signed angle, rad, from begin to end about a centre, at most a turn; points (2,) of the plane."""
    to_centre, to_end = middle - begin, end - begin
    pair = (float(to_centre[0]), float(to_centre[1])), (float(to_end[0]), float(to_end[1]))
    return sweep_angle(*pair, 1, clockwise=arc.clockwise)


def by_radius(arc: PieceOfArc, style: Style) -> tuple[str, FloatArray] | None:
    """R as written, and the centre (2,) that it means; None if that is over an output step from where it belongs."""
    begin, end, wanted = arc.begin[arc.columns], arc.end[arc.columns], arc.middle
    size = float(np.hypot(*(wanted - begin)) + np.hypot(*(wanted - end))) / 2
    sign = 1.0 if abs(swept(arc, wanted, begin, end)) <= math.pi else -1.0
    text = style.number(sign * size, arc.digits)
    radius = abs(value_of(text))
    chord = end - begin
    half_chord = float(np.hypot(*chord)) / 2
    if not radius > half_chord > 0:
        return None
    rise = np.sqrt(radius**2 - half_chord**2) * np.array([-chord[1], chord[0]]) / (2 * half_chord)
    middle = (begin + end) / 2 + (rise if (not arc.clockwise) == (sign > 0) else -rise)
    return (text, middle) if float(np.hypot(*(middle - wanted))) <= 10.0**-arc.digits else None


def written_pole(arc: PieceOfArc, middle: FloatArray, style: Style, digits: int) -> tuple[FloatArray, tuple[str, ...]]:
    """A pole (2,) as it is written, and its words, X before Y before Z."""
    texts = [style.number(float(value), digits) for value in middle]
    words = sorted("XYZ"[index] + text for index, text in zip(arc.plane[:2], texts, strict=True))
    return np.array([value_of(text) for text in texts]), tuple(words)


def helix(arc: PieceOfArc, style: Style, sense: str) -> ArcText:
    """CP with IPA about a pole that is about equally far from both ends; the control works the end out.

    The angle is put on its digits before the pole is: about a far one that leads nearer to the end. About a near one
    it is better found again from the pole as it is written.
    """
    begin, end = arc.begin[arc.columns], arc.end[arc.columns]
    wanted = between(begin, end, arc.middle, turned_by(arc, arc.middle, begin, end))
    first = on_digits(turned_by(arc, wanted, begin, end), style)
    fitting = seen_under(begin, end, math.radians(value_of(first)))
    if float(np.hypot(*(fitting - wanted))) * (1 - math.cos(math.radians(value_of(first)) / 2)) < ASIDE:
        wanted = fitting
    pole, words = written_pole(arc, wanted, style, max(POLE_DIGITS, arc.digits))
    texts = first, on_digits(turned_by(arc, pole, begin, end), style)
    reached = [swung(begin, pole, math.radians(value_of(text))) for text in texts]
    best = int(np.argmin([float(np.hypot(*(place - end))) for place in reached]))
    ending = arc.end.copy()
    ending[arc.columns] = reached[best]
    return ArcText("CP", words, ("IPA" + texts[best],), sense, ending, spatial(arc, pole))


def turned_by(arc: PieceOfArc, middle: FloatArray, begin: FloatArray, end: FloatArray) -> float:
    """As `swept`, with the whole turns that the arc was meant to have."""
    angle = swept(arc, middle, begin, end)
    return angle if arc.turn is None else angle + 2 * math.pi * round((arc.turn - angle) / (2 * math.pi))


def on_digits(angle: float, style: Style) -> str:
    """An angle as the control takes it."""
    return style.number(math.degrees(angle), ANGLE_DIGITS)


def swung(begin: FloatArray, pole: FloatArray, angle: float) -> FloatArray:
    """A point (2,) turned about another one by an angle, rad."""
    x, y = begin - pole
    c, s = math.cos(angle), math.sin(angle)
    found: FloatArray = pole + np.array([c * x - s * y, s * x + c * y])
    return found


def between(begin: FloatArray, end: FloatArray, middle: FloatArray, angle: float) -> FloatArray:
    """The centre that is equally far from both ends; of nearly full circles, where rounded ends are equally far only
    from a place far aside, a centre on the way there, so that the rest of the arc suffers no more than its end.
    """
    goal = equally_far(begin, end, middle)
    aside = float(np.hypot(*(goal - middle)))
    uneven = abs(float(np.hypot(*(begin - middle))) - float(np.hypot(*(end - middle))))
    bulge = 2.0 if abs(angle) > math.pi else 1 - math.cos(angle)
    if bulge * aside <= 2 * uneven:
        return goal
    result: FloatArray = middle + uneven / (uneven + bulge * aside) * (goal - middle)
    return result


def equally_far(begin: FloatArray, end: FloatArray, middle: FloatArray) -> FloatArray:
    """The point (2,) next to `middle` that is equally far from begin and end; of full turns any is."""
    chord = end - begin
    length = float(np.hypot(*chord))
    if length < 1e-6:
        return middle
    along = chord / length
    result: FloatArray = middle - float(np.dot(middle - (begin + end) / 2, along)) * along
    return result


def seen_under(begin: FloatArray, end: FloatArray, angle: float) -> FloatArray:
    """The point (2,) from which the way from begin to end is seen under an angle, rad; infinitely far for none."""
    chord = end - begin
    half = math.tan(angle / 2)
    if abs(half) < 1e-12:
        return np.full(2, math.inf)
    found: FloatArray = (begin + end) / 2 + 0.5 / half * np.array([-chord[1], chord[0]])
    return found


def spatial(arc: PieceOfArc, middle: FloatArray) -> FloatArray:
    """A centre (2,) in the plane as one of X Y Z, (3,); across the plane it lies where the arc begins."""
    found = arc.centre.copy()
    found[list(arc.plane[:2])] = middle
    across = arc.spatial[arc.plane[2]]
    if across >= 0:
        found[arc.plane[2]] = arc.begin[across]
    return found
