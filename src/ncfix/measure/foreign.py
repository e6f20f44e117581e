"""Files of instruments, known by what they look like (to be filled)."""

from __future__ import annotations

from ncfix.machine import Machine
from ncfix.measure.measurement import Measurement


def recognised(text: str, machine: Machine, path: str) -> Measurement | None:
    """The measurement in an instrument's file, or None if it looks like none."""
    return None
