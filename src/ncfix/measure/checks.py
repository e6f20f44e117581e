"""Plausibility of well-formed measurements: impossible contents are errors, odd ones are remarks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ncfix.arrays import Array, Ints
from ncfix.diagnostics import ConfigError, Message
from ncfix.machine import Machine
from ncfix.machine.axes import COMPONENTS
from ncfix.machine.plausible import much
from ncfix.measure.measurement import CENTRE, ENDS, Measurement, component_of, groups

LARGE_MM, LARGE_RAD = 2.0, 0.02
"""Median errors of the tool tip above this are probably in another unit."""
BEYOND_MUCH = 10.0
"""Error motions of one axis above this, in units of a large one (`plausible.much`), are probably in another unit."""
SMALL_MM = 1e-4
"""Errors of one axis that nowhere exceed this, mm, are probably in another unit."""
ROUND_DEG = 1e-6
"""Tolerance of a rounded position, degree."""
RADIAN_SHARE = 0.4
"""Positions that, taken as radians, span more than this share of the travel are probably radians."""
ELSEWHERE = 2.0
"""Largest distance of poses from the circle of a ball-bar, mm: the range of its reading."""
MARK_MM, MARK_RATIO = 999.0, 20.0
"""Smallest deviation, mm, and smallest ratio to the median one, of a number of nines that marks a missing reading."""
UNITS = {"inches": 25.4, "metres": 1000.0}
"""Unit -> mm."""
UNIT_SHARE = 0.8
"""Positions that, in another unit, span more than this share of the travel are probably in that unit."""
BEYOND = 1e-6
"""Tolerance of a travel limit for rounded positions, mm or rad."""


def checked(measurement: Measurement, machine: Machine, lines: Sequence[str] = ()) -> Measurement:
    """The measurement with remarks; raises `ConfigError` with all of NCF610 ... NCF612.

    lines  lines of the file, to be shown with messages
    """
    faults = [*_directions(measurement), *_clock(measurement), *_named(measurement, machine)]
    faults += [*_lengths(measurement), *_marks(measurement)]
    if faults:
        raise ConfigError.collected([_shown(fault, lines) for fault in faults])
    remarks = [
        *_twice(measurement),
        *_radians(measurement, machine),
        *_lengths_in_another_unit(measurement, machine),
        *_ranges(measurement, machine),
        *_micrometres(measurement, machine),
        *_circles(measurement, machine),
    ]
    return replace(measurement, remarks=(*measurement.remarks, *(_shown(each, lines) for each in remarks)))


def _shown(message: Message, lines: Sequence[str]) -> Message:
    """The message with the text of its source line."""
    place = message.place
    if place is None or not 0 < place.line <= len(lines):
        return message
    return replace(message, place=replace(place, text=lines[place.line - 1]))


def _directions(measurement: Measurement) -> Iterator[Message]:
    for name, values in measurement.columns.items():
        if name.startswith("dir_") or name == "direction":
            for row in np.flatnonzero(~np.isin(values, (-1, 0, 1))):
                text = f"{name} is {values[row]:g}, but must be -1, 0 or 1"
                yield Message("NCF612", text, measurement.place(int(row)))


def _clock(measurement: Measurement) -> Iterator[Message]:
    if "time_s" not in measurement.columns:
        return
    time_s = measurement.columns["time_s"]
    _, sets = groups(measurement.sets)
    for index in np.unique(sets):
        rows = np.flatnonzero(sets == index)
        for at in np.flatnonzero(np.diff(time_s[rows]) < 0)[:1]:
            row = int(rows[at + 1])
            text = f"time goes backwards: {time_s[row]:g} s after {time_s[rows[at]]:g} s"
            yield Message("NCF611", text, measurement.place(row), "give the rows after this one another `set`")


def _named(measurement: Measurement, machine: Machine) -> Iterator[Message]:
    if measurement.kind != "axis":
        return
    for row, (axis, component) in enumerate(
        zip(measurement.labels["axis"], measurement.labels["component"], strict=True)
    ):
        if axis not in machine.axis_names:
            has = " ".join(machine.axis_names)
            yield Message("NCF610", f"the machine has no axis {axis}, only {has}", measurement.place(row))
        elif component_of(axis, component) is None:
            text = f"{component!r} is not an error motion of {axis}"
            names = [f"E{each}{axis}" for each in COMPONENTS]
            own = next(filter(machine.is_positioning, names), names[0])
            yield Message("NCF612", text, measurement.place(row), f"for example {own}")


def _lengths(measurement: Measurement) -> Iterator[Message]:
    """NCF612: lengths that are not positive, or whose ends coincide."""
    if measurement.kind != "length":
        return
    for name in ("length", "nominal", "radius"):
        for row in np.flatnonzero(measurement.columns.get(name, np.ones(0)) <= 0):
            text = f"{name} is {measurement.columns[name][row]:g} mm, but a distance must be above zero"
            yield Message("NCF612", text, measurement.place(int(row)))
    if set(ENDS) <= measurement.columns.keys():
        way = measurement.stacked(*ENDS[3:]) - measurement.stacked(*ENDS[:3])
        for row in np.flatnonzero((way == 0).all(axis=1)):
            yield Message("NCF612", "both ends of this length are the same position", measurement.place(int(row)))


def _marks(measurement: Measurement) -> Iterator[Message]:
    """NCF612: deviations of 999 mm, 9999 mm ... that mark missing readings."""
    for name, rows, values in _errors(measurement):
        size = np.abs(values[rows])
        for row in rows[(size >= MARK_MM) & (size > MARK_RATIO * np.median(size))]:
            if not f"{abs(values[row]):.12g}".replace(".", "").strip("9"):
                text = f"{name} is {values[row]:.12g}: is this the mark of a missing reading?"
                yield Message("NCF612", text, measurement.place(int(row)), "leave out this row")


def _twice(measurement: Measurement) -> Iterator[Message]:
    """NCF613: rows of one state in one set without a column that marks repeats; one remark for the file."""
    if "repeat" in measurement.labels or "run" in measurement.columns:
        return
    commanded = [name for name in measurement.columns if name not in measurement.measured]
    first: dict[tuple[object, ...], int] = {}
    again: list[tuple[int, int]] = []
    copied: list[tuple[int, int]] = []
    for row in range(len(measurement)):
        numbers = tuple(float(measurement.columns[name][row]) for name in commanded)
        key = (measurement.sets[row], *(each[row] for each in measurement.labels.values()), *numbers)
        before = first.setdefault(key, row)
        if before != row:
            (copied if _alike(measurement, before, row) else again).append((before, row))
    yield from _repeated(measurement, again, "taken as a repeat")
    yield from _repeated(measurement, copied, "with the same values; was the row copied?")


def _alike(measurement: Measurement, first: int, second: int) -> bool:
    """Whether two rows have equal measured values."""
    names = measurement.measured
    return bool(names) and all(measurement.columns[n][first] == measurement.columns[n][second] for n in names)


def _repeated(measurement: Measurement, pairs: Sequence[tuple[int, int]], what: str) -> Iterator[Message]:
    if pairs:
        before, row = pairs[0]
        more = f" (and {len(pairs) - 1} more such rows)" if len(pairs) > 1 else ""
        text = f"the same pose as in line {measurement.place(before).line}, {what}{more}"
        yield Message("NCF613", text, measurement.place(row))


def _radians(measurement: Measurement, machine: Machine) -> Iterator[Message]:
    for axis in machine.axes:
        rows, values = _commanded(measurement, axis.name)
        low, high = (limit / axis.unit for limit in axis.range)
        if axis.rotary and high - low > 45 and _looks_like_radians(values, low, high):
            spread = f"{values.min():g} ... {values.max():g}"
            text = f"the positions of {axis.name}, {spread}, look like radians; they must be in degrees"
            yield Message("NCF614", text, measurement.place(int(rows[np.abs(values).argmax()])))


def _commanded(measurement: Measurement, axis: str) -> tuple[Ints, Array]:
    """Rows and positions of an axis, mm or degree, in all columns but the centre of a bar, where no axis stands."""
    found = measurement.columns_of(axis, CENTRE)
    rows = [np.flatnonzero(there) for there in found.values()]
    values = [measurement.columns[name][there] for name, there in found.items()]
    return np.concatenate([np.zeros(0, dtype=np.int64), *rows]), np.concatenate([np.zeros(0), *values])


def _looks_like_radians(values: Array, low: float, high: float) -> bool:
    """Whether positions are probably radians: most are not round, but become round degrees, or span the travel
    low ... high (degree), when converted.
    """
    moved = np.unique(values[np.abs(values) > ROUND_DEG])
    if len(moved) < 3 or np.abs(moved).max() > 2 * np.pi + ROUND_DEG or np.abs(moved).max() < 0.1:
        return False
    uneven = np.abs(moved - np.round(moved, 1)) > ROUND_DEG
    degrees = np.rad2deg(moved)
    even_in_degrees = np.abs(degrees - np.round(degrees)) < 0.05
    far = (
        np.ptp(degrees) > RADIAN_SHARE * min(high - low, 360.0) and degrees.min() > low - 1 and degrees.max() < high + 1
    )
    return bool(uneven.mean() > 0.5 and (even_in_degrees.mean() > 0.5 or far))


def _lengths_in_another_unit(measurement: Measurement, machine: Machine) -> Iterator[Message]:
    """NCF614: positions that, in inches or metres, would cover most of the travel."""
    for axis in machine.axes:
        rows, values = _commanded(measurement, axis.name)
        low, high = axis.range
        if axis.rotary or not np.isfinite(high - low) or len(np.unique(values)) < 3:
            continue
        for unit, size in UNITS.items():
            first, last = float(values.min()) * size, float(values.max()) * size
            slack = 0.01 * (high - low)
            if last - first > UNIT_SHARE * (high - low) and first > low - slack and last < high + slack:
                text = f"the positions of {axis.name}, {first / size:g} ... {last / size:g}, look like {unit}: "
                row = int(rows[np.abs(values).argmax()])
                yield Message("NCF614", f"{text}they must be in mm", measurement.place(row))


def _ranges(measurement: Measurement, machine: Machine) -> Iterator[Message]:
    for axis in machine.axes:
        rows, values = _commanded(measurement, axis.name)
        values = values * axis.unit
        outside = np.flatnonzero((values < axis.range[0] - BEYOND) | (values > axis.range[1] + BEYOND))
        if outside.size:
            low, high = (limit / axis.unit for limit in axis.range)
            found = values[outside[0]] / axis.unit
            small = outside.size > len(values) / 2 and low <= (values / 1000).min() and (values / 1000).max() <= high
            text = (
                f"{axis.name} = {found:g} is outside its range {low:g} ... {high:g}; so are {outside.size} rows in all"
            )
            hint = "are they in um?" if small and not axis.rotary else "are columns swapped?"
            yield Message("NCF615", text, measurement.place(int(rows[outside[0]])), hint)


def _micrometres(measurement: Measurement, machine: Machine) -> Iterator[Message]:
    """NCF616: errors too large for any machine, of the tip or of one axis, or too small for any instrument."""
    for name, rows, values in _errors(measurement):
        turns = name[0] == "r" or name[1] in "ABC"
        limit, unit = (LARGE_RAD, "rad") if turns else (LARGE_MM, "mm")
        if measurement.kind == "axis":
            limit = BEYOND_MUCH * much(machine, name)
        size, most = float(np.median(np.abs(values[rows]))), float(np.abs(values[rows]).max())
        place = measurement.place(int(rows[0]))
        if size > limit:
            text = f"the median of {name} is {size:g} {unit}; errors must be in {unit}"
            hint = "are they in degrees, in seconds of arc, or in mrad?" if turns else "divide by 1000?"
            yield Message("NCF616", text, place, hint)
        elif measurement.kind == "axis" and not turns and 0 < most < SMALL_MM:
            text = f"{name} is {1e3 * most:.2g} um at most, which is less than a laser can measure"
            yield Message("NCF616", text, place, "are the values in metres or inches, or those of a .rtl in mm?")


def _circles(measurement: Measurement, machine: Machine) -> Iterator[Message]:
    """NCF625: ball-bar poses whose distance from the stated centre is not the length of the bar."""
    if measurement.kind != "length" or not {*CENTRE, "radius"} <= measurement.columns.keys():
        return
    tip = machine.tip(measurement.positions(machine), measurement.column("tool_length"))
    distance = np.linalg.norm(tip - measurement.stacked(*CENTRE), axis=1)
    names, sets = groups(measurement.sets)
    for index, name in enumerate(names):
        rows = np.flatnonzero(sets == index)
        found, stated = (float(np.median(each[rows])) for each in (distance, measurement.columns["radius"]))
        if abs(found - stated) > ELSEWHERE:
            text = (
                f"the poses of set {name} are {found:.1f} mm from the stated centre, but the bar is {stated:g} mm long"
            )
            hint = "give `tool_length`, and the centre (cx, cy, cz) in the workpiece frame"
            yield Message("NCF625", text, measurement.place(int(rows[0])), hint)


def _errors(measurement: Measurement) -> Iterator[tuple[str, Ints, Array]]:
    """Measured errors: (name, indices of its rows, whole column)."""
    if measurement.kind in ("tcp", "tcp6"):
        for name in measurement.measured:
            yield name, np.arange(len(measurement)), measurement.columns[name]
    if measurement.kind == "axis" and "value" in measurement.columns:
        pairs = zip(measurement.labels["axis"], measurement.labels["component"], strict=True)
        names = np.array([component_of(axis, component) or "" for axis, component in pairs])
        for name in dict.fromkeys(names.tolist()):
            yield name, np.flatnonzero(names == name), measurement.columns["value"]
