"""Search for mistakes in machine file or measurements: wrong signs, units, columns, tables, tools or axis points.

Each mistake is undone in turn, and the machine file is compared with the data with its constants nearly fixed. A real
mistake explains nearly the whole misfit at once without fitting anything; no missing effect does.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from ncfix.diagnosis.catalogue import plain
from ncfix.diagnosis.evidence import SURE
from ncfix.diagnosis.mistakes.kinds import (
    PIVOT,
    at_first_sight,
    looking_like_constants,
    not_of_first_order,
)
from ncfix.diagnosis.mistakes.mistake import Mistake
from ncfix.diagnosis.mistakes.units import looks_typed, units
from ncfix.diagnosis.residual_data import (
    AS_IT_STANDS_UM,
    TIGHT_UM,
    Misfit,
    little_of,
    misfit,
)
from ncfix.diagnostics import NcfixError
from ncfix.machine import Machine
from ncfix.measure.measurement import Measurement, component_of

SUSPECT, TOO_GOOD = 1.15, 0.7
"""Residual, in units of the noise, from which mistakes are sought; and below which a larger unit is suspected."""
OTHERWISE = 0.2
"""If moved constants explain the data, a mistake must leave less than this share of the squares that they explain."""
AS_STANDING = 1.5
"""Largest ratio of the residual with unmoved constants to that with constants nearly fixed, for a file that agrees."""
AS_SIMPLE = 1.03
"""Among mistakes whose residual is within this factor of the smallest, the simplest is chosen."""
TRIED = 8
"""Number of mistakes, the best to first order, that are evaluated exactly."""
NAMES_COST = 25.0
"""Smallest price of names, log odds: within it of the noise, no names can do better than a mistake."""
A_LITTLE_UM = 0.6
"""Small effects that every machining centre has, um per value: no closer to the noise can a file come."""
PLAUSIBLE_UM, DECADE = 3.0, float(np.log(10.0))
"""Usual residual of a value, um, and standard deviation of its logarithm: the prior that makes wrong units unlikely."""
TYPED = 5.0
"""Prior log odds for a mistake that the file itself suggests (`Mistake.likely`)."""
TINY_UM = 1e-6
TORN = "either the machine file or the readings are wrong; no file is written until it is known which"
ALIAS_LOG_ODDS = 3.0
"""Log odds (20 to 1) within which another mistake explains the data as well."""
HOPELESS = 100.0
"""A mistake with log odds further below zero than this, and than what `AS_SIMPLE` forgives, is not fitted to the end:
it is neither found nor listed beside one that is."""
FIRST_SIGHT = 5.0
"""Mistakes with log odds below minus this, to first order, are not evaluated exactly."""


def find(measurements: Sequence[Measurement], machine: Machine, refused: Sequence[str] = ()) -> Mistake | None:
    """The mistake that explains the data best, if one has positive log odds against the given file.

    refused  names of mistakes that must not be used
    """
    measurements = tuple(measurements)
    now = misfit(measurements, machine)
    tried = _suspects(measurements, machine, now, {plain(name) for name in refused})
    best = max(tried, key=lambda each: each.odds, default=None)
    if best is None or best.odds <= 0:
        return None
    slack = now.count * float(np.log(AS_SIMPLE))
    alike = [each for each in tried if each.odds > best.odds - slack and each.stretch == best.stretch]
    found = _simplest(alike, [each for each in tried if each.replaces and each.after_um < AS_SIMPLE * best.after_um])
    if found.odds <= 0:
        return None
    near = [each for each in alike if each.odds > found.odds - ALIAS_LOG_ODDS and each is not found]
    torn = len({each.machine == machine for each in (found, *near)}) > 1
    components = len(now.problem.values) / max(sum(map(len, measurements)), 1)
    return replace(
        found,
        given_um=now.left(AS_IT_STANDS_UM) * float(np.sqrt(components)),
        aliases=(*dict.fromkeys(each.name for each in near if each.name != found.name), *found.aliases),
        sure=found.odds > NAMES_COST and (found.gained is not None or _reaches_noise(found, now)),
        torn=torn,
        remedy=f"{TORN}{_sense(measurements, machine)}" if torn else found.remedy,
    )


def _suspects(
    measurements: tuple[Measurement, ...], machine: Machine, now: Misfit, refused: Collection[str]
) -> list[Mistake]:
    """Mistakes that may explain the misfit, with their log odds.

    If none is likely, but the constants of the file must move to explain the data, mistakes that make this unnecessary
    are sought. These include units of positions, since inches make a squareness 25.4 times as large. Residuals are
    compared in the unit of the file.
    """
    left, standing = now.left(), now.left(AS_IT_STANDS_UM)
    far = left >= SUSPECT * now.noise or any(looks_typed(effect) for effect in machine.effects)
    moved = standing >= SUSPECT * max(left, now.noise)  # constants, or points of axes, or units
    deep: list[Mistake] = []
    if far or moved or left < TOO_GOOD * now.noise:
        kinds = not_of_first_order if far else looking_like_constants
        deep = [each for each in kinds(measurements, machine, now) if plain(each.name) not in refused]
    tried = _judged(measurements, machine, now, TIGHT_UM, deep, refused)
    if moved and not any(each.odds > 0 for each in tried):
        most = OTHERWISE * (standing**2 - left**2)
        deep = [each for each in units(measurements, machine) if plain(each.name) not in refused]
        tried = _judged(measurements, machine, now, AS_IT_STANDS_UM, deep, refused)
        tried = [each for each in tried if (each.after_um / each.stretch) ** 2 - left**2 < most]
    return tried


def _simplest(alike: Sequence[Mistake], others: Sequence[Mistake]) -> Mistake:
    """The simplest of mistakes that explain the data equally well.

    If the file, with that undone, does not agree with the data: the likeliest wrong axis point with which it does, or
    else the likeliest of `others`, which replace the constants of the file.
    """
    simplest = min(alike, key=lambda each: (each.fitted, -each.odds))
    if (others or len(alike) > 1) and not _stands(simplest):
        points = [each for each in alike if each.name.startswith(PIVOT) and _stands(each)]
        return max(points or others or [simplest], key=lambda each: each.odds)
    return simplest


def _sense(measurements: Sequence[Measurement], machine: Machine) -> str:
    """A remark on the sign convention of positioning deviations, if the files have any; else ""."""
    read = {
        component
        for each in measurements
        if each.kind == "axis"
        for axis, name in zip(each.labels["axis"], each.labels["component"], strict=True)
        if (component := component_of(axis, name)) and machine.is_positioning(component)
    }
    if not read:
        return ""
    return f"; {', '.join(sorted(read))} is actual minus target of the body, and a table goes against its numbers"


def _judged(
    measurements: tuple[Measurement, ...], machine: Machine, now: Misfit, held_um: float,
    deep: Sequence[Mistake], refused: Collection[str],
) -> list[Mistake]:  # fmt: skip
    """Mistakes with their log odds: the best ones to first order, and all of `deep`.

    held_um  prior standard deviation of the constants, um
    """
    quick = [each for each in at_first_sight(measurements, machine, now, held_um) if plain(each[1].name) not in refused]
    count, before = len(quick) + len(deep), now.left(held_um)
    sighted = [(_odds(left, before, each, now, now, count), each) for left, each in quick]
    sighted.sort(key=lambda pair: pair[0])
    near = [each for odds, each in sighted[-TRIED:] if odds > -FIRST_SIGHT]
    tried = [_tried(each, before, now, count, held_um) for each in (*near, *deep)]
    return [each for each in tried if np.isfinite(each.odds)]


def _odds(left: float, before: float, mistake: Mistake, undone: Misfit, now: Misfit, count: int) -> float:
    return _weight(left, mistake.stretch, undone) - _paid(mistake, now, count) - _weight(before, 1.0, now)


def _paid(mistake: Mistake, now: Misfit, count: int) -> float:
    fitted = 0.5 * mistake.fitted * float(np.log(now.count))
    return float(np.log(count)) + SURE + fitted - TYPED * mistake.likely


def _weight(left: float, stretch: float, now: Misfit) -> float:
    """Log likelihood of the values in the file, given the residual `left`, um, of the values times `stretch`."""
    scatter = float(np.log(now.relative).mean())  # another unit changes the noise from repeats, too
    fit = -now.count * (float(np.log(max(left, TINY_UM))) + scatter - float(np.log(stretch)))
    return fit - 0.5 * (float(np.log(max(left, TINY_UM) / PLAUSIBLE_UM)) / DECADE) ** 2


def _tried(mistake: Mistake, before: float, now: Misfit, count: int, held_um: float) -> Mistake:
    """The mistake with its residual after being undone, constants held within `held_um`, and its log odds."""
    slack = HOPELESS + now.count * float(np.log(AS_SIMPLE))

    def hopeless(least: float) -> bool:
        return _odds(max(least, 0.0), before, mistake, undone, now, count) < -slack

    try:
        undone = misfit(mistake.measurements, mistake.machine)
        left = undone.left(held_um, hopeless if mistake.gained is None else None)
    except (NcfixError, np.linalg.LinAlgError, ValueError):
        return replace(mistake, odds=-np.inf)
    paid, odds = _paid(mistake, now, count), _odds(left, before, mistake, undone, now, count)
    odds = odds if mistake.gained is None else mistake.gained - paid
    return replace(mistake, before_um=before, after_um=left, odds=odds, paid=paid)


def _stands(mistake: Mistake) -> bool:
    """Whether, with the mistake undone, the file agrees with the data without moving its constants."""
    left = misfit(mistake.measurements, mistake.machine).left(AS_IT_STANDS_UM)
    return left < AS_STANDING * mistake.after_um


def _reaches_noise(mistake: Mistake, now: Misfit) -> bool:
    """Whether, with the mistake undone, the residual of the file is the noise without fitting its constants."""
    fixed = misfit(mistake.measurements, mistake.machine)
    still = _weight(max(mistake.after_um, fixed.left(AS_IT_STANDS_UM)), mistake.stretch, fixed) - mistake.paid
    little = A_LITTLE_UM * little_of(mistake.machine, fixed.noise)
    floor = float(np.hypot(fixed.noise, little)) / mistake.stretch
    return still >= _weight(floor, 1.0, fixed) - NAMES_COST


def is_a_point_of(wrong: Mistake, constants: Collection[str]) -> bool:
    """Whether a mistake is a wrong axis point that one of the named constants could imitate.

    The data cannot tell the two apart. The point is then corrected: a constant in its place would make programs worse
    if the control has the right point.
    """
    return wrong.name.startswith(PIVOT) and not set(wrong.aliases).isdisjoint(constants)
