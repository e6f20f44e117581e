"""Stored pitch errors as text: numbered increments, and the parameters that belong to them in the punched form.

Increments in the form of the sample of B-63980EN, p. 100: `no,value`. Parameters as punched by Series 15i and later
(B-63330EN): records `N03620A1P33A2P...;` between two lines with `%`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.tables.table_files import Remarks

LARGEST = 7
MOST = 128
"""Points of an axis."""
NUMBERS = {"reference": 3620, "low": 3621, "high": 3622, "magnification": 3623, "interval": 3624, "turn": 3625}
HEAD = "no,value"
RECORD = re.compile(r"N(\d{1,6})(?:Q\d)?((?:[ASL]\d{1,3}[PM][-+]?\d{1,12}\.?\d*)+);?")
PLAIN = re.compile(r"N(\d{1,6})(?:Q\d)?P([-+]?\d{1,12}\.?\d*);?")
ENTRY = re.compile(r"([ASL])(\d+)[PM]([-+]?\d+\.?\d*)")
POINT = re.compile(r"\s*(\d{1,6})\s*[,;\s]\s*([-+]?\d{1,6})\s*")


@dataclass(frozen=True, slots=True)
class Pitch:
    """The increments of one axis.

    axis           its letter
    first          number of the first point
    increments     (n,) times magnification times detection unit: what is added on the way from the point before; of a
                   turn the first is the last one again
    reference      number of the point at machine zero
    magnification  factor
    interval       mm or degree
    turn           travel of a turn, degree; 0 for an axis that does not turn round
    """

    axis: str
    first: int
    increments: NDArray[np.int64]
    reference: int
    magnification: int
    interval: float
    turn: float = 0.0

    @property
    def last(self) -> int:
        """The number of the last point."""
        return self.first + len(self.increments) - 1


def pitch_text(pitch: Pitch) -> bytes:
    """The increments."""
    note = f"# No.{pitch.first}..{pitch.last}, incremental values (-7..+7), x magnification, detection units"
    rows = [f"{number},{value}" for number, value in enumerate(pitch.increments.tolist(), pitch.first)]
    return "".join(f"{row}\n" for row in [note, HEAD, *rows]).encode()


def is_increments(content: bytes) -> bool:
    """Whether a file holds increments by point number."""
    rows = (row.split("#", 1)[0].replace(" ", "").lower() for row in content.decode("latin-1").splitlines())
    return next((row for row in rows if row.strip()), "") == HEAD


def is_records(content: bytes) -> bool:
    """Whether a file is of records between two lines with %, as parameters are punched."""
    rows = [row.strip() for row in content.decode("latin-1").split("\n") if row.strip()]
    return len(rows) > 1 and rows[0] == "%" and bool(RECORD.fullmatch(rows[1]) or PLAIN.fullmatch(rows[1]))


def read_increments(remarks: Remarks) -> tuple[int, NDArray[np.int64]]:
    """The number of the first point, and the increments."""
    rows = [(line, row) for line, row in enumerate(remarks.rows, 1) if row.split("#", 1)[0].strip()]
    if not rows or rows[0][1].replace(" ", "").lower() != HEAD:
        remarks.refuse(rows[0][0] if rows else 0, f"should begin with {HEAD}")
        return 0, np.zeros(0, dtype=np.int64)
    found: list[tuple[int, int]] = []
    for line, row in rows[1:]:
        match = POINT.fullmatch(row.split("#", 1)[0])
        if match is None:
            remarks.refuse(line, "not a point number, a comma and a whole number")
            continue
        number, value = int(match[1]), int(match[2])
        if found and number != found[-1][0] + 1:
            remarks.refuse(line, f"point {number} after point {found[-1][0]}")
        if abs(value) > LARGEST:
            remarks.refuse(line, f"{value} is beyond -{LARGEST} to {LARGEST}", "a larger magnification")
        found.append((number, value))
    if len(found) < 2 or len(found) > MOST:
        remarks.refuse(0, f"{len(found)} points; 2 to {MOST} are possible")
    first = found[0][0] if found else 0
    return first, np.array([value for _, value in found], dtype=np.int64)


def parameter_text(values: Mapping[int, Sequence[float]]) -> bytes:
    """Records of axis parameters: number -> one value for each axis in turn."""
    rows = [
        f"N{number:05d}{''.join(f'A{n}P{_short(value)}' for n, value in enumerate(row, 1))};"
        for number, row in sorted(values.items())
    ]
    return "".join(f"{row}\n" for row in ["%", *rows, "%"]).encode()


def _short(value: float) -> str:
    return f"{value:.0f}" if value == round(value) else f"{value:.4f}"


@dataclass(frozen=True, slots=True)
class Record:
    """A parameter as punched: kind "A" for axes, "S" spindles, "L" paths, "" for a plain one; values by their index."""

    number: int
    kind: str
    values: tuple[tuple[int, str], ...]


def read_records(remarks: Remarks) -> tuple[Record, ...]:
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
            found.append(Record(int(plain[1]), "", ((0, plain[2]),)))
        elif several:
            entries = ENTRY.findall(several[2])
            if len({kind for kind, _, _ in entries}) > 1:
                remarks.refuse(line, "axes, spindles or paths, not several kinds in one record")
            found.append(Record(int(several[1]), entries[0][0], tuple((int(n), value) for _, n, value in entries)))
        else:
            remarks.refuse(line, "is no record N..P.. or N..A1P..A2P..")
    return tuple(found)
