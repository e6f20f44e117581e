"""Whatever one joint may do: rivals by its own position, its direction, another axis, time.

All its six errors at once, with the same share each, and each of them alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ncfix.diagnose.catalogue import Candidate, shapes
from ncfix.diagnose.catalogue.candidate import LETTERS, TURNS, Reach, weighed, zero
from ncfix.diagnose.fields import UNNAMED, together
from ncfix.diagnose.groups import Group
from ncfix.diagnose.view import View
from ncfix.machine import Effect
from ncfix.machine.axes import Axis
from ncfix.machine.basis import Backlash, Fourier, Polynomial
from ncfix.measure.measurement import Array

FULL = 270.0
"""degree: an axis that turned further is taken for one that turns round and round."""
BEND = 0.4
"""Length of the bends of what a joint may do, of half its travel; of what time does, `SLOW`."""
SLOW = 0.3
WAVES = (1.0, 0.7, 0.5, 0.3, 0.2, 0.2)
"""Variances of the waves a turn."""
PLAY = (1.0, 1.0, 0.5, 0.3)
Part = tuple[str, dict[str, Any], Array]
"""Component, options of the effect, and the loading of its coefficients."""


def of_joints(view: View) -> Iterator[Group | None]:
    """Of every joint, by all it may depend on: its six errors with the same share each, and each alone."""
    sorts = [(axis, *sort) for axis in _moved(view.reach) for sort in _sorts(view.reach, axis)]
    parts = [part for _, _, components in sorts for component in components for part in component]
    designs = _designs(view, [Effect(name, (), **options) for name, options, _ in parts])
    shown = iter([design @ loading for design, (_, _, loading) in zip(designs, parts, strict=True)])
    for axis, what, components in sorts:
        own = [np.concatenate([next(shown) for _ in component], axis=1) for component in components]
        yield together(view, _something(axis, f"something of {axis.name}", what), own)
        for component, part in zip(components, own, strict=True):
            effects = zero([Effect(name, (), **options) for name, options, _ in component])
            yield together(view, replace(_something(axis, component[0][0], what), effects=effects), [part])


def _designs(view: View, effects: Sequence[Effect]) -> list[Array]:
    """What each effect's coefficients show."""
    ends = np.cumsum([effect.basis.size for effect in effects])
    return np.split(view.design(zero(effects)), ends[:-1], axis=1)


def _something(axis: Axis, error: str, what: str) -> Candidate:
    title = f"{error} by {what} that has no name in the catalogue"
    return Candidate(f"unknown of {axis.name}", title, axis.name, UNNAMED, (), ())


def _moved(reach: Reach) -> tuple[Axis, ...]:
    return (*reach.linear, *reach.rotary)


def _sorts(reach: Reach, axis: Axis) -> Iterator[tuple[str, list[list[Part]]]]:
    """What each component may do: by position, direction, another axis, time."""
    names = [f"E{letter}{axis.name}" for letter in LETTERS + TURNS]
    options, loading = _curve(reach, axis)
    yield "its position", [[(name, options, _curved(axis, name, loading))] for name in names]
    if f"dir_{axis.name}" in reach.columns:
        play = {"basis": Backlash(degree=(0, 1, 2, 3)), **reach.scaled(axis)}
        yield "its direction", [[(name, play, weighed(PLAY))] for name in names]
    others = [other for other in _moved(reach) if other is not axis]
    for other in others:
        yield f"its position and {other.name}", [[(name, options | reach.factor(other), loading)] for name in names]
    for what, driven in (("time or heat", _warm(reach)), ("load", _loaded(reach))):
        if driven:
            yield what, [[(name, *each) for each in driven] for name in names]
            product = [(options | reach.factor(axis), loading) for options, loading in driven]
            yield f"its position and {what}", [[(name, *each) for each in product] for name in names]


def _curve(reach: Reach, axis: Axis) -> tuple[dict[str, Any], Array]:
    if axis.rotary and np.ptp(reach.spans[axis.name]) > FULL:
        return {"basis": Fourier(order=tuple(range(1, len(WAVES) + 1)))}, weighed(np.repeat(WAVES, 2))
    return {"basis": shapes.spline(), **reach.scaled(axis)}, shapes.smooth(BEND)


def _curved(axis: Axis, name: str, loading: Array) -> Array:
    """Without what is straight in a shift: that is where the axis lies, or its gain, and has a name of its own."""
    return loading if axis.rotary or name[1] in TURNS else shapes.bent(BEND)


def _warm(reach: Reach) -> list[tuple[dict[str, Any], Array]]:
    """Time and temperatures as options of effects."""
    found: list[tuple[dict[str, Any], Array]] = []
    if "time_s" in reach.columns:
        first, last = reach.clock
        middle = {"center": (first + last) / 2, "scale": (last - first) / 2}
        found.append(({"basis": shapes.spline(), "input": "time_s", **middle}, shapes.smooth(SLOW)))
    for name in reach.sensors:
        options = {"basis": Polynomial(degree=(1,)), "input": name, "center": reach.warmth[name][0], "scale": 5.0}
        found.append((options, np.eye(1)))
    return found


def _loaded(reach: Reach) -> list[tuple[dict[str, Any], Array]]:
    """The same of the load."""
    options = {"basis": Polynomial(degree=(1,)), "input": "load_kg", "center": 0.0, "scale": 100.0}
    return [(options, np.eye(1))] if "load_kg" in reach.columns else []
