"""Writing an arc in words, and which pole is in force at a block.

An arc is written as CR where the radius fixes its centre well enough. Near a half circle, and for full circles, it does
not: there the arc is written as C, after a CC of its own. Helices, and arcs of more than a turn, are written as CP.

After a CC of its own, the pole that was in force has to be restored if later blocks rely on it. Both are found in the
text of the program.
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
"""Decimals that a control accepts of a coordinate, and of an angle (TNC 640, "Technical information")."""

MAX_ASIDE = 1e-4
"""How far an arc may pass beside its place, program units, so that an angle of `ANGLE_DIGITS` leads to its end."""

LEAST_FULL_TURN = 2 * math.pi - 1e-6

NUMBER = r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)"
LINE = re.compile(
    rf"(?im)^[ \t]*/?[ \t]*\d*[ \t]*(?:"
    rf"CC[ \t]+(?P<words>[XYZ]{NUMBER}[ \t]*[XYZ]{NUMBER})[ \t]*(?:;.*)?\r?$"
    rf"|(?:CC(?![A-Z])|LBL|[^;\r\n]*(?:CALL|M99|M98|M89)))".encode("latin-1")
)
"""A CC in plain numbers (`words`); or a line after which the pole may be another: other CC, labels, calls, cycles."""

NUMBERED = r"(?i)\n[ \t]*/?[ \t]*\d*[ \t]*(?=[CLADFIE])(?!L[ \t])"
"""The beginning of a line, with its block number; by their first letter it leaves out most lines, as L."""

SETS = re.compile(rb"(?i)CC[ \t]*(?:[;~\r\n]|\Z|I?[XYZ][^;\r\nXYZ]*I?[XYZ])|END[ \t]+PGM")
EVENT = re.compile(
    (
        NUMBERED + r"(?P<what>CC?(?![A-Z])|LP|CP|CTP|(?:APPR|DEP)[ \t]+P|CALL|FN|IF|LBL[ \t]*0(?!\d)|END[ \t]+PGM)"
    ).encode()
)
"""Lines that set a pole, rely on one, or may lead elsewhere; of labels only LBL 0 does."""

USES = re.compile(rb"(?im)^[ \t/\d]*(?:CP?|LP|CTP)(?![A-Z])|(?:APPR|DEP)[ \t]+P|CALL[ \t]+(?:PGM|SEL)|PGM[ \t]+CALL")
"""Blocks that rely on a pole, and calls of other programs, which may: a text without any relies on none."""

CALCULATION = re.compile(rb"(?i)FN[ \t]*(?!9|1[0-2])\d")
LOOK_BYTES = 80
"""The number of bytes of a line that are read to tell what it is."""


class PieceOfArc(NamedTuple):
    """One arc, in program units.

    begin, end  (n_axes,) positions
    centre      (3,) X Y Z of the centre
    plane       the two axes of its plane and the one across, as indices of X Y Z
    spatial     columns of X Y Z among the axes
    clockwise   sense of rotation
    turn        the angle in the program, rad, where it may be more than a turn; else None
    decimals    (n_axes,) decimals of each axis
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
        """The columns of the two axes of its plane."""
        return [self.spatial[index] for index in self.plane[:2]]


class ArcText(NamedTuple):
    """The words of an arc, and the arc that they mean.

    function  CR, C or CP
    pole      the words of the CC before it; empty for CR
    words     the word R of CR or IPA of CP; empty for C
    sense     DR+ or DR-
    end       (n_axes,) end; that of CP as the control works it out
    centre    (3,) X Y Z of the centre
    """

    function: str
    pole: tuple[str, ...]
    words: tuple[str, ...]
    sense: str
    end: Array
    centre: Array


class InPlane(NamedTuple):
    """An arc in its plane, with points as complex numbers; `middle` is its centre, `turn` as in `PieceOfArc`."""

    begin: complex
    end: complex
    middle: complex
    clockwise: bool
    digits: int
    turn: float | None


def arc_text(arc: PieceOfArc, style: Spelling) -> ArcText:
    """The words of an arc."""
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
    """The signed angle, rad, from the begin of an arc to its end about a centre; at most a turn."""
    to_centre, to_end = middle - arc.begin, arc.end - arc.begin
    return sweep_angle((to_centre.real, to_centre.imag), (to_end.real, to_end.imag), 1, clockwise=arc.clockwise)


def by_radius(arc: InPlane, style: Spelling) -> tuple[str, complex] | None:
    """The text of R, and the centre that it means; None if that is more than an output step from the wanted one."""
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
    """The texts of the two coordinates of a pole."""
    return style.number(middle.real, digits), style.number(middle.imag, digits)


def point_of(texts: tuple[str, str]) -> complex:
    """The point that two texts of coordinates mean."""
    return complex(value_of(texts[0]), value_of(texts[1]))


def pole_words(plane: tuple[int, int, int], texts: tuple[str, str]) -> tuple[str, ...]:
    """The words of a pole, X before Y before Z."""
    return tuple(sorted(("XYZ"[plane[0]] + texts[0], "XYZ"[plane[1]] + texts[1])))


def helix(arc: InPlane, style: Spelling) -> tuple[tuple[str, str], str, complex]:
    """CP: the texts of a pole about equally far from both ends, the text of IPA, and the end that results from them.

    There are two ways to the angle. It may be rounded first, and the pole chosen for the rounded angle: about a far
    pole this leads nearer to the end. Or it is measured about the pole as written: that is better about a near one.
    The one that leads nearer to the end is taken.
    """
    wanted = between(arc, turned_by(arc, arc.middle))
    first = on_digits(turned_by(arc, wanted), style)
    angle = math.radians(value_of(first))
    fitting = seen_under(arc, angle)
    if abs(wanted - fitting) * (1 - math.cos(angle / 2)) < MAX_ASIDE:
        wanted = fitting
    texts = pole_text(wanted, style, max(POLE_DIGITS, arc.digits))
    pole = point_of(texts)
    angles = first, on_digits(turned_by(arc, pole), style)
    reached = [pole + cmath.rect(1.0, math.radians(value_of(text))) * (arc.begin - pole) for text in angles]
    best = 0 if abs(arc.end - reached[0]) <= abs(arc.end - reached[1]) else 1
    return texts, angles[best], reached[best]


def turned_by(arc: InPlane, middle: complex) -> float:
    """As `swept`, plus the whole turns that the arc has in the program."""
    angle = swept(arc, middle)
    return angle if arc.turn is None else angle + 2 * math.pi * round((arc.turn - angle) / (2 * math.pi))


def on_digits(angle: float, style: Spelling) -> str:
    """The text of an angle, rad, in degrees with the decimals that the control accepts."""
    return style.number(math.degrees(angle), ANGLE_DIGITS)


def between(arc: InPlane, angle: float) -> complex:
    """The point near the centre that is equally far from both ends, or a point on the way there.

    On a nearly full circle, rounded ends are equally far only from a point that is far aside. There it goes only part
    of the way, so that the error along the arc is no larger than the error at its end.
    """
    goal = equally_far(arc)
    aside = abs(goal - arc.middle)
    uneven = abs(abs(arc.middle - arc.begin) - abs(arc.middle - arc.end))
    bulge = 2.0 if abs(angle) > math.pi else 1 - math.cos(angle)
    if bulge * aside <= 2 * uneven:
        return goal
    return arc.middle + uneven / (uneven + bulge * aside) * (goal - arc.middle)


def equally_far(arc: InPlane) -> complex:
    """The point nearest to the centre that is equally far from begin and end; the centre itself if these coincide."""
    way = arc.end - arc.begin
    if abs(way) < 1e-6:
        return arc.middle
    way /= abs(way)
    return arc.middle - ((arc.middle - (arc.begin + arc.end) / 2) * way.conjugate()).real * way


def seen_under(arc: InPlane, angle: float) -> complex:
    """The centre about which begin and end are an angle (rad) apart; infinitely far away for the angle 0."""
    half = math.tan(angle / 2)
    if abs(half) < 1e-12:
        return complex(math.inf, math.inf)
    return (arc.begin + arc.end) / 2 + 0.5 / half * (1j * (arc.end - arc.begin))


def spatial(arc: PieceOfArc, middle: complex) -> Array:
    """X Y Z of a centre in the plane, (3,); across the plane it is where the arc begins."""
    found = arc.centre.copy()
    found[arc.plane[0]], found[arc.plane[1]] = middle.real, middle.imag
    across = arc.spatial[arc.plane[2]]
    if across >= 0:
        found[arc.plane[2]] = arc.begin[across]
    return found


# -- the pole that is in force at a block ------------------------------------------------------------------------------


def in_lines(source: bytes) -> bytes:
    """A text whose carriage returns, which may stand alone, are line feeds; every byte keeps its place."""
    return source.replace(b"\r", b"\n")


def is_relied_on(source: bytes, after: int) -> bool:
    """Whether blocks after a byte of the program may rely on the pole that is in force there."""
    places, relying = _events(source)
    index = bisect_left(places, after)
    return index < len(places) and relying[index]


def relies_at_once(source: bytes) -> bool:
    """Whether a text relies on a pole before it sets one."""
    _, relying = _events(source)
    return bool(relying) and relying[0]


@lru_cache(maxsize=4)
def _events(source: bytes) -> tuple[list[int], list[bool]]:
    """The bytes at which a pole is set or may be relied on, and for each whether it is relied on."""
    places, relying = [], []
    text = b"\n" + in_lines(source)
    for found in EVENT.finditer(text) if USES.search(text) else ():
        line = text[found.start("what") : found.start("what") + LOOK_BYTES]
        if CALCULATION.match(line) is None:
            places.append(found.start())
            relying.append(SETS.match(line) is None)
    return places, relying


def pole_in_force(source: bytes, at: int) -> str | None:
    """The words of the last CC before a byte of the program; empty if there is none, None if the text does not tell."""
    places, words = _poles(source)
    index = bisect_left(places, at) - 1
    return words[index] if index >= 0 else ""


@lru_cache(maxsize=4)
def _poles(source: bytes) -> tuple[list[int], list[str | None]]:
    found = [(match.start(), match["words"]) for match in LINE.finditer(in_lines(source))]
    return [place for place, _ in found], [None if words is None else words.decode("latin-1") for _, words in found]
