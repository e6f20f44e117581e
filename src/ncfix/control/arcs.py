"""Geometry of programmed arcs in their plane: centre, closure and sweep angle.

Pure functions. Lengths in mm, angles in rad; a point is (first, second) coordinate of the plane, relative to the start
of the arc. The rules and tolerances are those of LinuxCNC (facts read in interp_arc.cc and interp_internal.hh, checked
with `rs274`).
"""

from __future__ import annotations

import math

from ncfix.control.expressions import Fault

Point = tuple[float, float]

CLOCKWISE, COUNTER = 20, 30
"""Motion codes of clockwise and counter-clockwise arcs (G2, G3), in tenths."""

ARC_FAULT = "NCF220"
MIN_RADIUS_MM = 0.00127
"""Smallest radius of an arc, mm, and largest distance by which an R arc may miss its end (LinuxCNC: 0.00005 inch)."""

SEMICIRCLE_TOLERANCE = 1e-12
"""An R arc whose half chord is within this relative distance of the radius is taken as a semicircle."""

MIN_SWEEP_RAD = 1e-6
"""Smallest sweep, rad: below it, an arc is a full circle."""

MAX_CLOSURE_FACTOR = 100.0
"""An arc that misses its end by more than this multiple of the closure tolerance is refused, whatever its radius."""


def check_closure(centre: Point, end: Point, absolute: float, relative: float) -> None:
    """Raise `Fault` if the control would refuse the arc because its radii at start and end differ.

    It refuses if they differ by more than `absolute` (mm) and also by more than `relative` times the greater radius, or
    by more than a hundred times `absolute`.
    """
    start_radius = math.hypot(*centre)
    end_radius = math.hypot(end[0] - centre[0], end[1] - centre[1])
    if min(start_radius, end_radius) < MIN_RADIUS_MM:
        raise Fault(ARC_FAULT, "the arc has no radius: its centre is at its start or end")
    gap = abs(start_radius - end_radius)
    greater = max(start_radius, end_radius)
    if gap > absolute * MAX_CLOSURE_FACTOR or (gap > absolute and gap > relative * greater):
        raise Fault(
            ARC_FAULT,
            f"the arc does not close: its radius is {start_radius:.4f} mm at the start and {end_radius:.4f} mm"
            f" at the end ({gap:.4f} apart, {absolute:.4f} allowed)",
            "check the centre words, and whether they count from the start of the arc or from the zero point",
        )


def centre_from_radius(end: Point, radius: float, *, clockwise: bool) -> Point:
    """The centre of an arc given by R; negative R selects the longer arc. Raises `Fault` if there is none."""
    chord = math.hypot(*end)
    if chord == 0.0:
        raise Fault(ARC_FAULT, "an arc given by R must end elsewhere than it starts", "a full circle needs I J K")
    if chord / 2 - abs(radius) > MIN_RADIUS_MM or radius == 0.0:
        raise Fault(ARC_FAULT, f"the radius {abs(radius):.4f} mm is too small to reach the arc's end")
    half = min(chord / 2, abs(radius))
    if half / abs(radius) > 1 - SEMICIRCLE_TOLERANCE:
        half = abs(radius)
    height = math.sqrt(max(radius * radius - half * half, 0.0))
    side = -1.0 if clockwise == (radius > 0) else 1.0
    return end[0] / 2 - side * height * end[1] / chord, end[1] / 2 + side * height * end[0] / chord


def sweep_angle(centre: Point, end: Point, turns: int, *, clockwise: bool) -> float:
    """Sweep angle, rad, positive counter-clockwise, with `turns` - 1 additional full turns."""
    start_angle = math.atan2(-centre[1], -centre[0])
    end_angle = math.atan2(end[1] - centre[1], end[0] - centre[0])
    angle = start_angle - end_angle if clockwise else end_angle - start_angle
    while angle < MIN_SWEEP_RAD:
        angle += 2 * math.pi
    if angle > 2 * math.pi + MIN_SWEEP_RAD:
        angle -= 2 * math.pi
    angle += 2 * math.pi * (turns - 1)
    return -angle if clockwise else angle
