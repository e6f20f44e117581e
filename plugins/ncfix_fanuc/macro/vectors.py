"""The direction of the tool as a vector, I J K under G43.5: made into rotary positions by the machine's own kinematics.

The vector points from the tip to the spindle, in the coordinates of the program, and may have any length; a component
that is not written is zero, and a block without any keeps the direction. Which of two ways the rotary axes take is for
the control's parameters to say: here it is the nearest.
Source: Fanuc, "Tool center point control for 5-axis machining" (A-79348E), type 2.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ncfix.control.coordinates import DEGREE, LETTERS, dot
from ncfix.control.expressions import Fault
from ncfix.control.posture import Postures, WayRules
from ncfix_fanuc.macro.control import COMPONENTS, MacroControl

if TYPE_CHECKING:
    from ncfix_iso.rs274.control import Block

STRAIGHT, ARCS = (0, 10), (20, 30)
BAD_VECTOR = "NCF219"
TURNED_TO = "NCF243"
INCLINED = "the tool leans away from its vectors (Q of G43.5), which ncfix does not follow"
BY_AXES = "a word of a rotary axis while the direction of the tool is given by I J K (G43.5)"
ON_ARC = "an arc or a cycle while the direction of the tool is given by I J K (G43.5)"
AT_RUNTIME = "the direction of the tool (I J K) is known only at run time"
NO_KINEMATICS = "the direction of the tool (I J K) needs the kinematics of a machine with two rotary axes"
FROM_UNKNOWN = "where the rotary axes stand before the tool is turned (I J K) is not known"
AFTER_VECTOR = "where the axis {} stands after a direction of the tool that is not followed is not known"
CHOICE = "state the direction in smaller steps, or use G43.4, if the control turns the other way"


def directed(control: MacroControl, block: Block, motion: int) -> str:
    """Give a block the rotary words that its vector amounts to; why its motion is refused, if it is."""
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
        raise Fault(BAD_VECTOR, "the rotary axes cannot point the tool in this direction (I J K)")
    note_choice(control, found)
    for index, angle in found.chosen.items():
        block.values[LETTERS[index]] = (angle - control.offset[index]) / DEGREE
        block.axes |= 1 << index
    control.points = True
    control.whole |= motion != 0 and found.strays
    return ""


def wanted(control: MacroControl, block: Block) -> list[float]:
    """The vector of a block as a unit vector in the workpiece; raises `Fault` if it has no length."""
    turned = np.array([dot(row, [block.get(letter) for letter in COMPONENTS]) for row in control.rotation])
    size = float(np.linalg.norm(turned))
    if size == 0.0:
        raise Fault(BAD_VECTOR, "the direction of the tool (I J K) has no length")
    return [float(part) for part in turned / size]


def note_choice(control: MacroControl, found: Postures) -> None:
    """Say which way was taken where another would do as well, or where a control may find another one nearer."""
    if len(found.ways) < 2 or found.at_pole:
        return
    here, (first, second) = found.here, found.ways
    by_one_axis = any(abs(second[k] - here[k]) < abs(first[k] - here[k]) for k in (0, 1))
    if found.leaves_pole or by_one_axis:
        control.warn(TURNED_TO, f"G43.5 is taken to turn to {found}, the nearest of several ways", CHOICE)
