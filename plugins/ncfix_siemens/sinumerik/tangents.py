"""CT: the arc that goes on in the direction in which the motion before it ended.

It lies in the active plane, with the part of that direction that does; with a step across the plane it is a helix.
Where the end lies straight ahead it is a line. The direction belongs to the program's coordinates: a frame that is
programmed in between turns it.
Source: Siemens, "SINUMERIK 840D sl, NC programming, fundamentals": circular interpolation with tangential transition.
"""

from __future__ import annotations

import math

from ncfix.control.arcs import ARC_FAULT
from ncfix.control.expressions import Fault
from ncfix.control.moves import MotionKind
from ncfix_siemens.sinumerik.circles import POLAR_ARC, circle_of
from ncfix_siemens.sinumerik.destination import BlockWordValues, ProgrammedMotion, destination
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.vocabulary import CT_LEFT, CT_RIGHT

NO_HEADING = "in which direction the motion before this arc (CT) ends is not known"
TURNS_AT_RUNTIME = "the turns of the arc (CT) are known only at run time"
STRAIGHT = 1e-9
"""Of the chord: an arc that strays by less from a line is one."""


def tangential(control: Sinumerik, words: BlockWordValues) -> None:
    """CT with its end; TURN adds full turns."""
    control.settle_all()
    end, heading, plane = destination(control, words), control.heading, control.modal.plane
    why = refusal_of(words)
    step = control.in_frame([b - a for a, b in zip(control.position, end.target, strict=True)])
    ahead = (0.0, 0.0) if heading is None else (heading[plane.first], heading[plane.second])
    chord = step[plane.first], step[plane.second]
    if why or end.unknown or control.unknown or not math.hypot(*ahead):
        control.go(ProgrammedMotion(MotionKind.FEED, words, end, CT_LEFT, refusal=why or NO_HEADING))
        return
    along = ahead[0] * chord[0] + ahead[1] * chord[1]
    left = ahead[0] * chord[1] - ahead[1] * chord[0]
    if abs(left) <= STRAIGHT * math.hypot(*ahead) * math.hypot(*chord):
        if along <= 0.0 and any(chord):
            raise Fault(ARC_FAULT, "the arc (CT) would have to turn back on the spot: its end lies straight behind")
        control.go(ProgrammedMotion(MotionKind.FEED, words, end, CT_LEFT))
        return
    away = (chord[0] ** 2 + chord[1] ** 2) / (2 * left)
    sweep = 2 * math.atan2(left, along)
    sweep += math.copysign(2 * math.pi * max(round(words.get("TURN")), 0), left)
    circle = circle_of(control, plane, (-ahead[1] * away, ahead[0] * away), sweep)
    control.go(ProgrammedMotion(MotionKind.ARC, words, end, CT_LEFT if left > 0 else CT_RIGHT, arc=circle))


def refusal_of(words: BlockWordValues) -> str:
    """Why it is refused, whatever its geometry."""
    if {"AP", "RP"} & words.values.keys():
        return POLAR_ARC
    return TURNS_AT_RUNTIME if words.runtime("TURN") else ""
