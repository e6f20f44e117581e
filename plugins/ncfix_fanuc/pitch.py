"""Stored pitch error compensation of Fanuc controls: increments of one axis over itself.

The values are small whole numbers, the changes of the correction from one point to the next. They are rounded so that
their sum is never off by more than half a step: the rounding error is carried from point to point.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ncfix.arrays import Array, Ints
from ncfix.diagnostics import Message, RefusedError
from ncfix.tables.axis_tables import positioning
from ncfix.tables.compensation import Compensation
from ncfix.tables.control import Assumption, FileControl, Files, Option, Properties, Request, Written, whole
from ncfix.tables.grid import Grid
from ncfix.tables.lower_bounds import least_of_own_axis
from ncfix.tables.table_files import DEGREE, TURNING, Remarks, in_order, messages_of, unit_of
from ncfix_fanuc.parameters import (
    PLACING_OPTIONS,
    UNITS,
    is_records,
    parameter_text,
    read_records,
    references,
    sense_of,
    sign_option,
    units_of,
)
from ncfix_fanuc.pitch_files import (
    LARGEST_INCREMENT,
    MOST_PITCH_MAGNIFICATION,
    MOST_POINTS,
    NUMBERS,
    PARAMETERS,
    SETTINGS,
    Pitch,
    is_increments,
    pitch_text,
    read_increments,
    read_pitches,
)

MOST_NUMBER = 9999
"""Largest number of a point, beyond that of any control."""
THOUSANDTHS = 360_000
"""Number of thousandths of a degree in a turn."""


class FanucPitch(FileControl):
    """The control `fanuc-pitch`."""

    name = "fanuc-pitch"
    title = "Fanuc stored pitch error compensation"
    reaches = "L-POS"
    properties = Properties(
        value_sign="as --set sign says",
        input_signal="setpoint",
        position_frame="the reference position (PITCH-4)",
        unit="detection unit times magnification, increments",
        quantum=(1e-4, 1e-4 * DEGREE),
        extrapolation="the sum up to the first or last point is held",
        bidirectional=False,
        max_points=MOST_POINTS,
        max_tables=9,
        combine="one for each axis",
    )
    assumptions = (
        Assumption(
            "PITCH-1",
            "The sign of the values is what --set sign says.",
            "none public",
            "none: it must be given",
            "Load +7 at one point: does the axis go farther (correction) or less far (error) beyond it?",
        ),
        Assumption(
            "PITCH-2",
            "The sum of the increments changes along a straight line from point to point.",
            "none public; without the interpolation function the control may add each increment at once",
            "so",
            "Move past a point in steps of the detection unit and watch the position error of the servo.",
        ),
        Assumption(
            "PITCH-3",
            "Parameters 3620 to 3625, punched as N..A1P..A2P.., are those of this control; its axes are counted in "
            "the order X Y Z A B C U V W of those that the machine has, and lengths are in mm.",
            "B-63330EN (15i), B-63980EN",
            "so",
            "Punch the parameters of the control and compare the form; parameter 1020 has the names of the axes, and "
            "1001#0 (INM) is 1 on a machine in inches: the interval (3624) is in inches there.",
        ),
        Assumption(
            "PITCH-4",
            "The reference position of every axis is machine zero, unless --set reference says otherwise.",
            "points count from the reference position (3620)",
            "so",
            "Parameter 1240 is the machine coordinate of the reference position.",
        ),
    )
    options: ClassVar[Mapping[str, Option]] = {
        "sign": sign_option("PITCH-1"),
        **UNITS,
        **PLACING_OPTIONS,
        "first_number": Option("1", "number of the first point that is free on the control", whole(0, MOST_NUMBER)),
    }
    steps = (
        "Check PITCH-1 on the machine.",
        "Save parameters and pitch data; set parameter 3605#0 to 0 (one table for both ways).",
        "See that no axis which is not written here uses the point numbers below (its 3621 to 3622): "
        "--set first_number=... begins behind them.",
        "Set the parameters of parameters.txt, switch power off and on (alarm PW1102 tells of wrong point numbers). "
        "Axes that are not in it keep theirs.",
        "Type in the increments of the pitch_*.csv files at the numbers given.",
        "Home all axes and measure one again: the error must have become smaller, not twice as large.",
    )
    switch_off = "Set the magnification (3623) to 0."

    def write(self, request: Request) -> Written:
        """The increments of every axis that needs a correction, and the parameters."""
        settings = self.settings(request.settings)
        sense, units = sense_of(settings["sign"]), units_of(settings)
        axes, turning = in_order(request.machine), {axis.name for axis in request.machine.axes if axis.rotary}
        tables, notes = curves(request), []
        found: list[Pitch] = []
        places = references(request, settings)
        for axis in axes:
            number = found[-1].last + 1 if found else int(settings["first_number"])
            step, at = sense * units[int(axis in turning)], places.get(axis, 0.0)
            made = pitch_of(request, axis, tables.get(axis, ()), step, number, at)
            if made is not None:
                found.append(made)
                notes.append(_said(made, units))
            elif axis in tables:
                notes.append(_unsaid(axis, at_reference(tables[axis], at)))
        files = {f"pitch_{each.axis}.csv": pitch_text(each) for each in found}
        if found:
            files[PARAMETERS] = parameter_text(_parameters(found, axes))
        words = [settings["sign"], settings["detection_unit_um"], settings["detection_unit_deg"], "".join(axes)]
        words += [f"{axis}{at!r}" for axis, at in places.items()]
        files[SETTINGS] = (" ".join(words) + "\n").encode()
        notes.append(
            "The opposite direction needs its own table (3605#0); the values written are the mean of both directions."
        )
        notes.append(f"{SETTINGS} is for ncfix emulate only; the control does not read it.")
        least = least_of_own_axis(request.machine, request.space, request.tool_length)
        return Written(files, tuple(notes), least)

    def examined(self, files: Files) -> tuple[Compensation, list[Remarks]]:
        """The increments, as the control sums them up."""
        terms, remarks = read_pitches(files)
        return Compensation(terms), remarks

    def knows(self, name: str, content: bytes) -> bool:
        """Increments by point number, or records of parameters."""
        return is_increments(content) or is_records(content)

    def look(self, files: Files) -> tuple[Message, ...]:
        """See `Control`; without the settings file of ncfix, every file is checked on its own."""
        if SETTINGS in files:
            return self.lint(files)
        found = []
        for name, content in sorted(files.items()):
            found.append(Remarks.of(name, content, "#"))
            read_increments(found[-1]) if is_increments(content) else list(read_records(found[-1]))
        return messages_of(found)


def _said(pitch: Pitch, units: tuple[float, float]) -> str:
    rotary = pitch.axis in TURNING
    half = 0.5 * pitch.magnification * (units[1] / DEGREE if rotary else 1000 * units[0])
    unit = "degree" if rotary else "um"
    return (
        f"{pitch.axis}: points {pitch.first} to {pitch.last}, magnification {pitch.magnification}: a sum is rounded by "
        f"up to {half:.4g} {unit}, however many increments it has."
    )


def _unsaid(axis: str, correction: float) -> str:
    """The note why an axis with errors gets no points."""
    rotary = axis in TURNING
    size = f"{correction / DEGREE:.4g} degree" if rotary else f"{1000 * correction:.1f} um"
    return (
        f"{axis}: no points are written. Increments count from the reference position, where the correction is "
        f"{size}; without that part they correct nothing. Shift the reference position by this amount, and measure "
        "the axis again."
    )


def _parameters(pitches: list[Pitch], axes: tuple[str, ...]) -> dict[int, dict[int, float]]:
    """Parameter number -> number of an axis -> value, for axes that have points."""
    rows: dict[int, dict[int, float]] = {number: {} for number in NUMBERS.values()}
    for each in pitches:
        values = (each.reference, each.first, each.last, each.magnification, each.interval, each.turn)
        for number, value in zip(NUMBERS.values(), values, strict=True):
            rows[number][axes.index(each.axis) + 1] = float(value)
    return rows


def curves(request: Request) -> dict[str, tuple[Grid, ...]]:
    """Letter -> corrections of the axis over itself: forward and, if it differs, reverse."""
    tables = positioning(request.machine, request.space, request.tool_length, MOST_POINTS - 1, request.target)
    found: dict[str, tuple[Grid, ...]] = {}
    for term in tables.terms:
        found[term.outputs[0]] = (*found.get(term.outputs[0], ()), term.factors[0])
    return found


def at_reference(tables: tuple[Grid, ...], at: float) -> float:
    """The correction at the reference position `at` (mm or degree), mm or rad, which increments cannot represent."""
    place = np.array([[at * unit_of(tables[0].inputs[0])]])
    return float(np.mean([table.at(place)[0, 0] for table in tables]))


def pitch_of(
    request: Request, axis: str, tables: tuple[Grid, ...], step: float, number: int, at: float
) -> Pitch | None:
    """The increments of an axis; the number of points is doubled while that lowers the magnification.

    step    change of the correction by a detection unit, mm or rad; negative if increments are errors
    number  the first free point number
    at      the reference position, mm or degree
    """
    if not tables:
        return None
    cells = len(tables[0].nodes[0]) - 1
    best = _with_cells(request, axis, tables, step, number, cells, at)
    while best is not None and best.magnification > 1 and 2 * cells < MOST_POINTS - 1:
        cells *= 2
        best = _with_cells(request, axis, tables, step, number, cells, at)
    return best


def _with_cells(
    request: Request, axis: str, tables: tuple[Grid, ...], step: float, number: int, cells: int, at: float
) -> Pitch | None:
    """The increments with about `cells` intervals; None if they do not make the axis better.

    The correction at the reference position cannot be represented. Points are numbered so that the number of the
    reference position is not negative. The first and the last point of a turn are the same place, and have the same
    value (B-63980EN, p. 100). A turn has a whole number of intervals of whole thousandths of a degree, because the
    control counts in these. An outermost point beyond the travel gets the value that makes the end of the travel right.
    """
    column = request.machine.axis_names.index(axis)
    described = request.machine.axes[column]
    low, high = (request.space[column] / described.unit).tolist()
    turn = 360.0 if described.endless else 0.0
    while turn and cells < MOST_POINTS - 1 and THOUSANDTHS % cells:
        cells += 1
    interval = 360.0 / cells if turn else math.ceil((high - low) / cells * 1000) / 1000
    first, last = (0, cells) if turn else _ends(low - at, high - at, interval)
    if last - first + 1 > MOST_POINTS:
        raise RefusedError.of(
            "NCF484", f"{axis} needs {last - first + 1} points, but the control has {MOST_POINTS} for an axis"
        )
    places = (at + np.arange(first, last + 1) * interval) * described.unit
    lowest, highest = request.space[column]
    inside = lowest + np.mod(places - lowest, 2 * np.pi) if turn else np.clip(places, lowest, highest)
    mean = np.mean([table.at(inside[:, None])[:, 0] for table in tables], axis=0)
    for end, next_ in () if turn else ((0, 1), (-1, -2)):
        slope = (mean[end] - mean[next_]) / (inside[end] - inside[next_])
        mean[end] += slope * (places[end] - inside[end])
    curve: Array = mean - at_reference(tables, at)
    if turn:
        curve[-1] = curve[0]
    increments, magnification = diffused(curve / step)
    if not increments.any() or np.mean((mean - curve) ** 2) > np.mean(mean**2):
        return None
    if turn:
        increments[0] = increments[-1]
    number = max(number, first)
    return Pitch(axis, number, increments, number - first, magnification, interval, turn, at)


def _ends(low: float, high: float, interval: float) -> tuple[int, int]:
    """The first and last whole number of intervals from the reference position that enclose a range."""
    first = math.floor(low / interval + 1e-9)
    return first, max(math.ceil(high / interval - 1e-9), first + 1)


def diffused(curve: Array) -> tuple[Ints, int]:
    """Increments from -7 to 7 whose sums follow a curve (detection units) within half a step, and the magnification.

    The first increment, which leads to the first point, is 0: sums count from the reference position, where the curve
    is zero.
    """
    magnification = 1
    while True:
        steps = np.rint(curve / magnification)
        increments = np.diff(steps, prepend=steps[0]).astype(np.int64)
        if np.abs(increments).max() <= LARGEST_INCREMENT:
            return increments, magnification
        magnification += 1
        if magnification > MOST_PITCH_MAGNIFICATION:
            text = f"a pitch error needs a magnification above {MOST_PITCH_MAGNIFICATION}"
            raise RefusedError.of("NCF484", text, hint="check that the error is in mm")
