"""Kind `length`: the distance between two positions (interferometer, gauge), or a ball-bar's about its centre.

Gauge: the machine goes from position a to position b; `length` is how far that really was, `nominal` how far it should
have been (the distance commanded, if there is no such column). With `# setup: unknown` all lengths of a set have an
unknown part in common: an artefact that is not calibrated. Ball-bar: `length` is the distance of the tip from a centre
ball; where that ball really is, (u, v, w), is unknown per set, and with `# setup: unknown` so is the bar's length.

A ball-bar test also says something by itself: where the centre is, size and form, and the figures of ISO 230-4 for
circles. The set-up (u, v, w) is taken off by least squares (Esmaeili Marzdashti 2021, Eq. 15-17); what is left of the
radius has a mean, the size, and a shape, the form. A test whose places lie in one plane is a circle: the two ways round
it are told apart, and compared.
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
"""mm: a length that has no direction."""
FLAT = 1e-3
"""Places whose third extent is this share of the first lie in a plane."""
STEPS = 360
"""Angles at which the two ways round are compared."""
UM = 1e3


class Length(Observation):
    """What gauges and ball-bars have in common: one length a row, and what is unknown of it per set."""

    def __init__(self, measurement: Measurement, machine: Machine) -> None:
        super().__init__(measurement, machine)
        self.setup = measurement.header("setup")

    @property
    def components(self) -> tuple[str, ...]:
        """One length a row."""
        return ("length",)

    def _constant(self) -> Unknowns:
        names = self.set_names if self.setup == "unknown" else ()
        labels = tuple(f"length of the artefact in set {name}" for name in names)
        return Unknowns(labels, np.zeros(len(labels)), np.full(len(labels), 0.05))

    def _constant_design(self) -> Array:
        ones: Array = (self.set_index[:, None] == np.arange(len(self.set_names))).astype(np.float64)
        return ones if self.setup == "unknown" else ones[:, :0]


class Gauge(Length):
    """Rows of ax ay az bx by bz length [nominal]."""

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
        """The artefact's length per set, if it is not known."""
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
    """Rows of cx cy cz radius length."""

    def __init__(self, measurement: Measurement, machine: Machine) -> None:
        super().__init__(measurement, machine)
        self.centre = measurement.stacked(*CENTRE)
        arm = machine.tip(self.q, self.state.tool_length) - self.centre
        self.commanded = np.linalg.norm(arm, axis=1)
        self.way = arm / np.maximum(self.commanded, SHORT)[:, None]
        self.radius = measurement.columns["radius"]

    @cached_property
    def unknowns(self) -> Unknowns:
        """The centre's offset u v w per set, and the bar's length if it is not known."""
        if self.setup == "none":
            return Unknowns.joined([])
        return Unknowns.joined([Unknowns.vectors("centre of set ", self.set_names), self._constant()])

    def predict(self, machine: Machine, unknowns: Array) -> Array:
        """See `Observation`; `radius` is what the commanded circle has, so its own rounding does not matter."""
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


@frozen
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
    circle: CircularDeviations | None


def ball_bar_figures(measurement: Measurement, machine: Machine) -> Iterator[BallBarFigures]:
    """The figures of each set of a ball-bar measurement; nothing for other measurements."""
    if measurement.kind != "length" or "radius" not in measurement.columns or "length" not in measurement.columns:
        return
    seen = BallBar(measurement, machine)
    off = measurement.columns["length"] - seen.radius
    for index, name in enumerate(seen.set_names):
        rows = np.flatnonzero(seen.set_index == index)
        yield _set_figures(name, seen.way[rows], off[rows])


def _set_figures(name: str, way: Array, off: Array) -> BallBarFigures:
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
    return normal * np.sign(normal[leading])


def _in_plane(normal: Array) -> Array:
    """Two directions of a plane that make a right-handed triad with its normal, (3, 2)."""
    first = np.cross(normal, np.eye(3)[int(np.abs(normal).argmin())])
    first = first / np.linalg.norm(first)
    return np.column_stack([first, np.cross(normal, first)])


def _circle(place: Array, radius: Array) -> CircularDeviations:
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
    return CircularDeviations(
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
