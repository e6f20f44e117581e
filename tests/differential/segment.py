"""Which motions of a corrected program stand for which motion of the original: one or more each, in order.

A corrected motion is compared by where it takes the tool on the machine with errors. It ends where the original ends
(compensated), or it is the original's own command (unchanged), or it is a piece on the way. A canned cycle and a
contour under cutter compensation are the control's own making and are matched block by block.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from differential import paths
from differential.canon import ARC, FEED, PROBE, RAPID, SPLINE, TAP, Canon
from differential.errors import Machine

Floats = NDArray[np.float64]

LOOKAHEAD = 4000  # pieces that one motion may have
FAR = 1.0  # mm, degree: a piece farther from the original path than this belongs to something else
LINEAR = np.array([1.0] * 3 + [0.0] * 3 + [1.0] * 3)
SMALL = 0.3  # mm: as large as a correction may be
STILL = 1e-6  # mm, degree: rounding of what the interpreter tells
ONE_PECK = 3  # motions: down, out, and back
CYCLES = {730, 760, *range(810, 900, 10)}


class Fate(IntEnum):
    """What became of an original motion."""

    COMPENSATED = 0
    UNCHANGED = 1
    CYCLE = 2
    CONTOUR = 3
    WRONG = 4


@dataclass(frozen=True, slots=True)
class Segments:
    """For every original motion its fate and its corrected motions first[k] : last[k] + 1.

    complaints  (original motion, text) where they cannot be told
    loose       motions of cycles that have no counterpart of their own, and are compared here
    """

    fate: NDArray[np.int64]
    first: NDArray[np.int64]
    last: NDArray[np.int64]
    complaints: tuple[tuple[int, str], ...]
    loose: NDArray[np.int64]

    def owner(self, n: int) -> NDArray[np.int64]:
        """(n,) the original motion of each corrected one, -1 for none."""
        owner = np.full(n, -1)
        for k, (first, last) in enumerate(zip(self.first, self.last, strict=True)):
            owner[first : last + 1] = k
        return owner


@dataclass(slots=True)
class _Matcher:
    """Walks both programs at once."""

    original: Canon
    fixed: Canon
    seen: Floats
    near: Floats
    tolerance: float
    by_rule: NDArray[np.bool_]
    left: NDArray[np.bool_]
    fate: list[int] = field(default_factory=list)
    first: list[int] = field(default_factory=list)
    last: list[int] = field(default_factory=list)
    complaints: list[tuple[int, str]] = field(default_factory=list)
    loose: list[int] = field(default_factory=list)
    j: int = 0

    def run(self) -> Segments:
        k = 0
        while k < len(self.original):
            if int(self.original.mode[k]) in CYCLES and not self.by_rule[k]:  # G28 leaves the mode as it is
                k = self.block(k, Fate.CYCLE)
            elif self.original.side[k] in (410, 420):
                k = self.block(k, Fate.CONTOUR)
            else:
                self.motion(k)
                k += 1
        if self.j < len(self.fixed):
            self.complaints.append((len(self.original) - 1, f"{len(self.fixed) - self.j} motions too many at the end"))
        fate, first, last, loose = (
            np.array(part, dtype=np.int64) for part in (self.fate, self.first, self.last, self.loose)
        )
        return Segments(fate, first, last, tuple(self.complaints), loose)

    def motion(self, k: int) -> None:
        """Consume the corrected motions of one original motion."""
        progress = np.zeros(1)
        for j in range(self.j, min(self.j + LOOKAHEAD, len(self.fixed))):
            if not self.same_kind(k, j):
                break
            alike = j == self.j and self.original.kind[k] == self.fixed.kind[j]
            left = bool(alike and untouched(self.original, self.fixed, k, j))
            if self.arrives(k, j) and not (left and self.by_rule[k]) and self.went_round(k, j, progress):
                return self.take(k, self.nearest(k, j), Fate.COMPENSATED)
            if left:
                return self.take(k, j, Fate.UNCHANGED)
            progress = self.progress(k, j, progress)
            if np.isnan(progress[0]):
                break
        self.complaints.append((k, self.describe(k)))
        return self.take(k, min(self.j, len(self.fixed) - 1), Fate.WRONG)

    def take(self, k: int, last: int, fate: Fate) -> None:
        self.fate.append(fate)
        self.first.append(self.j)
        self.last.append(last)
        self.j = last + 1

    def same_kind(self, k: int, j: int) -> bool:
        original, fixed = self.original.kind[k], self.fixed.kind[j]
        return bool(original == fixed or (original == ARC and fixed == FEED))

    def arrives(self, k: int, j: int) -> bool:
        """The tool gets where the original takes it, to a step; probing, tapping and splines never are corrected."""
        if self.original.kind[k] in (PROBE, TAP, SPLINE):
            return False
        near = self.near[k] + (self.tolerance * LINEAR if self.original.kind[k] == ARC else 0.0)
        return bool(np.all(np.abs(self.seen[j] - self.original.end[k]) <= near))

    def went_round(self, k: int, j: int, progress: Floats) -> bool:
        """A full circle ends where it begins: to be there is not enough."""
        closed = self.original.kind[k] == ARC and bool(
            np.all(np.abs(self.original.end[k] - self.original.start[k]) < 1e-3)
        )
        return not closed or progress[0] > 0.5 or int(self.fixed.kind[j]) == ARC

    def nearest(self, k: int, j: int) -> int:
        """The last pieces of a finely cut arc may all be near its end: the one that is nearest.

        What moves an axis that the arc left where it stood is the beginning of the next motion.
        """
        while self.original.kind[k] == ARC and j + 1 < len(self.fixed) and self.arrives(k, j + 1):
            moved = np.abs(self.fixed.end[j + 1] - self.fixed.start[j + 1]) > STILL
            if (moved & self.left[k]).any() or not self.same_kind(k, j + 1):
                break
            if self.distance(k, j + 1) >= self.distance(k, j):
                break
            j += 1
        return j

    def distance(self, k: int, j: int) -> float:
        return float(np.abs(self.seen[j] - self.original.end[k]).max())

    def progress(self, k: int, j: int, before: Floats) -> Floats:
        """(1,) the fraction of the original motion that a piece ends at, NaN if it ends far from the path."""
        row, point = np.array([k]), self.seen[j][None]
        fraction = paths.fraction_of(self.original, row, point, before)
        near = np.all(np.abs(paths.at(self.original, row, fraction) - point) <= FAR)
        return fraction if near else np.full(1, np.nan)

    def pecks(self, k: int, stop: int, end: int) -> int:
        """A depth that is a multiple of Q by a hair may take a peck more or less; compared are the nearest ones."""
        there = self.seen[self.j : end, :3]
        for n in range(k, stop):
            off = float(np.abs(there - self.original.end[n, :3]).max(axis=1).min())
            deepest = self.original.end[n, 2] <= self.original.end[k:stop, 2].min() + 1e-9
            if off > (self.near[n, 2] if deepest else SMALL):
                self.complaints.append((n, f"no motion of the cycle comes nearer than {off:.4f} mm"))
            self.fate.append(Fate.CYCLE)
            self.first.append(min(self.j + n - k, end - 1))
            self.last.append(self.first[-1])
            self.loose.append(n)
        self.first[-1] = self.last[-1] = end - 1
        self.j = end
        return stop

    def rises(self, k: int, stop: int) -> bool:
        """Somewhere before its hole the corrected cycle has a motion along Z that is no longer than a correction."""
        length = np.abs(self.fixed.end[self.j : self.j + 2] - self.fixed.start[self.j : self.j + 2])
        return bool(np.any((length.max(axis=1) < SMALL) & (self.fixed.kind[self.j : self.j + 2] == RAPID)))

    def describe(self, k: int) -> str:
        j = min(self.j, len(self.fixed) - 1)
        off = self.seen[j] - self.original.end[k]
        axis = int(np.argmax(np.abs(off)))
        return f"ends {off[axis]:+.4f} off in {'XYZABCUVW'[axis]} (kinds {self.original.kind[k]}, {self.fixed.kind[j]})"

    def block(self, k: int, fate: Fate) -> int:
        """Match a block that the control expands: as many motions on both sides, or a complaint.

        A cycle that is called a few um below its R plane first rises to it: such a motion may come or go.
        """
        stop, end = _same_line(self.original, k), _same_line(self.fixed, self.j)
        if stop - k + 1 == end - self.j and self.rises(k, stop):
            self.j += 1
        if fate == Fate.CYCLE and 0 < abs((stop - k) - (end - self.j)) <= ONE_PECK:
            return self.pecks(k, stop, end)
        pairs = min(stop - k, end - self.j)
        for n in range(k, stop):
            self.fate.append(fate)
            self.first.append(min(self.j + min(n - k, pairs - 1), len(self.fixed) - 1))
            self.last.append(self.first[-1])
        if stop - k != end - self.j:
            self.complaints.append((k, f"{stop - k} motions of a block became {end - self.j}"))
        self.j = end
        return stop


def untouched(original: Canon, fixed: Canon, k: int, j: int) -> bool:
    """The command is the original's; an axis without a word, or with an increment, stays off by what it was."""
    turn = -original.rotation[k]
    off = _turned(fixed.end[j] - original.end[k], turn)
    carried = _turned(fixed.start[j] - original.start[k], turn)
    return bool(np.all((np.abs(off) <= 1e-6) | (np.abs(off - carried) <= 1e-6)))


def _same_line(canon: Canon, k: int) -> int:
    """One past the last motion that comes from the same line as motion k."""
    stop = k + 1
    while stop < len(canon) and canon.line[stop] == canon.line[k]:
        stop += 1
    return min(stop, len(canon))


def _turned(vector: Floats, angle: float) -> Floats:
    """Turn X and Y of a machine vector, into the program's axes."""
    out, cosine, sine = vector.copy(), np.cos(angle), np.sin(angle)
    out[0], out[1] = vector[0] * cosine - vector[1] * sine, vector[0] * sine + vector[1] * cosine
    return out


def match(
    original: Canon,
    fixed: Canon,
    machine: Machine,
    length: Floats,
    near: Floats,
    tolerance: float,
    by_rule: NDArray[np.bool_],
    left: NDArray[np.bool_],
) -> tuple[Segments, Floats]:
    """The segments, and (m, 9) where the corrected motions end as the machine with errors does them.

    length     (m,) tool length of the corrected motions, mm
    near       (n, 9) mm, degree: how near ends must be to count as reached; the judge looks closer afterwards
    tolerance  mm: added for the ends of arcs
    by_rule    (n,) original motions that must not be touched
    left       (n, 9) axes that were left where they stood
    """
    seen = machine.embedded(fixed.end, length) if len(fixed) else fixed.end
    return _Matcher(original, fixed, seen, near, tolerance, by_rule, left).run(), seen
