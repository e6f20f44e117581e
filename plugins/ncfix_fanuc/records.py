"""Grids as records of the FOCAS library (fwlib32.h), in JSON: whole numbers, and the required parameters.

`Volc`, after `ODBVOLC`: records of 72 numbers, for 24 points and three axes; also as CSV, and as a text file by a
template. `Lattice`, after `IODBROTVOLC`: three lengths and three angles at every point.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from string import Formatter
from typing import Any

import numpy as np

from ncfix.arrays import Array, Ints
from ncfix.diagnostics import RefusedError
from ncfix.tables.control import Files
from ncfix.tables.grid import Grid, full_grid
from ncfix.tables.table_files import DEGREE, Remarks, unit_of
from ncfix.values import frozen
from ncfix_fanuc import json_values
from ncfix_fanuc.json_values import SMALLEST
from ncfix_fanuc.parameters import LINEAR, SIGNS, Placing, placed, sense_of

RECORD_POINTS = 24
"""Number of points in a record."""
SIDE = 25
"""Largest number of points along an axis."""
MOST_GRID_MAGNIFICATION = 100
MOST_NUMBER = 99_999_999
TEMPLATE_FIELDS = ("no", "dx", "dy", "dz", "x", "y", "z")
NUMBER_FORM = re.compile(r"[+0 -]?\d{0,2}(?:\.\d)?[dfg]?")
"""Permitted format of a number in a template."""
VOLUME_JSON, VOLUME_CSV, VOLUME_TEXT = "volume.json", "volume.csv", "volume-ASSUMED.txt"
MOST_LATTICE_MAGNIFICATION = 10_000
MOST_ROTARY = 400
LARGEST_VALUE = 127
ANGLES = ("A", "B", "C")


@frozen
class PointNumbering:
    """The numbering of points and the form of the text file, which are not documented publicly.

    first       number of the first point
    order       the axes, beginning with the one whose number runs fastest
    largest     largest value of a point
    template    line of the text file for a point; "" for no text file
    home_minus  the axes whose reference position return goes towards minus
    """

    first: int = 1
    order: str = "XYZ"
    largest: int = 127
    template: str = ""
    home_minus: str = ""


@frozen
class Volc:
    """A grid of whole numbers.

    sign           "correction" or "error"
    low, step      first node and interval of X, Y and Z, mm
    unit           detection unit, mm
    magnification  factor of the unit; values are in units times this
    values         (nx, ny, nz, 3) values along X, Y and Z
    style          numbering and text file
    placing        position of the grid by the parameters of the control; None for files without it
    """

    sign: str
    low: tuple[float, ...]
    step: tuple[float, ...]
    unit: float
    magnification: int
    values: Ints
    style: PointNumbering = PointNumbering()
    placing: Placing | None = None

    @property
    def axes(self) -> tuple[int, ...]:
        """The axes of `values`, from the one whose number runs slowest to the fastest."""
        return tuple("XYZ".index(axis) for axis in reversed(self.style.order))

    @property
    def rows(self) -> Ints:
        """(n, 3) values by point number."""
        return self.values.transpose(*self.axes, 3).reshape(-1, 3)

    @property
    def places(self) -> Array:
        """(n, 3) positions of the points by point number, mm."""
        points = full_grid(_nodes(self.low, self.step, self.values.shape)).reshape(self.values.shape)
        return points.transpose(*self.axes, 3).reshape(-1, 3)

    def grid(self) -> Grid:
        """The grid as corrections, mm."""
        factor = self.unit * self.magnification * sense_of(self.sign)
        nodes = _nodes(self.low, self.step, self.values.shape)
        return Grid(LINEAR, nodes, LINEAR, self.values.astype(np.float64) * factor)


def _nodes(low: Sequence[float], step: Sequence[float], counts: Sequence[int]) -> tuple[Array, ...]:
    """Evenly spaced positions along each axis."""
    numbers = (np.arange(count, dtype=np.float64) for count in counts)
    return tuple(first + each * line for first, each, line in zip(low, step, numbers, strict=False))


def _json(head: Mapping[str, Any], records: Iterable[str]) -> bytes:
    """A JSON object with one line for each entry and each record."""
    lines = "".join(f' "{key}": {json.dumps(value)},\n' for key, value in head.items())
    body = ",\n".join(f"  {record}" for record in records)
    return f'{{\n{lines} "records": [\n{body}\n ]\n}}\n'.encode()


def json_text(volc: Volc) -> bytes:
    """The JSON file: the required parameters, and the records."""
    head = {
        "sign": volc.sign,
        "first_mm": volc.low,
        "interval_mm": volc.step,
        "counts": volc.values.shape[:3],
        **_placing(volc),
        "detection_unit_um": round(volc.unit * 1000, 6),
        "magnification": volc.magnification,
        "first_number": volc.style.first,
        "order": volc.style.order,
        "largest": volc.style.largest,
        "template": volc.style.template,
        "home_minus": volc.style.home_minus,
    }
    rows, first = volc.rows, volc.style.first
    records = []
    for start in range(0, len(rows), RECORD_POINTS):
        part = rows[start : start + RECORD_POINTS]
        ends = {"start_no": start + first, "start_ax": 1, "end_no": start + first + len(part) - 1, "end_ax": 3}
        records.append(json.dumps({**ends, "num": part.size, "type": 0, "data": part.reshape(-1).tolist()}))
    return _json(head, records)


def _placing(volc: Volc) -> dict[str, Any]:
    """The entries of the grid's position by parameters, with the number of the point at the reference position."""
    if volc.placing is None:
        return {}
    number = volc.placing.number(volc.values.shape[:3], volc.axes[::-1], volc.style.first)
    return {**volc.placing.entries("mm"), "reference_number": number}


def csv_text(volc: Volc) -> bytes:
    """The CSV file: one line for each point, with number, position and values."""
    lines = [
        f"{number},{x:.6f},{y:.6f},{z:.6f},{dx},{dy},{dz}\n" for number, ((x, y, z), (dx, dy, dz)) in _numbered(volc)
    ]
    return "".join(["point,X,Y,Z,X_value,Y_value,Z_value\n", *lines]).encode()


def template_text(volc: Volc) -> bytes:
    """The text file by the template; its form is assumed."""
    lines = [
        volc.style.template.format(no=number, dx=dx, dy=dy, dz=dz, x=x, y=y, z=z)
        for number, ((x, y, z), (dx, dy, dz)) in _numbered(volc)
    ]
    return "".join(f"{line}\n" for line in ["%", *lines, "%"]).encode()


def _numbered(volc: Volc) -> Iterator[tuple[int, tuple[list[float], list[int]]]]:
    return enumerate(zip(volc.places.tolist(), volc.rows.tolist(), strict=True), volc.style.first)


def read_volc(files: Files) -> tuple[Volc | None, Remarks]:
    """The grid of the records, and remarks on them, also if the CSV or text file differs."""
    remarks = Remarks.of(VOLUME_JSON, files.get(VOLUME_JSON, b""))
    try:
        volc = _volc(json.loads(files.get(VOLUME_JSON, b"")), remarks)
    except (ValueError, KeyError, RecursionError) as error:
        remarks.refuse(0, f"is not what ncfix writes: {type(error).__name__}: {error}")
        return None, remarks
    if volc is not None and files.get(VOLUME_CSV) != csv_text(volc):
        remarks.refuse(0, f"{VOLUME_CSV} is missing or has other values")
    if volc is not None and files.get(VOLUME_TEXT) != (template_text(volc) if volc.style.template else None):
        remarks.refuse(0, f"{VOLUME_TEXT} is missing, exists without a template, or has other values")
    return volc, remarks


def _volc(found: Any, remarks: Remarks) -> Volc | None:
    records = json_values.records(found)
    style = _style(found, remarks)
    counts = tuple(json_values.wholes(found, "counts"))
    rows: list[int] = []
    for record in records:
        rows += _data(record, len(rows) // 3 + style.first, remarks)
    _check_sign(found, remarks)
    if len(counts) != 3 or not all(2 <= count <= SIDE for count in counts):
        remarks.refuse(0, f"counts {counts}: 2 to {SIDE} points along each of three axes")
    elif len(rows) != 3 * math.prod(counts):
        remarks.refuse(0, f"{len(rows)} values in the records, {3 * math.prod(counts)} expected of {counts}")
    if any(abs(value) > style.largest for value in rows):
        remarks.refuse(0, f"a value beyond -{style.largest} to {style.largest}")
    step = json_values.reals(found, "interval_mm", 3, SMALLEST)
    low, placing = placed(found, "mm", step, counts, remarks)
    unit = json_values.real(found, "detection_unit_um", 1e-6, 10) / 1000
    magnification = json_values.whole(found, "magnification", 1, MOST_GRID_MAGNIFICATION)
    if remarks.wrong:
        return None
    slowest = ["XYZ".index(axis) for axis in reversed(style.order)]
    stacked = np.array(rows, dtype=np.int64).reshape(*(counts[axis] for axis in slowest), 3)
    values = stacked.transpose(*np.argsort(slowest), 3)
    volc = Volc(found["sign"], low, step, unit, magnification, values, style, placing)
    for key, number in _placing(volc).items():
        if key == "reference_number" and found.get(key) != number:
            remarks.refuse(0, f"{key} is {found.get(key)!r}, but must be {number} by the numbers of the axes")
            return None
    return volc


def _style(record: Mapping[str, Any], remarks: Remarks) -> PointNumbering:
    first, largest = (
        json_values.whole(record, key, low, MOST_NUMBER) for key, low in (("first_number", 0), ("largest", 1))
    )
    order, template = json_values.text(record, "order"), json_values.text(record, "template")
    home_minus = json_values.text({"home_minus": "", **record}, "home_minus")
    if sorted(order) != [*LINEAR]:
        remarks.refuse(0, f"the order of the axes is {order!r}", "XYZ, ZYX, ...")
    _check_home(home_minus, remarks)
    if template:
        check_template(template)
    return PointNumbering(first, order, largest, template, home_minus)


def _check_sign(record: Mapping[str, Any], remarks: Remarks) -> None:
    if record["sign"] not in SIGNS:
        remarks.refuse(0, f"the sign is {record['sign']!r}", "correction or error")


def _check_home(home_minus: str, remarks: Remarks) -> None:
    if not set(home_minus) <= set(LINEAR):
        remarks.refuse(0, f"home_minus is {home_minus!r}", "axes of X, Y and Z")


def check_template(template: str) -> None:
    """Raise ValueError for a template that cannot be filled in, or lacks a value."""
    names = [(name, form) for _, name, form, _ in Formatter().parse(template) if name is not None]
    for name, form in names:
        if name not in TEMPLATE_FIELDS or not NUMBER_FORM.fullmatch(form or ""):
            raise ValueError(f"{{{name}}} with {form!r} is not known: {', '.join(TEMPLATE_FIELDS)}")
    if not {"dx", "dy", "dz"} <= {name for name, _ in names}:
        raise ValueError("it needs {dx}, {dy} and {dz}")
    template.format(no=1, dx=1, dy=1, dz=1, x=0.0, y=0.0, z=0.0)


def _data(record: Mapping[str, Any], first: int, remarks: Remarks) -> list[int]:
    data = json_values.wholes(record, "data")
    size = len(data)
    if record["start_no"] != first or record["num"] != size or size > 3 * RECORD_POINTS:
        remarks.refuse(0, f"the record of point {record['start_no']} has {size} values, but states {record['num']}")
    if record["end_no"] != first + size // 3 - 1:
        remarks.refuse(0, f"the record of point {record['start_no']} ends at {record['end_no']}")
    return data


@frozen
class WholeNumberScale:
    """The meaning of whole numbers.

    sign            "correction" or "error"
    units           detection units of lengths, mm, and of angles, rad
    magnifications  factors of the units for lengths and for angles
    """

    sign: str
    units: tuple[float, float]
    magnifications: tuple[int, int]

    @property
    def factors(self) -> tuple[float, float]:
        """The correction of a value of 1: of a length, mm, and of an angle, rad."""
        sense = float(sense_of(self.sign))
        length, angle = (sense * unit * many for unit, many in zip(self.units, self.magnifications, strict=True))
        return length, angle

    @property
    def rounding(self) -> tuple[float, float]:
        """Largest rounding error of a length, mm, and of an angle, rad."""
        length, angle = (abs(factor) / 2 for factor in self.factors)
        return length, angle


@frozen
class Lattice:
    """A lattice of lengths and angles over some axes, in whole numbers.

    inputs      the axes, beginning with the one whose number runs fastest
    low         first position along each axis, mm or degree
    step        interval along each axis, mm or degree
    scale       meaning of the numbers
    lin         (*counts, 3) lengths along X, Y and Z
    rot         (*counts, 3) angles about X, Y and Z
    centre      point about which the angles turn a table, mm; () if they turn the tool
    home_minus  the linear axes whose reference position return goes towards minus
    placing     position of the lattice by the parameters of the control; None for files without it
    """

    inputs: tuple[str, ...]
    low: tuple[float, ...]
    step: tuple[float, ...]
    scale: WholeNumberScale
    lin: Ints
    rot: Ints
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
        """Corrections (lengths, angles) as whole numbers, with the smallest magnifications that can hold them.

        reference  reference position of each axis, at which a node lies, mm or degree
        centre     (3,) point about which the angles turn a table, mm

        Raises `RefusedError` NCF484 if a magnification would be too large.
        """
        factors, whole = [], []
        for grid, unit in zip(grids, units, strict=True):
            factors.append(max(1, math.ceil(float(np.abs(grid.values).max()) / (LARGEST_VALUE * unit) - 1e-9)))
            if factors[-1] > MOST_LATTICE_MAGNIFICATION:
                text = (
                    f"a value needs a magnification of {factors[-1]}, but at most {MOST_LATTICE_MAGNIFICATION} is "
                    "possible"
                )
                raise RefusedError.of(
                    "NCF484", text, hint="use a larger detection unit, or check that the errors are in mm and rad"
                )
            whole.append(np.rint(sense_of(sign) * grid.values / (factors[-1] * unit)).astype(np.int64))
        inputs = grids[0].inputs
        lines = [line / unit_of(name) for name, line in zip(inputs, grids[0].nodes, strict=True)]
        placing = Placing.of(reference, lines)
        step = tuple(round(float(line[-1] - line[0]) / (len(line) - 1), 6) for line in lines)
        scale = WholeNumberScale(sign, units, (factors[0], factors[1]))
        middle = () if centre is None else tuple(centre.tolist())
        return cls(inputs, placing.first(step), step, scale, whole[0], whole[1], middle, placing=placing)

    def grids(self) -> tuple[Grid, Grid]:
        """Lengths and angles as corrections, mm and rad."""
        lines = _nodes(self.low, self.step, self.lin.shape)
        nodes = tuple(line * unit_of(name) for name, line in zip(self.inputs, lines, strict=True))
        length, angle = self.scale.factors
        lin, rot = (np.asarray(part, dtype=np.float64) for part in (self.lin, self.rot))
        return Grid(self.inputs, nodes, LINEAR, lin * length), Grid(self.inputs, nodes, ANGLES, rot * angle)

    def _placing(self) -> dict[str, Any]:
        """The entries of the lattice's position by parameters, with the record at the reference position."""
        if self.placing is None:
            return {}
        counts = self.lin.shape[:-1]
        number = self.placing.number(counts, range(len(counts)))
        return {**self.placing.entries("mm" if self.inputs == LINEAR else "deg"), "reference_number": number}

    def text(self) -> bytes:
        """The JSON file: the required parameters, and a record for each point."""
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
        order = [*reversed(range(len(self.inputs))), len(self.inputs)]
        rows = zip(*(part.transpose(order).reshape(-1, 3).tolist() for part in (self.lin, self.rot)), strict=True)
        return _json(head, (f'{{"no": {n}, "lin": {lin}, "rot": {rot}}}' for n, (lin, rot) in enumerate(rows, 1)))


def read_lattice(name: str, content: bytes, linear: bool) -> tuple[Lattice | None, Remarks]:
    """The lattice of a file, and remarks on the file; None if it cannot be used."""
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
    _check_sign(value, remarks)
    if len(counts) != len(inputs) or not all(2 <= count <= words[1] for count in counts):
        remarks.refuse(0, f"counts {counts}: 2 to {words[1]} points along each of {words[0]} axes")
    rows = {key: [json_values.wholes(record, key) for record in records] for key in ("lin", "rot")}
    _check_records(records, rows, counts, remarks)
    if remarks.wrong:
        return None
    order = [*reversed(range(len(counts))), len(counts)]
    lin, rot = (np.array(rows[key], dtype=np.int64).reshape(*counts[::-1], 3).transpose(order) for key in rows)
    end = "mm" if inputs == LINEAR else "deg"
    step = json_values.reals(value, f"interval_{end}", len(inputs), SMALLEST)
    low, placing = placed(value, end, step, counts, remarks)
    if remarks.wrong:
        return None
    centre: tuple[float, ...] = ()
    home_minus = ""
    if linear:
        home_minus = json_values.text({"home_minus": "", **value}, "home_minus")
        _check_home(home_minus, remarks)
    else:
        centre = json_values.reals(value, "centre_mm", 3)
    return Lattice(inputs, low, step, _scale(value), lin, rot, centre, home_minus, placing)


def _inputs(record: Mapping[str, Any], remarks: Remarks, linear: bool) -> tuple[str, ...]:
    if linear:
        return LINEAR
    axes = record["axes"]
    if not isinstance(axes, list) or len(axes) not in (1, 2) or any(axis not in ANGLES for axis in axes):
        remarks.refuse(0, f"the axes are {axes}", "one or two of A, B and C")
        return ()
    return tuple(axes)


def _scale(record: Mapping[str, Any]) -> WholeNumberScale:
    length, angle = (json_values.real(record, key, 1e-6, 10) for key in ("detection_unit_um", "detection_unit_deg"))
    keys = ("magnification", "angle_magnification")
    lengths, angles = (json_values.whole(record, key, 1, MOST_LATTICE_MAGNIFICATION) for key in keys)
    return WholeNumberScale(record["sign"], (length / 1000, angle * DEGREE), (lengths, angles))


def _check_records(
    records: Sequence[Mapping[str, Any]], rows: Mapping[str, list[list[int]]], counts: Sequence[int], remarks: Remarks
) -> None:
    if [record["no"] for record in records] != list(range(1, len(records) + 1)):
        remarks.refuse(0, "the records are not numbered 1, 2, 3, ...")
    if len(records) != math.prod(counts):
        remarks.refuse(0, f"{len(records)} records, {math.prod(counts)} expected of {counts}")
    values = [row for part in rows.values() for row in part]
    if any(len(row) != 3 for row in values):
        remarks.refuse(0, "a record without three lengths and three angles")
    if any(abs(value) > LARGEST_VALUE for row in values for value in row):
        remarks.refuse(0, f"a value beyond -{LARGEST_VALUE} to {LARGEST_VALUE}")
