"""Effects of linear axes by position and direction: curves, screws, lost motion. Rows 2 to 12 of the catalogue."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ncfix.diagnose.catalogue import shapes
from ncfix.diagnose.catalogue.candidate import LETTERS, TURNS, Candidate, Reach, along, stacked, weighed, zero
from ncfix.machine import Effect
from ncfix.machine.axes import Axis, component_title
from ncfix.machine.basis import Backlash, Periodic
from ncfix.measure.measurement import Array

PIVOT = 10.0
"""mm: how far the point about which a slide tilts lies from the reference point stated, in each direction."""
HALF = 0.5
"""Of a play: how far its middle may lie from the zero of the axis."""
PITCHES = (4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0, 25.0, 30.0, 32.0, 40.0)
"""mm: usual screws, where the machine file does not say."""
WORN = "re-measure the axis directly; a scale or guide that changes locally is worn"
SLACK = "check nut preload, thrust bearings and coupling"
GUIDE = "check the preload of the guide"


def candidates(reach: Reach) -> Iterator[Candidate]:
    """All of them."""
    for axis in reach.linear:
        yield from _curves(reach, axis)
        yield from _screw(reach, axis)
        if f"dir_{axis.name}" in reach.columns:
            yield from _lost(reach, axis)


def _curves(reach: Reach, axis: Axis) -> Iterator[Candidate]:
    span = reach.scaled(axis)
    for component in LETTERS + TURNS:
        name = f"E{component}{axis.name}"
        parts = zero([Effect(each, (), shapes.spline(), **span) for each in (name, *swept(component, axis))])
        shift = [shapes.bent(length) for length in shapes.SMOOTH]
        tilt = [shapes.turned(length) for length in shapes.SMOOTH]
        own = shift if component in LETTERS else tilt
        loadings = tuple(stacked(a, *[PIVOT * b] * (len(parts) - 1)) for a, b in zip(own, shift, strict=True))
        yield Candidate(
            name, component_title(name, axis), axis.name, f"{axis.name} geometry", parts, loadings, (), WORN, lead=1
        )


def swept(component: str, axis: Axis) -> tuple[str, ...]:
    """The shifts that come with a tilt if its pivot is not at the reference point; none for a shift."""
    if component in LETTERS:
        return ()
    return tuple(f"E{letter}{axis.name}" for letter in LETTERS if letter != LETTERS[TURNS.index(component)])


def _screw(reach: Reach, axis: Axis) -> Iterator[Candidate]:
    own = along(axis)
    if own is None:
        return
    name, span = f"E{LETTERS[own]}{axis.name}", reach.factor(axis)
    low, high = reach.spans[axis.name]
    pitches = (axis.pitch,) if axis.pitch else tuple(p for p in PITCHES if p < (high - low) / 3)
    waves = [Effect(name, (), Periodic(order=(1, 2, 3), period=pitch)) for pitch in pitches]
    waves += [replace(wave, **span) for wave in waves]
    if not waves:
        return
    title = f"screw of {axis.name}: an error that repeats with its pitch"
    remedy = "check the alignment of the screw's bearings and coupling"
    loadings = tuple(_of_pitch(k, len(pitches)) for k in range(len(pitches)))
    yield Candidate(f"pitch {axis.name}", title, axis.name, f"{axis.name} geometry", zero(waves), loadings, (), remedy)


def _of_pitch(index: int, count: int) -> Array:
    """The columns of one pitch: its harmonics, and the same growing along the screw."""
    variances = np.zeros((2, count, 6))
    variances[0, index] = shapes.harmonics(3)
    variances[1, index] = 0.3 * np.asarray(shapes.harmonics(3))
    whole = weighed(variances.ravel())
    kept: Array = whole[:, whole.any(axis=0)]
    return kept


def _lost(reach: Reach, axis: Axis) -> Iterator[Candidate]:
    span, needs = reach.scaled(axis), (f"dir_{axis.name}",)
    play, family = Backlash(degree=(0, 1, 2)), f"{axis.name} reversal"
    own = along(axis)
    for component in LETTERS + TURNS:
        symbol = f"E{component}{axis.name}"
        tilt = component in TURNS
        if not tilt and LETTERS.index(component) == own:
            name, title, remedy = f"backlash {axis.name}", f"backlash of {axis.name}: lost motion at reversal", SLACK
        else:
            sort = "angular" if tilt else "lateral"
            name, remedy = f"{sort} play {symbol}", GUIDE
            way = f"about {LETTERS[TURNS.index(component)]}" if tilt else f"in {component}"
            title = f"{sort} play of {axis.name} {way} at reversal"
        parts = [Effect(each, (), play, **span) for each in (symbol, *swept(component, axis))]
        loading = stacked(weighed(shapes.LOST), *[PIVOT * weighed(shapes.LOST)] * (len(parts) - 1))
        if tilt:  # half of the play either way, or all of it one way: the zero may have been set on either side
            parts, loading = [*parts, Effect(symbol, ())], stacked(loading, np.array([[HALF]]))
        yield Candidate(name, title, axis.name, family, zero(parts), (loading,), needs, remedy, lead=1)
