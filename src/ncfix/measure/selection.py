"""The effects that a calibration estimates: those of the machine, by name or pattern, new ones, or a named model.

New effects get a basis without the part that belongs to another effect: straightness has no linear part (that is
squareness), radial and tilt motions of a rotary axis no first harmonic (that is the location of its axis line).

Named models are those of S. Esmaeili Marzdashti, PhD thesis, Polytechnique Montreal, 2021. Location errors are
inter-axis errors, carried by what follows (`carried`). Error motions are ordinary cubics in mm and rad, Eq. 19; `b` is
a backlash. The models of 10 and 12 have no length standard: EYY and EZZ are gains relative to X. Names are in the base
frame: the EZ0S of chapter 7 is in a tool frame whose z is the base's y, so it is EY0S here.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

import numpy as np

from ncfix.diagnostics import UsageError
from ncfix.machine import Effect, Machine
from ncfix.machine.axes import COMPONENTS, NAME, SPINDLE, Axis, is_arm
from ncfix.machine.basis import Backlash, Basis, ConstantBasis, Fourier, Polynomial
from ncfix.machine.effects import library
from ncfix.machine.piecewise import Truncated
from ncfix.toml_text import did_you_mean
from ncfix.values import frozen

ALL, LOCATIONS = "all", "E?0?"
"""The word for all effects, and the pattern of all location errors."""
TERM = re.compile(r"([XYZABC][A-Z])(\d|b)(?:-(\d))?")
RADIAN = 180 / np.pi
"""The file's unit of a rotary axis is the degree: this scale makes u radians."""


@frozen
class Selection:
    """The effects of a machine and which of them are to be estimated.

    effects  all effects, those of the machine first, then new ones
    free     for each effect, whether it is estimated
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
        """Present values of the estimated coefficients, (p,)."""
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
    """A name for each coefficient, unique even if other effects in `among` have the same name."""
    same = [other for other in among if other.name == effect.name]
    head = effect.name
    if len(same) > 1:
        own = [other for other in same if _told_apart_by(other) == _told_apart_by(effect)]
        head += f" {effect.basis.name}" + (f" {own.index(effect) + 1}" if len(own) > 1 else "")
        head += f" of {effect.input}" if effect.input else ""
        head += f" x {effect.times}" if effect.times else ""
    if isinstance(effect.basis, ConstantBasis):
        return [head]
    return [f"{head} {label}" for label in effect.basis.labels]


def _told_apart_by(effect: Effect) -> tuple[str, str | None, str | None]:
    return effect.basis.name, effect.input, effect.times


def select(
    machine: Machine, wanted: str | None = None, reference: Sequence[float] | None = None, knots: int = 0
) -> Selection:
    """The effects selected by a list such as `EC0Y,E?X,EZZ`, by `all`, or by the name of a model.

    wanted     the list; it may contain names of physical effects (`ncfix.machine.effects`). None: those of the machine;
               if it has none, all effects, but for an arm its location errors only, as its data hardly determine more
    reference  point to which new effects refer, mm
    knots      number of knots of new error motions of linear axes; 0: cubics

    Raises `UsageError` NCF635.
    """
    point = None if reference is None else (float(reference[0]), float(reference[1]), float(reference[2]))
    if wanted in MODELS:
        return _with_new((), (), MODELS[wanted].effects(machine))
    if wanted is None and machine.effects:
        return Selection(machine.effects, (True,) * len(machine.effects))
    meant = _Wanted.of(machine, wanted or (LOCATIONS if is_arm(machine.axes) else ALL))
    present, there = {effect.name for effect in machine.effects}, {form(effect) for effect in machine.effects}
    new = [effect for effect in meant.physical if form(effect) not in there]
    new += [effect for name in meant.patterns for effect in _new(machine, name, present, point, knots)]
    return _with_new(machine.effects, [meant.has(effect) for effect in machine.effects], new)


@frozen
class _Wanted:
    """A parsed list of names: names and patterns of errors, and effects of the library of physical effects."""

    patterns: tuple[str, ...]
    physical: tuple[Effect, ...]

    @staticmethod
    def of(machine: Machine, text: str) -> _Wanted:
        """Parse a list such as `EC0Y,E?X,wind-up-X`."""
        names = [name.strip() for name in text.split(",") if name.strip()]
        known = library(machine)
        physical = tuple(effect for name in names if name in known for effect in known[name].effects)
        return _Wanted(tuple(name for name in names if name not in known), physical)

    def has(self, effect: Effect) -> bool:
        """Whether the list selects an existing effect."""
        named = any(_matches(effect.name, pattern) for pattern in self.patterns)
        return named or any(form(effect) == form(each) for each in self.physical)


def _with_new(there: Sequence[Effect], free: Sequence[bool], new: Sequence[Effect]) -> Selection:
    """The selection of existing effects, estimated or held, and new ones without duplicates, all estimated."""
    added = tuple(dict.fromkeys(new))
    return Selection((*there, *added), (*free, *(True for _ in added)))


def _matches(name: str, pattern: str) -> bool:
    return pattern == ALL or fnmatchcase(name, pattern)


def form(effect: Effect) -> Effect:
    """An effect without coefficients and covariance, for comparison."""
    return replace(effect, coefficients=(), covariance=None)


def _new(
    machine: Machine, name: str, present: set[str], point: tuple[float, float, float] | None, knots: int
) -> list[Effect]:
    """New effects that match a name or pattern and that the machine does not have. Raises `UsageError` NCF635."""
    possible = [each for each in candidate_effects(machine, knots) if _matches(each.name, name)]
    fresh = [each for each in possible if each.name not in present]
    if fresh or any(_matches(each, name) for each in present):
        return fresh if point is None else [each if each.location else replace(each, reference=point) for each in fresh]
    match = NAME.fullmatch(name)
    if match and match[3] in (*machine.axis_names, SPINDLE):
        return [default(machine, name, knots)]
    known = [*MODELS, *library(machine), *present, *(each.name for each in candidate_effects(machine))]
    hint = did_you_mean(name, known) or "`ncfix effects` lists the names"
    raise UsageError.of("NCF635", f"there is no effect {name!r} of this machine", hint=hint)


def candidate_effects(machine: Machine, knots: int = 0) -> list[Effect]:
    """All location errors and error motions that can matter for this machine, zero, with default bases."""
    found = []
    for axis in machine.axes:
        names = [f"E{component}0{axis.name}" for component in _located(machine, axis)]
        names += [f"E{component}{axis.name}" for component in COMPONENTS]
        found += [default(machine, name, knots) for name in names]
    along = int(np.abs(np.asarray(machine.tool.direction)).argmax())  # an error along it is the tool length, or nothing
    return found + [default(machine, f"E{c}0{SPINDLE}") for k, c in enumerate(COMPONENTS) if k % 3 != along]


def _located(machine: Machine, axis: Axis) -> list[str]:
    """Components of the location errors that have an effect; the zero offset only for joints of an arm."""
    along = [k for k in range(3) if abs(np.asarray(axis.error_axes[k]) @ np.asarray(axis.direction)) > 1 - 1e-9]
    across = [COMPONENTS[k] for k in range(3) if k not in along]
    turns = [COMPONENTS[3 + k] for k in range(3) if k not in along or (axis.rotary and is_arm(machine.axes))]
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
    """Harmonics; without the first one for radial and tilt motions, which is the location of the axis line."""
    along = _along(axis, name)
    return Fourier(order=(1, 2) if along else (2, 3))


def _straight(axis: Axis, name: str) -> Basis:
    """Powers up to 3; without the first one for straightness of a linear axis, which is its squareness."""
    shift = name[1] in "XYZ"
    first = 2 if not axis.rotary and shift and not _along(axis, name) else 1
    return Polynomial(degree=tuple(range(first, 4)))


def _piecewise(axis: Axis, name: str, knots: int) -> Basis:
    """Parabolas joined smoothly at equidistant knots; for straightness without mean and slope (Soons, 2.1, 2.2)."""
    inside = tuple(float(place) for place in np.linspace(-1, 1, knots + 2)[1:-1])
    straight = name[1] in "XYZ" and not _along(axis, name)
    return Truncated(inside, 2, (2,), (-1.0, 1.0)) if straight else Truncated(inside, 2, (1, 2))


def _along(axis: Axis, name: str) -> bool:
    """Whether a component acts along or about the axis itself."""
    triad = np.asarray(axis.error_axes[COMPONENTS.index(name[1]) % 3])
    return bool(abs(triad @ np.asarray(axis.direction)) > 1 - 1e-9)


# -- named models ------------------------------------------------------------------------------------------------------


@frozen
class Model:
    """A named model: location errors, and terms of error motions such as `YX2-3` (powers) or `BBb` (backlash)."""

    name: str
    title: str
    located: tuple[str, ...]
    motions: str = ""

    def effects(self, machine: Machine) -> list[Effect]:
        """The effects with zero coefficients; raises `UsageError` NCF635 if the machine lacks an axis."""
        found = [Effect(name, (0.0,), carried=not name.endswith(SPINDLE)) for name in self.located]
        found += [effect for text in self.motions.split() for effect in _terms(machine, text)]
        missing = {effect.joint for effect in found} - {*machine.axis_names, SPINDLE}
        if missing:
            text = f"the model {self.name} needs a machine with the axes {' '.join(sorted(missing))}"
            raise UsageError.of("NCF635", text, hint=f"this machine has {' '.join(machine.axis_names)}")
        return found


def _terms(machine: Machine, text: str) -> list[Effect]:
    match = TERM.fullmatch(text)
    assert match is not None, text
    name, first, last = f"E{match[1]}", match[2], match[3]
    if first == "b":
        return [Effect(name, (0.0,), Backlash())]
    rotary = next((axis.rotary for axis in machine.axes if axis.name == name[-1]), False)
    degree = tuple(range(int(first), int(last or first) + 1))
    return [Effect(name, (0.0,) * len(degree), Polynomial(degree=degree), scale=RADIAN if rotary else 1.0)]


TEN = ("EB0A", "EC0A", "EY0C", "EA0C", "EB0C", "EC0X", "EA0Z", "EB0Z")
THIRTEEN_BC = ("EA0B", "EC0B", "EX0C", "EA0C", "EB0C", "EB0Z", "EA0Y", "EC0Y", "EY0S", "EX0S")
GAINS = "XX1 YY1 ZZ1"
MOTIONS_84 = (
    "XX1-3 YX2-3 ZX2-3 AX0-3 BX1-3 CX0-3 XY0 XY2-3 YY0-3 ZY2-3 XZ1-3 YZ2-3 ZZ1-3 AZ0-3 CZ0-3 XB0-3 YB1-3 ZB1-3 "
    "AB0-3 BB0-3 BBb CB1-3 XC1-3 YC1-3 ZC1-3 AC1-3 BC1-3 CC1-3 CCb"
)
MOTIONS_81 = (
    "XX2-3 YX1-3 ZX2-3 AX0-3 BX0-3 XY2-3 YY1-3 ZY2-3 AY1-3 BY0-3 CY0-3 XZ2-3 YZ2-3 ZZ1-3 XA1-3 YA0-3 ZA1-3 AA0-3 AAb "
    "BA0-3 CA1-3 XC1-3 YC1-3 ZC1-3 AC1-3 BC1-3 CC1-3 CCb"
)

MODELS = {
    model.name: model
    for model in (
        Model("esmaeili-10", "locations and relative gains of an AC table, chapter 6", TEN, "YY1 ZZ1"),
        Model("esmaeili-12", "the same with the backlash of A and C, chapter 5", TEN, "YY1 ZZ1 AAb CCb"),
        Model("esmaeili-13-bc", "locations, spindle and gains of a BC table, chapter 4", THIRTEEN_BC, GAINS),
        Model("esmaeili-13-ac", "the same of an AC table, chapter 7", (*TEN, "EX0S", "EY0S"), GAINS),
        Model("esmaeili-81", "cubics of all axes of an AC table, chapter 5", (), MOTIONS_81),
        Model("esmaeili-84", "cubics of all axes of a BC table, chapter 4", (), MOTIONS_84),
    )
}
