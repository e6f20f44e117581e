"""Tilted working planes (G68.2 begins one, G53.1 turns the tool square to it, G69 ends it), and tool vectors (G43.5).

In a tilted plane, X Y Z are those of the tool tip in a frame fixed to the workpiece, to which the tool stands square.
The control computes the linear axes from the tip; while the program turns rotary axes they stand still, unless G43.4 is
in force.

The dynamic work offset of Haas (G254, G255) turns the work offset with the tables, by their present angles. X Y Z are
then those of the tip along the machine's axes, from the turned origin of the workpiece. That is the frame of a tilted
plane to which the tool is already square.

The vector I J K of G43.5 points from the tip to the spindle, in the coordinates of the program, and may have any
length. A component that is not written is zero; a block without any keeps the direction. Parameters of the control
decide which of two ways the rotary axes take; here it is the nearest.
Sources: Fanuc 30i operator's manual (machining centre), "Tilted working plane indexing"; Fanuc, "Tool center point
control for 5-axis machining" (A-79348E), type 2; Mazak, "Inclined-plane machining" (roll, pitch and yaw). Haas,
"Next Generation Control, mill operator's manual". That the first of three points is the origin, and that the block Q0
shifts it from there, is taken from descriptions in programs for these controls.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ncfix.control.coordinates import (
    DEGREE,
    LETTERS,
    PLANES,
    Rotation,
    Vector,
    X,
    Y,
    Z,
    about,
    angles_in_words,
    dot,
    mask_of,
    product,
)
from ncfix.control.expressions import Fault
from ncfix.control.frames import WORLD, euler, from_points, from_vectors, shifted, spatial
from ncfix.control.moves import Motion, MotionEnd, MotionKind, Pass, Passing, TcpState
from ncfix.control.pointing import Triple
from ncfix.control.posture import Postures, WayRules, normal_of
from ncfix.control.tcp import switch
from ncfix_fanuc.macro.control import COMPONENTS, MacroControl
from ncfix_iso.rs274.control import Block
from ncfix_iso.rs274.motion import words_destination
from ncfix_iso.rs274.parameters import whole
from ncfix_iso.rs274.systems import ENDS, rotate_system, turned_back, unfollowed

STRAIGHT, ARCS = (0, 10), (20, 30)
SPATIAL = (X, Y, Z)
BAD_VECTOR = "NCF219"
INCLINED = "Q of G43.5 inclines the tool from its vector, which ncfix does not support"
BY_AXES = "a rotary axis is programmed while I J K give the tool direction (G43.5)"
ON_ARC = "an arc or a cycle is programmed while I J K give the tool direction (G43.5)"
AT_RUNTIME = "the tool direction (I J K) is known only at run time"
NO_KINEMATICS = "the tool direction (I J K) needs the kinematics of a machine with two rotary axes"
FROM_UNKNOWN = "the positions of the rotary axes before the tool turns (I J K) are not known"
AFTER_VECTOR = "the position of the axis {} after a tool direction that is not supported is not known"
CHOICE = "if the control turns the other way, program the direction in smaller steps or use G43.4"


def directed(control: MacroControl, block: Block, motion: int) -> str:
    """Add the rotary words to a block that its vector means. Returns why its motion is refused; "" if it is not."""
    axes = control.turning
    if any(block.axes >> index & 1 for index in axes):
        return BY_AXES
    given = block.values.keys() & {*COMPONENTS}
    if motion in ARCS or (given and motion not in STRAIGHT):
        return ON_ARC
    if not given:
        return ""
    if block.unknown & set(COMPONENTS):
        return AT_RUNTIME
    if control.posture.pointing is None:
        return NO_KINEMATICS
    control.use_start_positions(axes)
    if control.unknown.keys() & set(axes):
        return FROM_UNKNOWN
    found = control.postures(wanted(control, block), WayRules(in_travel=True))
    if found is None or not found.ways:
        raise Fault(BAD_VECTOR, "the rotary axes cannot turn the tool to this direction (I J K)")
    note_choice(control, found)
    for index, angle in found.chosen.items():
        block.values[LETTERS[index]] = (angle - control.offset[index]) / DEGREE
        block.axes |= 1 << index
    control.points = True
    if found.is_close:
        control.builder.keeps_direction()
    control.whole |= motion != 0 and found.strays
    return ""


def wanted(control: MacroControl, block: Block) -> list[float]:
    """The vector of a block as a unit vector in the workpiece; raises `Fault` if it has no length."""
    turned = np.array([dot(row, [block.get(letter) for letter in COMPONENTS]) for row in control.rotation])
    size = float(np.linalg.norm(turned))
    if size == 0.0:
        raise Fault(BAD_VECTOR, "the tool direction (I J K) is a vector of length zero")
    return [float(part) for part in turned / size]


def note_choice(control: MacroControl, found: Postures) -> None:
    """Warn which way was taken if another one is equally possible, or a control may take another as the nearest."""
    if len(found.ways) < 2 or found.at_pole:
        return
    here, (first, second) = found.here, found.ways
    by_one_axis = any(abs(second[k] - here[k]) < abs(first[k] - here[k]) for k in (0, 1))
    if found.leaves_pole or by_one_axis:
        control.warn(TURNED_TO, f"G43.5: ncfix assumes {found}, the nearest of several positions", CHOICE)


TILT, CANCEL = 682, 690
EULER, ROLL_PITCH_YAW, POINTS, VECTORS = range(4)
ORDER = 123
"""X, Y, Z: the order of the turns of G68.2 P1, if its Q does not name another."""

LAST = {POINTS: 3, VECTORS: 2}
"""Q of the last of the blocks that together say how the plane lies."""

DEFINING = "the blocks that define the tilted plane (G68.2) are not complete"
BAD_PLANE = "NCF221"
LEAST = 1e-6
"""Least length of vectors, and least sine of the angle between them, that define a plane."""

NEARLY_SQUARE = 2e-3
"""Largest deviation from a right angle, rad, of two vectors that are written with three decimals."""

NOT_SOLVED = "the position of the axis {} after the turn of the tool normal to the plane is not known"
WAY_BY_P = "in which direction P of {} turns the axis {} depends on the control: program the rotary axes after it"
TURNED_TO = "NCF243"
SQUARED = "parameters of the control decide; if it uses other positions, program the rotary axes"
ALIGNMENTS = {
    code: Passing(Pass.ALIGNMENT, f"tool axis alignment ({name})") for code, name in ((531, "G53.1"), (536, "G53.6"))
}
ABOUT_TIP = 536
ROTARY_ALONE = Passing(
    Pass.ROTARY_ALONE, "rotary axes are positioned in a tilted plane; the tool tip is corrected in the next motion"
)
NO_TURN = 1e-9
"""rad; an axis that is told to go where it stands does not turn."""
MIXED = "rotary and linear axes move together in a tilted plane without tool-centre-point control (G43.4)"
AFTER_MIXED = (
    "the position of the axis {} after rotary and other axes have moved together in a tilted plane is not known"
)
ASKEW = "the program has turned rotary axes in a tilted plane, and the tool is not normal to it"
DYNAMIC_ON, DYNAMIC_OFF = 2540, 2550
DYNAMIC = "dynamic work offset"
OFFSET_NOT_SOLVED = (
    "G254 with table positions that are not known, or together with other transformations, is not supported"
)
TABLES_MOVED = "a rotary axis moves while G254 is in force, which depends on the table positions at its start"


def tilt(control: MacroControl, block: Block, code: int) -> None:
    """G68.2: begin a frame at X Y Z, turned as its P says; forms that are not followed are refused."""
    form = whole(block.get("P", EULER), "P of G68.2")
    if control.mirrored or code != TILT or not is_followed(block, form):
        unfollowed(control, block, code)
        return
    if block.unknown:
        control.suspend(ENDS[CANCEL], "the tilted plane (G68.2) is known only at run time")
        return
    if form in LAST:
        define(control, block, form)
        return
    angles = block.get("I"), block.get("J"), block.get("K")
    if form == EULER:
        begin(control, euler(*angles), block)
    else:
        order = "".join("XYZ"[int(axis) - 1] for axis in order_of(block))
        begin(control, spatial(dict(zip("XYZ", angles, strict=True)), order), block)


def is_followed(block: Block, form: int) -> bool:
    """Whether a block defines the plane in a form whose meaning is certain."""
    number, turned = whole(block.get("Q", -1.0), "Q of G68.2"), bool(block.get("R"))
    if form == POINTS:
        shifted = any(block.get(letter) for letter in "XYZ")
        return not shifted if number == 0 else number in (1, 2, 3) and {"X", "Y", "Z"} <= block.values.keys()
    if form == VECTORS:
        return number in (1, 2) and not turned and not block.values.keys().isdisjoint("IJK")
    in_known_order = form == EULER or (form == ROLL_PITCH_YAW and sorted(order_of(block)) == ["1", "2", "3"])
    return in_known_order and not turned


def order_of(block: Block) -> str:
    """The order of the turns, "123"."""
    return str(whole(block.get("Q", ORDER), "Q of G68.2"))


def define(control: MacroControl, block: Block, form: int) -> None:
    """Apply one of the blocks that define a plane: three points (Q1 to Q3, turned by R of Q0), or vectors (Q1, Q2)."""
    number = whole(block.get("Q"), "Q of G68.2")
    if form != control.defining or number == 0 or number in control.definition:
        control.defining, control.definition = form, {}
    control.definition[number] = block
    given = control.definition
    if not {*range(1, LAST[form] + 1)} <= given.keys():
        control.suspend(DEFINING, DEFINING)
        return
    control.definition = {}
    control.resume(DEFINING)
    if form == POINTS:
        first, second, third = (components(given[number], "XYZ") for number in (1, 2, 3))
        plane = from_points(first, second, third, LEAST)
        turn = given[0].get("R") if 0 in given else 0.0
    else:
        x, z = (components(given[number], "IJK") for number in (1, 2))
        if abs(dot(x, z)) > NEARLY_SQUARE * math.hypot(*x) * math.hypot(*z):
            unfollowed(control, block, TILT)
            return
        plane, turn = from_vectors(x, z, LEAST), 0.0
    if plane is None:
        raise Fault(BAD_PLANE, "the points or vectors do not define the tilted plane (G68.2)")
    begin(control, product(plane, about(PLANES[170], turn)), given[1])


def components(block: Block, letters: str) -> Triple:
    """Three words of a block."""
    x, y, z = (block.get(letter) for letter in letters)
    return x, y, z


def begin(control: MacroControl, rotation: Rotation, origin: Block) -> None:
    """Begin the tilted plane whose origin a block names."""
    end(control)
    feature = shifted({index: control.modal.unit * origin.get(LETTERS[index]) for index in (X, Y, Z)})
    control.frames = replace(control.frames, plane=replace(feature, rotation=rotation), rotation=WORLD)
    control.tilted, control.frame_unknown = True, None
    switch(control, control.tools.vector, True, control.tools.offset)
    control.refresh()


def rotate(control: MacroControl, block: Block, code: int) -> None:
    """G68 and G69. G68 with I J K (a rotation in space), and any in mirrored coordinates, is not followed."""
    if control.mirrored:
        unfollowed(control, block, CANCEL if code == CANCEL else TILT)
        return
    if code == CANCEL:
        control.definition = {}
        control.resume(DEFINING)
        end(control)
    elif block.values.keys() & {"I", "J", "K"}:
        unfollowed(control, block, TILT)
        return
    rotate_system(control, block, code)


def end(control: MacroControl) -> None:
    """End the tilted plane, if there is one."""
    if not control.tilted:
        return
    control.resume(ASKEW)
    control.tilted, control.frame_unknown = False, None
    control.frames = replace(control.frames, plane=WORLD, rotation=WORLD)
    on = control.setup.tcp or control.tip_control
    switch(control, control.tools.vector, on, control.tools.offset)
    turned_back(control)
    control.refresh()


# -- G53.1, G53.6 ------------------------------------------------------------------------------------------------------


def align(control: MacroControl, block: Block, code: int) -> None:
    """G53.1 and G53.6: turn the rotary axes so that the tool is square to the plane.

    In G53.1 the linear axes stand still; in G53.6 they follow, so that the tip stays at its place on the workpiece. On
    some controls P chooses among several ways (Mitsubishi, Mazak); then the positions of the axes are not known.
    """
    control.resume(ASKEW)
    control.use_start_positions(control.turning)
    found = control.postures(normal_of(control.rotation))
    target, lost = control.position[:], set[int]()
    name = f"G{code / 10:g}"
    by_word = found is not None and len(found.ways) > 1 and ("P" in block.unknown or bool(block.get("P")))
    why = WAY_BY_P.format(name, "{}") if by_word else NOT_SOLVED
    if found is not None and found.ways and not by_word:
        target = turned(control, found.chosen, about_tip=code == ABOUT_TIP)
        if len(found.ways) > 1:
            angles = angles_in_words(control.turning, [target[index] for index in control.turning])
            control.warn(
                TURNED_TO,
                f"{name} turns the rotary axes; ncfix assumes {angles}, the nearest of several positions",
                SQUARED,
            )
        hidden = not control.unknown.keys().isdisjoint((X, Y, Z))
    else:
        hidden = bool(control.turning)
        lost |= {*control.turning}
    if hidden or (code == ABOUT_TIP and is_moved_otherwise(control, block)):
        lost |= {X, Y, Z}
    unknown = control.unknown | dict.fromkeys(lost.intersection(control.axis_indices), why)
    control.make(
        Motion(MotionKind.RAPID, 0, MotionEnd(target, unknown), control.modal.motion, passing=ALIGNMENTS[code])
    )


def turned(control: MacroControl, angles: Mapping[int, float], *, about_tip: bool) -> Vector:
    """The command with the rotary axes at these angles; `about_tip`: the tip stays, else X Y Z of the machine stay."""
    if about_tip:
        return [angles.get(index, value) for index, value in enumerate(control.position)]
    assert control.kinematics is not None, "they have shown how the tool is pointed"
    on, off = TcpState(True, control.length_under_tcp), TcpState(False, 0.0)
    still = control.kinematics([control.position[index] for index in control.axis_indices], on, off)
    command = [angles.get(index, value) for index, value in zip(control.axis_indices, still, strict=True)]
    target = control.position[:]
    for index, value in zip(control.axis_indices, control.kinematics(command, off, on), strict=True):
        target[index] = value
    return target


def is_moved_otherwise(control: MacroControl, block: Block) -> bool:
    """Whether G53.6 moves the tip: along the tool (R), or because no tool length, or another one, is in force."""
    other = "H" in block.values and whole(block.values["H"], "H") != control.tools.offset
    return bool(block.get("R")) or not control.length_code or other


# -- rotary words in a tilted plane ------------------------------------------------------------------------------------


def turns_in_plane(control: MacroControl, block: Block) -> bool:
    """Whether a block turns rotary axes in a tilted plane without control of the tip: X Y Z do not follow."""
    led = control.tip_control or control.setup.tcp or control.dynamic
    named = [index for index in control.turning if block.axes >> index & 1]
    if led or not control.tilted or not named:
        return False
    end = words_destination(control, block)
    known = not {*named} & (end.unknown.keys() | control.unknown.keys())
    return not (known and all(abs(end.target[index] - control.position[index]) < NO_TURN for index in named))


def turn_in_plane(control: MacroControl, block: Block, motion: int) -> None:
    """Such a block, straight and without other axes."""
    control.modal.motion = control.modal.straight = motion
    end, turning = words_destination(control, block), {*control.turning}
    switch(control, control.tools.vector, False, control.tools.offset)
    control.refresh()
    target = [value if index in turning else control.position[index] for index, value in enumerate(end.target)]
    unknown = {index: why for index, why in end.unknown.items() if index in turning}
    unknown |= {index: why for index, why in control.unknown.items() if index not in turning}
    kind = MotionKind.FEED if motion else MotionKind.RAPID
    control.make(Motion(kind, block.axes, MotionEnd(target, unknown), motion, passing=ROTARY_ALONE))
    switch(control, control.tools.vector, True, control.tools.offset)
    control.refresh()


def look_square(control: MacroControl) -> None:
    """Behind a turn by the program: while the tool does not stand square to the plane motions are refused."""
    control.resume(ASKEW)
    if control.square_to(control.rotation) is False:
        control.suspend(ASKEW, ASKEW, followed=True)


# -- G254 and G255 of Haas ---------------------------------------------------------------------------------------------


def dynamic_offset(control: MacroControl, block: Block, code: int) -> None:
    """G254 and G255 of Haas: begin and end the dynamic work offset."""
    control.resume(DYNAMIC)
    if code == DYNAMIC_OFF:
        control.dynamic = False
        end(control)
        return
    machine = None
    if not (control.mirrored or control.is_rotated):
        control.use_start_positions(control.turning)
        known = not control.unknown.keys() & {*control.turning}
        machine = control.posture.directions(control.position) if known else None
    if machine is None:
        control.suspend(DYNAMIC, OFFSET_NOT_SOLVED)
        return
    control.dynamic = True
    begin(control, machine.axes, Block(block.index, {}, frozenset(), 0))
    control.places.lose(mask_of(control.turning))  # a rotary word would turn the tables under the offset


def turns_tables(control: MacroControl, block: Block) -> bool:
    """Whether a block has a rotary word while the dynamic work offset is in force, which would turn the tables."""
    return control.dynamic and any(block.axes >> index & 1 for index in control.turning)
