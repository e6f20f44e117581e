"""The grid as records of the FOCAS library (`ODBVOLC` of fwlib32.h: 72 numbers, 24 points of three axes) and as CSV."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from string import Formatter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ncfix.tables.control import Files
from ncfix.tables.grid import Grid
from ncfix.tables.table_files import Remarks
from ncfix_fanuc import json_values
from ncfix_fanuc.json_values import SMALLEST
from ncfix_fanuc.placing import Placing, placed
from ncfix_fanuc.units import SIGNS

POINTS = 24
"""Of one record."""
SIDE = 25
"""Along an axis."""
MOST_MAGNIFICATION = 100
MOST_NUMBER = 99_999_999
FIELDS = ("no", "dx", "dy", "dz", "x", "y", "z")
FORM = re.compile(r"[+0 -]?\d{0,2}(?:\.\d)?[dfg]?")
"""How a number of a template may be written."""
NAME, TABLE, TEXT = "volume.json", "volume.csv", "volume-ASSUMED.txt"


@dataclass(frozen=True, slots=True)
class Style:
    """What no public text says of the numbering and the text file.

    first     number of the first point
    order     the axes from the one whose number runs fastest
    largest   value of a point
    template  a line of the text file; "" for none
    home_minus  the axes whose reference position return goes towards minus
    """

    first: int = 1
    order: str = "XYZ"
    largest: int = 127
    template: str = ""
    home_minus: str = ""


@dataclass(frozen=True, slots=True)
class Volc:
    """A grid in whole numbers.

    sign           "correction" or "error"
    low, step      first node and interval of X, Y and Z, mm
    unit           detection unit, mm
    magnification  values are in units times this
    values         (nx, ny, nz, 3)
    style          numbering and text
    placing        how the parameters of the control put it; None in files that do not say it
    """

    sign: str
    low: tuple[float, ...]
    step: tuple[float, ...]
    unit: float
    magnification: int
    values: NDArray[np.int64]
    style: Style = Style()
    placing: Placing | None = None

    @property
    def axes(self) -> tuple[int, ...]:
        """The axes of `values` from the slowest to the fastest number."""
        return tuple("XYZ".index(axis) for axis in reversed(self.style.order))

    @property
    def rows(self) -> NDArray[np.int64]:
        """By point number, (n, 3)."""
        return self.values.transpose(*self.axes, 3).reshape(-1, 3)

    @property
    def places(self) -> NDArray[np.float64]:
        """The positions of the points by number, (n, 3) mm."""
        lines = [
            low + step * np.arange(n) for low, step, n in zip(self.low, self.step, self.values.shape, strict=False)
        ]
        grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
        return grid.transpose(*self.axes, 3).reshape(-1, 3)

    def grid(self) -> Grid:
        """As corrections."""
        nodes = tuple(
            low + step * np.arange(count)
            for low, step, count in zip(self.low, self.step, self.values.shape[:3], strict=True)
        )
        factor = self.unit * self.magnification * (1 if self.sign == "correction" else -1)
        return Grid(("X", "Y", "Z"), nodes, ("X", "Y", "Z"), self.values.astype(np.float64) * factor)


def json_text(volc: Volc) -> bytes:
    """The records with what the parameters must be."""
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
    lines = [f' "{key}": {json.dumps(value)},\n' for key, value in head.items()]
    records = ",\n".join(f"  {json.dumps(record)}" for record in _records(volc.rows, volc.style.first))
    return f'{{\n{"".join(lines)} "records": [\n{records}\n ]\n}}\n'.encode()


def _placing(volc: Volc) -> dict[str, Any]:
    """How the parameters put the grid, and the number of the point at the reference position among all."""
    if volc.placing is None:
        return {}
    fastest = volc.axes[::-1]
    return {
        **volc.placing.entries("mm"),
        "reference_number": volc.placing.number(volc.values.shape[:3], fastest, volc.style.first),
    }


def _records(rows: NDArray[np.int64], first: int) -> list[dict[str, Any]]:
    found = []
    for start in range(0, len(rows), POINTS):
        part = rows[start : start + POINTS]
        ends = {"start_no": start + first, "start_ax": 1, "end_no": start + first + len(part) - 1, "end_ax": 3}
        found.append({**ends, "num": part.size, "type": 0, "data": part.reshape(-1).tolist()})
    return found


def csv_text(volc: Volc) -> bytes:
    """One line a point: number, position, values."""
    lines = [
        f"{number},{x:.6f},{y:.6f},{z:.6f},{dx},{dy},{dz}\n" for number, ((x, y, z), (dx, dy, dz)) in _numbered(volc)
    ]
    return "".join(["point,X,Y,Z,X_value,Y_value,Z_value\n", *lines]).encode()


def template_text(volc: Volc) -> bytes:
    """The text file that the template makes: ASSUMED."""
    lines = [
        volc.style.template.format(no=number, dx=dx, dy=dy, dz=dz, x=x, y=y, z=z)
        for number, ((x, y, z), (dx, dy, dz)) in _numbered(volc)
    ]
    return "".join(f"{line}\n" for line in ["%", *lines, "%"]).encode()


def _numbered(volc: Volc) -> Iterator[tuple[int, tuple[list[float], list[int]]]]:
    return enumerate(zip(volc.places.tolist(), volc.rows.tolist(), strict=True), volc.style.first)


def read_volc(files: Files) -> tuple[Volc | None, Remarks]:
    """The grid of the records, with remarks on them and on whether the CSV says the same."""
    remarks = Remarks.of(NAME, files.get(NAME, b""))
    try:
        volc = _volc(json.loads(files.get(NAME, b"")), remarks)
    except (ValueError, KeyError, RecursionError) as error:
        remarks.refuse(0, f"is not what ncfix writes: {type(error).__name__}: {error}")
        return None, remarks
    if volc is not None and files.get(TABLE) != csv_text(volc):
        remarks.refuse(0, f"{TABLE} is missing or does not say the same")
    if volc is not None and files.get(TEXT) != (template_text(volc) if volc.style.template else None):
        remarks.refuse(0, f"{TEXT} is missing, or there without a template, or does not say the same")
    return volc, remarks


def _volc(found: Any, remarks: Remarks) -> Volc | None:
    records = json_values.records(found)
    style = _style(found, remarks)
    counts = tuple(json_values.wholes(found, "counts"))
    rows: list[int] = []
    for record in records:
        rows += _data(record, len(rows) // 3 + style.first, remarks)
    if found["sign"] not in SIGNS:
        remarks.refuse(0, f"the sign is {found['sign']!r}", "correction or error")
    if len(counts) != 3 or not all(2 <= count <= SIDE for count in counts):
        remarks.refuse(0, f"counts {counts}: 2 to {SIDE} points along each of three axes")
    elif len(rows) != 3 * math.prod(counts):
        remarks.refuse(0, f"{len(rows)} values in the records, {3 * math.prod(counts)} expected of {counts}")
    if any(abs(value) > style.largest for value in rows):
        remarks.refuse(0, f"a value beyond -{style.largest} to {style.largest}")
    step = json_values.reals(found, "interval_mm", 3, SMALLEST)
    low, placing = placed(found, "mm", step, counts, remarks)
    unit = json_values.real(found, "detection_unit_um", 1e-6, 10) / 1000
    magnification = json_values.whole(found, "magnification", 1, MOST_MAGNIFICATION)
    if remarks.wrong:
        return None
    slowest = ["XYZ".index(axis) for axis in reversed(style.order)]
    stacked = np.array(rows, dtype=np.int64).reshape(*(counts[axis] for axis in slowest), 3)
    values = stacked.transpose(*np.argsort(slowest), 3)
    volc = Volc(found["sign"], low, step, unit, magnification, values, style, placing)
    for key, number in _placing(volc).items():
        if key == "reference_number" and found.get(key) != number:
            remarks.refuse(0, f"{key} is {found.get(key)!r}, and by the numbers of the axes it is {number}")
            return None
    return volc


def _style(record: Mapping[str, Any], remarks: Remarks) -> Style:
    first, largest = (
        json_values.whole(record, key, low, MOST_NUMBER) for key, low in (("first_number", 0), ("largest", 1))
    )
    order, template = json_values.text(record, "order"), json_values.text(record, "template")
    home_minus = json_values.text({"home_minus": "", **record}, "home_minus")
    if sorted(order) != ["X", "Y", "Z"]:
        remarks.refuse(0, f"the order of the axes is {order!r}", "XYZ, ZYX, ...")
    if not set(home_minus) <= set("XYZ"):
        remarks.refuse(0, f"home_minus is {home_minus!r}", "axes of X, Y and Z")
    if template:
        check_template(template)
    return Style(first, order, largest, template, home_minus)


def check_template(template: str) -> None:
    """Raise ValueError for a line that cannot be filled in, or says too little."""
    names = [(name, form) for _, name, form, _ in Formatter().parse(template) if name is not None]
    for name, form in names:
        if name not in FIELDS or not FORM.fullmatch(form or ""):
            raise ValueError(f"{{{name}}} with {form!r} is not known: {', '.join(FIELDS)}")
    if not {"dx", "dy", "dz"} <= {name for name, _ in names}:
        raise ValueError("it needs {dx}, {dy} and {dz}")
    template.format(no=1, dx=1, dy=1, dz=1, x=0.0, y=0.0, z=0.0)


def _data(record: Mapping[str, Any], first: int, remarks: Remarks) -> list[int]:
    data = json_values.wholes(record, "data")
    size = len(data)
    if record["start_no"] != first or record["num"] != size or size > 3 * POINTS:
        remarks.refuse(0, f"the record of point {record['start_no']} has {size} values and says {record['num']}")
    if record["end_no"] != first + size // 3 - 1:
        remarks.refuse(0, f"the record of point {record['start_no']} ends at {record['end_no']}")
    return data
