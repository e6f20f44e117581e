"""Holes in a row (HOLES1) and on a circle (HOLES2): where the control takes the modal cycle to.

One block leads to many holes, each with a correction of its own: only a flat program can say them. A row may be drilled
from either end; a control takes the nearer one, and so does the flat program.
Source: Siemens, "SINUMERIK, cycles": HOLES1(SPCA, SPCO, STA1, FDIS, DBH, NUM), HOLES2(CPA, CPO, RAD, STA1, INDA, NUM).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ncfix.control.coordinates import mask_of
from ncfix.control.expressions import number
from ncfix_siemens.sinumerik.destination import BlockWordValues, End

if TYPE_CHECKING:
    from ncfix_siemens.sinumerik.plans import Calling
    from ncfix_siemens.sinumerik.state import Sinumerik

Points = tuple[tuple[float, float], ...]
"""Places in the plane, in program units."""

ARGUMENTS = 6
MOST = 1000
WRITE_OUT = "holes whose places the control makes up ({}): --flatten writes them out"
AFTER_PATTERN = "where the axis {} stands after a pattern of holes is not followed"


def row(values: Sequence[float]) -> Points:
    """HOLES1."""
    x, y, angle, first, step, count = values
    ways = (first + step * k for k in range(round(count)))
    turn = math.radians(angle)
    return tuple((x + way * math.cos(turn), y + way * math.sin(turn)) for way in ways)


def circle(values: Sequence[float]) -> Points:
    """HOLES2; an angle between holes of zero means that they divide the circle evenly."""
    x, y, radius, angle, step, count = values
    step = step or 360.0 / count
    turns = (math.radians(angle + step * k) for k in range(round(count)))
    return tuple((x + radius * math.cos(turn), y + radius * math.sin(turn)) for turn in turns)


PATTERNS = {"holes1": row, "holes2": circle}


def points_of(control: Sinumerik, step: Calling) -> Points:
    """The places of a pattern in the order in which they are drilled; empty if that cannot be followed.

    Further arguments hide places or say how to go from one to the next; G0 must be in force, so that it still is when
    the holes have been written out.
    """
    modal = control.modal
    plain = modal.motion == 0 and not (modal.incremental or modal.diameter) and control.modes.modal_cycle is not None
    if step.name not in PATTERNS or not plain or len(step.arguments) < ARGUMENTS:
        return ()
    values = [
        number(each(control)) if part is not None else 0.0
        for each, part in zip(step.arguments, step.written, strict=True)
    ]
    known = [value for value in values if value is not None]
    if len(known) < len(values) or any(known[ARGUMENTS:]) or not 1 <= known[ARGUMENTS - 1] <= MOST:
        return ()
    control.budget.spend(round(known[ARGUMENTS - 1]))
    points = PATTERNS[step.name](known[:ARGUMENTS])
    return points[::-1] if step.name == "holes1" and is_nearer(control, points[-1], points[0]) else points


def is_nearer(control: Sinumerik, last: tuple[float, float], first: tuple[float, float]) -> bool:
    """Whether the axes stand nearer to the last place than to the first."""
    plane = control.modal.plane
    if any(control.lost.get(index, AFTER_PATTERN) != AFTER_PATTERN for index in (plane.first, plane.second)):
        return False
    here = [control.program_position()[index] / control.stretch for index in (plane.first, plane.second)]
    return math.dist(here, last) < math.dist(here, first)


def lead_to(control: Sinumerik, block: int, point: tuple[float, float], name: str) -> tuple[BlockWordValues, End, str]:
    """The words that lead to a place, where that is, and why its hole is not corrected."""
    plane, program, lost = control.modal.plane, control.program_position(), dict(control.lost)
    axes = mask_of((plane.first, plane.second))
    for index, value in zip((plane.first, plane.second), point, strict=True):
        program[index] = control.stretch * value
        lost.pop(index, None)
    end = End(control.command(program, axes), control.axes_of(lost), lost)
    return BlockWordValues(block, {}, {}, axes), end, WRITE_OUT.format(name)
