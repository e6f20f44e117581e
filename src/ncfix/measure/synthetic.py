"""Measurements that never were: what an instrument would read on a machine, with noise and the faults of measuring.

The same observation models as for calibration, so what they cannot see is not in the data either; the set-up is drawn
at random and nobody is told.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.machine import Machine
from ncfix.measure.measurement import Array, Measurement
from ncfix.measure.observation import Observation
from ncfix.measure.observe import observe
from ncfix.measure.probing import Probing

ROUNDS = 50
"""Most iterations to find them."""
SETTLED = 1e-9
"""mm: readings that change by less are found."""


@dataclass(frozen=True, slots=True)
class Faults:
    """How a measurement goes wrong.

    noise_um        standard deviation of a length; noise_urad that of an angle, None: that of a length at 100 mm
    drift_um        a straight drift of lengths over the whole measurement (by `time_s`, else by row), per component at
                    random between minus and plus this
    quantum_um      step of the instrument's display, 0 for none
    setup           how far the set-up is off, 1 for what is usual for the instrument, 0 for not at all
    """

    noise_um: float = 0.0
    noise_urad: float | None = None
    drift_um: float = 0.0
    quantum_um: float = 0.0
    setup: float = 1.0


def simulate(plan: Measurement, machine: Machine, faults: Faults | None = None, seed: int = 0) -> Measurement:
    """The plan filled in as this machine would have it, shape as the plan; the same seed gives the same values."""
    faults = Faults() if faults is None else faults
    random = np.random.default_rng(seed)
    seen = observe(_started(plan), machine)
    unknowns = seen.unknowns
    setup = unknowns.start + faults.setup * unknowns.spread * random.standard_normal(len(unknowns.start))
    if isinstance(seen, Probing):
        setup = seen.with_bars(setup, random)
    filled, model = _settled(plan, machine, setup)
    values = model.predict(machine, setup)[: len(plan) * len(model.components)]
    turns = np.tile(_angles(model), 1 if len(_angles(model)) == len(values) else len(plan))
    values = values + _noise(values.shape, turns, faults, random) + _drift(filled, model, turns, faults, random)
    if faults.quantum_um:
        step = np.where(turns, faults.quantum_um * 1e-5, faults.quantum_um * 1e-3)
        values = np.round(values / step) * step
    found = model.with_values(values)
    if faults.noise_um:
        found = found.with_header("noise_um", f"{faults.noise_um:g}")
        if faults.noise_urad is not None:
            found = found.with_header("noise_urad", f"{faults.noise_urad:g}")
    return found


def _started(plan: Measurement) -> Measurement:
    """The plan without values that would be taken for measured ones; probing keeps where it is meant to probe."""
    if plan.kind in ("probe", "tcp", "tcp6"):
        return plan
    columns = {name: values for name, values in plan.columns.items() if name not in plan.measured}
    return Measurement(plan.kind, plan.headers, columns, plan.labels, plan.lines, plan.path)


def _settled(plan: Measurement, machine: Machine, setup: Array) -> tuple[Measurement, Observation]:
    """The plan with exact values; axis positions that are themselves the reading are found by iteration."""
    plan = _started(plan)
    model = observe(plan, machine)
    if plan.kind != "probe":
        return plan, model
    for _ in range(ROUNDS):
        values = model.predict(machine, setup)
        moved = float(np.abs(values[: 3 * len(plan)] - model.values[: 3 * len(plan)]).max())
        plan = model.with_values(values)
        model = observe(plan, machine)
        if moved < SETTLED:
            break
    return plan, model


def _angles(model: Observation) -> Array:
    """Which values are angles: per component, or per value where rows differ."""
    rotational = getattr(model, "rotational", None)
    return np.asarray(model.angular if rotational is None else rotational, dtype=bool)


def _noise(shape: tuple[int, ...], turns: Array, faults: Faults, random: np.random.Generator) -> Array:
    urad = faults.noise_urad if faults.noise_urad is not None else faults.noise_um * 10.0
    size = np.where(turns, urad * 1e-6, faults.noise_um * 1e-3)
    noise: Array = size * random.standard_normal(shape)
    return noise


def _drift(plan: Measurement, model: Observation, turns: Array, faults: Faults, random: np.random.Generator) -> Array:
    time = plan.columns.get("time_s", np.arange(len(plan), dtype=np.float64))
    span = float(np.ptp(time)) or 1.0
    share = (time - time.min()) / span
    ways = random.uniform(-1.0, 1.0, len(model.components)) * faults.drift_um * 1e-3
    drift: Array = np.outer(share, ways).ravel()
    return np.where(turns, 0.0, drift)
