"""Free contours (FK): lines and arcs with only the data that a drawing gives, worked out one after another.

Points are complex numbers in the working plane, in program units. A contour is worked out only if it has exactly one
solution: not if the data of an element leave two, or contradict each other. An arc on a known circle may end where the
next element touches the circle.

Source: TNC 640, "FK free contour programming".
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import replace

from ncfix.values import frozen

FLAT = 1e-9


@frozen
class Element:
    """The data that the program gives of one element; None for those that it does not give.

    arc         an arc (FC, FCT), else a line (FL, FLT)
    tangential  FLT and FCT: it starts in the direction in which the element before ends
    x, y        its end
    angle       AN: the direction of a line, rad
    length      LEN: the length of a line
    centre      CCX and CCY: the centre of an arc
    radius      R: the radius of an arc
    sense       1 for DR+, -1 for DR-, 0 if it is not given
    turn        CCA: the angle of an arc about its centre, rad
    opens       CLSD+: a closed contour begins with this element
    closes      CLSD-: it ends where the closed contour began
    """

    arc: bool
    tangential: bool
    x: float | None = None
    y: float | None = None
    angle: float | None = None
    length: float | None = None
    centre: complex | None = None
    radius: float | None = None
    sense: int = 0
    turn: float | None = None
    opens: bool = False
    closes: bool = False

    @property
    def end(self) -> complex | None:
        """The end of the element; None unless both coordinates are given."""
        return None if self.x is None or self.y is None else complex(self.x, self.y)

    @property
    def circle(self) -> DirectedCircle | None:
        """The circle of an arc; None unless centre, radius and sense are given."""
        if self.centre is None or self.radius is None or not self.sense:
            return None
        return DirectedCircle(self.centre, self.radius, self.sense)


@frozen
class DirectedCircle:
    """A circle, with the sense in which the contour goes round it: 1 counterclockwise, -1 clockwise."""

    centre: complex
    radius: float
    sense: int

    def heading(self, at: complex) -> complex:
        """The direction of the contour at one of its points."""
        spoke = at - self.centre
        return self.sense * 1j * spoke / abs(spoke)

    def touched(self, heading: complex) -> complex:
        """The point of the circle at which the contour has this direction."""
        return self.centre - self.sense * 1j * self.radius * heading


@frozen
class ContourElement:
    """An element that has been worked out: its end, the direction there, and its circle if it is an arc."""

    end: complex
    heading: complex
    circle: DirectedCircle | None = None


class NoSolutionError(Exception):
    """The data of a contour have no solution, or more than one."""


def solved(
    elements: Sequence[Element], start: complex, heading: complex | None, near: float
) -> list[ContourElement] | None:
    """The elements of a contour that begins at `start`; None unless all of them are certain.

    heading  the direction in which the element before ends; None if there is none
    near     by how much data may contradict each other, program units
    """
    chain = _Chain(start, heading, near)
    try:
        for element, following in zip(elements, [*elements[1:], None], strict=True):
            chain.add(element, following)
    except NoSolutionError:
        return None
    return None if chain.open else chain.done


class _Chain:
    """A contour as far as it has been worked out.

    at       where it has come to
    heading  the direction there
    open     the circle of the last arc while its end is not known yet
    home     where the closed contour began
    """

    def __init__(self, start: complex, heading: complex | None, near: float) -> None:
        self.at = start
        self.heading = heading
        self.near = near
        self.done: list[ContourElement] = []
        self.open: DirectedCircle | None = None
        self.home: complex | None = None

    def add(self, element: Element, following: Element | None) -> None:
        """Work out the next element; raises `NoSolutionError`."""
        if element.opens:
            self.home = self.at
        if element.closes:
            if self.home is None or element.x is not None or element.y is not None:
                raise NoSolutionError
            element = replace(element, x=self.home.real, y=self.home.imag)
        if element.arc:
            self._arc(element)
        else:
            self._line(element, following)

    # -- lines --------------------------------------------------------------------------------------------------------

    def _line(self, element: Element, following: Element | None) -> None:
        target = following.circle if following is not None and following.tangential else None
        reached = None if self.open is None else self._leave(self.open, element, target)
        direction = self._direction(element)
        end = element.end if reached is None else reached
        if end is None and direction is not None:
            end = self._along(element, direction)
        elif end is None and element == Element(arc=False, tangential=False) and target is not None:
            end = target.touched(touching(target.centre - self.at, target.sense * target.radius))
        if end is None or abs(end - self.at) < self.near:
            raise NoSolutionError
        if element.length is not None:
            self._agree(abs(end - self.at), element.length)
        if direction is not None:
            self._agree(end, self.at + abs(end - self.at) * direction)
        self._append(ContourElement(end, (end - self.at) / abs(end - self.at)))

    def _direction(self, element: Element) -> complex | None:
        """The direction of a line; None if it is not given."""
        stated = None if element.angle is None else cmath.rect(1.0, element.angle)
        if not element.tangential:
            return stated
        if self.heading is None:
            raise NoSolutionError
        if stated is not None:
            self._agree(stated, self.heading)
        return self.heading

    def _along(self, element: Element, direction: complex) -> complex | None:
        """The end of a line of known direction, by its length or one coordinate; None if that is not given."""
        if element.length is not None:
            return self.at + element.length * direction
        for value, part, begin in (
            (element.x, direction.real, self.at.real),
            (element.y, direction.imag, self.at.imag),
        ):
            if value is not None and abs(part) > math.sin(math.radians(1)) and (value - begin) / part > 0:
                return self.at + (value - begin) / part * direction
        return None

    def _leave(self, circle: DirectedCircle, element: Element, target: DirectedCircle | None) -> complex | None:
        """End the open arc where a tangential line leaves it.

        The line has a known direction, leads to a known end, or touches the next circle: returns where it does.
        """
        reached = None
        if not element.tangential:
            raise NoSolutionError
        if element.angle is not None:
            direction = cmath.rect(1.0, element.angle)
        elif element.end is not None:
            direction = touching(element.end - circle.centre, -circle.sense * circle.radius)
        elif element == Element(arc=False, tangential=True) and target is not None:
            across = target.sense * target.radius - circle.sense * circle.radius
            direction = touching(target.centre - circle.centre, across)
            reached = target.touched(direction)
        else:
            raise NoSolutionError
        self._end_arc(circle, circle.touched(direction))
        return reached

    # -- arcs ---------------------------------------------------------------------------------------------------------

    def _arc(self, element: Element) -> None:
        if self.open is not None:
            self._touch(self.open, element)
        circle = self._circle(element)
        self._agree(abs(self.at - circle.centre), circle.radius)
        if element.tangential:
            if self.heading is None:
                raise NoSolutionError
            self._agree(circle.heading(self.at), self.heading)
        end = element.end
        if end is None and element.turn is not None:
            end = circle.centre + (self.at - circle.centre) * cmath.exp(1j * circle.sense * abs(element.turn))
        if end is None and (element.x is not None or element.y is not None):
            raise NoSolutionError
        if end is None:
            self.open = circle
            return
        self._agree(abs(end - circle.centre), circle.radius)
        if abs(end - self.at) < self.near:
            raise NoSolutionError
        self._append(ContourElement(end, circle.heading(end), circle))

    def _circle(self, element: Element) -> DirectedCircle:
        """The circle of an arc that begins where the contour has come to."""
        if element.centre is not None and element.sense:
            size = abs(self.at - element.centre) if element.radius is None else element.radius
            return DirectedCircle(element.centre, size, element.sense)
        if self.heading is None or not element.tangential or element.centre is not None:
            raise NoSolutionError
        if element.end is not None:
            return self._through(element, element.end, self.heading)
        if element.radius is None or not element.sense:
            raise NoSolutionError
        return DirectedCircle(
            self.at + element.sense * 1j * element.radius * self.heading, element.radius, element.sense
        )

    def _through(self, element: Element, end: complex, heading: complex) -> DirectedCircle:
        """The circle on which an arc starts in a direction and leads to an end."""
        side = ((end - self.at) * heading.conjugate()).imag
        if abs(side) < self.near:
            raise NoSolutionError
        radius = abs(end - self.at) ** 2 / (2 * side)
        sense = 1 if radius > 0 else -1
        if element.sense not in (0, sense):
            raise NoSolutionError
        if element.radius is not None:
            self._agree(abs(radius), element.radius)
        return DirectedCircle(self.at + 1j * radius * heading, abs(radius), sense)

    def _touch(self, circle: DirectedCircle, element: Element) -> None:
        """End the open arc where the known circle of the next arc touches its own."""
        other = element.circle
        if other is None or not element.tangential:
            raise NoSolutionError
        way = other.centre - circle.centre
        inside = circle.sense == other.sense
        self._agree(abs(way), abs(circle.radius - other.radius) if inside else circle.radius + other.radius)
        if abs(way) < self.near:
            raise NoSolutionError
        outward = -1 if inside and other.radius > circle.radius else 1
        self._end_arc(circle, circle.centre + outward * circle.radius * way / abs(way))

    # -- what is worked out -------------------------------------------------------------------------------------------

    def _end_arc(self, circle: DirectedCircle, end: complex) -> None:
        if abs(end - self.at) < self.near:
            raise NoSolutionError
        self.open = None
        self._append(ContourElement(end, circle.heading(end), circle))

    def _append(self, element: ContourElement) -> None:
        self.done.append(element)
        self.at, self.heading = element.end, element.heading

    def _agree(self, one: complex, other: complex) -> None:
        if abs(one - other) > self.near:
            raise NoSolutionError


def touching(way: complex, across: float) -> complex:
    """The direction for which `way` has the part `across` to its left, and the rest ahead."""
    along = abs(way) ** 2 - across**2
    if along <= FLAT:
        raise NoSolutionError
    return way / complex(math.sqrt(along), across)
