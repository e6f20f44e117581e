"""What a file assigns to one table, CEC or EEC: its range, its step and its values, looked at as the control would."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ncfix.tables.grid import Array
from ncfix.tables.table_files import Remarks
from ncfix_siemens.syntax import Assignment

WHOLE = 1e-6
"""How far from a whole number (MAX - MIN) / STEP may be."""
MOST = 100_000
"""Points of a table, beyond any control's."""
KEEPS = "the control keeps what it had"


@dataclass(slots=True)
class Assigned:
    """The assignments of one table.

    title   for messages, e.g. "table 3" or "AX1"
    place   the text of the n-th value's variable, with {} for n
    names   the text of a field's variable, with {} for the field
    """

    title: str
    place: str
    names: str
    remarks: Remarks
    fields: dict[str, Assignment] = field(default_factory=dict)
    values: dict[int, Assignment] = field(default_factory=dict)

    def put_field(self, name: str, assignment: Assignment) -> None:
        """Take a field; the last of several counts."""
        self._look_for_another(self.fields.get(name), assignment)
        self.fields[name] = assignment

    def put_value(self, number: int, assignment: Assignment) -> None:
        """Take a value; the last of several counts."""
        self._look_for_another(self.values.get(number), assignment)
        self.values[number] = assignment

    def _look_for_another(self, other: Assignment | None, assignment: Assignment) -> None:
        if other is not None:
            self.remarks.doubt(assignment.line, "is assigned twice: the control keeps the last", "a slip?")

    def lacks(self, needed: Iterable[str]) -> bool:
        """Whether fields are missing, which is refused."""
        gone = [name for name in needed if name not in self.fields]
        if gone:
            first = next(iter([*self.values.values(), *self.fields.values()]))
            text = f"{self.title} has no {', '.join(self.names.format(name) for name in gone)}: {KEEPS}"
            self.remarks.refuse(first.line, text)
        return bool(gone)

    def number(self, name: str) -> float:
        """A field as a number; 0, and refused, if it is none."""
        return self._number(self.fields[name])

    def _number(self, assignment: Assignment) -> float:
        if assignment.number is None:
            what = "a decimal comma" if "," in assignment.value else f"{assignment.value!r} is not a number"
            self.remarks.refuse(assignment.line, what, "a decimal point")
        return assignment.number or 0.0

    def choice(self, name: str, allowed: Sequence[int] | None = None) -> int:
        """A field that is a whole number, one of those allowed; 0 if it is not there."""
        if name not in self.fields:
            return 0
        value = self.number(name)
        if value != int(value) or (allowed is not None and int(value) not in allowed):
            wanted = "a whole number" if allowed is None else f"one of {', '.join(map(str, allowed))}"
            self.remarks.refuse(self.fields[name].line, f"{name} is {value:g}, not {wanted}")
        return int(value)

    def curve(self, modulo: bool) -> Array | None:
        """The values from MIN to MAX, (k + 1,); None if something is wrong with them."""
        before = len(self.remarks.wrong)
        last = self._last()
        if last:
            self._look_at_places(last)
        found = {number: self._number(each) for number, each in self.values.items()}
        if len(self.remarks.wrong) > before:
            return None
        values = np.array([found[number] for number in range(last + 1)])
        if modulo and abs(values[0] - values[-1]) > WHOLE:
            text = f"{self.title} repeats, but ends on another value than it begins"
            self.remarks.doubt(self.values[last].line, text)
        return values

    def _last(self) -> int:
        """k = (MAX - MIN) / STEP; 0, and refused, if there is none."""
        step, low, high = (self.number(name) for name in ("STEP", "MIN", "MAX"))
        line = self.fields["STEP"].line
        if step <= 0 or high <= low:
            self.remarks.refuse(line, f"a step of {step:g} from {low:g} to {high:g}")
            return 0
        steps = (high - low) / step
        if steps > MOST:
            self.remarks.refuse(line, f"(MAX - MIN) / STEP is {steps:.6g}: no control has so many points")
            return 0
        if abs(steps - round(steps)) > WHOLE:
            text = f"(MAX - MIN) / STEP is {steps:.6g}, not a whole number: the control would move the end"
            self.remarks.refuse(line, text)
            return 0
        return round(steps)

    def _look_at_places(self, last: int) -> None:
        for number in sorted(number for number in self.values if number > last)[:1]:
            text = f"{self.title} has values 0 to {last} by its MIN, MAX and STEP; this one is ignored"
            self.remarks.refuse(self.values[number].line, text, "one value too many, or MAX too small")
        gone = [number for number in range(last + 1) if number not in self.values]
        if gone:
            text = f"{len(gone)} of {last + 1} values of {self.title} are missing, first {self.place.format(gone[0])}"
            self.remarks.refuse(self.fields["STEP"].line, f"{text}: {KEEPS} there")
