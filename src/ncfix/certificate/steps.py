"""The second reader: what the lines of a program do, line by line and in columns."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ncfix.certificate.reading import TextLine, TextWord
from ncfix.certificate.text import Lines, StraightLines
from ncfix.values import mutable

NAN = math.nan
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Indices = NDArray[np.intp]


class Kind(IntEnum):
    """What a step is."""

    RAPID = 0
    FEED = 1
    ARC = 2
    HOLE = 3
    """A drilling cycle: the end is the bottom of the hole."""
    FIXED = 4
    """In machine coordinates, or to a reference point: never corrected."""


@mutable
class AxisStep:
    """What one line does; positions are commands, mm and degree, NaN where they are not known.

    row     the index of the line
    said    axes that the program itself has brought to their places
    named   the words of the axes
    why     why this reader cannot follow it; empty if it does
    tcp     X Y Z are those of the tool tip in the workpiece
    unit    mm in a unit of linear words
    centre  of arcs, mm, in the order X Y Z; `across`: the axis normal to its plane; `sweep`: rad, about that axis
    """

    row: int
    kind: Kind
    start: list[float]
    end: list[float]
    said: list[bool]
    named: dict[str, TextWord]
    why: str
    tcp: bool
    length: float
    feed: float | None
    feed_mode: int
    unit: float
    centre: tuple[float, float, float] = (NAN, NAN, NAN)
    across: str = "Z"
    sweep: float = 0.0
    foreign: bool = False
    """It is because of what the program uses before, or in this line, that a correction may rewrite otherwise."""
    unsteady: bool = False
    """Cutter radius compensation is on: the control offsets the contour."""
    by_vector: bool = False
    """The tool turns in a plane, not its axes at even rates."""
    turn: Floats | None = None
    """(3, 3), how the coordinates of the program are turned; None: they are not."""


class ModesInForce(NamedTuple):
    """What is in force in a run of lines: offsets and scales of the numbers of axes (a,), and as in `AxisStep`."""

    offsets: Floats
    scales: Floats
    counting: bool
    tcp: bool
    length: float
    feed_mode: int
    unit: float
    unsteady: bool
    by_vector: bool
    turn: Floats | None = None


class StraightRun(NamedTuple):
    """Lines one behind the other that only bring axes straight to places: k steps of a axes.

    start, end  (k, a), mm and degree; `said` (k, a)
    feed        (k,), NaN for none; `rapid` (k,)
    unsaid      (k,) a word is an increment from where the program has not brought the axis
    """

    row: int
    rapid: Bools
    start: Floats
    end: Floats
    said: Bools
    feed: Floats
    unsaid: Bools
    modes: ModesInForce

    @classmethod
    def of(
        cls,
        lines: StraightLines,
        rows: tuple[int, int],
        before: tuple[Sequence[float], Sequence[bool], bool, float],
        modes: ModesInForce,
        klartext: bool,
    ) -> StraightRun | None:
        """Follow lines from `rows[0]` up to `rows[1]`; None where an axis has absolute and incremental words.

        before  where the axes stand, which the program has brought there, whether rapids are on, and the feed
        """
        at, said, rapid, feed = before
        part = slice(*rows)
        word, counted = lines.word[part], lines.counted[part]
        k, axes = word.shape
        has = word >= 0
        absolute = has & ~counted & (klartext or not modes.counting)
        relative = has & ~absolute
        values = lines.values[word] * modes.scales
        end = np.empty((k, axes))
        for column in range(axes):
            here = absolute[:, column]
            if relative[:, column].any():
                if here.any():
                    return None
                ways = np.where(relative[:, column], values[:, column], 0.0)
                end[:, column] = np.cumsum(np.concatenate([[at[column]], ways]))[1:]
            else:
                last = np.maximum.accumulate(np.where(here, np.arange(k), -1))
                places = modes.offsets[column] + values[:, column]
                end[:, column] = np.where(last >= 0, places[last], at[column])
        known = np.logical_or.accumulate(absolute, axis=0) | np.array(said)
        start = np.vstack([np.array(at)[None], end[:-1]])
        paces = _carried(lines.feed[part], lines.values, feed)
        fast = lines.rapid[part] if klartext else _carried(lines.code[part], lines.values, 0.0 if rapid else 1.0) == 0.0
        return cls(rows[0], fast, start, end, known, paces, (has & ~known).any(axis=1), modes)


def _carried(word: Indices, values: Floats, before: float) -> Floats:
    """The numbers of words, each up to the next; -1: no word."""
    last = np.maximum.accumulate(np.where(word >= 0, np.arange(len(word)), -1))
    return np.where(last >= 0, values[word[last]], before)


class ProgramSteps(Mapping[int, AxisStep]):
    """The steps of a program by the index of their line, and in columns (n,) or (n, a) as in `AxisStep`.

    at        (lines,) which step a line is; -1: none
    before    (lines + 1,) how many steps there are before a line
    followed  (n,) whether this reader could follow it
    feed      NaN for none
    across    0 1 2 for X Y Z
    unsaid    a word is an increment from where the program has not brought the axis
    turn      (n,) which of `rotations` (t, 3, 3) the coordinates have; 0: they are not turned
    """

    def __init__(
        self,
        log: Sequence[AxisStep | StraightRun],
        lines: Sequence[TextLine],
        names: Sequence[str],
        straight: StraightLines | None,
    ) -> None:
        """Of single steps and runs of them, in the order of their lines."""
        self._lines, self._names, self._straight = lines, names, straight
        axes = len(names)
        sizes = [1 if isinstance(each, AxisStep) else len(each.rapid) for each in log]
        n = sum(sizes)
        self.rows = np.empty(n, dtype=np.intp)
        self.kind = np.empty(n, dtype=np.int8)
        self.start, self.end, self.said = np.empty((n, axes)), np.empty((n, axes)), np.empty((n, axes), dtype=bool)
        self.followed, self.foreign = np.ones(n, dtype=bool), np.zeros(n, dtype=bool)
        self.unsaid = np.zeros(n, dtype=bool)
        self.tcp, self.unsteady, self.by_vector = (np.zeros(n, dtype=bool) for _ in range(3))
        self.length, self.feed, self.unit = np.empty(n), np.empty(n), np.empty(n)
        self.feed_mode, self.across = np.empty(n, dtype=np.intp), np.full(n, 2, dtype=np.intp)
        self.centre, self.sweep = np.full((n, 3), NAN), np.zeros(n)
        self.turn, self.rotations = np.zeros(n, dtype=np.intp), np.eye(3)[None]
        self._made: list[AxisStep | None] = [None] * n
        single: list[int] = []
        first = 0
        for each, size in zip(log, sizes, strict=True):
            if isinstance(each, AxisStep):
                single.append(first)
                self._made[first] = each
            else:
                self._enter(each, slice(first, first + size))
            first += size
        if single:
            self._enter_each(np.array(single), [each for each in log if isinstance(each, AxisStep)])
        self.at = np.full(len(lines) + 1, -1, dtype=np.intp)
        self.at[self.rows] = np.arange(n)
        self.before = np.searchsorted(self.rows, np.arange(len(lines) + 1))

    def _enter(self, run: StraightRun, at: slice) -> None:
        self.rows[at] = np.arange(run.row, run.row + len(run.rapid))
        self.kind[at] = np.where(run.rapid, Kind.RAPID, Kind.FEED)
        self.start[at], self.end[at], self.said[at], self.feed[at] = run.start, run.end, run.said, run.feed
        self.unsaid[at] = run.unsaid
        modes = run.modes
        self.tcp[at], self.length[at], self.unit[at] = modes.tcp, modes.length, modes.unit
        self.feed_mode[at], self.unsteady[at], self.by_vector[at] = modes.feed_mode, modes.unsteady, modes.by_vector
        self.turn[at] = self._turn_of(modes.turn)

    def _enter_each(self, at: Indices, steps: Sequence[AxisStep]) -> None:
        self.rows[at] = [step.row for step in steps]
        self.kind[at] = [step.kind for step in steps]
        self.start[at] = [step.start for step in steps]
        self.end[at] = [step.end for step in steps]
        self.said[at] = [step.said for step in steps]
        self.followed[at] = [not step.why for step in steps]
        self.foreign[at] = [step.foreign for step in steps]
        self.unsaid[at] = [not all(step.said[self._names.index(name)] for name in step.named) for step in steps]
        self.tcp[at] = [step.tcp for step in steps]
        self.unsteady[at] = [step.unsteady for step in steps]
        self.by_vector[at] = [step.by_vector for step in steps]
        self.length[at] = [step.length for step in steps]
        self.feed[at] = [NAN if step.feed is None else step.feed for step in steps]
        self.unit[at] = [step.unit for step in steps]
        self.feed_mode[at] = [step.feed_mode for step in steps]
        self.across[at] = ["XYZ".index(step.across) for step in steps]
        self.centre[at] = [step.centre for step in steps]
        self.sweep[at] = [step.sweep for step in steps]
        self.turn[at] = [self._turn_of(step.turn) for step in steps]

    def _turn_of(self, rotation: Floats | None) -> int:
        """Which of `rotations` one is, a new one if need be."""
        if rotation is None:
            return 0
        same = (self.rotations[1:] == rotation).all(axis=(1, 2))
        if not same.any():
            self.rotations = np.concatenate([self.rotations, rotation[None]])
            return len(self.rotations) - 1
        return 1 + int(np.argmax(same))

    def step_of(self, row: int) -> int:
        """Which step a line is; -1: none."""
        return int(self.at[row]) if 0 <= row < len(self.at) else -1

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[int]:
        return iter(self.rows.tolist())

    def __contains__(self, row: object) -> bool:
        return isinstance(row, int) and 0 <= row < len(self.at) and bool(self.at[row] >= 0)

    def __getitem__(self, row: int) -> AxisStep:
        at = self.at[row] if 0 <= row < len(self.at) else -1
        if at < 0:
            raise KeyError(row)
        found = self._made[at]
        if found is None:
            found = self._made[at] = self._step(row, at)
        return found

    def _step(self, row: int, at: int) -> AxisStep:
        """A step of a run."""
        feed = float(self.feed[at])
        return AxisStep(
            row,
            Kind(int(self.kind[at])),
            self.start[at].tolist(),
            self.end[at].tolist(),
            self.said[at].tolist(),
            {word.name: word for word in self._lines[row].path},
            "",
            bool(self.tcp[at]),
            float(self.length[at]),
            None if math.isnan(feed) else feed,
            int(self.feed_mode[at]),
            float(self.unit[at]),
            unsteady=bool(self.unsteady[at]),
            by_vector=bool(self.by_vector[at]),
            turn=self.rotations[self.turn[at]] if self.turn[at] else None,
        )

    def decimals(self, at: Indices, least: NDArray[np.intp]) -> NDArray[np.intp]:
        """Digits behind the point of the words of axes of steps (k,), where they may be more than `least`; (k, a)."""
        found = np.zeros((len(at), len(self._names)), dtype=np.intp)
        lines, straight = self._lines, self._straight
        single = np.array([self._made[step] is not None for step in at.tolist()], dtype=bool)
        for k in np.flatnonzero(single).tolist():
            named = self[int(self.rows[at[k]])].named
            for name, word in named.items():
                if word.value is not None:
                    found[k, self._names.index(name)] = word.decimals
        runs = np.flatnonzero(~single)
        if runs.size and straight is not None and isinstance(lines, Lines):
            digits = lines.digits
            words = straight.word[self.rows[at[runs]]]
            values = straight.values
            before = np.ceil(np.log10(np.maximum(np.floor(np.abs(values)) + 1, 1))) + (values < 0)
            most = np.fromiter(map(len, digits), np.intp, len(digits)) - before - 1
            where = np.nonzero((words >= 0) & (most[words] > least[runs]))
            for k, column, number in zip(*map(np.ndarray.tolist, where), words[where].tolist(), strict=True):
                text = digits[number]
                point = max(text.find("."), text.find(","))
                found[runs[k], column] = 0 if point < 0 else len(text) - 1 - point
        return found
