"""Comparison of two programs on one machine while they are read: does the second one cut what the first one means?

The paths are compared as curves in the workpiece, without knowledge of how the second program was made: from every
sample of the actual path of the second program to the nearest point of the intended path of the first, and back, so
that no cut may be missing. The nearest point is searched near the same length of path, so that a neighbouring pass of
the same cut is not taken for the matching one.

    original --> intended path --+--> there:  from the actual path of the other to the intended path
             --> actual path     |    back:   from the intended path to the actual path of the other
    other    --> actual path ----+    before: from the actual path of the original to the intended path

Of every path, only the part is held on which a nearest point may lie. If that is not enough, `NearestNotHereError` is
raised, and both programs have to be read as a whole.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import field, replace
from functools import partial

import numpy as np

from ncfix.arrays import Array, Index, Signs, stacked, taken
from ncfix.compensate.account import NoFigureReason, not_looked_at
from ncfix.compensate.figures.backlash import BacklashBodies, Flank
from ncfix.compensate.figures.curve import Curve, CurvePoints, Stretches
from ncfix.compensate.figures.nearest import Nearest, Search, over_holes, over_peaks
from ncfix.compensate.figures.simulation import SimulatedErrors, actual_tip
from ncfix.compensate.following import Task
from ncfix.compensate.parts import MachineParts
from ncfix.compensate.plan.intent import Intent, left_in_cuts
from ncfix.compensate.plan.kinematics import matters
from ncfix.compensate.plan.written import rounding_of_arcs
from ncfix.compensate.workers import Read
from ncfix.control.moves import Moves
from ncfix.control.trace import joined_moves, motions_at
from ncfix.diagnostics import DifferenceError, Message
from ncfix.machine import Machine, State
from ncfix.text.tree import Program
from ncfix.values import frozen, mutable

BESIDE = 64
"""Number of motions before and behind a motion that are examined for reversals of axes near it."""


@frozen
class CutPath:
    """The path that a part of a program cuts. `rows` of its curves are lines.

    actual    the path on the real machine
    intended  the path on a perfect machine; None if it is not needed
    flank     the other possible places of the tip near reversals; None if no error depends on direction
    unseen    reason why feeds, arcs and holes are not examined -> their lines, one for each
    left      letter of a linear axis -> lines of motions that cannot be corrected along it
    last      whether it is the last part
    rounding  largest tip error by rounding to the control's digits, mm
    bodies    the bodies of axes with play; None if no error depends on direction
    """

    actual: Curve
    intended: Curve | None
    flank: Flank | None
    unseen: dict[NoFigureReason, Index]
    left: dict[str, Index]
    last: bool
    rounding: float
    bodies: BacklashBodies | None = None

    @classmethod
    def of(
        cls, intent: Intent, lines: Index, rows: slice, last: bool, meant: bool, first: Array | None = None
    ) -> CutPath:
        """The path of motions `rows` of a program; motions before and behind them are only examined for reversals.

        lines  (n,) lines of all motions
        meant  with the intended path
        first  (n_axes,) places of the bodies of axes before all motions, see `BacklashBodies`
        """

        def counted(curve: Curve) -> slice:
            first, stop, _ = rows.indices(len(intent.moves))
            return slice(*np.searchsorted(curve.rows, [first, stop]).tolist())

        def in_lines(curve: Curve) -> Curve:
            found = curve.taken(counted(curve))
            return replace(found, rows=lines[found.rows])

        def lines_of(found: Index) -> Index:
            first, stop, _ = rows.indices(len(intent.moves))
            return lines[found[(found >= first) & (found < stop)]]

        stretches = Stretches.of(intent)
        bodies = BacklashBodies.of(intent, stretches, first) if matters(intent.machine) else None
        stretches = bodies.divided() if bodies else stretches
        actual = Curve.through(stretches, bodies.tip if bodies else partial(actual_tip, intent))
        intended = in_lines(Curve.through(stretches, intent.tip)) if meant else None
        flank = taken(Flank.of(bodies, actual), counted(actual)) if bodies else None
        left = {axis: lines_of(found) for axis, found in left_in_cuts(intent.moves).items()}
        digits = rounding_of_arcs(intent.machine, np.nan_to_num(intent.moves.sweep[rows]))
        unseen = {why: lines_of(found) for why, found in not_looked_at(intent.moves).items()}
        return cls(in_lines(actual), intended, flank, unseen, left, last, digits, bodies)


def whole(machine: Machine, program: Program, moves: Moves, meant: bool = False) -> Iterator[CutPath]:
    """The path that a whole program cuts, as one part."""
    yield CutPath.of(Intent(machine, moves, State()), program.lines(moves.block), slice(None), True, meant)


@frozen
class PartEnd:
    """The last motions of a part. The path of the last `BESIDE` is made with the next part, for reversals behind them.

    moves      up to twice `BESIDE` motions
    lines      (n,) their lines
    direction  (n_axes,) direction in which the axes came to the start of the first of them
    sides      (n_axes,) places of the bodies there, see `BacklashBodies`
    """

    moves: Moves
    lines: Index
    direction: Signs
    sides: Array

    @classmethod
    def behind(cls, bodies: BacklashBodies, lines: Index) -> PartEnd:
        """The end of the motions of `bodies`; `lines` (n,): their lines."""
        start, moves = max(len(lines) - 2 * BESIDE, 0), bodies.intent.moves
        last = motions_at(moves, np.arange(start, len(lines)))
        return cls(last, lines[start:], bodies.came(start), bodies.before(start))


@frozen
class CutPaths:
    """The path that a program cuts, part after part while it is read.

    read   returns the next `size` bytes of the text; no bytes at its end
    meant  with the intended path
    said   messages from following the program, filled with the last part
    """

    task: Task
    read: Read
    meant: bool
    said: list[Message] = field(default_factory=list)

    def __iter__(self) -> Iterator[CutPath]:
        """The parts. Raises what reading and following raise, and UsageError for values that the setup lacks."""
        task = self.task
        parts = MachineParts.of(task, self.read)
        machine = parts.set_up
        around = None
        for continued in parts:
            moves, lines = continued.part.moves, continued.part.lines
            if continued.part.last:
                self.said.extend(parts.messages)
            if not matters(machine):
                yield CutPath.of(Intent(machine, moves, State()), lines, slice(None), continued.part.last, self.meant)
                continue
            intent, lines, counted = _with(around, machine, moves, lines)
            rows = slice(counted, None if continued.part.last else -BESIDE)
            cut = CutPath.of(intent, lines, rows, continued.part.last, self.meant, around.sides if around else None)
            yield cut
            assert cut.bodies is not None
            around = PartEnd.behind(cut.bodies, lines)


def _with(around: PartEnd | None, machine: Machine, moves: Moves, lines: Index) -> tuple[Intent, Index, int]:
    """The last motions of the part before with those of a part, the lines of all, and the number already compared."""
    if around is None:
        return Intent(machine, moves, State()), lines, 0
    both = joined_moves([around.moves, moves], [0, 0])
    counted = max(len(around.lines) - BESIDE, 0)
    intent = Intent(machine, both, State(direction=around.direction))
    return intent, np.concatenate([around.lines, lines]), counted


UNLIKE = 0.02
"""Difference of the lengths of two paths, as a share, above which they are not the same cut."""
AT_HAND = 100.0
"""Length of path, mm, that is held before and behind a place: enough for all deviations below 2 mm."""
GROUP = 2048
"""Number of parabolas that are compared together. Groups are counted from the start of the path, so that the result
does not depend on the parts in which it is read."""


@mutable
class Track:
    """The held part of a path.

    dropped   number of parabolas before it that were dropped
    complete  it reaches to the end of the path
    cut       length of all cuts so far, mm
    flank     the other possible places of the tip near reversals; None if no error depends on direction
    """

    curve: Curve
    dropped: int = 0
    complete: bool = False
    cut: float = 0.0
    flank: Flank | None = None

    @classmethod
    def empty(cls) -> Track:
        """A path at its begin."""
        none = np.zeros(0)
        places = np.zeros((0, 3))
        return cls(Curve(np.zeros(0, dtype=np.intp), none, none, places, places, places, np.zeros(0, dtype=bool), none))

    @property
    def count(self) -> int:
        """Number of parabolas so far."""
        return self.dropped + len(self.curve)

    @property
    def reached(self) -> float:
        """The length of the whole path so far, mm."""
        curve = self.curve
        return float(curve.lengths[-1] + curve.ways[-1]) if len(curve) else curve.first

    def add(self, more: Curve, last: bool, flank: Flank | None = None) -> None:
        """Add the next stretch of the path; `last`: it ends with it."""
        self.complete = last
        self.cut += more.total
        self.curve = self.curve.and_then(more)
        self.flank = flank if self.flank is None or flank is None else stacked([self.flank, flank])

    def drop(self, before: float) -> None:
        """Drop the parabolas that end before the length `before` of the path, mm."""
        curve = self.curve
        count = int(np.searchsorted(curve.lengths + curve.ways, before))
        if count:
            self.curve = self.part(count, len(curve))
            self.flank = self.flank and taken(self.flank, slice(count, None))
            self.dropped += count

    def joined(self, at: int) -> float:
        """The length of held parabola `at`, mm; 0 if there is none, or a gap before it."""
        curve = self.curve
        return float(curve.ways[at]) if at < len(curve) and not curve.opens[at] else 0.0

    def part(self, start: int, stop: int) -> Curve:
        """The held parabolas from `start` up to `stop`."""
        curve = self.curve
        first = float(curve.lengths[start]) if start < len(curve) else self.reached
        return replace(curve.taken(slice(start, stop)), first=first)


@mutable
class Match:
    """The distances from one path to the nearest points of another, as far as both are held.

    near   distance below which a place need not be the nearest one, mm, see `Search`
    along  the distances so far, as errors along the path
    done   number of parabolas of the path that have been compared
    ahead  length of the other path minus that of the path at the end of these, mm
    last   the nearest place of the other path to that end, its parabolas counted from the start of that path
    """

    path: Track
    other: Track
    near: float
    along: SimulatedErrors
    done: int = 0
    ahead: float = 0.0
    last: Nearest | None = None

    def go_on(self) -> None:
        """Compare as much of the path as enough of the other is held for; in whole groups, except at its end."""
        curve, other = self.path.curve, self.other
        start, stop = self.done - self.path.dropped, len(curve)
        if not other.complete:
            stop = int(np.searchsorted(curve.lengths + curve.ways, other.reached - self.ahead - 2 * AT_HAND))
        if stop < len(curve) or not self.path.complete:
            stop = min(stop, len(curve) - 1)  # the next parabola must be known
            stop -= (stop - start) % GROUP
        if stop > start and len(other.curve):
            self.done += stop - start
            self._look(start, stop)

    def _look(self, start: int, stop: int) -> None:
        """Compare the held parabolas from `start` up to `stop`."""
        part, other, flank = self.path.part(start, stop), self.other, self.path.flank
        samples = CurvePoints.of(part, self.path.joined(stop))
        search = Search(other.curve, self.near, self.ahead, other.dropped == 0, other.complete)
        groups = np.searchsorted(samples.piece, np.arange(GROUP, len(part), GROUP))
        found = search.all(samples.points, part.way(samples.piece, samples.share), groups)
        last = taken(found, slice(1)) if self.last is None else self.last.shifted(-other.dropped)
        before = stacked([last, taken(found, slice(-1))])
        self.ahead, self.last = search.ahead, taken(found, slice(-1, None)).shifted(other.dropped)
        between = [
            over_holes(search, part, samples, before.piece, found),
            *over_peaks(search, part, samples, before, found),
        ]
        for more in between:
            samples, found = stacked([samples, more[0]]), stacked([found, more[1]])
        gap = found.gap if flank is None else taken(flank, slice(start, stop)).there(search, part, samples, found)
        if other.flank is not None:
            gap = other.flank.back(search, samples.points, found)
        self.along.add(part.rows[samples.piece], gap, samples.weight)

    @property
    def looked_at(self) -> float:
        """The length of the path up to which it has been compared, mm."""
        curve, start = self.path.curve, self.done - self.path.dropped
        return float(curve.lengths[start]) if start < len(curve) else self.path.reached

    @property
    def first_needed(self) -> float:
        """The length of the other path before which it is not needed any more, mm."""
        return self.looked_at + self.ahead - 2 * AT_HAND


@mutable
class RunningComparison:
    """The comparison of two programs while they are read.

    tolerance  tolerance of the path before rounding, mm
    rounding   largest tip error by rounding to the control's digits, mm; arcs may raise it
    unseen     reason why motions of the original are not examined -> their lines, by parts
    blind      the same of the other program: reason -> number of motions
    left       letter of a linear axis -> lines of the original that cannot be corrected along it, by parts
    """

    tolerance: float
    rounding: float
    unseen: dict[NoFigureReason, list[Index]] = field(default_factory=dict)
    blind: Counter[NoFigureReason] = field(default_factory=Counter)
    left: dict[str, list[Index]] = field(default_factory=dict)
    intended: Track = field(default_factory=Track.empty)
    unfixed: Track = field(default_factory=Track.empty)
    fixed: Track = field(default_factory=Track.empty)
    matches: tuple[Match, Match, Match] = field(init=False)

    def __post_init__(self) -> None:
        self.matches = (
            Match(self.unfixed, self.intended, self.limit, SimulatedErrors()),
            Match(self.fixed, self.intended, self.limit, SimulatedErrors(self.limit)),
            Match(self.intended, self.fixed, self.limit, SimulatedErrors(self.limit)),
        )

    @property
    def limit(self) -> float:
        """Largest permitted distance of the tip from the intended path, mm."""
        return self.tolerance + self.rounding

    @property
    def no_figure(self) -> Counter[NoFigureReason]:
        """Number of feeds, arcs and holes that are not examined, by reason: the larger one of both programs."""
        return Counter({why: sum(map(len, parts)) for why, parts in self.unseen.items()}) | self.blind

    def run(self, original: Iterator[CutPath], other: Iterator[CutPath]) -> None:
        """Compare both programs to their end.

        Raises what reading them raises, `NearestNotHereError`, and `DifferenceError` NCF420 if they cut different
        lengths of path.
        """
        while not (self.intended.complete and self.fixed.complete):
            behind = self.intended.reached <= self.fixed.reached
            if self.fixed.complete or (behind and not self.intended.complete):
                self._take_original(next(original, None))
            else:
                self._take_other(next(other, None))
            self._go_on()
        for match in self.matches[1:]:
            match.along.limit = self.limit
        meant, made = self.intended.cut, self.fixed.cut
        if (self.intended.count == 0) != (self.fixed.count == 0) or abs(meant - made) > UNLIKE * max(meant, made):
            text = f"the two programs do not have the same path: {meant:.3f} mm and {made:.3f} mm"
            raise DifferenceError.of("NCF420", text, hint="give the original program first, then the corrected one")

    def _take_original(self, cut: CutPath | None) -> None:
        if cut is None:
            self.unfixed.complete = self.intended.complete = True
            return
        assert cut.intended is not None
        self.unfixed.add(cut.actual, cut.last, cut.flank)
        self.intended.add(cut.intended, cut.last)
        for why, lines in cut.unseen.items():
            self.unseen.setdefault(why, []).append(lines)
        for axis, lines in cut.left.items():
            self.left.setdefault(axis, []).append(lines)

    def _take_other(self, cut: CutPath | None) -> None:
        if cut is None:
            self.fixed.complete = True
        else:
            self.fixed.add(cut.actual, cut.last, cut.flank)
            self.rounding = max(self.rounding, cut.rounding)
            self.blind += Counter({why: len(lines) for why, lines in cut.unseen.items()})

    def _go_on(self) -> None:
        for match in self.matches:
            match.go_on()
        for track in (self.intended, self.unfixed, self.fixed):
            needed = [match.first_needed for match in self.matches if match.other is track]
            own = [match.looked_at for match in self.matches if match.path is track]
            track.drop(min(needed + own))
