"""How the grid over X, Y and Z is filled: exact, fitted or in the middle, in whole numbers, play apart."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ncfix.diagnostics import RefusedError
from ncfix.tables.axis_tables import reversal_note
from ncfix.tables.control import Least, Request, wrong_setting
from ncfix.tables.grid import Array, Grid
from ncfix.tables.lower_bounds import least_of_even_nodes, least_of_functions
from ncfix.tables.volume import AIM, Mesh, Volume, search
from ncfix_fanuc.backlash import Backlash
from ncfix_fanuc.placing import Placing, anchors
from ncfix_fanuc.records import MOST_MAGNIFICATION, SIDE, TEXT, Style, Volc, check_template
from ncfix_fanuc.units import sense_of

AXES = ("X", "Y", "Z")
TEMPLATE = "N{no}A1P{dx}A2P{dy}A3P{dz};"
FITS = {"auto": (False, True), "nodes": (False,), "area": (True,)}
SAID = {
    "zero": "The grid is that of rotary axes at zero; at other angles more is left (rotary=middle shares it out).",
    "middle": "The grid lies in the middle of what all angles of the rotary axes ask for, and is exact at none.",
}
LEVEL = 0.1
"""Of the target: where less changes towards an end of the travel, the edge of the grid may hold."""


@dataclass(frozen=True, slots=True)
class GridFilling:
    """What a grid is made of.

    sign  "correction" or "error"
    unit  detection unit, mm
    reference  machine coordinates of the reference position, mm
    """

    request: Request
    sign: str
    unit: float
    style: Style
    backlash: Backlash
    fit: str
    rotary: str
    reference: tuple[float, ...]

    @classmethod
    def of(cls, request: Request, settings: Mapping[str, str]) -> GridFilling:
        """From the settings; raises `UsageError` NCF485 and `RefusedError` NCF484."""
        if not set(AXES) <= set(request.machine.axis_names):
            text = f"the grid is over X, Y and Z; the machine has {' '.join(request.machine.axis_names)}"
            raise RefusedError.of("NCF484", text, hint="correct its programs instead: ncfix fix")
        sign = settings["sign"]
        unit = float(settings["detection_unit_um"]) / 1000
        fit, rotary = settings["fit"], settings["rotary"]
        style, reference = _style(settings), anchors(request, settings, AXES)
        return cls(request, sign, unit, style, Backlash.of(request, settings, unit), fit, rotary, reference)

    def volc(self) -> tuple[Volc, Mesh]:
        """The grid in whole numbers, and what it misses."""
        mesh = self._searched()
        order = [mesh.grid.outputs.index(axis) for axis in AXES]
        values = mesh.grid.values[..., order]
        magnification = _magnification(values, self.style.largest * self.unit)
        if magnification > MOST_MAGNIFICATION:
            text = f"a value of {float(np.abs(values).max()):.3f} mm needs a magnification of {magnification}"
            hint = f"the control takes {MOST_MAGNIFICATION}; a larger detection unit, or is the error in mm?"
            raise RefusedError.of("NCF484", text, hint=hint)
        whole = np.rint(sense_of(self.sign) * values / (magnification * self.unit)).astype(np.int64)
        placing = Placing.of(self.reference, mesh.grid.nodes)
        step = tuple(round(float(line[1] - line[0]), 6) for line in mesh.grid.nodes)
        return Volc(self.sign, placing.first(step), step, self.unit, magnification, whole, self.style, placing), mesh

    def _searched(self) -> Mesh:
        """Exact at its points if that will do, or fitted to what is around them, with points only where it bends."""
        first, *more = FITS[self.fit]
        found = [self._mesh(first, False)]
        if not found[0].reached:
            found.append(self._mesh(more[0] if more else first, True))
        return found[-1] if found[-1].reached else min(found, key=lambda mesh: mesh.left)

    def _mesh(self, area: bool, trimmed: bool) -> Mesh:
        volume = self._volume(area)
        for index in range(len(AXES)) if trimmed else ():
            volume = volume.trimmed(index, LEVEL * self.request.target)
        return search(volume, AIM * self.request.target, [SIDE] * 3, SIDE**3)

    def _volume(self, area: bool = False) -> Volume:
        request = self.request
        of = Volume.over_all if self.rotary == "middle" else Volume.of
        volume = of(request.machine, AXES, request.space, request.tool_length, area)
        shift = self.backlash.shift(self.unit)[[AXES.index(axis) for axis in volume.outputs]]
        exact = volume.exact
        rounded = self._rounded
        return replace(volume, exact=lambda places: exact(places) + shift, written=rounded, anchors=self.reference)

    def _rounded(self, grid: Grid) -> Grid:
        """What whole numbers make of it."""
        quantum = _magnification(grid.values, self.style.largest * self.unit) * self.unit
        return replace(grid, values=np.rint(grid.values / quantum) * quantum)

    def least(self) -> Least:
        """What no grid over X, Y and Z could do better."""
        request, play = self.request, any(self.backlash.amounts)
        return least_of_functions(request.machine, request.space, request.tool_length, AXES, play)

    def _even(self, mesh: Mesh) -> Iterator[str]:
        """Of a target that is not reached, why, if it is for want of points."""
        covered = np.array([[line[0], line[-1]] for line in mesh.grid.nodes])
        for index, count in enumerate(mesh.grid.counts):
            if count == SIDE:
                yield least_of_even_nodes(replace(self._volume(), covered=covered), index, SIDE).sentence

    def notes(self, volc: Volc, mesh: Mesh) -> Iterator[str]:
        """What was made, and what is left."""
        request, style = self.request, self.style
        counts = " x ".join(map(str, mesh.grid.counts))
        missed = f"it misses {1e3 * mesh.left:.2f} um at most, rounding included"
        yield f"Grid {counts}: {mesh.grid.points} points; {missed}."
        if volc.placing is not None:
            yield from volc.placing.notes(AXES, mesh.grid.counts, volc.step, "mm")
        rounding = volc.magnification * self.unit / 2
        yield f"Magnification {volc.magnification}: a value is rounded by up to {1e3 * rounding:.2f} um."
        if rounding > request.target:
            cure = f"values have {style.largest} steps only" if volc.magnification > 1 else "a smaller unit would help"
            yield f"The rounding is larger than the target: {cure}."
        if mesh.left > request.target:
            yield f"The target of {1e3 * request.target:g} um is not reached with {SIDE} points an axis."
            yield from self._even(mesh)
        yield from self._outside(mesh)
        yield from self.backlash.notes(self.unit)
        done = self.backlash.tables(self.unit)
        yield from reversal_note(request.machine, request.space, request.tool_length, done)
        if request.machine.rotary.any():
            yield SAID[self.rotary]
        if style.template:
            yield f"{TEXT} is a guess at the control's own file (FANUC-5): compare it with a punched one first."

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


def _style(settings: Mapping[str, str]) -> Style:
    first, largest = int(settings["first_number"]), int(settings["largest"])
    template = settings["template"]
    try:
        if template:
            check_template(template)
    except (ValueError, KeyError, IndexError) as error:
        raise wrong_setting(settings, "template", f"like {TEMPLATE}; {error}") from error
    return Style(first, settings["order"], largest, template, "".join(sorted(settings["home_minus"].upper())))
