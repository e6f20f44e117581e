"""Mistakes of people and software: the machine is as it is, and somebody told the computer otherwise.

Each mistake is undone in turn, and it is looked how well the machine file as it stands, its constants nearly fixed,
then agrees with the data. A mistake that is real explains nearly all at once, with nothing fitted: no missing effect
does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ncfix.diagnose import stale
from ncfix.diagnose.catalogue import Candidate
from ncfix.diagnose.catalogue.build import plain
from ncfix.diagnose.misfit import Misfit, misfit
from ncfix.diagnose.verdict import AMBIGUOUS, FOUND, NOTHING
from ncfix.machine import Effect, Machine
from ncfix.machine.axes import Axis
from ncfix.measure.measurement import Measurement

if TYPE_CHECKING:
    from ncfix.diagnose.findings import Diagnosis

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


def find(measurements: Sequence[Measurement], machine: Machine, refused: Sequence[str] = ()) -> Mistake | None:
    """The mistake that explains nearly everything, if one does."""
    data = tuple(measurements)
    now = misfit(data, machine)
    left = now.left()
    agrees = left < SUSPECT * now.noise or left < now.noise + SUSPECT_UM
    if agrees and not any(_looks_typed(effect) for effect in machine.effects):
        return None
    names = {plain(name) for name in refused}
    return _convincing([_tried(each, left) for each in _offered(data, machine) if plain(each.name) not in names], now)


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


def _offered(data: tuple[Measurement, ...], machine: Machine) -> Iterator[Mistake]:
    """Simple ones first."""
    yield from _signs(data, machine)
    yield from _units(data, machine)
    for axis in machine.axes:
        if axis.rotary:
            title = f"rotary sign: the machine file turns {axis.name} the other way round"
            turned = _with(machine, replace(axis, direction=tuple(-x for x in axis.direction)))  # type: ignore[arg-type]
            yield Mistake(f"rotary sign {axis.name}", title, axis.name, turned, data)
            moved = _pivot(data, machine, axis)
            if moved is not None:
                yield moved
    for shifted, title in stale.tables(data, machine):
        yield Mistake("stale table", title, "", shifted, data)


def _signs(data: tuple[Measurement, ...], machine: Machine) -> Iterator[Mistake]:
    """The control corrects already, or corrects the wrong way, or the file holds corrections."""
    if machine.is_perfect:
        return
    title = "table already active: the control compensates what the model predicts"
    yield Mistake("table active", title, "", _scaled(machine, 0.0), data)
    title = "wrong sign: the model holds corrections instead of errors"
    yield Mistake("wrong sign", title, "", _scaled(machine, -1.0), data)
    title = "wrong sign of the table in the control: errors are doubled"
    yield Mistake("wrong sign", title, "", _scaled(machine, 2.0), data)


def _scaled(machine: Machine, factor: float) -> Machine:
    effects = tuple(replace(e, coefficients=tuple(factor * c for c in e.coefficients)) for e in machine.effects)
    return machine.replace(effects=effects)


def _units(data: tuple[Measurement, ...], machine: Machine) -> Iterator[Mistake]:
    linear = [axis.name for axis in machine.axes if not axis.rotary]
    yield Mistake("inch", "inch: positions of the linear axes are in inches", "", machine, _times(data, linear, INCH))
    rotary = [axis.name for axis in machine.axes if axis.rotary]
    if rotary and max(float(np.abs(each.column(a)).max()) for each in data for a in rotary) < TURN_RAD:
        title = "radian: angles in the measurement are in radians instead of degrees"
        yield Mistake("degree", title, "", machine, _times(data, rotary, 180 / np.pi))
    for index, effect in enumerate(machine.effects):
        if _looks_typed(effect):
            title = f"degree: {effect.name} of the machine file was typed in degrees instead of radians"
            yield Mistake("degree", title, effect.joint, _in_radians(machine, index), data, likely=True)


def _looks_typed(effect: Effect) -> bool:
    return effect.rotational and max(map(abs, effect.coefficients), default=0.0) > LARGE_RAD


def _in_radians(machine: Machine, index: int) -> Machine:
    effects = list(machine.effects)
    values = tuple(c * np.pi / 180 for c in effects[index].coefficients)
    effects[index] = replace(effects[index], coefficients=values)
    return machine.replace(effects=tuple(effects))


def _times(data: tuple[Measurement, ...], axes: Sequence[str], factor: float) -> tuple[Measurement, ...]:
    names = {*axes, *(f"m{axis.lower()}" for axis in axes)}
    return tuple(
        each.with_columns({name: factor * values for name, values in each.columns.items() if name in names})
        for each in data
    )


def _pivot(data: tuple[Measurement, ...], machine: Machine, axis: Axis) -> Mistake | None:
    """The axis point moved to where the data have it."""
    located = [Effect(f"E{letter}0{axis.name}", (0.0,)) for letter in "XYZ"]
    moved, point = machine, np.asarray(axis.point)
    for _ in range(PIVOT_STEPS):
        shift = misfit(data, moved, located).coefficients
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
    return Mistake(f"pivot {axis.name}", title, axis.name, moved, data)


def _with(machine: Machine, axis: Axis) -> Machine:
    return machine.replace(axes=tuple(axis if each.name == axis.name else each for each in machine.axes))


def told(diagnosis: Diagnosis, wrong: Mistake) -> Diagnosis:
    """The diagnosis with the mistake as its first finding."""
    from ncfix.diagnose.findings import Finding

    candidate = Candidate(wrong.name, wrong.title, wrong.axis, "mistake", (), (), remedy="correct the mistake")
    size = float(np.sqrt(max(wrong.before_um**2 - wrong.after_um**2, 0.0)))
    first = Finding(candidate, size**2, 0.0, wrong.aliases, size, (), np.zeros(len(diagnosis.view.y)))
    verdict = (AMBIGUOUS if wrong.aliases else FOUND) if diagnosis.verdict == NOTHING else diagnosis.verdict
    gap = replace(diagnosis.gap, before=wrong.before_um)
    return replace(diagnosis, verdict=verdict, findings=(first, *diagnosis.findings), gap=gap, mistake=wrong)
