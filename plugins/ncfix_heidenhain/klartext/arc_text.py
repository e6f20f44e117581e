"""An arc put into words: CR where its radius says well enough where its centre is, C about a pole of its own where it
does not (near a half circle, and full circles), CP for helices and for more than one turn.

The pole that is in force at a block, as the text shows it, and whether blocks after it rely on it: what has to come
back after an arc that is written about a pole of its own.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_left
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ncfix.control.arcs import Point, sweep_angle
from ncfix.text.spelling import Spelling, value_of

FloatArray = NDArray[np.float64]

POLE_DIGITS, ANGLE_DIGITS = 4, 4
"""What a control takes after the point of a coordinate, and of an angle (TNC 640, "Technical information")."""

ASIDE = 1e-4
"""How far (in program units) an arc may pass beside its place so that an angle of so many digits leads to its end."""

LEAST_FULL_TURN = 2 * math.pi - 1e-6

NUMBER = r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)"
LINE = re.compile(
    rf"(?im)^[ \t]*/?[ \t]*\d*[ \t]*(?:"
    rf"CC[ \t]+(?P<words>[XYZ]{NUMBER}[ \t]*[XYZ]{NUMBER})[ \t]*(?:;.*)?\r?$"
    rf"|(?:CC(?![A-Z])|LBL|[^;\r\n]*(?:CALL|M99|M98|M89)))".encode("latin-1")
)
"""A pole in plain numbers, or what may set another one or be reached from elsewhere."""


NUMBERED = r"(?i)\n[ \t]*/?[ \t]*\d*[ \t]*(?=[CLADFIE])(?!L[ \t])"
"""The beginning of a line, behind the end of the one before; most lines are told apart from those that matter here."""

SETS = re.compile(rb"(?i)CC[ \t]*(?:[;~\r\n]|\Z|I?[XYZ][^;\r\nXYZ]*I?[XYZ])|END[ \t]+PGM")
EVENT = re.compile(
    (
        NUMBERED + r"(?P<what>CC?(?![A-Z])|LP|CP|CTP|(?:APPR|DEP)[ \t]+P|CALL|FN|IF|LBL[ \t]*0(?!\d)|END[ \t]+PGM)"
    ).encode()
)
"""What sets a pole, relies on one, or may lead elsewhere; other labels are passed through."""

CALCULATION = re.compile(rb"(?i)FN[ \t]*(?!9|1[0-2])\d")
LOOK = 80
"""Bytes of a line that tell what it is."""


class PieceOfArc(NamedTuple):
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


class ArcText(NamedTuple):
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


class InPlane(NamedTuple):
    """An arc in its plane: begin, end, about what, its sense, digits of lengths, and `PieceOfArc.turn`."""

    begin: Point
    end: Point
    middle: Point
    clockwise: bool
    digits: int
    turn: float | None


def arc_text(arc: PieceOfArc, style: Spelling) -> ArcText:
    """Put an arc into words."""
    first, second, across = (arc.spatial[index] for index in arc.plane)
    begin, end, centre = arc.begin.tolist(), arc.end.tolist(), arc.centre.tolist()
    flat = InPlane(
        (begin[first], begin[second]),
        (end[first], end[second]),
        (centre[arc.plane[0]], centre[arc.plane[1]]),
        arc.clockwise,
        int(arc.decimals[first]),
        arc.turn,
    )
    sense = "DR-" if arc.clockwise else "DR+"
    rises = across >= 0 and abs(end[across] - begin[across]) >= 0.5 * 10.0 ** -int(arc.decimals[across])
    if rises or (arc.turn is not None and abs(arc.turn) > LEAST_FULL_TURN + 1e-3):
        pole, angle, reached = helix(flat, style)
        ending = arc.end.copy()
        ending[first], ending[second] = reached
        return ArcText("CP", pole_words(arc.plane, pole), ("IPA" + angle,), sense, ending, spatial(arc, point_of(pole)))
    found = by_radius(flat, style)
    if found is not None:
        text, middle = found
        return ArcText("CR", (), ("R" + text,), sense, arc.end, spatial(arc, middle))
    pole = pole_text(flat.middle, style, flat.digits)
    return ArcText("C", pole_words(arc.plane, pole), (), sense, arc.end, spatial(arc, point_of(pole)))


def distance(a: Point, b: Point) -> float:
    """From one point to another."""
    return math.hypot(b[0] - a[0], b[1] - a[1])


def swept(arc: InPlane, middle: Point) -> float:
    """The signed angle, rad, from begin to end about a centre, at most a turn."""
    (x, y), end = arc.begin, arc.end
    to_centre, to_end = (middle[0] - x, middle[1] - y), (end[0] - x, end[1] - y)
    return sweep_angle(to_centre, to_end, 1, clockwise=arc.clockwise)


def by_radius(arc: InPlane, style: Spelling) -> tuple[str, Point] | None:
    """R as written, and the centre that it means; None if that is over an output step from where it belongs."""
    (x, y), end, wanted = arc.begin, arc.end, arc.middle
    size = (distance(arc.begin, wanted) + distance(end, wanted)) / 2
    sign = 1.0 if abs(swept(arc, wanted)) <= math.pi else -1.0
    text = style.number(sign * size, arc.digits)
    radius, half_chord = abs(value_of(text)), distance(arc.begin, end) / 2
    if not radius > half_chord > 0:
        return None
    rise = math.sqrt(radius**2 - half_chord**2)
    side = 1.0 if (not arc.clockwise) == (sign > 0) else -1.0
    across = y - end[1], end[0] - x
    middle = (
        (x + end[0]) / 2 + side * (rise * across[0] / (2 * half_chord)),
        (y + end[1]) / 2 + side * (rise * across[1] / (2 * half_chord)),
    )
    return (text, middle) if distance(middle, wanted) <= 10.0**-arc.digits else None


def pole_text(middle: Point, style: Spelling, digits: int) -> tuple[str, str]:
    """The coordinates of a pole as they are written."""
    return style.number(middle[0], digits), style.number(middle[1], digits)


def point_of(texts: tuple[str, str]) -> Point:
    """What coordinates say."""
    return value_of(texts[0]), value_of(texts[1])


def pole_words(plane: tuple[int, int, int], texts: tuple[str, str]) -> tuple[str, ...]:
    """The words of a pole, X before Y before Z."""
    return tuple(sorted(("XYZ"[plane[0]] + texts[0], "XYZ"[plane[1]] + texts[1])))


def helix(arc: InPlane, style: Spelling) -> tuple[tuple[str, str], str, Point]:
    """CP: a pole that is about equally far from both ends, IPA, and the end that the control works out of these.

    The angle is put on its digits before the pole is: about a far one that leads nearer to the end. About a near one
    it is better found again from the pole as it is written.
    """
    begin, end = arc.begin, arc.end
    wanted = between(begin, end, arc.middle, turned_by(arc, arc.middle))
    first = on_digits(turned_by(arc, wanted), style)
    angle = math.radians(value_of(first))
    fitting = seen_under(begin, end, angle)
    if distance(fitting, wanted) * (1 - math.cos(angle / 2)) < ASIDE:
        wanted = fitting
    texts = pole_text(wanted, style, max(POLE_DIGITS, arc.digits))
    pole = point_of(texts)
    angles = first, on_digits(turned_by(arc, pole), style)
    reached = [swung(begin, pole, math.radians(value_of(text))) for text in angles]
    best = 0 if distance(reached[0], end) <= distance(reached[1], end) else 1
    return texts, angles[best], reached[best]


def turned_by(arc: InPlane, middle: Point) -> float:
    """As `swept`, with the whole turns that the arc was meant to have."""
    angle = swept(arc, middle)
    return angle if arc.turn is None else angle + 2 * math.pi * round((arc.turn - angle) / (2 * math.pi))


def on_digits(angle: float, style: Spelling) -> str:
    """An angle as the control takes it."""
    return style.number(math.degrees(angle), ANGLE_DIGITS)


def swung(begin: Point, pole: Point, angle: float) -> Point:
    """A point turned about another one by an angle, rad."""
    x, y = begin[0] - pole[0], begin[1] - pole[1]
    c, s = math.cos(angle), math.sin(angle)
    return pole[0] + (c * x - s * y), pole[1] + (s * x + c * y)


def between(begin: Point, end: Point, middle: Point, angle: float) -> Point:
    """The centre that is equally far from both ends; of nearly full circles, where rounded ends are equally far only
    from a place far aside, a centre on the way there, so that the rest of the arc suffers no more than its end.
    """
    goal = equally_far(begin, end, middle)
    aside = distance(middle, goal)
    uneven = abs(distance(begin, middle) - distance(end, middle))
    bulge = 2.0 if abs(angle) > math.pi else 1 - math.cos(angle)
    if bulge * aside <= 2 * uneven:
        return goal
    part = uneven / (uneven + bulge * aside)
    return middle[0] + part * (goal[0] - middle[0]), middle[1] + part * (goal[1] - middle[1])


def equally_far(begin: Point, end: Point, middle: Point) -> Point:
    """The point next to `middle` that is equally far from begin and end; of full turns any is."""
    x, y = end[0] - begin[0], end[1] - begin[1]
    length = math.hypot(x, y)
    if length < 1e-6:
        return middle
    x, y = x / length, y / length
    way = (middle[0] - (begin[0] + end[0]) / 2) * x + (middle[1] - (begin[1] + end[1]) / 2) * y
    return middle[0] - way * x, middle[1] - way * y


def seen_under(begin: Point, end: Point, angle: float) -> Point:
    """The point from which the way from begin to end is seen under an angle, rad; infinitely far for none."""
    half = math.tan(angle / 2)
    if abs(half) < 1e-12:
        return math.inf, math.inf
    height = 0.5 / half
    x, y = end[0] - begin[0], end[1] - begin[1]
    return (begin[0] + end[0]) / 2 - height * y, (begin[1] + end[1]) / 2 + height * x


def spatial(arc: PieceOfArc, middle: Point) -> FloatArray:
    """A centre in the plane as one of X Y Z, (3,); across the plane it lies where the arc begins."""
    found = arc.centre.copy()
    found[arc.plane[0]], found[arc.plane[1]] = middle
    across = arc.spatial[arc.plane[2]]
    if across >= 0:
        found[arc.plane[2]] = arc.begin[across]
    return found


# -- the pole that is in force at a block ------------------------------------------------------------------------------


def in_lines(source: bytes) -> bytes:
    """A text with a line feed for every carriage return, which may stand alone: every byte is where it was."""
    return source.replace(b"\r", b"\n")


def is_relied_on(source: bytes, after: int) -> bool:
    """Whether what follows a byte of the program may rely on the pole that is in force there."""
    places, relying = _events(source)
    index = bisect_left(places, after)
    return index < len(places) and relying[index]


def relies_at_once(source: bytes) -> bool:
    """Whether a text relies on a pole before it sets one."""
    _, relying = _events(source)
    return bool(relying) and relying[0]


@lru_cache(maxsize=4)
def _events(source: bytes) -> tuple[list[int], list[bool]]:
    """Where a pole is set or something may rely on one, and which of the two it is."""
    places, relying = [], []
    text = b"\n" + in_lines(source)
    for found in EVENT.finditer(text):
        line = text[found.start("what") : found.start("what") + LOOK]
        if CALCULATION.match(line) is None:
            places.append(found.start())
            relying.append(SETS.match(line) is None)
    return places, relying


def pole_in_force(source: bytes, at: int) -> str | None:
    """The words of the last CC before a byte of the program: empty if there is none, None if the text does not tell."""
    places, words = _poles(source)
    index = bisect_left(places, at) - 1
    return words[index] if index >= 0 else ""


@lru_cache(maxsize=4)
def _poles(source: bytes) -> tuple[list[int], list[str | None]]:
    found = [(match.start(), match["words"]) for match in LINE.finditer(in_lines(source))]
    return [place for place, _ in found], [None if words is None else words.decode("latin-1") for _, words in found]
