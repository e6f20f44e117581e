"""LinuxCNC's `rs274`, run for its positions: a second opinion on short programs. It prints four decimals."""

from __future__ import annotations

import math
import os
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

CALL = re.compile(r"\s*\d+ N\S*\s+([A-Z0-9_]+)\((.*)\)$")
MOTIONS = frozenset({"STRAIGHT_FEED", "STRAIGHT_TRAVERSE", "STRAIGHT_PROBE"})
ORDER = {"XY": (0, 1, 2), "XZ": (2, 0, 1), "YZ": (1, 2, 0)}
"""First, second and third axis of an arc, by plane."""

INI = """[EMC]
VERSION = 1.1
[RS274NGC]
PARAMETER_FILE = {folder}/p.var
RS274NGC_STARTUP_CODE = G21
[TRAJ]
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
COORDINATES = X Y Z A B C
[KINS]
JOINTS = 6
[EMCIO]
TOOL_TABLE = {folder}/t.tbl
"""


@dataclass(frozen=True, slots=True)
class Stop:
    """Where a motion ends: machine coordinates in mm and degrees, and for arcs the centre and the turns."""

    end: tuple[float, ...]
    centre: tuple[float, ...] | None = None
    turns: int = 0


def available() -> bool:
    """Whether it is installed."""
    return shutil.which("rs274") is not None


def run(text: str) -> tuple[int, list[Stop]]:
    """Exit code and motions of a program; offsets, references and tool lengths are zero at the start."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "min.ini").write_text(INI.format(folder=folder))
        (folder / "t.tbl").write_text("".join(f"T{n} P{n} Z0 D10\n" for n in range(1, 20)))
        numbers = [*range(5161, 5167), *range(5181, 5187), *range(5210, 5217)]
        numbers += [first + i for first in range(5221, 5382, 20) for i in (0, 1, 2, 3, 4, 5, 9)]
        values = dict.fromkeys(numbers, 0.0) | {5220: 1.0}
        lines = [f"{number}\t{value}\n" for number, value in sorted(values.items())]
        (folder / "p.var").write_text("".join(lines))
        (folder / "part.ngc").write_text(text)
        command = ["rs274", "-g", "-n", "2", "-i", "min.ini", "-t", "t.tbl", "-v", "p.var", "part.ngc"]
        done = subprocess.run(
            command,
            cwd=folder,
            env={**os.environ, "HOME": name},
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        return done.returncode, Canon().read(done.stdout)


class Canon:
    """Adds the offsets to the canonical calls."""

    def __init__(self) -> None:
        self.unit, self.plane, self.angle = 1.0, "XY", 0.0
        self.origin, self.shift, self.tool = ([0.0] * 6 for _ in range(3))

    def read(self, text: str) -> list[Stop]:
        """The motions in what it printed."""
        stops = []
        for line in text.splitlines():
            match = CALL.match(line)
            stop = self.call(*match.groups()) if match else None
            if stop is not None:
                stops.append(stop)
        return stops

    def call(self, name: str, arguments: str) -> Stop | None:
        """One call."""
        if name == "USE_LENGTH_UNITS":
            self.unit = 25.4 if "INCH" in arguments else 1.0
        elif name == "SELECT_PLANE":
            self.plane = arguments.removesuffix(")")[-2:]
        elif name in MOTIONS:
            return Stop(self.machine(numbers(arguments)[:6]))
        elif name == "ARC_FEED":
            return self.arc(numbers(arguments))
        elif name == "SET_XY_ROTATION":
            self.angle = math.radians(numbers(arguments)[0])
        elif name == "SET_G5X_OFFSET":
            self.origin = self.scaled(numbers(arguments)[1:7])
        elif name == "SET_G92_OFFSET":
            self.shift = self.scaled(numbers(arguments)[:6])
        elif name == "USE_TOOL_LENGTH_OFFSET":
            self.tool = self.scaled(numbers(arguments)[:6])
        return None

    def scaled(self, values: list[float]) -> list[float]:
        """mm of program units."""
        return [value * self.unit for value in values[:3]] + values[3:]

    def machine(self, values: list[float]) -> tuple[float, ...]:
        """Machine coordinates of program coordinates."""
        x, y, *rest = (a + b for a, b in zip(self.scaled(values), self.shift, strict=True))
        cosine, sine = math.cos(self.angle), math.sin(self.angle)
        turned = [x * cosine - y * sine, x * sine + y * cosine, *rest]
        return tuple(a + b + c for a, b, c in zip(turned, self.origin, self.tool, strict=True))

    def arc(self, values: list[float]) -> Stop:
        """An arc: end and centre in its plane, turns, and the end across it."""
        first, second, first_centre, second_centre, turns, across, *rotary = values
        end, centre = [0.0] * 3, [0.0] * 3
        i, j, k = ORDER[self.plane]
        end[i], end[j], end[k] = first, second, across
        centre[i], centre[j], centre[k] = first_centre, second_centre, across
        return Stop(self.machine(end + rotary[:3]), self.machine([*centre, 0.0, 0.0, 0.0])[:3], int(turns))


def numbers(arguments: str) -> list[float]:
    """The numbers of a call."""
    return [float(part) for part in re.split(r"[ ,]+", arguments.strip())]
