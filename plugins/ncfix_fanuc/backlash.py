"""Play as backlash compensation, parameter 1851: what is added to an axis whenever it turns round.

The parameter manuals (B-63090EN, B-64120EN and later) say it: detection units, -9999 to 9999; moved against the
direction of its reference position return, an axis is moved by the amount as well, in the direction of that motion.
Moved in the direction of the return it is not, so that the mean of both ways is off by half of the amount, which goes
into the grid.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ncfix.tables.axis_tables import reversals
from ncfix.tables.compensation import Compensation, Term
from ncfix.tables.control import Assumption, Files, Option, Request, SettingForm, one_of
from ncfix.tables.grid import Array, Grid
from ncfix.tables.table_files import Remarks
from ncfix_fanuc.pitch_text import parameter_text, read_records

NAME = "backlash.txt"
NUMBER = 1851
LARGEST = 9999
AXES = ("X", "Y", "Z")

ASSUMPTION = Assumption(
    "FANUC-6",
    "X, Y and Z are the axes 1, 2 and 3 of the parameters, they home towards plus unless --set home_minus says "
    "otherwise, and backlash compensation acts besides the grid.",
    "parameter manuals: 1851 in detection units, first added when the axis moves against its reference position "
    "return; of the grid they say nothing",
    "so; --set play=no writes no backlash",
    "Parameter 1006#5 (ZMI) is the direction of the return. Turn an axis round under a dial gauge with 1851 at zero, "
    "and as written: the play must have gone, not doubled.",
)
HOMING = SettingForm(
    "axes of X, Y and Z, like XY",
    lambda text: set(text.upper()) <= set(AXES) and len(set(text.upper())) == len(text),
)
OPTIONS: Mapping[str, Option] = {
    "play": Option(
        "yes", "yes: play goes into the backlash compensation of the axes; no: it is left", one_of("yes", "no")
    ),
    "home_minus": Option("", "axes of X, Y and Z whose reference position return goes towards minus, e.g. XY", HOMING),
}
STEP = (
    "Is there a backlash.txt? Add its amounts to what parameter 1851 holds (the machine was measured with that); set "
    "nothing else for the same play, such as bidirectional pitch error compensation (3605#0)."
)


@dataclass(frozen=True, slots=True)
class Backlash:
    """Amounts of X, Y and Z in detection units, and the axes that go home towards minus."""

    amounts: tuple[int, ...] = (0, 0, 0)
    home_minus: str = ""

    @classmethod
    def of(cls, request: Request, settings: Mapping[str, str], unit: float) -> Backlash:
        """The play of a machine, as it is written; unit: detection unit, mm."""
        home = "".join(sorted(settings["home_minus"].upper()))
        if settings["play"] == "no":
            return cls(home_minus=home)
        found = {
            each.axis: round(each.whole / unit)
            for each in reversals(request.machine, request.space, request.tool_length, request.target, 2)
        }
        return cls(tuple(int(np.clip(found.get(axis, 0), -LARGEST, LARGEST)) for axis in AXES), home)

    def files(self) -> dict[str, bytes]:
        """The parameter as it is punched; no file if there is no play."""
        return {NAME: parameter_text({NUMBER: [float(each) for each in self.amounts]})} if any(self.amounts) else {}

    def shift(self, unit: float) -> Array:
        """What grids must hold besides the mean of both ways, X, Y and Z, mm."""
        signs = [-1.0 if axis in self.home_minus else 1.0 for axis in AXES]
        found: Array = np.array(self.amounts) * signs * unit / 2
        return found

    def tables(self, unit: float) -> Compensation:
        """What the control does: the amount, in the direction of motion, against that of the return."""
        terms = []
        for axis, amount in zip(AXES, self.amounts, strict=True):
            way = 1 if axis in self.home_minus else -1
            if amount:
                grid = Grid((axis,), (np.zeros(1),), (axis,), np.array([[way * amount * unit]]))
                terms.append(Term((grid,), (axis, way)))
        return Compensation(tuple(terms))

    def notes(self, unit: float) -> Iterator[str]:
        """What was written, in words."""
        for axis, amount in zip(AXES, self.amounts, strict=True):
            if amount:
                yield f"Play of {axis}, {1e3 * amount * unit:+.2f} um, is in {NAME}: {amount} detection units."


def read_backlash(files: Files, home_minus: str) -> tuple[Backlash, list[Remarks]]:
    """The amounts of the file, if there is one, with remarks on it."""
    if NAME not in files:
        return Backlash(home_minus=home_minus), []
    remarks = Remarks.of(NAME, files[NAME])
    amounts = dict.fromkeys(range(1, len(AXES) + 1), 0)
    for record in read_records(remarks):
        if record.number != NUMBER or record.kind != "A":
            remarks.refuse(0, f"parameter {record.number} is not for here", f"N0{NUMBER}A1P..A2P..A3P..;")
            continue
        for axis, value in record.values:
            if axis not in amounts or float(value) != round(float(value)) or abs(float(value)) > LARGEST:
                remarks.refuse(
                    0, f"{value} for axis {axis}", f"whole numbers from -{LARGEST} to {LARGEST}, axes 1 to 3"
                )
            else:
                amounts[axis] = round(float(value))
    return Backlash(tuple(amounts.values()), home_minus), [remarks]
