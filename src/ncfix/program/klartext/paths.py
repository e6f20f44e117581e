"""The path functions by name."""

from __future__ import annotations

from ncfix.program.klartext.arcs import circular, circular_by_radius, circular_polar, tangential
from ncfix.program.klartext.lines import straight, straight_polar

PATHS = {
    "": straight,
    "l": straight,
    "ln": straight,
    "lp": straight_polar,
    "c": circular,
    "cr": circular_by_radius,
    "cp": circular_polar,
    "ct": tangential,
    "ctp": tangential,
}
"""Path functions by name."""
