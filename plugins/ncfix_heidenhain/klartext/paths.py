"""The path functions by name: what follows them, and which words each of them takes.

Source: TNC 640 and iTNC 530, "Programming: contours". A word that its function does not take is never passed over: the
control would stop at it, or knows a form of the block that is not known here.
"""

from __future__ import annotations

from ncfix_heidenhain.klartext.arcs import Step, circular, circular_by_radius, circular_polar, tangential
from ncfix_heidenhain.klartext.control import KlartextControl
from ncfix_heidenhain.klartext.lines import straight, straight_polar
from ncfix_heidenhain.klartext.plans import CARTESIAN, MOVING, POLAR, VECTOR

PATHS = {
    "": straight,
    "l": straight,
    "ln": straight,
    "lp": straight_polar,
    "c": circular,
    "cr": circular_by_radius,
    "cp": circular_polar,
    "ct": tangential,
    "ctp": tangential,
}
"""Path functions by name."""

TAKES = {
    **dict.fromkeys(("l", "ln"), CARTESIAN | VECTOR),
    **dict.fromkeys(("", "c", "cr", "ct"), CARTESIAN),
    **dict.fromkeys(("lp", "cp", "ctp"), CARTESIAN | POLAR),
    **dict.fromkeys(("appr lt", "appr ln", "appr ct", "appr lct", "dep lct"), CARTESIAN),
    **dict.fromkeys(("appr plt", "appr pln", "appr pct", "appr plct", "dep plct"), CARTESIAN | POLAR),
    **dict.fromkeys(("dep lt", "dep ln", "dep ct"), frozenset[str]()),
    **dict.fromkeys(("cycl call", "cycl call pos"), CARTESIAN),
}
"""Path function -> the words among `MOVING` that lead it."""

TURNING = frozenset({"c", "cp", "cr"})
"""What takes a sense of rotation, DR+ or DR-."""

CALLING = frozenset({"", "l", "ln", "lp", "cycl call", "cycl call pos"})
"""What may execute a cycle where it leads; behind an arc there would be two motions in one block."""

NOT_TAKEN = "{} takes no word {}: the control would stop, or makes a path of it that is not followed"
TWICE = "{} with a word {} in the plane of its pole: where the control would go is not sure"
CALLED_BY_ARC = "a cycle that is called in a block with {}: two motions in one block are not followed"
CALLED_AT_MACHINE = "a cycle that is called in a block with M91 or M92: from which coordinates it drills is not sure"
NO_FIRST_POINT = "{} without the point at which the contour begins"
NO_HEIGHT = "CYCL CALL POS without Z: the manuals ask for all three axes, and at which height it is called is not sure"
COUNTED_HEIGHT = "CYCL CALL POS with a height in increments (IZ): from where the control counts it is not sure"


def astray(control: KlartextControl, step: Step, *, called: bool) -> str:
    """Why a block cannot be followed for the words that it has or lacks; empty if it can.

    called  it executes a cycle where it leads
    """
    name, words = step.name, step.words.values
    said = name.upper() or "a block of words alone"
    if called and name not in CALLING:
        return CALLED_BY_ARC.format(said)
    if (called or name.startswith("cycl call")) and step.codes & {91, 92}:
        return CALLED_AT_MACHINE
    other = next((word for word in words if word in MOVING and word not in TAKES.get(name, MOVING)), "")
    if step.flags & {"dr+", "dr-"} and name in TAKES and name not in TURNING:
        other = "DR"
    if other:
        return NOT_TAKEN.format(said, other)
    if name in ("lp", "cp", "ctp") or words.keys() & POLAR:
        plane = (control.path.plane.first, control.path.plane.second)
        twice = next((word for word in words if word in CARTESIAN and "XYZ".find(word[-1]) in plane), "")
        return TWICE.format(said, twice) if twice else ""
    if name.startswith("appr ") and not words.keys() & MOVING:
        return NO_FIRST_POINT.format(said)
    if name == "cycl call pos" and "Z" not in words:
        return COUNTED_HEIGHT if "IZ" in words else NO_HEIGHT
    return ""
