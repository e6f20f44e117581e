"""Thermal candidates, and those that depend on time. Rows 39 to 44, 47 and 49 of the catalogue.

A name says where an effect acts: along the tool, on an axis line, in proportion to a position. It does not say how the
effect goes in time, since a sensor may be late or sit on another body. So each effect has several forms: it follows any
logged temperatures, at once or with a lag, plus a course of time of its own; or mainly that course; or closely the
sensors named like its body. Bodies differ in which sensors are likely theirs, and in how slow they are.
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
"""Time constants, s: none, of a spindle, a slide, a frame; others are represented by a mixture."""
PIECES = 24
"""Pieces of the spline of a course of time."""
FREE = 0.4
"""Variance of the course of time relative to that of the temperatures."""
BADLY = 0.25
"""Variance of the temperatures relative to that of the course of time, if they say little."""
FOREIGN = 0.3
"""Relative variance of a sensor that is probably on another body, or in the air."""
CLOSELY = 0.05
"""Variance of the course of time relative to that of a body's own sensors."""
AIR = ("ambient", "air", "hall", "room")
HOT = ("spindle", "head", "motor", "bearing")
STAND = ("column", "bed", "frame", "base", "stand")
HOLDS = 4
"""Number of assumed fixed points of a scale along its travel."""
BETWEEN = 1 / (HOLDS - 1) / np.sqrt(3)
"""Standard deviation of the true fixed point from the nearest assumed one, in units of half the travel."""
SLIPS = 40
"""Number of moments at which a slip is sought."""
DEGREE = Polynomial(degree=(1,))
WARMER = 5.0
"""Unit of temperature in effects, K."""
BESIDE = 0.3
"""Size of the components that accompany the leading one, relative to it."""
WARM_UP = "warm up before measuring and cutting"
Parts = Sequence[tuple[str, Mapping[str, Any]]]


@frozen(slots=False)
class Body:
    """A body of the machine that becomes warm.

    slow, quick  correlation times, s, of its course of time beside its temperatures, and without them
    words        words in the names of its own sensors
    """

    slow: float
    quick: float
    words: tuple[str, ...] = ()


SPINDLES, FRAMES = Body(3600.0, 1200.0, HOT), Body(7200.0, 2400.0, STAND)
OUTSIDE = Body(14400.0, 7200.0, AIR)
PLATE = Body(28800.0, 28800.0)
"""An artefact on the table, whose fixed point is unknown; slow, since faster courses in all directions fit anything."""


@frozen(repr=False, slots=False)
class Drive:
    """The inputs of a thermal effect: options of effects, and loadings of their coefficients, one for each form."""

    options: tuple[dict[str, Any], ...]
    forms: tuple[Array, ...]


def thermal_candidates(measured: MeasuredRange) -> Iterator[Candidate]:
    """Thermal candidates and slip; none unless time or a temperature was logged."""
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
    """Whether the name of a sensor contains one of these words."""
    return any(word in sensor.removeprefix("temp_").split("_") for word in words)


def _growth(measured: MeasuredRange, inside: Mapping[str, float], clocked: bool) -> Candidate:
    along_tool = int(np.abs(np.asarray(measured.machine.tool.direction)).argmax())
    title = "spindle growth: the spindle lengthens as it warms"
    own = {name: 1.0 if _of(name, HOT) or min(inside.values()) == 1.0 else FOREIGN for name in inside}
    driven = _drive(measured, own, SPINDLES, clocked)
    parts: list[Parts] = [[(f"E{LETTERS[along_tool]}{SPINDLE}", {})]]
    return _driven("spindle growth", title, "", parts, driven, "spindle")


def _drifts(measured: MeasuredRange, driven: Drive, clocked: bool) -> Iterator[Candidate]:
    """Shifts of the frame along each base axis, driven by the machine's heat or by the temperature of the air."""
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
    """Thermal expansion of the scale of a linear axis about an unknown fixed point; none for a skewed axis."""
    own = along(axis)
    if own is None:
        return
    title, name = f"thermal scale of {axis.name}: positions stretch with temperature", f"E{LETTERS[own]}{axis.name}"
    places = np.linspace(*measured.spans[axis.name], HOLDS).tolist()
    fixed = [[(name, measured.factor(axis) | {"times_center": place}), (name, {})] for place in places]
    yield _driven(f"thermal scale {axis.name}", title, axis.name, fixed, driven, among=[(1.0, BETWEEN)])


def _bends(axis: Axis, driven: Drive) -> Iterator[Candidate]:
    """Thermal tilts of a linear axis about each direction."""
    for turn, letter in zip(TURNS, LETTERS, strict=True):
        title, name = f"thermal bend: {axis.name} tilts about {letter} with temperature", f"E{turn}{axis.name}"
        yield _driven(f"thermal bend {name}", title, axis.name, [[(name, {})]], driven)


def _centre(axis: Axis, driven: Drive) -> Candidate:
    """Thermal shift of the line of a rotary axis, with what it carries or of the line alone."""
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
    """A candidate whose components follow the inputs of `drive`; one form for each place and leading component.

    At each place one component leads and the others are smaller (`BESIDE`), since heat moves a body mainly one way.
    among  relative sizes of the components, instead
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
    """Relative sizes of `count` components, one list for each leading component."""
    return [[1.0 if part == leads else BESIDE for part in range(count)] for leads in range(count)]


def _swing(measured: MeasuredRange, air: Sequence[str]) -> float:
    """Standard deviation of the air temperature, in units of `WARMER`."""
    return max((measured.warmth[sensor][1] for sensor in air), default=0.0) / WARMER


def _drive(
    measured: MeasuredRange, sensors: Mapping[str, float], body: Body, clocked: bool, course: float = 1.0
) -> Drive:
    """The inputs of a body's effects: sensors with these variances, and a course of time.

    clocked  time was logged; course: relative size of the course of time
    """
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
    """A sudden shift of the frame; one form for each moment."""
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
    title = "slip: something slipped, was set to zero again or was hit; before and after differ"
    yield Candidate(
        "slip", title, "", "slip", zero(effects), tuple(loadings), ("time_s",), "find out what happened at that time"
    )


def _artefact(measured: MeasuredRange, clocked: bool) -> Candidate:
    """Thermal expansion of the artefact on the table: no error of the machine, never added to its file."""
    drive = _drive(measured, dict.fromkeys(measured.sensors, 1.0), PLATE, clocked)
    effects = zero([Effect(f"EX{SPINDLE}", (), **each) for each in drive.options])
    title = "artefact growth: the artefact or workpiece expands with temperature"
    remedy, needs = "record the temperature of the artefact", measured.sensors
    return Candidate("artefact growth", title, "", "heat", effects, drive.forms[:1], needs, remedy, True)
