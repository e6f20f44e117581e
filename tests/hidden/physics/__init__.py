"""The benchmark's own catalogue of physics: `catalogue(machine)`, `vocabulary(machine)` and `foreign(machine)`."""

from __future__ import annotations

from ..chain import Machine
from . import foreign as strangers
from . import linear, location, rotary, thermal, weight
from .entry import Entry, Field
from .vocabulary import sayable

__all__ = ["Entry", "Field", "catalogue", "foreign", "location", "vocabulary"]


def catalogue(machine: Machine) -> tuple[Entry, ...]:
    """Every effect with a name that can act on this machine and show in its data."""
    parts = (linear, rotary, weight, thermal)
    return tuple(entry for part in parts for entry in part.entries(machine))


def vocabulary(machine: Machine) -> tuple[Entry, ...]:
    """The catalogue, and what else a diagnosis may name; an entry of another name may be a form of it."""
    hidden = catalogue(machine)
    names = {entry.name for entry in hidden}
    return (*hidden, *(entry for entry in sayable(machine) if entry.name not in names))


def foreign(machine: Machine) -> tuple[Entry, ...]:
    """Effects for which there is no name."""
    return tuple(strangers.entries(machine))
