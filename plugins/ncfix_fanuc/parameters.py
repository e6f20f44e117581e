"""Parameters of Fanuc controls for all of their compensations: signs and units, positions of grids, backlash.

Parameters are punched as by Series 15i and later (B-63330EN): records `N03620A1P33A2P...;` between two lines with `%`.

Position of a grid: parameters give the number of points along each axis, their interval, and the number of the point at
the reference position. So there must be a point there, and its number goes with the files.

Backlash compensation, parameter 1851, is the amount that is added to an axis when it reverses. By the parameter manuals
(B-63090EN, B-64120EN and later) it is in detection units, -9999 to 9999. An axis that moves against the direction of
its reference position return is moved by the amount in addition, in the direction of motion. In the direction of the
return nothing is added, so the mean of both directions is off by half of the amount, which goes into the grid.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnostics import RefusedError, UsageError
from ncfix.tables.axis_tables import reversals
from ncfix.tables.compensation import Compensation, Term
from ncfix.tables.control import Assumption, Files, Option, Request, SettingForm, number, one_of
from ncfix.tables.grid import Grid
from ncfix.tables.table_files import DEGREE, Remarks
from ncfix.values import frozen
from ncfix_fanuc import json_values

SIGNS = ("correction", "error")
SIGNED = "correction: values are added to the command; error: they are subtracted from it"
UNITS: Mapping[str, Option] = {
    "detection_unit_um": Option("0.1", "detection unit of linear axes, um", number(1e-3, 10)),
    "detection_unit_deg": Option("0.0001", "detection unit of rotary axes and of angles, degree", number(1e-6, 10)),
}
RECORD = re.compile(r"N(\d{1,6})(?:Q\d)?((?:[ASL]\d{1,3}[PM][-+]?\d{1,12}\.?\d*)+);?")
PLAIN = re.compile(r"N(\d{1,6})(?:Q\d)?P([-+]?\d{1,12}\.?\d*);?")
ENTRY = re.compile(r"([ASL])(\d+)[PM]([-+]?\d+\.?\d*)")
PLACE = re.compile(r"([XYZABCUVW])=?([+-]?(?:\d+\.?\d*|\.\d+))")
REFERENCE, POINTS, FIRST = "reference", "reference_points", "first"
CLOSE = 1e-6
"""Distance, mm or degree, below which two positions are the same."""
PLACING_STEP = (
    "For each axis set the number of points, the interval, and the number of the point at the reference position as "
    "the remarks below list them: the control puts the grid by these, not by the positions in the files."
)
BACKLASH_FILE = "backlash.txt"
BACKLASH_PARAMETER = 1851
LARGEST_BACKLASH = 9999
LINEAR = ("X", "Y", "Z")
BACKLASH_ASSUMPTION = Assumption(
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
    "axes of X, Y and Z, like XY", lambda text: set(text.upper()) <= set(LINEAR) and len(set(text.upper())) == len(text)
)
BACKLASH_OPTIONS: Mapping[str, Option] = {
    "play": Option(
        "yes",
        "yes: play is written to the backlash compensation of the axes; no: it stays uncorrected",
        one_of("yes", "no"),
    ),
    "home_minus": Option("", "axes of X, Y and Z whose reference position return goes towards minus, e.g. XY", HOMING),
}
BACKLASH_STEP = (
    "Is there a backlash.txt? Add its amounts to what parameter 1851 holds (the machine was measured with that); set "
    "nothing else for the same play, such as bidirectional pitch error compensation (3605#0)."
)


def sign_option(settled: str) -> Option:
    """The option `sign`; `settled`: the assumption that it decides."""
    return Option(None, SIGNED, one_of(*SIGNS), settled)


def sense_of(sign: str) -> int:
    """1 if values are added to the command ("correction"), -1 if they are subtracted ("error")."""
    return 1 if sign == SIGNS[0] else -1


def units_of(settings: Mapping[str, str]) -> tuple[float, float]:
    """The detection units of linear axes, mm, and of rotary axes, rad."""
    length, angle = (float(settings[key]) for key in UNITS)
    return length / 1000, angle * DEGREE


def is_records(content: bytes) -> bool:
    """Whether a file has records of punched parameters; the lines with % around them may be missing."""
    rows = ("".join(row.split()).upper() for row in content.decode("latin-1").splitlines())
    first = next((row for row in rows if row.strip("%")), "")
    return bool(RECORD.fullmatch(first) or PLAIN.fullmatch(first))


def parameter_text(values: Mapping[int, Mapping[int, float]]) -> bytes:
    """Records of axis parameters: number -> number of the axis -> value.

    Axes that are not named keep what the control has: a zero would wipe out the compensation of the machine's maker.
    """
    rows = [
        f"N{number:05d}{''.join(f'A{n}P{_short(value)}' for n, value in sorted(row.items()))};"
        for number, row in sorted(values.items())
    ]
    return "".join(f"{row}\n" for row in ["%", *rows, "%"]).encode()


def _short(value: float) -> str:
    return f"{value:.0f}" if value == round(value) else f"{value:.4f}"


@frozen
class PunchedParameter:
    """A parameter as punched: kind "A" for axes, "S" spindles, "L" paths, "" for a plain one; values by their index."""

    number: int
    kind: str
    values: tuple[tuple[int, str], ...]


def read_records(remarks: Remarks) -> tuple[PunchedParameter, ...]:
    """The records of a punched parameter file."""
    rows = [(line, "".join(row.split()).upper()) for line, row in enumerate(remarks.rows, 1) if row.strip()]
    if len(rows) < 2 or rows[0][1] != "%" or rows[-1][1] != "%":
        remarks.refuse(0, "should begin and end with a line %")
    found = []
    for line, row in rows:
        if row == "%":
            continue
        plain, several = PLAIN.fullmatch(row), RECORD.fullmatch(row)
        if plain:
            found.append(PunchedParameter(int(plain[1]), "", ((0, plain[2]),)))
        elif several:
            entries = ENTRY.findall(several[2])
            if len({kind for kind, _, _ in entries}) > 1:
                remarks.refuse(line, "axes, spindles or paths, not several kinds in one record")
            found.append(
                PunchedParameter(int(several[1]), entries[0][0], tuple((int(n), value) for _, n, value in entries))
            )
        else:
            remarks.refuse(line, "is no record N..P.. or N..A1P..A2P..")
    return tuple(found)


def entries_of(text: str) -> list[tuple[str, float]] | None:
    """The axis letters and positions of a text like X0,Y-5; None for any other text, or a repeated letter."""
    found = [PLACE.fullmatch(part) for part in re.split(r"[ ,]+", text.strip().upper()) if part]
    pairs = [(match[1], float(match[2])) for match in found if match is not None]
    return pairs if len(pairs) == len(found) == len({letter for letter, _ in pairs}) else None


REFERENCE_FORM = SettingForm("axes with their positions, like X0,Y0,Z-10.5", lambda text: entries_of(text) is not None)


def placing_assumption(name: str) -> Assumption:
    """The assumption about the position of a grid, with id `name`."""
    return Assumption(
        name,
        "Points are an interval apart, numbered from 1 towards plus along each axis, and a parameter for each axis "
        "says which of them lies at its reference position: machine zero, unless --set reference says otherwise. "
        "Lengths are in mm.",
        "the parameters of stored pitch error compensation (3620 to 3624) place their points so; of the grid no public "
        "text says more than that it has points, intervals and vertices",
        "machine zero is the reference position of every axis",
        "Parameter 1240 is the machine coordinate of the reference position, and 1001#0 (INM) is 1 on a machine in "
        "inches. With the grid on, stand at the reference position of all axes: cnc_rdvolccomp must show the value of "
        "the point whose number the files give for it; then move one axis by its interval towards plus: the value of "
        "the next point must show.",
    )


PLACING_OPTIONS: Mapping[str, Option] = {
    REFERENCE: Option(
        "",
        "machine coordinates of the reference position, e.g. X0,Y0,Z-10; of axes that are not named it is machine zero",
        REFERENCE_FORM,
    )
}


def references(request: Request, settings: Mapping[str, str]) -> dict[str, float]:
    """Letter -> reference position of the axes that the setting names, mm or degree.

    Raises `UsageError` NCF485 for an axis that the machine lacks.
    """
    given = dict(entries_of(settings[REFERENCE]) or ())
    names = request.machine.axis_names
    if strange := sorted(set(given) - set(names)):
        text = f"{REFERENCE} names {', '.join(strange)}, and the machine has {' '.join(names)}"
        raise UsageError.of("NCF485", text, hint=REFERENCE_FORM.hint)
    return given


def anchors(request: Request, settings: Mapping[str, str], inputs: Sequence[str]) -> tuple[float, ...]:
    """The reference position along each axis of a grid, mm or degree.

    Raises `UsageError` NCF485 if it is outside the range of the grid, or given for an axis that the machine lacks.
    """
    machine, given = request.machine, references(request, settings)
    for name in inputs:
        index = machine.axis_names.index(name)
        low, high = (float(value) / machine.axes[index].unit for value in request.space[index])
        place = given.get(name, 0.0)
        if not low - CLOSE <= place <= high + CLOSE:
            what = "" if name in given else ", which is taken to be machine zero,"
            text = f"the reference position of {name}, {place:g}{what} is not between {low:g} and {high:g}"
            text += ": the control places the grid by the point at that position"
            hint = (
                f"--set {REFERENCE}={name}POSITION, where {name} stands after its reference position return (machine "
            )
            hint += "coordinates); or a range in the machine file, or --range, that takes it in"
            raise UsageError.of("NCF485", text, hint=hint)
    return tuple(given.get(name, 0.0) for name in inputs)


@frozen
class Placing:
    """The position of a grid by the parameters of the control, for each axis.

    reference  machine coordinate of the reference position, mm or degree
    points     number of the point at the reference position, from 1
    """

    reference: tuple[float, ...]
    points: tuple[int, ...]

    @classmethod
    def of(cls, reference: Sequence[float], lines: Sequence[Any]) -> Placing:
        """From the positions of the nodes along each axis, mm or degree, of which one is at the reference position."""
        numbers = [int(np.argmin(np.abs(np.asarray(line) - at))) for line, at in zip(lines, reference, strict=True)]
        off = [abs(line[number] - at) for line, number, at in zip(lines, numbers, reference, strict=True)]
        assert max(off) < CLOSE, f"no node at the reference position {reference}: {off}"
        return cls(tuple(float(at) for at in reference), tuple(number + 1 for number in numbers))

    def first(self, step: Sequence[float]) -> tuple[float, ...]:
        """The position of the first point along each axis, mm or degree."""
        return tuple(
            round(at - (number - 1) * each, 6)
            for at, number, each in zip(self.reference, self.points, step, strict=True)
        )

    def entries(self, unit: str) -> dict[str, Any]:
        """The entries of a file; `unit`: "mm" or "deg"."""
        return {f"{REFERENCE}_{unit}": self.reference, POINTS: self.points}

    def number(self, counts: Sequence[int], fastest: Sequence[int], first: int = 1) -> int:
        """The number, among all points, of the one at the reference position; `fastest`: the axes, fastest first."""
        strides = {axis: math.prod(counts[each] for each in fastest[:place]) for place, axis in enumerate(fastest)}
        return first + sum((self.points[axis] - 1) * stride for axis, stride in strides.items())

    def notes(self, inputs: Sequence[str], counts: Sequence[int], step: Sequence[float], unit: str) -> Iterator[str]:
        """The required parameters of each axis, in words."""
        rows = zip(inputs, counts, step, self.reference, self.points, self.first(step), strict=True)
        for name, count, each, at, point, first in rows:
            place = f"the reference position {name}{at:g} is point {point} (so the first is at {name}{first:g})"
            yield f"{name}: {count} points, interval {each:g} {unit}, {place}."


def placed(
    record: Mapping[str, Any], unit: str, step: Sequence[float], counts: Sequence[int], remarks: Remarks
) -> tuple[tuple[float, ...], Placing | None]:
    """The first position along each axis of a grid by its parameters, and its `Placing`; None for old files without."""
    said = json_values.reals(record, f"{FIRST}_{unit}", len(step))
    if POINTS not in record:
        text = (
            f"does not state which point is at the reference position, so the control cannot place the grid ({POINTS})"
        )
        remarks.doubt(0, text, "export again")
        return said, None
    numbers = json_values.wholes(record, POINTS)
    reference = json_values.reals(record, f"{REFERENCE}_{unit}", len(step))
    if len(numbers) != len(step) or any(not 1 <= number <= most for number, most in zip(numbers, counts, strict=False)):
        remarks.refuse(0, f"{POINTS} {numbers}: a point of each axis, of {list(counts)}")
        return said, None
    placing = Placing(reference, tuple(numbers))
    first = placing.first(step)
    if any(abs(one - other) > CLOSE for one, other in zip(first, said, strict=True)):
        text = f"by {REFERENCE}_{unit}, {POINTS} and the intervals the grid begins at {list(first)}"
        remarks.refuse(0, f"{text}, and {FIRST}_{unit} says {list(said)}", "the control uses the first")
    return first, placing


@frozen
class BacklashAmounts:
    """Backlash compensation of X, Y and Z, in detection units.

    home_minus  the axes whose reference position return goes towards minus
    """

    amounts: tuple[int, ...] = (0, 0, 0)
    home_minus: str = ""

    @classmethod
    def of(cls, request: Request, settings: Mapping[str, str], unit: float) -> BacklashAmounts:
        """The backlash of a machine, rounded; `unit`: detection unit, mm. Raises `RefusedError` NCF484."""
        home = "".join(sorted(settings["home_minus"].upper()))
        if settings["play"] == "no":
            return cls(home_minus=home)
        found = {
            each.axis: round(each.whole / unit)
            for each in reversals(request.machine, request.space, request.tool_length, request.target, 2)
        }
        for axis in [axis for axis in LINEAR if abs(found.get(axis, 0)) > LARGEST_BACKLASH]:
            text = f"the play of {axis} is {found[axis]} detection units, and parameter {BACKLASH_PARAMETER} holds "
            hint = (
                "give --set detection_unit_um=... as on the control, or --set play=no, which leaves the play "
                "uncorrected"
            )
            raise RefusedError.of("NCF484", f"{text}{LARGEST_BACKLASH}", hint=hint)
        return cls(tuple(found.get(axis, 0) for axis in LINEAR), home)

    def files(self) -> dict[str, bytes]:
        """The file with the punched parameter; no file without backlash."""
        return (
            {BACKLASH_FILE: parameter_text({BACKLASH_PARAMETER: found})}
            if (found := {n: float(each) for n, each in enumerate(self.amounts, 1) if each})
            else {}
        )

    def shift(self, unit: float) -> Array:
        """(3,) the part of X, Y and Z that grids must hold in addition to the mean of both directions, mm."""
        signs = [-1.0 if axis in self.home_minus else 1.0 for axis in LINEAR]
        return np.array(self.amounts) * signs * unit / 2

    def tables(self, unit: float) -> Compensation:
        """The effect on the control: the amount is added when an axis moves against the direction of its return."""
        terms = []
        for axis, amount in zip(LINEAR, self.amounts, strict=True):
            way = 1 if axis in self.home_minus else -1
            if amount:
                grid = Grid((axis,), (np.zeros(1),), (axis,), np.array([[way * amount * unit]]))
                terms.append(Term((grid,), (axis, way)))
        return Compensation(tuple(terms))

    def notes(self, unit: float) -> Iterator[str]:
        """Notes on the backlash that was written."""
        for axis, amount in zip(LINEAR, self.amounts, strict=True):
            if amount:
                yield f"Play of {axis}, {1e3 * amount * unit:+.2f} um, is in {BACKLASH_FILE}: {amount} detection units."


def read_backlash(files: Files, home_minus: str) -> tuple[BacklashAmounts, list[Remarks]]:
    """The amounts of the file, if there is one, with remarks on it."""
    if BACKLASH_FILE not in files:
        return BacklashAmounts(home_minus=home_minus), []
    remarks = Remarks.of(BACKLASH_FILE, files[BACKLASH_FILE])
    amounts = dict.fromkeys(range(1, len(LINEAR) + 1), 0)
    for record in read_records(remarks):
        if record.number != BACKLASH_PARAMETER or record.kind != "A":
            remarks.refuse(
                0, f"parameter {record.number} does not belong in this file", f"N0{BACKLASH_PARAMETER}A1P..A2P..A3P..;"
            )
            continue
        for axis, value in record.values:
            if axis not in amounts or float(value) != round(float(value)) or abs(float(value)) > LARGEST_BACKLASH:
                hint = f"whole numbers from -{LARGEST_BACKLASH} to {LARGEST_BACKLASH}, axes 1 to 3"
                remarks.refuse(0, f"{value} for axis {axis}", hint)
            else:
                amounts[axis] = round(float(value))
    return BacklashAmounts(tuple(amounts.values()), home_minus), [remarks]
