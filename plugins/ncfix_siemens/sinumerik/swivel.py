"""CYCLE800: a tilted plane, and rotary axes that turn until the tool stands square to it.

X Y Z are then those of the tip in a frame that the workpiece carries, whatever the rotary axes do: the control works
the swivelled geometry into the frames. `p -> X0 + turn @ (X1 + p)`, the turns one after another about the axes as the
ones before have left them, in the order of the mode. Solid angles turn about Z, then about Y; projected angles are
those of the plane's traces in the planes of the axes.
Source: Siemens, "SINUMERIK Operate, milling": CYCLE800, external programming (_FR, _TC, _ST, _MODE, _X0 ... _DIR).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ncfix.control.coordinates import X, Y, Z, mask_of
from ncfix.control.expressions import number
from ncfix.control.frames import WORLD, Affine, projected, shifted, turned
from ncfix.control.moves import MotionKind, Pass, Passing
from ncfix.control.posture import WayRules, normal_of
from ncfix.control.tcp import rotary_at_zero
from ncfix.text.tree import StringLiteral
from ncfix_siemens.sinumerik.orientation import WAY
from ncfix_siemens.sinumerik.plans import Calling, plain_text
from ncfix_siemens.sinumerik.state import GEOMETRY, Sinumerik
from ncfix_siemens.sinumerik.values import BlockWordValues, End, ProgrammedMotion

ORDER = {1: "X", 2: "Y", 3: "Z"}
"""The axes in the bits of the mode."""

AXIS_BY_AXIS, SOLID, PROJECTED = 0, 1, 2
"""The kinds of angles in its bits 6 and 7."""

DESELECTED = "0"
"""The name of a swivel data set with which swivelling is deselected; the rotary axes stand where they stand."""

PLACES = {"fr": 0, "st": 2, "mode": 3, "before": 4, "angles": 7, "after": 10, "dir": 13}
"""Where the arguments stand: retraction, state, mode, reference point, angles, zero point, direction."""

SWIVEL = Passing(Pass.ALIGNMENT, "swivelling (CYCLE800)")
UNFOLLOWED = "a tilted plane (CYCLE800{}) is in force, which ncfix does not follow"
OVER_FRAME = (
    "a programmed frame (TRANS, ROT, ...) was in force at CYCLE800, and whether it stays is for machine data: "
    "take it out before"
)
STILL = ", without turning the rotary axes"
AFTER_SWIVEL = "where the axis {} stands after swivelling (CYCLE800) is not followed"


def swivel(control: Sinumerik, block: int, step: Calling) -> None:
    """CYCLE800: without arguments it takes the tilt away, with them it tilts the plane."""
    control.suspended.pop("tilt", None)
    if control.frames.programmable != WORLD:
        control.suspended["frame"] = OVER_FRAME
    if all(part is None or isinstance(part, StringLiteral) for part in step.written):
        untilted(control)
        return
    if len(step.written) > 1 and plain_text(step.written[1]) == DESELECTED:
        untilted(control)
        control.lose_axes(GEOMETRY, AFTER_SWIVEL)
        return
    values = [number(value(control)) for value in step.arguments]
    written = zip(values, step.written, strict=True)
    if any(value is None and part is not None and not isinstance(part, StringLiteral) for value, part in written):
        control.refusal = control.refusal or "a tilted plane (CYCLE800) is known only at run time"
        return
    plane = SwivelPlane.of([value or 0.0 for value in values] + [0.0] * 16)
    if plane.fault:
        control.suspended["tilt"] = UNFOLLOWED.format(plane.fault)
        control.lose_all(AFTER_SWIVEL)
        return
    if plane.direction:
        tilted(control, block, plane)
    else:
        level(control, plane)


class SwivelPlane:
    """The arguments of CYCLE800.

    frame      of the plane
    adds       it is added to the plane in force
    direction  -1 or 1: which of two ways the rotary axes take; 0: they stand still
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
    def of(cls, values: list[float]) -> SwivelPlane:
        """From the numbers of the call."""
        mode, table = round(values[PLACES["mode"]]), round(values[PLACES["st"]])
        direction = round(values[PLACES["dir"]])
        before, angles, after = (values[PLACES[name] : PLACES[name] + 3] for name in ("before", "angles", "after"))
        turn = turn_of(mode, angles)
        fault = f", mode {mode}" if turn is None else ""
        if table // 100 % 10:
            fault = fault or ", which aligns the tool"
        if direction not in (-1, 0, 1) or (direction == 0 and turn is not None and turn.rotation != WORLD.rotation):
            fault = fault or STILL
        frame = shifted(dict(enumerate(before))).then(turn or WORLD).then(shifted(dict(enumerate(after))))
        return cls(frame, table % 10 == 1, direction, round(values[PLACES["fr"]]) != 0, fault)


def turn_of(mode: int, angles: Sequence[float]) -> Affine | None:
    """How the plane is turned; None for modes that are not followed (rotary axes given directly)."""
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
    """Out of the tilted plane; the rotary axes stand where they stood."""
    control.frames = replace(control.frames, plane=WORLD)
    control.modes.swivelled = False
    control.switch_tcp()


def tilted(control: Sinumerik, block: int, plane: SwivelPlane) -> None:
    """Into a tilted plane: the frame, then the turn of the rotary axes."""
    whole = control.frames.plane.then(plane.frame) if plane.adds else plane.frame
    control.frames = replace(control.frames, plane=whole, programmable=WORLD)
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
    mask = mask_of(control.turning)
    end = End(target, control.axes_of(lost), lost)
    control.go(
        ProgrammedMotion(
            MotionKind.RAPID, BlockWordValues(block, {}, {}, mask), end, control.modal.motion, passing=SWIVEL
        )
    )


def level(control: Sinumerik, plane: SwivelPlane) -> None:
    """A plane that is not turned, while the rotary axes stand still: as they stand, the tool has to be square to it."""
    control.use_start_positions(control.turning)
    whole = control.frames.plane.then(plane.frame) if plane.adds else plane.frame
    if whole.rotation != WORLD.rotation or not rotary_at_zero(control, control.position, control.unknown):
        control.suspended["tilt"] = UNFOLLOWED.format(STILL)
        control.lose_all(AFTER_SWIVEL)
        return
    control.frames = replace(control.frames, plane=whole, programmable=WORLD)
    control.modes.swivelled = True
    control.switch_tcp()
    if plane.retracts:
        control.lose_axes(GEOMETRY, AFTER_SWIVEL)


def turn_square(control: Sinumerik, plane: SwivelPlane) -> dict[int, float]:
    """Where the rotary axes stand when the tool is square to the plane; empty if that cannot be known.

    An axis of which it is not known where it stands counts as standing at zero.
    """
    if control.posture.pointing is None:
        return {}
    outer, inner = (control.machine[column] for column in control.posture.pointing.columns)
    here = [0.0 if index in control.unknown else control.position[index] for index in (outer, inner)]
    found = control.postures(normal_of(control.rotation), WayRules(sense=plane.direction), (here[0], here[1]))
    if found is None or not found.ways:
        return {}
    control.warn(WAY, f"CYCLE800 is taken to turn to {found}", "check it on the control: its swivel data decide")
    return found.chosen
