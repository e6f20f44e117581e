"""Codes that only set something: planes, units, distance modes, cutter compensation, saved states.

Source: LinuxCNC documentation, "G-codes" and "M70 .. M73".
"""

from __future__ import annotations

import copy
import math

from ncfix.control.coordinates import INCH, PLANES
from ncfix.control.expressions import Fault
from ncfix.control.state import Modal, Saved
from ncfix_iso.rs274.control import Block, RS274Control
from ncfix_iso.rs274.systems import activate

BAD_SETTING = "NCF221"


def plane(control: RS274Control, block: Block, code: int) -> None:
    """G17, G18, G19, and G17.1 to G19.1."""
    if control.modal.compensated and control.rules.strict and PLANES[code] is not control.modal.plane:
        raise Fault(BAD_SETTING, "the plane cannot be changed while cutter compensation is on")
    control.modal.plane = PLANES[code]


def units(control: RS274Control, block: Block, code: int) -> None:
    """G20 and G21."""
    control.modal.unit = INCH if code == 200 else 1.0
    control.refresh()


def diameter(control: RS274Control, block: Block, code: int) -> None:
    """G7 and G8."""
    control.modal.diameter = code == 70
    control.refresh()


def distance(control: RS274Control, block: Block, code: int) -> None:
    """G90 and G91."""
    control.modal.incremental = code == 910


def arc_distance(control: RS274Control, block: Block, code: int) -> None:
    """G90.1 and G91.1."""
    control.modal.arc_absolute = code == 901


def retract(control: RS274Control, block: Block, code: int) -> None:
    """G98 and G99."""
    control.modal.retract_to_r = code == 990


NO_REGISTER = -1
"""The D of a program that has named none: no tool has this number, so the radius is not known."""


def compensation(control: RS274Control, block: Block, code: int) -> None:
    """G40 to G42.1: the programmed contour is followed, the control offsets it."""
    side = 0 if code == 400 else code // 10
    if control.rules.strict and side:
        if control.modal.compensated:
            raise Fault(BAD_SETTING, "cutter compensation is on already")
        if control.modal.plane.code == 190:
            raise Fault(BAD_SETTING, "cutter compensation works in the planes G17 and G18 only")
    if not side:
        control.end_compensation()
    number, tools = block.values.get("D"), control.tools
    tools.cutter = math.nan
    if control.rules.strict:
        tools.register = None
    elif side and tools.register is None:
        tools.register = NO_REGISTER
    if number is not None and code % 10:
        tools.cutter = number / 2 * control.modal.unit
    elif number is not None:
        tools.register = round(number)
    control.modal.compensated = side


def select_radius(control: RS274Control, block: Block, code: int) -> None:
    """D, by which ISO controls know the radius of the cutter from there on; LinuxCNC takes it beside G41 only."""
    if not control.rules.strict:
        control.tools.register = NO_REGISTER if "D" in block.runtime else round(block.values["D"])


def unknown_code(control: RS274Control, code: int, *, moving: bool) -> None:
    """A G code that is not known: it may change coordinates, or move."""
    name = f"G{code / 10:g}"
    if control.rules.strict:
        raise Fault("NCF227", f"{name} is not a code of LinuxCNC", "if the machine remaps it, ncfix cannot follow it")
    control.refuse_after(code, moving=moving)


# -- saved states -----------------------------------------------------------------------------------------------------


def spindle_or_state(control: RS274Control, block: Block, code: int) -> None:
    """M3, M4, M5, M19, and M70 to M73 that save and restore the modal state."""
    match code:
        case 700 | 730:
            control.saved[-1] = Saved(copy.copy(control.modal), code == 730)
        case 710:
            control.saved[-1] = None
        case 720:
            state = control.saved[-1]
            if state is None:
                raise Fault(BAD_SETTING, "M72 restores a state, and none was saved with M70")
            restore(control, state.modal)
        case _:
            control.modal.spindle = 5 if code == 190 else code // 10


def restore(control: RS274Control, saved: Modal) -> None:
    """Take a saved modal state into force; the motion code and canned cycle are not part of it."""
    now = control.modal
    restored = copy.copy(saved)
    restored.motion, restored.cycle, restored.system = now.motion, now.cycle, now.system
    control.modal = restored
    if saved.system != now.system:
        activate(control, saved.system)
    control.refresh()
