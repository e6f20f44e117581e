"""Tools: T, M6, M61, tool length offsets G43 to G49, and G10 L1, L10, L11 that set them.

Source: LinuxCNC documentation, "G43", "G43.1", "G43.2", "G49", "G10 L1"; G43.4, G43.5 and G44 from the Fanuc 30i
programming manual.
"""

from __future__ import annotations

from ncfix.control.coordinates import LETTERS, Vector, X, Y, Z, mask_of, zeros
from ncfix.control.expressions import Fault
from ncfix.control.state import TOOL_AT_RUN_TIME
from ncfix.control.tcp import switch
from ncfix_iso.rs274.control import Block, RS274Control
from ncfix_iso.rs274.expressions import whole
from ncfix_iso.rs274.groups import DYNAMIC_OFFSETS
from ncfix_iso.rs274.systems import BAD_G10, SYSTEM_NAMES, first_parameter, set_system, stored, words_of

BAD_LENGTH = "NCF224"

DIFFERS = "what G10 L{} sets differs from control to control (--dialect says which one it is)"


# -- tool numbers -----------------------------------------------------------------------------------------------------


def select_tool(control: RS274Control, block: Block, code: int) -> None:
    """T: the tool that the next M6 puts into the spindle."""
    control.tools.select(whole(block.values["T"], "T"), unsure="T" in block.runtime)


def change_tool(control: RS274Control, block: Block, code: int) -> None:
    """M6, for which machines go where tools are changed, and M61 Qn, which only says what is in the spindle."""
    if code == 610:
        control.tools.select(whole(block.get("Q", -1.0), "Q of M61"), unsure="Q" in block.runtime)
        if control.tools.selected < 0:
            raise Fault(BAD_LENGTH, "M61 needs Q, the number of the tool")
    else:
        control.places.lose(mask_of(control.machine))
    control.tools.change()


# -- length offsets ---------------------------------------------------------------------------------------------------


def tool_offset(control: RS274Control, block: Block, code: int) -> None:
    """G43, G43.1, G43.2, G43.4, G43.5, G44 and G49.

    An offset without any length (H0, G43.1 Z0) is none: how long the tool is, the one in the spindle tells. One that
    was not given and is taken as zero is one.
    """
    tool, number, lacking = offset_of(control, block, code)
    given = number is not None
    control.tip_control = code in (434, 435)
    on = control.setup.tcp or control.tip_control or control.tilted
    number = number if (on and number) or any(tool) or lacking else None
    if "H" in block.runtime or (code in DYNAMIC_OFFSETS and block.runtime):
        control.refusal = control.refusal or "a tool length offset is known only at run time"
    if code == 435:
        control.refusal = control.refusal or "the tool direction is given by I J K (G43.5)"
    across = (X, Y) if on and not (control.tcp and control.stands_square()) else ()
    if on or control.tcp:
        switch(control, tool, on, number)
    control.places.shift(mask_of((*across, Z)))
    control.tools.vector, control.tools.offset = tool, number
    control.modal.tool_code = 430 if given else 490
    control.refresh()


def offset_of(control: RS274Control, block: Block, code: int) -> tuple[Vector, int | None, bool]:
    """What a code sets: the offset, the number of its tool (None without one), and whether its length is lacking."""
    if code == 490:
        return zeros(), None, False
    if code in DYNAMIC_OFFSETS:
        return *offset_by_words(control, block, added=code == 432), False
    tool, number = zeros(), numbered_tool(control, block)
    tool[Z] = length_of(control, number) * (-1.0 if code == 440 else 1.0)
    return tool, number, number > 0 and is_lacking(control, number)


def offset_by_words(control: RS274Control, block: Block, *, added: bool) -> tuple[Vector, int]:
    """G43.1: the axis words are the offset; G43.2: they, or the length of tool H, are added to it."""
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
    """The tool that H names; without H, and with H0 in LinuxCNC, the one in the spindle."""
    number = whole(block.values["H"], "H") if "H" in block.values else None
    if number is not None and number < 0:
        raise Fault(BAD_LENGTH, f"H{number} is negative")
    if number is not None and (number or not control.rules.strict):
        return number
    if control.tools.unsure:
        control.refusal = control.refusal or TOOL_AT_RUN_TIME
    return control.tools.spindle


def is_lacking(control: RS274Control, number: int) -> bool:
    """Whether nobody has said how long a tool is."""
    return number not in control.tools.lengths and control.knowledge.known_tool_length(number) is None


def length_of(control: RS274Control, number: int) -> float:
    """The length of a tool for an offset, mm."""
    if number in control.tools.measured:
        control.refusal = control.refusal or f"the length of tool {number} is measured at run time"
    if number in control.tools.lengths:
        return control.tools.lengths[number]
    if number == 0 and not control.rules.strict:
        return 0.0
    return control.knowledge.tool_length(number)


# -- G10 --------------------------------------------------------------------------------------------------------------


def set_data(control: RS274Control, block: Block, code: int) -> None:
    """G10: L2 and L20 set a coordinate system, L1, L10 and L11 a tool.

    Where controls differ: P0 is the system in force or the external one, and in G91 words are set or added.
    """
    kind = whole(block.get("L", -1.0), "L of G10")
    if block.runtime & {"L", "P"}:
        control.refusal = control.refusal or "what G10 sets is known only at run time"
    alike = kind == 2 and "R" not in block.values and block.get("P") != 0.0 and not control.modal.incremental
    if not control.rules.strict and not alike:
        control.refusal = control.refusal or DIFFERS.format(kind)
    elif kind in (2, 20):
        set_system(control, block, at_position=kind == 20)
    elif kind in (1, 10, 11):
        set_tool(control, block, kind)
    else:
        raise Fault(BAD_G10, "G10 needs L1, L2, L10, L11 or L20")


def set_tool(control: RS274Control, block: Block, kind: int) -> None:
    """G10 L1: the Z word is the tool's length; L10, L11: it is what Z is to be called with that tool."""
    number = whole(block.get("P", -1.0), "P of G10")
    if number < 1:
        raise Fault(BAD_G10, "P of G10 L1, L10 and L11 is a tool number")
    if "Z" not in block.values:
        return
    length = control.modal.unit * block.values["Z"]
    if kind != 1:
        control.use_start_positions((Z,))
        system = control.modal.system if kind == 10 else len(SYSTEM_NAMES)
        shift = control.frames.additive.shift[Z] + control.frames.local.shift[Z] if kind == 10 else 0.0
        length = control.position[Z] - stored(control, first_parameter(system))[Z] - shift - length
    control.tools.lengths[number] = length
    if "Z" in block.runtime or (kind != 1 and Z in control.unknown):
        control.tools.measured.add(number)
