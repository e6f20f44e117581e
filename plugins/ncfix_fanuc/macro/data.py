"""G10 of these controls: work offsets (L2, L20) and tool lengths (L10); other data are not followed. Reference points.

Sources: Fanuc 30i operator's manual (machining centre), "Programmable data input"; "Reference position": G27 is a
rapid to its words; Haas mill operator's manual, G28, G49.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.control.coordinates import DEGREE, LETTERS, Z, mask_of
from ncfix.control.expressions import Unknown, Value, nominal
from ncfix.control.moves import Motion, MotionEnd, MotionKind, Pass, Passing
from ncfix.control.operations import make_up
from ncfix_iso.rs274.control import Block, RS274Control
from ncfix_iso.rs274.motion import REFERENCE_POINT, destination, go_to_reference
from ncfix_iso.rs274.parameters import whole
from ncfix_iso.rs274.settings import tool_offset
from ncfix_iso.rs274.systems import (
    AFTER_UNFOLLOWED,
    SYSTEM_NAMES,
    activate,
    extended_system,
    first_parameter,
    moved_while_turned,
    store,
    stored,
    words_of,
)

if TYPE_CHECKING:
    from ncfix_fanuc.macro.control import MacroControl
    from ncfix_iso.rs274.plans import RS274Plan

WORK_OFFSETS = 6
G17, STRAIGHT = 170, (0, 10)
FIRST_EXTENDED, ALL_EXTENDED = 1100, 1540
MADE = {
    470: "engraving of text (G47)",
    120: "a circular pocket (G12)",
    130: "a circular pocket (G13)",
    1500: "a pocket (G150)",
    290: "return from the reference point (G29)",
    720: "holes along a line (G72)",
    2530: "the turn of the tool normal to a feature coordinate system (G253)",
}
"""Motions whose path the control generates."""
SQUARE = 2530

SETTING_ERRORS = {
    542: "the dynamic offset of the rotary table (G54.2) is in force; its data are in the control",
    544: "the workpiece setting error compensation (G54.4) is in force; its data are in the control",
}

LENGTHS = (10,)
UNFOLLOWED = {
    11: "tool wear (G10 L11)",
    50: "parameters of the control (G10 L50)",
    52: "parameters of the control (G10 L52)",
}
CHANGED = (
    "the program changes the tool length while it is in force (G10 L10, #11001); when the change acts depends on the "
    "control"
)
CHECKED = Passing(Pass.REFERENCE_POINT, "reference point check (G27)")
AFTER_ALL = "the position of the axis {} after G28 without axis words depends on the control"
NO_LENGTH = 490
TOOL_LIFE = 3
RADIUS = 12
HARMLESS = frozenset({TOOL_LIFE, RADIUS, 13})
"""Tool life, and tool radii and their wear, which only the control's cutter compensation uses."""
DATA_WORDS = frozenset("PLTHDQ")
"""Words of the blocks between G10 L3 and G11, which select no tool and no length."""


def extended(control: RS274Control, block: Block, code: int) -> None:
    """G154 Pn of Haas, and G110 (P1) to G129 (P20): an additional work offset."""
    number = (code - FIRST_EXTENDED) / 10 + 1 if code < ALL_EXTENDED else block.get("P", 1.0)
    extended_system(control, Block(block.index, {"P": number}, block.unknown, block.axes))


def setting_error(control: RS274Control, block: Block, code: int) -> None:
    """G54.2 Pn and G54.4 Pn: offsets that turn with the tables; P0 ends them."""
    if block.get("P") or block.unknown:
        control.suspend(SETTING_ERRORS[code], SETTING_ERRORS[code])
    elif control.resume(SETTING_ERRORS[code]):
        control.lose(control.axis_indices, AFTER_UNFOLLOWED)


def made(control: RS274Control, block: Block, code: int) -> None:
    """A motion whose path the control generates: a text, a pocket, or the way back from a reference point."""
    make_up(control, block, MADE[code], control.turning if code == SQUARE else ())


def circular_pocket(control: RS274Control, block: Block, code: int) -> None:
    """G12 and G13 of Haas: a feed to the centre of the pocket, at its depth, where the cycle ends.

    The circles about the centre move with it. Passes at several depths (L, in G91) have no single bottom.
    Source: Haas, "Mill operator's manual": G12 and G13, X and Y in their block.
    """
    modal = control.modal
    turned = modal.incremental or modal.plane.code != G17 or modal.compensated or control.tilted
    if turned or modal.motion not in STRAIGHT or block.get("L", 1.0) != 1.0:
        make_up(control, block, MADE[code])
        return
    with control.in_one_piece():
        control.make(Motion(MotionKind.FEED, block.axes, destination(control, block), modal.motion))
    control.moved_as_a_whole(f"G{code // 10}")


def circular_pocket_here(control: RS274Control, block: Block, code: int) -> None:
    """G12 and G13 of Mitsubishi: about the position of the tool; the meaning of axis words beside them is not known."""
    if block.axes:
        make_up(control, block, MADE[code])
        return
    control.builder.rests(mask_of(control.axis_indices))
    circular_pocket(control, block, code)


def set_data(control: MacroControl, block: Block, code: int) -> None:
    """G10; without L, a block with P sets tool lengths, as on old controls."""
    kind = whole(block.get("L", 10.0 if "P" in block.values else -1.0), "L of G10")
    control.entering = kind == TOOL_LIFE
    if kind == 2:
        set_offset(control, block)
    elif kind == 20:
        set_extended(control, block)
    elif kind in LENGTHS:
        set_length(control, block)
    elif kind == RADIUS:
        control.tools.resized.add(whole(block.get("P"), "P of G10"))
    elif kind not in HARMLESS:
        what = UNFOLLOWED.get(kind, f"data of the control (G10 L{kind})")
        control.refuse_rest(f"the program sets {what}, which ncfix does not support")


def is_data(plan: RS274Plan) -> bool:
    """Whether a block is one of those behind G10 L3: words of a tool, and no code."""
    return (
        plan.codes is not None
        and not (plan.codes.g or plan.codes.m or plan.codes.unknown)
        and plan.letters <= DATA_WORDS
    )


def set_offset(control: RS274Control, block: Block) -> None:
    """L2 Pn: the words are the offset of G54 (P1) to G59 (P6), or are added to it in G91."""
    system = whole(block.get("P"), "P of G10")
    if not 1 <= system <= WORK_OFFSETS:
        external = "the external work offset (G10 L2 P0)"
        control.refuse_rest(f"the program sets {external if system == 0 else f'a work offset P{system} (G10 L2)'}")
        return
    first = first_parameter(system)
    before = stored(control, first)
    if control.modal.incremental and SYSTEM_NAMES[system - 1] not in control.setup.work_offsets:
        control.knowledge.work_offset(SYSTEM_NAMES[system - 1])
    for index in words_of(block):
        value = control.scale[index] * block.values[LETTERS[index]]
        value += before[index] if control.modal.incremental else 0.0
        store(control, first, index, value, LETTERS[index] in block.unknown)
    if system == control.modal.system:
        moved_while_turned(control, "G10")
        activate(control, system)
        control.places.shift(mask_of(words_of(block)))


def set_extended(control: RS274Control, block: Block) -> None:
    """L20 Pn: the words are the offset of G54.1 Pn, or are added to it in G91."""
    name = f"G54.1P{whole(block.get('P'), 'P of G10')}"
    given = dict(control.extended.get(name, control.setup.work_offsets.get(name, {})))
    if control.modal.incremental and not given:
        control.knowledge.work_offset(name)
    for index in words_of(block):
        letter = LETTERS[index]
        value = control.scale[index] * block.values[letter] / (DEGREE if control.rotary[index] else 1.0)
        given[letter] = value + (given.get(letter, 0.0) if control.modal.incremental else 0.0)
    if block.unknown:
        control.refuse_rest(f"the work offset {name} is known only at run time")
    control.extended[name] = given
    if control.modal.system == 0 and control.extended_name == name:
        moved_while_turned(control, "G10")
        extended_system(control, block)
        control.places.shift(mask_of(words_of(block)))


def set_length(control: RS274Control, block: Block) -> None:
    """L10 Pn R: the length of tool offset n; in G91 it is added."""
    number = whole(block.get("P"), "P of G10")
    if "R" not in block.values:
        control.refuse_rest("G10 L10 sets a tool with other words than R")
        return
    length = control.modal.unit * block.values["R"]
    if control.modal.incremental:
        length += control.tools.lengths.get(number, control.knowledge.tool_length(number))
    keep_length(control, number, Unknown("R", length) if "R" in block.unknown else length)


def keep_length(control: RS274Control, number: int, length: Value) -> None:
    """Store the length of a tool that the program sets, mm."""
    unknown = isinstance(length, Unknown)
    if control.tools.offset == number and (unknown or length != control.tools.vector[Z]):
        control.suspend(CHANGED, CHANGED)
    control.tools.lengths[number] = nominal(length)
    if unknown:
        control.tools.measured.add(number)


# -- reference points ------------------------------------------------------------------------------------------------


def check_reference(control: RS274Control, block: Block, code: int) -> None:
    """G27: a rapid to the words, which should be a reference point."""
    if block.axes:
        end = destination(control, block)
        control.make(Motion(MotionKind.RAPID, block.axes, end, control.modal.motion, passing=CHECKED))


def to_reference(control: RS274Control, block: Block, code: int) -> None:
    """G28: the named axes go to the reference point; if none is named, controls differ in whether all go."""
    if block.axes:
        go_to_reference(control, block, code)
        return
    unknown = control.unknown | dict.fromkeys(control.axis_indices, AFTER_ALL)
    passing = Passing(Pass.REFERENCE_POINT, REFERENCE_POINT.format("G28"))
    end = MotionEnd(control.position[:], unknown)
    control.make(Motion(MotionKind.RAPID, 0, end, control.modal.motion, passing=passing))


def to_reference_without_length(control: MacroControl, block: Block, code: int) -> None:
    """G28 of Haas, which also cancels the tool length offset."""
    go_to_reference(control, block, code)
    if control.length_code:
        control.length_code = 0
        tool_offset(control, Block(block.index, {}, frozenset(), 0), NO_LENGTH)
