"""Three-dimensional error compensation of Fanuc Series 30i: a grid of corrections over X, Y and Z.

The interpolation (A-79351E, trilinear in the control's current position), the size (25 x 25 x 25) and the record of the
FOCAS library are public. The control's own text file is not: one is written only if a template is given, and its name
says that it is assumed. The sign, which would double the error if guessed wrongly, must be given: `--set sign=...`. The
grid is filled exactly, by least squares, or in the middle of the corrections of all angles of rotary axes; in whole
numbers, with backlash compensated separately.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnostics import RefusedError
from ncfix.tables.axis_tables import reversal_note
from ncfix.tables.compensation import Compensation, Term
from ncfix.tables.control import (
    Assumption,
    FileControl,
    Files,
    Least,
    Option,
    Properties,
    Request,
    SettingForm,
    Written,
    one_of,
    whole,
    wrong_setting,
)
from ncfix.tables.grid import Grid
from ncfix.tables.lower_bounds import least_of_even_nodes, least_of_functions
from ncfix.tables.table_files import Remarks
from ncfix.tables.volume import AIM, Mesh, Volume, search, unseen_axes
from ncfix.values import frozen
from ncfix_fanuc.parameters import (
    BACKLASH_ASSUMPTION,
    BACKLASH_OPTIONS,
    BACKLASH_STEP,
    LINEAR,
    PLACING_OPTIONS,
    PLACING_STEP,
    UNITS,
    BacklashAmounts,
    Placing,
    anchors,
    placing_assumption,
    read_backlash,
    sense_of,
    sign_option,
)
from ncfix_fanuc.records import (
    MOST_GRID_MAGNIFICATION,
    MOST_NUMBER,
    SIDE,
    VOLUME_CSV,
    VOLUME_JSON,
    VOLUME_TEXT,
    PointNumbering,
    Volc,
    check_template,
    csv_text,
    json_text,
    read_volc,
    template_text,
)

ORDER_FORM = SettingForm("XYZ, ZYX, ...: each axis once", lambda text: sorted(text) == list(LINEAR))
TEMPLATE = "N{no}A1P{dx}A2P{dy}A3P{dz};"
FITS = {"auto": (False, True), "nodes": (False,), "area": (True,)}
ROTARY_NOTES = {
    "zero": "The grid is exact with {} at zero; at other angles the remaining error is larger (rotary=middle "
    "distributes it).",
    "middle": "The grid is the middle of the corrections at all positions of {}, and exact at none.",
}
LEVEL = 0.1
"""Share of the target: an end of the travel with a smaller change need not be covered, because the edge value holds."""


class Fanuc(FileControl):
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
        extrapolation="the value of the outermost node is assumed to hold (FANUC-4)",
        bidirectional=True,
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
        BACKLASH_ASSUMPTION,
        placing_assumption("FANUC-7"),
    )
    options: ClassVar[Mapping[str, Option]] = {
        "sign": sign_option("FANUC-1"),
        "detection_unit_um": UNITS["detection_unit_um"],
        "largest": Option("127", "largest value of a point", whole(1, MOST_NUMBER)),
        "order": Option("XYZ", "the axes from the one whose number runs fastest", ORDER_FORM),
        "first_number": Option("1", "number of the first point", whole(0, MOST_NUMBER)),
        "template": Option("", f"a line of the text file, ASSUMED, e.g. {TEMPLATE}"),
        "fit": Option(
            "auto",
            "nodes: exact at the points; area: least squares around them; auto: area where nodes have the larger error",
            one_of(*FITS),
        ),
        "rotary": Option(
            "zero",
            "zero: exact with the rotary axes at zero; middle: between what all their angles ask for",
            one_of(*ROTARY_NOTES),
        ),
        **PLACING_OPTIONS,
        **BACKLASH_OPTIONS,
    }
    steps = (
        "Check the assumptions below on the machine, the sign first.",
        PLACING_STEP,
        "Set the magnification as volume.json has it.",
        "Write the records of volume.json with cnc_wrvolc, or type in volume.csv.",
        BACKLASH_STEP,
        "Switch power off and on, home all axes.",
        "Read cnc_rdvolccomp at one pose and compare it with volume.csv.",
        "Measure one line again: the error must have become smaller, not twice as large.",
    )
    switch_off = (
        "Switch the function off by its parameter, or set the magnification to zero; give parameter 1851 its old "
        "values if backlash.txt was there. Power off and on, home all axes."
    )

    def write(self, request: Request) -> Written:
        """`volume.json` with the FOCAS records, the same as `volume.csv`, as text on request, and the backlash file."""
        made = GridFilling.of(request, self.settings(request.settings))
        volc, mesh = made.volc()
        files = {VOLUME_JSON: json_text(volc), VOLUME_CSV: csv_text(volc), **made.backlash.files()}
        if volc.style.template:
            files[VOLUME_TEXT] = template_text(volc)
        return Written(files, tuple(made.notes(volc, mesh)), made.least())

    def examined(self, files: Files) -> tuple[Compensation | None, list[Remarks]]:
        """The grid, as the control would interpolate it, and the backlash compensation."""
        volc, remarks = read_volc(files)
        backlash, more = read_backlash(files, volc.style.home_minus if volc else "")
        if volc is None:
            return None, [remarks, *more]
        return Compensation((Term((volc.grid(),)), *backlash.tables(volc.unit).terms)), [remarks, *more]

    def knows(self, name: str, content: bytes) -> bool:
        """Records of the grid as ncfix writes them."""
        return name.lower() in (VOLUME_JSON, VOLUME_CSV) or (content.lstrip()[:1] == b"{" and b'"start_no"' in content)


@frozen
class GridFilling:
    """The task of filling a grid.

    sign       "correction" or "error"
    unit       detection unit, mm
    fit        way to fill it: "nodes", "area" or "auto", see the option
    rotary     angles of rotary axes: "zero" or "middle", see the option
    reference  machine coordinates of the reference position, mm
    """

    request: Request
    sign: str
    unit: float
    style: PointNumbering
    backlash: BacklashAmounts
    fit: str
    rotary: str
    reference: tuple[float, ...]

    @classmethod
    def of(cls, request: Request, settings: Mapping[str, str]) -> GridFilling:
        """From the settings; raises `UsageError` NCF485 and `RefusedError` NCF484."""
        if not set(LINEAR) <= set(request.machine.axis_names):
            text = f"the grid is over X, Y and Z; the machine has {' '.join(request.machine.axis_names)}"
            raise RefusedError.of("NCF484", text, hint="correct the programs instead: ncfix fix")
        sign = settings["sign"]
        unit = float(settings["detection_unit_um"]) / 1000
        fit, rotary = settings["fit"], settings["rotary"]
        style, reference = _style(settings), anchors(request, settings, LINEAR)
        return cls(request, sign, unit, style, BacklashAmounts.of(request, settings, unit), fit, rotary, reference)

    def volc(self) -> tuple[Volc, Mesh]:
        """The grid in whole numbers, and the grid before rounding with its error."""
        mesh = self._searched()
        order = [mesh.grid.outputs.index(axis) for axis in LINEAR]
        values = mesh.grid.values[..., order]
        magnification = _magnification(values, self.style.largest * self.unit)
        if magnification > MOST_GRID_MAGNIFICATION:
            text = f"a value of {float(np.abs(values).max()):.3f} mm needs a magnification of {magnification}"
            hint = (
                f"the control takes at most {MOST_GRID_MAGNIFICATION}; use a larger detection unit, or check that "
                "the error is in mm"
            )
            raise RefusedError.of("NCF484", text, hint=hint)
        whole = np.rint(sense_of(self.sign) * values / (magnification * self.unit)).astype(np.int64)
        placing = Placing.of(self.reference, mesh.grid.nodes)
        step = tuple(round(float(line[1] - line[0]), 6) for line in mesh.grid.nodes)
        return Volc(self.sign, placing.first(step), step, self.unit, magnification, whole, self.style, placing), mesh

    def _searched(self) -> Mesh:
        """The grid: exact at its points if that reaches the target, else fitted around them and trimmed at its ends."""
        first, *more = FITS[self.fit]
        found = [self._mesh(first, False)]
        if not found[0].reached:
            found.append(self._mesh(more[0] if more else first, True))
        return found[-1] if found[-1].reached else min(found, key=lambda mesh: mesh.left)

    def _mesh(self, area: bool, trimmed: bool) -> Mesh:
        volume = self._volume(area)
        for index in range(len(LINEAR)) if trimmed else ():
            volume = volume.trimmed(index, LEVEL * self.request.target)
        return search(volume, AIM * self.request.target, [SIDE] * 3, SIDE**3)

    def _volume(self, area: bool = False) -> Volume:
        request = self.request
        of = Volume.over_all if self.rotary == "middle" else Volume.of
        volume = of(request.machine, LINEAR, request.space, request.tool_length, area)
        shift = self.backlash.shift(self.unit)[[LINEAR.index(axis) for axis in volume.outputs]]
        exact = volume.exact
        rounded = self._rounded
        return replace(volume, exact=lambda places: exact(places) + shift, written=rounded, anchors=self.reference)

    def _rounded(self, grid: Grid) -> Grid:
        """The grid with its values rounded to whole numbers."""
        quantum = _magnification(grid.values, self.style.largest * self.unit) * self.unit
        return replace(grid, values=np.rint(grid.values / quantum) * quantum)

    def least(self) -> Least:
        """The least error that any grid over X, Y and Z could leave."""
        request, play = self.request, any(self.backlash.amounts)
        return least_of_functions(request.machine, request.space, request.tool_length, LINEAR, play)

    def _even(self, mesh: Mesh) -> Iterator[str]:
        """Sentences about axes whose number of points keeps the target from being reached."""
        covered = np.array([[line[0], line[-1]] for line in mesh.grid.nodes])
        for index, count in enumerate(mesh.grid.counts):
            if count == SIDE:
                yield least_of_even_nodes(replace(self._volume(), covered=covered), index, SIDE).sentence

    def notes(self, volc: Volc, mesh: Mesh) -> Iterator[str]:
        """Notes: the grid, and the error that is left."""
        request, style = self.request, self.style
        counts = " x ".join(map(str, mesh.grid.counts))
        missed = f"its error is {1e3 * mesh.left:.2f} um at most, rounding included"
        yield f"Grid {counts}: {mesh.grid.points} points; {missed}."
        if volc.placing is not None:
            yield from volc.placing.notes(LINEAR, mesh.grid.counts, volc.step, "mm")
        rounding = volc.magnification * self.unit / 2
        yield f"Magnification {volc.magnification}: a value is rounded by up to {1e3 * rounding:.2f} um."
        if rounding > request.target:
            cure = (
                f"values have {style.largest} steps only"
                if volc.magnification > 1
                else ("use a smaller detection unit")
            )
            yield f"The rounding is larger than the target: {cure}."
        if mesh.left > request.target:
            yield f"The target of {1e3 * request.target:g} um is not reached with {SIDE} points an axis."
            yield from self._even(mesh)
        yield from self._outside(mesh)
        yield from self.backlash.notes(self.unit)
        done = self.backlash.tables(self.unit)
        yield from reversal_note(request.machine, request.space, request.tool_length, done)
        if others := unseen_axes(request.machine, request.space, request.tool_length, LINEAR):
            yield ROTARY_NOTES[self.rotary].format(others)
        if style.template:
            yield f"{VOLUME_TEXT} is a guess at the control's own file (FANUC-5): compare it with a punched one first."

    def _outside(self, mesh: Mesh) -> Iterator[str]:
        for axis, line in zip(mesh.grid.inputs, mesh.grid.nodes, strict=True):
            low, high = self.request.space[self.request.machine.axis_names.index(axis)].tolist()
            if line[0] > low + 1e-6 or line[-1] < high - 1e-6:
                yield (
                    f"The grid goes from {axis}{line[0]:g} to {axis}{line[-1]:g} only, since little changes beyond: "
                    "there the control must hold the value of the edge (FANUC-4)."
                )


def _magnification(values: Array, largest: float) -> int:
    return max(1, math.ceil(float(np.abs(values).max()) / largest - 1e-9))


def _style(settings: Mapping[str, str]) -> PointNumbering:
    first, largest = int(settings["first_number"]), int(settings["largest"])
    template = settings["template"]
    try:
        if template:
            check_template(template)
    except (ValueError, KeyError, IndexError) as error:
        raise wrong_setting(settings, "template", f"like {TEMPLATE}; {error}") from error
    return PointNumbering(first, settings["order"], largest, template, "".join(sorted(settings["home_minus"].upper())))
