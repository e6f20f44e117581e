"""From a measurement to the instrument's view of it."""

from __future__ import annotations

from ncfix.diagnostics import UsageError
from ncfix.machine import Machine
from ncfix.measure.direct import DirectReading
from ncfix.measure.lengths import BallBar, Gauge
from ncfix.measure.measurement import Measurement
from ncfix.measure.observation import Observation
from ncfix.measure.probing import Probing
from ncfix.measure.targets import Targets
from ncfix.measure.tip_errors import TipErrors

UNKNOWNS = 6
"""Of a set, at most: a shift and a turn."""
MOST = 60_000_000
"""Numbers in the matrix of what is unknown: half a gigabyte, of which some copies are needed."""
FEW_SETS = 100
"""Sets that are never too many."""


def observe(measurement: Measurement, machine: Machine) -> Observation:
    """The observation model of this measurement's kind, for this machine's chain.

    Raises `UsageError` NCF624 if it has so many set-ups that what is unknown about them cannot be worked out.
    """
    _bounded(measurement)
    if measurement.kind == "length":
        return (BallBar if "radius" in measurement.columns else Gauge)(measurement, machine)
    models: dict[str, type[Observation]] = {
        "tcp": TipErrors,
        "tcp6": TipErrors,
        "probe": Probing,
        "axis": DirectReading,
        "points": Targets,
    }
    return models[measurement.kind](measurement, machine)


def _bounded(measurement: Measurement) -> None:
    """Refuse equations that no memory holds: a column for each unknown of each set, and a row for each value."""
    names = [len(set(measurement.labels[name])) for name in ("ball", "target") if name in measurement.labels]
    sets = len(set(zip(measurement.sets, *_series(measurement), strict=True)))
    values, unknowns = 3 * len(measurement), UNKNOWNS * sets + 3 * sum(names)
    if values * unknowns > MOST and sets > FEW_SETS:
        text = f"{sets} sets of {len(measurement)} rows: some {unknowns} unknowns of set-ups, too many to work out"
        hint = "rows that were measured in one set-up have one and the same `set`"
        raise UsageError.of("NCF624", text, measurement.place(0), hint)


def _series(measurement: Measurement) -> list[tuple[str, ...]]:
    """What besides the set has a zero of its own."""
    return [measurement.labels["component"]] if measurement.kind == "axis" else []
