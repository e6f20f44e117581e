"""Mistakes of people and software: the machine is as it is, and somebody told the computer otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ncfix.machine import Machine
from ncfix.measure.measurement import Measurement

if TYPE_CHECKING:
    from ncfix.diagnose.diagnosis import Diagnosis


@dataclass(frozen=True)
class Mistake:
    """A mistake, and machine and measurements as they are without it."""

    name: str
    title: str
    axis: str
    machine: Machine
    measurements: tuple[Measurement, ...]


def find(measurements: Sequence[Measurement], machine: Machine, refused: Sequence[str]) -> Mistake | None:
    """The mistake that explains nearly everything, if one does."""
    return None


def told(found: Diagnosis, wrong: Mistake) -> Diagnosis:
    """The diagnosis with the mistake as its first finding."""
    return found
