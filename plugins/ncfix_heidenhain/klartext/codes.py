"""M codes that matter to where the tool goes. Others, also those of the machine's builder, move nothing.

Source: TNC 640, "Miscellaneous functions". M94 and M128 act from the start of their block, M129 from its end.
"""

from __future__ import annotations

import math

from ncfix.control.moves import Pass, Passing
from ncfix_heidenhain.klartext.control import RETRACTED, KlartextControl
from ncfix_heidenhain.klartext.step import Step
from ncfix_heidenhain.klartext.targets import MotionWords

SUSPENDING = {
    104: "M104: the datum that was set last comes back into force",
    114: "M114: the control works the geometry of the machine into positions",
    144: "M144: the control works the geometry of the machine into positions",
}
ENDING = {115: 114, 145: 144}
CHOSEN = "M138: the control takes only some of the rotary axes into account"
UNTILTED = "M130: coordinates of the untilted system in a tilted plane"
RETRACT = Passing(Pass.RETRACTION, "retract along the tool axis (M140)")
COUNTED = "from where the axis {} counts after M126 depends on a parameter of the machine: it went past a turn"
FULL = 2 * math.pi
COMPENSATION = {"r0": 0, "rl": 41, "rr": 42, "r+": 41, "r-": 42}


def before_motion(control: KlartextControl, step: Step) -> None:
    """What acts from the start of the block."""
    for flag, side in COMPENSATION.items():
        if flag in step.flags:
            if not side:
                control.end_compensation()
            control.modal.compensated = side
    for code in step.codes:
        if code in SUSPENDING:
            control.suspended[f"M{code}"] = SUSPENDING[code]
        elif code in ENDING:
            control.suspended.pop(f"M{ENDING[code]}", None)
    control.suspended.pop("M130", None)
    if 130 in step.codes and control.plane_tilted:
        control.suspended["M130"] = UNTILTED
    if step.codes & {126, 127}:
        end_of_short_ways(control, 127 in step.codes)
    if 136 in step.codes or 137 in step.codes:
        control.modal.feed_mode = 95 if 136 in step.codes else 94
    if 128 in step.codes:
        tip_control(control, on=True)
    if 94 in step.codes:
        reduce_turns(control, step.flags)
    if 138 in step.codes:
        choose_axes(control, step.flags)


def end_of_short_ways(control: KlartextControl, on: bool) -> None:
    """M127 after M126: an axis that went past a turn may count from there, or from the angle below a turn.

    M126 means nothing to an axis that cannot go round, as the one that tilts the tool: it may stand below zero.
    """
    pointing = control.pointing if on and control.shortest else None
    tilts = None if pointing is None else control.machine[pointing.columns[1]]
    for index in control.turning if on and control.shortest else ():
        below = control.position[index] < 0 and index != tilts
        if index not in control.unknown and (below or control.position[index] >= FULL):
            control.lose([index], COUNTED)
    control.shortest = not on


def choose_axes(control: KlartextControl, flags: frozenset[str]) -> None:
    """M138: the rotary axes that tilted planes and control of the tip take into account, those of the machine again."""
    control.suspended.pop("M138", None)
    turning = {"XYZABCUVW"[index].lower() for index in control.turning}
    if flags & set("abc") not in (set(), turning):
        control.suspended["M138"] = CHOSEN


def reduce_turns(control: KlartextControl, flags: frozenset[str]) -> None:
    """M94: rotary axes, those that are named if any is, are said by an angle below a turn from here on."""
    named = flags & set("abc")
    for index in control.turning:
        if not named or "XYZABCUVW"[index].lower() in named:
            control.position[index] %= 2 * math.pi


def tip_control(control: KlartextControl, *, on: bool) -> None:
    """M128 and M129, FUNCTION TCPM."""
    control.m128 = on
    control.switch_tip()


def after_motion(control: KlartextControl, code: int, own: MotionWords, flags: frozenset[str]) -> None:
    """What acts at the end of the block."""
    if code == 129:
        tip_control(control, on=False)
        control.path.by_vector = control.path.spatial = False
    elif code == 140:
        control.pass_here(RETRACT, RETRACTED, "XYZ" if control.tcp else "Z")
