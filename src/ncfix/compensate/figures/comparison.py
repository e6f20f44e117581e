"""Two programs on one machine, compared while they are read: does the second one cut what the first one means?

The paths are compared as curves in the workpiece, so this knows nothing of how the second program was made: from every
sample of the real path of the second program to the nearest point of the intended path of the first, and back, so that
nothing may be missing. Nearest is looked for near the same length of path, so that the next pass of a cut, a hair's
breadth beside it, is not taken for the one that is meant.

    original --> what it means ----------------+--> there: from what the other makes to what is meant
             --> what the machine makes of it  |    back:  from what is meant to what the other makes
    other    --> what the machine makes of it -+    before: from what the original makes to what it means

Of every path as much is kept as a nearest point may lie on. If that is not enough, `NearestNotHereError` is raised, and
both programs have to be at hand as a whole.
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
from ncfix.control.trace import joined_moves
from ncfix.control.trace import taken as motions_taken
from ncfix.diagnostics import DifferenceError, Message
from ncfix.machine import Machine, State
from ncfix.text.tree import Program
from ncfix.values import frozen, mutable

BESIDE = 64
"""Motions on both sides of one that are looked at to find out whether an axis turns round near it."""


@frozen
class CutPath:
    """What a part of a program cuts; motions are called by their lines.

    actual    what the machine makes of it
    intended  what it means; None of a program of which that does not matter
    flank     where the tip is besides, with the play of axes, if there is any
    unseen    why motions at feed are not looked at -> their lines, one for each
    left      linear axis -> lines of motions that cannot be corrected along it
    last      nothing comes after it
    rounding  how far the tip may be off because numbers are rounded to the control's digits, mm
    bodies    where the bodies of axes with play are meanwhile, if there is any
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
        """Of motions, of which some `rows` count and others stand before and behind them; `meant`: with what they mean.

        lines  (n,) those of the motions
        first  (n_axes,) where the bodies of axes are before them, see `BacklashBodies`
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
    """What a program cuts, at once."""
    yield CutPath.of(Intent(machine, moves, State()), program.lines(moves.block), slice(None), True, meant)


@frozen
class PartEnd:
    """The last motions of a part, where it matters which way axes go next.

    moves      up to twice `BESIDE`; the last `BESIDE` count when the next part is known
    lines      (n,) those in which they are
    direction  the way in which the axes came to the first of them
    sides      (n_axes,) where their bodies are there
    """

    moves: Moves
    lines: Index
    direction: Signs
    sides: Array

    @classmethod
    def behind(cls, bodies: BacklashBodies, lines: Index) -> PartEnd:
        """The end of motions in lines (n,)."""
        start, moves = max(len(lines) - 2 * BESIDE, 0), bodies.intent.moves
        last = motions_taken(moves, np.arange(start, len(lines)))
        return cls(last, lines[start:], bodies.came(start), bodies.before(start))


@frozen
class CutPaths:
    """What a program cuts, part after part while it is read.

    read   gives the next so many bytes of the text; none at its end
    meant  with what it means
    said   what there is to say of following it, once the last part is there
    """

    task: Task
    read: Read
    meant: bool
    said: list[Message] = field(default_factory=list)

    def __iter__(self) -> Iterator[CutPath]:
        """The parts. Raises what reading and following do, and UsageError for what is not given."""
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
    """Motions behind those before them, the lines of all, and how many of them have been counted."""
    if around is None:
        return Intent(machine, moves, State()), lines, 0
    both = joined_moves([around.moves, moves], [0, 0])
    counted = max(len(around.lines) - BESIDE, 0)
    intent = Intent(machine, both, State(direction=around.direction))
    return intent, np.concatenate([around.lines, lines]), counted


UNLIKE = 0.02
"""Paths whose lengths differ by more than this share are not the same cut."""
AT_HAND = 100.0
"""mm of path before and behind a place that are at hand: enough for whatever is less than 2 mm off."""
GROUP = 2048
"""Parabolas from which one looks together, counted from where the path begins: the same however it is read."""


@mutable
class Track:
    """What is at hand of a path.

    dropped   parabolas before it
    complete  nothing comes behind it
    cut       the length of all that was cut, mm
    flank     where the tip may be besides, as axes turn round, if that matters
    """

    curve: Curve
    dropped: int = 0
    complete: bool = False
    cut: float = 0.0
    flank: Flank | None = None

    @classmethod
    def empty(cls) -> Track:
        """Of a path that begins."""
        none = np.zeros(0)
        places = np.zeros((0, 3))
        return cls(Curve(np.zeros(0, dtype=np.intp), none, none, places, places, places, np.zeros(0, dtype=bool), none))

    @property
    def count(self) -> int:
        """Parabolas so far."""
        return self.dropped + len(self.curve)

    @property
    def reached(self) -> float:
        """The way along the whole path to where it ends now, mm."""
        curve = self.curve
        return float(curve.lengths[-1] + curve.ways[-1]) if len(curve) else curve.first

    def add(self, more: Curve, last: bool, flank: Flank | None = None) -> None:
        """Go on along the path; `last`: to its end."""
        self.complete = last
        self.cut += more.total
        self.curve = self.curve.and_then(more)
        self.flank = flank if self.flank is None or flank is None else stacked([self.flank, flank])

    def drop(self, before: float) -> None:
        """Forget what lies before a way along the path."""
        curve = self.curve
        count = int(np.searchsorted(curve.lengths + curve.ways, before))
        if count:
            self.curve = self.part(count, len(curve))
            self.flank = self.flank and taken(self.flank, slice(count, None))
            self.dropped += count

    def joined(self, at: int) -> float:
        """The length of a parabola at hand that begins where the one before ends, mm; 0 if there is none."""
        curve = self.curve
        return float(curve.ways[at]) if at < len(curve) and not curve.opens[at] else 0.0

    def part(self, start: int, stop: int) -> Curve:
        """Some parabolas of what is at hand."""
        curve = self.curve
        first = float(curve.lengths[start]) if start < len(curve) else self.reached
        return replace(curve.taken(slice(start, stop)), first=first)


@mutable
class Match:
    """Looks from one path to another for what is nearest, as far as both are at hand.

    near   as `Search` has it
    done   parabolas of the path that have been looked at
    ahead  how much farther one is along the other path at the end of these, mm
    last   where the other path, its parabolas counted from its begin, is nearest to that end
    """

    path: Track
    other: Track
    near: float
    along: SimulatedErrors
    done: int = 0
    ahead: float = 0.0
    last: Nearest | None = None

    def go_on(self) -> None:
        """Look from as much of the path as there is enough of the other for, by whole groups but at its end."""
        curve, other = self.path.curve, self.other
        start, stop = self.done - self.path.dropped, len(curve)
        if not other.complete:
            stop = int(np.searchsorted(curve.lengths + curve.ways, other.reached - self.ahead - 2 * AT_HAND))
        if stop < len(curve) or not self.path.complete:
            stop = min(stop, len(curve) - 1)  # what goes on at its end is to be known
            stop -= (stop - start) % GROUP
        if stop > start and len(other.curve):
            self.done += stop - start
            self._look(start, stop)

    def _look(self, start: int, stop: int) -> None:
        """Look from some parabolas of what is at hand."""
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
        """The way along its path up to which it has looked."""
        curve, start = self.path.curve, self.done - self.path.dropped
        return float(curve.lengths[start]) if start < len(curve) else self.path.reached

    @property
    def first_needed(self) -> float:
        """The way along the other path before which nothing of it will be looked at any more."""
        return self.looked_at + self.ahead - 2 * AT_HAND


@mutable
class RunningComparison:
    """Two programs on their way, and what was found so far.

    tolerance    of the path before rounding, mm
    rounding     what the control's digits may add to it, mm; arcs that are met make it more
    unseen, left as `CutPath` has them, of the original, by parts; `blind`: what is unseen of the other
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
        """How far the tip may be off, mm."""
        return self.tolerance + self.rounding

    @property
    def no_figure(self) -> Counter[NoFigureReason]:
        """How many motions at feed are not looked at, and why: of the program that has more of them."""
        return Counter({why: sum(map(len, parts)) for why, parts in self.unseen.items()}) | self.blind

    def run(self, original: Iterator[CutPath], other: Iterator[CutPath]) -> None:
        """Go along both programs. Raises what reading them does, `NearestNotHereError`, `DifferenceError` NCF420."""
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
            text = f"the two programs do not cut the same: {meant:.3f} mm and {made:.3f} mm of path"
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
