"""PLANE, and cycle 19: from angles, vectors or points to a tilted plane.

Source: TNC 640, "The PLANE function: tilting the working plane", and "Cycle 19". Where TURN and MOVE take the rotary
axes follows from the machine's kinematics; MOVE also moves the linear axes, which are not known after it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from ncfix.control.coordinates import DEGREE, IDENTITY, INDEX, LETTERS, Rotation, product
from ncfix.control.expressions import Fault
from ncfix.control.frames import euler, from_points, from_vectors, projected, spatial
from ncfix.control.moves import AT_START, Motion, MotionKind, Pass, Passing
from ncfix.control.posture import AT_ZERO, WayRules, normal_of
from ncfix.control.tcp import switch
from ncfix_heidenhain.klartext.control import MOVED_ALONG, TILTED, KlartextControl
from ncfix_heidenhain.klartext.targets import MotionWords
from ncfix_heidenhain.klartext.transformations import put, with_plane

BAD_PLANE = "NCF273"
RETRACTING = "mb max"
"""The tool is drawn back before the axes turn."""


POSITIONED = "where the axis {} stands after PLANE ... TURN or MOVE the control works out"
NOT_NORMAL = "the tool does not stand normal to the tilted plane, by the axis positions of the program"
TURNED = Passing(Pass.ALIGNMENT, "the control positions the rotary axes (PLANE)")
WAY = "NCF279"
WAY_HINT = "say SEQ+ or SEQ- in the program, or state the rotary axes"
HOME = "PLANE RESET is taken to turn the rotary axes to zero, their basic position"
RUNTIME = "the tilted plane depends on a Q parameter that is known only at run time"
NO_KINEMATICS = "the tilted plane is given by the positions of rotary axes (PLANE AXIAL, cycle 19)"
CALCULATED = ("Q120", "Q121", "Q122")
"""Where the control leaves the positions of A, B and C that it has worked out."""

Values = Mapping[str, float]


def by_vectors(values: Values) -> Rotation | None:
    """PLANE VECTOR: base vector and normal."""
    base, normal = ([values.get(f"{kind}{axis}", 0.0) for axis in "XYZ"] for kind in "BN")
    return from_vectors((base[0], base[1], base[2]), (normal[0], normal[1], normal[2]))


def by_points(values: Values) -> Rotation | None:
    """PLANE POINTS."""
    first, second, third = ([values.get(f"P{number}{axis}", 0.0) for axis in "XYZ"] for number in "123")
    return from_points(
        (first[0], first[1], first[2]), (second[0], second[1], second[2]), (third[0], third[1], third[2])
    )


def by_angles(values: Values) -> Rotation:
    """PLANE SPATIAL."""
    return spatial({letter: values.get(f"SP{word}", 0.0) for letter, word in zip("XYZ", "ABC", strict=True)})


def by_projection(values: Values) -> Rotation | None:
    """PLANE PROJECTED."""
    first, second = values.get("PROPR", 0.0), values.get("PROMIN", 0.0)
    return None if max(abs(first), abs(second)) >= 90 else projected(first, second, values.get("ROT", 0.0))


FORMS: Mapping[str, Callable[[Values], Rotation | None]] = {
    "spatial": by_angles,
    "projected": by_projection,
    "euler": lambda v: euler(v.get("EULPR", 0.0), v.get("EULNU", 0.0), v.get("EULROT", 0.0)),
    "vector": by_vectors,
    "points": by_points,
}


def plane(control: KlartextControl, form: str, words: MotionWords, flags: frozenset[str]) -> None:
    """A PLANE block."""
    values = words.values
    if "MB" in values:
        flags |= {RETRACTING}
    if form == "reset" and is_idle(control, flags):
        return
    control.use()
    if form == "reset":
        tilt_to(control, None, flags)
        return
    if words.runtime:
        tilt_to(control, control.frames.plane.rotation, flags, RUNTIME)
    elif form.startswith("relativ"):
        tilt_to(control, product(control.frames.plane.rotation, by_angles(values)), flags)
    elif form == "axial":
        by_axes(control, values, flags)
    else:
        found = FORMS[form](values)
        if found is None:
            raise Fault(BAD_PLANE, f"PLANE {form.upper()} gives no plane: its vectors or points are in one line")
        tilt_to(control, found, flags)


def is_idle(control: KlartextControl, flags: frozenset[str]) -> bool:
    """Whether the end of a tilt changes nothing: none has begun, and where the rotary axes stand is not asked yet.

    Many programs begin with it. Then Q120 to Q122 are not known.
    """
    asked = any(control.rotary[index] and why is AT_START for index, why in control.unknown.items())
    turns = flags & {"turn", "move", RETRACTING}
    idle = asked and not turns and not control.plane_tilted and TILTED not in control.suspended
    if idle:
        for name in CALCULATED:
            control.scope.parameters.assign(name, 0.0, runtime=True)
    return idle


def by_axes(control: KlartextControl, values: Values, flags: frozenset[str]) -> None:
    """PLANE AXIAL: the plane to which rotary axes at these positions make the tool normal."""
    turned = control.position[:]
    for letter in "ABC":
        if letter in values:
            turned[INDEX[letter]] = values[letter] * DEGREE
    found = control.posture.directions(turned)
    if found is None or math.dist(found.tool, normal_of(found.axes)) > 1e-6:
        tilt_to(control, control.frames.plane.rotation, flags, NO_KINEMATICS)
        return
    tilt_to(control, found.axes, flags)


def tilt_to(control: KlartextControl, tilt: Rotation | None, flags: frozenset[str], refusal: str = "") -> None:
    """Make a tilted plane the frame; None: none."""
    frames, control.plane_tilted = with_plane(control, tilt), tilt is not None
    control.suspended.pop(TILTED, None)
    if refusal:
        control.suspended[TILTED] = refusal
    home = tilt is None and flags & {"turn", "move"}
    way = None if refusal else way_home(control) if home else chosen_way(control, tilt, flags)
    for letter, name in zip("ABC", CALCULATED, strict=True):
        known = way is not None and INDEX[letter] in way
        angle = way[INDEX[letter]] - control.offset[INDEX[letter]] if way is not None and known else 0.0
        control.scope.parameters.assign(name, angle / DEGREE, runtime=not known)
    if flags & {"turn", "move"}:
        turn_axes(control, way)
    if flags & {"move", RETRACTING}:
        control.lose(range(3), MOVED_ALONG)
    put(control, frames)
    control.recompose()
    control.switch_tip()
    control.path.tangent = None


def chosen_way(control: KlartextControl, tilt: Rotation | None, flags: frozenset[str]) -> dict[int, float] | None:
    """The rotary positions that the control works out, by letter; None where that is not known or not sure.

    SEQ (or SYM) says which of the two ways is taken by the sign of the master axis, the one that tilts the tool when
    all rotary axes stand at zero. Without it the nearest is.

    Where the tool is square to the plane wherever the axis next to the workpiece stands, that axis is free: by COORD
    ROT, which counts where nothing is said, some controls turn it to zero, others leave it; by TABLE ROT it takes over
    the rotation of the plane. Only where it stands at zero already, all is one.
    """
    signs = (-1 if flag.endswith("-") else 1 for flag in flags if flag[:3] in ("seq", "sym"))
    normal = normal_of(IDENTITY if tilt is None else tilt)
    found = control.postures(normal, WayRules(in_travel=True, sign=next(signs, 0)))
    if found is None or not found.ways:
        return None
    if found.at_pole:
        turned = "table rot" in flags and tilt is not None and tilt != IDENTITY
        at_zero = abs(found.ways[0][0]) < AT_ZERO
        return found.chosen if at_zero and not turned else None
    if len(found.ways) > 1:
        control.warn(WAY, f"the rotary axes are taken to turn to {found}, the nearest of several ways", WAY_HINT)
    return found.chosen


def way_home(control: KlartextControl) -> dict[int, float] | None:
    """PLANE RESET with TURN or MOVE: the rotary axes go to their basic position, zero; None where zero is shifted."""
    if any(control.offset[index] for index in control.turning):
        return None
    if any(index in control.unknown or abs(control.position[index]) > AT_ZERO for index in control.turning):
        control.warn(WAY, HOME, "state the rotary axes in the next block")
    return dict.fromkeys(control.turning, 0.0)


def turn_axes(control: KlartextControl, way: dict[int, float] | None) -> None:
    """TURN and MOVE: the control positions the rotary axes."""
    if control.tcp:
        switch(control, control.tools.vector, False, control.tools.offset)
        control.refresh()
    if way is None:
        control.pass_here(TURNED, POSITIONED, rotary_letters(control))
        return
    target, unknown = control.position[:], {k: why for k, why in control.unknown.items() if k not in way}
    for index, angle in way.items():
        target[index] = angle
    control.make(Motion(MotionKind.RAPID, 0, target, unknown, 0, passing=TURNED))


def rotary_letters(control: KlartextControl) -> str:
    """The machine's rotary axes."""
    return "".join(LETTERS[index] for index in control.turning)


def cycle_19(control: KlartextControl, words: MotionWords) -> None:
    """Cycle 19: spatial angles, or positions of rotary axes, as a machine parameter says; none ends the tilt.

    Where the axes stand tells which of the two is meant.
    """
    values = {letter: words.values[letter] for letter in "ABC" if letter in words.values}
    if not values and is_idle(control, frozenset()):
        return
    control.use()
    if not values:
        tilt_to(control, None, frozenset())
        return
    if words.runtime:
        tilt_to(control, control.frames.plane.rotation, frozenset(), RUNTIME)
        return
    meant = by_angles({f"SP{letter}": value for letter, value in values.items()})
    standing = all(
        INDEX[letter] in control.machine
        and INDEX[letter] not in control.unknown
        and abs(control.position[INDEX[letter]] - value * DEGREE) < 1e-6
        for letter, value in values.items()
    )
    if control.square_to(meant) is False and standing:
        by_axes(control, values, frozenset())
        return
    tilt_to(control, meant, frozenset())


def check_normal(control: KlartextControl) -> str:
    """Why a motion in the tilted plane is refused: the tool does not stand normal to it."""
    if not control.plane_tilted or control.m128 or TILTED in control.suspended:
        return ""
    return NOT_NORMAL if control.square_to(control.frames.plane.rotation) is False else ""
