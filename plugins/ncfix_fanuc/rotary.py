"""Three-dimensional compensation with angles (`cnc_wrrotvolc`): three lengths and three angles at every point.

The record, `IODBROTVOLC` of fwlib32.h, has `lin[3]` and `rot[3]`; what the control makes of them is not public. Taken
for true: the lengths are what is added with a tool of no length, and the angles turn the tool about the gauge line, so
that one grid holds for tools of any length.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ncfix.diagnostics import Message, RefusedError, UsageError
from ncfix.tables.control import Assumption, Control, Files, Option, Properties, Request, Written
from ncfix.tables.grid import Array, Grid
from ncfix.tables.lines import Remarks
from ncfix.tables.mesh import search
from ncfix.tables.volume import Volume
from ncfix_fanuc.control import AXES, SIDE

NAME = "rotary.json"
LARGEST = 127
LENGTH = 100.0
"""mm: the tool with which angles are worked out."""
DEGREE = np.pi / 180


@dataclass(frozen=True, slots=True)
class Turning:
    """A grid of lengths and angles, both corrections; the tool is along Z.

    lengths  over X, Y and Z: X, Y, Z at the gauge line, mm
    angles   about X, Y and Z, rad, under the names A, B and C
    """

    lengths: Grid
    angles: Grid
    length: float = 0.0

    def for_tool(self, length: float) -> Turning:
        """With a tool of this length."""
        return Turning(self.lengths, self.angles, length)

    @property
    def grids(self) -> tuple[Grid, ...]:
        """Both."""
        return (self.lengths, self.angles)

    @property
    def axes(self) -> frozenset[str]:
        """X, Y and Z."""
        return frozenset(AXES)

    @property
    def points(self) -> int:
        """The nodes of the one grid that they share."""
        return self.lengths.points

    def at(self, names: Sequence[str], q: Array, direction: Array | None = None) -> Array:
        """See `Tables.at`: the shift of the gauge line, and what the turned tool adds at its tip."""
        columns = [names.index(axis) for axis in AXES]
        tool = np.array([0.0, 0.0, -self.length])
        correction = np.zeros_like(q)
        angles = self.angles.at(q[:, columns])
        correction[:, columns] = self.lengths.at(q[:, columns]) + np.cross(angles, tool)
        return correction


@dataclass(frozen=True, slots=True)
class Records:
    """The grid in whole numbers, (nx, ny, nz, 3) each."""

    sign: str
    low: tuple[float, ...]
    step: tuple[float, ...]
    units: tuple[float, float]
    magnifications: tuple[int, int]
    lin: NDArray[np.int64]
    rot: NDArray[np.int64]

    def tables(self) -> Turning:
        """As corrections."""
        counts = self.lin.shape[:3]
        nodes = tuple(low + step * np.arange(n) for low, step, n in zip(self.low, self.step, counts, strict=True))
        sense = 1.0 if self.sign == "correction" else -1.0
        scales = [sense * unit * factor for unit, factor in zip(self.units, self.magnifications, strict=True)]
        lin, rot = (np.asarray(part, dtype=np.float64) for part in (self.lin, self.rot))
        lengths = Grid(AXES, nodes, AXES, lin * scales[0])
        return Turning(lengths, Grid(AXES, nodes, ("A", "B", "C"), rot * scales[1]))

    def text(self) -> bytes:
        """JSON: what the parameters must be, and a record for each point, X fastest."""
        head = {
            "sign": self.sign,
            "first_mm": self.low,
            "interval_mm": self.step,
            "counts": self.lin.shape[:3],
            "detection_unit_um": round(self.units[0] * 1000, 6),
            "detection_unit_deg": round(self.units[1] / DEGREE, 9),
            "magnification": self.magnifications[0],
            "angle_magnification": self.magnifications[1],
        }
        lines = [f' "{key}": {json.dumps(value)},\n' for key, value in head.items()]
        rows = zip(*(part.transpose(2, 1, 0, 3).reshape(-1, 3).tolist() for part in (self.lin, self.rot)), strict=True)
        records = ",\n".join(f'  {{"no": {n}, "lin": {lin}, "rot": {rot}}}' for n, (lin, rot) in enumerate(rows, 1))
        return f'{{\n{"".join(lines)} "records": [\n{records}\n ]\n}}\n'.encode()


class FanucRotary(Control):
    """The control `fanuc-rotary`."""

    name = "fanuc-rotary"
    title = "Fanuc Series 30i three-dimensional compensation with angles"
    reaches = "L-VOL"
    any_tool = True
    properties = Properties(
        value_sign="as --set sign says",
        input_signal="setpoint",
        position_frame="machine coordinates",
        unit="detection unit times magnification; positions mm",
        quantum=(1e-4, 1e-4 * DEGREE),
        extrapolation="taken as held at the outermost nodes",
        bidirectional=False,
        max_points=SIDE**3,
        max_tables=1,
        combine="one grid",
    )
    assumptions = (
        Assumption(
            "FROT-1",
            "The sign of lengths and angles is what --set sign says.",
            "none public; patents speak of an amount that is added",
            "none: it must be given",
            "Load lin = [100, 0, 0] at all points: which way does X move?",
        ),
        Assumption(
            "FROT-2",
            "Lengths are what is added at the gauge line; angles turn the tool about it, right-handed about X, Y and "
            "Z, and the linear axes follow its tip.",
            "the record has three lengths and three angles (fwlib32.h); a patent (US 7969111) adds six-component "
            "vectors of a lattice to the linear positions",
            "so",
            "Load rot = [100, 0, 0] at all points and see how far Y moves with a short and with a long tool.",
        ),
        Assumption(
            "FROT-3",
            f"Points are numbered from 1, X fastest; values are whole numbers from -{LARGEST} to {LARGEST}.",
            "none public",
            "so",
            "Write one point and read it back.",
        ),
    )
    options: ClassVar[Mapping[str, Option]] = {
        "sign": Option(None, "correction: values are added to the command; error: they are taken off it"),
        "detection_unit_um": Option("0.1", "detection unit of linear axes, um"),
        "detection_unit_deg": Option("0.0001", "detection unit of angles, degree"),
    }
    steps = (
        "Settle FROT-1 to FROT-3 on the machine.",
        "Set numbers of points, intervals and magnifications as rotary.json has them.",
        "Write the records with cnc_wrrotvolc, switch power off and on, home all axes.",
        "Measure one line with a short and with a long tool: both errors must have become smaller.",
    )
    switch_off = "Switch the function off by its parameter."

    def write(self, request: Request) -> Written:
        """`rotary.json`."""
        settings = self.settings(request.settings)
        if settings["sign"] not in ("correction", "error"):
            raise UsageError.of("NCF485", f"sign={settings['sign']}", hint="correction or error")
        units = (_unit(settings["detection_unit_um"]) / 1000, _unit(settings["detection_unit_deg"]) * DEGREE)
        machine = request.machine
        if not set(AXES) <= set(machine.axis_names):
            raise RefusedError.of("NCF484", f"the grid is over X, Y and Z; the machine has {machine.axis_names}")
        if not np.allclose(machine.tool.direction, (0, 0, 1), atol=1e-9):
            raise RefusedError.of("NCF484", "the tool of this machine is not along Z", hint="use the control fanuc")
        mesh = search(Volume.of(machine, AXES, request.space, request.tool_length), request.target, [SIDE] * 3, SIDE**3)
        counts = mesh.grid.counts
        bare, long = (Volume.of(machine, AXES, request.space, length).grid(counts) for length in (0.0, LENGTH))
        order = [bare.outputs.index(axis) for axis in AXES]
        lever = (long.values - bare.values)[..., order] / LENGTH
        angles = np.stack([lever[..., 1], -lever[..., 0], np.zeros(counts)], axis=-1)
        made = _records(settings["sign"], mesh.grid.nodes, bare.values[..., order], angles, units)
        rounding = [0.5 * made.magnifications[0] * units[0] * 1000, 0.5 * made.magnifications[1] * units[1] * 1e6]
        notes = [
            f"Grid {' x '.join(map(str, counts))}: {bare.points} points; it misses {1e3 * mesh.left:.2f} um at most.",
            f"Values are rounded by up to {rounding[0]:.2f} um and {rounding[1]:.2f} urad.",
        ]
        if machine.rotary.any():
            notes.append("The grid is that of rotary axes at zero; at other angles more is left.")
        if not mesh.reached:
            notes.append(f"The target of {1e3 * request.target:g} um is not reached with {SIDE} points an axis.")
        return Written({NAME: made.text()}, tuple(notes))

    def read(self, files: Files) -> Turning:
        """As the control is taken to add them. Raises `ConfigError` NCF491."""
        found, remarks = _read(files)
        remarks.check()
        assert found is not None
        return found.tables()

    def lint(self, files: Files) -> tuple[Message, ...]:
        """Records that do not fit, and values beyond the range."""
        return _read(files)[1].messages


def _unit(text: str) -> float:
    try:
        found = float(text)
    except ValueError:
        found = math.nan
    if not 1e-6 <= found <= 10:
        raise UsageError.of("NCF485", f"a detection unit of {text}", hint="from 0.000001 to 10")
    return found


def _records(sign: str, nodes: tuple[Array, ...], lengths: Array, angles: Array, units: tuple[float, float]) -> Records:
    sense = 1 if sign == "correction" else -1
    factors, whole = [], []
    for values, unit in zip((lengths, angles), units, strict=True):
        factors.append(max(1, math.ceil(float(np.abs(values).max()) / (LARGEST * unit) - 1e-9)))
        whole.append(np.rint(sense * values / (factors[-1] * unit)).astype(np.int64))
    low = tuple(float(line[0]) for line in nodes)
    step = tuple(round(float(line[1] - line[0]), 6) for line in nodes)
    return Records(sign, low, step, units, (factors[0], factors[1]), whole[0], whole[1])


def _read(files: Files) -> tuple[Records | None, Remarks]:
    remarks = Remarks.of(NAME, files.get(NAME, b""))
    try:
        return _checked(json.loads(files.get(NAME, b"")), remarks), remarks
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        remarks.refuse(0, f"is not what ncfix writes: {type(error).__name__}: {error}")
    return None, remarks


def _checked(found: Mapping[str, Any], remarks: Remarks) -> Records | None:
    counts = tuple(int(count) for count in found["counts"])
    if found["sign"] not in ("correction", "error"):
        remarks.refuse(0, f"the sign is {found['sign']!r}", "correction or error")
    if len(counts) != 3 or not all(2 <= count <= SIDE for count in counts):
        remarks.refuse(0, f"counts {counts}: 2 to {SIDE} points along each of three axes")
    records = found["records"]
    if [record["no"] for record in records] != list(range(1, len(records) + 1)):
        remarks.refuse(0, "the records are not numbered 1, 2, 3, ...")
    if len(records) != int(np.prod(counts)):
        remarks.refuse(0, f"{len(records)} records, {int(np.prod(counts))} expected of {counts}")
    if any(len(record[key]) != 3 for record in records for key in ("lin", "rot")):
        remarks.refuse(0, "a record without three lengths and three angles")
    if any(abs(int(value)) > LARGEST for record in records for key in ("lin", "rot") for value in record[key]):
        remarks.refuse(0, f"a value beyond -{LARGEST} to {LARGEST}")
    if remarks.wrong:
        return None
    parts = []
    for key in ("lin", "rot"):
        rows = np.array([record[key] for record in records], dtype=np.int64)
        parts.append(rows.reshape(*counts[::-1], 3).transpose(2, 1, 0, 3))
    low, step = (tuple(float(value) for value in found[key]) for key in ("first_mm", "interval_mm"))
    units = (float(found["detection_unit_um"]) / 1000, float(found["detection_unit_deg"]) * DEGREE)
    magnifications = (int(found["magnification"]), int(found["angle_magnification"]))
    return Records(found["sign"], low, step, units, magnifications, parts[0], parts[1])
