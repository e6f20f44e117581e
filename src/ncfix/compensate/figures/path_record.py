"""Record of the path of a corrected program for a picture: intended tip, error before and after, and reasons.

A record takes the plan and text of each part in turn (`take`), and keeps the places of the path that a picture needs.
For a long program these are a selection: the largest errors before and after of every stretch, and then, repeatedly,
the places that are farthest from the lines drawn so far. The deviation of the picture from the path is measured, and is
part of the result. Figures, histogram and lists are of all places, not of the selection.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace

import numpy as np

from ncfix.arrays import Array, Index, Mask, owners, picked, stacked, taken
from ncfix.compensate.account import Account
from ncfix.compensate.plan.deviation import errors_at, samples
from ncfix.compensate.plan.figure_tally import PathSamples
from ncfix.compensate.plan.sampling import even
from ncfix.compensate.plan.written import WrittenPieces
from ncfix.compensate.solve import WrittenPlan
from ncfix.control.moves import MotionKind, Moves
from ncfix.text.tree import Program
from ncfix.values import frozen, mutable

CUT, RAPID, REFUSED, PASSED = range(4)
"""The kind of motion that leads to a place: a corrected cut, a rapid, a refused motion, one passed by rule."""
DRAWN = 12_000
"""Approximate largest number of places in a picture."""
HELD = 2_000_000
"""Number of places in memory above which they are thinned."""
STEP = np.radians(7.5)
"""Largest step, rad, in which an arc or a turn of a rotary axis is drawn."""
MOST_STEPS = 400
LISTED = 500
"""Largest number of blocks in a list."""
WORST = 40
"""Number of lines with the largest errors that are kept."""
ROUNDS = 10
FINE = 1e-3
"""Distance, mm, from the drawn lines up to which a place need not be drawn."""
EDGES = np.logspace(-4, 4, 97)
"""Edges of the bins of the histogram, um: twelve per decade."""
COLUMNS = {"x": "f4", "y": "f4", "z": "f4", "way": "f4", "before": "f4", "after": "f4", "line": "i4", "kind": "u1"}


@frozen
class ListedPlace:
    """A place of the path: line, way along the path, mm, tip, mm, error before and after, um."""

    line: int
    way: float
    tip: tuple[float, float, float]
    before: float
    after: float


@frozen
class ListedBlock:
    """A block that stayed unchanged, the reason, and the place at which its motion ends; None: not known."""

    line: int
    reason: str
    spot: ListedPlace | None


@frozen
class Extent:
    """The corrections of an axis: smallest and largest, mm or rad, and the line of the larger one."""

    low: float = 0.0
    high: float = 0.0
    line: int = 0

    def with_more(self, values: Array, lines: Index) -> Extent:
        """The extent with the corrections (k,) of more motions, in lines (k,)."""
        if not len(values):
            return self
        most = int(np.argmax(np.abs(values)))
        larger = abs(values[most]) > max(-self.low, self.high)
        line = int(lines[most]) if larger else self.line
        return Extent(min(self.low, float(values.min())), max(self.high, float(values.max())), line)


@mutable
class PathRecord:
    """The record of a path: call `take` with each part in turn, then read `columns()` and the fields.

    drawn        approximate largest number of places in the picture
    way          length of the path so far, mm
    total        number of sampled places
    share        (2, 96) length of path by error before and after, mm, in bins between EDGES
    worst        the places with the largest errors after the correction, one for each line
    corrections  letter of an axis -> its corrections
    linear       the norm of the corrections of the linear axes
    refused, passed  blocks that stayed unchanged, the first `LISTED` of each
    """

    drawn: int = DRAWN
    way: float = 0.0
    total: int = 0
    share: Array = field(default_factory=lambda: np.zeros((2, len(EDGES) - 1)))
    worst: list[ListedPlace] = field(default_factory=list)
    corrections: dict[str, Extent] = field(default_factory=dict)
    linear: Extent = Extent()
    refused: list[ListedBlock] = field(default_factory=list)
    passed: list[ListedBlock] = field(default_factory=list)
    _parts: list[tuple[dict[str, Array], Array]] = field(default_factory=list)
    _held: int = 0
    _strays: float = 0.0

    def take(self, program: Program, solution: WrittenPlan, own: Mask | None = None) -> None:
        """Add a part; `own` (n,): the motions to include, None: all."""
        moves = solution.moves
        mine = np.ones(len(moves), dtype=bool) if own is None else own
        lines = program.lines(moves.block)
        found = _Places.of(solution, mine & (moves.kind != MotionKind.DWELL))
        kind = np.where(moves.kind == MotionKind.RAPID, RAPID, np.where(solution.unchanged, PASSED, CUT))
        kind[solution.unchanged & np.isin(moves.block, list(solution.reasons))] = REFUSED
        shown = solution.shown(False)
        self._count(found, shown)
        way = self.way + np.cumsum(found.weight)
        self.way = float(way[-1]) if len(way) else self.way
        values = {
            **dict(zip("xyz", found.tip.T, strict=True)),
            "way": way,
            "before": 1e3 * found.before,
            "after": 1e3 * found.after,
            "line": lines[found.move],
            "kind": np.where(found.lifted, RAPID, kind[found.move]),
        }
        shift = np.nan_to_num(solution.shift)
        self._note_corrections(moves, shift, lines, mine & ~solution.unchanged)
        self._note_blocks(moves, solution, lines, values, found.move, mine)
        self._note_worst(values, shown[found.move])
        self._hold(values, shift[found.move])

    def _count(self, found: _Places, shown: Mask) -> None:
        rows = shown[found.move] & (found.weight > 0)
        for side, error in enumerate((found.before, found.after)):
            bins = np.clip(np.searchsorted(EDGES, 1e3 * error[rows], side="right") - 1, 0, len(EDGES) - 2)
            self.share[side] += np.bincount(bins, found.weight[rows], len(EDGES) - 1)

    def _note_corrections(self, moves: Moves, shift: Array, lines: Index, done: Mask) -> None:
        rows = np.flatnonzero(done)
        for column, axis in enumerate(moves.axes):
            known = self.corrections.get(axis, Extent())
            self.corrections[axis] = known.with_more(shift[rows, column], lines[rows])
        size = np.sqrt((shift[rows][:, ~moves.rotary] ** 2).sum(axis=1))
        self.linear = self.linear.with_more(size, lines[rows])

    def _note_blocks(
        self, moves: Moves, solution: WrittenPlan, lines: Index, values: Mapping[str, Array], at: Index, mine: Mask
    ) -> None:
        account = Account.of(moves, solution.unchanged, solution.reasons)
        if not (account.refused or account.passed):
            return
        theirs = set(moves.block[~mine].tolist())
        line_of = dict(zip(moves.block.tolist(), lines.tolist(), strict=True))
        last = dict(zip(moves.block[at].tolist(), range(len(at)), strict=True))

        def listed(blocks: Mapping[int, object], why: Callable[[int], str]) -> list[ListedBlock]:
            chosen = [block for block in sorted(blocks) if block not in theirs][:LISTED]
            return [
                ListedBlock(line_of[block], why(block), _spot(values, last[block]) if block in last else None)
                for block in chosen
            ]

        self.refused += listed(
            account.refused, lambda block: f"{account.refused[block].code}: {account.refused[block].text}"
        )
        self.passed += listed(account.passed, lambda block: account.passed[block] or account.rules[block])
        del self.refused[LISTED:], self.passed[LISTED:]

    def _note_worst(self, values: Mapping[str, Array], shown: Mask) -> None:
        rows = np.flatnonzero(shown & np.isfinite(values["after"]))
        rows = rows[np.lexsort((rows, -values["after"][rows]))][: 50 * WORST]
        best = {spot.line: spot for spot in self.worst}
        for row in rows.tolist():
            line = int(values["line"][row])
            if line not in best or best[line].after < values["after"][row]:
                best[line] = _spot(values, row)
        self.worst = sorted(best.values(), key=lambda spot: (-spot.after, spot.line))[:WORST]

    def _hold(self, values: dict[str, Array], shift: Array) -> None:
        self.total += len(shift)
        columns = {name: values[name].astype(kind) for name, kind in COLUMNS.items()}
        self._parts.append((columns, shift.astype("f4")))
        self._held += len(shift)
        if self._held > HELD:
            self._thin(HELD // 8)

    def _together(self) -> tuple[dict[str, Array], Array]:
        if not self._parts:
            return {name: np.zeros(0, kind) for name, kind in COLUMNS.items()}, np.zeros((0, 0), "f4")
        columns = {name: np.concatenate([values[name] for values, _ in self._parts]) for name in COLUMNS}
        return columns, np.concatenate([shift for _, shift in self._parts])

    def _thin(self, most: int) -> None:
        """Keep `most` places, and add the deviation of the picture from the path to `_strays`."""
        values, shift = self._together()
        self._parts, self._held = [(values, shift)], len(shift)
        if len(shift) <= most:
            return
        rows = selection(values, most)
        tips = np.stack([values[name] for name in "xyz"], axis=1).astype(np.float64)
        self._strays += float(_off_lines(tips, rows).max(initial=0.0))
        self._parts = [({name: column[rows] for name, column in values.items()}, shift[rows])]
        self._held = len(rows)

    def columns(self) -> tuple[dict[str, Array], Array, float]:
        """The places to draw, as columns (`COLUMNS`); (k, n_axes) the corrections at the ends of the motions there, mm
        and rad; and the largest deviation of straight lines between these places from the path, mm.
        """
        self._thin(self.drawn)
        values, shift = self._together()
        return values, shift, self._strays

    def in_lines(self, lines: Sequence[int]) -> None:
        """Replace the line numbers by those of another text: `lines` has the new number for each line."""
        table = np.array([0, *lines], dtype=np.int64)

        def at(line: int) -> int:
            return int(table[line]) if line < len(table) else line

        def moved(spot: ListedPlace | None) -> ListedPlace | None:
            return None if spot is None else replace(spot, line=at(spot.line))

        for values, _ in self._parts:
            values["line"] = table[np.minimum(values["line"], len(table) - 1)].astype("i4")
        best: dict[int, ListedPlace] = {}
        for each in self.worst:  # the largest first
            best.setdefault(at(each.line), replace(each, line=at(each.line)))
        self.worst = list(best.values())
        for name in ("refused", "passed"):
            blocks = [replace(each, line=at(each.line), spot=moved(each.spot)) for each in getattr(self, name)]
            setattr(self, name, blocks)
        self.corrections = {axis: replace(each, line=at(each.line)) for axis, each in self.corrections.items()}
        self.linear = replace(self.linear, line=at(self.linear.line))


@frozen
class _Places:
    """Places in the order of the path.

    move           (k,) the motion
    tip            (k, 3) intended tip, mm
    before, after  (k,) tip errors, mm
    weight         (k,) way for which the place stands, mm
    lifted         (k,) the place is over a hole, at its level R
    """

    move: Index
    tip: Array
    before: Array
    after: Array
    weight: Array
    lifted: Mask

    @classmethod
    def of(cls, solution: WrittenPlan, mine: Mask) -> _Places:
        """The samples of the figures, with more places on arcs and turns; `mine` (n,): the motions to include."""
        written, intent = solution.written, solution.intent
        which = np.flatnonzero(mine[written.pieces.move])
        piece, fraction = _bent(written, which)
        move, at = written.pieces.move[piece], written.before[piece] + fraction * written.span[piece]
        before, after = errors_at(intent, move, at, written.segments.at(piece, fraction))
        bent = PathSamples(move, at, before, after, np.zeros(len(piece)))
        looked = stacked([*samples(written, which, solution.plan.known), bent])
        tip = intent.tip(looked.move, looked.fraction)
        holes = np.flatnonzero((intent.moves.kind[looked.move] == MotionKind.CYCLE) & (looked.fraction == 1.0))
        if holes.size:
            drilled, none = taken(looked, holes), np.zeros(len(holes))
            above = intent.meant(drilled.move, picked(intent.moves.approach, drilled.move))
            looked, tip = stacked([looked, replace(drilled, fraction=none, weight=none)]), np.concatenate([tip, above])
        lifted = np.arange(len(tip)) >= len(tip) - len(holes)
        found = cls(looked.move, tip, looked.before, looked.after, np.nan_to_num(looked.weight), lifted)
        known = np.isfinite(tip).all(axis=1) & np.isfinite(looked.before) & np.isfinite(looked.after)
        order = np.lexsort((looked.fraction, looked.move))
        return taken(found, order[known[order]])


def _bent(written: WrittenPieces, which: Index) -> tuple[Index, Array]:
    """Pieces and fractions that a picture needs besides ends: places inside arcs and turns, and the begins of cuts."""
    moves, segments, move = written.intent.moves, written.segments, written.pieces.move[which]
    turned = np.abs(picked(segments.end, which) - picked(segments.start, which))[:, moves.rotary].max(
        axis=1, initial=0.0
    )
    turned = np.where(moves.tcp[move], 0.0, turned) + np.where(segments.arc[which], np.abs(segments.sweep[which]), 0.0)
    drawn = np.isin(moves.kind[move], (MotionKind.FEED, MotionKind.ARC))
    counts = np.where(drawn, np.minimum(np.ceil(np.nan_to_num(turned) / STEP), MOST_STEPS), 0).astype(np.intp)
    counts = np.maximum(counts - 1, 0)
    inside = which[owners(counts)], even(counts)
    first = np.flatnonzero(np.diff(moves.kind[move], prepend=-1) != 0)  # starts of runs of one kind
    first = first[drawn[first] & np.isfinite(picked(segments.start, which[first])).all(axis=1)]
    return np.concatenate([which[first], inside[0]]), np.concatenate([np.zeros(len(first)), inside[1]])


def _spot(values: Mapping[str, Array], row: int) -> ListedPlace:
    tip = tuple(round(float(values[name][row]), 4) for name in "xyz")
    way, before, after = (round(float(values[name][row]), 4) for name in ("way", "before", "after"))
    return ListedPlace(int(values["line"][row]), way, (tip[0], tip[1], tip[2]), before, after)


def selection(values: Mapping[str, Array], most: int) -> Index:
    """(k,) about `most` places that represent all places: see the module's docstring."""
    count = len(values["way"])
    changes = np.flatnonzero(np.diff(values["kind"]) != 0)
    fixed = np.concatenate([[0, count - 1], changes, changes + 1])
    fixed = fixed if len(fixed) < most // 2 else fixed[:2]
    stretches = max((most - len(fixed)) // 6, 1)
    first = np.unique(np.linspace(0, count, stretches, endpoint=False).astype(np.intp))
    chosen = [_largest(values[side], first) for side in ("before", "after")]
    rows = np.unique(np.concatenate([fixed, *chosen]))
    tips = np.stack([values[name] for name in "xyz"], axis=1).astype(np.float64)
    for _ in range(ROUNDS):
        off = _off_lines(tips, rows)
        peaks = _largest(off, rows)
        peaks = peaks[off[peaks] > FINE]
        room = (most - len(rows) + 1) // 2
        if not len(peaks) or room <= 0:
            break
        rows = np.unique(np.concatenate([rows, peaks[np.argsort(-off[peaks], kind="stable")[:room]]]))
    return rows


def _largest(values: Array, first: Index) -> Index:
    """The index of the largest value in each stretch, the first of equal ones; stretches begin at `first`."""
    most = np.maximum.reduceat(values, first)
    at = np.flatnonzero(values == np.repeat(most, np.diff(np.append(first, len(values)))))
    return at[np.searchsorted(at, first)]


def _off_lines(tips: Array, rows: Index) -> Array:
    """The distance of every point from the polyline through the points `rows`, mm."""
    after = np.clip(np.searchsorted(rows, np.arange(len(tips))), 1, len(rows) - 1)
    begin = tips[rows[after - 1]]
    along = tips[rows[after]] - begin
    size = np.maximum((along**2).sum(axis=1), 1e-12)
    share = np.clip(((tips - begin) * along).sum(axis=1) / size, 0.0, 1.0)
    return np.asarray(np.linalg.norm(tips - begin - share[:, None] * along, axis=1))
