"""Which motion a block executes: the code that it names, or the one in force if its axis words have no other use."""

from __future__ import annotations

from ncfix.control.expressions import Fault
from ncfix.control.modal import NO_MOTION
from ncfix_iso.rs274.control import ARCS, RS274Control
from ncfix_iso.rs274.groups import DYNAMIC_OFFSETS, LENGTH, TURNING_CYCLES
from ncfix_iso.rs274.motion import BAD_MOTION, NO_CODE
from ncfix_iso.rs274.plans import Codes, RS274Plan

WITHOUT_AXES = frozenset((0, 10, *ARCS, 52, NO_MOTION, *TURNING_CYCLES))
"""Motion codes that need no axis word."""


def motion_of(control: RS274Control, plan: RS274Plan, codes: Codes) -> int | None:
    """The motion code that a block executes; raises `Fault` where its axis words have no code."""
    has_axes = plan.axes != 0
    if codes.motion is not None:
        return explicit_motion(control, codes, codes.motion, has_axes)
    if codes.takes or (has_axes and codes.g.get(LENGTH) in DYNAMIC_OFFSETS):
        return None
    modal = control.modal.motion
    if has_axes and modal in (NO_MOTION, -1):
        return without_code(control)
    if has_axes:
        return modal
    level = control.rules.level_of(modal)
    if not control.rules.strict and level in plan.letters and control.modal.cycle.initial is not None:
        return modal if modal in control.rules.cycles else None
    return modal if plan.letters & {"I", "J", "K"} and modal in ARCS else None


def explicit_motion(control: RS274Control, codes: Codes, motion: int, has_axes: bool) -> int | None:
    """The motion code that a block names, if it is executed."""
    if codes.takes and motion != NO_MOTION:
        only_modal(control, motion, "two G codes of the block both use its axis words")
        return None
    if motion == NO_MOTION and has_axes and not codes.takes and control.rules.strict:
        raise Fault(BAD_MOTION, "axis words cannot be used with G80")
    if not has_axes and motion not in WITHOUT_AXES:
        only_modal(control, motion, f"G{motion / 10:g} needs an axis word")
        return None
    return motion


def only_modal(control: RS274Control, motion: int, fault: str) -> None:
    """A motion code that comes into force and moves nothing yet; LinuxCNC refuses it."""
    if control.rules.strict:
        raise Fault(BAD_MOTION, fault)
    control.modal.motion = motion


def without_code(control: RS274Control) -> int:
    """Axis words while no motion code is in force."""
    if control.rules.strict:
        raise Fault(BAD_MOTION, "axis words, and no motion code is in force", "G0 or G1 is missing")
    return NO_CODE
