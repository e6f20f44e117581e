"""The benchmark's own catalogue of physics: `catalogue(machine)` and `foreign(machine)`."""

from __future__ import annotations

from ..chain import Machine
from . import foreign as strangers
from . import linear, location, rotary, thermal, weight
from .entry import Entry, Field

__all__ = ["Entry", "Field", "catalogue", "foreign", "location"]


def catalogue(machine: Machine) -> tuple[Entry, ...]:
    """Every effect with a name that can act on this machine and show in its data."""
    parts = (linear, rotary, weight, thermal)
    return tuple(entry for part in parts for entry in part.entries(machine))


def foreign(machine: Machine) -> tuple[Entry, ...]:
    """Effects for which there is no name."""
    return tuple(strangers.entries(machine))
