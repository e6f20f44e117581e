"""Mistakes of units: of measured values, positions, angles and tools, in all files or in one of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from ncfix.arrays import Mask
from ncfix.diagnosis.checks import sensible
from ncfix.diagnosis.mistakes.mistake import Mistake
from ncfix.diagnosis.residual_data import misfit
from ncfix.diagnosis.selection import ALIAS_LOG_ODDS
from ncfix.diagnostics import UsageError
from ncfix.machine import Effect, Machine
from ncfix.machine.plausible import times_a_machining_centre
from ncfix.measure.measurement import TURNS, Measurement, component_of, perhaps_right

UNIT_OF_VALUES = "unit of values"
LARGE_RAD = 2e-4
"""An error angle above this, rad, may have been typed in degrees."""
TURN_RAD = 6.6
"""Axis angles that nowhere exceed this may be in radians."""
INCH = 25.4
TINY = 1e-9
LENGTHS, DEVIATIONS = ("dx", "dy", "dz", "value"), ("tcp", "tcp6", "axis")
"""Columns of measured deviations in mm, and the kinds of files that have them."""
READINGS = ("x", "y", "z", "length")
"""Measured columns in mm that are no deviations: target coordinates, and lengths. (Those of probes are positions.)"""
UNITS_OF_LENGTH = {"": 1.0, "um": 1e-3, "m": 1e3, "inch": INCH, "thousandths of an inch": INCH / 1e3}
UNITS_OF_ANGLE = {"": 1.0, "urad": 1e-6, "seconds of arc": np.pi / 648000, "mrad": 1e-3, "degrees": np.pi / 180}
"""Units that values may be in by mistake, in mm and rad; "" is the right unit."""
USUAL_UM, USUAL_NOISE_UM, SPREAD = 5.0, 1.0, float(np.log(5.0))
"""Usual residual of a machine file and usual noise, um, and the standard deviation of the logarithm of both.

Two of three machines, small and large, lie within a factor of five. Tested on 8 generated laser measurements (errors of
1.5 to 60 um, repeats of 0.15 to 2 um): if the file knows most of the curve, every wrong unit was named, and no right
one. Without a curve in the file, um was named in all 8; in one, the user is asked about thousandths of an inch. Metres
and inches make values smaller, as good machines do, so sizes do not show these; values that are too good get a remark
(checks.STEADY_UM, NCF616).
"""
RARE = {"thousandths of an inch": float(np.log(100.0))}
"""Prior log odds against a unit."""


def in_usual_unit(measurements: Sequence[Measurement], machine: Machine, refused: Sequence[str]) -> Mistake | None:
    """The wrong unit of implausibly large values, as a mistake; None if the values are plausible as they are.

    Raises `UsageError` NCF654 if no unit makes them plausible, or if several do (the hint names these).
    """
    try:
        sensible(measurements, machine)
    except UsageError as refusal:
        told = all(each.kind == "axis" for each in measurements)  # other kinds may be of another machine
        found = _usual_units(tuple(measurements), machine) if told and UNIT_OF_VALUES not in refused else []
        found = [each for each in found if each.odds > found[0].odds - ALIAS_LOG_ODDS]
        if not found:
            raise
        if len(found) > 1:
            said = "; or ".join(each.title.removeprefix(f"{UNIT_OF_VALUES}: ") for each in found)
            hint = f"{said}? In such a unit machines err so"
            raise UsageError.of("NCF654", refusal.messages[0].text, hint=hint) from refusal
        return found[0]
    return None


def _usual_units(measurements: tuple[Measurement, ...], machine: Machine) -> list[Mistake]:
    """The units that make residual and noise of the values usual, as mistakes with their log odds, likeliest first."""
    given, size = _usual(measurements, machine)
    offered = [*units_of_values(measurements, machine), *units_of_one_file(measurements, machine)]
    found = []
    for each in [each for each in offered if each.name == UNIT_OF_VALUES]:
        usual, _ = _usual(each.measurements, machine)
        odds = usual - given - sum(less for unit, less in RARE.items() if unit in each.title)
        found.append(replace(each, odds=odds, sure=True, given_um=size))
    return sorted([each for each in found if each.odds > 0], key=lambda each: -each.odds)


def _usual(measurements: tuple[Measurement, ...], machine: Machine) -> tuple[float, float]:
    """Log likelihood of the sizes of residual and noise of these values; and the residual, um rms."""
    now, large = misfit(measurements, machine), times_a_machining_centre(machine)
    noise = [float(np.median(each.um * each.sigma)) for each in now.problem.observations if each.noise_known]
    unusual = np.log(np.maximum([now.free / USUAL_UM, *(each / USUAL_NOISE_UM for each in noise)], TINY) / large)
    return -0.5 * float(((unusual / SPREAD) ** 2).sum()), now.free


def units_of_values(measurements: tuple[Measurement, ...], machine: Machine) -> Iterator[Mistake]:
    """Mistakes of measured values given in another unit than mm and rad."""
    turns = [_turns(each) for each in measurements]
    parts = [part for each in turns for part in each.values()]
    angles = sum(int(part.sum()) for part in parts)
    lengths = sum(map(len, parts)) - angles
    for of_length, of_angle in product(UNITS_OF_LENGTH, UNITS_OF_ANGLE):
        factors, named = (UNITS_OF_LENGTH[of_length], UNITS_OF_ANGLE[of_angle]), [of_length, of_angle]
        spare = (of_length and not lengths) or (of_angle and not angles)
        if spare or not any(named) or (all(named) and of_length != "um"):
            continue
        changed = tuple(
            each.with_columns({name: np.where(part, *factors[::-1]) * each.columns[name] for name, part in own.items()})
            for each, own in zip(measurements, turns, strict=True)
        )
        said = " and ".join(filter(None, named))
        title = f"unit of values: the measured values are in {said}, not in {'mm' if of_length else 'rad'}"
        stretch = np.exp(np.log(factors) @ (lengths, angles) / (lengths + angles))
        by = " and ".join(f"{factor:.4g}" for factor in factors if factor != 1)
        remedy = f"multiply them by {by} in the file, and measure nothing anew"
        yield Mistake(UNIT_OF_VALUES, title, "", machine, changed, stretch=float(stretch), remedy=remedy)


def _turns(measurement: Measurement) -> dict[str, Mask]:
    """For each measured column that has a unit, a mask of its rows that are angles."""
    found = {name: np.zeros(len(measurement), dtype=bool) for name in (*LENGTHS, *READINGS)}
    found |= {name: np.ones(len(measurement), dtype=bool) for name in TURNS}
    if measurement.kind == "axis":
        pairs = zip(measurement.labels["axis"], measurement.labels["component"], strict=True)
        found["value"] = np.array([(component_of(*pair) or "EXX")[1] in "ABC" for pair in pairs], dtype=bool)
    return {name: turned for name, turned in found.items() if name in measurement.measured}


def units_of_tools(measurements: tuple[Measurement, ...], machine: Machine) -> Iterator[Mistake]:
    """Mistakes of tool lengths given in another unit than mm."""
    for unit, factor in (("m", 1e3), ("inch", INCH)):
        title = f"tool length: the lengths of the tools are in {unit}, not in mm"
        changed = tuple(each.times(["tool_length"], factor) for each in measurements)
        yield Mistake("tool length", title, "", machine, changed)


def units_of_one_file(measurements: tuple[Measurement, ...], machine: Machine) -> Iterator[Mistake]:
    """Mistakes of units in a single one of several files."""
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
    """Mistakes of axis positions in another unit than mm and degree, and of machine file angles typed in degrees."""
    linear = [axis.name for axis in machine.axes if not axis.rotary]
    for name, said, factor in (("inch", "inches", INCH), ("metre", "metres", 1e3), ("um", "micrometres", 1e-3)):
        offered = [(linear, "positions of the linear axes", right) for right in perhaps_right(measurements)]
        if any(each.kind == "length" for each in measurements):
            offered.append(([*linear, "length", "nominal", "radius"], "positions and lengths", ()))
        for names, what, right in offered:
            changed = tuple(each.times(names, factor, right) for each in measurements)
            stretch = _stretch(measurements, names, factor)
            yield Mistake(name, f"{name}: {what} are in {said}", "", machine, changed, stretch=stretch)
    rotary = [axis.name for axis in machine.axes if axis.rotary]
    if rotary and max(float(np.abs(each.column(a)).max()) for each in measurements for a in rotary) < TURN_RAD:
        title = "radian: angles in the measurement are in radians instead of degrees"
        changed = tuple(each.times(rotary, 180 / np.pi) for each in measurements)
        yield Mistake("radian", title, "", machine, changed)
    for index, effect in enumerate(machine.effects):
        if looks_typed(effect):
            title = f"degree: {effect.name} of the machine file was typed in degrees instead of radians"
            yield Mistake("degree", title, effect.joint, _in_radians(machine, index), measurements, likely=True)


def looks_typed(effect: Effect) -> bool:
    """Whether an effect is an angle so large that it may have been typed in degrees."""
    return effect.rotational and max(map(abs, effect.coefficients), default=0.0) > LARGE_RAD


def _in_radians(machine: Machine, index: int) -> Machine:
    effects = list(machine.effects)
    values = tuple(c * np.pi / 180 for c in effects[index].coefficients)
    effects[index] = replace(effects[index], coefficients=values)
    return machine.replace(effects=tuple(effects))


def _stretch(measurements: tuple[Measurement, ...], names: Sequence[str], factor: float) -> float:
    """The mean factor on readings if these columns are scaled by `factor`: a probe reads axis positions."""
    scaled = [{column for name in names for column in each.columns_of(name)} for each in measurements]
    pairs = zip(scaled, measurements, strict=True)
    shares = [len(own & {*each.measured}) / max(len(each.measured), 1) for own, each in pairs]
    return float(factor ** np.mean(shares))
