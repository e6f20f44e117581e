"""The parts of a machine: axes, topology, tool, and error effects. Names follow ISO 230-1.

`EYX` is the error motion of axis X along Y, `EAC` the tilt of axis C about X: they change with the axis position.
`EC0Y`, `EX0C` are location errors: direction and place of an axis line. `S` is the spindle, the end of the tool branch.
docs/conventions.md has the frames and signs.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import field, fields
from typing import Any

import numpy as np

from ncfix.arrays import Array
from ncfix.machine import se3
from ncfix.machine.basis import Basis, ConstantBasis
from ncfix.values import frozen

Vector = tuple[float, float, float]
Triad = tuple[Vector, Vector, Vector]
ORIGIN: Vector = (0.0, 0.0, 0.0)
DEGREE = math.pi / 180
BASE_AXES: Triad = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def degrees(angle: float) -> float:
    """An angle in degrees, as short as possible, that converts back to exactly this value in rad."""
    near = math.degrees(angle)
    candidates = [round(near, 9), near, math.nextafter(near, math.inf), math.nextafter(near, -math.inf)]
    return next((each for each in candidates if each * DEGREE == angle), near)


@frozen
class Axis:
    """A prismatic or revolute joint. Geometry in the base frame with all axes at zero.

    name            the axis letter
    rotary          revolute (rad) rather than prismatic (mm)
    workpiece_side  it carries the workpiece rather than the tool
    direction       unit vector of the motion of its body in the positive sense; for a rotary axis right-handed
    point           a point on the axis line, mm
    range           lowest and highest position, mm or rad; infinite if endless or not given
    error_axes      rows: the directions along and about which its errors act
    moving_frame    the error axes turn with the axis itself
    pitch           pitch of its screw, mm, if known
    """

    name: str
    rotary: bool
    workpiece_side: bool
    direction: Vector
    point: Vector = ORIGIN
    range: tuple[float, float] = (-np.inf, np.inf)
    error_axes: Triad = BASE_AXES
    moving_frame: bool = False
    pitch: float | None = None

    @property
    def endless(self) -> bool:
        """Whether it is a rotary axis without limits: 370 degrees is the same place as 10 degrees."""
        return self.rotary and not np.isfinite(self.range).any()

    @property
    def reference(self) -> Vector:
        """Default reference point of effects, mm: the axis point of a rotary axis, the base origin for a linear one."""
        return self.point if self.rotary else ORIGIN

    @property
    def zero_sense(self) -> float:
        """Factor from a location error along or about the axis to the zero offset that is added to its position.

        It is -1 if the error axis points against `direction`, so that the offset counts as written in the file. Of an
        error that is only partly along the axis, the projection on `direction` counts.
        """
        against = np.asarray(self.error_axes) @ np.asarray(self.direction) < -1 + 1e-9
        return -1.0 if against.any() else 1.0

    @property
    def unit(self) -> float:
        """Internal units per unit of the machine file: rad per degree, or 1."""
        return DEGREE if self.rotary else 1.0

    def along(self, component: str) -> float:
        """The cosine of the angle between the axis and the error axis of a component, X to C: 1 along, 0 across."""
        return float(np.asarray(self.error_axes[COMPONENTS.index(component) % 3]) @ np.asarray(self.direction))

    def owns(self, component: str) -> bool:
        """Whether a component is the positioning of the axis: along a linear axis, about a rotary one.

        That depends on the error axes, not on the letter: for a W along Z it is Z. For an axis that is skewed to all
        error axes, it is the component of its own letter.
        """
        near = abs(self.along(component))
        return (component in LINEAR) != self.rotary and (
            near > 1 - SKEWED or (component == self.name and near > SKEWED)
        )

    @property
    def screw(self) -> tuple[Array, Array]:
        """The twist of unit motion (v, w) about the base origin."""
        direction = np.asarray(self.direction)
        if self.rotary:
            return np.cross(self.point, direction), direction
        return direction, np.zeros(3)

    def motion(self, position: Array) -> Array:
        """(..., 4, 4) the nominal motion of its body at positions (...), mm or rad, in the base frame."""
        position = np.asarray(position, dtype=np.float64)
        displacement = position[..., None] * np.asarray(self.direction)
        return se3.turn(displacement, self.point) if self.rotary else se3.shift(displacement)

    def file_keys(self) -> dict[str, Any]:
        """The keys and values of its table in a machine file; None for keys that are left out."""
        low, high = self.range
        limits = None if math.isinf(low) else [degrees(low), degrees(high)] if self.rotary else [low, high]
        return {
            "type": "rotary" if self.rotary else "linear",
            "direction": self.direction,
            "point": None if self.point == ORIGIN else self.point,
            "range": limits,
            "error_axes": None if self.error_axes == BASE_AXES else self.error_axes,
            "error_frame": "moving" if self.moving_frame else None,
            "pitch": self.pitch,
        }


@frozen
class GaugeLine:
    """The end of the tool branch in the base frame with all axes at zero.

    direction  unit vector from the tool tip to the gauge line
    point      the centre of the gauge line, mm
    """

    direction: Vector = (0.0, 0.0, 1.0)
    point: Vector = field(default=ORIGIN)

    def tip(self, length: Array) -> Array:
        """(..., 3) the tip of tools of length (...), mm."""
        return np.asarray(self.point) - np.asarray(length)[..., None] * np.asarray(self.direction)


@frozen
class Topology:
    """The axes on both branches, in the order of the topology string; `spindle`: S is named before t."""

    workpiece: tuple[str, ...]
    tool: tuple[str, ...]
    spindle: bool = False

    @property
    def axes(self) -> tuple[str, ...]:
        """All axes, from the workpiece to the tool."""
        return self.workpiece + self.tool

    def __str__(self) -> str:
        spindle = ("S",) if self.spindle else ()
        return " ".join(("w", *self.workpiece, "F", *self.tool, *spindle, "t"))


def parse_topology(text: str) -> tuple[Topology | None, list[str]]:
    """The topology of a string, or None and its faults. Blanks between the letters may be left out."""
    letters = text.split() if " " in text.strip() else list(text.strip())
    joints, wrong = letters[1:-1], []
    if letters[:1] != ["w"]:
        wrong.append("it must start with w, the workpiece")
    if letters[-1:] != ["t"]:
        wrong.append("it must end with t, the tool")
    if letters.count("F") != 1:
        wrong.append(f"the foundation F must be named once, not {letters.count('F')} times")
    if "S" in joints[:-1]:
        wrong.append("the spindle S can only stand last, before t")
    strange = [each for each in joints if not (len(each) == 1 and "A" <= each <= "Z")]
    wrong += [f"{each!r} is not an axis letter" for each in strange]
    twice = sorted({each for each in joints if joints.count(each) > 1 and each != "F"})
    wrong += [f"axis {each} is named twice" for each in twice]
    if wrong:
        return None, wrong
    foundation = joints.index("F")
    workpiece, tool = tuple(joints[:foundation]), tuple(joints[foundation + 1 :])
    spindle = tool[-1:] == ("S",)
    return Topology(workpiece, tool[:-1] if spindle else tool, spindle), []


COMPONENTS = "XYZABC"
"""X Y Z: translations along the error axes, mm. A B C: rotations about them, rad."""
SPINDLE = "S"
NAME = re.compile(r"E([XYZABC])(0?)([A-Z])")

Matrix = tuple[tuple[float, ...], ...]


@frozen
class Effect:
    """A component of the error of one joint: `sum coefficients * basis(u)`, u = (x - center) / scale.

    name             ISO 230-1 component
    coefficients     mm (translations) or rad (rotations)
    basis            the functions
    center, scale    centre and scale of u, in the unit of the machine file
    covariance       covariance matrix of the coefficients
    reference        the point at which rotations cause no translation, base frame with all axes at zero, mm;
                     None: the axis point of a rotary axis, the base origin for a linear one
    range            range of x: outside it the end values hold; None: the range of the axis
    input            the signal x if it is not the axis position: another axis, or a name in `State.inputs`
    times            a second signal whose u multiplies the sum
    times_center, times_scale   centre and scale of that u; None: `center` and `scale`
    time_constant_s  time constant, s, of a first-order lag through which the input acts; None: no lag
    carried          a location error that moves the whole body, rather than the axis line only
    """

    name: str
    coefficients: tuple[float, ...]
    basis: Basis = ConstantBasis()
    center: float = 0.0
    scale: float = 1.0
    covariance: Matrix | None = None
    reference: Vector | None = None
    range: tuple[float, float] | None = None
    input: str | None = None
    times: str | None = None
    times_center: float | None = None
    times_scale: float | None = None
    time_constant_s: float | None = None
    carried: bool = False

    @property
    def component(self) -> int:
        """The index of its component: 0 to 5 for X Y Z A B C."""
        return COMPONENTS.index(self.name[1])

    @property
    def joint(self) -> str:
        """The letter of its axis, or `S` for the spindle."""
        return self.name[-1]

    @property
    def rotational(self) -> bool:
        """Whether it is an angle."""
        return self.component >= 3

    @property
    def location(self) -> bool:
        """Whether it is a location error rather than an error motion."""
        return len(self.name) == 4

    @property
    def signal(self) -> str | None:
        """The name of the signal on which its basis depends; None if there is none."""
        if self.input is not None:
            return self.input
        return self.joint if self.basis.needs_signal else None

    @property
    def active(self) -> bool:
        """Whether any coefficient is not zero."""
        return any(self.coefficients)

    def file_keys(self) -> dict[str, Any]:
        """The keys and values of its table in a machine file, in customary order; None for keys that are left out."""
        basis = self.basis
        own = {each: getattr(basis, each.name) for each in fields(basis)}  # type: ignore[arg-type]
        parameters = {
            each.name: None if isinstance(value, str) and value == each.default else value
            for each, value in own.items()
        }
        return {
            "name": self.name,
            "basis": None if basis.name == "constant" else basis.name,
            "input": self.input,
            "time_constant_s": self.time_constant_s,
            **parameters,
            "center": self.center or None,
            "scale": None if self.scale == 1 else self.scale,
            "range": self.range,
            "times": self.times,
            "times_center": self.times_center,
            "times_scale": self.times_scale,
            "coefficients": self.coefficients,
            "covariance": self.covariance,
            "reference": self.reference,
            "carried": self.carried or None,
        }


SKEWED = 0.01
"""Cosine of an angle, or one minus it, above which an axis counts as skewed."""

LINEAR = "XYZ"
TURNS_ABOUT = dict(zip("ABC", LINEAR, strict=True))
"""Rotation letter -> the direction that it turns about."""
IDLE = "no effect without `carried`"
"""Remark on a location error that moves an axis line only along or about itself."""


JOINTS = 3
"""Least number of rotary axes in one branch of an arm."""


def is_arm(axes: Iterable[Axis]) -> bool:
    """Whether several rotary joints (`JOINTS`) carry the tool or the workpiece, as in a robot."""
    held = [each.workpiece_side for each in axes if each.rotary]
    return max(held.count(True), held.count(False)) >= JOINTS


def component_title(name: str, axis: Axis | None = None) -> str:
    """The title of an ISO 230-1 component, e.g. "straightness of X in Y".

    Without the axis, its kind follows from the letter: X Y Z U V W are linear, others rotary; A B C turn about X Y Z.
    """
    component, zero, joint = _parts(name)
    about = TURNS_ABOUT.get(component)
    if joint == SPINDLE:
        if about:
            return f"{'tilt' if zero else 'tilt motion'} of the spindle about {about}"
        return f"{'place' if zero else 'motion'} of the spindle in {component}"
    axis = axis or _by_letter(joint)
    if zero:
        return _location_title(component, axis)
    near = abs(axis.along(component))
    if axis.owns(component):
        return f"{'angular ' if axis.rotary else ''}positioning of {joint}"
    if about:
        return f"tilt of {joint} about {about}" if axis.rotary or near < 1 - SKEWED else f"roll of {joint}"
    if not axis.rotary:
        return f"straightness of {joint} in {component}"
    sense = "axial " if near > 1 - SKEWED else "radial " if near < SKEWED else ""  # neither for a skewed axis
    return f"{sense}motion of {joint} in {component}"


def _by_letter(joint: str) -> Axis:
    """The axis for which a letter usually stands, along or about a base axis."""
    place = "XYZABCUVW".find(joint)
    return Axis(joint, joint not in "XYZUVW", True, BASE_AXES[place % 3] if place >= 0 else ORIGIN)


def _parts(name: str) -> tuple[str, str, str]:
    """Component, "0" for a location error or "", and joint, of the name of an effect."""
    match = NAME.fullmatch(name)
    if match is None:
        raise ValueError(f"{name!r} is not the name of an ISO 230-1 component")
    component, zero, joint = match.groups()
    return component, zero, joint


def _location_title(component: str, axis: Axis) -> str:
    joint, about, own = axis.name, TURNS_ABOUT.get(component), abs(axis.along(component)) > 1 - SKEWED
    if axis.owns(component) and (own or not axis.rotary):
        return f"zero offset of {joint}"
    if about:
        if own:
            return f"roll of {joint} as a whole; {IDLE}"
        return f"{'tilt of the axis line' if axis.rotary else 'direction'} of {joint}, turned about {about}"
    if not axis.rotary:
        return f"offset of the line of {joint} in {component}; {IDLE}"
    if own:
        return f"offset of {joint} along its axis line, {component}; {IDLE}"
    return f"offset of the axis line of {joint} in {component}"


def component_names(joints: Iterable[str] = "XYZABC" + SPINDLE) -> tuple[str, ...]:
    """The names of all components of these joints: for each joint, error motions first, then location errors."""
    return tuple(f"E{component}{zero}{joint}" for joint in joints for zero in ("", "0") for component in COMPONENTS)


def squareness_meaning(name: str) -> str:
    """The effect of a squareness on the angle between two linear axes, e.g. "+X to +Y is 90 deg + EC0Y".

    Empty unless the name is one of EB0X EC0X EA0Y EC0Y EA0Z EB0Z.
    """
    match = NAME.fullmatch(name)
    if match is None or match[1] not in TURNS_ABOUT or not match[2] or match[3] not in LINEAR:
        return ""
    about, axis = TURNS_ABOUT[match[1]], match[3]
    if about == axis:
        return ""
    (other,) = set(LINEAR) - {about, axis}
    turns_towards_other = (LINEAR.index(axis) - LINEAR.index(about)) % 3 == 1
    sign = "-" if turns_towards_other else "+"
    return f"+{min(axis, other)} to +{max(axis, other)} is 90 deg {sign} {name}"


def instruments_for(name: str) -> str:
    """The kinds of measurement in which a component is visible, see docs/formats.md."""
    component, zero, joint = _parts(name)
    if joint == SPINDLE:
        return "tcp tcp6 probe points" if component in LINEAR else "tcp6 points; others with two tool lengths"
    return "tcp tcp6 probe points length" + ("" if zero else " axis")


def usual_basis(name: str, axis: Axis | None = None) -> str:
    """The usual basis of a component, which is identifiable. Without the axis, its kind is guessed from the letter."""
    match = NAME.fullmatch(name)
    if match is None or match[2] or match[3] == SPINDLE:
        return "constant"
    component, _, joint = match.groups()
    axis = axis or _by_letter(joint)
    if axis.rotary:
        return f"fourier order {1 if abs(axis.along(component)) > 1 - SKEWED else 2} up"
    return f"polynomial degree {2 if component in LINEAR and not axis.owns(component) else 1} up"


def large_size(name: str) -> str:
    """A size, mm or rad over the travel, that is large for a machine tool in use, as text; "" for an unknown name."""
    match = NAME.fullmatch(name)
    if match is None:
        return ""
    component, zero, _ = match.groups()
    if component in LINEAR:
        return "0.1" if zero else "0.03"
    return "0.0002" if zero else "0.0001"
