"""What warms, and what happens in the course of time. Rows 39 to 44, 47 and 49 of the catalogue.

A name says where an effect acts: along the tool, on an axis line, in proportion to a position. Its course in time is no
part of the name: what drives it is rarely what is measured, for a sensor may be late or sit on another body. So each
effect may follow any logged temperature, at once or with a lag, and has a course of its own besides, or nothing but
that, or it closely follows the sensors that are called like its body; the bodies differ only in which sensors are
likely theirs, and in how slow they are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnosis.catalogue.candidate import (
    LETTERS,
    TURNS,
    Candidate,
    MeasuredRange,
    across,
    along,
    spline,
    stacked,
    time_course,
    weighed,
    zero,
)
from ncfix.diagnosis.catalogue.weight import by_foundation
from ncfix.machine import Axis, Effect
from ncfix.machine.axes import SPINDLE
from ncfix.machine.basis import Polynomial
from ncfix.machine.piecewise import PiecewiseConstant
from ncfix.values import frozen

LAGS = (None, 600.0, 1800.0, 5400.0)
"""s: at once, a spindle, a slide, a frame; what lies between is a mixture."""
PIECES = 24
"""Pieces of a course of time."""
FREE = 0.4
"""Variance of the course of time beside that of the temperatures."""
BADLY = 0.25
"""Variance of the temperatures beside that of the course of time, where they say little."""
FOREIGN = 0.3
"""Variance of a sensor that is likely of another body, or of the air about it."""
CLOSELY = 0.05
"""Variance of the course of time beside that of a body's own sensors."""
AIR = ("ambient", "air", "hall", "room")
HOT = ("spindle", "head", "motor", "bearing")
STAND = ("column", "bed", "frame", "base", "stand")
HOLDS = 4
"""Places along its travel at which a scale may be held."""
BETWEEN = 1 / (HOLDS - 1) / np.sqrt(3)
"""The true one is between two of them: how far from the nearer one, of half the travel, rms."""
SLIPS = 40
DEGREE = Polynomial(degree=(1,))
WARMER = 5.0
"""K: unit of temperature."""
BESIDE = 0.3
"""Size of what goes another way with a course of its own, against what leads."""
WARM_UP = "warm up before measuring and cutting"
Parts = Sequence[tuple[str, Mapping[str, Any]]]


@frozen(slots=False)
class Body:
    """What becomes warm.

    slow, quick  s: over which times its course bends where it follows its sensors, and where it does not
    words        what its own sensors are called
    """

    slow: float
    quick: float
    words: tuple[str, ...] = ()


SPINDLES, FRAMES = Body(3600.0, 1200.0, HOT), Body(7200.0, 2400.0, STAND)
OUTSIDE = Body(14400.0, 7200.0, AIR)
PLATE = Body(28800.0, 28800.0)
"""One that is held at a point nobody knows: all ways at once with courses of their own would be anything."""


@frozen(repr=False, slots=False)
class Drive:
    """What drives a thermal effect: options of effects, and the loadings of their coefficients, one for each form."""

    options: tuple[dict[str, Any], ...]
    forms: tuple[Array, ...]


def thermal_candidates(measured: MeasuredRange) -> Iterator[Candidate]:
    """All of them, if time or a temperature was logged."""
    clocked = "time_s" in measured.columns and measured.clock[1] > measured.clock[0]
    if not clocked and not measured.sensors:
        return
    inside = {name: FOREIGN if _of(name, HOT) else 1.0 for name in measured.sensors if not _of(name, AIR)}
    around = {name: FOREIGN for name in measured.sensors if name not in inside}
    driven = _drive(measured, inside | around, FRAMES, clocked)
    yield _growth(measured, inside, clocked)
    yield from _drifts(measured, driven, clocked)
    for axis in measured.linear:
        yield from _scales(measured, axis, driven)
        yield from _bends(axis, driven)
    for axis in measured.rotary:
        yield _centre(axis, driven)
    yield _artefact(measured, clocked)
    if clocked:
        yield from _slip(measured)


def _of(sensor: str, words: Sequence[str]) -> bool:
    """Whether a sensor's name says that it is one of these."""
    return any(word in sensor.removeprefix("temp_").split("_") for word in words)


def _growth(measured: MeasuredRange, inside: Mapping[str, float], clocked: bool) -> Candidate:
    along_tool = int(np.abs(np.asarray(measured.machine.tool.direction)).argmax())
    title = "spindle growth: the spindle lengthens as it warms"
    own = {name: 1.0 if _of(name, HOT) or min(inside.values()) == 1.0 else FOREIGN for name in inside}
    driven = _drive(measured, own, SPINDLES, clocked)
    parts: list[Parts] = [[(f"E{LETTERS[along_tool]}{SPINDLE}", {})]]
    return _driven("spindle growth", title, "", parts, driven, "spindle")


def _drifts(measured: MeasuredRange, driven: Drive, clocked: bool) -> Iterator[Candidate]:
    """The frame moves along a base axis: with the machine's own heat, or with the hall's day."""
    held = by_foundation(measured)
    air = [name for name in measured.sensors if _of(name, AIR)]
    outside = _drive(measured, dict.fromkeys(air, 1.0), OUTSIDE, clocked, _swing(measured, air))
    for letter in LETTERS:
        parts: list[Parts] = [[(f"E{letter}0{held.name}", {"carried": True})]]
        title = f"drift of the frame along {letter} as the machine warms"
        yield _driven(f"drift {letter}", title, letter, parts, driven)
        if air:
            title = f"ambient swing along {letter}: the frame follows the air"
            yield _driven(f"ambient swing {letter}", title, letter, parts, outside)


def _scales(measured: MeasuredRange, axis: Axis, driven: Drive) -> Iterator[Candidate]:
    """Positions of a linear axis stretch, from a place along its travel that nobody knows; none of a skewed axis."""
    own = along(axis)
    if own is None:
        return
    title, name = f"thermal scale of {axis.name}: positions stretch with temperature", f"E{LETTERS[own]}{axis.name}"
    places = np.linspace(*measured.spans[axis.name], HOLDS).tolist()
    fixed = [[(name, measured.factor(axis) | {"times_center": place}), (name, {})] for place in places]
    yield _driven(f"thermal scale {axis.name}", title, axis.name, fixed, driven, among=[(1.0, BETWEEN)])


def _bends(axis: Axis, driven: Drive) -> Iterator[Candidate]:
    """A linear axis tilts about each direction."""
    for turn, letter in zip(TURNS, LETTERS, strict=True):
        title, name = f"thermal bend: {axis.name} tilts about {letter} with temperature", f"E{turn}{axis.name}"
        yield _driven(f"thermal bend {name}", title, axis.name, [[(name, {})]], driven)


def _centre(axis: Axis, driven: Drive) -> Candidate:
    """The line of a rotary axis moves across itself, with what carries the axis or against it."""
    lines = [f"E{LETTERS[k]}0{axis.name}" for k in across(axis)]
    ways: list[Parts] = [[(line, how) for line in lines] for how in ({"carried": True}, {})]
    title = f"rotary centre drift of {axis.name}: its axis line moves with temperature"
    return _driven(f"rotary centre drift {axis.name}", title, axis.name, ways, driven)


def _driven(
    name: str,
    title: str,
    axis: str,
    places: Sequence[Parts],
    drive: Drive,
    family: str = "heat",
    among: Sequence[Sequence[float]] = (),
) -> Candidate:
    """Components that follow temperatures, lagged and not, and a course of time; at one of several places.

    Of several components at a place one leads, whichever: one heat moves a body one way, and hardly any other way with
    a course of its own. What walks all ways at once is no body that warms. `among` has other sizes.
    """
    effects = zero(
        [Effect(part, (), **each, **options) for place in places for part, options in place for each in drive.options]
    )
    count, loadings = sum(effect.basis.size for effect in effects), []
    for form in drive.forms:
        rows = 0
        for place in places:
            for sizes in among or _leading(len(place)):
                block = stacked(*(size * form for size in sizes))
                whole = np.zeros((count, block.shape[1]))
                whole[rows : rows + len(block)] = block
                loadings.append(whole)
            rows += len(block)
    needs = tuple(dict.fromkeys(each["input"] for each in drive.options))
    return Candidate(name, title, axis, family, effects, tuple(loadings), needs, WARM_UP)


def _leading(count: int) -> list[list[float]]:
    """The sizes of so many components of which one leads, for each of them."""
    return [[1.0 if part == leads else BESIDE for part in range(count)] for leads in range(count)]


def _swing(measured: MeasuredRange, air: Sequence[str]) -> float:
    """How much the air swings, against what warms a machine."""
    return max((measured.warmth[sensor][1] for sensor in air), default=0.0) / WARMER


def _drive(
    measured: MeasuredRange, sensors: Mapping[str, float], body: Body, clocked: bool, course: float = 1.0
) -> Drive:
    """Sensors with these variances, and courses of time of such a size besides: that of a body."""
    options: list[dict[str, Any]] = []
    lags = LAGS if "time_s" in measured.columns else LAGS[:1]
    for sensor in sensors:
        each = {"basis": DEGREE, "input": sensor, "center": round(measured.warmth[sensor][0], 1), "scale": WARMER}
        options += [each | ({"time_constant_s": lag} if lag else {}) for lag in lags]
    warm = weighed([variance for variance in sensors.values() for _ in lags])
    if not clocked:
        return Drive(tuple(options), (warm,))
    first, last = measured.clock
    half = (last - first) / 2
    options.append({"basis": spline(pieces=PIECES), "input": "time_s", "center": (first + last) / 2, "scale": half})
    slow, quick = (course * time_course(length / half, PIECES) for length in (body.slow, body.quick))
    forms = [stacked(warm, np.sqrt(FREE) * slow), stacked(np.sqrt(BADLY) * warm, quick)]
    own = [float(_of(sensor, body.words)) for sensor in sensors for _ in lags]
    if any(own):
        forms.append(stacked(weighed(own), np.sqrt(CLOSELY) * slow))
    return Drive(tuple(options), tuple(forms))


def _slip(measured: MeasuredRange) -> Iterator[Candidate]:
    """Before and after a moment differ by a vector; the moment is found out."""
    first, last = measured.clock
    held = by_foundation(measured)
    moments = first + (last - first) * (np.arange(SLIPS) + 1) / (SLIPS + 1)
    effects = [
        Effect(f"E{letter}0{held.name}", (), PiecewiseConstant(positions=(float(t),)), input="time_s", carried=True)
        for t in moments
        for letter in LETTERS
    ]
    after = np.kron(np.eye(3), [[0.0], [1.0]])
    loadings = []
    for k in range(SLIPS):
        whole = np.zeros((SLIPS * 6, 3))
        whole[6 * k : 6 * k + 6] = after
        loadings.append(whole)
    title = "slip: something slipped, was re-zeroed or hit once; before and after differ"
    yield Candidate(
        "slip", title, "", "slip", zero(effects), tuple(loadings), ("time_s",), "find out what happened then"
    )


def _artefact(measured: MeasuredRange, clocked: bool) -> Candidate:
    """The balls on the table move apart as their plate warms: no error of the machine, and none in its file."""
    drive = _drive(measured, dict.fromkeys(measured.sensors, 1.0), PLATE, clocked)
    effects = zero([Effect(f"EX{SPINDLE}", (), **each) for each in drive.options])
    title = "artefact growth: the artefact or workpiece expands with temperature"
    remedy, needs = "log the artefact's own temperature", measured.sensors
    return Candidate("artefact growth", title, "", "heat", effects, drive.forms[:1], needs, remedy, True)
