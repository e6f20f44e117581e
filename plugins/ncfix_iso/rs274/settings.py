"""Steps of codes that only set something: planes, units, distances, cutter compensation, saved states, tools, lengths.

Sources: LinuxCNC documentation, "G-codes", "M70 .. M73", "G43", "G43.1", "G43.2", "G49", "G10 L1"; for G43.4, G43.5 and
G44 the Fanuc 30i programming manual.
"""

from __future__ import annotations

import copy
import math

from ncfix.control.coordinates import INCH, LETTERS, PLANES, Vector, X, Y, Z, mask_of, zeros
from ncfix.control.expressions import Fault
from ncfix.control.state import TOOL_AT_RUN_TIME, Modal, Saved
from ncfix.control.tcp import switch
from ncfix_iso.rs274.control import Block, RS274Control
from ncfix_iso.rs274.groups import DYNAMIC_OFFSETS
from ncfix_iso.rs274.parameters import whole
from ncfix_iso.rs274.systems import (
    BAD_G10,
    SYSTEM_NAMES,
    activate,
    before_persistent,
    first_parameter,
    set_system,
    stored,
    words_of,
)

BAD_SETTING = "NCF221"


def plane(control: RS274Control, block: Block, code: int) -> None:
    """G17, G18, G19, and G17.1 to G19.1."""
    if control.modal.compensated and control.rules.strict and PLANES[code] is not control.modal.plane:
        raise Fault(BAD_SETTING, "the plane cannot be changed while cutter compensation is on")
    control.modal.plane = PLANES[code]


def units(control: RS274Control, block: Block | None, code: int) -> None:
    """G20 and G21."""
    control.set_unit(INCH if code == 200 else 1.0)


def diameter(control: RS274Control, block: Block, code: int) -> None:
    """G7 and G8."""
    control.modal.diameter = code == 70
    control.refresh()


def distance(control: RS274Control, block: Block, code: int) -> None:
    """G90 and G91: axis words are absolute or incremental."""
    control.modal.incremental = code == 910


def arc_distance(control: RS274Control, block: Block, code: int) -> None:
    """G90.1 and G91.1: centres of arcs are absolute or relative to the start."""
    control.modal.arc_absolute = code == 901


def path_mode(control: RS274Control, block: Block, code: int) -> None:
    """G61 (exact stop on ISO controls), G61.1 (exact stop in LinuxCNC), G63 and G64."""
    control.modal.exact_stop = code == (611 if control.rules.strict else 610)


def retract(control: RS274Control, block: Block, code: int) -> None:
    """G98 and G99."""
    control.modal.retract_to_r = code == 990


NO_REGISTER = -1
"""D of a program that has named none: no tool has this number, so the radius is unknown."""


def compensation(control: RS274Control, block: Block, code: int) -> None:
    """G40 to G42.1: the programmed contour is followed, which the control offsets.

    G41.1 without D turns an axis along the path on other controls.
    """
    side = 0 if code == 400 else code // 10
    if code % 10 and "D" not in block.values and not control.rules.strict:
        control.refuse_rest(f"G{code / 10:g} without D turns an axis along the path on some controls")
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
    """D, which sets the cutter radius on ISO controls; in LinuxCNC it only counts beside G41 or G42."""
    if not control.rules.strict:
        control.tools.register = NO_REGISTER if "D" in block.unknown else round(block.values["D"])


def unknown_code(control: RS274Control, code: int, *, moving: bool) -> None:
    """Handle an unknown G code, which may change coordinates or move axes."""
    name = f"G{code / 10:g}"
    if control.rules.strict:
        raise Fault(
            "NCF227", f"{name} is not a code of LinuxCNC", "if the machine remaps it, ncfix cannot know what it does"
        )
    control.refuse_after(code, moving=moving)


# -- saved states -----------------------------------------------------------------------------------------------------


def spindle_or_state(control: RS274Control, block: Block, code: int) -> None:
    """M3, M4, M5, M19, and M70 to M73, which save and restore the modal state."""
    match code:
        case 700 | 730:
            control.saved[-1] = Saved(copy.copy(control.modal), code == 730)
        case 710:
            control.saved[-1] = None
        case 720:
            state = control.saved[-1]
            if state is None:
                raise Fault(BAD_SETTING, "M72 restores a state, but M70 has saved none")
            restore(control, state.modal)
        case _:
            control.modal.spindle = 5 if code == 190 else code // 10


def restore(control: RS274Control, saved: Modal) -> None:
    """Restore a saved modal state; motion code and canned cycle are not part of it."""
    now = control.modal
    restored = copy.copy(saved)
    restored.motion, restored.cycle, restored.system = now.motion, now.cycle, now.system
    control.modal = restored
    if saved.system != now.system:
        activate(control, saved.system)
    control.refresh()


BAD_LENGTH = "NCF224"

BY_H_ALONE = "whether H without G43 changes the tool length depends on the control"
AFTER_H_ALONE = "the position of the axis {} after H without G43 depends on the control"
DIFFERS = "what G10 L{} sets depends on the control (--dialect says which one it is)"


# -- tool numbers -----------------------------------------------------------------------------------------------------


def select_tool(control: RS274Control, block: Block, code: int) -> None:
    """T: select the tool that the next M6 loads."""
    control.tools.select(whole(block.values["T"], "T"), unsure="T" in block.unknown)


def change_tool(control: RS274Control, block: Block, code: int) -> None:
    """M6, for which machines move to their tool change position, and M61 Qn, which only names the tool."""
    if code == 610:
        control.tools.select(whole(block.get("Q", -1.0), "Q of M61"), unsure="Q" in block.unknown)
        if control.tools.selected < 0:
            raise Fault(BAD_LENGTH, "M61 needs Q, the number of the tool")
    else:
        control.places.lose(mask_of(control.axis_indices))
    control.tools.change()


# -- length offsets ---------------------------------------------------------------------------------------------------


def tool_offset(control: RS274Control, block: Block, code: int) -> None:
    """G43, G43.1, G43.2, G43.4, G43.5, G44 and G49.

    An offset of zero length (H0, G43.1 Z0) counts as none: the tool length is then that of the tool in the spindle. An
    offset whose length is missing and taken as zero counts as one. G43.1 with H is a length along the turned tool on
    other controls.
    """
    if code == 431 and "H" in block.values and not control.rules.strict:
        control.refuse_rest("on some controls G43.1 with H is a tool length along the tilted tool")
    tool, number, lacking = offset_of(control, block, code)
    if control.resume(BY_H_ALONE):
        control.lose((X, Y, Z) if control.tcp else (Z,), AFTER_H_ALONE)
    given = number is not None
    control.tip_control = code in (434, 435)
    on = control.setup.tcp or control.tip_control or control.tilted
    number = number if (on and number) or any(tool) or lacking else None
    if "H" in block.unknown or (code in DYNAMIC_OFFSETS and block.unknown):
        control.refuse_rest("a tool length offset is known only at run time")
    if code == 435:
        control.refuse_rest("I J K give the tool direction (G43.5)")
    across = (X, Y) if on and not (control.tcp and control.stands_square()) else ()
    if on or control.tcp:
        switch(control, tool, on, number)
    control.places.shift(mask_of((*across, Z)))
    control.tools.vector, control.tools.offset = tool, number
    control.modal.tool_code = 430 if given else 490
    control.refresh()


def lone_length(control: RS274Control, block: Block, code: int) -> None:
    """H in a block without G43: changes the length if one is in force; otherwise controls differ."""
    tools, known = control.tools, "H" not in block.unknown
    if known and block.values["H"] == float(tools.offset or 0):
        return
    if known and tools.offset is not None and tools.vector[Z] >= 0 and not control.modal.incremental:
        tool_offset(control, block, 434 if control.tip_control else 430)
    else:
        control.suspend(BY_H_ALONE, BY_H_ALONE)


def offset_of(control: RS274Control, block: Block, code: int) -> tuple[Vector, int | None, bool]:
    """The effect of a code: the offset, its tool number (None: no offset), and whether the tool's length is missing."""
    if code == 490:
        return zeros(), None, False
    if code in DYNAMIC_OFFSETS:
        return *offset_by_words(control, block, added=code == 432), False
    tool, number = zeros(), numbered_tool(control, block)
    tool[Z] = length_of(control, number) * (-1.0 if code == 440 else 1.0)
    said = number in control.tools.lengths or control.knowledge.known_tool_length(number) is not None
    return tool, number, number > 0 and not said


def offset_by_words(control: RS274Control, block: Block, *, added: bool) -> tuple[Vector, int]:
    """G43.1: the axis words are the offset. G43.2: they, or the length of tool H, are added to it."""
    tool = control.tools.vector[:]
    number = control.tools.spindle if control.tools.offset is None else control.tools.offset
    if added and "H" in block.values:
        tool[Z] += length_of(control, numbered_tool(control, block))
        return tool, number
    if added and not block.axes:
        raise Fault(BAD_LENGTH, "G43.2 needs H or axis words")
    for index in words_of(block):
        value = control.scale[index] * block.values[LETTERS[index]]
        tool[index] = tool[index] + value if added else value
    return tool, number


def numbered_tool(control: RS274Control, block: Block) -> int:
    """The tool named by H; without H, and for H0 in LinuxCNC, the tool in the spindle."""
    number = whole(block.values["H"], "H") if "H" in block.values else None
    if number is not None and number < 0:
        raise Fault(BAD_LENGTH, f"H{number} is negative")
    if number is not None and (number or not control.rules.strict):
        return number
    if control.tools.unsure:
        control.refuse_rest(TOOL_AT_RUN_TIME)
    return control.tools.spindle


def length_of(control: RS274Control, number: int) -> float:
    """The length of a tool for an offset, mm."""
    if number in control.tools.measured:
        control.refuse_rest(f"the program measures the length of tool {number} at run time")
    if number in control.tools.lengths:
        return control.tools.lengths[number]
    if number == 0 and not control.rules.strict:
        return 0.0
    return control.knowledge.tool_length(number)


# -- G10 --------------------------------------------------------------------------------------------------------------


def set_data(control: RS274Control, block: Block, code: int) -> None:
    """G10: L2 and L20 set a coordinate system, L1, L10 and L11 a tool.

    Controls differ: P0 is the system in force or the external one, and in G91 words are set or added.
    """
    kind = whole(block.get("L", -1.0), "L of G10")
    if block.unknown & {"L", "P"}:
        control.refuse_rest("what G10 sets is known only at run time")
    alike = kind == 2 and "R" not in block.values and block.get("P") != 0.0 and not control.modal.incremental
    if not control.rules.strict and not alike:
        control.refuse_rest(DIFFERS.format(kind))
    elif kind in (2, 20):
        set_system(control, block, at_position=kind == 20)
    elif kind in (1, 10, 11):
        set_tool(control, block, kind)
    else:
        raise Fault(BAD_G10, "G10 needs L1, L2, L10, L11 or L20")


def set_tool(control: RS274Control, block: Block, kind: int) -> None:
    """G10 L1: the Z word is the tool length. L10, L11: it is the Z coordinate that the position gets with that tool."""
    number = whole(block.get("P", -1.0), "P of G10")
    if number < 1:
        raise Fault(BAD_G10, "P of G10 L1, L10 and L11 is a tool number")
    if "Z" not in block.values:
        return
    length, unsure = control.modal.unit * block.values["Z"], "Z" in block.unknown
    if kind != 1:
        control.use_start_positions((Z,))
        system = control.modal.system if kind == 10 else len(SYSTEM_NAMES)
        first = first_parameter(system)
        before_persistent(control, first + Z)
        shift = control.frames.additive.shift[Z] + control.frames.local.shift[Z] if kind == 10 else 0.0
        length = control.position[Z] - stored(control, first)[Z] - shift - length
        unsure |= Z in control.unknown or control.parameters.is_unknown(first + Z)
        unsure |= kind == 10 and Z in control.composed.unknown
    control.tools.lengths[number] = length
    if unsure:
        control.tools.measured.add(number)
