"""Data that cannot carry a diagnosis: said in plain words, and no name is given."""

from __future__ import annotations

from collections.abc import Sequence

from ncfix.diagnose.background import Background
from ncfix.diagnose.groups import Gathered
from ncfix.diagnose.view import View
from ncfix.machine import Machine
from ncfix.measure.measurement import Measurement


def before(measurements: Sequence[Measurement], machine: Machine) -> None:
    """What can be said before anything is computed."""


def after(view: View, ground: Background, gathered: Gathered) -> None:
    """What can be said once the set-up is fitted."""
