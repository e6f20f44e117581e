"""The direction of the tool as programs give it under TRAORI, and the plane of CYCLE800: made into rotary positions.

A3 B3 C3 are a vector in the coordinates of the program, of any length; a component that is not written is zero. A2 B2
C2 are angles by which a vector along Z is turned, in the sense that ORIEULER, ORIRPY or ORIRPY2 says, or machine data
where none of them does. Which of two ways the rotary axes take is for the machine data, too: here it is the nearest.
Source: Siemens, "SINUMERIK 840D sl, NC programming, job planning": orientation programming (TRAORI).
"""

from __future__ import annotations

import math
from functools import reduce

from ncfix.control.coordinates import DEGREE, LETTERS, mask_of, product
from ncfix.control.expressions import Fault, number
from ncfix.control.frames import turned
from ncfix.control.pointing import Triple, dot
from ncfix.control.posture import postures
from ncfix_siemens.sinumerik.destination import BlockWordValues
from ncfix_siemens.sinumerik.directions import NO_LENGTH
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.vocabulary import ANGLES, NORMALS, OTHERS, VECTOR

BAD_VECTOR = "NCF254"
WAY = "NCF253"
OTHERWISE = "state the rotary axes in the program if the control turns them otherwise"
FROM_UNKNOWN = "where the axis {} stands before the tool is turned is not known"
AT_RUNTIME = "the direction of the tool is known only at run time"
NO_KINEMATICS = "the direction of the tool needs the kinematics of a machine with two rotary axes"
NOT_ON = "a direction of the tool is given while TRAORI is not on"
NOT_FOLLOWED = "the tool is oriented in another way than by rotary axes or a vector ({})"
MIXED = "the direction of the tool is given in more than one way"
MEANT = '"$MC_ORIENTATION_IS_EULER"'
WHICH_ANGLES = (
    "whether A2 B2 C2 are Euler or roll-pitch-yaw angles is for ORIEULER or ORIRPY to say, or machine data: "
    f"`variables.{MEANT} = 1` (or 0) in the setup file"
)
IN_MACHINE = "a direction of the tool in machine coordinates (ORIMKS) while the program's are turned"
ALONG_PATH = "the tool turns with the path ({})"
BY_AXES = "oriaxes"
BY_PATH = "oripath"
ON_CURVES = ("oricon", "oricurve", "oripath")
BY_CURVE = "the tool turns on a cone, or after a curve ({})"


def oriented(control: Sinumerik, words: BlockWordValues) -> None:
    """Give the block the rotary words that its direction of the tool amounts to, or the reason why it is refused."""
    if leads_along(control):
        words.refuse(ALONG_PATH.format(control.modes.orientation.upper()), control.turning)
        return
    words.whole |= bool(NORMALS & words.values.keys())
    others = sorted(OTHERS & words.values.keys())
    ways = [way for way in (VECTOR, ANGLES) if any(address in words.values for address in way)]
    if not others and not ways:
        return
    reason = NOT_FOLLOWED.format(others[0]) if others else MIXED if len(ways) > 1 else by_direction(control, words)
    if reason:
        words.refuse(reason, control.turning)


def leads_along(control: Sinumerik) -> bool:
    """Whether each motion turns the tool, as the path turns."""
    return control.modes.transformed and control.modes.orientation.startswith(BY_PATH)


def by_direction(control: Sinumerik, words: BlockWordValues) -> str:
    """Take A3 B3 C3 or A2 B2 C2; why the motion is refused, if it is."""
    if not control.modes.transformed:
        return NOT_ON
    if words.runtime(*VECTOR, *ANGLES):
        return AT_RUNTIME
    if control.modes.orientation_in_machine and control.is_rotated:
        return IN_MACHINE
    if control.modes.orientation.startswith(ON_CURVES):
        return BY_CURVE.format(control.modes.orientation.upper())
    if control.pointing is None:
        return NO_KINEMATICS
    wanted = by_angles(control, words) if any(address in words.values for address in ANGLES) else by_vector(words)
    if wanted is None:
        return WHICH_ANGLES
    control.settle_all()
    if control.unknown.keys() & {*control.turning}:
        return FROM_UNKNOWN.format(LETTERS[control.machine[control.pointing.columns[0]]])
    found = postures(control, direction_of(control, wanted))
    if found is None or not found.ways:
        raise Fault(BAD_VECTOR, "the rotary axes cannot point the tool in this direction")
    if found.leaves_pole:
        control.warn(WAY, f"the tool is taken to turn to {found}, the nearest of several ways", OTHERWISE)
    for index, angle in found.chosen.items():
        words.values[LETTERS[index]] = (angle - control.offset[index]) / DEGREE
        words.forms[LETTERS[index]] = "ac"
        words.axes |= 1 << index
    control.points = True
    control.builder.says_the_way(mask_of(found.letters))
    even = control.modes.orientation == BY_AXES or control.modal.motion == 0
    words.whole |= not even and found.strays
    return ""


def by_vector(words: BlockWordValues) -> Triple:
    """A3 B3 C3."""
    a, b, c = (words.get(address) for address in VECTOR)
    return a, b, c


def by_angles(control: Sinumerik, words: BlockWordValues) -> Triple | None:
    """The direction that A2 B2 C2 say, as a vector; None where nobody says how they are meant."""
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
"""About which axis, as the turns before have left it, and by which word."""


def direction_of(control: Sinumerik, vector: Triple) -> list[float]:
    """A vector of the program as a unit vector in the workpiece."""
    size = math.hypot(*vector)
    if size < NO_LENGTH:
        raise Fault(BAD_VECTOR, "the direction of the tool (A3 B3 C3) has no length")
    return [dot(row, vector) / size for row in control.rotation]
