"""Reference points of these controls: G28 goes to the first, G27 checks one.

Sources: Fanuc 30i operator's manual (machining centre), "Reference position": G27 is a rapid to its words; Haas mill
operator's manual, G28, G49.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.control.moves import Motion, MotionEnd, MotionKind, Pass, Passing
from ncfix_iso.rs274.control import Block, RS274Control
from ncfix_iso.rs274.motion import REFERENCE_POINT, destination, go_to_reference
from ncfix_iso.rs274.settings import tool_offset

if TYPE_CHECKING:
    from ncfix_fanuc.macro.control import MacroControl

CHECKED = Passing(Pass.REFERENCE_POINT, "reference point check (G27)")
AFTER_ALL = "where the axis {} stands after G28 that names no axis differs from control to control"
NO_LENGTH = 490


def check(control: RS274Control, block: Block, code: int) -> None:
    """G27: a rapid to the words, which should be a reference point."""
    if block.axes:
        end = destination(control, block)
        control.make(Motion(MotionKind.RAPID, block.axes, end, control.modal.motion, passing=CHECKED))


def named(control: RS274Control, block: Block, code: int) -> None:
    """G28: the named axes go to the reference point; if none is named, controls differ in whether all go."""
    if block.axes:
        go_to_reference(control, block, code)
        return
    unknown = control.unknown | dict.fromkeys(control.axis_indices, AFTER_ALL)
    passing = Passing(Pass.REFERENCE_POINT, REFERENCE_POINT.format("G28"))
    end = MotionEnd(control.position[:], unknown)
    control.make(Motion(MotionKind.RAPID, 0, end, control.modal.motion, passing=passing))


def cancelling(control: MacroControl, block: Block, code: int) -> None:
    """G28 of Haas, which also cancels the tool length offset."""
    go_to_reference(control, block, code)
    if control.length_code:
        control.length_code = 0
        tool_offset(control, Block(block.index, {}, frozenset(), 0), NO_LENGTH)
