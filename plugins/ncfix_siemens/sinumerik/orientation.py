"""Rotary positions from the direction of the tool under TRAORI, and from the tilted plane of CYCLE800.

A3 B3 C3 are a vector in program coordinates, of any length; an omitted component is zero. A2 B2 C2 are angles that
rotate a vector along Z, as ORIEULER, ORIRPY or ORIRPY2 states, or else machine data. Machine data also choose between
the two solutions of the rotary axes; here the nearest is taken.
Source: Siemens, "SINUMERIK 840D sl, NC programming, job planning": orientation programming (TRAORI).

Stretches of straight motions with vectors are executed at once: X Y Z by the fast lane, the rotary axes motion after
motion, since the solution depends on the position before. A motion that needs a warning, a refusal or must not be split
ends the stretch, and is executed as a single block.

CYCLE800 tilts the plane and turns the rotary axes until the tool is perpendicular to it. X Y Z are then positions of
the tip in a frame fixed to the workpiece, whatever the rotary axes do: the control includes the swivelled geometry in
the frames. A point p is mapped to X0 + turn @ (X1 + p). The rotations follow one another about the rotated axes, in the
order of the mode. Solid angles rotate about Z, then about Y; projected angles are those of the plane's traces in the
coordinate planes.
Source: Siemens, "SINUMERIK Operate, milling": CYCLE800, external programming (_FR, _TC, _ST, _MODE, _X0 ... _DIR).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import reduce

import numpy as np

from ncfix.control.coordinates import DEGREE, LETTERS, X, Y, Z, mask_of, product
from ncfix.control.expressions import Fault, number
from ncfix.control.frames import WORLD, Affine, projected, shifted, turned
from ncfix.control.lanes.block_rows import BlockRows, stage_of
from ncfix.control.lanes.lane import MIN_STRETCH_BLOCKS, before_placing, is_open, take
from ncfix.control.moves import FeedMode, MotionEnd, MotionKind, Pass, Passing
from ncfix.control.pointing import Pointing, Triple, Ways, dot, nearest
from ncfix.control.posture import MAX_PLANE_DEVIATION_RAD, WayRules, normal_of
from ncfix.control.tcp import rotary_at_zero
from ncfix.text.tree import StringLiteral
from ncfix.values import frozen
from ncfix_siemens.sinumerik.plans import Calling, plain_text
from ncfix_siemens.sinumerik.state import GEOMETRY, Sinumerik
from ncfix_siemens.sinumerik.unit import NO_LENGTH, SinumerikUnit
from ncfix_siemens.sinumerik.vocabulary import ANGLES, NORMALS, OTHERS, VECTOR, BlockWordValues

BAD_VECTOR = "NCF254"
WAY = "NCF253"
OTHERWISE = "if the control uses other positions, program the rotary axes"
FROM_UNKNOWN = "the position of the axis {} before the tool turns is not known"
AT_RUNTIME = "the tool direction is known only at run time"
NO_KINEMATICS = "the tool direction needs the kinematics of a machine with two rotary axes"
NOT_ON = "a tool direction is programmed while TRAORI is not in force"
NOT_FOLLOWED = "the program gives the tool direction in another form than rotary axes or a vector ({})"
MIXED = "the program gives the tool direction in more than one way"
MEANT = '"$MC_ORIENTATION_IS_EULER"'
WHICH_ANGLES = (
    "A2 B2 C2 without ORIEULER or ORIRPY: machine data decide whether they are Euler or roll-pitch-yaw angles: "
    f"`variables.{MEANT} = 1` (or 0) in the setup file"
)
IN_MACHINE = "a tool direction in machine coordinates (ORIMKS) while the coordinates of the program are rotated"
ALONG_PATH = "the tool direction follows the path ({})"
BY_AXES = "oriaxes"
BY_PATH = "oripath"
ON_CURVES = ("oricon", "oricurve", "oripath")
BY_CURVE = "the tool turns on a cone or along a curve ({})"

LONGEST = 1 << 10
"""Largest number of blocks of a stretch; directions behind the block that ends it were computed in vain."""

ORDER = {1: "X", 2: "Y", 3: "Z"}
"""Two bits of the mode -> axis of rotation."""

AXIS_BY_AXIS, SOLID, PROJECTED = 0, 1, 2
"""Kinds of angles, in bits 6 and 7 of the mode."""

DESELECTED = "0"
"""Name of the swivel data set that deselects swivelling; the rotary axes do not move."""

PLACES = {"fr": 0, "st": 2, "mode": 3, "before": 4, "angles": 7, "after": 10, "dir": 13}
"""Indices of the arguments: retraction, state, mode, reference point, angles, zero point, direction."""

SWIVEL = Passing(Pass.ALIGNMENT, "swivelling (CYCLE800)")
UNFOLLOWED = "a tilted plane (CYCLE800{}) is in force, which ncfix does not support"
OVER_FRAME = (
    "a programmed frame (TRANS, ROT, ...) was in force at CYCLE800, and machine data decide whether it stays: cancel "
    "it before"
)
STILL = ", without turning the rotary axes"
AFTER_SWIVEL = "the position of the axis {} after swivelling (CYCLE800) is not known"


def oriented(control: Sinumerik, words: BlockWordValues) -> None:
    """Add rotary words to a block for its tool direction, or the reason why it is refused."""
    if leads_along(control):
        words.refuse(ALONG_PATH.format(control.modes.orientation.upper()), control.turning)
        return
    words.whole |= bool(NORMALS & words.values.keys())
    others = sorted(OTHERS & words.values.keys())
    ways = [way for way in (VECTOR, ANGLES) if any(address in words.values for address in way)]
    if not others and not ways:
        return
    mixed = len(ways) > 1 or any(LETTERS[index] in words.values for index in control.turning)
    reason = NOT_FOLLOWED.format(others[0]) if others else MIXED if mixed else by_direction(control, words)
    if reason:
        words.refuse(reason, control.turning)


def leads_along(control: Sinumerik) -> bool:
    """Whether the tool orientation follows the path (ORIPATH)."""
    return control.modes.transformed and control.modes.orientation.startswith(BY_PATH)


def by_direction(control: Sinumerik, words: BlockWordValues) -> str:
    """Convert A3 B3 C3 or A2 B2 C2 to rotary words; returns why the motion is refused, "" if it is not."""
    if not control.modes.transformed:
        return NOT_ON
    if words.unknown(*VECTOR, *ANGLES):
        return AT_RUNTIME
    if control.modes.orientation_in_machine and control.is_rotated:
        return IN_MACHINE
    if control.modes.orientation.startswith(ON_CURVES):
        return BY_CURVE.format(control.modes.orientation.upper())
    if control.posture.pointing is None:
        return NO_KINEMATICS
    if any(address in words.values for address in ANGLES):
        wanted = by_angles(control, words)
    else:
        a, b, c = (words.get(address) for address in VECTOR)
        wanted = a, b, c
    if wanted is None:
        return WHICH_ANGLES
    control.use_all_start_positions()
    if control.unknown.keys() & {*control.turning}:
        return FROM_UNKNOWN.format(LETTERS[control.axis_indices[control.posture.pointing.columns[0]]])
    size = math.hypot(*wanted)
    if size < NO_LENGTH:
        raise Fault(BAD_VECTOR, "the tool direction (A3 B3 C3) is a vector of length zero")
    found = control.postures([dot(row, wanted) / size for row in control.rotation])
    if found is None or not found.ways:
        raise Fault(BAD_VECTOR, "the rotary axes cannot turn the tool to this direction")
    if found.leaves_pole:
        control.warn(
            WAY, f"ncfix assumes that the rotary axes turn to {found}, the nearest of several positions", OTHERWISE
        )
    for index, angle in found.chosen.items():
        words.values[LETTERS[index]] = (angle - control.offset[index]) / DEGREE
        words.forms[LETTERS[index]] = "ac"
        words.axes |= 1 << index
    control.points = True
    if found.is_close:
        control.builder.keeps_direction()
    control.builder.says_the_way(mask_of(found.letters))
    even = control.modes.orientation == BY_AXES or control.modal.motion == 0
    words.whole |= not even and found.strays
    return ""


def by_angles(control: Sinumerik, words: BlockWordValues) -> Triple | None:
    """The tool direction by A2 B2 C2 as a vector; None if their meaning is not known."""
    euler = number(control.variables.value(MEANT.strip('"').lower()))
    default = "" if euler is None else "orieuler" if euler else "orirpy"
    meant = control.modes.angles or default
    if meant not in TURNS:
        return None
    turns = (turned({axis: words.get(address)}, axis).rotation for axis, address in TURNS[meant])
    x, y, z = (row[2] for row in reduce(product, turns))
    return x, y, z


TURNS = {
    "orieuler": (("Z", "A2"), ("X", "B2"), ("Z", "C2")),
    "orirpy": (("Z", "C2"), ("Y", "B2"), ("X", "A2")),
    "orirpy2": (("X", "A2"), ("Y", "B2"), ("Z", "C2")),
}
"""Meaning of A2 B2 C2 -> successive rotations: (rotated axis, word of the angle)."""


# -- many at once ------------------------------------------------------------------------------------------------------


def run_vectors(control: Sinumerik, unit: SinumerikUnit, block: int, main: bool) -> int:
    """Execute the stretch of blocks with vectors that begins with a block; the number of blocks executed."""
    stop = min(unit.vector_end(block), block + LONGEST)
    if stop - block < MIN_STRETCH_BLOCKS or not is_ready(control) or not is_open(control, unit, block):
        return 0
    pointing = control.posture.pointing
    assert pointing is not None
    letters = [control.axis_indices[column] for column in pointing.columns]
    turning = 1 << letters[0] | 1 << letters[1]
    mask = unit.lanes.mask[unit.program.template[block:stop]] | turning
    stop = before_placing(control, mask, block)
    if stop - block < MIN_STRETCH_BLOCKS:
        return 0
    ways = unit.directions.known(pointing, unit, block, stop, MIN_STRETCH_BLOCKS)
    if len(ways) < MIN_STRETCH_BLOCKS:
        return 0
    stage = stage_of(control, unit, block, block + len(ways))
    stage = replace(stage, mask=mask[: len(ways)])
    count = turn(control, pointing, letters, ways, stage)
    if count < MIN_STRETCH_BLOCKS:
        return 0
    control.points = True
    control.builder.says_the_way(turning, count)
    take(control, stage.rows(0, count), block, main)
    return count


def is_ready(control: Sinumerik) -> bool:
    """Whether tool directions of many blocks can be followed at once."""
    modes, modal = control.modes, control.modal
    plain = not modal.incremental and modal.feed_mode != FeedMode.INVERSE_TIME and control.tools.offset is not None
    followed = modes.transformed and not modes.orientation.startswith(ON_CURVES)
    return plain and followed and control.posture.pointing is not None


def turn(control: Sinumerik, pointing: Pointing, letters: list[int], ways: Sequence[Ways], stage: BlockRows) -> int:
    """Set the rotary positions of a stage to the nearest solutions; the number of motions until one is undecided."""
    first, second = letters
    (scale, other_scale), (offset, other_offset) = (
        [each[i] for i in letters] for each in (control.scale, control.offset)
    )
    here, path = (control.position[first], control.position[second]), stage.path
    found: list[tuple[float, float]] = []
    even = ((stage.motion == 0) | (control.modes.orientation == BY_AXES)).tolist()
    at_will = True
    for both, is_even in zip(ways, even, strict=True):
        nearer = nearest(both, here)
        undecided = (at_will and pointing.leaves_pole(here, nearer)) or pointing.is_close(here, nearer)
        if undecided or not (is_even or pointing.stray(here, nearer[0]) <= MAX_PLANE_DEVIATION_RAD):
            break
        outer, inner = nearer[0]
        here = (
            scale * ((outer - offset) / DEGREE) + offset,
            other_scale * ((inner - other_offset) / DEGREE) + other_offset,
        )
        found.append(here)
        at_will = math.isnan(both[0][0])
    path[1 : len(found) + 1, letters] = found or np.empty((0, 2))
    return len(found)


# -- CYCLE800 ----------------------------------------------------------------------------------------------------------


def swivel(control: Sinumerik, block: int, step: Calling) -> None:
    """CYCLE800: without arguments it resets the plane, with arguments it tilts it."""
    control.resume("tilt")
    if control.frames.programmable != WORLD:
        control.suspend("frame", OVER_FRAME)
    if all(part is None or isinstance(part, StringLiteral) for part in step.written):
        untilted(control)
        return
    if len(step.written) > 1 and plain_text(step.written[1]) == DESELECTED:
        untilted(control)
        control.lose(GEOMETRY, AFTER_SWIVEL)
        return
    values = [number(value(control)) for value in step.arguments]
    written = zip(values, step.written, strict=True)
    if any(value is None and part is not None and not isinstance(part, StringLiteral) for value, part in written):
        control.suspend("tilt", "a tilted plane (CYCLE800) is known only at run time")
        control.lose_all(AFTER_SWIVEL)
        return
    plane = SwivelPlane.of([value or 0.0 for value in values] + [0.0] * 16, control.modal.unit)
    if plane.fault:
        control.suspend("tilt", UNFOLLOWED.format(plane.fault))
        control.lose_all(AFTER_SWIVEL)
        return
    if plane.direction:
        tilted(control, block, plane)
    else:
        level(control, plane)


@frozen
class SwivelPlane:
    """The arguments of CYCLE800.

    frame      frame of the plane
    adds       whether it is added to the plane in force
    direction  -1 or 1: which of two solutions the rotary axes take; 0: they do not move
    retracts   whether the axes retract before the rotary axes turn
    fault      why it is not followed; "" if it is
    """

    frame: Affine
    adds: bool
    direction: int
    retracts: bool
    fault: str

    @classmethod
    def of(cls, values: list[float], unit: float) -> SwivelPlane:
        """The plane by the arguments of a call; unit: mm per unit of its lengths."""
        mode, table = round(values[PLACES["mode"]]), round(values[PLACES["st"]])
        direction = round(values[PLACES["dir"]])
        before, angles, after = (values[PLACES[name] : PLACES[name] + 3] for name in ("before", "angles", "after"))
        turn = turn_of(mode, angles)
        fault = f", mode {mode}" if turn is None else ""
        if table // 100 % 10:
            fault = fault or ", which aligns the tool"
        if direction not in (-1, 0, 1) or (direction == 0 and turn is not None and turn.rotation != WORLD.rotation):
            fault = fault or STILL
        to, on = (shifted({index: unit * each for index, each in enumerate(way)}) for way in (before, after))
        frame = to.then(turn or WORLD).then(on)
        return cls(frame, table % 10 == 1, direction, round(values[PLACES["fr"]]) != 0, fault)

    def within(self, before: Affine) -> Affine:
        """The resulting frame, given that `before` was in force."""
        return before.then(self.frame) if self.adds else self.frame


def turn_of(mode: int, angles: Sequence[float]) -> Affine | None:
    """The rotation of the plane; None for modes that are not followed (rotary axes given directly)."""
    order = "".join(ORDER.get(mode >> shift & 3, "") for shift in (0, 2, 4))
    kind = mode >> 6
    if kind == SOLID:
        return turned(dict(zip("ZY", angles, strict=False)), "ZY")
    if sorted(order) != ["X", "Y", "Z"] or kind not in (AXIS_BY_AXIS, PROJECTED):
        return None
    by_axis = dict(zip(order, angles, strict=False))
    if kind == AXIS_BY_AXIS:
        return turned(by_axis, order)
    plane = projected(by_axis["Y"], by_axis["X"], by_axis["Z"]) if order.endswith("Z") else None
    return None if plane is None else Affine(rotation=plane)


def untilted(control: Sinumerik) -> None:
    """Reset the tilted plane; the rotary axes do not move."""
    control.frames = replace(control.frames, plane=WORLD)
    control.modes.swivelled = False
    control.switch_tcp()


def tilted(control: Sinumerik, block: int, plane: SwivelPlane) -> None:
    """Take a tilted plane into force, and turn the rotary axes."""
    take_plane(control, plane.within(control.frames.plane))
    axes = turn_square(control, plane)
    target, unknown = control.position[:], dict(control.unknown)
    for index, angle in axes.items():
        target[index] = angle
        unknown.pop(index, None)
    gone = [i for i in control.axis_indices if (control.rotary[i] and i not in axes) or i in (X, Y, Z)]
    lost = dict(control.lost_in_frame()) | dict.fromkeys(gone, AFTER_SWIVEL)
    lost = {index: why for index, why in lost.items() if index not in axes}
    mask = mask_of(control.turning)
    end = MotionEnd(target, control.axes_of(lost), lost)
    control.go(MotionKind.RAPID, BlockWordValues(block, axes=mask), end, control.modal.motion, passing=SWIVEL)


def level(control: Sinumerik, plane: SwivelPlane) -> None:
    """Take an unrotated plane into force without moving rotary axes; they must be at zero, else it is not followed."""
    control.use_start_positions(control.turning)
    whole = plane.within(control.frames.plane)
    if whole.rotation != WORLD.rotation or not rotary_at_zero(control, control.position, control.unknown):
        control.suspend("tilt", UNFOLLOWED.format(STILL))
        control.lose_all(AFTER_SWIVEL)
        return
    take_plane(control, whole)
    if plane.retracts:
        control.lose(GEOMETRY, AFTER_SWIVEL)


def take_plane(control: Sinumerik, frame: Affine) -> None:
    """Put a tilted plane into force; it deletes the programmable frame."""
    control.frames = replace(control.frames, plane=frame, programmable=WORLD)
    control.modes.swivelled = True
    control.switch_tcp()


def turn_square(control: Sinumerik, plane: SwivelPlane) -> dict[int, float]:
    """The rotary positions, rad, with the tool perpendicular to the plane; empty if unknown.

    An axis in an unknown position counts as being at zero.
    """
    if control.posture.pointing is None:
        return {}
    outer, inner = (control.axis_indices[column] for column in control.posture.pointing.columns)
    here = [0.0 if index in control.unknown else control.position[index] for index in (outer, inner)]
    rules = WayRules(in_travel=True, sense=plane.direction)
    found = control.postures(normal_of(control.rotation), rules, (here[0], here[1]))
    if found is None or not found.ways:
        return {}
    control.warn(
        WAY,
        f"CYCLE800: ncfix assumes that the rotary axes turn to {found}",
        "check this on the control: its swivel data decide",
    )
    return found.chosen
