"""Tilted working planes: PLANE and cycle 19, by angles, vectors or points.

The kinematics of the machine say where TURN and MOVE take the rotary axes; MOVE also moves the linear axes, which are
not known after it.

Source: TNC 640, "The PLANE function: tilting the working plane", and "Cycle 19".
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from ncfix.control.coordinates import DEGREE, IDENTITY, INDEX, LETTERS, Rotation, product
from ncfix.control.expressions import Fault, Unknown
from ncfix.control.frames import euler, from_points, from_vectors, projected, spatial
from ncfix.control.moves import AT_START, Motion, MotionEnd, MotionKind, Pass, Passing
from ncfix.control.posture import MIN_SIGNED_RAD, WayRules, normal_of
from ncfix.control.tcp import switch
from ncfix_heidenhain.klartext.control import MOVED_ALONG, TILTED, KlartextControl
from ncfix_heidenhain.klartext.targets import MotionWords
from ncfix_heidenhain.klartext.transformations import put, with_plane

BAD_PLANE = "NCF273"
RETRACTING = "mb max"
"""The flag of a PLANE block with MB: the tool is retracted before the axes turn."""

POSITIONED = "the control calculates the position of the axis {} after PLANE ... TURN or MOVE"
NOT_NORMAL = "with the axis positions of the program the tool is not normal to the tilted plane"
TURNED = Passing(Pass.ALIGNMENT, "the control positions the rotary axes (PLANE)")
WAY = "NCF279"
WAY_HINT = "state the rotary axes in the program; a PLANE block may say SEQ+ or SEQ-"
HOME = "PLANE RESET: ncfix assumes that the rotary axes turn to zero, their basic position"
RUNTIME = "the tilted plane depends on a Q parameter that is known only at run time"
ANGLES = "NCF284"
ANGLES_HINT = "a machine parameter decides: compare Q120 to Q122 on the control, or use PLANE"
NO_KINEMATICS = "positions of rotary axes define the tilted plane (PLANE AXIAL, cycle 19)"
CALCULATED = ("Q120", "Q121", "Q122")
"""The parameters in which the control stores the positions of A, B and C that it has worked out."""

Values = Mapping[str, float]


def triple(values: Values, name: str) -> tuple[float, float, float]:
    """The words with this name and X, Y or Z, as the components of a vector."""
    return values.get(f"{name}X", 0.0), values.get(f"{name}Y", 0.0), values.get(f"{name}Z", 0.0)


def by_angles(values: Values) -> Rotation:
    """PLANE SPATIAL: the plane by three spatial angles."""
    return spatial({letter: values.get(f"SP{word}", 0.0) for letter, word in zip("XYZ", "ABC", strict=True)})


def by_projection(values: Values) -> Rotation | None:
    """PLANE PROJECTED: the plane by two projected angles and a rotation; None from 90 degrees on."""
    first, second = values.get("PROPR", 0.0), values.get("PROMIN", 0.0)
    return None if max(abs(first), abs(second)) >= 90 else projected(first, second, values.get("ROT", 0.0))


FORMS: Mapping[str, Callable[[Values], Rotation | None]] = {
    "spatial": by_angles,
    "projected": by_projection,
    "euler": lambda v: euler(v.get("EULPR", 0.0), v.get("EULNU", 0.0), v.get("EULROT", 0.0)),
    "vector": lambda v: from_vectors(triple(v, "B"), triple(v, "N")),
    "points": lambda v: from_points(triple(v, "P1"), triple(v, "P2"), triple(v, "P3")),
}


def plane(control: KlartextControl, form: str, words: MotionWords, flags: frozenset[str]) -> None:
    """Execute a PLANE block; `form` is `spatial`, `reset`, ..."""
    values = words.values
    if "MB" in values:
        flags |= {RETRACTING}
    if form == "reset" and is_idle(control, flags):
        return
    control.use()
    if form == "reset":
        tilt_to(control, None, flags)
        return
    if words.unknown:
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
    """Whether the end of a tilt changes nothing: no tilt is in force, and no rotary start position was needed yet.

    Many programs begin so; Q120 to Q122 are then not known.
    """
    asked = any(control.rotary[index] and why is AT_START for index, why in control.unknown.items())
    turns = flags & {"turn", "move", RETRACTING}
    idle = asked and not turns and not control.plane_tilted and TILTED not in control.suspended
    if idle:
        for name in CALCULATED:
            control.scope.parameters.assign(name, Unknown())
    return idle


def by_axes(control: KlartextControl, values: Values, flags: frozenset[str]) -> None:
    """PLANE AXIAL: the plane to which the tool is normal with rotary axes at these positions; TURN moves them there."""
    way = {index: values[letter] * DEGREE for letter, index in INDEX.items() if letter in values}
    staying = {index: control.position[index] for index in control.turning if index not in way}
    plane = None if staying.keys() & control.unknown.keys() else plane_of(control, values)
    refusal = "" if plane else NO_KINEMATICS
    tilt_to(control, plane or control.frames.plane.rotation, flags, refusal, staying | way)


def plane_of(control: KlartextControl, values: Values) -> Rotation | None:
    """The plane to which the tool is normal with rotary axes at these positions (degrees); None if it is not known."""
    turned = control.position[:]
    for letter in "ABC":
        if letter in values:
            turned[INDEX[letter]] = values[letter] * DEGREE
    found = control.posture.directions(turned)
    return None if found is None or math.dist(found.tool, normal_of(found.axes)) > 1e-6 else found.axes


def tilt_to(
    control: KlartextControl,
    tilt: Rotation | None,
    flags: frozenset[str],
    refusal: str = "",
    way: dict[int, float] | None = None,
) -> None:
    """Put a tilted plane into force, or end it (None); `way`: where rotary axes go, if the block states it."""
    frames, control.plane_tilted = with_plane(control, tilt), tilt is not None
    control.resume(TILTED)
    if refusal:
        control.suspend(TILTED, refusal)
    home = tilt is None and flags & {"turn", "move"}
    if refusal or way is None:
        way = None if refusal else way_home(control) if home else chosen_way(control, tilt, flags)
    for letter, name in zip("ABC", CALCULATED, strict=True):
        known = way is not None and INDEX[letter] in way
        angle = way[INDEX[letter]] - control.offset[INDEX[letter]] if way is not None and known else 0.0
        control.scope.parameters.assign(name, angle / DEGREE if known else Unknown("", angle / DEGREE))
    if flags & {"turn", "move"}:
        turn_axes(control, way)
    if flags & {"move", RETRACTING}:
        control.lose(range(3), MOVED_ALONG)
    put(control, frames)
    control.recompose()
    control.switch_tip()
    control.path.tangent = None


def chosen_way(control: KlartextControl, tilt: Rotation | None, flags: frozenset[str]) -> dict[int, float] | None:
    """Axis -> the rotary position that the control works out for a plane; None if that is not known or not sure.

    SEQ (or SYM) chooses between the two solutions by the sign of the master axis, the one that tilts the tool when all
    rotary axes stand at zero. Without it the nearest solution is taken.

    At the pole the axis next to the workpiece is free: the tool is square to the plane at any of its positions. With
    COORD ROT, the default, some controls turn it to zero, and others leave it; with TABLE ROT it takes over the
    rotation of the plane. All agree only if it already stands at zero and the plane is not rotated by TABLE ROT.
    """
    signs = (-1 if flag.endswith("-") else 1 for flag in flags if flag[:3] in ("seq", "sym"))
    normal = normal_of(IDENTITY if tilt is None else tilt)
    found = control.postures(normal, WayRules(in_travel=True, sign=next(signs, 0)))
    if found is None or not found.ways:
        return None
    if found.at_pole:
        turned = "table rot" in flags and tilt is not None and tilt != IDENTITY
        at_zero = abs(found.ways[0][0]) < MIN_SIGNED_RAD
        return found.chosen if at_zero and not turned else None
    if len(found.ways) > 1:
        control.warn(
            WAY, f"ncfix assumes that the rotary axes turn to {found}, the nearest of several positions", WAY_HINT
        )
    return found.chosen


def way_home(control: KlartextControl) -> dict[int, float] | None:
    """Where PLANE RESET with TURN or MOVE takes the rotary axes: to zero; None if their datum is shifted."""
    if any(control.offset[index] for index in control.turning):
        return None
    if any(index in control.unknown or abs(control.position[index]) > MIN_SIGNED_RAD for index in control.turning):
        control.warn(WAY, HOME, "program the rotary axes in the next block")
    return dict.fromkeys(control.turning, 0.0)


def turn_axes(control: KlartextControl, way: dict[int, float] | None) -> None:
    """Turn the rotary axes as TURN and MOVE do; `way`: to where, None if that is not known."""
    if control.tcp:
        switch(control, control.tools.vector, False, control.tools.offset)
        control.refresh()
    if way is None:
        why = next((control.unknown[index] for index in control.turning if index in control.unknown), POSITIONED)
        control.pass_here(TURNED, why, "".join(LETTERS[index] for index in control.turning))
        return
    target, unknown = control.position[:], {k: why for k, why in control.unknown.items() if k not in way}
    for index, angle in way.items():
        target[index] = angle
    control.make(Motion(MotionKind.RAPID, 0, MotionEnd(target, unknown), 0, passing=TURNED))


def cycle_19(control: KlartextControl, words: MotionWords) -> None:
    """Cycle 19: tilt by spatial angles or by positions of rotary axes; without angles it ends the tilt.

    A machine parameter decides which of the two is meant; here the positions of the axes show it.
    """
    values = {letter: words.values[letter] for letter in "ABC" if letter in words.values}
    if not values and is_idle(control, frozenset()):
        return
    control.use()
    if not values:
        tilt_to(control, None, frozenset())
        return
    if words.unknown:
        tilt_to(control, control.frames.plane.rotation, frozenset(), RUNTIME)
        return
    meant = by_angles({f"SP{letter}": value for letter, value in values.items()})
    standing = all(
        INDEX[letter] in control.axis_indices
        and INDEX[letter] not in control.unknown
        and abs(control.position[INDEX[letter]] - value * DEGREE) < 1e-6
        for letter, value in values.items()
    )
    square = control.square_to(meant)
    if square is False and standing:
        by_axes(control, values, frozenset())
        return
    if not square and all(INDEX[letter] in control.axis_indices for letter in values):
        other = plane_of(control, values)
        if other is not None and math.dist(normal_of(other), normal_of(meant)) > 1e-6:
            control.warn(ANGLES, "cycle 19: ncfix assumes spatial angles, not positions of rotary axes", ANGLES_HINT)
    tilt_to(control, meant, frozenset())


def check_normal(control: KlartextControl) -> str:
    """Why a motion in the tilted plane is refused: the tool is not normal to it. Empty if it is not refused."""
    if not control.plane_tilted or control.m128 or TILTED in control.suspended:
        return ""
    return NOT_NORMAL if control.square_to(control.frames.plane.rotation) is False else ""
