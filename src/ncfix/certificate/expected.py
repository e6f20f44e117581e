"""Two programs as the second reader knows them, and where the machine model wants corrected motions to end."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ncfix.certificate.families import follower_of
from ncfix.certificate.following import AxisStep, Given, Kind
from ncfix.certificate.model import Array, Mask, TipModel, Ways
from ncfix.certificate.reading import AXES, Text, TextLine
from ncfix.machine import Machine

SLACK = 3e-6
"""mm; numbers agree to that, apart from digits: the correction is solved to 1 nm."""
FULL = 0.2
"""mm within which commands are taken for those of a correction that turns rotary axes, too."""
WHOLE_TURN = 2 * math.pi - 1e-9
"""rad; an arc that turns farther is a full circle: it ends where it begins, which is right to the digit there only."""
KEPT = 1000
"""Answers that are kept for the same question soon again."""
PoseColumns = tuple[Mask, Array, Array]
"""Of motions: under tool-centre-point control (n,), the length of the tool (n,) mm, directions (n, n_axes)."""


class Expected:
    """The steps of an original and of its correction, by line, and where the correction of each should end.

    expected    line of the original -> command (n_axes,), mm and rad
    directions  line of the original -> the last direction of each axis; 0 where it has not moved yet, or is not sure
    one_sided   lines of the original at whose ends it is known of every axis with play how it came there, or that it
                has not moved yet: then `fix` and this reader take the middle
    """

    def __init__(self, first: Text, second: Text, machine: Machine, given: Given, tolerance_um: float = 1.0) -> None:
        self.first, self.second, self.given = first, second, given
        x, y, z = (a + b for a, b in zip(machine.workpiece_offset, given.workpiece_offset, strict=True))
        self.machine = machine.replace(workpiece_offset=(x, y, z), conditions=dict(given.inputs))
        self.model = TipModel.of(self.machine)
        self.strategy = second.stamp.strategy if second.stamp else "rotary-then-linear"
        turned = self.model.turned if self.model else lambda numbers, length, on: [math.nan] * len(numbers)
        ours, theirs = (follower_of(text.family, machine.axis_names, given, turned) for text in (first, second))
        self.ours = {step.row: step for step in ours.run(first)}
        self.foreign = ours.foreign
        self.theirs = {step.row: step for step in theirs.run(second)}
        self.our_ends, self.their_ends = self._ends(self.ours), self._ends(self.theirs)
        self.tolerance = (second.stamp.tolerance_um if second.stamp else tolerance_um) / 1e3
        self._halves: dict[tuple[Any, ...], Array] = {}
        self._near: dict[float, list[float]] = {}
        self._leads: dict[tuple[int, int], bool] = {}
        self._expect()
        self.sure = {row for row, place in self.expected.items() if np.isfinite(place).all()}
        """Lines of which it is known where their correction should end."""

    def _expect(self) -> None:
        """Work out where corrected motions should end."""
        self.expected: dict[int, Array] = {}
        self.directions: dict[int, NDArray[np.int8]] = {}
        self.one_sided: set[int] = set()
        model = self.model
        if model is None:
            return
        known = [step for step in self.ours.values() if not step.why and step.kind != Kind.FIXED]
        known = [step for step in known if not any(map(math.isnan, step.end))]
        known = [step for step in known if not step.tcp or (model.leads and not math.isnan(step.length))]
        if not known:
            return
        self._signs(known)
        end, tcp, length, direction = self.columns(known)
        found = model.aimed(end, tcp, length, direction)
        self.expected = dict(zip([step.row for step in known], found, strict=True))

    def _signs(self, steps: Sequence[AxisStep]) -> None:
        """The last direction of each axis at the end of each step, as its program means it; 0 where it is not sure."""
        assert self.model is not None
        last = np.zeros(len(self.machine.axes), dtype=np.int8)
        if not self.machine.depends_on_direction:
            self.directions = dict.fromkeys((step.row for step in steps), last)
            self.one_sided = set(self.directions)
            return
        ways, rows = Ways.of(self.model, steps), np.arange(len(steps))
        tcp = np.array([step.tcp for step in steps])
        length = np.nan_to_num(np.array([step.length for step in steps]))
        end = self.model.joints(ways.end, tcp, length)
        way, lately, at_last = (
            end - self.model.joints(ways.at(rows, np.full(len(steps), 1 - share)), tcp, length)
            for share in (1e-4, 1e-2, 1e-6)
        )
        signs = np.where(np.isfinite(way) & (np.abs(way) > 1e-11), np.sign(way), 0).astype(np.int8)
        clear = np.isfinite(way) & ((np.abs(lately) < 1e-9) | ((lately > 0) == (at_last > 1e-11)))
        clear &= (np.abs(lately) < 1e-9) | ((lately < 0) == (at_last < -1e-11))  # it does not turn round at the end
        found = {step.row: (sign, at) for step, sign, at in zip(steps, signs, clear, strict=True)}
        tcp_before, sure = False, np.ones(len(last), dtype=bool)
        placed = np.array([name in self.given.initial for name in self.machine.axis_names])
        """Axes of which it is not only assumed where they stood before they moved for the first time."""
        directed = list(self.machine.directed)
        for row in sorted(self.ours):
            sign, known = found.get(row, (None, sure))
            tcp_now = self.ours[row].tcp
            if sign is None or tcp_now != tcp_before:
                last, sure = np.zeros_like(last), np.zeros_like(sure)
            else:
                last, sure = np.where(sign != 0, sign, last), known & (placed | (sign == 0)) & (sure | (sign != 0))
                placed = placed | (sign != 0)
            tcp_before = tcp_now
            self.directions[row] = last
            if sure[directed].all():
                self.one_sided.add(row)

    def columns(self, steps: Sequence[AxisStep]) -> tuple[Array, Mask, Array, Array]:
        """Ends (n, n_axes), under tool-centre-point control (n,), tool lengths (n,), directions (n, n_axes)."""
        assert self.model is not None
        return (
            self.model.internal([step.end for step in steps]),
            np.array([step.tcp for step in steps], dtype=bool),
            np.nan_to_num(np.array([step.length for step in steps], dtype=np.float64)),
            np.array([self.directions[step.row] for step in steps], dtype=np.float64),
        )

    def leads_there(self, row: int, at: int) -> bool:
        """Whether a corrected line leads where the correction of an original one should."""
        found = self._leads.get((row, at))
        if found is None:
            if len(self._leads) > KEPT:
                self._leads.clear()
            found = self._leads[row, at] = self._is_there(row, at)
        return found

    def _is_there(self, row: int, at: int) -> bool:
        step, other = self.ours.get(row), self.theirs.get(at)
        if step is None or other is None:
            return step is None and other is None
        if row not in self.sure or any(map(math.isnan, other.end)):
            return self._alike(self.first.lines[row], self.second.lines[at], step.unit)
        if (step.kind == Kind.RAPID) != (other.kind == Kind.RAPID):
            return False
        near = self._near.get(step.unit)
        if near is None:
            reach = 3 * self.half_steps(step, True) + SLACK
            if self.strategy == "full":
                reach = np.where(self.machine.rotary, self.machine.max_correction[1], FULL)
            near = self._near[step.unit] = reach.tolist()
        if abs(step.sweep) > WHOLE_TURN:
            near = [max(reach, self.tolerance) for reach in near]
        places = zip(step.said, self.their_ends[at].tolist(), self.expected[row].tolist(), near, strict=True)
        return all(abs(there - wanted) <= reach for said, there, wanted, reach in places if said)

    def _alike(self, line: TextLine, other: TextLine, unit: float) -> bool:
        """Whether the numbers of two lines differ by corrections only, word by word."""
        most = 2.5 * self.machine.max_correction[0] / unit
        for word in line.path:
            found = other.word(word.name)
            if word.name in AXES and (
                found is None
                or (word.value is not None and found.value is not None and abs(found.value - word.value) > most)
            ):
                return False
        return True

    def half_steps(self, step: AxisStep, added: bool = False) -> Array:
        """Half of the last digit of each axis, as it is written in a block, (n_axes,) mm and rad.

        added  the number stands in an added line, which has the digits of the control only
        """
        words = () if added else tuple(step.named.items())
        digits_of = tuple((name, word.decimals) for name, word in words if word.value is not None)
        key = (step.unit, digits_of)
        found = self._halves.get(key)
        if found is None:
            found = np.empty(len(self.machine.axes))
            written = dict(digits_of)
            for column, name in enumerate(self.machine.axis_names):
                rotary = bool(self.machine.rotary[column])
                unit = math.pi / 180 if rotary else step.unit
                least = self.machine.least_increment[rotary] / unit
                digits = max(0, math.ceil(-math.log10(least) - 1e-9), written.get(name, 0))
                found[column] = 0.5 * 10.0**-digits * unit
            self._halves[key] = found
        return found

    def sure_of_side(self, step: AxisStep) -> bool:
        """Whether the direction of every axis is known on which an error depends."""
        return step.row in self.one_sided

    def is_followed(self, row: int) -> bool:
        """Whether it is known where a line should lead, or that it leads nowhere."""
        step = self.ours.get(row)
        if step is None:
            return True
        if row not in self.sure or not all(step.said[self.machine.axis_names.index(name)] for name in step.named):
            return False
        return not self.machine.depends_on_direction or (self.sure_of_side(step) and abs(step.sweep) <= WHOLE_TURN)

    def _ends(self, steps: Mapping[int, AxisStep]) -> dict[int, Array]:
        """The ends of steps, mm and rad, by line."""
        if self.model is None:
            return {}
        return dict(zip(steps, self.model.internal([step.end for step in steps.values()]), strict=True))
