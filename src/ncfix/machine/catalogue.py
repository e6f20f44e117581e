"""What the names of error components mean: ISO 230-1, in words. docs/conventions.md has the frames and signs."""

from __future__ import annotations

from ncfix.machine.axis import Axis
from ncfix.machine.effect import COMPONENTS, NAME, SPINDLE

SKEWED = 0.01
"""Cosine, or one minus it, from which an axis counts as skewed."""

LINEAR = "XYZ"
TURNS_ABOUT = dict(zip("ABC", LINEAR, strict=True))
"""Rotation letter -> the direction that it turns about."""
IDLE = "no effect unless carried"
"""Said of what leaves an axis line in itself."""


def title(name: str, axis: Axis | None = None) -> str:
    """What an ISO 230-1 component is, e.g. "straightness of X in Y".

    Without the axis it goes by the letter: X Y Z U V W are linear, others rotary, and A B C turn about X Y Z.
    """
    match = NAME.fullmatch(name)
    if match is None:
        raise ValueError(f"{name!r} is not the name of an ISO 230-1 component")
    component, zero, joint = match.groups()
    if joint == SPINDLE:
        return _spindle(component, bool(zero))
    turns = axis.rotary if axis else joint not in "XYZUVW"
    if zero:
        return _location(component, joint, turns)
    return _rotary_motion(component, joint, axis) if turns else _linear_motion(component, joint)


def names(joints: str = "XYZABC" + SPINDLE) -> tuple[str, ...]:
    """The components of these joints: error motions first, then location errors."""
    return tuple(f"E{component}{zero}{joint}" for joint in joints for zero in ("", "0") for component in COMPONENTS)


def squareness(name: str) -> str:
    """What the location error of a linear axis does to the angle to the axis beside it, e.g. "X-Y is 90 deg + EC0Y".

    Empty where the name is none of EB0X EC0X EA0Y EC0Y EA0Z EB0Z.
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


def _linear_motion(component: str, joint: str) -> str:
    if component == joint:
        return f"positioning of {joint}"
    if component in LINEAR:
        return f"straightness of {joint} in {component}"
    if TURNS_ABOUT[component] == joint:
        return f"roll of {joint}"
    return f"tilt of {joint} about {TURNS_ABOUT[component]}"


def _rotary_motion(component: str, joint: str, axis: Axis | None) -> str:
    if component == joint:
        return f"angular positioning of {joint}"
    if component in LINEAR:
        return f"{_sense(component, joint, axis)}motion of {joint} in {component}"
    return f"tilt of {joint} about {TURNS_ABOUT[component]}"


def _sense(component: str, joint: str, axis: Axis | None) -> str:
    """Whether a direction is that of the axis line or across it; neither for a skewed axis."""
    if axis is None:
        return "axial " if component == TURNS_ABOUT.get(joint) else "radial "
    pairs = zip(axis.error_axes[LINEAR.index(component)], axis.direction, strict=True)
    along = abs(sum(a * b for a, b in pairs))
    return "axial " if along > 1 - SKEWED else "radial " if along < SKEWED else ""


def _location(component: str, joint: str, rotary: bool) -> str:
    if component == joint:
        return f"zero offset of {joint}"
    if component in LINEAR:
        if not rotary:
            return f"offset of the line of {joint} in {component}; {IDLE}"
        if component == TURNS_ABOUT.get(joint):
            return f"offset of {joint} along its axis line, {component}; {IDLE}"
        return f"offset of the axis line of {joint} in {component}"
    if not rotary and TURNS_ABOUT[component] == joint:
        return f"roll of {joint} as a whole; {IDLE}"
    what = "tilt of the axis line" if rotary else "direction"
    return f"{what} of {joint}, turned about {TURNS_ABOUT[component]}"


def _spindle(component: str, location: bool) -> str:
    what = "place" if location else "motion"
    if component in LINEAR:
        return f"{what} of the spindle in {component}"
    return f"{'tilt' if location else 'tilt motion'} of the spindle about {TURNS_ABOUT[component]}"


def instruments(name: str) -> str:
    """The kinds of measurement that see a component, docs/formats.md."""
    match = NAME.fullmatch(name)
    if match is None:
        raise ValueError(f"{name!r} is not the name of an ISO 230-1 component")
    component, zero, joint = match.groups()
    if joint == SPINDLE:
        return "tcp tcp6 probe points" if component in LINEAR else "tcp6 points; others with two tool lengths"
    return "tcp tcp6 probe points length" + ("" if zero else " axis")


def usual_basis(name: str) -> str:
    """The basis that suits a component: what identifiability leaves to it."""
    match = NAME.fullmatch(name)
    if match is None or match[2] or match[3] == SPINDLE:
        return "constant"
    component, _, joint = match.groups()
    if joint not in "XYZUVW":
        along = component in (joint, TURNS_ABOUT.get(joint))
        return f"fourier order {1 if along else 2} up"
    return "polynomial degree 2 up" if component in LINEAR and component != joint else "polynomial degree 1 up"


def much(name: str) -> str:
    """A size, mm or rad over the travel, that is large for a machine tool in use."""
    match = NAME.fullmatch(name)
    if match is None:
        return ""
    component, zero, _ = match.groups()
    if component in LINEAR:
        return "0.1" if zero else "0.03"
    return "0.0002" if zero else "0.0001"
