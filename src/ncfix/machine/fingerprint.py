"""A short name for a machine's errors, so that a corrected program tells for which state of the machine it is."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ncfix.machine.machine import Machine


def fingerprint(machine: Machine) -> str:
    """12 hexadecimal digits of what matters to a correction: not of names, uncertainties, provenance or zeros."""
    from ncfix.machine.write import dumps

    effects = tuple(replace(effect, covariance=None) for effect in machine.effects if effect.active)
    axes = tuple(replace(axis, pitch=None) for axis in machine.axes)
    bare = machine.replace(name="", control=None, provenance={}, effects=effects, axes=axes)
    return hashlib.sha256(dumps(bare).encode()).hexdigest()[:12]
