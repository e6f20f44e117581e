"""Which effects a calibration estimates: those of the machine, by name or pattern, new ones, or a named model.

New effects get a basis that leaves out what another effect has: straightness no linear part (that is squareness),
radial and tilt motions of a rotary axis no part once per revolution (that is where its axis line lies).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

import numpy as np

from ncfix.diagnostics import UsageError
from ncfix.machine import Effect, Machine
from ncfix.machine.axes import COMPONENTS, NAME, SPINDLE, Axis
from ncfix.machine.basis import Basis, ConstantBasis, Fourier, Polynomial
from ncfix.machine.effects import library
from ncfix.machine.fields import did_you_mean
from ncfix.machine.piecewise import Truncated

ALL = "all"


@dataclass(frozen=True, slots=True)
class Selection:
    """The effects of a machine and which of them are to be estimated.

    effects  all of them, those of the machine first
    free     for each whether it is estimated
    """

    effects: tuple[Effect, ...]
    free: tuple[bool, ...]

    @property
    def estimated(self) -> tuple[Effect, ...]:
        """The effects that are estimated."""
        return tuple(effect for effect, free in zip(self.effects, self.free, strict=True) if free)

    @property
    def labels(self) -> tuple[str, ...]:
        """A name for each estimated coefficient: EC0Y, EXX u^2, ECC cos 1."""
        return tuple(label for effect in self.estimated for label in labels_of(effect, self.estimated))

    @property
    def start(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """Their present values."""
        return np.array([value for effect in self.estimated for value in effect.coefficients])

    def machine(self, machine: Machine, coefficients: Sequence[float]) -> Machine:
        """The machine with these values of the estimated coefficients."""
        values = list(coefficients)
        effects = []
        for effect, free in zip(self.effects, self.free, strict=True):
            own = tuple(float(value) for value in values[: effect.basis.size]) if free else effect.coefficients
            del values[: effect.basis.size if free else 0]
            effects.append(replace(effect, coefficients=own))
        return machine.replace(effects=tuple(effects))


def labels_of(effect: Effect, among: Sequence[Effect]) -> list[str]:
    """A name for each coefficient, told apart from those of other effects of that name."""
    same = [other for other in among if other.name == effect.name]
    head = effect.name
    if len(same) > 1:
        own = [other for other in same if other.basis.name == effect.basis.name]
        head += f" {effect.basis.name}" + (f" {own.index(effect) + 1}" if len(own) > 1 else "")
        head += f" of {effect.input}" if effect.input else ""
    if isinstance(effect.basis, ConstantBasis):
        return [head]
    return [f"{head} {label}" for label in effect.basis.labels]


def select(
    machine: Machine, wanted: str | None = None, reference: Sequence[float] | None = None, knots: int = 0
) -> Selection:
    """The effects that are meant by a list such as `EC0Y,E?X,EZZ`, by `all`, or by the name of a model;
    names of physical effects (`ncfix.machine.effects`) may stand in the list.

    Nothing given means those of the machine; a machine without effects gets all of them. `reference` is the point to
    which new effects refer; with `knots` the new error motions of linear axes are piecewise, with so many knots.
    Raises `UsageError` NCF635.
    """
    from ncfix.measure.models import MODELS

    point = None if reference is None else (float(reference[0]), float(reference[1]), float(reference[2]))
    if wanted in MODELS:
        return _with_new((), (), MODELS[wanted].effects(machine))
    if wanted is None and machine.effects:
        return Selection(machine.effects, (True,) * len(machine.effects))
    meant = _Meant.of(machine, wanted or ALL)
    present, there = {effect.name for effect in machine.effects}, {form(effect) for effect in machine.effects}
    new = [effect for effect in meant.physical if form(effect) not in there]
    new += [effect for name in meant.patterns for effect in _new(machine, name, present, point, knots)]
    return _with_new(machine.effects, [meant.has(effect) for effect in machine.effects], new)


@dataclass(frozen=True, slots=True)
class _Meant:
    """What a list of names means: names and patterns of errors, and the effects of names of the library."""

    patterns: tuple[str, ...]
    physical: tuple[Effect, ...]

    @staticmethod
    def of(machine: Machine, text: str) -> _Meant:
        """A list such as `EC0Y,E?X,wind-up-X`."""
        names = [name.strip() for name in text.split(",") if name.strip()]
        known = library(machine)
        physical = tuple(effect for name in names if name in known for effect in known[name].effects)
        return _Meant(tuple(name for name in names if name not in known), physical)

    def has(self, effect: Effect) -> bool:
        """Whether an effect that is there is meant."""
        named = any(_matches(effect.name, pattern) for pattern in self.patterns)
        return named or any(form(effect) == form(each) for each in self.physical)


def _with_new(there: Sequence[Effect], free: Sequence[bool], new: Sequence[Effect]) -> Selection:
    """Effects that are there, estimated or held, and new ones, each of them once."""
    added = tuple(dict.fromkeys(new))
    return Selection((*there, *added), (*free, *(True for _ in added)))


def _matches(name: str, pattern: str) -> bool:
    return pattern == ALL or fnmatchcase(name, pattern)


def form(effect: Effect) -> Effect:
    """An effect without its numbers."""
    return replace(effect, coefficients=(), covariance=None)


def _new(
    machine: Machine, name: str, present: set[str], point: tuple[float, float, float] | None, knots: int
) -> list[Effect]:
    """Effects of this name or pattern that the machine does not have yet."""
    possible = [each for each in candidates(machine, knots) if _matches(each.name, name)]
    fresh = [each for each in possible if each.name not in present]
    if fresh or any(_matches(each, name) for each in present):
        return fresh if point is None else [each if each.location else replace(each, reference=point) for each in fresh]
    match = NAME.fullmatch(name)
    if match and match[3] in (*machine.axis_names, SPINDLE):
        return [default(machine, name, knots)]
    from ncfix.measure.models import MODELS

    known = [*MODELS, *library(machine), *present, *(each.name for each in candidates(machine))]
    hint = did_you_mean(name, known) or "`ncfix effects` lists the names"
    raise UsageError.of("NCF635", f"there is no effect {name!r} of this machine", hint=hint)


def candidates(machine: Machine, knots: int = 0) -> list[Effect]:
    """Every location error and error motion that can matter for this machine, zero, with its default basis."""
    found = []
    for axis in machine.axes:
        names = [f"E{component}0{axis.name}" for component in _located(axis)]
        names += [f"E{component}{axis.name}" for component in COMPONENTS]
        found += [default(machine, name, knots) for name in names]
    return found + [default(machine, f"E{component}0{SPINDLE}") for component in "XYAB"]


def _located(axis: Axis) -> list[str]:
    """Location errors that are not without effect, the zero offset apart."""
    along = [k for k in range(3) if abs(np.asarray(axis.error_axes[k]) @ np.asarray(axis.direction)) > 1 - 1e-9]
    across = [COMPONENTS[k] for k in range(3) if k not in along]
    turns = [COMPONENTS[3 + k] for k in range(3) if k not in along]
    return across + turns if axis.rotary else turns


def default(machine: Machine, name: str, knots: int = 0) -> Effect:
    """A zero effect of this name with the basis that suits its axis."""
    axis = next((axis for axis in machine.axes if axis.name == name[-1]), None)
    if axis is None or len(name) == 4:
        return Effect(name, (0.0,))
    low, high = (limit / axis.unit for limit in axis.range)
    bounded = bool(np.isfinite([low, high]).all())
    full = axis.rotary and (not bounded or high - low >= 330)
    basis = _turning(axis, name) if full else _straight(axis, name)
    if knots and bounded and not axis.rotary:
        basis = _piecewise(axis, name, knots)
    center, scale = ((low + high) / 2, (high - low) / 2) if bounded and not full else (0.0, 1.0)
    return Effect(name, (0.0,) * basis.size, basis, center=center, scale=scale)


def _turning(axis: Axis, name: str) -> Basis:
    """Harmonics; the first one of radial and tilt motions belongs to the location of the axis line."""
    along = _along(axis, name)
    return Fourier(order=(1, 2) if along else (2, 3))


def _straight(axis: Axis, name: str) -> Basis:
    """Powers; the first of a linear axis's straightness is its squareness."""
    shift = name[1] in "XYZ"
    first = 2 if not axis.rotary and shift and not _along(axis, name) else 1
    return Polynomial(degree=tuple(range(first, 4)))


def _piecewise(axis: Axis, name: str, knots: int) -> Basis:
    """Parabolas that join smoothly at evenly spaced knots; of straightness without mean and slope (Soons, 2.1, 2.2)."""
    inside = tuple(float(place) for place in np.linspace(-1, 1, knots + 2)[1:-1])
    straight = name[1] in "XYZ" and not _along(axis, name)
    return Truncated(inside, 2, (2,), (-1.0, 1.0)) if straight else Truncated(inside, 2, (1, 2))


def _along(axis: Axis, name: str) -> bool:
    """Whether a component acts along or about the axis itself."""
    triad = np.asarray(axis.error_axes[COMPONENTS.index(name[1]) % 3])
    return bool(abs(triad @ np.asarray(axis.direction)) > 1 - 1e-9)
