"""The verdict on a corrected program: does the machine with errors now do what the original meant?

The control's canonical motions of both programs are compared in machine axes. A corrected command is first replaced
by the command with which a perfect machine would have its tip there (`Machine.embedded`), so what is left to compare
are two paths of a perfect machine. Ends of motions must agree to half an output step in every axis of the program,
the tip along the way to the tolerance plus that rounding, motions that may not be touched exactly, and every other
canonical call must come in the same place with the same words.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from differential import calls, paths
from differential.canon import ARC, FEED, RAPID, SPLINE, Canon
from differential.errors import Machine
from differential.segment import Fate, Segments, match, untouched

Floats = NDArray[np.float64]

FLOAT_SLACK = 1e-5
"""mm: two exact models may differ in the order of composing small rotations: (3e-5 rad)**2 times 10 m."""
DENSE = (0.125, 0.25, 0.5, 0.75, 0.9)
PRINTED = 3e-3  # mm: four decimals of an inch, rounded twice
LARGEST_RADIUS = 5.0  # mm, of a cutter
LEFT = 0.2  # mm: farther than any correction leads an axis that is left
MOST_DENSE = 4000  # motions of a file that are looked at along their whole length, evenly spread


@dataclass(frozen=True, slots=True)
class Terms:
    """What the judge holds a corrected program to.

    tolerance    mm, of the tip along feeds and arcs
    step         mm, output step of linear words; rotary_step in degrees
    refused      lines that the product says it left as they were, with its reason
    left         line -> columns of axes that the product says it left where they stood
    passed       line -> True if a motion of that line must not be touched
    rapids       hold rapids to the tolerance along their way too
    rotary       the strategy moves rotary axes: their ends are free by so many degrees
    tool_length  tool number -> mm
    whole        line -> how far, mm, the product says that the tip leaves its path there, since it must not be split
    calls        compare the calls that are no motions too
    """

    tolerance: float = 1e-3
    step: float = 1e-3
    rotary_step: float = 1e-3
    refused: Mapping[int, str] = field(default_factory=dict)
    left: Mapping[int, frozenset[int]] = field(default_factory=dict)
    passed: Callable[[int], bool] = lambda line: False
    rapids: bool = False
    rotary: float = 0.0
    tool_length: Mapping[int, float] = field(default_factory=dict)
    whole: Mapping[int, float] = field(default_factory=dict)
    calls: bool = True


@dataclass(slots=True)
class Verdict:
    """Counts of original motions by fate, the worst distances in mm with their lines, and every complaint."""

    motions: int = 0
    compensated: int = 0
    passed: int = 0
    refused: int = 0
    reasons: Counter[str] = field(default_factory=Counter)
    worst: dict[str, tuple[float, int]] = field(default_factory=dict)
    complaints: list[str] = field(default_factory=list)

    @property
    def right(self) -> bool:
        """Nothing to complain about."""
        return not self.complaints

    def note(
        self, what: str, distance: Floats, allowed: Floats, lines: NDArray[np.int64], excused: Floats | None = None
    ) -> None:
        """Keep the worst, and complain of what is more than allowed (the first three of a kind).

        excused  of the allowed, what comes from a motion before that was not corrected: left out of the worst
        """
        if not distance.size:
            return
        own = distance if excused is None else np.where(excused > 0, 0.0, distance)
        at = int(np.argmax(own))
        if own[at] >= self.worst.get(what, (-1.0, 0))[0]:
            self.worst[what] = (float(own[at]), int(lines[at]))
        for row in np.flatnonzero(~(distance <= allowed))[:3]:
            self.complain(int(lines[row]), f"{what}: {distance[row] * 1e3:.3f} um, allowed {allowed[row] * 1e3:.3f}")

    def complain(self, line: int, text: str) -> None:
        """One more complaint."""
        self.complaints.append(f"line {line}: {text}")

    def __str__(self) -> str:
        figures = ", ".join(f"{what} {value * 1e3:.3f} um (line {at})" for what, (value, at) in self.worst.items())
        counts = f"{self.motions} motions: {self.compensated} compensated, {self.passed} passed, {self.refused} refused"
        return "\n".join([f"{counts}; {figures}", *self.complaints[:10]])


def judge(original: Canon, fixed: Canon, machine: Machine, terms: Terms | None = None) -> Verdict:
    """Compare a corrected program with the original, both as the control runs them."""
    return _Judge(original, fixed, machine, terms or Terms()).run()


class _Judge:
    def __init__(self, original: Canon, fixed: Canon, machine: Machine, terms: Terms) -> None:
        self.original, self.fixed, self.machine, self.terms = original, fixed, machine, terms
        self.verdict = Verdict(motions=len(original))
        self.half = terms.step / 2 + FLOAT_SLACK
        self.rough = PRINTED * ~original.exact, PRINTED * ~fixed.exact
        self.length = _lengths(fixed, terms)
        left = [terms.left.get(int(line), frozenset()) for line in original.line]
        rows = [[column in columns for column in range(9)] for columns in left]
        self.left = np.array(rows, dtype=np.bool_).reshape(-1, 9)

    def run(self) -> Verdict:
        if not (self.original.accepted and self.fixed.accepted):
            self.verdict.complain(0, f"the control refuses: {self.original.error or self.fixed.error}")
            return self.verdict
        linear = 2 * self.half + sum(float(rough.max(initial=0.0)) for rough in self.rough)
        rotary = max(linear, self.terms.rotary)
        near = np.array([linear] * 3 + [rotary] * 3 + [linear] * 3) + LEFT * self.left
        by_rule = np.array([self.terms.passed(int(line)) for line in self.original.line], dtype=np.bool_)
        segments, self.seen = match(
            self.original, self.fixed, self.machine, self.length, near, self.terms.tolerance, by_rule, self.left
        )
        for k, text in segments.complaints:
            self.verdict.complain(int(self.original.line[k]), text)
        self.started = self.machine.embedded(self.fixed.start, self.length) if len(self.fixed) else self.seen
        self.count(segments)
        self.stood_still(segments)
        self.ends(segments)
        self.along(segments)
        self.cycles(segments)
        for line, text in calls.compare(self.original, self.fixed, segments) if self.terms.calls else ():
            self.verdict.complain(line, text)
        return self.verdict

    def halves(self, of: NDArray[np.int64], pieces: NDArray[np.int64]) -> Floats:
        """Half an output step, and what is not known of motions of which only the printed numbers are."""
        start, end = self.rough
        unknown = start[of] + start[np.maximum(of - 1, 0)] + end[pieces] + end[np.maximum(pieces - 1, 0)]
        return self.half + np.asarray(unknown)

    # -- what became of the motions -----------------------------------------------------------------------------------

    def count(self, segments: Segments) -> None:
        """Every motion is compensated, passed by rule, or refused and said to be."""
        fates = Counter(segments.fate.tolist())
        self.verdict.compensated = fates[Fate.COMPENSATED] + fates[Fate.CYCLE] + fates[Fate.CONTOUR]
        for k in np.flatnonzero(segments.fate == Fate.UNCHANGED):
            line = int(self.original.line[k])
            if self.terms.passed(line) or self.rests(segments, k):
                self.verdict.passed += 1
            elif (reason := self.reason(k)) is not None:
                self.verdict.refused += 1
                self.verdict.reasons[reason] += 1
            else:
                self.verdict.complain(line, f"left uncorrected in silence ({self.miss(segments, k):.1f} um off)")
        for k in np.flatnonzero(segments.fate == Fate.COMPENSATED):
            line = int(self.original.line[k])
            if self.terms.passed(line) and not untouched(self.original, self.fixed, k, segments.last[k]):
                self.verdict.complain(line, "a motion that is passed by rule was corrected")

    def stood_still(self, segments: Segments) -> None:
        """An axis that is said to be left where it stood makes the way of the original, and no other.

        Not so beside a contour, nor from there: where the axis stands then is where the control has offset it to.
        """
        contour = segments.fate == Fate.CONTOUR
        offset = contour | np.append(False, contour[:-1])
        rows = np.flatnonzero(self.left.any(axis=1) & (segments.fate != Fate.WRONG) & ~offset)
        whole = self.fixed.end[segments.last[rows]] - self.fixed.start[segments.first[rows]]
        way = np.abs(whole - (self.original.end - self.original.start)[rows])
        moved = (way > 1e-6 + 2 * self.rough[0][rows, None]) & self.left[rows]
        for line in self.original.line[rows[moved.any(axis=1)]][:3]:
            self.verdict.complain(int(line), "an axis that was to be left was moved")

    def without(self, off: Floats, command: Floats, left: NDArray[np.bool_], length: Floats) -> Floats:
        """How far tips are off (n, 3) but for the ways along which axes (9,) that were left would take them, (n,)."""
        columns = [column for column in np.flatnonzero(left) if column in self.machine.linear]
        if not columns:
            return np.linalg.norm(off, axis=1)
        tip = self.machine.tip(command, length)
        ways = np.stack([self.machine.tip(command + np.eye(9)[column], length) - tip for column in columns], axis=-1)
        return np.linalg.norm(off - (ways @ (np.linalg.pinv(ways) @ off[..., None]))[..., 0], axis=1)

    def rests(self, segments: Segments, k: int) -> bool:
        """A motion word alone makes LinuxCNC call a motion to where it is."""
        j = segments.last[k]
        moves = (self.original.end[k] - self.original.start[k], self.fixed.end[j] - self.fixed.start[j])
        return all(bool(np.all(np.abs(move) < 1e-9)) for move in moves)

    def reason(self, k: int) -> str | None:
        """Why a motion was refused, if it was.

        A spline is told at its last block, and a turning cycle at no line of its own: they belong to a refused line
        since the motion before.
        """
        line = self.original.line
        if line[k] > 0 and self.original.kind[k] != SPLINE:
            return self.terms.refused.get(int(line[k]))
        known = line[: k + 1][(line[: k + 1] > 0) & (np.arange(k + 1) < k)]
        first = int(known[-1]) if known.size else 0
        last = next((int(each) for each in line[k:] if each > 0), first)
        return next((self.terms.refused[each] for each in range(first, last + 1) if each in self.terms.refused), None)

    def miss(self, segments: Segments, k: int) -> float:
        return float(np.abs(self.seen[segments.last[k]] - self.original.end[k])[:3].max()) * 1e3

    # -- ends ---------------------------------------------------------------------------------------------------------

    def ends(self, segments: Segments) -> None:
        """Half a step at the ends of lines, tolerance plus half a step at those of arcs, in the program's axes."""
        said = np.isin(self.original.line, list(self.terms.refused))
        done = np.flatnonzero((segments.fate == Fate.COMPENSATED) & ~said)
        last = segments.last[done]
        off = np.where(self.left[done], 0.0, self.seen[last] - self.original.end[done])
        off = np.abs(_turn_back(off, self.original.rotation[done]))
        half = self.halves(done, last)
        arc = (self.original.kind[done] == ARC) | (self.fixed.kind[last] == ARC)
        linear = off[:, self.machine.linear].max(axis=1, initial=0.0)
        lines = self.original.line[done]
        if not self.terms.rotary:
            self.verdict.note("line ends", linear[~arc], half[~arc], lines[~arc])
            self.verdict.note("arc ends", linear[arc], half[arc] + self.terms.tolerance, lines[arc])
        free = half - self.half + self.terms.rotary + 1e-9
        rotary = off[:, self.machine.rotary].max(axis=1, initial=0.0)
        self.verdict.note("rotary ends (degree)", rotary, free, lines)

    # -- along the way ------------------------------------------------------------------------------------------------

    def along(self, segments: Segments) -> None:
        """The tip along every piece of a sample of the compensated motions."""
        kinds = (FEED, ARC, RAPID) if self.terms.rapids else (FEED, ARC)
        said = np.isin(
            self.original.line, list(self.terms.refused)
        )  # a full circle ends where it begins, refused or not
        chosen = np.flatnonzero((segments.fate == Fate.COMPENSATED) & ~said & np.isin(self.original.kind, kinds))
        chosen = chosen[:: max(1, len(chosen) // MOST_DENSE)]
        owner = segments.owner(len(self.fixed))
        pieces = np.flatnonzero(np.isin(owner, chosen))
        if not pieces.size:
            return
        of = owner[pieces]
        entry, exit_ = self.fractions(segments, pieces, of)
        for u in DENSE:
            self.sample("along the way", segments, pieces, of, u, entry, exit_)
        inner = pieces != segments.last[of]
        self.sample("inserted points", segments, pieces[inner], of[inner], 1.0, entry[inner], exit_[inner])

    def fractions(self, segments: Segments, pieces: NDArray[np.int64], of: NDArray[np.int64]) -> tuple[Floats, Floats]:
        """On the original motion, the fractions at which each piece begins and ends; they must grow."""
        begins, ends = pieces == segments.first[of], pieces == segments.last[of]
        leaving = paths.fraction_of(self.original, of, self.seen[pieces], np.where(begins, 0.0, 1e-12))
        leaving += paths.turns_before(self.original, of, leaving, begins)
        leaving[ends] = 1.0
        entering = np.where(begins, 0.0, np.roll(leaving, 1))
        for row in np.flatnonzero(leaving < entering - 1e-6)[:3]:
            self.verdict.complain(int(self.original.line[of[row]]), "the pieces of this motion go back and forth")
        return entering, leaving

    def sample(
        self, what: str, segments: Segments, pieces: NDArray[np.int64], of: NDArray[np.int64], u: float,
        entry: Floats, exit_: Floats,
    ) -> None:  # fmt: skip
        """Distance of the real tip from the intended path at fraction u of every piece.

        An axis that was left takes the tip along the path too, so that another of its points is the nearest one. There
        the tip is compared with where it should be at the same time.
        """
        if not pieces.size:
            return
        command = paths.at(self.fixed, pieces, np.full(len(pieces), u))
        real = self.machine.actual_tip(command, self.length[pieces])
        guess = entry + u * (exit_ - entry)
        low, high = entry - 0.02, exit_ + 0.02

        def intended(fraction: Floats) -> Floats:
            return self.machine.tip(paths.at(self.original, of, fraction), self.length[pieces])

        distance = paths.nearest(intended, real, guess, low, high)[1]
        off = real - intended(guess)
        for left in np.unique(self.left[of], axis=0):
            if left.any():
                rows = (self.left[of] == left).all(axis=1)
                distance[rows] = self.without(off[rows], command[rows], left, self.length[pieces[rows]])
        excused = self.entry_error(segments, pieces, of) * (1 - u)
        allowed = self.terms.tolerance + np.sqrt(3) * self.halves(of, pieces) + excused
        allowed = allowed + self.rotary_rounding(pieces, of, segments, command)
        allowed = allowed + np.array([self.terms.whole.get(int(line), 0.0) for line in self.original.line[of]])
        self.verdict.note(what, distance, allowed, self.original.line[of], excused)

    def entry_error(self, segments: Segments, pieces: NDArray[np.int64], of: NDArray[np.int64]) -> Floats:
        """How far the tip is off where a motion begins, if the one before was not corrected; it fades on the way."""
        begins = pieces == segments.first[of]
        off = np.linalg.norm(np.where(self.left[of], 0.0, self.started[pieces] - self.original.start[of]), axis=1)
        return np.where(begins & (off > 2 * self.halves(of, pieces)), off, 0.0)

    def rotary_rounding(
        self, pieces: NDArray[np.int64], of: NDArray[np.int64], segments: Segments, command: Floats
    ) -> Floats:
        """What half a step of the rotary words of an inserted block may do to the tip."""
        inner = (pieces != segments.last[of]) | (pieces != segments.first[of])
        total = np.zeros(len(pieces))
        for axis in self.machine.rotary:
            turned = np.abs(self.original.end[of, axis] - self.original.start[of, axis]) > 1e-9
            nudged = command + np.eye(9)[axis] * self.terms.rotary_step / 2
            arm = self.machine.tip(nudged, self.length[pieces]) - self.machine.tip(command, self.length[pieces])
            total += np.where(inner & turned, np.linalg.norm(arm, axis=1), 0.0)
        return total

    # -- cycles and contours ------------------------------------------------------------------------------------------

    def cycles(self, segments: Segments) -> None:
        """The bottom of a hole to half a step; the rest of a cycle to what the correction varies over its depth."""
        for fate, what in ((Fate.CYCLE, "cycles"), (Fate.CONTOUR, "contours")):
            rows = np.setdiff1d(np.flatnonzero(segments.fate == fate), segments.loose)
            if not rows.size:
                continue
            miss = np.where(self.left[rows], 0.0, self.seen[segments.last[rows]] - self.original.end[rows])
            off = np.abs(_turn_back(miss, self.original.rotation[rows]))
            linear, lines = off[:, self.machine.linear].max(axis=1), self.original.line[rows]
            refused = np.isin(lines, list(self.terms.refused))
            half = self.halves(rows, segments.last[rows])
            if fate == Fate.CYCLE:
                bottom = _bottoms(self.original, rows) & ~refused
                self.verdict.note("cycle bottoms", linear[bottom], half[bottom], lines[bottom])
            near = half + (self.variation(segments, rows) if fate == Fate.CYCLE else self.offset_change(rows))
            self.verdict.note(what, linear[~refused], near[~refused], lines[~refused])
            self.verdict.refused += int(refused.sum())
            self.verdict.compensated -= int(refused.sum())
            self.verdict.reasons.update(self.terms.refused[int(line)] for line in lines[refused])

    def variation(self, segments: Segments, rows: NDArray[np.int64]) -> Floats:
        """How much the correction differs over the holes of one cycle and the way to the first of them.

        The height to which a cycle returns is that from which it was called, and R may not sink below where the
        control stands: there the correction of an earlier hole holds, or what a refused motion before has left.
        """
        spread = np.zeros(len(rows))
        for group in np.split(np.arange(len(rows)), np.flatnonzero(np.diff(rows) > 1) + 1):
            places = np.concatenate([self.original.start[rows[group[:1]]], self.original.end[rows[group]]])
            length = _lengths(self.original, self.terms)[rows[group[0]]]
            some = (self.machine.corrected(places, length) - places)[:, self.machine.linear]
            spread[group] = np.ptp(some, axis=0).max()
            first = rows[group[0]]
            if first and int(self.original.line[first - 1]) in self.terms.refused:
                off = self.started[segments.first[first]] - self.original.start[first]
                spread[group] += np.abs(off[self.machine.linear]).max()
        return spread

    def offset_change(self, rows: NDArray[np.int64]) -> Floats:
        """What the correction changes within the largest radius round a contour, and what rounding does at a corner."""
        places, length = self.original.end[rows], _lengths(self.original, self.terms)[rows]
        total = np.full(len(rows), 2 * self.terms.step)
        for axis in (0, 1):
            shift = np.eye(9)[axis] * LARGEST_RADIUS
            change = self.machine.corrected(places + shift, length) - self.machine.corrected(places - shift, length)
            total += np.abs(change - 2 * shift).max(axis=1)
        return total


def _bottoms(canon: Canon, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
    """The motions that end at the bottom of a hole: feeds to the lowest point of their block, along Z."""
    lowest: dict[int, float] = {}
    for row in rows:
        line = int(canon.line[row])
        lowest[line] = min(lowest.get(line, np.inf), float(canon.end[row, 2]))
    deep = np.array([canon.end[row, 2] <= lowest[int(canon.line[row])] + 1e-9 for row in rows])
    return deep & (canon.kind[rows] == FEED)


def _lengths(canon: Canon, terms: Terms) -> Floats:
    """(n,) length of the tool: the offset in force, which tells it, else that of the tool in the spindle."""
    table = np.array([terms.tool_length.get(int(number), 0.0) for number in canon.tool], dtype=np.float64)
    return np.where(canon.offset_z != 0, canon.offset_z, table)


def _turn_back(vectors: Floats, angle: Floats) -> Floats:
    """Machine differences (n, 9) in the axes of the program, which may be turned about Z."""
    out, cosine, sine = vectors.copy(), np.cos(angle), np.sin(angle)
    out[:, 0], out[:, 1] = (
        vectors[:, 0] * cosine + vectors[:, 1] * sine,
        vectors[:, 1] * cosine - vectors[:, 0] * sine,
    )
    return out
