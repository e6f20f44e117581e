"""Stored pitch error compensation of Fanuc controls: increments of one axis over itself.

The values are small whole numbers, each what is added on the way from one point to the next. They are rounded so that
their sum is never off by more than half a step: the rounding error is carried along, not thrown away at every point.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ncfix.diagnostics import Message
from ncfix.tables.compensation import Compensation
from ncfix.tables.control import Assumption, Control, Files, Option, Properties, Request, Written
from ncfix.tables.lower_bounds import least_of_own_axis
from ncfix.tables.table_files import DEGREE, TURNING, Remarks, in_order
from ncfix_fanuc.increments import at_zero, curves, pitch_of
from ncfix_fanuc.pitch_reading import PARAMETERS, SETTINGS, read_pitches
from ncfix_fanuc.pitch_text import (
    MOST,
    NUMBERS,
    Pitch,
    is_increments,
    is_records,
    parameter_text,
    pitch_text,
    read_increments,
    read_records,
)
from ncfix_fanuc.units import UNITS, sense_of, sign_option, units_of

FIRST_NUMBER = 1


class FanucPitch(Control):
    """The control `fanuc-pitch`."""

    name = "fanuc-pitch"
    title = "Fanuc stored pitch error compensation"
    reaches = "L-POS"
    properties = Properties(
        value_sign="as --set sign says",
        input_signal="setpoint",
        position_frame="reference position: machine zero",
        unit="detection unit times magnification, increments",
        quantum=(1e-4, 1e-4 * DEGREE),
        extrapolation="the sum up to the first or last point is held",
        bidirectional=False,
        max_points=MOST,
        max_tables=9,
        combine="one for each axis",
    )
    assumptions = (
        Assumption(
            "PITCH-1",
            "The sign of the values is what --set sign says.",
            "none of the public pages says it",
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
            "Parameters 3620 to 3625 and the punched form N..A1P..A2P.. are those of this control.",
            "B-63330EN (15i), B-63980EN",
            "so",
            "Punch the parameters of the control and compare the form.",
        ),
    )
    options: ClassVar[Mapping[str, Option]] = {
        "sign": sign_option("PITCH-1"),
        **UNITS,
    }
    steps = (
        "Settle PITCH-1 on the machine.",
        "Save parameters and pitch data; set parameter 3605#0 to 0 (one table for both ways).",
        "Set the parameters of parameters.txt, switch power off and on (alarm PW1102 tells of wrong point numbers).",
        "Type in the increments of the pitch_*.csv files at the numbers given.",
        "Home all axes and measure one again: the error must have become smaller, not twice as large.",
    )
    switch_off = "Set the magnification (3623) to 0."

    def write(self, request: Request) -> Written:
        """The increments of every axis that has something to correct, and the parameters."""
        settings = self.settings(request.settings)
        sense, units = sense_of(settings["sign"]), units_of(settings)
        axes, turning = in_order(request.machine), {axis.name for axis in request.machine.axes if axis.rotary}
        tables, notes = curves(request), []
        found: list[Pitch] = []
        for axis in axes:
            number = found[-1].last + 1 if found else FIRST_NUMBER
            made = pitch_of(request, axis, tables.get(axis, ()), sense * units[int(axis in turning)], number)
            if made is not None:
                found.append(made)
                notes.append(_said(made, units))
            elif axis in tables:
                notes.append(_unsaid(axis, at_zero(tables[axis])))
        files = {f"pitch_{each.axis}.csv": pitch_text(each) for each in found}
        files[PARAMETERS] = parameter_text(_parameters(found, axes))
        words = (settings["sign"], settings["detection_unit_um"], settings["detection_unit_deg"], "".join(axes))
        files[SETTINGS] = (" ".join(words) + "\n").encode()
        notes.append("The way back needs a table of its own (3605#0); what is written is the mean of both ways.")
        notes.append(f"{SETTINGS} is for ncfix emulate only; the control does not read it.")
        least = least_of_own_axis(request.machine, request.space, request.tool_length)
        return Written(files, tuple(notes), least)

    def read(self, files: Files) -> Compensation:
        """As the control sums them up. Raises `ConfigError` NCF491."""
        terms, remarks = read_pitches(files)
        for each in remarks:
            each.check()
        return Compensation(terms)

    def lint(self, files: Files) -> tuple[Message, ...]:
        """Values beyond the range, point numbers that do not fit, turns that do not close."""
        return tuple(message for each in read_pitches(files)[1] for message in each.messages)

    def knows(self, name: str, content: bytes) -> bool:
        """Increments by point number, or records of parameters."""
        return is_increments(content) or is_records(content)

    def look(self, files: Files) -> tuple[Message, ...]:
        """The same; without what ncfix writes of sign and units, every file by itself."""
        if SETTINGS in files:
            return self.lint(files)
        found = []
        for name, content in sorted(files.items()):
            found.append(Remarks.of(name, content, "#"))
            read_increments(found[-1]) if is_increments(content) else list(read_records(found[-1]))
        return tuple(message for each in found for message in each.messages)


def _said(pitch: Pitch, units: tuple[float, float]) -> str:
    rotary = pitch.axis in TURNING
    half = 0.5 * pitch.magnification * (units[1] / DEGREE if rotary else 1000 * units[0])
    unit = "degree" if rotary else "um"
    return (
        f"{pitch.axis}: points {pitch.first} to {pitch.last}, magnification {pitch.magnification}: a sum is rounded by "
        f"up to {half:.4g} {unit}, however many increments it has."
    )


def _unsaid(axis: str, correction: float) -> str:
    """Why an axis that errs has no points."""
    rotary = axis in TURNING
    size = f"{correction / DEGREE:.4g} degree" if rotary else f"{1000 * correction:.1f} um"
    return (
        f"{axis}: no points. Increments count from machine zero, where the correction is {size}, and without that they "
        f"take nothing off. A reference position that is shifted by it, and an axis that is measured again, help."
    )


def _parameters(pitches: list[Pitch], axes: tuple[str, ...]) -> dict[int, list[float]]:
    by_axis = {each.axis: each for each in pitches}
    rows: dict[int, list[float]] = {number: [] for number in NUMBERS.values()}
    for axis in axes:
        each = by_axis.get(axis)
        values = (
            (each.reference, each.first, each.last, each.magnification, each.interval, each.turn) if each else [0] * 6
        )
        for number, value in zip(NUMBERS.values(), values, strict=True):
            rows[number].append(float(value))
    return rows
