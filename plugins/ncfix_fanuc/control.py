"""Three-dimensional error compensation of Fanuc Series 30i: a grid of corrections over X, Y and Z.

The interpolation (A-79351E, trilinear in the control's current position), the size (25 x 25 x 25) and the record of
the FOCAS library are public; the control's own text file is not: one is written only if a template is given, and its
name says that it is assumed. What would double the error if guessed wrongly must be said: `--set sign=...`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from ncfix.diagnostics import Message, RefusedError, UsageError
from ncfix.tables.control import Assumption, Control, Files, Option, Properties, Request, Written
from ncfix.tables.exact import reversal_note
from ncfix.tables.grid import Array, Grid
from ncfix.tables.mesh import AIM, Mesh, search
from ncfix.tables.neutral import Compensation, Term
from ncfix.tables.volume import Volume
from ncfix_fanuc.records import NAME, TABLE, TEXT, Style, Volc, csv_text, json_text, read_volc, template_text

SIDE = 25
MOST_MAGNIFICATION = 100
AXES = ("X", "Y", "Z")
TEMPLATE = "N{no}A1P{dx}A2P{dy}A3P{dz};"


class Fanuc(Control):
    """The control `fanuc`."""

    name = "fanuc"
    title = "Fanuc Series 30i three-dimensional error compensation"
    reaches = "L-VOL"
    properties = Properties(
        value_sign="as --set sign says",
        input_signal="setpoint",
        position_frame="machine coordinates",
        unit="detection unit times magnification; positions mm",
        quantum=(1e-4, 0.0),
        extrapolation="taken as held at the outermost nodes (FANUC-4)",
        bidirectional=False,
        max_points=SIDE**3,
        max_tables=1,
        combine="one grid",
    )
    assumptions = (
        Assumption(
            "FANUC-1",
            "The sign of the values is what --set sign says.",
            "none public; patents speak of an amount that is added",
            "none: it must be given",
            "Load +0.010 mm at all points of X: does X move by 0.010 towards plus (correction) or minus (error)?",
        ),
        Assumption(
            "FANUC-2",
            "Points are numbered from first_number on, the first axis of order fastest.",
            "none public",
            "from 1, X fastest, then Y, then Z",
            "Load a value at point 2 only, and find with cnc_rdvolccomp where it acts.",
        ),
        Assumption(
            "FANUC-3",
            "A value is a whole number from -127 to 127, times magnification, times detection unit.",
            "none public for the grid; so it is with other compensations of these controls",
            "the detection unit is 0.1 um",
            "The parameter manual of the machine; --set detection_unit_um=...",
        ),
        Assumption(
            "FANUC-4",
            "Outside the grid the value of its edge holds.",
            "none public",
            "edge value",
            "Move beyond the grid and read cnc_rdvolccomp.",
        ),
        Assumption(
            "FANUC-5",
            "The text file has a line like the template for every point, between two lines with %.",
            "none public; N..A1P..A2P.. is how parameters of these controls are punched",
            "no text file is written",
            "Punch the grid that is in the control and compare the form; --set template=... follows it.",
        ),
    )
    options: ClassVar[Mapping[str, Option]] = {
        "sign": Option(None, "correction: values are added to the command; error: they are taken off it"),
        "detection_unit_um": Option("0.1", "detection unit of the linear axes, um"),
        "largest": Option("127", "largest value of a point"),
        "order": Option("XYZ", "the axes from the one whose number runs fastest"),
        "first_number": Option("1", "number of the first point"),
        "template": Option("", f"a line of the text file, ASSUMED, e.g. {TEMPLATE}"),
        "fit": Option(
            "auto", "nodes: exact at the points; area: least squares around them; auto: area if nodes miss more"
        ),
    }
    steps = (
        "Settle the assumptions below on the machine, sign first.",
        "Set numbers of points, intervals, reference points and magnification as volume.json has them.",
        "Write the records of volume.json with cnc_wrvolc, or type in volume.csv.",
        "Switch power off and on, home all axes.",
        "Read cnc_rdvolccomp at one pose and compare it with volume.csv.",
        "Measure one line again: the error must have become smaller, not twice as large.",
    )
    switch_off = "Switch the function off by its parameter, or set the magnification to zero."

    def write(self, request: Request) -> Written:
        """`volume.json` with the FOCAS records, the same as `volume.csv`, and as text if there is a template."""
        settings = self.settings(request.settings)
        sign = _sign(settings["sign"])
        unit = _unit(settings["detection_unit_um"])
        style = _style(settings)
        if not set(AXES) <= set(request.machine.axis_names):
            text = f"the grid is over X, Y and Z; the machine has {' '.join(request.machine.axis_names)}"
            raise RefusedError.of("NCF484", text, hint="correct its programs instead: ncfix fix")
        mesh = _searched(request, settings["fit"], lambda grid: _rounded(grid, style.largest, unit))
        order = [mesh.grid.outputs.index(axis) for axis in AXES]
        values = mesh.grid.values[..., order]
        magnification = _magnification(values, style.largest * unit)
        if magnification > MOST_MAGNIFICATION:
            text = f"a value of {float(np.abs(values).max()):.3f} mm needs a magnification of {magnification}"
            hint = f"the control takes {MOST_MAGNIFICATION}; a larger detection unit, or is the error in mm?"
            raise RefusedError.of("NCF484", text, hint=hint)
        whole = np.rint(sign * values / (magnification * unit)).astype(np.int64)
        low = tuple(float(line[0]) for line in mesh.grid.nodes)
        step = tuple(round(float(line[1] - line[0]), 6) for line in mesh.grid.nodes)
        made = Volc(settings["sign"], low, step, unit, magnification, whole, style)
        counts = " x ".join(map(str, mesh.grid.counts))
        notes = [
            f"Grid {counts}: {mesh.grid.points} points; it misses {1e3 * mesh.left:.2f} um at most, rounding included.",
            f"Magnification {magnification}: a value is rounded by up to {500 * magnification * unit:.2f} um.",
        ]
        if magnification * unit / 2 > request.target:
            cure = (
                f"values have {style.largest} steps only"
                if magnification > 1
                else "a smaller detection unit would help"
            )
            notes.append(f"The rounding is larger than the target: {cure}.")
        if mesh.left > request.target:
            notes.append(f"The target of {1e3 * request.target:g} um is not reached with {SIDE} points an axis.")
        notes += reversal_note(request.machine, request.space, request.tool_length)
        if request.machine.rotary.any():
            notes.append("The grid is that of rotary axes at zero; at other angles more is left.")
        files = {NAME: json_text(made), TABLE: csv_text(made)}
        if style.template:
            files[TEXT] = template_text(made)
            notes.append(f"{TEXT} is a guess at the control's own file (FANUC-5): compare it with a punched one first.")
        return Written(files, tuple(notes))

    def read(self, files: Files) -> Compensation:
        """As the control would interpolate them. Raises `ConfigError` NCF491."""
        volc, remarks = read_volc(files)
        remarks.check()
        assert volc is not None
        return Compensation((Term((volc.grid(),)),))

    def lint(self, files: Files) -> tuple[Message, ...]:
        """Records that do not fit, values beyond the range, and a CSV that says something else."""
        return read_volc(files)[1].messages


def _sign(text: str) -> int:
    if text not in ("correction", "error"):
        raise UsageError.of("NCF485", f"sign={text}", hint="correction or error; FANUC-1 says how to find out")
    return 1 if text == "correction" else -1


def _magnification(values: Array, largest: float) -> int:
    return max(1, math.ceil(float(np.abs(values).max()) / largest - 1e-9))


def _searched(request: Request, fit: str, written: Callable[[Grid], Grid]) -> Mesh:
    """The grid, exact at its points if that is good enough, and fitted to what is around them if not."""
    found = []
    for area in {"auto": (False, True), "nodes": (False,), "area": (True,)}[fit]:
        volume = Volume.of(request.machine, AXES, request.space, request.tool_length, area)
        volume.written = written
        found.append(search(volume, AIM * request.target, [SIDE] * 3, SIDE**3))
        if found[-1].reached:
            break
    return min(found, key=lambda mesh: mesh.left)


def _rounded(grid: Grid, largest: int, unit: float) -> Grid:
    """What whole numbers make of it."""
    quantum = _magnification(grid.values, largest * unit) * unit
    return replace(grid, values=np.rint(grid.values / quantum) * quantum)


def _style(settings: Mapping[str, str]) -> Style:
    first, largest = (settings[key] for key in ("first_number", "largest"))
    if sorted(settings["order"]) != list(AXES):
        raise UsageError.of("NCF485", f"order={settings['order']}", hint="XYZ, ZYX, ...: each axis once")
    if not (first.isascii() and first.isdigit() and largest.isascii() and largest.isdigit() and int(largest) > 0):
        text = f"first_number={first}, largest={largest}"
        raise UsageError.of("NCF485", text, hint="whole numbers")
    if settings["fit"] not in ("auto", "nodes", "area"):
        raise UsageError.of("NCF485", f"fit={settings['fit']}", hint="auto, nodes or area")
    template = settings["template"]
    try:
        template.format(no=1, dx=1, dy=1, dz=1, x=0.0, y=0.0, z=0.0)
    except (KeyError, ValueError, IndexError) as error:
        raise UsageError.of("NCF485", f"template={template}", hint=f"like {TEMPLATE}") from error
    if template and not all(f"{{{name}" in template for name in ("dx", "dy", "dz")):
        raise UsageError.of("NCF485", f"template={template}", hint="it needs {dx}, {dy} and {dz}")
    return Style(int(first), settings["order"], int(largest), template)


def _unit(text: str) -> float:
    try:
        found = float(text)
    except ValueError:
        found = math.nan
    if not 0.001 <= found <= 10:
        raise UsageError.of("NCF485", f"detection_unit_um={text}", hint="um, from 0.001 to 10")
    return found / 1000
