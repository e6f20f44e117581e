"""In which direction the last motion ended: an arc by CT goes on in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.control.coordinates import Vector, X, Y, Z
from ncfix.control.moves import Arc, MotionKind

if TYPE_CHECKING:
    from ncfix_siemens.sinumerik.destination import ProgrammedMotion
    from ncfix_siemens.sinumerik.state import Sinumerik


def note(control: Sinumerik, leg: ProgrammedMotion, *, follows: bool) -> None:
    """Keep the direction in which a motion is about to end; None where it is not known, or not followed."""
    end, arc = leg.end, leg.arc
    if leg.kind == MotionKind.DWELL:
        return
    step = [b - a for a, b in zip(control.position, end.target, strict=True)]
    if not follows or any(index in control.unknown or index in end.unknown for index in (X, Y, Z)):
        control.heading = None
    elif arc is not None:
        control.heading = control.in_frame(departing(arc, end.target, step))[:3]
    elif any(step[:3]):
        control.heading = control.in_frame(step)[:3]
    elif any(step):
        control.heading = None


def note_stretch(control: Sinumerik) -> None:
    """Keep the direction in which the last of many motions of the fast lane ended, as `note` does of single ones."""
    stretch = control.builder.latest
    if stretch is None:
        return
    steps, (turned, arc) = stretch.end - stretch.start, control.builder.latest_arc() or (-1, None)
    rows = range(len(steps) - 1, -1, -1)
    last = next((row for row in rows if row == turned or steps[row].any()), -1)
    if arc is not None and last == turned:
        control.heading = departing(arc, stretch.end[last].tolist(), steps[last].tolist())[:3]
    elif last >= 0:
        control.heading = steps[last, :3].tolist() if steps[last, :3].any() else None


def departing(arc: Arc, end: Vector, step: Vector) -> Vector:
    """The direction in which an arc or helix that makes `step` ends, in commands; of any length."""
    nx, ny, nz = arc.normal
    x, y, z = (end[i] - arc.centre[i] for i in range(3))
    rise = nx * step[0] + ny * step[1] + nz * step[2]
    round_ = ny * z - nz * y, nz * x - nx * z, nx * y - ny * x
    return [arc.sweep * part + rise * across for part, across in zip(round_, arc.normal, strict=True)]
