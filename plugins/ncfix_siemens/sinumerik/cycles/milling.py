"""Milling cycles whose call names place and depth: pockets, slots, studs, faces, threads.

Such a cycle is followed as one motion to its bottom at the named place, and is corrected as a whole: place, reference
plane (RFP) and bottom are shifted by the same amount. So its size and depth steps stay. Arguments that count from RFP
(DPR, an incremental DP, the depth of a chamfer) are not changed.
Source: Siemens, "SINUMERIK 840D sl/828D, Job planning", "Programming cycles externally"; the shorter calls of older
controls: "SINUMERIK, cycles".
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ncfix.control.coordinates import X, Y, Z
from ncfix.control.expressions import Unknown
from ncfix.values import frozen
from ncfix_siemens.sinumerik.plans import Calling
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.vocabulary import DP, DPR, RFP, RTP, Drilling


class MillingCycle(NamedTuple):
    """Indices of the arguments of a milling cycle. The first are RTP, RFP, SDIS and DP; index 0 means "none" below.

    point    its place in the plane (PA, PO): the first of two arguments
    way      whether DPR follows DP; else DP itself may be incremental, by `mode`
    variant  machining type (VARI), whose last digit tells whether it is a chamfer
    mode     mode of lengths (AMODE): the last digit for the depth, the hundreds for the depth of a chamfer (ZFS). The
             argument before it is DMODE, whose last digit may select a plane
    size     length and width of a face whose place is a corner: the first of two arguments
    corner   whether the hundreds and thousands of the mode may turn these into an opposite corner
    angle    rotation of the face about its corner
    named    whether a contour gives the place; its name is then an argument before all these
    counts   possible numbers of arguments of a call, with that name; empty: any
    """

    point: int
    way: bool = False
    variant: int = 0
    mode: int = 0
    size: int = 0
    corner: bool = False
    angle: int = 0
    named: bool = False
    counts: frozenset[int] = frozenset()

    @property
    def places(self) -> set[int]:
        """Indices of the arguments of place and depth."""
        shown = {self.mode - 1} if self.mode else set[int]()
        others = (self.point, self.point + 1, self.variant, self.mode, self.size, self.size + 1, self.angle)
        return {*range(DPR + self.way), *others} | shown


MILLING = {
    "pocket1": MillingCycle(8, way=True),
    "pocket2": MillingCycle(6, way=True),
    "pocket3": MillingCycle(7, variant=16, mode=28),
    "pocket4": MillingCycle(5, variant=13, mode=24),
    "slot1": MillingCycle(8, way=True, variant=18, mode=30),
    "slot2": MillingCycle(8, way=True, variant=18, mode=28),
    "longhole": MillingCycle(7, way=True, mode=19),
    "cycle61": MillingCycle(4, mode=15, size=6, corner=True),
    "cycle71": MillingCycle(4, size=6, angle=8),
    "cycle72": MillingCycle(0, variant=9, mode=21, named=True, counts=frozenset({*range(6, 18), 23})),
    "cycle76": MillingCycle(8, way=True, variant=17, mode=24),
    "cycle77": MillingCycle(6, way=True, variant=14, mode=20),
    "cycle90": MillingCycle(11, way=True),
}

ABSOLUTE, WAY_DOWN = 0, 1
"""Last digits of AMODE; for cycles with DPR, 0 leaves it to the arguments, and 2 means absolute."""
CHAMFER = 5
PLANES = {1: Z, 2: Y, 3: X}
"""Last digit of DMODE -> axis across the plane that it selects."""

AT_RUN_TIME = "the position and depth of {} are known only at run time"
NO_PLACE = "{} does not give its position (PA, PO)"
OWN_PLACE = "{} is called by MCALL, but gives its own position (PA, PO)"
NO_DEPTH = "the depth of {} is not clear: RTP, RFP and the bottom must be one below the other"
NO_WAY_DOWN = "the depth of {} is not clear: with its mode (AMODE) the depth is a distance, which must be positive"
TWO_DEPTHS = "the cycle {} gives its depth twice (DP and DPR), with different values"
OF_CHAMFER = "{} mills a chamfer, but its mode (AMODE) does not make the depth (ZFS) a distance"
OWN_CONTOUR = "{} is called by MCALL, but its contour gives its position"
OTHER_COUNT = "ncfix does not know {} with this number of arguments"
OTHER_PLANE = "{} selects another plane (DMODE) than the one in force"
IN_DIAMETERS = "{} is called while X is a diameter"

ALIKE = 1e-6
"""Largest difference of equal depths, in program units."""


@frozen
class MillingCall:
    """The numeric arguments of a call, zero if omitted, and the indices of those written."""

    form: MillingCycle
    numbers: list[float]
    written: frozenset[int]

    def digit(self, place: int, power: int = 0) -> int:
        """A decimal digit of an argument, 10**power; zero if the cycle has no such argument."""
        return digit(self.numbers[place], power) if place > DP else 0

    @property
    def bottom(self) -> tuple[float, tuple[int, ...], str]:
        """The height of the bottom, the indices of arguments that state this height, and a fault or ""."""
        mode, reference, deep = self.digit(self.form.mode), self.numbers[RFP], self.numbers[DP]
        way = self.numbers[DPR] if self.form.way else deep if mode == WAY_DOWN else 0.0
        by_way = mode == WAY_DOWN or (mode == ABSOLUTE and way != 0.0)
        heights = (DP,) if DP in self.written and (self.form.way or not by_way) else ()
        bottom, fault = reference - way if by_way else deep, ""
        if mode > (2 if self.form.way else 1) or (by_way and way <= 0.0):
            fault = NO_WAY_DOWN
        elif by_way and heights and abs(deep - bottom) > ALIKE:
            fault = TWO_DEPTHS
        elif not (self.numbers[RTP] > reference >= bottom) or not (by_way or heights):
            fault = NO_DEPTH
        elif self.digit(self.form.variant) == CHAMFER and (
            self.form.named or self.digit(self.form.mode, 2) != WAY_DOWN
        ):
            fault = OF_CHAMFER
        return bottom, heights, fault

    @property
    def corners(self) -> tuple[bool, ...]:
        """For each axis of the plane, whether the size of a face is given as its opposite corner."""
        return tuple(self.form.corner and self.digit(self.form.mode, power) == 1 for power in (2, 3))

    @property
    def points(self) -> tuple[tuple[int, int], ...]:
        """Arguments of position, as (index, axis of the plane); none if a contour gives the place."""
        if self.form.named:
            return ()
        corners = [(self.form.size + axis, axis) for axis, own in enumerate(self.corners) if own]
        return ((self.form.point, 0), (self.form.point + 1, 1), *corners)

    @property
    def place(self) -> tuple[float, float]:
        """The place of the cycle in program units: the middle of a face, else the place that the call names."""
        x, y = self.numbers[self.form.point : self.form.point + 2]
        if not self.form.size:
            return x, y
        far = [self.numbers[self.form.size + axis] - (own and (x, y)[axis]) for axis, own in enumerate(self.corners)]
        u, v = far[0] / 2, far[1] / 2
        turn = math.radians(self.numbers[self.form.angle]) if self.form.angle else 0.0
        return x + u * math.cos(turn) - v * math.sin(turn), y + u * math.sin(turn) + v * math.cos(turn)


def digit(value: float, power: int = 0) -> int:
    """The decimal digit 10**power of a number."""
    return round(abs(value)) // 10**power % 10


def said_in(control: Sinumerik, step: Calling) -> tuple[tuple[float | str | None, ...], bool]:
    """The arguments of a call, None if omitted or unknown; and whether all written ones are known."""
    pairs = zip(step.arguments, step.written, strict=True)
    values = [None if part is None else value(control) for value, part in pairs]
    known = tuple(None if isinstance(value, Unknown) else value for value in values)
    return known, not any(isinstance(value, Unknown) for value in values)


def milling_of(control: Sinumerik, step: Calling, *, modal: bool) -> Drilling:
    """The call of a milling cycle, evaluated; omitted arguments are zero."""
    form, name, first = MILLING[step.name], step.name.upper(), int(MILLING[step.name].named)
    said, sure = said_in(control, step)
    numbers = [
        0.0 if part is None else value if isinstance(value, float) else None
        for value, part in zip(said[first:], step.written[first:], strict=True)
    ]
    numbers += [0.0] * (1 + max(form.places) - len(numbers))
    if any(numbers[place] is None for place in form.places):
        return Drilling(step.name, numbers[RTP], None, AT_RUN_TIME.format(name), said, sure, control.external, ())
    written = frozenset(place for place, part in enumerate(step.written[first:]) if part is not None)
    call = MillingCall(form, [value or 0.0 for value in numbers], written)
    bottom, heights, fault = call.bottom
    chosen = call.digit(form.mode and form.mode - 1)
    if form.counts and len(said) not in form.counts:
        fault = OTHER_COUNT
    if modal and form.named:
        fault = fault or OWN_CONTOUR
    elif modal and any(numbers[form.point : form.point + 2]):
        fault = fault or OWN_PLACE
    elif not modal and not written >= {form.point, form.point + 1}:
        fault = fault or NO_PLACE
    if chosen and PLANES.get(chosen) != control.modal.plane.across:
        fault = fault or OTHER_PLANE
    if control.modal.diameter:
        fault = fault or IN_DIAMETERS
    return Drilling(
        step.name,
        None if fault else numbers[RTP],
        bottom,
        fault.format(name),
        (*said[:first], *call.numbers[:DP], *said[first + DP :]),
        sure,
        control.external,
        tuple((first + place, 1) for place in (*heights, RFP)),
        None if modal or form.named else call.place,
        () if modal else call.points,
    )
