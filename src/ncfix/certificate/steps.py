"""The second reader: the steps of a program, that is, the motions of its lines, one by one and in columns."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from ncfix.arrays import Array, Mask, Signs
from ncfix.certificate.reading import TextLine, TextWord
from ncfix.certificate.text import KEPT, MOST_DIGITS, Indices, StraightLines
from ncfix.values import mutable

NAN = math.nan
PLANES = {17: ("X", "Y", "Z"), 18: ("Z", "X", "Y"), 19: ("Y", "Z", "X")}
"""The axes of a plane, and the axis normal to it."""
NO_CIRCLE = "an arc that does not close"
AT_ONCE = 500
"""Number of steps that are put into columns together."""


class Kind(IntEnum):
    """The kinds of steps."""

    RAPID = 0
    FEED = 1
    ARC = 2
    HOLE = 3
    """A drilling cycle: the end is the bottom of the hole."""
    FIXED = 4
    """In machine coordinates, or to a reference point: never corrected."""


@mutable
class AxisStep:
    """The motion of one line. Positions are commands, mm and degree, NaN if not known.

    row     index of the line
    said    for each axis, whether the program itself has set its position
    named   letter of an axis -> its word
    why     why this reader cannot follow it; empty if it can
    tcp     X Y Z are those of the tool tip in the workpiece
    length  tool length, mm
    unit    unit of linear words, mm
    centre  centre of an arc, mm, as X Y Z; `across`: the axis normal to its plane; `sweep`: angle about it, rad
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
    """A correction may rewrite the line in a form unknown to this reader, because of features of the program."""
    unsteady: bool = False
    """Cutter radius compensation is on: the control offsets the contour."""
    by_vector: bool = False
    """The tool turns in a plane, instead of the rotary axes evenly."""
    turn: Array | None = None
    """(3, 3) rotation of the coordinates of the program; None: they are not turned."""

    def is_like(self, other: AxisStep) -> bool:
        """Whether another step of the same line makes the same motion."""
        here, there = (
            np.array([*step.start, *step.end, *step.said, *step.centre, step.length, step.sweep, step.unit])
            for step in (self, other)
        )
        ours, theirs = ((each.kind, each.why, each.tcp, each.feed, each.feed_mode) for each in (self, other))
        return ours == theirs and np.array_equal(here, there, equal_nan=True) and self.turn is other.turn

    def lead_round(
        self, names: Sequence[str], plane: int, centre: Mapping[str, float], clockwise: bool, radius: float | None
    ) -> AxisStep:
        """Make the step an arc in a plane (17, 18, 19) about a centre, or with a radius, mm; sets `why` if impossible.

        names  the letters of the axes
        """
        one, two, up = PLANES[plane]
        start, end = (dict(zip(names, places, strict=True)) for places in (self.start, self.end))
        a, b = (start[one], start[two]), (end[one], end[two])
        if radius is not None:
            chord = math.dist(a, b)
            height = radius * radius - chord * chord / 4
            if not chord > 0 or height < -0.01 * radius * radius:
                self.why = self.why or NO_CIRCLE
                return self
            side = math.sqrt(max(height, 0.0)) * (1 if (radius > 0) != clockwise else -1)
            way = ((b[0] - a[0]) / chord, (b[1] - a[1]) / chord)
            middle = ((a[0] + b[0]) / 2 - side * way[1], (a[1] + b[1]) / 2 + side * way[0])
        else:
            middle = (centre[one], centre[two])
        sizes = math.dist(a, middle), math.dist(b, middle)
        if abs(sizes[0] - sizes[1]) > 0.05 + 1e-3 * sizes[0]:
            self.why = self.why or NO_CIRCLE
        first = math.atan2(a[1] - middle[1], a[0] - middle[0])
        last = math.atan2(b[1] - middle[1], b[0] - middle[0])
        turn = (last - first) % (2 * math.pi)
        if clockwise:
            turn -= 2 * math.pi
        if math.dist(a, b) < 1e-9 or abs(turn) < 1e-12:
            turn = -2 * math.pi if clockwise else 2 * math.pi
        places = {one: middle[0], two: middle[1], up: 0.0}
        self.centre = (places["X"], places["Y"], places["Z"])
        self.across, self.sweep, self.kind = up, turn, Kind.ARC
        return self


class ModesInForce(NamedTuple):
    """The modes in a run of lines: offsets and scales of words (a,), `counting` (G91), and others as in `AxisStep`."""

    offsets: Array
    scales: Array
    counting: bool
    tcp: bool
    length: float
    feed_mode: int
    unit: float
    unsteady: bool
    by_vector: bool
    turn: Array | None = None


class StraightRun(NamedTuple):
    """Consecutive straight motions: k steps of a axes.

    row         index of the first line
    start, end  (k, a) positions, mm and degree; `said` (k, a): whether the program has set them
    written     (k, a) decimals of the words
    feed        (k,) NaN: none; `rapid` (k,): whether it is a rapid
    unsaid      (k,) a word is an increment of an axis whose position the program has not set
    """

    row: int
    rapid: Mask
    start: Array
    end: Array
    said: Mask
    written: Signs
    feed: Array
    unsaid: Mask
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
        """Follow lines from `rows[0]` up to `rows[1]`; None if an axis has both absolute and incremental words.

        before  positions of the axes, whether the program has set them, whether rapids are on, and the feed
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
        written = np.where(has, np.maximum(lines.decimals[word], 0), 0).astype(np.int8)
        return cls(rows[0], fast, start, end, known, written, paces, (has & ~known).any(axis=1), modes)


def _carried(word: Indices, values: Array, before: float) -> Array:
    """The values of modal words: each is in force up to the next; `word` (k,): index in `values`, -1: no word."""
    last = np.maximum.accumulate(np.where(word >= 0, np.arange(len(word)), -1))
    return np.where(last >= 0, values[word[last]], before)


class ProgramSteps(Mapping[int, AxisStep]):
    """The steps of a program: by the index of their line, and in columns (n,) or (n, a) as in `AxisStep`.

    at        (lines + 1,) number of the step of each line; -1: none
    before    (lines + 1,) number of steps before each line
    why       (n,) index in `reasons`
    feed      (n,) NaN: none
    across    (n,) 0, 1 or 2 for X, Y or Z
    unsaid    (n,) a word is an increment of an axis whose position the program has not set
    written   (n, a) decimals of the words of axes
    turn      (n,) index in `rotations` (t, 3, 3) of the rotation of the coordinates; 0: they are not turned
    """

    def __init__(self, lines: Sequence[TextLine], names: Sequence[str]) -> None:
        """A program without steps; `add` and `add_run` add them in the order of their lines."""
        self._lines, self._names = lines, names
        self._size, self._waiting = 0, list[AxisStep]()
        self._kept: dict[int, AxisStep] = {}
        """Number -> step, for steps with formulas as words, whose values are not in the line."""
        most, axes = len(lines), len(names)
        self.rows, self.kind = np.empty(most, dtype=np.int32), np.empty(most, dtype=np.int8)
        self.start, self.end, self.said = np.empty((most, axes)), np.empty((most, axes)), np.empty((most, axes), bool)
        self.written = np.empty((most, axes), dtype=np.int8)
        self.why, self.reasons = np.zeros(most, dtype=np.int32), [""]
        self.tcp, self.foreign, self.unsaid, self.unsteady, self.by_vector = (np.zeros(most, bool) for _ in range(5))
        self.length, self.feed, self.unit = np.empty(most), np.empty(most), np.empty(most)
        self.feed_mode, self.across = np.empty(most, dtype=np.int16), np.zeros(most, dtype=np.int8)
        self.centre, self.sweep = np.zeros((most, 3)), np.zeros(most)  # zeros take no memory unless there are arcs
        self.turn, self.rotations = np.zeros(most, dtype=np.int32), np.eye(3)[None]
        self._reason_of = {"": 0}

    def add(self, step: AxisStep) -> None:
        """Add a step."""
        if any(word.value is None for word in self._lines[step.row].path):
            self._kept[self._size + len(self._waiting)] = step
        self._waiting.append(step)
        if len(self._waiting) >= AT_ONCE:
            self._enter_each()

    def add_run(self, run: StraightRun) -> None:
        """Add the steps of a run."""
        self._enter_each()
        count, modes = len(run.rapid), run.modes
        at = slice(self._size, self._size + count)
        self.rows[at] = np.arange(run.row, run.row + count)
        self.kind[at] = np.where(run.rapid, Kind.RAPID, Kind.FEED)
        self.start[at], self.end[at], self.said[at], self.feed[at] = run.start, run.end, run.said, run.feed
        self.unsaid[at], self.written[at] = run.unsaid, run.written
        self.tcp[at], self.length[at], self.unit[at] = modes.tcp, modes.length, modes.unit
        self.feed_mode[at], self.unsteady[at], self.by_vector[at] = modes.feed_mode, modes.unsteady, modes.by_vector
        self.turn[at] = self._turn_of(modes.turn)
        self._size += count

    def done(self) -> ProgramSteps:
        """Finish the columns; all steps have been added."""
        self._enter_each()
        for name, column in list(vars(self).items()):
            if isinstance(column, np.ndarray) and name != "rotations":
                setattr(self, name, column[: self._size])
        self.at = np.full(len(self._lines) + 1, -1, dtype=np.int32)
        self.at[self.rows] = np.arange(self._size)
        self.before = np.searchsorted(self.rows, np.arange(len(self._lines) + 1)).astype(np.int32)
        self.followed = self.why == 0
        """(n,) whether this reader could follow the step."""
        self._made: dict[int, AxisStep] = {}
        return self

    def _enter_each(self) -> None:
        """Put the waiting steps into columns."""
        steps, self._waiting = self._waiting, []
        at = slice(self._size, self._size + len(steps))
        self._size += len(steps)
        if not steps:
            return
        for name in ("kind", "start", "end", "said", "foreign", "tcp", "unsteady", "by_vector", "length", "unit"):
            getattr(self, name)[at] = [getattr(step, name) for step in steps]
        self.rows[at] = [step.row for step in steps]
        self.feed_mode[at] = [step.feed_mode for step in steps]
        self.feed[at] = [NAN if step.feed is None else step.feed for step in steps]
        self.unsaid[at] = [not all(step.said[self._names.index(name)] for name in step.named) for step in steps]
        self.written[at] = [[_digits(step.named.get(name)) for name in self._names] for step in steps]
        for index, step in enumerate(steps, at.start):
            if step.why:
                self.why[index] = self._reason_of.setdefault(step.why, len(self.reasons))
                self.reasons += [step.why] if self.why[index] == len(self.reasons) else []
            if step.kind is Kind.ARC:
                self.across[index] = "XYZ".index(step.across)
                self.centre[index], self.sweep[index] = step.centre, step.sweep
            if step.turn is not None:
                self.turn[index] = self._turn_of(step.turn)

    def _turn_of(self, rotation: Array | None) -> int:
        """The index of a rotation in `rotations`; it is added if it is new."""
        if rotation is None:
            return 0
        same = (self.rotations[1:] == rotation).all(axis=(1, 2))
        if not same.any():
            self.rotations = np.concatenate([self.rotations, rotation[None]])
            return len(self.rotations) - 1
        return 1 + int(np.argmax(same))

    def step_of(self, row: int) -> int:
        """The number of the step of a line; -1: none."""
        return int(self.at[row]) if 0 <= row < len(self.at) else -1

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[int]:
        return iter(self.rows.tolist())

    def __contains__(self, row: object) -> bool:
        return isinstance(row, int) and 0 <= row < len(self.at) and bool(self.at[row] >= 0)

    def __getitem__(self, row: int) -> AxisStep:
        at = self.step_of(row)
        if at < 0:
            raise KeyError(row)
        found = self._kept.get(at) or self._made.get(at)
        if found is None:
            if len(self._made) >= KEPT:
                self._made.clear()
            found = self._made[at] = self._step(row, at)
        return found

    def _step(self, row: int, at: int) -> AxisStep:
        """The step of a line, made from the columns."""
        feed, arc = float(self.feed[at]), self.kind[at] == Kind.ARC
        x, y, z = self.centre[at].tolist() if arc else (NAN, NAN, NAN)
        return AxisStep(
            row,
            Kind(int(self.kind[at])),
            self.start[at].tolist(),
            self.end[at].tolist(),
            self.said[at].tolist(),
            {word.name: word for word in self._lines[row].path if word.name in self._names},
            self.reasons[self.why[at]],
            bool(self.tcp[at]),
            float(self.length[at]),
            None if math.isnan(feed) else feed,
            int(self.feed_mode[at]),
            float(self.unit[at]),
            centre=(x, y, z),
            across="XYZ"[self.across[at]] if arc else "Z",
            sweep=float(self.sweep[at]),
            foreign=bool(self.foreign[at]),
            unsteady=bool(self.unsteady[at]),
            by_vector=bool(self.by_vector[at]),
            turn=self.rotations[self.turn[at]] if self.turn[at] else None,
        )


def _digits(word: TextWord | None) -> int:
    """Number of decimals of a word with a plain number; 0 for a formula, or without a word."""
    return 0 if word is None or word.value is None else min(word.decimals, MOST_DIGITS)
