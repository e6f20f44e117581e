"""Coordinate systems and their common shifts and rotations: G54 to G59.3, G10 L2 and L20, G52, G92, and G68 of ISO
controls. None of these moves the machine.

Parameters contain offsets in mm and degrees: #5221 is X of G54, 20 numbers further that of G55, #5230 its rotation.
Sources: LinuxCNC documentation, "Coordinate systems", "G10 L2", "G10 L20", and "G52", "G92", which are one shift there;
for G52 and G92 of ISO controls, which are two shifts, and for G68 and G69, the Fanuc 30i programming manual.
"""

from __future__ import annotations

from dataclasses import replace

from ncfix.control.coordinates import (
    DEGREE,
    IDENTITY,
    INDEX,
    LETTERS,
    N_LETTERS,
    PLANES,
    Rotation,
    Vector,
    X,
    Y,
    about,
    dot,
    mask_of,
    product,
    rotated,
    transposed,
)
from ncfix.control.expressions import Fault, Unknown, nominal
from ncfix.control.frames import WORLD, Affine, turned_about
from ncfix.control.moves import UnknownAxes
from ncfix.control.state import XYZ
from ncfix_iso.rs274.control import Block, RS274Control
from ncfix_iso.rs274.parameters import whole

SYSTEM_NAMES = ("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")
SHIFT = 5211
"""Parameter with the X shift of G92."""

REFERENCES = {"G28": 5161, "G30": 5181}
"""Parameters with X of the reference points."""

BAD_G10 = "NCF222"
NO_PRESET = "G92.1 without an axis, with a value other than zero, or under a tool offset is not supported"
COUNTED_ON = "from which position G92 counts in G91 depends on the control"
ON_TOP = "whether a shift (G52) in G91 is added to the one in force depends on the control"
WHOSE_SHIFT = "whether a shift (G52) of the axis {} applies to all work offsets depends on the control"
TURNED_WITH_SHIFT = "the position of {} after a rotation while G92 is active depends on the control"
TURNED = "turned"
MOVED_WHILE_TURNED = "what {} does while coordinates are rotated, mirrored or tilted depends on the control"
AFTER_TURNED = "the position of the axis {} after a shift of the origin in rotated coordinates is not known"
RUNTIME_OFFSET = "the offset of the axis {} is known only at run time"
SHIFT_ACTIVE = 5210
UNFOLLOWED = {
    160: ("polar", "polar coordinates (G16)"),
    510: ("scaling", "scaling (G51)"),
    511: ("mirror", "mirroring (G51.1)"),
    121: ("polar plane", "polar interpolation (G12.1)"),
    1120: ("polar plane", "polar interpolation (G112)"),
    682: ("tilt", "a tilted plane (G68.2)"),
    683: ("tilt", "a tilted plane (G68.3)"),
    684: ("tilt", "a tilted plane (G68.4)"),
    2680: ("feature", "a feature coordinate system (G268)"),
}
"""Codes of ISO controls that change coordinates in a way that is not followed: the mode, and its name in messages."""

ENDS = {
    150: "polar",
    500: "scaling",
    501: "mirror",
    131: "polar plane",
    1130: "polar plane",
    690: "tilt",
    2690: "feature",
}
"""Codes that end these modes."""

SAME_PLACE = 1e-6
"""mm; places that are less apart are one."""

ROTATED = "rotation"
"""Mode that suspends motions while a rotation in the plane is uncertain, until G69."""
AFTER_UNFOLLOWED = "the position of the axis {} after coordinates that are not supported is not known"


def first_parameter(system: int) -> int:
    """The parameter with X of a coordinate system, 1 for G54."""
    return 5201 + 20 * system


def load_setup(control: RS274Control) -> None:
    """Set the parameters from the setup, and bring G54 into force."""
    tables = [(control.setup.work_offsets, name, first_parameter(i)) for i, name in enumerate(SYSTEM_NAMES, 1)]
    tables += [(control.setup.references, code, first) for code, first in REFERENCES.items()]
    for table, name, first in tables:
        for letter, value in table.get(name, {}).items():
            control.parameters.assign(first + INDEX[letter], value)
    for name, value in control.setup.variables.items():
        control.parameters.assign(parameter_key(name), value)
    control.parameters.assign(5220, 1.0)
    activate(control, 1)


def parameter_key(name: str) -> int | str:
    """The number or name of a parameter as written in the setup, `#100` or `#<name>`."""
    bare = name.strip().lstrip("#")
    return int(bare) if bare.isdigit() else bare.strip("<>").replace(" ", "").lower()


def stored(control: RS274Control, first: int) -> Vector:
    """Nine parameters as a position, mm and rad."""
    values = control.parameters.numbers
    scales = (DEGREE if turning else 1.0 for turning in control.rotary)
    return [nominal(values.get(first + index, 0.0)) * scale for index, scale in enumerate(scales)]


def store(control: RS274Control, first: int, index: int, value: float, unknown: bool) -> None:
    """Store one number of a position, mm or rad, in its parameter; as a nominal value if it is unknown."""
    degrees = value / DEGREE if control.rotary[index] else value
    control.parameters.assign(first + index, Unknown("", degrees) if unknown else degrees)


def is_given(control: RS274Control, first: int, index: int) -> bool:
    """Whether a parameter of a coordinate system or reference point was given by the setup or the program."""
    return first + index in control.parameters.numbers


def words_of(block: Block) -> list[int]:
    """The letter indices of the axis words of a block."""
    return [index for index in range(N_LETTERS) if block.axes >> index & 1]


# -- selecting ---------------------------------------------------------------------------------------------------------


def moved_while_turned(control: RS274Control, what: str) -> None:
    """Refuse motions from when the origin moves in rotated, mirrored or tilted coordinates until these end.

    LinuxCNC only has rotations of the work offset itself, whose effect is known.
    """
    if not control.rules.strict and (is_turned(control) or control.tilted):
        control.suspend(TURNED, MOVED_WHILE_TURNED.format(what))


def is_turned(control: RS274Control) -> bool:
    """Whether the program has rotated or mirrored coordinates, apart from the rotation of the work offset."""
    frames = control.frames
    return not frames.plane.rotation == frames.rotation.rotation == frames.mirror.rotation == IDENTITY


def turned_back(control: RS274Control) -> None:
    """End the refusal of `moved_while_turned` if coordinates are no longer rotated; axis positions are then unknown."""
    if not (is_turned(control) or control.tilted) and control.resume(TURNED):
        control.lose(control.axis_indices, AFTER_TURNED)


def select_system(control: RS274Control, block: Block, code: int) -> None:
    """G54 to G59.3, and G54.1 Pn."""
    before = control.modal.system, control.extended_name
    take_system(control, block, code)
    if (control.modal.system, control.extended_name) != before:
        moved_while_turned(control, f"G{code / 10:g}")
        if not (control.rules.strict or control.rules.one_local):
            doubt_local(control)


def doubt_local(control: RS274Control) -> None:
    """Behind another work offset: is G52 a shift of all of them, or has each its own? Where that matters is not known.

    Sources: Fanuc has one for all; Mitsubishi M700V programming manual, "Local coordinate system setting".
    """
    local, kept = control.frames.local, control.locals.get(control.modal.system or control.extended_name, WORLD)
    unknown = {index: why for index, why in local.unknown.items() if why != WHOSE_SHIFT}
    unknown |= {i: WHOSE_SHIFT for i in control.axis_indices if local.shift[i] != kept.shift[i]}
    control.frames = replace(control.frames, local=replace(local, unknown=unknown))
    compose(control)


def take_system(control: RS274Control, block: Block, code: int) -> None:
    """Bring a work offset into force, if it differs from the present one."""
    if code == 541:
        extended_system(control, block)
        return
    system = (code - 530) // 10 if code <= 590 else code - 584
    if system != control.modal.system:
        control.parameters.assign(5220, float(system))
        activate(control, system)


def activate(control: RS274Control, system: int) -> None:
    """Bring a coordinate system's offset and rotation into force."""
    control.modal.system = system
    turn, frames = turn_of(control, system), control.frames
    if turn != frames.datum.rotation and (any(frames.additive.shift[:2]) or any(frames.local.shift[:2])):
        control.lose((X, Y), TURNED_WITH_SHIFT)
    control.offset_checked = False
    origin = tuple(stored(control, first_parameter(system)))
    control.frames = replace(frames, datum=Affine(origin, turn, unknown=frames.datum.unknown))
    compose(control)


def turn_of(control: RS274Control, system: int) -> Rotation:
    """The rotation of a coordinate system (G10 R)."""
    angle = nominal(control.parameters.numbers.get(first_parameter(system) + 9, 0.0))
    return about(PLANES[170], angle) if angle else IDENTITY


def compose(control: RS274Control) -> None:
    """Bring frames into force, and record axes whose work offset or G92 shift is known only at run time."""
    frames = control.frames
    if not control.probes_nominally:
        is_unknown, first = control.parameters.is_unknown, first_parameter(control.modal.system)
        unknown = {index for index in control.axis_indices if is_unknown(first + index) or is_unknown(SHIFT + index)}
        own = frames.local.unknown.keys()
        if frames.datum.rotation is not IDENTITY and ((unknown | own) & {X, Y} or is_unknown(first + 9)):
            unknown |= {X, Y} & {*control.axis_indices}
        datum = replace(frames.datum, unknown=dict.fromkeys(sorted(unknown), RUNTIME_OFFSET))
        control.frames = replace(frames, datum=datum)
    control.refresh()


def extended_system(control: RS274Control, block: Block) -> None:
    """G54.1 Pn: an additional work offset, `G54.1P1` in the setup."""
    name = f"G54.1P{whole(block.get('P', 1.0), 'P of G54.1')}"
    given = control.extended.get(name, control.setup.work_offsets.get(name))
    control.extended_name = name
    if given is None:
        control.knowledge.work_offset(name)
    values = ((given or {}).get(letter, 0.0) for letter in LETTERS)
    origin = tuple(value * DEGREE if turning else value for value, turning in zip(values, control.rotary, strict=True))
    control.modal.system = 0
    control.offset_checked = True
    control.frames = replace(control.frames, datum=Affine(origin, unknown=control.frames.datum.unknown))
    compose(control)


# -- what has to be given ----------------------------------------------------------------------------------------------


def check_system(control: RS274Control) -> None:
    """Require that the coordinate system in force is given, because it is used; record it as missing if not."""
    control.offset_checked = True
    name = SYSTEM_NAMES[control.modal.system - 1]
    first = first_parameter(control.modal.system)
    if name not in control.setup.work_offsets and not all(is_given(control, first, i) for i in control.axis_indices):
        control.knowledge.work_offset(name)


def before_persistent(control: RS274Control, number: int) -> None:
    """Before a parameter from 5161 to 5390 is read: record it as missing if the setup should give it and does not."""
    if number in control.parameters.numbers:
        return
    system, axis = divmod(number - 5221, 20)
    if 0 <= system < len(SYSTEM_NAMES) and axis < N_LETTERS:
        if SYSTEM_NAMES[system] not in control.setup.work_offsets:
            control.knowledge.work_offset(SYSTEM_NAMES[system])
    elif number < 5190:
        code = "G28" if number < REFERENCES["G30"] else "G30"
        if code not in control.setup.references:
            control.knowledge.reference_point(code)


# -- setting -----------------------------------------------------------------------------------------------------------


def set_system(control: RS274Control, block: Block, *, at_position: bool) -> None:
    """G10 L2 and L20: the axis words are the new offset, or the coordinates that the present position gets."""
    system = whole(block.get("P"), "P of G10") or control.modal.system
    if not 1 <= system <= len(SYSTEM_NAMES):
        raise Fault(BAD_G10, f"there is no work offset P{system}", f"P is 0 to {len(SYSTEM_NAMES)}")
    first = first_parameter(system)
    if "R" in block.values:
        if at_position:
            raise Fault(BAD_G10, "R is not allowed with G10 L20")
        control.parameters.assign(first + 9, block.value("R"))
    origin = stored(control, first)
    if at_position:
        origin, doubtful = origin_for_position(control, block, system, origin)
    else:
        doubtful = {}
        for index in words_of(block):
            origin[index] = control.scale[index] * block.values[LETTERS[index]]
    for index, value in enumerate(origin):
        if value != stored(control, first)[index] or block.axes >> index & 1:
            store(control, first, index, value, index in doubtful or LETTERS[index] in block.unknown)
    if system == control.modal.system:
        moved_while_turned(control, "G10")
        activate(control, system)
        control.places.shift(mask_of(words_of(block)) | (mask_of((X, Y)) if "R" in block.values else 0))


def origin_for_position(control: RS274Control, block: Block, system: int, origin: Vector) -> tuple[Vector, UnknownAxes]:
    """The origin with which the present position has the words' coordinates, and reasons where it is uncertain."""
    turn = turn_of(control, system)
    involved = {*words_of(block), *((X, Y) if turn is not IDENTITY and block.axes & 3 else ())}
    control.use_start_positions(tuple(involved))
    outer = [p - o - t for p, o, t in zip(control.position, origin, control.tool_shift, strict=True)]
    shifts = zip(control.frames.additive.shift, control.frames.local.shift, strict=True)
    now = [a - s - local for a, (s, local) in zip(rotated(transposed(turn), outer), shifts, strict=True)]
    wanted = now[:]
    for index in words_of(block):
        wanted[index] = control.scale[index] * block.values[LETTERS[index]]
    moved = rotated(turn, [a - b for a, b in zip(now, wanted, strict=True)])
    doubtful = {index: why for index, why in control.unknown.items() if index in involved}
    return [a + b for a, b in zip(origin, moved, strict=True)], doubtful


# -- shifts and rotations of all of them -------------------------------------------------------------------------------


LOCAL, BY_POSITION, CANCELLED, RESTORED = 520, 920, 921, 923
"""G52, G92, G92.1 and G92.3."""


def shift_system(control: RS274Control, block: Block, code: int) -> None:
    """G52 and G92: shift all coordinate systems, by the words, or so that the position gets their values."""
    linuxcnc = control.rules.strict
    if code == CANCELLED and block.axes and not linuxcnc:
        preset_system(control, block, code)
        return
    if code not in (LOCAL, BY_POSITION):
        take_shift(control, code)
        return
    if not block.axes:
        if linuxcnc:
            raise Fault("NCF221", f"G{code // 10} needs an axis word")
        return
    if not linuxcnc:
        moved_while_turned(control, f"G{code // 10}")
        if control.modal.incremental and code == BY_POSITION:
            control.refuse_rest(COUNTED_ON)
        elif code == LOCAL and control.modal.incremental:
            local = control.frames.local
            if any(local.shift[i] or i in local.unknown for i in words_of(block)):
                control.refuse_rest(ON_TOP)
        set_local(control, block, cancelled=code == BY_POSITION)
        if code == LOCAL:
            return
    set_shift(control, block, from_position=code == BY_POSITION)
    control.parameters.assign(SHIFT_ACTIVE, 1.0)
    compose(control)
    named = mask_of(words_of(block))
    if code == BY_POSITION:
        control.places.place(named)
    else:
        control.places.shift(named)


def take_shift(control: RS274Control, code: int) -> None:
    """G92.1 and G92.2 (which keeps the shift for G92.3) switch the shift off; G92.3 switches it on again."""
    moved_while_turned(control, "G92")
    again = code == RESTORED
    before, doubtful = control.frames.additive.shift, {*control.composed.unknown}
    control.frames = replace(control.frames, additive=Affine(tuple(stored(control, SHIFT))) if again else WORLD)
    if code == CANCELLED:
        for index in range(N_LETTERS):
            store(control, SHIFT, index, 0.0, unknown=False)
    control.parameters.assign(SHIFT_ACTIVE, float(again))
    compose(control)
    after, doubtful = control.frames.additive.shift, doubtful | {*control.composed.unknown}
    control.places.shift(mask_of(i for i in control.axis_indices if before[i] != after[i] or i in doubtful))


def preset_system(control: RS274Control, block: Block, code: int) -> None:
    """G92.1 X0 of ISO controls: cancel the shifts (G52, G92) along the axes named."""
    named, offset = words_of(block), any(control.tools.vector) or control.modal.compensated
    if not named or offset or block.unknown or any(block.values[LETTERS[index]] for index in named):
        control.refuse_rest(NO_PRESET)
        return
    moved_while_turned(control, "G92.1")
    additive, local = control.frames.additive, control.frames.local
    for index in named:
        store(control, SHIFT, index, 0.0, unknown=False)
    control.frames = replace(
        control.frames,
        additive=Affine(tuple(0.0 if index in named else step for index, step in enumerate(additive.shift))),
        local=Affine(
            tuple(0.0 if index in named else step for index, step in enumerate(local.shift)),
            unknown={index: why for index, why in local.unknown.items() if index not in named},
        ),
    )
    compose(control)
    control.places.shift(mask_of(named))


def set_local(control: RS274Control, block: Block, *, cancelled: bool) -> None:
    """G52 of ISO controls, which is separate from the shift of G92; G92 cancels it along the axes that it names."""
    local, unknown = [*control.frames.local.shift], dict(control.frames.local.unknown)
    for index in words_of(block):
        local[index] = 0.0 if cancelled else control.scale[index] * block.values[LETTERS[index]]
        unknown.pop(index, None)
        at_run_time = LETTERS[index] in block.unknown and not cancelled and not control.probes_nominally
        if at_run_time and index in control.axis_indices:
            unknown[index] = RUNTIME_OFFSET
    local_frame = Affine(tuple(local), unknown=unknown)
    control.locals[control.modal.system or control.extended_name] = local_frame
    control.frames = replace(control.frames, local=local_frame)
    compose(control)


def set_shift(control: RS274Control, block: Block, *, from_position: bool) -> None:
    """Set the shift asked for by the words."""
    shift = [*control.frames.additive.shift]
    if from_position:
        control.use_start_positions(tuple(control.unknown) if control.is_rotated else words_of(block))
    position = control.program_position()
    doubtful = {*control.unknown, *control.composed.unknown} if from_position else set()
    for index in words_of(block):
        value = control.scale[index] * block.values[LETTERS[index]]
        shift[index] = position[index] + shift[index] - value if from_position else value
        store(control, SHIFT, index, shift[index], index in doubtful or LETTERS[index] in block.unknown)
    control.frames = replace(control.frames, additive=Affine(tuple(shift)))


def rotate_system(control: RS274Control, block: Block, code: int) -> None:
    """G68 X Y R rotates the coordinates of the plane about a point; G69 ends it."""
    before = control.frames.rotation.rotation
    if code == 680 and (why := uncertain(control, block)):
        control.suspend(ROTATED, why)
        return
    control.frames = replace(control.frames, rotation=WORLD)
    if code == 680:
        turn_about_point(control, block, before if control.modal.incremental else IDENTITY)
    else:
        unfollowed(control, block, code)
        if control.resume(ROTATED):
            control.lose(XYZ, AFTER_UNFOLLOWED)
    if control.frames.rotation.rotation != before:
        control.unnamed = frozenset(control.modal.plane.pair)
    turned_back(control)
    control.refresh()
    control.places.shift(mask_of(control.unnamed))


def uncertain(control: RS274Control, block: Block) -> str:
    """Why a rotation (G68) is uncertain; empty if it is not."""
    if "R" not in block.values:
        return "the angle of the rotation (G68) is not in the program"
    centred = any(LETTERS[index] in block.values for index in control.modal.plane.pair)
    again = control.frames.rotation.rotation != IDENTITY and not control.rules.adds_rotations
    if control.modal.incremental and (centred or again):
        return "from which position the words of a rotation (G68) count in G91 depends on the control"
    pair = control.modal.plane.pair
    about_here = [index for index in pair if LETTERS[index] not in block.values]
    control.use_start_positions(about_here)
    if block.unknown or control.unknown.keys() & {*pair}:
        return "the centre or angle of a rotation (G68) is known only at run time"
    here, turned = control.program_position(), control.frames.rotation
    before = [turned.shift[index] + dot(turned.rotation[index], here[:3]) for index in about_here]
    if any(abs(place - here[index]) > SAME_PLACE for place, index in zip(before, about_here, strict=True)):
        return "the centre of a rotation (G68) without centre words, while another rotation is in force, is not certain"
    return ""


def turn_about_point(control: RS274Control, block: Block, before: Rotation) -> None:
    """Bring a rotation by R about the point in the words into force, after the rotation `before`."""
    plane = control.modal.plane
    centre = control.program_position()
    for index in plane.pair:
        letter = LETTERS[index]
        if letter in block.values:
            step = centre[index] if control.modal.incremental else 0.0
            centre[index] = control.scale[index] * block.values[letter] + step
    turned = turned_about(product(before, about(plane, block.get("R"))), centre)
    control.frames = replace(control.frames, rotation=turned)


def unfollowed(control: RS274Control, block: Block, code: int) -> None:
    """Scaling, mirroring, polar coordinates and tilted planes: motions are refused while they are in force."""
    if code in UNFOLLOWED:
        alone = not block.axes and not block.values.keys() & {"I", "J", "K", "P"}
        if code == 510 and alone and control.rules.din_units:
            return  # in DIN/ISO of a TNC the next tool; elsewhere by a factor of the control
        key, words = UNFOLLOWED[code]
        control.suspend(key, f"{words} is in force, which ncfix does not support")
    elif control.resume(ENDS[code]):
        control.lose(control.axis_indices, AFTER_UNFOLLOWED)
