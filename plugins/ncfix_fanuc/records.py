"""The grid as records of the FOCAS library (`ODBVOLC` of fwlib32.h: 72 numbers, 24 points of three axes) and as CSV."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ncfix.tables.control import Files
from ncfix.tables.grid import Grid
from ncfix.tables.lines import Remarks

POINTS = 24
"""Of one record."""
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
    """

    sign: str
    low: tuple[float, ...]
    step: tuple[float, ...]
    unit: float
    magnification: int
    values: NDArray[np.int64]
    style: Style = Style()

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
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        remarks.refuse(0, f"is not what ncfix writes: {type(error).__name__}: {error}")
        return None, remarks
    if volc is not None and files.get(TABLE) != csv_text(volc):
        remarks.refuse(0, f"{TABLE} is missing or does not say the same")
    if volc is not None and files.get(TEXT) != (template_text(volc) if volc.style.template else None):
        remarks.refuse(0, f"{TEXT} is missing, or there without a template, or does not say the same")
    return volc, remarks


def _volc(found: Mapping[str, Any], remarks: Remarks) -> Volc | None:
    counts = tuple(int(count) for count in found["counts"])
    rows: list[int] = []
    style = Style(int(found["first_number"]), str(found["order"]), int(found["largest"]), str(found["template"]))
    style = replace(style, home_minus=str(found.get("home_minus", "")))
    if not set(style.home_minus) <= set("XYZ"):
        remarks.refuse(0, f"home_minus is {style.home_minus!r}", "axes of X, Y and Z")
    if sorted(style.order) != ["X", "Y", "Z"]:
        remarks.refuse(0, f"the order of the axes is {style.order!r}", "XYZ, ZYX, ...")
    for record in found["records"]:
        _check_record(record, len(rows) // 3 + style.first, remarks)
        rows += [int(value) for value in record["data"]]
    if found["sign"] not in ("correction", "error"):
        remarks.refuse(0, f"the sign is {found['sign']!r}", "correction or error")
    if len(counts) != 3 or not all(2 <= count <= 25 for count in counts):
        remarks.refuse(0, f"counts {counts}: 2 to 25 points along each of three axes")
    elif len(rows) != 3 * int(np.prod(counts)):
        remarks.refuse(0, f"{len(rows)} values in the records, {3 * int(np.prod(counts))} expected of {counts}")
    if any(abs(value) > style.largest for value in rows):
        remarks.refuse(0, f"a value beyond -{style.largest} to {style.largest}")
    low, step = (tuple(float(value) for value in found[key]) for key in ("first_mm", "interval_mm"))
    if len(low) != 3 or len(step) != 3 or not all(value > 0 for value in step):
        remarks.refuse(0, "three first positions and three intervals above zero are needed")
    if remarks.wrong:
        return None
    slowest = ["XYZ".index(axis) for axis in reversed(style.order)]
    stacked = np.array(rows, dtype=np.int64).reshape(*(counts[axis] for axis in slowest), 3)
    values = stacked.transpose(*np.argsort(slowest), 3)
    unit, magnification = float(found["detection_unit_um"]) / 1000, int(found["magnification"])
    return Volc(found["sign"], low, step, unit, magnification, values, style)


def _check_record(record: Mapping[str, Any], first: int, remarks: Remarks) -> None:
    size = len(record["data"])
    if record["start_no"] != first or record["num"] != size or size > 3 * POINTS:
        remarks.refuse(0, f"the record of point {record['start_no']} has {size} values and says {record['num']}")
    if record["end_no"] != first + size // 3 - 1:
        remarks.refuse(0, f"the record of point {record['start_no']} ends at {record['end_no']}")
