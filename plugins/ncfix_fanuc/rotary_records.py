"""Lattices of `IODBROTVOLC` records as files: three lengths and three angles at every point, whole numbers."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ncfix.diagnostics import RefusedError
from ncfix.tables.grid import Array, Grid
from ncfix.tables.table_files import DEGREE, Remarks, unit_of
from ncfix_fanuc import json_values
from ncfix_fanuc.json_values import SMALLEST
from ncfix_fanuc.placing import Placing, placed
from ncfix_fanuc.units import SIGNS, sense_of

SIDE = 25
MOST_MAGNIFICATION = 10_000
MOST_ROTARY = 400
LARGEST = 127
ANGLES = ("A", "B", "C")
LINEAR = ("X", "Y", "Z")


@dataclass(frozen=True, slots=True)
class Scale:
    """What whole numbers stand for.

    sign            "correction" or "error"
    units           detection units, mm and rad
    magnifications  of lengths and of angles
    """

    sign: str
    units: tuple[float, float]
    magnifications: tuple[int, int]

    @property
    def factors(self) -> tuple[float, float]:
        """Correction in mm and in rad of a value of 1."""
        sense = float(sense_of(self.sign))
        length, angle = (sense * unit * many for unit, many in zip(self.units, self.magnifications, strict=True))
        return length, angle

    @property
    def rounding(self) -> tuple[float, float]:
        """The most that a length and an angle are off by, mm and rad."""
        length, angle = (abs(factor) / 2 for factor in self.factors)
        return length, angle


@dataclass(frozen=True, slots=True)
class Lattice:
    """Records over some axes.

    inputs   the axes, that whose number runs fastest first
    low      first position of each, mm or degree
    step     interval
    lin      (*counts, 3) lengths along X, Y and Z
    rot      (*counts, 3) angles about X, Y and Z
    centre   mm: where angles turn about, if they turn a table
    home_minus  the linear axes whose reference position return goes towards minus
    placing  how the parameters of the control put it; None in files that do not say it
    """

    inputs: tuple[str, ...]
    low: tuple[float, ...]
    step: tuple[float, ...]
    scale: Scale
    lin: NDArray[np.int64]
    rot: NDArray[np.int64]
    centre: tuple[float, ...] = ()
    home_minus: str = ""
    placing: Placing | None = None

    @classmethod
    def of(
        cls,
        grids: tuple[Grid, Grid],
        sign: str,
        units: tuple[float, float],
        reference: Sequence[float],
        centre: Array | None = None,
    ) -> Lattice:
        """Corrections in whole numbers, with the smallest magnifications that hold them.

        reference: where a node of each axis lies, mm or degree.
        """
        factors, whole = [], []
        for grid, unit in zip(grids, units, strict=True):
            factors.append(max(1, math.ceil(float(np.abs(grid.values).max()) / (LARGEST * unit) - 1e-9)))
            if factors[-1] > MOST_MAGNIFICATION:
                text = f"a value needs a magnification of {factors[-1]}, and {MOST_MAGNIFICATION} is the most"
                raise RefusedError.of("NCF484", text, hint="a larger detection unit, or is the error in mm and rad?")
            whole.append(np.rint(sense_of(sign) * grid.values / (factors[-1] * unit)).astype(np.int64))
        inputs = grids[0].inputs
        lines = [line / unit_of(name) for name, line in zip(inputs, grids[0].nodes, strict=True)]
        placing = Placing.of(reference, lines)
        step = tuple(round(float(line[-1] - line[0]) / (len(line) - 1), 6) for line in lines)
        scale = Scale(sign, units, (factors[0], factors[1]))
        middle = () if centre is None else tuple(centre.tolist())
        return cls(inputs, placing.first(step), step, scale, whole[0], whole[1], middle, placing=placing)

    def grids(self) -> tuple[Grid, Grid]:
        """Lengths and angles as corrections, mm and rad."""
        nodes = tuple(
            (low + step * np.arange(count)) * unit_of(name)
            for name, low, step, count in zip(self.inputs, self.low, self.step, self.lin.shape, strict=False)
        )
        length, angle = self.scale.factors
        lin, rot = (np.asarray(part, dtype=np.float64) for part in (self.lin, self.rot))
        return Grid(self.inputs, nodes, LINEAR, lin * length), Grid(self.inputs, nodes, ANGLES, rot * angle)

    def _placing(self) -> dict[str, Any]:
        """How the parameters put it, and which record is that of the reference position."""
        if self.placing is None:
            return {}
        counts = self.lin.shape[:-1]
        number = self.placing.number(counts, range(len(counts)))
        return {**self.placing.entries("mm" if self.inputs == LINEAR else "deg"), "reference_number": number}

    def text(self) -> bytes:
        """JSON: what the parameters must be, and a record for each point."""
        linear = self.inputs == LINEAR
        head = {
            "sign": self.scale.sign,
            **({} if linear else {"axes": self.inputs}),
            "first_mm" if linear else "first_deg": self.low,
            "interval_mm" if linear else "interval_deg": self.step,
            "counts": self.lin.shape[:-1],
            **self._placing(),
            "detection_unit_um": round(self.scale.units[0] * 1000, 6),
            "detection_unit_deg": round(self.scale.units[1] / DEGREE, 9),
            "magnification": self.scale.magnifications[0],
            "angle_magnification": self.scale.magnifications[1],
            **({"home_minus": self.home_minus} if linear else {"centre_mm": self.centre}),
        }
        lines = [f' "{key}": {json.dumps(value)},\n' for key, value in head.items()]
        order = [*reversed(range(len(self.inputs))), len(self.inputs)]
        rows = zip(*(part.transpose(order).reshape(-1, 3).tolist() for part in (self.lin, self.rot)), strict=True)
        records = ",\n".join(f'  {{"no": {n}, "lin": {lin}, "rot": {rot}}}' for n, (lin, rot) in enumerate(rows, 1))
        return f'{{\n{"".join(lines)} "records": [\n{records}\n ]\n}}\n'.encode()


def read_lattice(name: str, content: bytes, linear: bool) -> tuple[Lattice | None, Remarks]:
    """A file of records with remarks on it; no lattice if it cannot be used."""
    remarks = Remarks.of(name, content)
    try:
        return _checked(json.loads(content), remarks, linear), remarks
    except (ValueError, KeyError, RecursionError) as error:
        remarks.refuse(0, f"is not what ncfix writes: {type(error).__name__}: {error}")
    return None, remarks


def _checked(value: Any, remarks: Remarks, linear: bool) -> Lattice | None:
    records = json_values.records(value)
    counts, inputs = tuple(json_values.wholes(value, "counts")), _inputs(value, remarks, linear)
    words = ("three", SIDE) if linear else ("one or two", MOST_ROTARY)
    if value["sign"] not in SIGNS:
        remarks.refuse(0, f"the sign is {value['sign']!r}", "correction or error")
    if len(counts) != len(inputs) or not all(2 <= count <= words[1] for count in counts):
        remarks.refuse(0, f"counts {counts}: 2 to {words[1]} points along each of {words[0]} axes")
    rows = {key: [json_values.wholes(record, key) for record in records] for key in ("lin", "rot")}
    _check_records(records, rows, counts, remarks)
    if remarks.wrong:
        return None
    order = [*reversed(range(len(counts))), len(counts)]
    lin, rot = (np.array(rows[key], dtype=np.int64).reshape(*counts[::-1], 3).transpose(order) for key in rows)
    step, end = _interval(value, inputs)
    low, placing = placed(value, end, step, counts, remarks)
    if remarks.wrong:
        return None
    rest = _rest(value, remarks, linear)
    return Lattice(inputs, low, step, _scale(value), lin, rot, *rest, placing)


def _inputs(record: Mapping[str, Any], remarks: Remarks, linear: bool) -> tuple[str, ...]:
    if linear:
        return LINEAR
    axes = record["axes"]
    if not isinstance(axes, list) or len(axes) not in (1, 2) or any(axis not in ANGLES for axis in axes):
        remarks.refuse(0, f"the axes are {axes}", "one or two of A, B and C")
        return ()
    return tuple(axes)


def _interval(record: Mapping[str, Any], inputs: tuple[str, ...]) -> tuple[tuple[float, ...], str]:
    """The interval along each axis, and its unit."""
    end = "mm" if inputs == LINEAR else "deg"
    return json_values.reals(record, f"interval_{end}", len(inputs), SMALLEST), end


def _scale(record: Mapping[str, Any]) -> Scale:
    length, angle = (json_values.real(record, key, 1e-6, 10) for key in ("detection_unit_um", "detection_unit_deg"))
    keys = ("magnification", "angle_magnification")
    lengths, angles = (json_values.whole(record, key, 1, MOST_MAGNIFICATION) for key in keys)
    return Scale(record["sign"], (length / 1000, angle * DEGREE), (lengths, angles))


def _rest(record: Mapping[str, Any], remarks: Remarks, linear: bool) -> tuple[tuple[float, ...], str]:
    """The centre of a table's turns, or the way home of the linear axes."""
    if not linear:
        return json_values.reals(record, "centre_mm", 3), ""
    home_minus = json_values.text({"home_minus": "", **record}, "home_minus")
    if not set(home_minus) <= set(LINEAR):
        remarks.refuse(0, f"home_minus is {home_minus!r}", "axes of X, Y and Z")
    return (), home_minus


def _check_records(
    records: Sequence[Mapping[str, Any]],
    rows: Mapping[str, list[list[int]]],
    counts: tuple[int, ...],
    remarks: Remarks,
) -> None:
    if [record["no"] for record in records] != list(range(1, len(records) + 1)):
        remarks.refuse(0, "the records are not numbered 1, 2, 3, ...")
    if len(records) != math.prod(counts):
        remarks.refuse(0, f"{len(records)} records, {math.prod(counts)} expected of {counts}")
    values = [row for part in rows.values() for row in part]
    if any(len(row) != 3 for row in values):
        remarks.refuse(0, "a record without three lengths and three angles")
    if any(abs(value) > LARGEST for row in values for value in row):
        remarks.refuse(0, f"a value beyond -{LARGEST} to {LARGEST}")
