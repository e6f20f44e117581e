"""The machine as it really is: its chain, its known errors, what is hidden, what is small and everywhere, and its
control.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from .chain import Machine
from .mistakes import Control
from .model import Model
from .motion import Array
from .physics import Entry, Field
from .situation import Situation
from .visibility import View, first_order

FAINT = 0.2
"""A constant that moves the tip by less than this share of what others do is no further off for that (a knot of a table
where hardly a pose is).
"""


@dataclass(frozen=True, slots=True)
class Specimen:
    """A drawn effect in its size; `moved_mm` is what it moves the tip by, rms."""

    entry: Entry
    field: Field
    size: float
    moved_mm: float

    def twists(self, s: Situation) -> Array:
        """Small motions of all frames (n, n_frames, 6)."""
        return self.size * self.field(s)


@dataclass(frozen=True, slots=True)
class World:
    """Everything that decides where the tip really goes."""

    machine: Machine
    model: Model
    hidden: tuple[Specimen, ...] = ()
    clutter: tuple[Specimen, ...] = ()
    control: Control | None = None

    def tips(self, s: Situation, q: Array | None = None) -> tuple[Array, Array]:
        """Tip (n, 3) and rotation of the tool (n, 3, 3) in the workpiece frame, exact; with other positions than s.q
        if given.
        """
        q = s.q if q is None else q
        if self.control is not None:
            q = q + self.control(q, s.length)
        there = replace(s, machine=self.machine, q=q)
        errors = self.model.errors(self.machine, q)
        for specimen in (*self.hidden, *self.clutter):
            errors = errors.plus(specimen.twists(there))
        return self.machine.tips(q, s.length, errors)

    def displacement(self, s: Situation) -> Array:
        """Actual minus nominal tip, workpiece frame (n, 3), mm."""
        return self.tips(s)[0] - self.machine.nominal_tip(s.q, s.length)

    def of_hidden(self, s: Situation) -> Array:
        """What the hidden effects alone do, (n, 3): the difference they make on this machine."""
        return self.displacement(s) - replace(self, hidden=()).displacement(s)


def rms(displacement: Array) -> float:
    """Root mean square length of vectors (n, 3)."""
    return float(np.sqrt(np.mean(np.sum(displacement**2, axis=1))))


def sized(world: World, entry: Entry, field: Field, s: Situation, sensitivity: Array, wanted: float) -> Specimen:
    """The specimen in the size that moves the tip by `wanted` mm rms in the situation; exact to second order."""
    size = wanted / rms(first_order(sensitivity, field(s)))
    specimen = Specimen(entry, field, size, wanted)
    exact = rms(replace(world, hidden=(specimen,)).of_hidden(s))
    return replace(specimen, size=size * wanted / exact)


def draw_clutter(
    rng: Generator,
    world: World,
    entries: tuple[Entry, ...],
    s: Situation,
    sensitivity: Array,
    sight: View,
    total: float,
) -> World:
    """All the entries at once and every known constant a little off, `total` mm rms together, sizes of one order of
    magnitude.
    """
    fields = [entry.specimen(rng) for entry in entries]
    weight = np.exp(rng.normal(scale=rng.uniform(0.3, 0.9), size=len(fields)))
    unit = [w / rms(first_order(sensitivity, f(s))) for w, f in zip(weight, fields, strict=True)]
    shifts = sum(first_order(sensitivity, u * f(s)) for u, f in zip(unit, fields, strict=True))
    reach = np.array([rms(c) for c in np.moveaxis(sight.base, 2, 0)])
    off = rng.normal(size=len(reach)) / np.maximum(reach, FAINT * np.median(reach))
    scale = total / rms(shifts + sight.base @ off)
    parts = zip(entries, fields, unit, weight, strict=True)
    clutter = tuple(Specimen(e, f, scale * u, scale * w) for e, f, u, w in parts)
    return replace(world, model=_nudged(world.model, scale * off), clutter=clutter)


def _nudged(model: Model, changes: Array) -> Model:
    """Every coefficient changed, in order."""
    rest = iter(changes)
    terms = (replace(t, coefficients=tuple(c + float(next(rest)) for c in t.coefficients)) for t in model.terms)
    return Model(tuple(terms))
