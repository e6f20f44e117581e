"""One compensation table of the control: CEC (any axis over any axis) or EEC (an encoder over its own axis)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.tables.grid import Array, Grid

DIGITS = 7
"""Decimals of values: 0.1 nm, so that factors of products keep theirs."""
PLACES = 4
"""Decimals of positions."""
BOTH = 0


@dataclass(frozen=True, slots=True)
class Table:
    """Values at evenly spaced positions of an axis.

    index      of the table (CEC), or of the encoder (EEC)
    input      machine axis that is looked up, e.g. AX1
    output     machine axis that is corrected
    low, step  first position and distance, mm or degree
    values     (k + 1,) mm or degree; those of a multiplier are plain numbers
    direction  0: always; 1, -1: only while the input axis moves that way
    multiply   number (index + 1) of the table that it is multiplied by; 0: none
    modulo     the values repeat
    """

    index: int
    input: str
    output: str
    low: float
    step: float
    values: Array
    direction: int = BOTH
    multiply: int = 0
    modulo: bool = False

    @property
    def high(self) -> float:
        """The last position."""
        return round(self.low + self.step * (len(self.values) - 1), PLACES)

    @property
    def positions(self) -> Array:
        """All positions, (k + 1,)."""
        found: Array = self.low + self.step * np.arange(len(self.values), dtype=np.float64)
        return found

    def grid(self, input_name: str, output_name: str, factor: float, input_unit: float) -> Grid:
        """The table with its values times a factor, over positions in mm or rad."""
        nodes: Array = self.positions * input_unit
        values: Array = (self.values * factor)[:, None]
        return Grid((input_name,), (nodes,), (output_name,), values, (self.modulo,))


def number(value: float, digits: int = DIGITS) -> str:
    """As short as it can be with these decimals, and always with a decimal point."""
    text = f"{round(value, digits) + 0.0:.{digits}f}".rstrip("0")
    return f"{text}0" if text.endswith(".") else text
