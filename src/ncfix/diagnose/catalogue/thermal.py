"""What warms, and what happens in the course of time. Rows 39 to 44, 47 and 49 of the catalogue.

What drives a thermal effect is rarely what is measured: a sensor may be late or sit on another body. So each effect may
follow any logged temperature, at once or with a lag, and a smooth course of time besides.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ncfix.diagnose.catalogue import shapes
from ncfix.diagnose.catalogue.candidate import LETTERS, TURNS, Candidate, Reach, across, along, stacked, weighed, zero
from ncfix.diagnose.catalogue.weight import by_foundation
from ncfix.machine import Effect
from ncfix.machine.effect import SPINDLE
from ncfix.machine.piecewise import Step
from ncfix.machine.smooth import Polynomial
from ncfix.measure.measurement import Array

LAGS = (None, 600.0, 1800.0, 5400.0)
"""s: at once, a spindle, a slide, a frame; what lies between is a mixture."""
COURSE = 8
"""Pieces of a smooth course of time."""
SLOW = 0.5
"""Length of its bends, of half the time."""
FREE = 0.4
"""Variance of the course of time beside that of the temperatures."""
AMBIENT = ("ambient", "air", "hall", "room")
SLIPS = 40
DEGREE = Polynomial(degree=(1,))
WARMER = 5.0
"""K: unit of temperature."""
WARM_UP = "warm up before measuring and cutting"
Parts = Sequence[tuple[str, Mapping[str, Any]]]
Drive = tuple[list[dict[str, Any]], Array]
"""What drives an effect, as options, and the loading of its coefficients."""


def candidates(reach: Reach) -> Iterator[Candidate]:
    """All of them, if time or a temperature was logged."""
    clocked = "time_s" in reach.columns and reach.clock[1] > reach.clock[0]
    if not clocked and not reach.sensors:
        return
    inside = [name for name in reach.sensors if not _of_air(name)]
    driven = _drive(reach, inside, clocked)
    yield _growth(reach, driven)
    yield from _drifts(reach, driven, clocked)
    for axis in reach.linear:
        own = along(axis)
        linear = reach.factor(axis)
        if own is not None:
            title = f"thermal scale of {axis.name}: positions stretch with temperature"
            name = f"E{LETTERS[own]}{axis.name}"
            fixed = [
                [(name, linear | {"times_center": place})]
                for place in (*reach.spans[axis.name], linear["times_center"])
            ]
            yield _of(reach, f"thermal scale {axis.name}", title, axis.name, fixed, driven)
        for turn in TURNS:
            title = f"thermal bend: {axis.name} tilts about {LETTERS[TURNS.index(turn)]} with temperature"
            name = f"E{turn}{axis.name}"
            yield _of(reach, f"thermal bend {name}", title, axis.name, [[(name, {})]], driven)
    for axis in reach.rotary:
        lines: Parts = [(f"E{LETTERS[k]}0{axis.name}", {}) for k in across(axis)]
        title = f"rotary centre drift of {axis.name}: its axis line moves with temperature"
        yield _of(reach, f"rotary centre drift {axis.name}", title, axis.name, [lines], driven)
    if reach.sensors or clocked:
        yield _artefact(reach, reach.sensors, clocked)
    if clocked:
        yield from _slip(reach)


def _of_air(sensor: str) -> bool:
    return sensor.removeprefix("temp_").startswith(AMBIENT)


def _growth(reach: Reach, driven: Drive) -> Candidate:
    along_tool = int(np.abs(np.asarray(reach.machine.tool.direction)).argmax())
    title = "spindle growth: the spindle lengthens as it warms"
    parts: list[Parts] = [[(f"E{LETTERS[along_tool]}{SPINDLE}", {})]]
    return _of(reach, "spindle growth", title, "", parts, driven, "spindle")


def _drifts(reach: Reach, driven: Drive, clocked: bool) -> Iterator[Candidate]:
    """The frame moves along a base axis: with the machine's own heat, or with the hall's day."""
    held = by_foundation(reach)
    air = [name for name in reach.sensors if _of_air(name)]
    outside = _drive(reach, air, clocked, _swing(reach, air))
    for letter in LETTERS:
        parts: list[Parts] = [[(f"E{letter}0{held.name}", {"carried": True})]]
        title = f"drift of the frame along {letter} as the machine warms"
        yield _of(reach, f"drift {letter}", title, letter, parts, driven)
        if air:
            title = f"ambient swing along {letter}: the frame follows the air"
            yield _of(reach, f"ambient swing {letter}", title, letter, parts, outside)


def _of(
    reach: Reach,
    name: str,
    title: str,
    axis: str,
    forms: Sequence[Parts],
    driven: Drive,
    family: str = "heat",
) -> Candidate:
    """Components that follow temperatures, lagged and not, and a course of time; in one of several forms."""
    drive, size = driven
    effects = [
        Effect(component, (), **each, **options) for form in forms for component, options in form for each in drive
    ]
    loadings, rows = [], 0
    for form in forms:
        block = stacked(*[size] * len(form))
        whole = np.zeros((len(forms) * len(block), block.shape[1]))
        whole[rows : rows + len(block)] = block
        loadings.append(whole)
        rows += len(block)
    needs = tuple(dict.fromkeys(each["input"] for each in drive))
    return Candidate(name, title, axis, family, zero(effects), _cut(loadings, effects), needs, WARM_UP)


def _cut(loadings: Sequence[Array], effects: Sequence[Effect]) -> tuple[Array, ...]:
    """The loadings over all coefficients there are."""
    count = sum(each.basis.size for each in zero(effects))
    return tuple(loading[:count] for loading in loadings)


def _swing(reach: Reach, air: Sequence[str]) -> float:
    """How much the air swings, against what warms a machine."""
    return max((reach.warmth[sensor][1] for sensor in air), default=0.0) / WARMER


def _drive(reach: Reach, sensors: Sequence[str], clocked: bool, course: float = 1.0) -> Drive:
    """What drives a thermal effect, as options of effects, and its loading; a course of time of such a size besides."""
    drive: list[dict[str, Any]] = []
    lags = LAGS if "time_s" in reach.columns else LAGS[:1]
    for sensor in sensors:
        each = {"basis": DEGREE, "input": sensor, "center": round(reach.warmth[sensor][0], 1), "scale": WARMER}
        drive += [each | ({"time_constant_s": lag} if lag else {}) for lag in lags]
    size = [weighed((1.0,) * len(drive))]
    if clocked:
        first, last = reach.clock
        middle = {"center": (first + last) / 2, "scale": (last - first) / 2, "input": "time_s"}
        drive.append({"basis": shapes.spline(pieces=COURSE), **middle})
        size.append(course * np.sqrt(FREE) * shapes.smooth(SLOW, pieces=COURSE))
    return drive, stacked(*size)


def _slip(reach: Reach) -> Iterator[Candidate]:
    """Before and after a moment differ by a vector; the moment is found out."""
    first, last = reach.clock
    held = by_foundation(reach)
    moments = first + (last - first) * (np.arange(SLIPS) + 1) / (SLIPS + 1)
    effects = [
        Effect(f"E{letter}0{held.name}", (), Step(positions=(float(t),)), input="time_s", carried=True)
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


def _artefact(reach: Reach, sensors: Sequence[str], clocked: bool) -> Candidate:
    """The balls on the table move apart as their plate warms: no error of the machine, and none in its file."""
    drive, size = _drive(reach, sensors, clocked)
    effects = zero([Effect(f"EX{SPINDLE}", (), **each) for each in drive])
    title = "artefact growth: the artefact or workpiece expands with temperature"
    return Candidate(
        "artefact growth", title, "", "heat", effects, (size,), (*sensors,), "log the artefact's own temperature", True
    )
