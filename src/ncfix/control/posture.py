"""The directions of tool and axes in the workpiece, and the rotary positions a control takes for a tool direction
(PLANE, CYCLE800, G53.1, vectors under TRAORI, M128 and G43.5).

All of it follows from the machine's kinematics, which give the tip of a tool of any length in the workpiece: the tip of
a longer tool minus that of a shorter one is the tool direction; the tip with an axis moved minus the tip without is the
direction of that axis.

There are usually two ways to point the tool. `WayRules` describe which one a control takes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ncfix.arrays import Array
from ncfix.control.coordinates import Rotation, Vector, X, Y, Z, angles_in_words, as_rotation
from ncfix.control.moves import Kinematics, TcpState
from ncfix.control.pointing import Pair, Pointing, Triple
from ncfix.values import frozen

PROBE_LENGTH_MM = 128.0
"""Tool length, mm, used to find the tool direction; a power of two, so that dividing by it is exact."""

ALIGNMENT_TOLERANCE_RAD = 2e-4
"""Largest angle, rad, between tool and a direction that it is taken to lie along: rotary words have three decimals of
a degree, 9e-6 rad each."""

MAX_PLANE_DEVIATION_RAD = math.radians(0.1)
"""Largest deviation, rad, between turning the tool in a plane and turning its rotary axes evenly. A control may do
either. The tip is not affected; but beyond this, pieces of a motion would orient the tool differently from the
whole."""

TRAVEL_END_TOLERANCE_RAD = 1e-6
"""Largest overrun of its travel, rad, at which an axis still counts as at its end."""

MIN_SIGNED_RAD = 1e-9
"""Smallest distance from zero, rad, at which an axis has a sign."""

MAX_WHOLE_TURNS = 2


class WayRules(NamedTuple):
    """The rules by which a control chooses among the ways to point its tool; by default the nearest.

    in_travel  only ways within the travels of both axes, changed by whole turns if necessary
    sign       the inner (tilting) axis must be at or above zero (1), or at or below (-1): SEQ+, SEQ-
    sense      the way with the larger (1) or smaller (-1) angle of the inner axis, within half a turn: _DIR
    """

    in_travel: bool = False
    sign: int = 0
    sense: int = 0


NEAREST = WayRules()


@frozen
class Postures:
    """The ways of two rotary axes to point the tool in a direction.

    letters  letter indices of the outer and the inner axis
    here     their current angles, rad
    ways     possible angles, rad, the one that the control takes first; empty if the tool cannot point there
    at_pole  the tool is then parallel to the outer axis, whose angle is free
    """

    pointing: Pointing
    letters: tuple[int, int]
    here: Pair
    ways: Sequence[Pair]
    at_pole: bool

    @property
    def chosen(self) -> dict[int, float]:
        """Letter index -> angle that the axis takes, rad; empty if the tool cannot point there."""
        return dict(zip(self.letters, self.ways[0], strict=True)) if self.ways else {}

    @property
    def leaves_pole(self) -> bool:
        """Whether the tool is to leave a pole, where it is parallel to the outer axis: then neither way is nearer."""
        return self.pointing.leaves_pole(self.here, self.ways)

    @property
    def is_close(self) -> bool:
        """Whether another way is about as near as the first."""
        return self.pointing.is_close(self.here, self.ways)

    @property
    def strays(self) -> bool:
        """Whether evenly turning axes move the tool out of the plane between the two directions."""
        return self.pointing.stray(self.here, self.ways[0]) > MAX_PLANE_DEVIATION_RAD

    def __str__(self) -> str:
        """The angles that the axes take, as programs write them: `B30.000 C120.000`."""
        return angles_in_words(self.letters, self.ways[0])


@frozen
class MachineDirections:
    """Directions in the workpiece at some position of the rotary axes.

    tool  unit vector from the tip to the spindle
    axes  directions of the machine's X, Y and Z, as columns of a rotation
    """

    tool: Triple
    axes: Rotation


class MachinePosture:
    """Directions of a machine's tool and axes in the workpiece, from its kinematics.

    kinematics  None: not known
    machine     letter indices of the machine's axes, in column order; `rotary`: whether each letter is a rotary axis
    """

    def __init__(self, kinematics: Kinematics | None, machine: tuple[int, ...], rotary: Sequence[bool]) -> None:
        self.kinematics, self.axis_indices, self.rotary = kinematics, machine, rotary
        self._directions: tuple[Vector, MachineDirections] | None = None

    @cached_property
    def pointing(self) -> Pointing | None:
        """How the two rotary axes point the tool, determined from the tips of two tool lengths.

        None if the machine has more or fewer rotary axes, lacks X, Y or Z, or if its kinematics are not known.
        """
        turning = [index for index in self.axis_indices if self.rotary[index]]
        if self.kinematics is None or len(turning) != 2 or not {X, Y, Z} <= {*self.axis_indices}:
            return None

        def directions(first: float, second: float) -> Array:
            position = [0.0] * len(self.rotary)
            position[turning[0]], position[turning[1]] = first, second
            return (self._tip(position, 0.0) - self._tip(position, PROBE_LENGTH_MM)) / PROBE_LENGTH_MM

        return Pointing.of((self.axis_indices.index(turning[0]), self.axis_indices.index(turning[1])), directions)

    def postures(self, direction: Sequence[float], rules: WayRules, here: Pair) -> Postures | None:
        """The ways to point the tool along a unit vector in the workpiece, with the two rotary axes now at `here`, rad.

        None if the kinematics are not known or are not those of two rotary axes.
        """
        pointing = self.pointing
        if pointing is None:
            return None
        wanted = np.array(direction)
        ways, at_pole = pointing.angles(wanted, here), pointing.at_pole(wanted)
        if rules.in_travel:
            assert self.kinematics is not None, "they have shown how the tool is pointed"
            near = (here[0], 0.0) if rules.sense else here
            ways = within(ways, [self.kinematics.travel[column] for column in pointing.columns], near)
        if rules.sign:
            ways = [way for way in ways if abs(way[1]) < MIN_SIGNED_RAD or (way[1] > 0) == (rules.sign > 0)]
        if rules.sense and not at_pole:
            ways.sort(key=lambda way: -rules.sense * way[1])
        outer, inner = pointing.columns
        return Postures(pointing, (self.axis_indices[outer], self.axis_indices[inner]), here, ways, at_pole)

    def only_posture(self, direction: Sequence[float], rules: WayRules) -> Postures | None:
        """The way to point the tool along a unit vector if it does not depend on where the axes stand.

        None unless the travels leave exactly one way, whole turns included.
        """
        if self.kinematics is None or self.pointing is None or not rules.in_travel:
            return None
        outer, inner = (self.kinematics.travel[column] for column in self.pointing.columns)
        if not np.isfinite([outer, inner]).all():
            return None
        one, other = (self.postures(direction, rules, here) for here in zip(outer, inner, strict=True))
        return one if one and other and one.ways == other.ways and len(one.ways) == 1 else None

    def directions(self, position: Vector) -> MachineDirections | None:
        """Directions of tool and axes with the rotary axes at `position`, rad; None if the kinematics are not known."""
        if self.kinematics is None or not {X, Y, Z} <= {*self.axis_indices}:
            return None
        still = [value if self.rotary[index] else 0.0 for index, value in enumerate(position)]
        if self._directions is None or self._directions[0] != still:
            origin = self._tip(still, 0.0)
            columns = []
            for index in (X, Y, Z):
                moved = still[:]
                moved[index] = PROBE_LENGTH_MM
                columns.append(_unit(self._tip(moved, 0.0) - origin))
            tool = _unit(origin - self._tip(still, PROBE_LENGTH_MM))
            found = MachineDirections((tool[0], tool[1], tool[2]), as_rotation(list(zip(*columns, strict=True))))
            self._directions = still, found
        return self._directions[1]

    def _tip(self, position: Vector, length: float) -> Array:
        """Tip (3,) of a tool of length `length` in the workpiece, mm."""
        assert self.kinematics is not None
        command = [position[index] for index in self.axis_indices]
        found = self.kinematics(command, TcpState(False, length), TcpState(True, length))
        return np.array([found[self.axis_indices.index(index)] for index in (X, Y, Z)])


def within(ways: Iterable[Pair], travel: Sequence[Pair], near: Pair) -> list[Pair]:
    """The ways within the travels of both axes, changed by whole turns if necessary; the nearest to `near` first."""
    found = []
    for way in ways:
        places = [_in_travel(angle, *span, to) for angle, span, to in zip(way, travel, near, strict=True)]
        if places[0] is not None and places[1] is not None:
            found.append((places[0], places[1]))
    return sorted(found, key=lambda way: abs(way[0] - near[0]) + abs(way[1] - near[1]))


def _in_travel(angle: float, low: float, high: float, near: float) -> float | None:
    """The angle, changed by whole turns to be within a travel and nearest to `near`; None if there is none."""
    turns = (angle + 2 * math.pi * count for count in range(-MAX_WHOLE_TURNS, MAX_WHOLE_TURNS + 1))
    possible = [each for each in turns if low - TRAVEL_END_TOLERANCE_RAD <= each <= high + TRAVEL_END_TOLERANCE_RAD]
    return min(possible, key=lambda each: abs(each - near), default=None)


def normal_of(frame: Rotation) -> Triple:
    """The Z axis of a frame."""
    return frame[0][2], frame[1][2], frame[2][2]


def _unit(vector: Array) -> list[float]:
    """The unit vector along a vector."""
    parts: list[float] = vector.tolist()
    size = math.hypot(*parts)
    return [part / size for part in parts]
