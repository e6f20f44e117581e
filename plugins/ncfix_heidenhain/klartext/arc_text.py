"""An arc put into words: CR where its radius says well enough where its centre is, C about a pole of its own where it
does not (near a half circle, and full circles), CP for helices and for more than one turn.

The pole that is in force at a block, as the text shows it, and whether blocks after it rely on it: what has to come
back after an arc that is written about a pole of its own.
"""

from __future__ import annotations

import cmath
import math
import re
from bisect import bisect_left
from functools import lru_cache
from typing import NamedTuple

from ncfix.arrays import Array, Ints
from ncfix.control.arcs import sweep_angle
from ncfix.text.spelling import Spelling, value_of

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

USES = re.compile(rb"(?im)^[ \t/\d]*(?:CP?|LP|CTP)(?![A-Z])|(?:APPR|DEP)[ \t]+P|CALL[ \t]+(?:PGM|SEL)|PGM[ \t]+CALL")
"""What counts from a pole, and calls of other programs, which may: without any a text relies on none."""

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

    begin: Array
    end: Array
    centre: Array
    plane: tuple[int, int, int]
    spatial: tuple[int, int, int]
    clockwise: bool
    turn: float | None
    decimals: Ints

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
    end: Array
    centre: Array


class InPlane(NamedTuple):
    """An arc in its plane, points as complex numbers: begin, end, about what, its sense, digits, `PieceOfArc.turn`."""

    begin: complex
    end: complex
    middle: complex
    clockwise: bool
    digits: int
    turn: float | None


def arc_text(arc: PieceOfArc, style: Spelling) -> ArcText:
    """Put an arc into words."""
    columns, across = arc.columns, arc.spatial[arc.plane[2]]
    begin, end, middle = (
        complex(*each) for each in (arc.begin[columns], arc.end[columns], arc.centre[[*arc.plane[:2]]])
    )
    flat = InPlane(begin, end, middle, arc.clockwise, int(arc.decimals[columns[0]]), arc.turn)
    sense = "DR-" if arc.clockwise else "DR+"
    rises = across >= 0 and abs(arc.end[across] - arc.begin[across]) >= 0.5 * 10.0 ** -int(arc.decimals[across])
    if rises or (arc.turn is not None and abs(arc.turn) > LEAST_FULL_TURN + 1e-3):
        pole, angle, reached = helix(flat, style)
        ending = arc.end.copy()
        ending[columns] = reached.real, reached.imag
        return ArcText("CP", pole_words(arc.plane, pole), ("IPA" + angle,), sense, ending, spatial(arc, point_of(pole)))
    found = by_radius(flat, style)
    if found is not None:
        text, middle = found
        return ArcText("CR", (), ("R" + text,), sense, arc.end, spatial(arc, middle))
    pole = pole_text(flat.middle, style, flat.digits)
    return ArcText("C", pole_words(arc.plane, pole), (), sense, arc.end, spatial(arc, point_of(pole)))


def swept(arc: InPlane, middle: complex) -> float:
    """The signed angle, rad, from begin to end about a centre, at most a turn."""
    to_centre, to_end = middle - arc.begin, arc.end - arc.begin
    return sweep_angle((to_centre.real, to_centre.imag), (to_end.real, to_end.imag), 1, clockwise=arc.clockwise)


def by_radius(arc: InPlane, style: Spelling) -> tuple[str, complex] | None:
    """R as written, and the centre that it means; None if that is over an output step from where it belongs."""
    way, wanted = arc.end - arc.begin, arc.middle
    size = (abs(wanted - arc.begin) + abs(wanted - arc.end)) / 2
    sign = 1.0 if abs(swept(arc, wanted)) <= math.pi else -1.0
    text = style.number(sign * size, arc.digits)
    radius, half_chord = abs(value_of(text)), abs(way) / 2
    if not radius > half_chord > 0:
        return None
    rise = math.sqrt(radius**2 - half_chord**2)
    side = 1.0 if (not arc.clockwise) == (sign > 0) else -1.0
    middle = (arc.begin + arc.end) / 2 + side * (rise * (1j * way) / (2 * half_chord))
    return (text, middle) if abs(wanted - middle) <= 10.0**-arc.digits else None


def pole_text(middle: complex, style: Spelling, digits: int) -> tuple[str, str]:
    """The coordinates of a pole as they are written."""
    return style.number(middle.real, digits), style.number(middle.imag, digits)


def point_of(texts: tuple[str, str]) -> complex:
    """What coordinates say."""
    return complex(value_of(texts[0]), value_of(texts[1]))


def pole_words(plane: tuple[int, int, int], texts: tuple[str, str]) -> tuple[str, ...]:
    """The words of a pole, X before Y before Z."""
    return tuple(sorted(("XYZ"[plane[0]] + texts[0], "XYZ"[plane[1]] + texts[1])))


def helix(arc: InPlane, style: Spelling) -> tuple[tuple[str, str], str, complex]:
    """CP: a pole that is about equally far from both ends, IPA, and the end that the control works out of these.

    The angle is put on its digits before the pole is: about a far one that leads nearer to the end. About a near one
    it is better found again from the pole as it is written.
    """
    wanted = between(arc, turned_by(arc, arc.middle))
    first = on_digits(turned_by(arc, wanted), style)
    angle = math.radians(value_of(first))
    fitting = seen_under(arc, angle)
    if abs(wanted - fitting) * (1 - math.cos(angle / 2)) < ASIDE:
        wanted = fitting
    texts = pole_text(wanted, style, max(POLE_DIGITS, arc.digits))
    pole = point_of(texts)
    angles = first, on_digits(turned_by(arc, pole), style)
    reached = [pole + cmath.rect(1.0, math.radians(value_of(text))) * (arc.begin - pole) for text in angles]
    best = 0 if abs(arc.end - reached[0]) <= abs(arc.end - reached[1]) else 1
    return texts, angles[best], reached[best]


def turned_by(arc: InPlane, middle: complex) -> float:
    """As `swept`, with the whole turns that the arc was meant to have."""
    angle = swept(arc, middle)
    return angle if arc.turn is None else angle + 2 * math.pi * round((arc.turn - angle) / (2 * math.pi))


def on_digits(angle: float, style: Spelling) -> str:
    """An angle as the control takes it."""
    return style.number(math.degrees(angle), ANGLE_DIGITS)


def between(arc: InPlane, angle: float) -> complex:
    """The centre that is equally far from both ends; of nearly full circles, where rounded ends are equally far only
    from a place far aside, a centre on the way there, so that the rest of the arc suffers no more than its end.
    """
    goal = equally_far(arc)
    aside = abs(goal - arc.middle)
    uneven = abs(abs(arc.middle - arc.begin) - abs(arc.middle - arc.end))
    bulge = 2.0 if abs(angle) > math.pi else 1 - math.cos(angle)
    if bulge * aside <= 2 * uneven:
        return goal
    return arc.middle + uneven / (uneven + bulge * aside) * (goal - arc.middle)


def equally_far(arc: InPlane) -> complex:
    """The point next to the centre that is equally far from begin and end; of full turns any is."""
    way = arc.end - arc.begin
    if abs(way) < 1e-6:
        return arc.middle
    way /= abs(way)
    return arc.middle - ((arc.middle - (arc.begin + arc.end) / 2) * way.conjugate()).real * way


def seen_under(arc: InPlane, angle: float) -> complex:
    """The point from which the way from begin to end is seen under an angle, rad; infinitely far for none."""
    half = math.tan(angle / 2)
    if abs(half) < 1e-12:
        return complex(math.inf, math.inf)
    return (arc.begin + arc.end) / 2 + 0.5 / half * (1j * (arc.end - arc.begin))


def spatial(arc: PieceOfArc, middle: complex) -> Array:
    """A centre in the plane as one of X Y Z, (3,); across the plane it lies where the arc begins."""
    found = arc.centre.copy()
    found[arc.plane[0]], found[arc.plane[1]] = middle.real, middle.imag
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
    for found in EVENT.finditer(text) if USES.search(text) else ():
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
