"""CYCLE800: a tilted plane, and rotary axes that turn until the tool stands square to it.

X Y Z are then those of the tip in a frame that the workpiece carries, whatever the rotary axes do: the control works
the swivelled geometry into the frames. `p -> X0 + turn @ (X1 + p)`, the turns one after another about the axes as the
ones before have left them, in the order of the mode.
Source: Siemens, "SINUMERIK Operate, milling": CYCLE800, external programming (_FR, _TC, _ST, _MODE, _X0 ... _DIR).
"""

from __future__ import annotations

import numpy as np

from ncfix.program.moves import Kind
from ncfix.program.rs274.coordinates import DEGREE, LETTERS, X, Y, Z
from ncfix.program.sinumerik.affine import WORLD, Affine, shifted, turned
from ncfix.program.sinumerik.destination import End, Words
from ncfix.program.sinumerik.orientation import WAY
from ncfix.program.sinumerik.plans import Calling
from ncfix.program.sinumerik.state import Sinumerik
from ncfix.program.sinumerik.values import number
from ncfix.program.tree import Text

ORDER = {1: "X", 2: "Y", 3: "Z"}
"""The axes in the bits of the mode."""

PLACES = {"fr": 0, "st": 2, "mode": 3, "before": 4, "angles": 7, "after": 10, "dir": 13}
"""Where the arguments stand: retraction, state, mode, reference point, angles, zero point, direction."""

SWIVEL = "swivelling (CYCLE800)"
UNFOLLOWED = "a tilted plane (CYCLE800{}) is in force, which ncfix does not follow"
AFTER_SWIVEL = "where the axis {} stands after swivelling (CYCLE800) is not followed"


def swivel(control: Sinumerik, block: int, step: Calling) -> None:
    """CYCLE800: without arguments it takes the tilt away, with them it tilts the plane."""
    control.suspended.pop("tilt", None)
    if all(part is None or isinstance(part, Text) for part in step.written):
        untilted(control)
        return
    values = [number(value(control)) for value in step.arguments]
    written = zip(values, step.written, strict=True)
    if any(value is None and part is not None and not isinstance(part, Text) for value, part in written):
        control.refusal = control.refusal or "a tilted plane (CYCLE800) is known only at run time"
        return
    plane = Plane.of([value or 0.0 for value in values] + [0.0] * 16)
    if plane.fault:
        control.suspended["tilt"] = UNFOLLOWED.format(plane.fault)
        control.lose_all(AFTER_SWIVEL)
        return
    tilted(control, block, plane)


class Plane:
    """The arguments of CYCLE800.

    frame      of the plane
    adds       it is added to the plane in force
    direction  -1 or 1: which of two ways the rotary axes take
    retracts   the axes retract before they turn
    fault      why it is not followed, empty if it is
    """

    def __init__(self, frame: Affine, adds: bool, direction: int, retracts: bool, fault: str) -> None:
        self.frame = frame
        self.adds = adds
        self.direction = direction
        self.retracts = retracts
        self.fault = fault

    @classmethod
    def of(cls, values: list[float]) -> Plane:
        """From the numbers of the call."""
        mode, table = round(values[PLACES["mode"]]), round(values[PLACES["st"]])
        order = "".join(ORDER.get(mode >> shift & 3, "") for shift in (0, 2, 4))
        fault = ""
        if mode >> 6 or sorted(order) != ["X", "Y", "Z"]:
            fault = f", mode {mode}"
        direction = round(values[PLACES["dir"]])
        if direction not in (-1, 1):
            fault = fault or ", without turning the rotary axes"
        before, angles, after = (values[PLACES[name] : PLACES[name] + 3] for name in ("before", "angles", "after"))
        turn = turned(dict(zip(order, angles, strict=False)), order)
        frame = shifted(dict(enumerate(before))).then(turn).then(shifted(dict(enumerate(after))))
        return cls(frame, table % 10 == 1, direction, round(values[PLACES["fr"]]) != 0, fault)


def untilted(control: Sinumerik) -> None:
    """Out of the tilted plane; the rotary axes stand where they stood."""
    control.frames.swivel = WORLD
    control.modes.swivelled = False
    control.switch_tcp()


def tilted(control: Sinumerik, block: int, plane: Plane) -> None:
    """Into a tilted plane: the frame, then the turn of the rotary axes."""
    control.frames.swivel = control.frames.swivel.then(plane.frame) if plane.adds else plane.frame
    control.frames.program = WORLD
    control.modes.swivelled = True
    control.switch_tcp()
    axes = turn_square(control, plane)
    target, unknown = control.position[:], dict(control.unknown)
    for index, angle in axes.items():
        target[index] = angle
        unknown.pop(index, None)
    gone = [index for index in control.machine if (control.rotary[index] and index not in axes) or index in (X, Y, Z)]
    lost = dict(control.lost) | dict.fromkeys(gone, AFTER_SWIVEL)
    lost = {index: why for index, why in lost.items() if index not in axes}
    mask = sum(1 << index for index in control.machine if control.rotary[index])
    end = End(target, control.unknown_for(lost), lost)
    control.go(Kind.RAPID, Words(block, {}, {}, mask), end, control.modal.motion, passing=SWIVEL)


def turn_square(control: Sinumerik, plane: Plane) -> dict[int, float]:
    """Where the rotary axes stand when the tool is square to the plane; empty if that cannot be known."""
    pointing = control.pointing
    if pointing is None:
        return {}
    columns = [control.machine[column] for column in pointing.columns]
    here = [0.0 if index in control.unknown else control.position[index] for index in columns]
    normal = np.array([row[2] for row in control.rotation])
    ways = pointing.angles(normal, (here[0], here[1]))
    if not ways:
        return {}
    chosen = max(ways, key=lambda way: plane.direction * way[1]) if len(ways) > 1 else ways[0]
    if pointing.at_pole(normal):
        chosen = ways[0]
    angles = " ".join(f"{LETTERS[i]}{angle / DEGREE:.3f}" for i, angle in zip(columns, chosen, strict=True))
    control.warn(WAY, f"CYCLE800 is taken to turn to {angles}", "check it on the control: its swivel data decide")
    return dict(zip(columns, chosen, strict=True))
