"""What an increment (G91, IC) counts from after a frame or a tool length has changed.

An axis stands, and its frame or the length of its tool changes. Whether the next increment takes that change along
is for setting data, one for frames and one for tools; as a control is delivered it does. So such an increment is
refused, until the axis is brought somewhere absolutely, unless the setup says that increments leave it out.
Source: Siemens, "SINUMERIK 840D sl, axes, coordinate systems, frames (K2)": frames with G91, SD42440, SD42442.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.control.coordinates import LETTERS
from ncfix.control.frames import WORLD, Affine
from ncfix.control.state import XYZ

if TYPE_CHECKING:
    from ncfix_siemens.sinumerik.state import Sinumerik

FRAME_COUNTS, TOOL_COUNTS = "$sc_frame_offset_incr_prog", "$sc_tool_offset_incr_prog"
UNSTEADY = (
    "whether the increment takes along that {} has changed is for setting data: "
    'variables."{}" = 0 in the setup file says that it does not'
)

TAKEN_ALONG = ("by machine coordinates",)
"""What an axis of a turned frame counts from that an axis of the machine has moved: neither frames nor none."""

Footing = tuple[tuple[object, ...], tuple[object, ...]]
"""What the numbers of an axis count from: by its frame, and by the tool."""


def footings(control: Sinumerik, whole: Affine) -> list[Footing]:
    """The footing of every letter while these frames are in force."""
    tool = control.tools.vector
    return [
        (frame_of(whole, index), (control.tcp, tuple(tool[:3])) if control.tcp and index < 3 else (tool[index],))
        for index in range(len(LETTERS))
    ]


def frame_of(whole: Affine, index: int) -> tuple[object, ...]:
    """What an axis counts from by frames; in a turned frame each of X Y Z counts from all three."""
    if index >= 3:
        return (whole.shift[index],)
    turned = whole.rotation != WORLD.rotation
    return (tuple(whole.shift[:3]) if turned else whole.shift[index], whole.rotation, whole.scale)


def unsteady(control: Sinumerik, index: int, *, by_machine: bool = False) -> str:
    """Why nobody can say where an increment of an axis leads; empty if all is well."""
    before, now = control.counted[index], (footings(control, WORLD) if by_machine else control.footing)[index]
    if before == now:
        return ""
    if before[0] != now[0] and control.variables.value(FRAME_COUNTS) != 0.0:
        return UNSTEADY.format("the frame", FRAME_COUNTS.upper())
    if before[1] != now[1] and control.variables.value(TOOL_COUNTS) != 0.0:
        return UNSTEADY.format("the tool length", TOOL_COUNTS.upper())
    return ""


def stand(control: Sinumerik, axes: int, *, by_machine: bool) -> None:
    """These axes, a bit mask, have been brought somewhere: in the frames in force, or in machine coordinates.

    An axis of the machine takes X, Y and Z of a turned frame along, and the frame was off meanwhile.
    """
    footing = footings(control, WORLD) if by_machine else control.footing
    moved = [index for index in XYZ if by_machine and control.is_rotated and axes >> index & 1]
    for index in range(len(LETTERS)):
        if axes >> index & 1:
            control.counted[index] = footing[index]
        elif index in XYZ and any(control.tcp or control.rotation[other][index] for other in moved):
            control.counted[index] = TAKEN_ALONG, footing[index][1]


def had_from_the_start(control: Sinumerik, before: list[Footing]) -> None:
    """What is in force now was so from the start, for axes that nothing has changed since."""
    control.counted = [
        now if counted == then else counted
        for counted, then, now in zip(control.counted, before, control.footing, strict=True)
    ]
