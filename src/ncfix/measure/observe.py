"""From a measurement to the instrument's view of it."""

from __future__ import annotations

from ncfix.machine import Machine
from ncfix.measure.direct import DirectReading
from ncfix.measure.lengths import BallBar, Gauge
from ncfix.measure.measurement import Measurement
from ncfix.measure.observation import Observation
from ncfix.measure.probing import Probing
from ncfix.measure.targets import Targets
from ncfix.measure.tip_errors import TipErrors


def observe(measurement: Measurement, machine: Machine) -> Observation:
    """The observation model of this measurement's kind, for this machine's chain."""
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
