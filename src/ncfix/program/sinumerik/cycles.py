"""Drilling cycles, called where the axes stand or, with MCALL, after every motion; and cycles that are not followed.

A drilled hole is corrected in the block that leads to it. How deep it is stands in the call, for all holes alike: the
control's motions down and up pass as they are.
Source: Siemens, "SINUMERIK, cycles": CYCLE81 to CYCLE89, CYCLE840 (RTP, RFP, SDIS, DP, DPR).
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from ncfix.program.moves import Kind
from ncfix.program.passing import Pass, Passing
from ncfix.program.sinumerik.destination import End, Leg, Words, command
from ncfix.program.sinumerik.patterns import AFTER_PATTERN, Points, lead_to, points_of
from ncfix.program.sinumerik.plans import Calling
from ncfix.program.sinumerik.state import GEOMETRY, Sinumerik
from ncfix.program.sinumerik.values import number
from ncfix.program.sinumerik.vocabulary import DRILLING

DEPTH = "the depth of a cycle ({}) is left as written"
MADE = "motions that the control makes up ({})"
MADE_HOLES = "holes whose places the control makes up ({})"
HEIGHTS = "the heights of the cycle {} are known only at run time"
MEASURING = re.compile(r"cycle9[789]\d")

AFTER_CYCLE = "where the axis {} stands after a cycle is not followed"


@dataclass(frozen=True, slots=True)
class Drilling:
    """A drilling cycle as it was called.

    name    lower case
    block   where the call stands
    clear   height at which it ends, in program units (RTP); None if known only at run time
    depth   of the hole, in program units
    """

    name: str
    block: int
    clear: float | None
    depth: float | None

    @classmethod
    def of(cls, control: Sinumerik, block: int, step: Calling) -> Drilling:
        """From the arguments RTP, RFP, SDIS, DP, DPR."""
        values = [number(value(control)) for value in step.arguments] + [None] * 5
        written = [*step.written, *[None] * 5]
        clear, reference, _, depth, relative = values[:5]
        if written[3] is None and reference is not None and relative is not None:
            depth = reference - relative
        return cls(step.name, block, clear, depth)


def cycle(control: Sinumerik, block: int, step: Calling, *, modal: bool) -> None:
    """A cycle of the control: kept for later (MCALL), or executed here."""
    name = step.name.upper()
    if step.name not in DRILLING:
        if modal:
            control.suspended["cycle"] = f"the modal cycle {name} is in force, which ncfix does not follow"
            return
        if points := points_of(control, step):
            pattern(control, block, name, points)
            return
        holes = step.name.startswith(("holes", "cycle80"))
        refuse(control, block, (MADE_HOLES if holes else MADE).format(name))
        if MEASURING.fullmatch(step.name):
            control.refusal = control.refusal or f"{name} measures, and may set offsets at run time"
        return
    drilling = Drilling.of(control, block, step)
    if modal:
        control.modes.modal_cycle = drilling
    else:
        drill(control, drilling)


def pattern(control: Sinumerik, block: int, name: str, points: Points) -> None:
    """The modal cycle at each place of a pattern; behind it nobody knows for certain at which the axes stand."""
    drilling, plane = control.modes.modal_cycle, control.modal.plane
    assert drilling is not None
    control.pattern = points
    for point in points:
        lead_to(control, block, point, name)
        drill(control, drilling)
    control.lost = dict(control.lost) | dict.fromkeys((plane.first, plane.second), AFTER_PATTERN)
    control.unknown = control.unknown_for(control.lost)


def drill(control: Sinumerik, drilling: Drilling) -> None:
    """One hole where the axes stand: down to its depth, and up again."""
    name, plane = drilling.name.upper(), control.modal.plane
    if drilling.clear is None or drilling.depth is None:
        refuse(control, drilling.block, HEIGHTS.format(name))
        return
    control.settle_all()
    before, control.row_block = control.row_block, drilling.block
    for kind, height in ((Kind.FEED, drilling.depth), (Kind.RAPID, drilling.clear)):
        program, lost = control.program_position(), dict(control.lost)
        program[plane.across] = control.scale[plane.across] * height
        lost.pop(plane.across, None)
        end = End(command(control, program, {plane.across}), control.unknown_for(lost), lost)
        words = Words(drilling.block, {}, {}, 1 << plane.across)
        control.go(
            Leg(
                kind,
                words,
                end,
                control.modal.motion,
                passing=Passing(Pass.CYCLE_DEPTH, DEPTH.format(name)),
                settles=words.axes,
            )
        )
    control.row_block = before


def refuse(control: Sinumerik, block: int, why: str) -> None:
    """Motions that are not followed: where the axes stand after them is not known."""
    gone = [index for index in GEOMETRY if index in control.machine]
    lost = dict(control.lost) | dict.fromkeys(gone, AFTER_CYCLE)
    words = Words(block, {}, {}, sum(1 << index for index in gone))
    end = End(control.position[:], control.unknown_for(lost), lost)
    control.go(Leg(Kind.RAPID, words, end, control.modal.motion, refusal=why))
