"""Mistakes of units: of measured values, positions, angles and tools, in all files or in one of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ncfix.diagnosis.mistakes.mistake import Mistake, times, undone_by_columns
from ncfix.machine import Effect, Machine
from ncfix.measure.measurement import Measurement

LARGE_RAD = 2e-4
"""An angle above this may have been typed in degrees."""
TURN_RAD = 6.6
INCH = 25.4
LENGTHS, DEVIATIONS = ("dx", "dy", "dz", "value"), ("tcp", "tcp6", "axis")
"""Columns of measured deviations in mm, and the kinds of files that have them."""
READINGS = ("x", "y", "z", "length")
"""Columns in mm of what is no deviation: where targets are, and how long a gauge is. Those of probes are positions."""


def units_of_values(measurements: tuple[Measurement, ...], machine: Machine) -> Iterator[Mistake]:
    """Measured values in another unit than mm."""
    names = (*LENGTHS, *READINGS)
    values = sum(len(each) * len(each.measured) for each in measurements)
    in_mm = sum(len(each) * sum(name in names for name in each.measured) for each in measurements)
    share = in_mm / max(values, 1)
    for unit, factor in (("um", 1e-3), ("m", 1e3), ("inch", INCH)) if in_mm else ():
        title = f"unit of values: the measured values are in {unit}, not in mm"
        columns = {name: (name, factor) for name in names}
        yield undone_by_columns("unit of values", title, machine, measurements, columns, factor**share)


def units_of_tools(measurements: tuple[Measurement, ...], machine: Machine) -> Iterator[Mistake]:
    """Lengths of tools in another unit than mm."""
    for unit, factor in (("m", 1e3), ("inch", INCH)):
        title = f"tool length: the lengths of the tools are in {unit}, not in mm"
        yield Mistake("tool length", title, "", machine, times(measurements, ["tool_length"], factor))


def units_of_one_file(measurements: tuple[Measurement, ...], machine: Machine) -> Iterator[Mistake]:
    """The same mistakes of units in one of several files."""
    values = [len(each) * len(each.measured) for each in measurements]
    for k, each in enumerate(measurements) if len(measurements) > 1 else ():
        offered = [*units((each,), machine), *units_of_values((each,), machine)]
        if each.column("tool_length").any():
            offered += units_of_tools((each,), machine)
        for wrong in offered:
            if wrong.measurements[0] is not each:
                changed = (*measurements[:k], *wrong.measurements, *measurements[k + 1 :])
                title = f"{wrong.title} (in {each.path} only)"
                stretch = wrong.stretch ** (values[k] / sum(values))
                yield replace(wrong, title=title, measurements=changed, stretch=stretch)


def units(measurements: tuple[Measurement, ...], machine: Machine) -> Iterator[Mistake]:
    """Positions in another unit than mm and degree, and angles of the machine file that were typed in degrees."""
    linear = [axis.name for axis in machine.axes if not axis.rotary]
    for name, said, factor in (("inch", "inches", INCH), ("metre", "metres", 1e3), ("um", "micrometres", 1e-3)):
        changed = times(measurements, linear, factor)
        title = f"{name}: positions of the linear axes are in {said}"
        yield Mistake(name, title, "", machine, changed, stretch=_stretch(measurements, linear, factor))
    rotary = [axis.name for axis in machine.axes if axis.rotary]
    if rotary and max(float(np.abs(each.column(a)).max()) for each in measurements for a in rotary) < TURN_RAD:
        title = "radian: angles in the measurement are in radians instead of degrees"
        yield Mistake("degree", title, "", machine, times(measurements, rotary, 180 / np.pi))
    for index, effect in enumerate(machine.effects):
        if looks_typed(effect):
            title = f"degree: {effect.name} of the machine file was typed in degrees instead of radians"
            yield Mistake("degree", title, effect.joint, _in_radians(machine, index), measurements, likely=True)


def looks_typed(effect: Effect) -> bool:
    """Whether an angle is so large that it may have been typed in degrees."""
    return effect.rotational and max(map(abs, effect.coefficients), default=0.0) > LARGE_RAD


def _in_radians(machine: Machine, index: int) -> Machine:
    effects = list(machine.effects)
    values = tuple(c * np.pi / 180 for c in effects[index].coefficients)
    effects[index] = replace(effects[index], coefficients=values)
    return machine.replace(effects=tuple(effects))


def _stretch(measurements: tuple[Measurement, ...], axes: Sequence[str], factor: float) -> float:
    """By how much the readings are stretched: those of a probe are positions of axes."""
    names = {*axes, *(f"m{axis.lower()}" for axis in axes)}
    shares = [len(names & set(each.measured)) / max(len(each.measured), 1) for each in measurements]
    return float(factor ** np.mean(shares))
