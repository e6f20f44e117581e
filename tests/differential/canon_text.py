"""The text that LinuxCNC's `rs274` prints: canonical calls in order, four decimals, in the program's unit."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MM = 25.4
WIDTH = 36
NAMES = ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED", "ARC_FEED", "STRAIGHT_PROBE", "RIGID_TAP", "NURBS_FEED")
KINDS = {name: kind for kind, name in enumerate(NAMES)}
PLANES = {"XY": (0, 1, 2), "YZ": (1, 2, 0), "XZ": (2, 0, 1)}
LINE = re.compile(r"^ *\d+ N\S* +([A-Z0-9_]+)\((.*)\)$")
LAST_DIGIT = 1.01e-4  # a printed number is the exact one to within half its fourth decimal; one for two roundings


@dataclass(frozen=True, slots=True)
class Call:
    """A canonical call that is no motion: its name, its arguments as printed, the number of motions before it."""

    name: str
    arguments: str
    after: int


@dataclass(frozen=True, slots=True)
class Printed:
    """What was printed: motions as rows of the extension's layout (machine axes, mm), the other calls, mm per unit."""

    rows: Floats
    calls: tuple[Call, ...]
    unit: Floats


class _Reader:
    """Follows the offsets through the calls, so that machine positions can be told."""

    def __init__(self) -> None:
        self.unit = 1.0
        self.plane = "XY"
        self.rotation = 0.0
        self.tool = 0.0
        self.offsets = {"SET_G5X_OFFSET": [0.0] * 6, "SET_G92_OFFSET": [0.0] * 6, "USE_TOOL_LENGTH_OFFSET": [0.0] * 6}
        self.rows: list[list[float]] = []
        self.units: list[float] = []
        self.calls: list[Call] = []
        self.last = [0.0] * 6

    def read(self, name: str, arguments: str) -> None:
        if name in KINDS:
            self.motion(name, [] if name == "NURBS_FEED" else [float(value) for value in arguments.split(",")])
            return
        self.calls.append(Call(name, arguments, len(self.rows)))
        if name == "USE_LENGTH_UNITS":
            self.change_unit(MM if "INCHES" in arguments else 1.0)
        elif name == "SELECT_PLANE":
            self.plane = arguments.removeprefix("CANON_PLANE_")
        elif name == "SET_XY_ROTATION":
            self.rotation = float(arguments)
        elif name == "CHANGE_TOOL":
            self.tool = float(arguments)
        elif name in self.offsets:
            self.offsets[name] = self.six(name, arguments)

    def six(self, name: str, arguments: str) -> list[float]:
        values = [float(value) for value in re.split(r"[, ]+", arguments)]
        return self.scaled(values[1:7] if name == "SET_G5X_OFFSET" else values[:6])

    def scaled(self, values: list[float]) -> list[float]:
        return [value if n >= 3 else value * self.unit for n, value in enumerate(values)]

    def change_unit(self, unit: float) -> None:
        self.unit = unit

    def motion(self, name: str, values: list[float]) -> None:
        centre, normal, turns = [0.0] * 3, [0.0] * 3, 0.0
        if name == "ARC_FEED":
            end, centre, normal, turns = self.arc(values)
        elif name == "RIGID_TAP":
            end = self.scaled(values[:3]) + self.last[3:]
        elif name == "NURBS_FEED":
            end = [math.nan] * 6
        else:
            end = self.scaled(values[:6])
        self.last = end
        middle = self.machine([*centre, 0.0, 0.0, 0.0])[:3] if turns else centre
        head = [0.0, KINDS[name], 0.0, 0.0, self.rotation, 0.0, self.tool]
        length = self.offsets["USE_TOOL_LENGTH_OFFSET"][:3]
        nothing = [0.0] * 3
        row = [*head, *end, *nothing, *self.machine(end), *nothing, *middle, *self.turned(normal), turns, *length, 0.0]
        self.rows.append(row)
        self.units.append(self.unit)

    def arc(self, values: list[float]) -> tuple[list[float], list[float], list[float], float]:
        first, second, centre_first, centre_second, turns, height, *rest = values
        one, two, up = PLANES[self.plane]
        end, centre, normal = [0.0, 0.0, 0.0, *rest[:3]], [0.0] * 3, [0.0] * 3
        end[one], end[two], end[up] = first, second, height
        centre[one], centre[two], centre[up], normal[up] = centre_first, centre_second, height, 1.0
        return self.scaled(end), self.scaled(centre), normal, turns

    def machine(self, position: list[float]) -> list[float]:
        shifted = [a + b for a, b in zip(position, self.offsets["SET_G92_OFFSET"], strict=True)]
        shifted[:3] = self.turned(shifted[:3])
        added = zip(shifted, self.offsets["SET_G5X_OFFSET"], self.offsets["USE_TOOL_LENGTH_OFFSET"], strict=True)
        return [value + work + tool for value, work, tool in added]

    def turned(self, vector: list[float]) -> list[float]:
        cosine, sine = math.cos(math.radians(self.rotation)), math.sin(math.radians(self.rotation))
        x, y, z = vector
        return [x * cosine - y * sine, x * sine + y * cosine, z]


def parse(text: str) -> Printed:
    """Read what `rs274` printed."""
    reader = _Reader()
    for line in text.split("\n"):
        found = LINE.match(line)
        if found:
            reader.read(found[1], found[2])
    rows = np.array(reader.rows, dtype=np.float64).reshape(-1, WIDTH)
    return Printed(rows, tuple(reader.calls), np.array(reader.units))


def splines_joined(printed: Printed, rows: Floats) -> Floats:
    """The extension tells a spline as many short lines of one block; here each becomes one motion, to its end."""
    kept, row = [], 0
    for kind in printed.rows[:, 1]:
        if row >= len(rows):
            return rows
        if kind == KINDS["NURBS_FEED"]:
            line = rows[row, 0]
            while row + 1 < len(rows) and rows[row + 1, 0] == line:
                row += 1
            rows[row, 1] = kind
        kept.append(row)
        row += 1
    return rows[[*kept, *range(row, len(rows))]]


def joined(printed: Printed, rows: Floats | None) -> tuple[Floats, NDArray[np.bool_]]:
    """The extension's motions where they are those that were printed, to the digits printed, and which those are.

    The extension loses an axis position that was never programmed when the unit changes before a tool change; such
    motions are taken as printed, with the extension's line. If it tells other motions altogether, or none, all are.
    The end of a spline is not printed.
    """
    if rows is None or len(printed.rows) != len(rows) or not np.array_equal(printed.rows[:, 1], rows[:, 1]):
        return printed.rows, np.zeros(len(printed.rows), dtype=np.bool_)
    allowed = np.full((len(rows), 6), LAST_DIGIT)
    allowed[:, :3] *= printed.unit[:, None]
    difference = np.abs(printed.rows[:, 7:13] - rows[:, 7:13])
    same: NDArray[np.bool_] = np.all(np.isnan(difference) | (difference <= allowed), axis=1)
    rows[~same, 7:] = printed.rows[~same, 7:]
    return rows, same
