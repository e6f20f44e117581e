"""Where axes lie, and gains: constants that the machine file does not have. Rows 1, 7 and 20 of the catalogue."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ncfix.diagnose.catalogue.candidate import LETTERS, TURNS, Candidate, Reach, across, along, zero
from ncfix.machine import Effect, catalogue
from ncfix.machine.axis import Axis
from ncfix.machine.smooth import Polynomial

ONE = (np.eye(1),)


def candidates(reach: Reach) -> Iterator[Candidate]:
    """Those that the file lacks."""
    known = {effect.name for effect in reach.machine.effects}
    for axis in (*reach.linear, *reach.rotary):
        for name in _lines(axis):
            if name not in known:
                title = catalogue.title(name, axis)
                remedy = "re-measure where the axis lies"
                effect = zero([Effect(name, ())])
                yield Candidate(name, title, axis.name, f"{axis.name} location", effect, ONE, (), remedy, constant=True)
    for axis in reach.linear:
        own = along(axis)
        name = f"E{LETTERS[own or 0]}{axis.name}"
        if own is not None and not any(_is_gain(effect, name) for effect in reach.machine.effects):
            gain = zero([Effect(name, (), Polynomial(degree=(1,)), **reach.scaled(axis))])
            title = f"scale of {axis.name}: positions too long or too short in proportion"
            yield Candidate(
                f"scale {axis.name}", title, axis.name, f"{axis.name} geometry", gain, ONE, (), "", constant=True
            )


def _is_gain(effect: Effect, name: str) -> bool:
    return effect.name == name and isinstance(effect.basis, Polynomial) and 1 in effect.basis.degree


def _lines(axis: Axis) -> tuple[str, ...]:
    """The location errors that an axis line can have."""
    tilts = tuple(f"E{TURNS[k]}0{axis.name}" for k in across(axis))
    return (*(f"E{LETTERS[k]}0{axis.name}" for k in across(axis)), *tilts) if axis.rotary else tilts
