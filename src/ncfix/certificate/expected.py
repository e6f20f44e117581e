"""The steps of two programs, as the second reader follows them, and the expected ends of corrected motions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ncfix.arrays import Array, Index, Mask
from ncfix.certificate.coordinates import Given
from ncfix.certificate.families import follower_of
from ncfix.certificate.flow import NotPlainError
from ncfix.certificate.following import AxisFollower
from ncfix.certificate.model import TipModel, Ways
from ncfix.certificate.reading import AXES, TextLine
from ncfix.certificate.steps import AxisStep, Kind, ProgramSteps
from ncfix.certificate.text import Indices, Text
from ncfix.machine import Machine

SLACK = 3e-6
"""Difference, mm, up to which positions agree, besides rounding: the correction is solved to 1 nm."""
BACK = 1000
"""Number of lines that are searched backwards for the word that set the position of an axis."""
WHOLE_TURN = 2 * math.pi - 1e-9
"""Sweep, rad, above which an arc is a full circle: it ends where it begins, and is right to the digit there only."""
PART = 8192
"""Number of steps that are computed at once."""
KEPT = 1000
"""Number of cached answers."""
PoseColumns = tuple[Mask, Array, Array]
"""For n motions: (n,) under tool-centre-point control, (n,) tool length, mm, (n, n_axes) directions."""


def parts(steps: Indices) -> Iterator[Indices]:
    """The steps in batches of `PART`."""
    return (steps[first : first + PART] for first in range(0, len(steps), PART))


class ProofTask(NamedTuple):
    """The programs to be compared, and what is needed to follow them.

    first, second  the original and its correction
    tolerance_um   tolerance of the way; that of the stamp of the correction takes precedence
    turn           see `AxisFollower.run`, for programs with the same loops; without effect if errors depend on
                   direction
    """

    first: Text
    second: Text
    machine: Machine
    given: Given
    tolerance_um: float = 1.0
    turn: int | None = None


class Expected:
    """The steps of an original (`ours`, n) and of its correction (`theirs`), and the expected ends of the correction.

    expected    (n, n_axes) commands at which the corrected steps should end, mm and rad; NaN if not known
    sure        (n,) whether `expected` is known
    directions  (n, n_axes) the last direction of each axis; 0 if it has not moved yet, or is not sure
    one_sided   (n,) for every axis with play, its direction is known, or it is known not to have moved yet: then `fix`
                and this reader assume the middle
    told        (n,) whether it is known where the corrected line should lead
    """

    def __init__(self, task: ProofTask) -> None:
        """Follow both programs."""
        first, second, machine, given, tolerance_um, turn = task
        self.first, self.second, self.given = first, second, given
        x, y, z = (a + b for a, b in zip(machine.workpiece_offset, given.workpiece_offset, strict=True))
        placed = ((x, y, z), dict(given.inputs))
        if placed != (machine.workpiece_offset, machine.conditions):  # else keep what the machine has cached
            machine = machine.replace(workpiece_offset=placed[0], conditions=placed[1])
        self.machine = machine
        self.model = TipModel.of(self.machine)
        self.strategy = second.stamp.strategy if second.stamp else "rotary-then-linear"
        turn = None if self.machine.depends_on_direction else turn
        try:
            (ours, self.ours), (theirs, self.theirs) = (self._followed(text, turn) for text in (first, second))
        except NotPlainError:
            (ours, self.ours), (theirs, self.theirs) = (self._followed(text, None) for text in (first, second))
        self.foreign, self.turns = ours.foreign, ours.turns
        self.calls, self.calls_there = ours.calls, theirs.calls
        self.tolerance = (second.stamp.tolerance_um if second.stamp else tolerance_um) / 1e3
        self._halves: dict[tuple[Any, ...], Array] = {}
        self._near: dict[float, Array] = {}
        self._leads: dict[tuple[int, int], bool] = {}
        n, axes = len(self.ours), len(machine.axes)
        self.expected, self.directions = np.full((n, axes), math.nan), np.zeros((n, axes), dtype=np.int8)
        self.one_sided = np.zeros(n, dtype=bool)
        if self.model is not None:
            self._expect(self.model)
        self.sure = np.isfinite(self.expected).all(axis=1)
        self.told = self.sure & ~self.ours.unsaid
        if self.machine.depends_on_direction:
            self.told &= self.one_sided & (np.abs(self.ours.sweep) <= WHOLE_TURN)

    def _followed(self, text: Text, turn: int | None) -> tuple[AxisFollower, ProgramSteps]:
        follower = follower_of(text.family, self.machine.axis_names, self.given, self.model)
        return follower, follower.run(text, turn)

    def _expect(self, model: TipModel) -> None:
        """Compute `expected`."""
        ours = self.ours
        known = ours.followed & (ours.kind != Kind.FIXED) & np.isfinite(ours.end).all(axis=1)
        known &= ~ours.tcp | (np.isfinite(ours.length) & bool(ours.tcp.any() and model.leads))
        at = np.flatnonzero(known)
        if at.size:
            self._signs(model, at)
        for part in parts(at):
            self.expected[part] = model.aimed(*self.columns(part))

    def _signs(self, model: TipModel, known: Indices) -> None:
        """Compute `directions` and `one_sided`: the last direction of each axis at the end of each step."""
        ours, n = self.ours, len(self.ours)
        if not self.machine.depends_on_direction:
            self.one_sided[known] = True
            return
        signs, clear = np.zeros_like(self.directions), np.zeros(self.directions.shape, dtype=bool)
        for part in parts(known):
            ways, rows = Ways.of(model, ours, part), np.arange(len(part))
            tcp, length = ours.tcp[part], np.nan_to_num(ours.length[part])
            end = model.joints(ways.end, tcp, length)
            way, lately, at_last = (
                end - model.joints(ways.at(rows, np.full(len(part), 1 - share)), tcp, length)
                for share in (1e-4, 1e-2, 1e-6)
            )
            signs[part] = np.where(np.isfinite(way) & (np.abs(way) > 1e-11), np.sign(way), 0)
            same = (np.abs(lately) < 1e-9) | (np.sign(lately) == np.where(np.abs(at_last) > 1e-11, np.sign(at_last), 0))
            clear[part] = np.isfinite(way) & same  # and it does not reverse at the end
        lost = np.ones(n, dtype=bool)
        lost[known] = False
        goes_on = ~lost[:-1] & ~lost[1:] & (~ours.tcp[:-1] | (ours.length[:-1] == ours.length[1:]))
        hole = np.flatnonzero((ours.kind[:-1] == Kind.HOLE) & goes_on)
        level, bottom = (
            model.joints(model.internal(places), ours.tcp[hole], np.nan_to_num(ours.length[hole]))
            for places in (ours.start[hole + 1], ours.end[hole])
        )
        out = np.where(np.abs(level - bottom) > 1e-9, np.sign(level - bottom), 0)
        signs[hole] = np.where(out != 0, -out, signs[hole])
        signs[hole + 1] = np.where(signs[hole + 1] != 0, signs[hole + 1], out)
        lost |= ours.tcp != np.concatenate([[False], ours.tcp[:-1]])
        moves, index = (signs != 0) & ~lost[:, None], np.arange(n)[:, None]
        last = np.maximum.accumulate(np.where(moves | lost[:, None], index, -1), axis=0)
        self.directions = np.where(last >= 0, np.take_along_axis(np.where(moves, signs, 0), last, axis=0), 0)
        placed = np.array([name in self.given.initial for name in self.machine.axis_names])
        moved = np.logical_or.accumulate(moves, axis=0)
        placed_before = np.vstack([placed[None], placed | moved[:-1]])  # other positions were only assumed
        breaks = lost[:, None] | ~clear | (moves & ~placed_before)
        last = np.maximum.accumulate(np.where(moves | breaks, index, -1), axis=0)
        sure = (last < 0) | ~np.take_along_axis(breaks, last, axis=0)
        self.one_sided = sure[:, list(self.machine.directed)].all(axis=1)

    def ends(self, steps: ProgramSteps, at: Indices) -> Array:
        """(k, n_axes) ends of steps `at` (k,) of a program, mm and rad."""
        return steps.end[at] * np.where(self.machine.rotary, math.pi / 180, 1.0)

    def columns(self, at: Indices) -> tuple[Array, Mask, Array, Array]:
        """For steps (n,) of the original: ends (n, n_axes), TCP (n,), tool lengths (n,), directions (n, n_axes)."""
        ours = self.ours
        return self.ends(ours, at), ours.tcp[at], np.nan_to_num(ours.length[at]), self.directions[at].astype(np.float64)

    # -- ends of lines ----------------------------------------------------------------------------------------------

    def leads_there(self, row: int, at: int) -> bool:
        """Whether corrected line `at` leads where the correction of original line `row` should."""
        found = self._leads.get((row, at))
        if found is None:
            if len(self._leads) > KEPT:
                self._leads.clear()
            found = self._leads[row, at] = self._is_there(row, at)
        return found

    def _is_there(self, row: int, at: int) -> bool:
        i, j = self.ours.step_of(row), self.theirs.step_of(at)
        if i < 0 or j < 0:
            return i < 0 and j < 0
        unit = float(self.ours.unit[i])
        if not self.sure[i] or not np.isfinite(self.theirs.end[j]).all():
            return self._alike(self.first.lines[row], self.second.lines[at], unit)
        return bool(self._are_there(np.array([i]), np.array([j]))[0])

    def _are_there(self, ours: Indices, theirs: Indices) -> Mask:
        """(k,) whether corrected steps lead to the expected ends of original steps (k,), which must be known."""
        units = self.ours.unit[ours]
        near = np.empty((len(ours), len(self.machine.axes)))
        for unit in set(units.tolist()):
            near[units == unit] = self._reach(unit)
        near = self.along(near, ours)
        turns = np.abs(self.ours.sweep[ours]) > WHOLE_TURN
        near[turns] = np.maximum(near[turns], self.tolerance)
        rapid = (self.ours.kind[ours] == Kind.RAPID) == (self.theirs.kind[theirs] == Kind.RAPID)
        done, expected = self.ends(self.theirs, theirs), self.expected[ours]
        if self.strategy == "full" and self.model is not None:
            expected = self.model.aimed(*self.columns(ours), done)
            expected = np.where(self.machine.rotary, self.ends(self.ours, ours), expected)
        off = np.abs(done - expected)
        there: Mask = rapid & ((off <= near) | ~self.ours.said[ours]).all(axis=1)
        return there

    def _reach(self, unit: float) -> Array:
        """(n_axes,) largest difference of a corrected end from the expected one, mm and rad, to count as equal."""
        found = self._near.get(unit)
        if found is None:
            found = 3 * self.control_halves(unit) + SLACK
            if self.strategy == "full":
                found = np.where(self.machine.rotary, self.machine.max_correction[1], found + self.tolerance)
            self._near[unit] = found
        return found

    def lead_there(self, row: int, at: int, count: int) -> int:
        """Number of consecutive lines, at most `count`, of which one from `row` on surely pairs with one from `at` on.

        Behind each of the latter there must be another line with a path.
        """
        done, size = 0, 16
        while done < count:
            size = min(4 * size, count - done)
            ours, theirs = self.ours.at[row + done :][:size], self.theirs.at[at + done :][: size + 1]
            good = (ours >= 0) & (theirs[:-1] >= 0) & (theirs[1:] >= 0)
            good &= self.told[ours] & np.isfinite(self.theirs.end[theirs[:-1]]).all(axis=1)
            good &= self._are_there(ours, theirs[:-1])
            if not good.all():
                return done + int(np.argmin(good))
            done += size
        return done

    def _alike(self, line: TextLine, other: TextLine, unit: float) -> bool:
        """Whether the words of two lines differ by no more than corrections may be."""
        most = 2.5 * self.machine.max_correction[0] / unit
        for word in line.path:
            found = other.word(word.name)
            if word.name in AXES and (
                found is None
                or (word.value is not None and found.value is not None and abs(found.value - word.value) > most)
            ):
                return False
        return True

    def is_followed(self, row: int) -> bool:
        """Whether it is known where an original line should lead, or that it is no motion."""
        at = self.ours.step_of(row)
        return at < 0 or bool(self.told[at])

    # -- digits -----------------------------------------------------------------------------------------------------

    def half_steps(self, step: AxisStep, piece: AxisStep | None = None, *, added: bool = False) -> Array:
        """(n_axes,) half of the last digit of each axis in a block, mm and rad.

        piece  the only line that replaces the block: for a word that was left unchanged, the rounding by the control
               counts
        added  the numbers are in an added line, which has the digits of the control only
        """
        found = self.control_halves(step.unit)
        named = {name: word for name, word in step.named.items() if word.value is not None}
        if not added:
            written = tuple(named[name].decimals if name in named else 0 for name in self.machine.axis_names)
            key = (step.unit, written)
            if key not in self._halves:
                self._halves[key] = self.halves(np.array([step.unit]), np.array([written]))[0]
            found = self._halves[key]
        if piece is not None:
            found, coarse = found.copy(), self.control_halves(step.unit)
            digits = self.control_digits(np.array([step.unit]))[0].tolist()
            for k, name in enumerate(self.machine.axis_names):
                if name in named and piece.named.get(name) == named[name]:
                    value = named[name].value or 0.0
                    rest = abs(value - round(value, digits[k]))
                    found[k] = coarse[k] + rest * (math.pi / 180 if self.machine.rotary[k] else step.unit)
        return self.along(found[None], np.array([self.ours.at[step.row]]))[0]

    def unrounded(self, step: AxisStep, piece: AxisStep) -> Array:
        """(n_axes,) rounding by the control of axes that the last line of a block does not name, mm and rad.

        It is not zero if the word that set the position of an axis has more digits than the control.
        """
        digits = self.control_digits(np.array([piece.unit]))[0].tolist()
        found = self.control_halves(piece.unit).copy()
        for k, name in enumerate(self.machine.axis_names):
            rows = range(piece.row - 1, max(piece.row - BACK, 0), -1)
            word = piece.named.get(name) or next(
                (word for row in rows if (word := self.second.lines[row].word(name))), None
            )
            if name in piece.named or word is None or word.decimals <= digits[k]:
                found[k] = 0.0
        return self.along(found[None], np.array([self.ours.at[step.row]]))[0]

    def along(self, numbers: Array, at: Indices) -> Array:
        """(k, n_axes) largest error of commands of steps (k,) by errors (k, n_axes) of their numbers, if turned."""
        turn = self.ours.turn[at]
        if self.model is None or not turn.any():
            return numbers
        found, columns = numbers.copy(), list(self.model.columns)
        found[:, columns] = np.einsum("kij,kj->ki", np.abs(self.ours.rotations[turn]), numbers[:, columns])
        return found

    def control_halves(self, unit: float) -> Array:
        """(n_axes,) largest error of numbers that are rounded to the digits of the control, mm and rad."""
        found = self._halves.get((unit,))
        if found is None:
            written = np.zeros((1, len(self.machine.axes)), dtype=np.intp)
            found = self._halves[unit,] = self.halves(np.array([unit]), written)[0]
        return found

    def control_digits(self, units: Array) -> Index:
        """(n, n_axes) number of decimals that the control resolves, in blocks with units (n,), mm."""
        linear, angle = self.machine.least_increment
        counted = np.where((units > 1) & self.given.decimal_inches, 10.0, units)
        least = np.where(self.machine.rotary, angle * 180 / math.pi, linear / counted[:, None])
        return np.maximum(0, np.ceil(-np.log10(least) - 1e-9)).astype(np.intp)

    def halves(self, units: Array, written: Index) -> Array:
        """(n, n_axes) largest error of rounded numbers with at least these decimals (n, n_axes), mm and rad.

        units  (n,) units of the blocks, mm
        """
        digits = np.maximum(self.control_digits(units), written)
        return 0.5 * 10.0 ** -digits.astype(float) * np.where(self.machine.rotary, math.pi / 180, units[:, None])

    def sure_of_side(self, step: AxisStep) -> bool:
        """Whether the directions of all axes are known on whose direction an error depends."""
        at = self.ours.step_of(step.row)
        return at >= 0 and bool(self.one_sided[at])
