"""Effects of rotary axes by angle and direction. Rows 21 to 27 and 37 of the catalogue."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ncfix.diagnose.catalogue import shapes
from ncfix.diagnose.catalogue.candidate import LETTERS, TURNS, Candidate, Reach, across, along, stacked, weighed, zero
from ncfix.machine import Effect
from ncfix.machine.axes import Axis
from ncfix.machine.basis import Backlash, Fourier
from ncfix.measure.measurement import Array

ORDERS = (1, 2, 3, 4, 5, 6, 7, 8)
SCALE_ORDERS = ORDERS[:4]
"""Those of an encoder: more waves a turn are a worm's, which swells along the turn, too."""
TEETH = tuple(range(5, 181))
"""Errors per turn that a worm, gear or encoder may have."""


def candidates(reach: Reach) -> Iterator[Candidate]:
    """All of them."""
    for axis in reach.rotary:
        own = along(axis)
        if own is None:
            continue
        yield from _motions(axis, own)
        yield _worm(axis, own)
        if f"dir_{axis.name}" in reach.columns:
            yield _backlash(reach, axis, own)
        yield from _seat(reach, axis)


def _motions(axis: Axis, own: int) -> Iterator[Candidate]:
    """Radial, axial, wobble, encoder: one name each, whatever the order."""
    q, first, second = axis.name, *across(axis)
    bearing = "check the bearing and how its rings are seated"
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
        loading = stacked(*[weighed(shapes.harmonics(len(orders)))] * len(letters))
        yield Candidate(name, title, q, f"{q} turning", effects, (loading,), (), remedy)


def _worm(axis: Axis, own: int) -> Candidate:
    """Many waves a turn: how many is found out."""
    effect = zero([Effect(f"E{TURNS[own]}{axis.name}", (), Fourier(order=TEETH))])
    columns = np.eye(2 * len(TEETH))
    loadings: tuple[Array, ...] = tuple(columns[:, 2 * k : 2 * k + 2] for k in range(len(TEETH)))
    title = f"worm or gear of {axis.name}: several waves a turn"
    return Candidate(
        f"worm {axis.name}", title, axis.name, f"{axis.name} turning", effect, loadings, (), "check the worm"
    )


def _backlash(reach: Reach, axis: Axis, own: int) -> Candidate:
    effect = zero([Effect(f"E{TURNS[own]}{axis.name}", (), Backlash(degree=(0, 1, 2)), **reach.scaled(axis))])
    title = f"backlash of {axis.name}: lost motion at reversal"
    return Candidate(
        f"backlash {axis.name}", title, axis.name, f"{axis.name} reversal", effect, (weighed(shapes.LOST),),
        (f"dir_{axis.name}",), "adjust the worm or the drive's preload",
    )  # fmt: skip


def _seat(reach: Reach, axis: Axis) -> Iterator[Candidate]:
    """The seat of a rotary axis yields with the place of a linear axis: of which one, and which way, is found out."""
    if not reach.linear:
        return
    wave = Fourier(order=(1,))
    places = [(other, letter) for other in reach.linear for letter in LETTERS]
    effects = zero([Effect(f"E{letter}{axis.name}", (), wave, **reach.factor(other)) for other, letter in places])
    columns = np.eye(2 * len(effects))
    each = 2 * len(LETTERS)
    every = [slice(each * k, each * (k + 1)) for k in range(len(reach.linear))]
    single = [slice(2 * k, 2 * k + 2) for k in range(len(places))]
    loadings = tuple(columns[:, part] for part in (*every, *single))
    title = f"rotary seat of {axis.name}: an error of its turn that grows with a linear position"
    name = f"rotary seat {axis.name}"
    yield Candidate(name, title, axis.name, f"{axis.name} turning", effects, loadings, (), "check the seat")
