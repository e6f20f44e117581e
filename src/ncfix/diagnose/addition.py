"""The named effects in the model: all coefficients fitted together, and the machine file that has them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ncfix.diagnose.evidence import Court, Member
from ncfix.diagnose.groups import Group
from ncfix.machine import Effect, Machine
from ncfix.machine.basis import Basis, Fourier, Polynomial
from ncfix.machine.effects import Unit, units
from ncfix.measure.measurement import Array

Mask = NDArray[np.bool_]

WIDE = 1e3
"""um: how far a constant of the machine file may be off; wide enough to be no prior, and what cannot be seen stays."""
NOTHING = 1e-12
FIRM = 3.0
"""Standard deviations by which the data must ask for another constant; else the machine file keeps its own."""


@dataclass(frozen=True)
class Joint:
    """Everything fitted at once.

    constants   (k,) changes of the free constants of the machine file, from where the view has them
    sigmas      (k,) their standard deviations
    numbers     for each member (p,) the numbers behind its coefficients; `covariances` of them
    shown       for each member (m,) what it shows, um
    before      (m,) residual with the constants alone; after with the members
    """

    constants: Array
    sigmas: Array
    numbers: tuple[Array, ...]
    covariances: tuple[Array, ...]
    shown: tuple[Array, ...]
    before: Array
    after: Array

    @property
    def together(self) -> Array:
        """What all members show, (m,) um."""
        whole: Array = np.sum([np.zeros(len(self.before)), *self.shown], axis=0)
        return whole


def fitted(court: Court, members: Sequence[Member], share: float, stay: Mask | None = None) -> Joint:
    """The most probable coefficients of constants and members together, and the residuals.

    stay  (k,) free constants that are left as the machine file has them; None: none
    """
    view, free = court.background.view, court.background.view.base
    back = view.problem.selection.start - view.coefficients
    loose = np.ones(len(back), dtype=bool) if stay is None else ~stay
    kept = np.concatenate([np.ones(free.shape[1] - len(back), dtype=bool), loose])
    y = view.y - free[:, ~kept] @ back[~loose]
    lengths = _lengths(free[:, kept])
    base, parts_of = free[:, kept] / lengths, [court.groups[m.group].columns for m in members]
    columns, n = np.concatenate([base, *parts_of], axis=1), base.shape[1]
    widths = [part.shape[1] for part in parts_of]
    own = [np.full(width, m.size**-2) for m, width in zip(members, widths, strict=True)]
    prior = np.concatenate([np.full(n, WIDE**-2), *own])
    precision = court.background.precision(share)
    z, spread = _solved(columns, y, precision, prior)
    alone, _ = _solved(base, y, precision, prior[:n])
    parts = [slice(a, b) for a, b in pairwise(n + np.cumsum([0, *widths]))]
    numbers = tuple(z[part] for part in parts)
    shown = tuple(part @ own_numbers for part, own_numbers in zip(parts_of, numbers, strict=True))
    constants, sigmas = back.copy(), np.zeros(len(back))
    constants[loose] = (z[:n] / lengths)[n - loose.sum() :]
    sigmas[loose] = (np.sqrt(np.diag(spread)[:n]) / lengths)[n - loose.sum() :]
    covariances = tuple(spread[part, part] for part in parts)
    return Joint(constants, sigmas, numbers, covariances, shown, y - base @ alone, y - columns @ z)


def moved(court: Court, joint: Joint) -> Array:
    """(k,) how far the data move the free constants from what the machine file says, in mm and rad."""
    view = court.background.view
    change: Array = view.coefficients + joint.constants - view.problem.selection.start
    return change


@dataclass(frozen=True, slots=True)
class Moved:
    """A constant of the machine file that the data put elsewhere, surely: mm or rad, with its standard deviation.

    unit  what these are multiplied with to be in the unit that people use, and its name
    """

    name: str
    file: float
    data: float
    sigma: float
    unit: Unit


def surely_moved(court: Court, joint: Joint) -> tuple[Moved, ...]:
    """The constants that the data move by more than three standard deviations."""
    view = court.background.view
    selection, change = view.problem.selection, moved(court, joint)
    said = [unit for effect in selection.estimated for unit in units(view.machine, effect)]
    start = selection.start
    return tuple(
        Moved(selection.labels[k], float(start[k]), float(start[k] + change[k]), float(joint.sigmas[k]), said[k])
        for k in np.flatnonzero(np.abs(change) > FIRM * joint.sigmas).tolist()
    )


def firm(court: Court, members: Sequence[Member], share: float, joint: Joint) -> Joint:
    """The fit in which constants stay that the data do not ask to change; the one given if it needs them changed.

    A constant that the data hardly see takes any value that helps a little, and would do harm at other poses.
    """
    stay = np.abs(moved(court, joint)) <= FIRM * joint.sigmas
    held, precision = fitted(court, members, share, stay), court.background.precision(share)
    worse, count = _misfit(held.after, precision) - _misfit(joint.after, precision), int(stay.sum())
    return joint if worse > count + FIRM * np.sqrt(2 * count) else held


def _misfit(residual: Array, precision: Array) -> float:
    return float(residual @ precision @ residual)


def _lengths(columns: Array) -> Array:
    """Sizes of columns as root mean squares, one for those that are zero."""
    size = np.sqrt((columns**2).mean(axis=0))
    return np.where(size > 0, size, 1.0)


def _solved(columns: Array, y: Array, precision: Array, prior: Array) -> tuple[Array, Array]:
    weighed = precision @ columns
    spread = np.linalg.inv(columns.T @ weighed + np.diag(prior))
    found: Array = spread @ (weighed.T @ y)
    return found, np.asarray(spread)


def machine_with(court: Court, members: Sequence[Member], joint: Joint) -> tuple[Machine, list[tuple[Effect, ...]]]:
    """The machine with constants changed and effects added; and the effects that each member brought."""
    view = court.background.view
    start = view.problem.selection.start
    coefficients = view.coefficients + joint.constants
    coefficients = np.where(np.isclose(coefficients, start, rtol=1e-9, atol=0.0), start, coefficients)
    machine = view.problem.selection.machine(view.machine, coefficients.tolist())
    added = [
        effects(court.groups[m.group], numbers, spread)
        for m, numbers, spread in zip(members, joint.numbers, joint.covariances, strict=True)
    ]
    every = (*machine.effects, *(effect for each in added for effect in each))
    return machine.replace(effects=every), added


def effects(group: Group, numbers: Array, spread: Array) -> tuple[Effect, ...]:
    """The effects of a form with their coefficients, without those that are zero; none for what is no error."""
    if group.owner.grows:
        return ()
    values = group.loading @ numbers
    covariance = group.loading @ spread @ group.loading.T
    found, start = [], 0
    for effect in group.owner.effects:
        part = slice(start, start + effect.basis.size)
        start = part.stop
        own = np.abs(group.loading[part]).sum(axis=1) > NOTHING * np.abs(group.loading).sum()
        if own.any():
            found.append(_trimmed(effect, values[part], covariance[part, part], own))
    return tuple(found)


def _trimmed(effect: Effect, values: Array, covariance: Array, own: Array) -> Effect:
    """The effect with its coefficients; orders and powers that the form does not have are left out."""
    basis, keep = _fewer(effect.basis, own)
    even = (covariance + covariance.T)[np.ix_(keep, keep)] / 2
    return replace(
        effect, basis=basis, coefficients=tuple(float(v) for v in values[keep]),
        covariance=tuple(tuple(float(v) for v in row) for row in even),
    )  # fmt: skip


def _fewer(basis: Basis, own: Array) -> tuple[Basis, Array]:
    if isinstance(basis, Fourier):
        pairs = [bool(pair.any()) for pair in own.reshape(-1, 2)]
        orders = tuple(k for k, kept in zip(basis.order, pairs, strict=True) if kept)
        return replace(basis, order=orders), np.repeat(pairs, 2)
    if isinstance(basis, Polynomial):
        return replace(basis, degree=tuple(k for k, kept in zip(basis.degree, own, strict=True) if kept)), own
    return basis, np.ones(len(own), dtype=bool)
