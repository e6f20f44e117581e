"""Tilted working planes: G68.2 sets a frame in the workpiece, G53.1 turns the tool square to it, G69 ends it.

X Y Z are then those of the tool tip in a frame that turns with the workpiece, whatever the rotary axes do: the control
computes the linear axes from the tip as it does under tool-centre-point control.
Source: Fanuc 30i operator's manual (machining centre), "Tilted working plane indexing".
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.program.fanuc.squaring import SQUARED, turned_square
from ncfix.program.moves import Kind
from ncfix.program.rs274 import tcp
from ncfix.program.rs274.arithmetic import whole
from ncfix.program.rs274.coordinates import (
    IDENTITY,
    LETTERS,
    PLANES,
    Rotation,
    X,
    Y,
    Z,
    about,
    product,
    zeros,
)
from ncfix.program.rs274.settings import unfollowed
from ncfix.program.rs274.shifts import rotate_system

if TYPE_CHECKING:
    from ncfix.program.fanuc.control import MacroControl
    from ncfix.program.rs274.control import Block

TILT, CANCEL = 682, 690
EULER, ROLL_PITCH_YAW = 0, 1
ORDER = 123
"""X, Y, Z: the order of the turns of G68.2 P1, if its Q does not name another."""

ABOUT = {"1": PLANES[190], "2": PLANES[180], "3": PLANES[170]}
"""The plane in which a turn about X, Y or Z is."""

ALIGNMENT = "tool axis alignment (G53.1)"
NOT_SOLVED = "where the axis {} stands after the tool was turned square to the plane (G53.1) is not known"
TURNED_TO = "NCF243"


def tilt(control: MacroControl, block: Block, code: int) -> None:
    """G68.2 X Y Z I J K: the frame at X Y Z, turned by I J K; forms that are not followed are refused."""
    form = whole(block.get("P", EULER), "P of G68.2")
    order = str(whole(block.get("Q", ORDER), "Q of G68.2"))
    known = form == EULER or (form == ROLL_PITCH_YAW and sorted(order) == ["1", "2", "3"])
    if control.mirrored or code != TILT or not known:
        unfollowed(control, block, code)
        return
    if block.runtime:
        control.refusal = control.refusal or "the tilted plane (G68.2) is known only at run time"
    angles = block.get("I"), block.get("J"), block.get("K")
    end(control)
    control.offsets.rotation = euler(*angles) if form == EULER else in_order(order, angles)
    feature = zeros()
    for index in (X, Y, Z):
        feature[index] = control.modal.unit * block.get(LETTERS[index])
    control.offsets.feature = feature
    control.tilted = True
    tcp.switch(control, control.offsets.tool, True)
    control.refresh()


def euler(first: float, second: float, third: float) -> Rotation:
    """Turned about Z, then about the new X, then about the new Z, degrees."""
    return product(about(PLANES[170], first), product(about(PLANES[190], second), about(PLANES[170], third)))


def in_order(order: str, angles: tuple[float, float, float]) -> Rotation:
    """Turned about X, Y and Z of the workpiece in an order such as "123", degrees."""
    rotation = IDENTITY
    for axis in order:
        rotation = product(about(ABOUT[axis], angles[int(axis) - 1]), rotation)
    return rotation


def rotate(control: MacroControl, block: Block, code: int) -> None:
    """G68 and G69; G68 with I J K turns in space and is not followed, nor is any in mirrored coordinates."""
    if control.mirrored:
        unfollowed(control, block, CANCEL if code == CANCEL else TILT)
        return
    if code == CANCEL:
        end(control)
    elif block.values.keys() & {"I", "J", "K"}:
        unfollowed(control, block, TILT)
        return
    rotate_system(control, block, code)


def end(control: MacroControl) -> None:
    """Out of the tilted plane."""
    if not control.tilted:
        return
    control.tilted = False
    control.offsets.rotation, control.offsets.feature = IDENTITY, zeros()
    tcp.switch(control, control.offsets.tool, control.setup.tcp or control.tip_control)
    control.refresh()


# -- G53.1 ------------------------------------------------------------------------------------------------------------


def align(control: MacroControl, block: Block, code: int) -> None:
    """G53.1: the rotary axes turn so that the tool stands square to the plane; the linear axes stand still."""
    turning = [index for index in control.machine if control.rotary[index]]
    target, unknown = control.position[:], dict(control.unknown)
    found = turned_square(control) if turning else None
    if turning and found is None:
        unknown |= {index: NOT_SOLVED for index in (*turning, X, Y, Z) if index in control.machine}
    elif found is not None:
        target = found.position
        if found.several:
            angles = " ".join(f"{LETTERS[index]}{found.degrees[index]:.3f}" for index in turning)
            control.warn(TURNED_TO, f"G53.1 is taken to turn to {angles}, the nearest of several ways", SQUARED)
    control.move(Kind.RAPID, 0, target, unknown, control.modal.motion, passing=ALIGNMENT)
