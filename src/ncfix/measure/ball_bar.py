"""What a ball-bar test says by itself: where the centre is, size and form, and the figures of ISO 230-4 for circles.

The set-up (u, v, w) is taken off by least squares (Esmaeili Marzdashti 2021, Eq. 15-17); what is left of the
radius has a mean, the size, and a shape, the form. A test whose places lie in one plane is a circle: the two ways round
it are told apart, and compared.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ncfix.machine import Machine
from ncfix.measure.lengths import BallBar
from ncfix.measure.measurement import Array, Measurement

FLAT = 1e-3
"""Places whose third extent is this share of the first lie in a plane."""
STEPS = 360
"""Angles at which the two ways round are compared."""
UM = 1e3


@dataclass(frozen=True, slots=True)
class Circle:
    """ISO 230-4, um. `G` circular deviation of each way round, `Gb` of both, `H` hysteresis, `F` radial deviation.

    Clockwise and the other way are as seen against the normal of the plane that points up (+z, else +y, else +x); NaN
    for a way that was not run. D: mean radius of both ways minus the nominal one. All about the least-squares centre.
    """

    G_clockwise: float
    G_counter: float
    Gb: float
    H: float
    F_max: float
    F_min: float
    D: float


@dataclass(frozen=True, slots=True)
class BallBarFigures:
    """One set of a ball-bar test, um.

    name       of the set
    centre     (u, v, w), where the centre ball was off, in axes of the workpiece
    size       mean radius minus the nominal one
    form       largest minus smallest radius after that; form_rms its standard deviation
    radial     largest minus smallest radius as measured
    circle     if the places lie in a plane
    """

    name: str
    centre: tuple[float, float, float]
    size: float
    form: float
    form_rms: float
    radial: float
    circle: Circle | None


def figures(measurement: Measurement, machine: Machine) -> Iterator[BallBarFigures]:
    """The figures of each set of a ball-bar measurement; nothing for other measurements."""
    if measurement.kind != "length" or "radius" not in measurement.columns or "length" not in measurement.columns:
        return
    seen = BallBar(measurement, machine)
    off = measurement.columns["length"] - seen.radius
    for index, name in enumerate(seen.set_names):
        rows = np.flatnonzero(seen.set_index == index)
        yield _figures(name, seen.way[rows], off[rows])


def _figures(name: str, way: Array, off: Array) -> BallBarFigures:
    """`way` (n, 3): unit vectors from the centre; `off` (n,): measured minus nominal radius, mm."""
    flat = _normal(way)
    columns = -way if flat is None else -way @ _in_plane(flat)
    fitted = np.linalg.lstsq(np.column_stack([columns, np.ones(len(off))]), off, rcond=None)[0]
    centre = fitted[:-1] if flat is None else _in_plane(flat) @ fitted[:-1]
    left = UM * (off - columns @ fitted[:-1])
    size = float(UM * fitted[-1])
    u, v, w = (float(UM * value) for value in centre)
    form = left - size
    circle = None if flat is None else _circle(way @ _in_plane(flat), left)
    return BallBarFigures(
        name, (u, v, w), size, float(np.ptp(form)), float(form.std()), float(UM * np.ptp(off)), circle
    )


def _normal(way: Array) -> Array | None:
    """The normal of the plane in which the places lie, pointing up; None if they do not lie in one."""
    _, values, axes = np.linalg.svd(way, full_matrices=False)
    if values[2] > FLAT * values[0]:
        return None
    normal: Array = axes[2]
    leading = next(k for k in (2, 1, 0) if abs(normal[k]) > 1e-6)
    upward: Array = normal * np.sign(normal[leading])
    return upward


def _in_plane(normal: Array) -> Array:
    """Two directions of a plane that make a right-handed triad with its normal, (3, 2)."""
    first = np.cross(normal, np.eye(3)[int(np.abs(normal).argmin())])
    first = first / np.linalg.norm(first)
    return np.column_stack([first, np.cross(normal, first)])


def _circle(place: Array, radius: Array) -> Circle:
    """`place` (n, 2) unit vectors in the order of the run; `radius` (n,) minus the nominal one about the centre, um."""
    angle = np.unwrap(np.arctan2(place[:, 1], place[:, 0]))
    turning = np.sign(np.gradient(angle)) if len(angle) > 1 else np.ones(len(angle))
    ways = [radius[turning < 0], radius[turning > 0]]
    both = np.concatenate(ways)
    spans = [float(np.ptp(each)) if each.size else float("nan") for each in ways]
    hysteresis = float("nan")
    if all(each.size > 1 for each in ways):
        hysteresis = _apart(angle, radius, turning)
    means = [float(each.mean()) for each in ways if each.size]
    return Circle(
        spans[0], spans[1], float(np.ptp(both)), hysteresis, float(both.max()), float(both.min()), float(np.mean(means))
    )


def _apart(angle: Array, radius: Array, turning: Array) -> float:
    """The largest difference of the two ways at one angle, where both were run."""
    grid = np.linspace(0, 2 * np.pi, STEPS, endpoint=False)
    found = []
    for sign in (-1.0, 1.0):
        rows = turning == sign
        own, order = np.mod(angle[rows], 2 * np.pi), np.argsort(np.mod(angle[rows], 2 * np.pi))
        values = np.interp(grid, own[order], radius[rows][order], period=2 * np.pi)
        gaps = np.abs(np.angle(np.exp(1j * (grid[:, None] - own[None, :])))).min(axis=1)
        found.append(np.where(gaps < 2 * np.pi / 36, values, np.nan))
    return float(np.nanmax(np.abs(found[0] - found[1])))
