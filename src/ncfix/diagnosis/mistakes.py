"""Mistakes of people and software: the machine is as it is, and somebody told the computer otherwise.

Each mistake is undone in turn, and it is looked how well the machine file as it stands, its constants nearly fixed,
then agrees with the data. A mistake that is real explains nearly all at once, with nothing fitted: no missing effect
does.

A table that was made before reference points were moved: the same curves, some way beside their place.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ncfix.diagnosis.catalogue import plain
from ncfix.diagnosis.residual_data import Misfit, ResidualData, misfit, residual_data
from ncfix.machine import Effect, Machine
from ncfix.machine.axes import Axis
from ncfix.measure.least_squares import orthonormal, without
from ncfix.measure.measurement import Array, Measurement

SUSPECT, SUSPECT_UM = 1.4, 1.5
"""Times the noise, and um above it, from which on a mistake is looked for."""
BETTER, BETTER_UM = 0.75, 1.5
"""A mistake is one if undoing it leaves at most this share of the misfit, and this much less."""
AS_GOOD = 1.5
"""And no more than this times what is left with all constants free."""
AS_SIMPLE = 1.03
"""Of mistakes that leave no more than this times the least, the simplest is taken."""
LARGE_RAD = 2e-4
"""An angle above this may have been typed in degrees."""
LIKELIER = 10.0
"""Log odds by which the data must prefer the angle in radians."""
TURN_RAD = 6.6
OFF_MM = 0.3
"""An axis point that is off by more was measured to the wrong face."""
NOWHERE_MM = 0.1
"""A first step that is smaller leads to none that is off: what it leaves is of second order."""
PIVOT_STEPS = 3
"""Steps in which the point of an axis is moved to where the data have it."""
INCH = 25.4
SHIFT_REACH = 0.16
"""Of the travel measured: how far a table may be off."""
SHIFTS = 33
"""Shifts that are tried over that reach, to both sides; the middle one is none."""
OF_FILE = "stale table: the curves of the file belong some way beside: "
OF_CONTROL = "stale table: the control corrects with a table shifted by "
SHIFT_ROUNDS = 4
"""How often the shift of each axis is chosen beside those of the others."""


@dataclass(frozen=True, repr=False)
class Mistake:
    """A mistake, and machine and measurements as they are without it.

    before_um, after_um  misfit with it and without it
    likely               the file itself looks like it
    aliases              mistakes of its kind that explain the data as well
    """

    name: str
    title: str
    axis: str
    machine: Machine
    measurements: tuple[Measurement, ...]
    before_um: float = 0.0
    after_um: float = 0.0
    likely: bool = False
    aliases: tuple[str, ...] = ()
    given_um: float = 0.0
    odds: float = 0.0


def find(measurements: Sequence[Measurement], machine: Machine, refused: Sequence[str] = ()) -> Mistake | None:
    """The mistake that explains nearly everything, if one does."""
    measurements = tuple(measurements)
    now = misfit(measurements, machine)
    left = now.left()
    agrees = left < SUSPECT * now.noise or left < now.noise + SUSPECT_UM
    if agrees and not any(_looks_typed(effect) for effect in machine.effects):
        return None
    names = {plain(name) for name in refused}
    return _convincing(
        [_tried(each, left) for each in _offered(measurements, machine) if plain(each.name) not in names], now
    )


def _convincing(tried: Sequence[Mistake], now: Misfit) -> Mistake | None:
    """The simplest that leaves as little as any: one that the file itself looks like, or that explains nearly all."""
    left, least = now.left(), min((each.after_um for each in tried), default=np.inf)
    alike = [each for each in tried if each.after_um <= AS_SIMPLE * least]
    typed = next((each for each in alike if each.likely), None)
    if typed is not None and now.count * np.log(left / typed.after_um) > LIKELIER:
        return typed
    if not alike or not _explains(least, left, now):
        return None
    return replace(alike[0], aliases=_of_its_kind(alike))


def _of_its_kind(alike: Sequence[Mistake]) -> tuple[str, ...]:
    """The names of the others that begin with the same word as the first: `pivot B` beside `pivot C`."""
    first = alike[0].name
    return tuple(each.name for each in alike[1:] if each.name.split()[0] == first.split()[0] and each.name != first)


def _tried(mistake: Mistake, before: float) -> Mistake:
    """The mistake with what undoing it leaves."""
    return replace(mistake, before_um=before, after_um=misfit(mistake.measurements, mistake.machine).left())


def _explains(left: float, before: float, now: Misfit) -> bool:
    if left >= BETTER * before or left >= before - BETTER_UM:
        return False
    return left < AS_GOOD * max(now.noise, min(now.free, 2 * now.noise))


def _offered(measurements: tuple[Measurement, ...], machine: Machine) -> Iterator[Mistake]:
    """Simple ones first."""
    yield from _signs(measurements, machine)
    yield from _units(measurements, machine)
    for axis in machine.axes:
        if axis.rotary:
            title = f"rotary sign: the machine file turns {axis.name} the other way round"
            turned = _with(machine, replace(axis, direction=tuple(-x for x in axis.direction)))  # type: ignore[arg-type]
            yield Mistake(f"rotary sign {axis.name}", title, axis.name, turned, measurements)
            moved = _pivot(measurements, machine, axis)
            if moved is not None:
                yield moved
    for shifted, title in _shifted_tables(measurements, machine):
        yield Mistake("stale table", title, "", shifted, measurements)


def _signs(measurements: tuple[Measurement, ...], machine: Machine) -> Iterator[Mistake]:
    """The control corrects already, or corrects the wrong way, or the file holds corrections."""
    if machine.is_perfect:
        return
    title = "table already active: the control compensates what the model predicts"
    yield Mistake("table active", title, "", _scaled(machine, 0.0), measurements)
    title = "wrong sign: the model holds corrections instead of errors"
    yield Mistake("wrong sign", title, "", _scaled(machine, -1.0), measurements)
    title = "wrong sign of the table in the control: errors are doubled"
    yield Mistake("wrong sign", title, "", _scaled(machine, 2.0), measurements)


def _scaled(machine: Machine, factor: float) -> Machine:
    effects = tuple(replace(e, coefficients=tuple(factor * c for c in e.coefficients)) for e in machine.effects)
    return machine.replace(effects=effects)


def _units(measurements: tuple[Measurement, ...], machine: Machine) -> Iterator[Mistake]:
    linear = [axis.name for axis in machine.axes if not axis.rotary]
    yield Mistake(
        "inch", "inch: positions of the linear axes are in inches", "", machine, _times(measurements, linear, INCH)
    )
    rotary = [axis.name for axis in machine.axes if axis.rotary]
    if rotary and max(float(np.abs(each.column(a)).max()) for each in measurements for a in rotary) < TURN_RAD:
        title = "radian: angles in the measurement are in radians instead of degrees"
        yield Mistake("degree", title, "", machine, _times(measurements, rotary, 180 / np.pi))
    for index, effect in enumerate(machine.effects):
        if _looks_typed(effect):
            title = f"degree: {effect.name} of the machine file was typed in degrees instead of radians"
            yield Mistake("degree", title, effect.joint, _in_radians(machine, index), measurements, likely=True)


def _looks_typed(effect: Effect) -> bool:
    return effect.rotational and max(map(abs, effect.coefficients), default=0.0) > LARGE_RAD


def _in_radians(machine: Machine, index: int) -> Machine:
    effects = list(machine.effects)
    values = tuple(c * np.pi / 180 for c in effects[index].coefficients)
    effects[index] = replace(effects[index], coefficients=values)
    return machine.replace(effects=tuple(effects))


def _times(measurements: tuple[Measurement, ...], axes: Sequence[str], factor: float) -> tuple[Measurement, ...]:
    names = {*axes, *(f"m{axis.lower()}" for axis in axes)}
    return tuple(
        each.with_columns({name: factor * values for name, values in each.columns.items() if name in names})
        for each in measurements
    )


def _pivot(measurements: tuple[Measurement, ...], machine: Machine, axis: Axis) -> Mistake | None:
    """The axis point moved to where the data have it."""
    located = [Effect(f"E{letter}0{axis.name}", (0.0,)) for letter in "XYZ"]
    moved, point = machine, np.asarray(axis.point)
    for _ in range(PIVOT_STEPS):
        shift = misfit(measurements, moved, located).coefficients
        way = np.asarray(axis.error_axes).T @ shift
        way -= np.asarray(axis.direction) * (way @ np.asarray(axis.direction))
        point = point + way
        if np.linalg.norm(point - np.asarray(axis.point)) < NOWHERE_MM:
            return None
        moved = _with(machine, replace(axis, point=tuple(float(x) for x in point)))  # type: ignore[arg-type]
    off = float(np.linalg.norm(point - np.asarray(axis.point)))
    if off < OFF_MM:
        return None
    title = f"pivot: the point of {axis.name} is {off:.2f} mm off in the machine file"
    return Mistake(f"pivot {axis.name}", title, axis.name, moved, measurements)


def _with(machine: Machine, axis: Axis) -> Machine:
    return machine.replace(axes=tuple(axis if each.name == axis.name else each for each in machine.axes))


def _shifted_tables(measurements: Sequence[Measurement], machine: Machine) -> Iterator[tuple[Machine, str]]:
    """The machine with its curves at the likeliest other place, and with a control that corrects there."""
    seen = residual_data(measurements, machine)
    basis = orthonormal(seen.base / seen.relative[:, None])
    curves = {
        axis.name: [e for e in machine.effects if _bent(e) and e.signal == axis.name] for axis in seen.measured.linear
    }
    curves = {name: effects for name, effects in curves.items() if effects}
    if not curves:
        return
    ways = {name: _ways(seen.measured.spans[name]) for name in curves}
    shown = {name: _shown(seen, basis, curves[name], ways[name]) for name in curves}
    own = {name: rows[len(rows) // 2] for name, rows in shown.items()}
    y = _left(basis, seen.y / seen.relative) + sum(own.values(), np.zeros(len(seen.y)))
    corrected = {name: own[name] - rows for name, rows in shown.items()}
    for title, by_control, patterns in ((OF_FILE, False, shown), (OF_CONTROL, True, corrected)):
        beside = _found(y, patterns)
        if any(k != SHIFTS // 2 for k in beside.values()):
            yield _machine(machine, curves, ways, beside, by_control), title + _said(ways, beside)


def _shown(seen: ResidualData, basis: Array, curves: Sequence[Effect], ways: Array) -> Array:
    """What curves of one axis show at every other place, beside what is free, (places, m)."""
    moved = [replace(e, center=e.center - float(way)) for way in ways for e in curves]
    values = np.concatenate([np.asarray(e.coefficients) for e in curves])
    designs = np.split(seen.design(moved), len(ways), axis=1)
    columns = np.stack([design @ values for design in designs], axis=1)
    left: Array = without(basis, columns / seen.relative[:, None]).T
    return left


def _bent(effect: Effect) -> bool:
    return effect.active and effect.basis.needs_signal and not effect.location


def _ways(span: tuple[float, float]) -> Array:
    return np.linspace(-SHIFT_REACH, SHIFT_REACH, SHIFTS) * (span[1] - span[0])


def _left(basis: Array, values: Array) -> Array:
    return without(basis, values[:, None])[:, 0]


def _found(y: Array, shown: dict[str, Array]) -> dict[str, int]:
    """The place of each axis's curves that leaves least, one axis after another."""
    chosen = dict.fromkeys(shown, SHIFTS // 2)
    for _ in range(SHIFT_ROUNDS):
        for name, rows in shown.items():
            rest = y - sum((shown[other][k] for other, k in chosen.items() if other != name), np.zeros(len(y)))
            chosen[name] = int(((rest - rows) ** 2).sum(axis=1).argmin())
    return chosen


def _machine(
    machine: Machine, curves: dict[str, list[Effect]], ways: dict[str, Array], at: dict[str, int], corrected: bool
) -> Machine:
    moved = {id(e): replace(e, center=e.center - float(ways[name][at[name]])) for name in curves for e in curves[name]}
    if not corrected:
        return machine.replace(effects=tuple(moved.get(id(e), e) for e in machine.effects))
    against = tuple(replace(e, coefficients=tuple(-c for c in e.coefficients)) for e in moved.values())
    constants = tuple(
        e if id(e) in moved else replace(e, coefficients=(0.0,) * len(e.coefficients)) for e in machine.effects
    )
    return machine.replace(effects=(*constants, *against))


def _said(ways: dict[str, Array], at: dict[str, int]) -> str:
    return ", ".join(f"{ways[name][k]:+.0f} mm in {name}" for name, k in at.items())
