"""Files of stored pitch errors: written, and read back as the control sums them up, with remarks on faults.

Increments are in the form of the sample of B-63980EN, p. 100: `no,value`; parameters 3620 to 3625 belong to them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ncfix.arrays import Array, Ints
from ncfix.tables.compensation import Term
from ncfix.tables.control import Files
from ncfix.tables.grid import Grid
from ncfix.tables.table_files import TURNING, Remarks, as_number, unit_of
from ncfix.values import frozen
from ncfix_fanuc.parameters import SIGNS, entries_of, read_records, sense_of

LARGEST_INCREMENT = 7
MOST_POINTS = 128
"""Largest number of points of an axis."""
NUMBERS = {"reference": 3620, "low": 3621, "high": 3622, "magnification": 3623, "interval": 3624, "turn": 3625}
HEAD = "no,value"
POINT = re.compile(r"\s*(\d{1,6})\s*[,;\s]\s*([-+]?\d{1,6})\s*")
PARAMETERS, SETTINGS = "parameters.txt", "settings.txt"
MOST_PITCH_MAGNIFICATION = 100
"""Largest magnification of pitch errors (parameter 3623)."""
FAR = 1e6
"""Largest interval, mm or degree."""


@frozen
class Pitch:
    """The increments of one axis.

    axis           letter of the axis
    first          number of the first point
    increments     (n,) change of the correction from the point before, in detection units times magnification; on an
                   endless axis the first repeats the last
    reference      number of the point at the reference position
    magnification  factor of the detection unit
    interval       distance of the points, mm or degree
    turn           travel of one turn, degrees; 0 for an axis that is not endless
    at             machine coordinate of the reference position, mm or degree
    """

    axis: str
    first: int
    increments: Ints
    reference: int
    magnification: int
    interval: float
    turn: float = 0.0
    at: float = 0.0

    @property
    def last(self) -> int:
        """The number of the last point."""
        return self.first + len(self.increments) - 1


def pitch_text(pitch: Pitch) -> bytes:
    """The file of increments of an axis."""
    note = f"# No.{pitch.first}..{pitch.last}, incremental values (-7..+7), x magnification, detection units"
    rows = [f"{number},{value}" for number, value in enumerate(pitch.increments.tolist(), pitch.first)]
    return "".join(f"{row}\n" for row in [note, HEAD, *rows]).encode()


def is_increments(content: bytes) -> bool:
    """Whether a file holds increments by point number."""
    rows = (row.split("#", 1)[0].replace(" ", "").lower() for row in content.decode("latin-1").splitlines())
    return next((row for row in rows if row.strip()), "") == HEAD


def read_increments(remarks: Remarks) -> tuple[int, Ints]:
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
        if abs(value) > LARGEST_INCREMENT:
            text = f"{value} is beyond -{LARGEST_INCREMENT} to {LARGEST_INCREMENT}"
            remarks.refuse(line, text, "a larger magnification")
        found.append((number, value))
    if len(found) < 2 or len(found) > MOST_POINTS:
        remarks.refuse(0, f"{len(found)} points; 2 to {MOST_POINTS} are possible")
    first = found[0][0] if found else 0
    return first, np.array([value for _, value in found], dtype=np.int64)


def read_pitches(files: Files) -> tuple[tuple[Term, ...], list[Remarks]]:
    """The tables of all axes, with remarks on every file."""
    head = Remarks.of(SETTINGS, files.get(SETTINGS, b""))
    words = " ".join(head.rows).split()
    units = [as_number(word) or 0.0 for word in words[1:3]]
    places = entries_of(" ".join(words[4:]))
    if len(words) < 4 or words[0] not in SIGNS or not all(1e-6 <= unit <= 10 for unit in units) or places is None:
        head.refuse(0, "should hold the sign, two detection units, the axes, and reference positions if any", "PITCH-1")
        return (), [head]
    tables = [name for name in sorted(files) if name.startswith("pitch_") and name.endswith(".csv")]
    parameters = Remarks.of(PARAMETERS, files.get(PARAMETERS, b""))
    punched = read_records(parameters) if tables or PARAMETERS in files else ()
    values = {record.number: dict(record.values) for record in punched if record.kind == "A"}
    remarks, terms = [head, parameters], []
    for name in tables:
        axis = name[len("pitch_") : -len(".csv")]
        found = Remarks.of(name, files[name])
        remarks.append(found)
        pitch = _pitch(found, axis, words[3], values)
        if pitch is not None and not found.wrong:
            unit = unit_of(axis) * (units[1] if axis in TURNING else units[0] / 1000)
            pitch = replace(pitch, at=dict(places).get(axis, 0.0))
            terms.append(Term((_grid(pitch, sense_of(words[0]) * unit),)))
    return tuple(terms), remarks


def _pitch(remarks: Remarks, axis: str, axes: str, values: Mapping[int, Mapping[int, str]]) -> Pitch | None:
    first, increments = read_increments(remarks)
    index = axes.find(axis) + 1
    if len(axis) != 1 or not index:
        remarks.refuse(0, f"{axis} is none of the axes {axes}")
        return None
    try:
        found = {name: float(values[number][index]) for name, number in NUMBERS.items()}
    except KeyError:
        remarks.refuse(0, f"{PARAMETERS} has not all parameters of axis {index}")
        return None
    last = first + len(increments) - 1
    _check(remarks, found, first, last)
    if found["turn"] and len(increments):  # the first point of a turn is the last one again: B-63980EN, p. 100
        if total := increments[1:].sum():
            remarks.refuse(0, f"the increments of a turn behind its first point add up to {total}, not to zero")
        if increments[0] != increments[-1]:
            text = f"point {first} has {increments[0]}, but point {last}, at the same position, has {increments[-1]}"
            remarks.doubt(0, text, "the same value for both")
    if remarks.wrong:
        return None
    reference, magnification = int(found["reference"]), int(found["magnification"])
    return Pitch(axis, first, increments, reference, magnification, found["interval"], found["turn"])


def _check(remarks: Remarks, parameters: Mapping[str, float], first: int, last: int) -> None:
    if (parameters["low"], parameters["high"]) != (first, last):
        remarks.refuse(
            0, f"points {first} to {last}, but the parameters state {parameters['low']:g} to {parameters['high']:g}"
        )
    if parameters["interval"] == 0:
        remarks.refuse(0, "an interval of zero")
    elif not 0 < parameters["interval"] <= FAR:
        remarks.refuse(0, f"an interval of {parameters['interval']:g}")
    if parameters["magnification"] not in range(MOST_PITCH_MAGNIFICATION + 1):
        remarks.refuse(0, f"a magnification of {parameters['magnification']:g}", f"0 to {MOST_PITCH_MAGNIFICATION}")
    if parameters["reference"] not in range(100_000):
        remarks.refuse(0, f"a reference position at point {parameters['reference']:g}")
    elif not first <= parameters["reference"] <= last:
        remarks.doubt(0, "the reference position is outside the points")


def _grid(pitch: Pitch, unit: float) -> Grid:
    sums = np.cumsum(pitch.increments)
    at_zero = int(np.clip(pitch.reference - pitch.first, 0, len(sums) - 1))
    counts = np.arange(pitch.first - pitch.reference, pitch.last - pitch.reference + 1, dtype=np.float64)
    nodes: Array = unit_of(pitch.axis) * (pitch.at + pitch.interval * counts)
    values = (sums - sums[at_zero]) * pitch.magnification * unit
    return Grid((pitch.axis,), (nodes,), (pitch.axis,), values[:, None].astype(np.float64), (bool(pitch.turn),))
