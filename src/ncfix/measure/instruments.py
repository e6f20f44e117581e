"""The observation model of each kind of measurement, and simulated measurements.

`observe` returns the observation model of a measurement. `simulate` fills in a plan with noise, drift and a random,
unknown set-up. It uses the same observation models as calibration, so the data contain only what instruments see.
"""

from __future__ import annotations

import numpy as np

from ncfix.arguments import FAULT, SEED
from ncfix.arrays import Array
from ncfix.diagnostics import UsageError
from ncfix.machine import Machine
from ncfix.measure.direct import DirectReading
from ncfix.measure.lengths import BallBar, Gauge
from ncfix.measure.measurement import Measurement
from ncfix.measure.observation import Observation
from ncfix.measure.tip_errors import Probing, TipErrors
from ncfix.measure.tracker import Targets
from ncfix.values import frozen

UNKNOWNS = 6
"""Largest number of unknowns of a set: a shift and a rotation."""
MAX_ELEMENTS = 60_000_000
"""Largest number of elements of the design of the unknowns: half a gigabyte, of which some copies are needed."""
FEW_SETS = 100
"""Number of sets that is always allowed."""
ROUNDS = 50
"""Largest number of iterations to find readings that are axis positions."""
SETTLED = 1e-9
"""Largest change of a reading, mm, at which the iteration ends."""

VIEWS: dict[str, type[Observation]] = {
    "tcp": TipErrors,
    "tcp6": TipErrors,
    "probe": Probing,
    "axis": DirectReading,
    "points": Targets,
}


def observe(measurement: Measurement, machine: Machine) -> Observation:
    """The observation model of this measurement's kind, for this machine.

    Raises `UsageError` NCF624 if it has too many set-ups to solve for.
    """
    labels = measurement.labels
    names = [len(set(labels[name])) for name in ("ball", "target") if name in labels]
    zeros = [labels["component"]] if measurement.kind == "axis" else []
    sets = len(set(zip(measurement.sets, *zeros, strict=True)))
    values, unknowns = 3 * len(measurement), UNKNOWNS * sets + 3 * sum(names)
    if values * unknowns > MAX_ELEMENTS and sets > FEW_SETS:
        text = (
            f"{sets} sets in {len(measurement)} rows: about {unknowns} unknowns of set-ups, which are too many to "
            "compute"
        )
        hint = "give all rows that were measured in one set-up the same `set`"
        raise UsageError.of("NCF624", text, measurement.place(0), hint)
    if measurement.kind == "length":
        return (BallBar if "radius" in measurement.columns else Gauge)(measurement, machine)
    return VIEWS[measurement.kind](measurement, machine)


@frozen
class Faults:
    """Disturbances of a simulated measurement.

    noise_um        standard deviation of a length, um
    noise_urad      standard deviation of an angle, urad; None: that of a length at 100 mm
    drift_um        largest linear drift of a length over the measurement (by `time_s`, else by row), um; the drift of
                    each component is random between minus and plus this
    quantum_um      step of the instrument's display, um; 0: none
    setup           size of the unknown set-up: 1 as usual for the instrument, 0 none

    Raises `UsageError` NCF025.
    """

    noise_um: float = 0.0
    noise_urad: float | None = None
    drift_um: float = 0.0
    quantum_um: float = 0.0
    setup: float = 1.0

    def __post_init__(self) -> None:
        for name in ("noise_um", "noise_urad", "drift_um", "quantum_um", "setup"):
            if (value := getattr(self, name)) is not None or name != "noise_urad":
                FAULT.check(name, value)


def simulate(plan: Measurement, machine: Machine, faults: Faults | None = None, seed: int = 0) -> Measurement:
    """The plan with simulated readings of this machine; equal seeds give equal values.

    Raises `UsageError` NCF025 for an invalid seed.
    """
    SEED.check("seed", seed)
    faults = Faults() if faults is None else faults
    random = np.random.default_rng(seed)
    seen = observe(_started(plan), machine)
    unknowns = seen.unknowns
    setup = unknowns.start + faults.setup * unknowns.spread * random.standard_normal(len(unknowns.start))
    if isinstance(seen, Probing):
        setup = seen.with_bars(setup, random)
    filled, model = _settled(plan, machine, setup)
    values = model.predict(machine, setup)[: len(plan) * len(model.components)]
    turns = model.turns
    urad = faults.noise_urad if faults.noise_urad is not None else faults.noise_um * 10.0
    noise = np.where(turns, urad * 1e-6, faults.noise_um * 1e-3) * random.standard_normal(values.shape)
    values = values + noise + np.where(turns, 0.0, _drift(filled, model, faults, random))
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
    """The plan without measured values; kind probe keeps the positions at which it is to probe."""
    if plan.kind in ("probe", "tcp", "tcp6"):
        return plan
    columns = {name: values for name, values in plan.columns.items() if name not in plan.measured}
    return Measurement(plan.kind, plan.headers, columns, plan.labels, plan.lines, plan.path)


def _settled(plan: Measurement, machine: Machine, setup: Array) -> tuple[Measurement, Observation]:
    """The plan and its model; for kind probe, whose readings are axis positions, with exact ones found by iteration."""
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


def _drift(plan: Measurement, model: Observation, faults: Faults, random: np.random.Generator) -> Array:
    """Drift of each value if it is a length, (m,) mm."""
    time = plan.columns.get("time_s", np.arange(len(plan), dtype=np.float64))
    share = (time - time.min()) / (float(np.ptp(time)) or 1.0)
    ways = random.uniform(-1.0, 1.0, len(model.components)) * faults.drift_um * 1e-3
    return np.outer(share, ways).ravel()
