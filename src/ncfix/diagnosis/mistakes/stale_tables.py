"""Error curves shifted along their axes, as in a table made before a reference point was moved."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnosis.residual_data import ResidualData, residual_data
from ncfix.machine import Effect, Machine
from ncfix.measure.least_squares import orthonormal, without
from ncfix.measure.measurement import Measurement

SHIFT_REACH = 0.16
"""Largest shift of a table, as a share of the measured travel."""
SHIFTS = 33
"""Number of shifts that are tried between minus and plus that; the middle one is zero."""
OF_FILE = "stale table: the curves of the file are displaced by "
OF_CONTROL = "stale table: the control corrects with a table shifted by "
SHIFT_ROUNDS = 4
"""Rounds in which the shift of each axis is optimized given those of the others."""


def shifted_tables(measurements: Sequence[Measurement], machine: Machine) -> Iterator[tuple[Machine, str]]:
    """Machines for two mistakes, each with a title: the file's curves are shifted, or those of the control's table."""
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
    """Effect on the values, (shifts, m), of an axis's curves at every shift in `ways`, mm, orthogonal to `basis`."""
    moved = [replace(e, center=e.center - float(way)) for way in ways for e in curves]
    values = np.concatenate([np.asarray(e.coefficients) for e in curves])
    designs = np.split(seen.design(moved), len(ways), axis=1)
    columns = np.stack([design @ values for design in designs], axis=1)
    return without(basis, columns / seen.relative[:, None]).T


def _bent(effect: Effect) -> bool:
    return effect.active and effect.basis.needs_signal and not effect.location


def _ways(span: tuple[float, float]) -> Array:
    return np.linspace(-SHIFT_REACH, SHIFT_REACH, SHIFTS) * (span[1] - span[0])


def _left(basis: Array, values: Array) -> Array:
    return without(basis, values[:, None])[:, 0]


def _found(y: Array, shown: dict[str, Array]) -> dict[str, int]:
    """For each axis, the index of the shift of its curves that leaves the smallest residual."""
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
