"""Kind `length`: distance between two positions (interferometer, gauge), or from the centre of a ball-bar.

Gauge: the machine moves from position a to position b. `length` is the measured distance, `nominal` the intended one
(by default the commanded distance). With `# setup: unknown` all lengths of a set share an unknown offset, as of an
uncalibrated artefact. Ball-bar: `length` is the distance of the tip from a centre ball. The offset (u, v, w) of that
ball is unknown per set, and with `# setup: unknown` so is the length of the bar.

`ball_bar_figures` evaluates a ball-bar test: centre offset, size and form, and for circles the figures of ISO 230-4.
The centre offset is removed by least squares (Esmaeili Marzdashti 2021, Eq. 15-17); the mean of the remaining radial
deviation is the size, its range the form. If all positions lie in a plane, the test is a circle, and both directions
of contouring are evaluated and compared.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np

from ncfix.arrays import Array
from ncfix.machine import Effect, Machine
from ncfix.measure.measurement import CENTRE, Measurement
from ncfix.measure.observation import Observation, Unknowns, linear_axes
from ncfix.values import frozen

SHORT = 1e-9
"""Smallest length that has a direction, mm."""
FLAT = 1e-3
"""Largest ratio of the third to the first singular value of positions that lie in a plane."""
STEPS = 360
"""Number of angles at which both directions of contouring are compared."""
UM = 1e3


class Length(Observation):
    """Base class of gauges and ball-bars: one length per row, with an unknown offset per set."""

    def __init__(self, measurement: Measurement, machine: Machine) -> None:
        super().__init__(measurement, machine)
        self.setup = measurement.header("setup")

    @property
    def components(self) -> tuple[str, ...]:
        """See `Observation`: one length per row."""
        return ("length",)

    def _constant(self) -> Unknowns:
        names = self.set_names if self.setup == "unknown" else ()
        labels = tuple(f"length of the artefact in set {name}" for name in names)
        return Unknowns(labels, np.zeros(len(labels)), np.full(len(labels), 0.05))

    def _constant_design(self) -> Array:
        ones: Array = (self.set_index[:, None] == np.arange(len(self.set_names))).astype(np.float64)
        return ones if self.setup == "unknown" else ones[:, :0]


class Gauge(Length):
    """Observation of a gauge: rows of ax ay az bx by bz length [nominal]."""

    def __init__(self, measurement: Measurement, machine: Machine) -> None:
        super().__init__(measurement, machine)
        linear = linear_axes(measurement, machine)
        self.ends = []
        for end in "ab":
            q = self.q.copy()
            q[:, linear] = measurement.stacked(*(f"{end}{axis}" for axis in "xyz"))
            self.ends.append(q)
        way = machine.tip(self.ends[1], self.state.tool_length) - machine.tip(self.ends[0], self.state.tool_length)
        self.commanded = np.linalg.norm(way, axis=1)
        self.way = way / np.maximum(self.commanded, SHORT)[:, None]
        self.nominal = measurement.columns.get("nominal", self.commanded)

    @cached_property
    def unknowns(self) -> Unknowns:
        """The offset of the artefact's length per set, if it is unknown."""
        return self._constant()

    def predict(self, machine: Machine, unknowns: Array) -> Array:
        """See `Observation`."""
        first, last = (machine.actual_tip(q, self.state) for q in self.ends)
        distance: Array = np.linalg.norm(last - first, axis=1)
        return self.nominal + distance - self.commanded + self._constant_design() @ unknowns

    def design(self, effects: Sequence[Effect]) -> Array:
        """See `Observation`: the difference of the errors of both ends along the way (Soons, Eq. 4.5)."""
        first, last = (self.machine.design(q, self.state, effects)[:, :3] for q in self.ends)
        return np.asarray(np.einsum("ni,nik->nk", self.way, last - first))

    def unknown_design(self, unknowns: Array) -> Array:
        """See `Observation`."""
        return self._constant_design()


class BallBar(Length):
    """Observation of a ball-bar: rows of cx cy cz radius length."""

    def __init__(self, measurement: Measurement, machine: Machine) -> None:
        super().__init__(measurement, machine)
        self.centre = measurement.stacked(*CENTRE)
        arm = machine.tip(self.q, self.state.tool_length) - self.centre
        self.commanded = np.linalg.norm(arm, axis=1)
        self.way = arm / np.maximum(self.commanded, SHORT)[:, None]
        self.radius = measurement.columns["radius"]

    @cached_property
    def unknowns(self) -> Unknowns:
        """The centre offset u v w per set, and the offset of the bar's length if it is unknown."""
        if self.setup == "none":
            return Unknowns.joined([])
        return Unknowns.joined([Unknowns.vectors("centre of set ", self.set_names), self._constant()])

    def predict(self, machine: Machine, unknowns: Array) -> Array:
        """See `Observation`; `radius` plus deviations, so rounding of the commanded positions does not matter."""
        arm = machine.actual_tip(self.q, self.state) - self.centre
        constant = np.zeros(len(arm))
        if self.setup != "none":
            size = 3 * len(self.set_names)
            arm = arm - unknowns[:size].reshape(-1, 3)[self.set_index]
            constant = self._constant_design() @ unknowns[size:]
        return self.radius + np.linalg.norm(arm, axis=1) - self.commanded + constant

    def design(self, effects: Sequence[Effect]) -> Array:
        """See `Observation`."""
        tip = self.machine.design(self.q, self.state, effects)[:, :3]
        return np.asarray(np.einsum("ni,nik->nk", self.way, tip))

    def unknown_design(self, unknowns: Array) -> Array:
        """See `Observation` (Esmaeili, Eq. 15-17)."""
        if self.setup == "none":
            return np.zeros((len(self.q), 0))
        columns = np.zeros((len(self.q), 3 * len(self.set_names)))
        for k in range(3):
            columns[np.arange(len(self.q)), 3 * self.set_index + k] = -self.way[:, k]
        return np.concatenate([columns, self._constant_design()], axis=1)


# -- figures of a ball-bar test ----------------------------------------------------------------------------------------


@frozen
class CircularDeviations:
    """Figures of a circular test by ISO 230-4, um, about the least-squares centre.

    G_...    circular deviation of each direction of contouring; Gb: of both
    H        hysteresis
    F_max, F_min  largest and smallest radial deviation
    D        mean of the mean radial deviations of both directions
    The direction is seen against the plane's normal that points up (+z, else +y, else +x). NaN for a direction that was
    not run.
    """

    G_clockwise: float
    G_counter: float
    Gb: float
    H: float
    F_max: float
    F_min: float
    D: float


@frozen
class BallBarFigures:
    """Figures of one set of a ball-bar test, um.

    name       name of the set
    centre     (u, v, w) offset of the centre ball, workpiece frame
    size       mean radius minus nominal radius
    form       range of the radius about the fitted centre; form_rms: its standard deviation
    radial     range of the radius as measured
    circle     figures of ISO 230-4 if the positions lie in a plane, else None
    """

    name: str
    centre: tuple[float, float, float]
    size: float
    form: float
    form_rms: float
    radial: float
    circle: CircularDeviations | None


def ball_bar_figures(measurement: Measurement, machine: Machine) -> Iterator[BallBarFigures]:
    """The figures of each set of a ball-bar measurement; none for other measurements."""
    if measurement.kind != "length" or "radius" not in measurement.columns or "length" not in measurement.columns:
        return
    seen = BallBar(measurement, machine)
    off = measurement.columns["length"] - seen.radius
    for index, name in enumerate(seen.set_names):
        rows = np.flatnonzero(seen.set_index == index)
        yield _set_figures(name, seen.way[rows], off[rows])


def _set_figures(name: str, way: Array, off: Array) -> BallBarFigures:
    """The figures of a set. way (n, 3): unit vectors from the centre; off (n,): measured minus nominal radius, mm."""
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
    """The upward normal of the plane of unit vectors `way` (n, 3); None if they do not lie in a plane."""
    _, values, axes = np.linalg.svd(way, full_matrices=False)
    if values[2] > FLAT * values[0]:
        return None
    normal: Array = axes[2]
    leading = next(k for k in (2, 1, 0) if abs(normal[k]) > 1e-6)
    return normal * np.sign(normal[leading])


def _in_plane(normal: Array) -> Array:
    """Two unit vectors in a plane, (3, 2), that form a right-handed triad with its normal."""
    first = np.cross(normal, np.eye(3)[int(np.abs(normal).argmin())])
    first = first / np.linalg.norm(first)
    return np.column_stack([first, np.cross(normal, first)])


def _circle(place: Array, radius: Array) -> CircularDeviations:
    """The figures of a circle. place (n, 2): unit vectors in order of the path; radius (n,): radial deviation, um."""
    angle = np.unwrap(np.arctan2(place[:, 1], place[:, 0]))
    turning = np.sign(np.gradient(angle)) if len(angle) > 1 else np.ones(len(angle))
    ways = [radius[turning < 0], radius[turning > 0]]
    both = np.concatenate(ways)
    spans = [float(np.ptp(each)) if each.size else float("nan") for each in ways]
    hysteresis = float("nan")
    if all(each.size > 1 for each in ways):
        hysteresis = _apart(angle, radius, turning)
    means = [float(each.mean()) for each in ways if each.size]
    return CircularDeviations(
        spans[0], spans[1], float(np.ptp(both)), hysteresis, float(both.max()), float(both.min()), float(np.mean(means))
    )


def _apart(angle: Array, radius: Array, turning: Array) -> float:
    """Hysteresis, um: largest difference of both directions at one angle, where both were run."""
    grid = np.linspace(0, 2 * np.pi, STEPS, endpoint=False)
    found = []
    for sign in (-1.0, 1.0):
        rows = turning == sign
        own, order = np.mod(angle[rows], 2 * np.pi), np.argsort(np.mod(angle[rows], 2 * np.pi))
        values = np.interp(grid, own[order], radius[rows][order], period=2 * np.pi)
        gaps = np.abs(np.angle(np.exp(1j * (grid[:, None] - own[None, :])))).min(axis=1)
        found.append(np.where(gaps < 2 * np.pi / 36, values, np.nan))
    return float(np.nanmax(np.abs(found[0] - found[1])))
