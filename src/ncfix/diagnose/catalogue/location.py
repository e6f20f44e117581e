"""Where axes lie, and gains: constants that the machine file does not have. Rows 1, 7 and 20 of the catalogue."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ncfix.diagnose.catalogue.candidate import LETTERS, TURNS, Candidate, Reach, across, along, zero
from ncfix.machine import Effect
from ncfix.machine.axes import Axis, component_title
from ncfix.machine.basis import Polynomial

ONE = (np.eye(1),)


def candidates(reach: Reach) -> Iterator[Candidate]:
    """Those that the file lacks.

    Gains, and lines of which the file says nothing, go before all other effects. Where it has some of the lines, what
    it lacks says the same again for the most part: those are names like others.
    """
    known = {effect.name for effect in reach.machine.effects}
    for axis in (*reach.linear, *reach.rotary):
        for name in _lines(axis):
            if name not in known:
                title = component_title(name, axis)
                remedy = "re-measure where the axis lies"
                effect = zero([Effect(name, ())])
                family, first = f"{axis.name} location", not _located(reach, axis)
                yield Candidate(name, title, axis.name, family, effect, ONE, (), remedy, constant=first)
    for axis in reach.linear:
        own, name = along(axis), _gain(axis)
        if own is not None and not any(_is_gain(effect, name) for effect in reach.machine.effects):
            gain = zero([Effect(name, (), Polynomial(degree=(1,)), **reach.scaled(axis))])
            title = f"scale of {axis.name}: positions too long or too short in proportion"
            yield Candidate(
                f"scale {axis.name}", title, axis.name, f"{axis.name} geometry", gain, ONE, (), "", constant=True
            )


def _gain(axis: Axis) -> str:
    return f"E{LETTERS[along(axis) or 0]}{axis.name}"


def _located(reach: Reach, axis: Axis) -> bool:
    """Whether the file says where this axis lies; of linear axes, where any of them does."""
    names = {axis.name} if axis.rotary else {each.name for each in reach.linear}
    return any(effect.location and effect.joint in names for effect in reach.machine.effects)


def _is_gain(effect: Effect, name: str) -> bool:
    return effect.name == name and isinstance(effect.basis, Polynomial) and 1 in effect.basis.degree


def _lines(axis: Axis) -> tuple[str, ...]:
    """The location errors that an axis line can have."""
    tilts = tuple(f"E{TURNS[k]}0{axis.name}" for k in across(axis))
    return (*(f"E{LETTERS[k]}0{axis.name}" for k in across(axis)), *tilts) if axis.rotary else tilts
