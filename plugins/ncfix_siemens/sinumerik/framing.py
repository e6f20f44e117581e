"""Frames, planes, units, feeds and tools: settings of a block that take effect before its motion.

Source: Siemens, "SINUMERIK 840D sl, NC programming": frames, CYCLE800, tool offsets.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ncfix.control.coordinates import INCH, INDEX, LETTERS, PLANES, Vector, mask_of, zeros
from ncfix.control.expressions import Unknown
from ncfix.control.frames import WORLD, ZEROS, Affine, mirrored, shifted, turned, turned_in
from ncfix_siemens.sinumerik.state import NO_SYSTEM, RESET_OF_DIAMETER, Sinumerik
from ncfix_siemens.sinumerik.vocabulary import BlockWordValues

FRAME_AT_RUNTIME = "a frame ({}) is known only at run time"
UNEQUAL = "a scale that differs from axis to axis ({})"
ROTARY_FRAME = "a {} of a rotary axis"
WHO_CHANGES = (
    "whether T alone changes the tool is not certain: after an earlier T the program calls a name that ncfix does not "
    "know"
)
UNSAID = (
    "whether X is a radius or a diameter is not given in a turning program (G96): program DIAMOF or DIAMON, or set "
    f'variables."{RESET_OF_DIAMETER}" = 1 or 2 in the setup file'
)
DIAMETER_SHIFT = (
    "a shift of X while X is a diameter ({}) is in force: machine data decide whether it is a radius or a diameter"
)
MIXED_SHIFTS = "G{} after a shift (ATRANS) in a rotated or scaled frame is in force"
FINE_STAYS = "{} after G59: whether the shift of G59 stays in force is not certain"
AFTER_UNFOLLOWED = "the position of the axis {} after coordinates that are not supported is not known"
CARRIED = "NCF255"
MEASURED = "NCF259"
INCH_MACHINE = "$mn_scaling_system_is_metric"
"""Machine data 10240: 0, the machine counts in inches. So do its feeds under G70 and G71, whatever these say."""
BASIC = "NCF282"
ADDED = (
    "the setup gives G500 an offset, which the control adds to {0} if it is a basic offset; ncfix uses {0} without it"
)
LIKE_IT = "give approximately the offset that the probe finds: tenths of a millimetre have little effect"
LENGTH_ACROSS = "$sc_tool_length_const"
PLANE_LENGTH = (
    "in this plane the control adds the tool length along another axis, unless $SC_TOOL_LENGTH_CONST is 17: "
    'variables."$SC_TOOL_LENGTH_CONST" in the setup file'
)


# -- programmable frames ----------------------------------------------------------------------------------------------


def programmable(control: Sinumerik, name: str, words: BlockWordValues) -> None:
    """Execute TRANS, ROT, SCALE, MIRROR, and their additive forms ATRANS, AROT, ASCALE, AMIRROR.

    A form without A replaces the whole programmable frame. So a frame known only at run time matters until the next one
    without A.
    """
    kind = name.removeprefix("a") if name.startswith("a") else name
    if any(value is None for value in words.values.values()):
        control.suspend("frame", FRAME_AT_RUNTIME.format(name.upper()))
        return
    frame, fault = FRAMES[kind](control, words)
    if fault:
        control.suspend("frame", fault)
    elif name == kind:
        control.resume("frame")
    modes = control.modes
    before = control.frames.programmable if name != kind else WORLD
    if name == kind:
        if modes.fine and axis_values(words):  # sources disagree on whether the shift of G59 stays
            control.suspend("frame", FINE_STAYS.format(name.upper()))
        modes.added, modes.fine = ZEROS, False
    elif name == "atrans":
        plain = modes.added is not None and before.rotation == WORLD.rotation and before.scale == 1.0
        modes.added = Affine(modes.added or ZEROS).then(frame).shift if plain else None
    control.frames = replace(control.frames, programmable=before.then(frame))
    control.refresh()


def translation(control: Sinumerik, words: BlockWordValues) -> tuple[Affine, str]:
    """The frame of TRANS, and why it is doubtful ("" if it is not)."""
    steps = {INDEX[letter]: value for letter, value in axis_values(words).items()}
    doubtful = DIAMETER_SHIFT.format(control.modes.diameter) if control.modal.diameter and steps.get(0) else ""
    return shifted({index: value * unit(control, index) for index, value in steps.items()}), doubtful


def rotation(control: Sinumerik, words: BlockWordValues) -> tuple[Affine, str]:
    """The frame of ROT X Y Z, or ROT RPL in the plane."""
    if "RPL" in words.values:
        return turned_in(control.modal.plane, words.get("RPL")), ""
    return turned(axis_values(words)), ""


def scaling(control: Sinumerik, words: BlockWordValues) -> tuple[Affine, str]:
    """The frame of SCALE; only one factor for all three axes is followed."""
    factors = axis_values(words)
    plain = {letter: factor for letter, factor in factors.items() if factor != 1.0}
    if not plain:
        return WORLD, ""
    if set(plain) >= {"X", "Y", "Z"} and len(set(plain.values())) == 1 and len(plain) == 3:
        return Affine(scale=plain["X"]), ""
    return WORLD, UNEQUAL.format("SCALE") + " is in force, which ncfix does not support"


def mirroring(control: Sinumerik, words: BlockWordValues) -> tuple[Affine, str]:
    """The frame of MIRROR, which reverses the named axes."""
    letters = "".join(axis_values(words))
    if set(letters) - set("XYZ"):
        return WORLD, ROTARY_FRAME.format("mirroring (MIRROR)") + " is in force, which ncfix does not support"
    return Affine(rotation=mirrored(letters)), ""


def by_solid_angles(control: Sinumerik, words: BlockWordValues) -> tuple[Affine, str]:
    """ROTS: not followed."""
    return WORLD, "a frame by solid angles (ROTS) is in force, which ncfix does not support"


FRAMES: dict[str, Callable[[Sinumerik, BlockWordValues], tuple[Affine, str]]] = {
    "trans": translation,
    "rot": rotation,
    "rots": by_solid_angles,
    "scale": scaling,
    "mirror": mirroring,
}
PROGRAMMABLE = frozenset(FRAMES) | {"a" + name for name in FRAMES}


def axis_values(words: BlockWordValues) -> dict[str, float]:
    """The axis words of a block."""
    return {letter: value for letter, value in words.values.items() if letter in INDEX and value is not None}


def unit(control: Sinumerik, index: int) -> float:
    """mm or rad per unit of a shift; a shift of X counts as a radius."""
    return control.of_setup(LETTERS[index]) * (1.0 if control.rotary[index] else control.modal.unit)


def programmed_shift(control: Sinumerik, words: BlockWordValues, code: int) -> None:
    """G58 (code 580) and G59 (590): replace the absolute or the additive part of the programmable shift."""
    values = {INDEX[letter]: value * unit(control, INDEX[letter]) for letter, value in axis_values(words).items()}
    if any(value is None for value in words.values.values()):
        control.refuse_rest(FRAME_AT_RUNTIME.format(f"G{code // 10}"))
        return
    frame, added = control.frames.programmable, control.modes.added
    if added is None:
        control.suspend("frame", MIXED_SHIFTS.format(code // 10))
        return
    if code == 590:
        control.modes.added = Affine(added).shifted_to(values).shift
        values = {index: frame.shift[index] - added[index] + value for index, value in values.items()}
        control.modes.fine = True
    else:
        values = {index: value + added[index] for index, value in values.items()}
    control.frames = replace(control.frames, programmable=frame.shifted_to(values))
    control.refresh()


# -- codes ------------------------------------------------------------------------------------------------------------


def plane(control: Sinumerik, code: int) -> None:
    """G17, G18, G19: choose the working plane, and put the tool length along the axis across it."""
    if PLANES[code] is not control.modal.plane:
        control.modes.pole, control.modes.polar, control.modes.in_plane = None, (None, None), False
    control.modal.plane = PLANES[code]
    set_length(control)


def units(control: Sinumerik, code: int) -> None:
    """G70, G71, G700, G710: inches or mm. With G70 and G71 feeds stay in the machine's unit, see `INCH_MACHINE`."""
    unit = INCH if code in (700, 7000) else 1.0
    basic = INCH if control.variables.value(INCH_MACHINE) == 0.0 else 1.0
    control.set_unit(unit, basic if code in (700, 710) else unit)


def settable(control: Sinumerik, code: int) -> None:
    """G54 to G57 and G505 to G599 select a settable frame; G500 deselects it."""
    name = f"G{code // 10}"
    control.modes.carried = ""
    if control.resume("measured"):
        control.warn(MEASURED, f"{name} after measuring: ncfix uses the offset of the setup", LIKE_IT)
    if name != NO_SYSTEM and any(control.setup.work_offsets.get(NO_SYSTEM, {}).values()):
        control.warn(
            BASIC,
            ADDED.format(name),
            f"give the whole offset for {name}, and for G500 the offset that is in force without it",
        )
    control.select(name)


def mind_carried(control: Sinumerik) -> None:
    """At the first motion after TRAORI or TRAFOOF, warn (NCF255) if the work offset was not programmed again."""
    frames, name = control.frames, control.modes.carried
    control.modes.carried = ""
    if name and any(frames.datum.shift):
        text = (
            f"{name}: ncfix assumes that {frames.name} stays in force; if machine data cancel it, all positions are "
            "wrong"
        )
        control.warn(CARRIED, text, f"program {frames.name} again after {name}")


def feed_mode(control: Sinumerik, code: int) -> None:
    """G93, G94, G95; and G96, G961, G97, G971, which imply feed per revolution or minute (G962 keeps the mode)."""
    now = control.modal.feed_mode
    mode = {960: 95, 970: 95, 9610: 94, 9620: now, 9710: 94}.get(code, code // 10)
    if mode != now:
        control.modal.feed, control.modal.feed_given = float("nan"), False
    control.modal.feed_mode = mode
    if code in (960, 9610, 9620) and not control.modes.said:
        control.suspend("diameter", UNSAID)


def path_mode(control: Sinumerik, code: int) -> None:
    """G60 sets exact stop; G64 and G641 to G645 clear it."""
    control.modal.exact_stop = code == 600


def compensation(control: Sinumerik, code: int) -> None:
    """G40, G41, G42: radius compensation off, left, right."""
    if code == 400:
        control.end_compensation()
    else:
        control.modal.compensated = code // 10


# -- tools ------------------------------------------------------------------------------------------------------------


def tool(control: Sinumerik, words: BlockWordValues, change: bool, at_once: bool) -> None:
    """Execute T, D and M6. change: M6 is in the block; at_once: the program has no M6, so T itself changes the tool."""
    called, edge = "T" in words.values or "T" in words.texts, "D" in words.values
    if called and not call_tool(control, words):
        return
    if at_once and control.changed_by_cycle and not change and not edge:
        control.suspend("tool", WHO_CHANGES)
        return
    if change or (at_once and called):
        into_spindle(control)
    if edge and not choose_edge(control, words):
        return
    if change or at_once or edge:
        control.at_start = False
        set_length(control)


def call_tool(control: Sinumerik, words: BlockWordValues) -> bool:
    """Execute T, which selects the next tool; False if it is known only at run time."""
    control.fresh_tool = True
    name, value = words.texts.get("T"), words.values.get("T")
    if name is None and value is None:
        control.refuse_rest("the tool (T) is known only at run time")
        return False
    control.tools.select(control.named.number(name) if name is not None else round(value or 0.0))
    return True


def choose_edge(control: Sinumerik, words: BlockWordValues) -> bool:
    """Execute D, which selects the cutting edge; False if it is known only at run time."""
    value = words.values["D"]
    if value is None:
        control.refuse_rest("the cutting edge (D) is known only at run time")
        return False
    control.edge = round(value)
    return True


def into_spindle(control: Sinumerik) -> None:
    """Change to the selected tool, with its edge D1."""
    control.resume("tool")
    control.tools.change()
    control.edge = 1
    control.places.lose(mask_of(control.axis_indices))


def take_up(control: Sinumerik) -> None:
    """At a motion before any tool or edge was called: take the tool in the spindle, with its edge D1, into force."""
    if not control.at_start:
        return
    control.at_start = False
    vector: Vector = zeros()
    vector[2] = control.knowledge.tool_length(0)
    control.tools.offset = 0
    before = control.footing
    control.switch_tcp(vector)
    now = zip(control.counted, before, control.footing, strict=True)
    control.counted = [new if counted == old else counted for counted, old, new in now]


def set_length(control: Sinumerik) -> None:
    """Take the length of the active tool into force, across the plane; the axes stay, the program position changes."""
    if control.at_start:
        return
    number, edge = control.tools.spindle, control.edge
    length = control.length_of(number, edge) if edge and number else 0.0
    vector: Vector = zeros()
    across = control.modal.plane.across
    constant = control.variables.value(LENGTH_ACROSS)
    control.resume("length")
    if across == 2 or constant == 17.0:
        vector[2] = length
    elif length and isinstance(constant, Unknown):
        control.suspend("length", PLANE_LENGTH)
    else:
        vector[across] = length
    control.tools.offset = number if edge and number else None
    control.switch_tcp(vector)
