"""Tool lengths of these controls: H stays in force, and another H alone is another length at once.

Source: Fanuc 30i operator's manual (machining centre), "Tool length offset": the number of H is modal, H0 is no offset.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.control.coordinates import Z, mask_of
from ncfix.text.tree import Comment, Tape, Word
from ncfix_fanuc.macro.data import CHANGED
from ncfix_fanuc.macro.tilt import INCLINED
from ncfix_iso.rs274 import settings
from ncfix_iso.rs274.cycles import AXES_SAID
from ncfix_iso.rs274.groups import LENGTH
from ncfix_iso.rs274.parameters import whole

if TYPE_CHECKING:
    from ncfix_fanuc.macro.control import MacroControl
    from ncfix_iso.rs274.control import Block
    from ncfix_iso.rs274.plans import Codes

ALONG_Z = "a tool length in G18 or G19: ncfix assumes that it acts along Z"
LENGTH_ALONE = "NCF214"
ALONE = (
    "a tool length without a Z word (G43, G49): ncfix assumes that it does not move the axis, which matters up to the "
    "next Z word"
)
LENGTH_IN_STEPS = "the position of the axis {} after a tool length together with an increment (G91) is not certain"
NO_NUMBER = "NCF217"
SPINDLE = "a tool length without H: ncfix uses the length of the tool in the spindle"
TURNED = "NCF218"
TURNED_TEXT = (
    "rotary axes are not at zero where G43.4 is switched on; ncfix assumes that X Y Z count in the workpiece as it "
    "lies with all rotary axes at zero (parameters 19696 WKP, 19754 RPS)"
)
KIND_OF_TIP_CONTROL = "which kind of tool-centre-point control G{:g} P{:g} selects is not known"
BY_ANGLE, BY_VECTOR = 434, 435
HAAS_TIP = 2340
TIP_CONTROL = (BY_ANGLE, BY_VECTOR)
NOTHING = 1e-12
PLAIN_CANCEL = 490
CANCEL = (PLAIN_CANCEL, 491)
SAME = {491: PLAIN_CANCEL, BY_VECTOR: BY_ANGLE, HAAS_TIP: BY_ANGLE}
"""Codes of tool lengths with the same effect on the length as another code."""

G90, G91 = 900, 910
REFERENCE = frozenset((280, 300, 530))
ENDS = frozenset((20, 300))
CALLS = frozenset((970, 980, 990, 1980))
MOVING = frozenset("XYABCUVWIJKRP")
"""Addresses in blocks that move something, or call a program that may."""


def tool_offset(control: MacroControl, block: Block, code: int) -> None:
    """G43 to G49. Without a Z word, controls differ: the axis moves by the change of length, or Z changes instead."""
    before = control.tools.vector[Z]
    control.resume(CHANGED)
    direct(control, block, code)
    if code in CANCEL:
        control.length_code = 0
    else:
        control.length_code = code
        if "H" in block.values:
            control.length_number = whole(block.values["H"], "H")
        elif control.length_number is not None:
            block.values["H"] = float(control.length_number)
        else:
            control.warn(NO_NUMBER, SPINDLE, "program H in the block of G43")
        if control.modal.plane.across != Z:
            control.warn(AXES_SAID, ALONG_Z, "check along which axis it acts (Fanuc: parameter 5001 TLB)")
        turned = any(abs(control.position[i]) > NOTHING for i in control.turning)
        if code in TIP_CONTROL and not control.tcp and turned:
            hint = "switch G43.4 on with the rotary axes at zero, or check the parameters"
            control.warn(TURNED, TURNED_TEXT, hint)
    settings.tool_offset(control, block, SAME.get(code, code))
    if control.tools.vector[Z] != before and "Z" not in block.values and not z_is_named_first(control):
        control.warn(LENGTH_ALONE, ALONE, "program Z in the block, or check what the control does (parameter TOS)")


def direct(control: MacroControl, block: Block, code: int) -> None:
    """Set how the tool is directed: by I J K in G43.5 (Q, an inclination from them, is not followed).

    P1 of G43.4 and G43.5 turns the tool in a plane.
    """
    control.resume(INCLINED)
    kind = block.get("P") if code in TIP_CONTROL else 0.0
    control.posture_control = kind != 0.0
    if kind not in (0.0, 1.0):
        control.suspend(INCLINED, KIND_OF_TIP_CONTROL.format(code / 10, kind))
    control.vectors = code == BY_VECTOR
    if control.vectors:
        control.places.lose(mask_of(control.turning))
        if block.get("Q") != 0.0:
            control.suspend(INCLINED, INCLINED)


def z_is_named_first(control: MacroControl) -> bool:
    """Whether Z is named, or the program ends, before anything else moves, so that the place of Z does not matter."""
    incremental = control.modal.incremental
    for shape in control.coming():
        words = {word.address for word in shape.words}
        incremental = G91 in shape.g_codes or (incremental and G90 not in shape.g_codes)
        if not all(isinstance(item, Word | Comment | Tape) for item in shape.items):
            return False
        if "Z" in words:
            return not incremental or not REFERENCE.isdisjoint(shape.g_codes)
        if not ENDS.isdisjoint(shape.m_codes):
            return True
        if words & MOVING or not CALLS.isdisjoint(shape.m_codes):
            return False
    return False


def lone_number(control: MacroControl, block: Block, codes: Codes) -> None:
    """Apply an H word in a block without G43: another length, which acts at once if one is in force."""
    if "H" not in block.values or LENGTH in codes.g or codes.call is not None:
        return
    if control.length_code:
        inclined = {key: why for key, why in control.suspended.items() if key == INCLINED}
        kept = control.posture_control
        tool_offset(control, block, control.length_code)
        control.suspended |= inclined
        control.posture_control = kept
    else:
        control.length_number = whole(block.values["H"], "H")
