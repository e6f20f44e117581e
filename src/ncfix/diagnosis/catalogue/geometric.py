"""Geometric candidates: error motions and lost motion of linear and rotary axes, location errors and gains.

Rows of the catalogue: 2 to 12 linear axes (curves, screws, lost motion); 21 to 27 and 37 rotary axes; 1, 7 and 20
location errors and gains that the machine file lacks.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnosis.catalogue.candidate import (
    LETTERS,
    LOST,
    SMOOTH,
    TURNS,
    Candidate,
    MeasuredRange,
    across,
    along,
    bent_loading,
    harmonic_variances,
    leaning_loading,
    spline,
    stacked,
    turned_loading,
    weighed,
    zero,
)
from ncfix.machine import Effect
from ncfix.machine.axes import Axis, component_title, is_arm
from ncfix.machine.basis import Backlash, Fourier, Periodic, Polynomial

PIVOT = 10.0
"""Standard deviation of a slide's tilting point from the reference point, mm per direction."""
HALF = 0.5
"""Standard deviation of the middle of a play from the axis zero, as a share of the play."""
PITCHES = (4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0, 25.0, 30.0, 32.0, 40.0)
"""Pitches of usual screws, mm, if the machine file states none."""
WORN = "re-measure the axis directly; a scale or guide that changes locally is worn"
SLACK = "check nut preload, thrust bearings and coupling"
GUIDE = "check the preload of the guide"
ORDERS = (1, 2, 3, 4, 5, 6, 7, 8)
SCALE_ORDERS = ORDERS[:4]
"""Orders of an encoder error; higher orders are those of a worm."""
TEETH = tuple(range(5, 181))
"""Orders, cycles per turn, of the error of a worm, gear or encoder."""
ONE = (np.eye(1),)


def linear_candidates(measured: MeasuredRange) -> Iterator[Candidate]:
    """Candidates of linear axes: error motions, periodic errors of the screw, lost motion."""
    for axis in measured.linear:
        yield from _curves(measured, axis)
        yield from _screw(measured, axis)
        if f"dir_{axis.name}" in measured.columns:
            yield from _lost(measured, axis)


def _curves(measured: MeasuredRange, axis: Axis) -> Iterator[Candidate]:
    span = measured.scaled(axis)
    for component in LETTERS + TURNS:
        name = f"E{component}{axis.name}"
        parts = zero([Effect(each, (), spline(), **span) for each in (name, *swept(component, axis))])
        shift = [bent_loading(length) for length in SMOOTH]
        tilt = [turned_loading(length) for length in SMOOTH]
        leaning = [leaning_loading(length) for length in SMOOTH] if _slope_lacks(measured, axis, component) else shift
        own = leaning if component in LETTERS else tilt
        loadings = tuple(stacked(a, *[PIVOT * b] * (len(parts) - 1)) for a, b in zip(own, shift, strict=True))
        yield Candidate(
            name, component_title(name, axis), axis.name, f"{axis.name} geometry", parts, loadings, (), WORN, lead=1
        )


def swept(component: str, axis: Axis) -> tuple[str, ...]:
    """Names of the shifts that accompany a tilt about a pivot away from the reference point; none for a shift."""
    if component in LETTERS:
        return ()
    return tuple(f"E{letter}{axis.name}" for letter in LETTERS if letter != LETTERS[TURNS.index(component)])


def _screw(measured: MeasuredRange, axis: Axis) -> Iterator[Candidate]:
    own = along(axis)
    if own is None:
        return
    name, span = f"E{LETTERS[own]}{axis.name}", measured.factor(axis)
    low, high = measured.spans[axis.name]
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
    """The loading for pitch number `index` of `count`: its harmonics, constant and growing along the screw."""
    variances = np.zeros((2, count, 6))
    variances[0, index] = harmonic_variances(3)
    variances[1, index] = 0.3 * np.asarray(harmonic_variances(3))
    whole = weighed(variances.ravel())
    return whole[:, whole.any(axis=0)]


def _lost(measured: MeasuredRange, axis: Axis) -> Iterator[Candidate]:
    span, needs = measured.scaled(axis), (f"dir_{axis.name}",)
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
        loading = stacked(weighed(LOST), *[PIVOT * weighed(LOST)] * (len(parts) - 1))
        if tilt:  # the zero may have been set on either side of the play, so a constant comes with it
            parts, loading = [*parts, Effect(symbol, ())], stacked(loading, np.array([[HALF]]))
        yield Candidate(name, title, axis.name, family, zero(parts), (loading,), needs, remedy, lead=1)


def rotary_candidates(measured: MeasuredRange) -> Iterator[Candidate]:
    """Candidates of rotary axes: error motions, worm, backlash, seat."""
    for axis in measured.rotary:
        own = along(axis)
        if own is None:
            continue
        yield from _motions(axis, own)
        yield _worm(axis, own)
        if f"dir_{axis.name}" in measured.columns:
            yield _backlash(measured, axis, own)
        yield from _seat(measured, axis)


def _motions(axis: Axis, own: int) -> Iterator[Candidate]:
    """Radial, axial, wobble and encoder errors of a rotary axis, each of all orders."""
    q, first, second = axis.name, *across(axis)
    bearing = "check the bearing and the seat of its rings"
    sorts = (
        (f"radial {q}", f"radial error motion of {q}: eccentric, oval", (LETTERS[first], LETTERS[second]), bearing),
        (f"axial {q}", f"axial error motion of {q}: face run-out", (LETTERS[own],), bearing),
        (f"wobble {q}", f"wobble of {q}: its axis tilts with the angle", (TURNS[first], TURNS[second]), bearing),
        (
            f"encoder {q}",
            f"encoder of {q} out of centre: angular positioning",
            (TURNS[own],),
            "centre the encoder ring",
        ),
    )
    for name, title, letters, remedy in sorts:
        orders = SCALE_ORDERS if name.startswith("encoder") else ORDERS
        effects = zero([Effect(f"E{letter}{q}", (), Fourier(order=orders)) for letter in letters])
        loading = stacked(*[weighed(harmonic_variances(len(orders)))] * len(letters))
        yield Candidate(name, title, q, f"{q} turning", effects, (loading,), (), remedy)


def _worm(axis: Axis, own: int) -> Candidate:
    """The error of a worm or gear, one form for each number of cycles per turn."""
    effect = zero([Effect(f"E{TURNS[own]}{axis.name}", (), Fourier(order=TEETH))])
    columns = np.eye(2 * len(TEETH))
    loadings: tuple[Array, ...] = tuple(columns[:, 2 * k : 2 * k + 2] for k in range(len(TEETH)))
    title = f"worm or gear of {axis.name}: several waves per turn"
    return Candidate(
        f"worm {axis.name}", title, axis.name, f"{axis.name} turning", effect, loadings, (), "check the worm"
    )


def _backlash(measured: MeasuredRange, axis: Axis, own: int) -> Candidate:
    effect = zero([Effect(f"E{TURNS[own]}{axis.name}", (), Backlash(degree=(0, 1, 2)), **measured.scaled(axis))])
    title = f"backlash of {axis.name}: lost motion at reversal"
    return Candidate(
        f"backlash {axis.name}", title, axis.name, f"{axis.name} reversal", effect, (weighed(LOST),),
        (f"dir_{axis.name}",), "adjust the worm or the drive's preload",
    )  # fmt: skip


def _seat(measured: MeasuredRange, axis: Axis) -> Iterator[Candidate]:
    """A once-per-turn shift of a rotary axis proportional to a linear position; forms by linear axis and direction."""
    if not measured.linear:
        return
    wave = Fourier(order=(1,))
    places = [(other, letter) for other in measured.linear for letter in LETTERS]
    effects = zero([Effect(f"E{letter}{axis.name}", (), wave, **measured.factor(other)) for other, letter in places])
    columns = np.eye(2 * len(effects))
    each = 2 * len(LETTERS)
    every = [slice(each * k, each * (k + 1)) for k in range(len(measured.linear))]
    single = [slice(2 * k, 2 * k + 2) for k in range(len(places))]
    loadings = tuple(columns[:, part] for part in (*every, *single))
    title = f"rotary seat of {axis.name}: an angular positioning error that grows with a linear position"
    name = f"rotary seat {axis.name}"
    yield Candidate(name, title, axis.name, f"{axis.name} turning", effects, loadings, (), "check the seat")


def location_candidates(measured: MeasuredRange) -> Iterator[Candidate]:
    """Location errors and gains that the machine file lacks.

    Gains, and location errors of axes for which the file has none, are constants, selected before other effects. If the
    file has some of them, the lacking ones are mostly redundant, and are candidates like others.
    """
    known = {effect.name for effect in measured.machine.effects}
    for axis in (*measured.linear, *measured.rotary):
        for name in _lines(measured, axis):
            if name not in known:
                title = component_title(name, axis)
                remedy = "measure the location of the axis again"
                effect = zero([Effect(name, ())])
                family, first = f"{axis.name} location", not _located(measured, axis)
                yield Candidate(name, title, axis.name, family, effect, ONE, (), remedy, constant=first)
    for axis in measured.linear:
        own, name = along(axis), _gain(axis)
        if own is not None and not any(_is_gain(effect, name) for effect in measured.machine.effects):
            gain = zero([Effect(name, (), Polynomial(degree=(1,)), **measured.scaled(axis))])
            title = f"scale of {axis.name}: positions too long or too short in proportion"
            yield Candidate(
                f"scale {axis.name}", title, axis.name, f"{axis.name} geometry", gain, ONE, (), "", constant=True
            )


def _slope_lacks(measured: MeasuredRange, axis: Axis, component: str) -> bool:
    """Whether the file lacks the squareness that is the slope of this straightness, though it has other ones.

    Other constants then imitate the slope, but only for a single tool length.
    """
    own = along(axis)
    if component not in LETTERS or own is None or LETTERS.index(component) == own or not _located(measured, axis):
        return False
    turn = TURNS[3 - own - LETTERS.index(component)]
    return all(effect.name != f"E{turn}0{axis.name}" for effect in measured.machine.effects)


def _gain(axis: Axis) -> str:
    return f"E{LETTERS[along(axis) or 0]}{axis.name}"


def _located(measured: MeasuredRange, axis: Axis) -> bool:
    """Whether the file has location errors of this axis; for a linear axis, of any linear axis."""
    names = {axis.name} if axis.rotary else {each.name for each in measured.linear}
    return any(effect.location and effect.joint in names for effect in measured.machine.effects)


def _is_gain(effect: Effect, name: str) -> bool:
    return effect.name == name and isinstance(effect.basis, Polynomial) and 1 in effect.basis.degree


def _lines(measured: MeasuredRange, axis: Axis) -> tuple[str, ...]:
    """Names of the location errors of an axis; for a joint of an arm with its zero offset."""
    tilts = tuple(f"E{TURNS[k]}0{axis.name}" for k in across(axis))
    own = along(axis)
    if axis.rotary and own is not None and is_arm(measured.machine.axes):
        tilts = (f"E{TURNS[own]}0{axis.name}", *tilts)
    return (*(f"E{LETTERS[k]}0{axis.name}" for k in across(axis)), *tilts) if axis.rotary else tilts
