"""Where the control puts a grid: its parameters say how many points there are along each axis, how far apart they are,
and which of them lies at the reference position. So there must be a point there, and its number goes with the files.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ncfix.diagnostics import UsageError
from ncfix.tables.control import Assumption, Option, Request, SettingForm
from ncfix.tables.table_files import Remarks
from ncfix_fanuc import json_values

ENTRY = re.compile(r"([XYZABC])=?([+-]?(?:\d+\.?\d*|\.\d+))")
REFERENCE, POINTS, FIRST = "reference", "reference_points", "first"
CLOSE = 1e-6
"""mm or degree: positions nearer to each other are one."""


def _entries(text: str) -> list[tuple[str, float]] | None:
    """Letters and positions; None for text that says anything else, or something twice."""
    found = [ENTRY.fullmatch(part) for part in re.split(r"[ ,]+", text.strip().upper()) if part]
    pairs = [(match[1], float(match[2])) for match in found if match is not None]
    return pairs if len(pairs) == len(found) == len({letter for letter, _ in pairs}) else None


FORM = SettingForm("axes with their positions, like X0,Y0,Z-10.5", lambda text: _entries(text) is not None)


def assumption(name: str) -> Assumption:
    """What is taken for true of the place of a grid, under this id."""
    return Assumption(
        name,
        "Points are an interval apart, numbered from 1 towards plus along each axis, and a parameter for each axis "
        "says which of them lies at its reference position: machine zero, unless --set reference says otherwise.",
        "the parameters of stored pitch error compensation (3620 to 3624) place their points so; of the grid no public "
        "text says more than that it has points, intervals and vertices",
        "machine zero is the reference position of every axis",
        "Parameter 1240 is the machine coordinate of the reference position. With the grid on, stand at the reference "
        "position of all axes: cnc_rdvolccomp must show the value of the point whose number the files give for it; "
        "then move one axis by its interval towards plus: the value of the next point must show.",
    )


OPTIONS: Mapping[str, Option] = {
    REFERENCE: Option(
        "",
        "machine coordinates of the reference position, e.g. X0,Y0,Z-10; of axes that are not named it is machine zero",
        FORM,
    )
}
STEP = (
    "For each axis set the number of points, the interval, and the number of the point at the reference position as "
    "the remarks below list them: the control puts the grid by these, not by the positions in the files."
)


def anchors(request: Request, settings: Mapping[str, str], inputs: Sequence[str]) -> tuple[float, ...]:
    """The reference position along each axis of a grid, mm or degree.

    Raises `UsageError` NCF485 where it is not in the range of the grid, or said of an axis that the machine lacks.
    """
    machine = request.machine
    given = dict(_entries(settings[REFERENCE]) or ())
    strange = sorted(set(given) - set(machine.axis_names))
    if strange:
        text = f"{REFERENCE} names {', '.join(strange)}, and the machine has {' '.join(machine.axis_names)}"
        raise UsageError.of("NCF485", text, hint=FORM.hint)
    for name in inputs:
        index = machine.axis_names.index(name)
        low, high = (float(value) / machine.axes[index].unit for value in request.space[index])
        place = given.get(name, 0.0)
        if not low - CLOSE <= place <= high + CLOSE:
            what = "" if name in given else ", which is taken to be machine zero,"
            text = f"the reference position of {name}, {place:g}{what} is not between {low:g} and {high:g}"
            text += ": the control puts the grid by the point that lies there"
            hint = (
                f"--set {REFERENCE}={name}POSITION, where {name} stands after its reference position return (machine "
            )
            hint += "coordinates); or a range in the machine file, or --range, that takes it in"
            raise UsageError.of("NCF485", text, hint=hint)
    return tuple(given.get(name, 0.0) for name in inputs)


@dataclass(frozen=True, slots=True)
class Placing:
    """A grid as the control's parameters put it, each along its axes.

    reference  machine coordinates of the reference position, mm or degree
    points     number of the point that lies there, from 1
    """

    reference: tuple[float, ...]
    points: tuple[int, ...]

    @classmethod
    def of(cls, reference: Sequence[float], lines: Sequence[Any]) -> Placing:
        """From the positions of the nodes along each axis, mm or degree, of which one is at the reference position."""
        numbers = [int(np.argmin(np.abs(np.asarray(line) - at))) for line, at in zip(lines, reference, strict=True)]
        off = [abs(line[number] - at) for line, number, at in zip(lines, numbers, reference, strict=True)]
        assert max(off) < CLOSE, f"no node at the reference position {reference}: {off}"
        return cls(tuple(float(at) for at in reference), tuple(number + 1 for number in numbers))

    def first(self, step: Sequence[float]) -> tuple[float, ...]:
        """Where the first points lie."""
        return tuple(
            round(at - (number - 1) * each, 6)
            for at, number, each in zip(self.reference, self.points, step, strict=True)
        )

    def entries(self, unit: str) -> dict[str, Any]:
        """As they stand in a file; unit: mm or deg."""
        return {f"{REFERENCE}_{unit}": self.reference, POINTS: self.points}

    def number(self, counts: Sequence[int], fastest: Sequence[int], first: int = 1) -> int:
        """The number that the point at the reference position has among all; fastest: the axes, fastest first."""
        strides = {axis: math.prod(counts[each] for each in fastest[:place]) for place, axis in enumerate(fastest)}
        return first + sum((self.points[axis] - 1) * stride for axis, stride in strides.items())

    def notes(self, inputs: Sequence[str], counts: Sequence[int], step: Sequence[float], unit: str) -> Iterator[str]:
        """What the parameters of each axis must be, in words."""
        rows = zip(inputs, counts, step, self.reference, self.points, self.first(step), strict=True)
        for name, count, each, at, number, first in rows:
            place = f"the reference position {name}{at:g} is point {number} (so the first is at {name}{first:g})"
            yield f"{name}: {count} points, interval {each:g} {unit}, {place}."


def placed(
    record: Mapping[str, Any], unit: str, step: Sequence[float], counts: Sequence[int], remarks: Remarks
) -> tuple[tuple[float, ...], Placing | None]:
    """Where the first points of a grid lie by its parameters, and these; None in old files, which say that alone."""
    said = json_values.reals(record, f"{FIRST}_{unit}", len(step))
    if POINTS not in record:
        text = f"does not say which point lies at the reference position: the control cannot put the grid ({POINTS})"
        remarks.doubt(0, text, "export again")
        return said, None
    numbers = json_values.wholes(record, POINTS)
    reference = json_values.reals(record, f"{REFERENCE}_{unit}", len(step))
    if len(numbers) != len(step) or any(not 1 <= number <= most for number, most in zip(numbers, counts, strict=False)):
        remarks.refuse(0, f"{POINTS} {numbers}: a point of each axis, of {list(counts)}")
        return said, None
    placing = Placing(reference, tuple(numbers))
    first = placing.first(step)
    if any(abs(one - other) > CLOSE for one, other in zip(first, said, strict=True)):
        text = f"by {REFERENCE}_{unit}, {POINTS} and the intervals the grid begins at {list(first)}"
        remarks.refuse(0, f"{text}, and {FIRST}_{unit} says {list(said)}", "the control goes by the former")
    return first, placing
