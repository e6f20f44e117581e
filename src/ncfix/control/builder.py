"""Collects the motions of a program as columns (`Moves`).

Single motions are appended to lists and converted to arrays later; stretches that the fast lane followed at once arrive
as arrays. No object is kept per motion.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ncfix.arrays import Array, Ints, Mask
from ncfix.control.coordinates import INDEX, N_LETTERS, Rotation, Vector
from ncfix.control.moves import Arc, CycleCall, Frame, MotionKind, Moves, Pass, Rule
from ncfix.control.turns import Winding, extremes, half_turns
from ncfix.values import mutable


class MotionStyle(NamedTuple):
    """Properties that many motions share; `frame` and `reason` are indices into the builder's tables."""

    kind: MotionKind
    rule: Rule
    reason: int
    frame: int
    incremental: bool
    arc_absolute: bool
    tcp: bool
    whole: bool
    tool: int
    tool_length: float
    feed_mode: int
    modal: int
    rotary_as_programmed: bool = False
    passing: Pass = Pass.NONE
    beside: float = 0.0
    across: int = 2
    tcp_length: float = math.nan
    exact_stop: bool = False


DTYPES: dict[str, type[np.generic]] = {
    "kind": np.int8,
    "rule": np.int8,
    "reason": np.int16,
    "frame": np.int32,
    "tool": np.int32,
    "tool_length": np.float64,
    "feed_mode": np.int8,
    "modal": np.int16,
    "passing": np.int8,
    "beside": np.float64,
    "across": np.int8,
    "tcp_length": np.float64,
}
"""Dtypes of the columns of `Moves` that come from styles; columns not listed are bool."""


NEUTRAL: dict[str, tuple[bool, float, type[np.generic]]] = {
    "rotary_as_programmed": (False, False, np.bool_),
    "approach": (True, math.nan, np.float64),
    "placed": (True, True, np.bool_),
    "fixed_centre": (False, False, np.bool_),
    "resting": (True, False, np.bool_),
    "beside": (False, 0.0, np.float64),
    "across": (False, 2, np.int8),
    "passing": (False, 0, np.int8),
    "measured": (True, False, np.bool_),
    "call": (False, -1, np.int32),
    "spelled": (True, False, np.bool_),
    "tcp_length": (False, math.nan, np.float64),
    "exact_stop": (False, False, np.bool_),
    "words_alone_turn": (False, False, np.bool_),
}
"""Columns of `Moves` that few programs need: whether they have a value for each axis, the value that changes nothing,
and its type."""


def neutral_column(name: str, count: int, n_axes: int) -> NDArray[Any]:
    """A column of `NEUTRAL` that changes nothing, (count,) or (count, n_axes); read-only, it takes no memory."""
    by_axis, value, kind = NEUTRAL[name]
    return np.broadcast_to(np.array(value, dtype=kind), (count, n_axes) if by_axis else (count,))


class Circles(NamedTuple):
    """Circles of k arcs in one plane, as columns of `Arc`; `row` (k,) is the index of each arc's motion."""

    row: Ints
    centre: Array
    normal: tuple[float, float, float]
    sweep: Array
    fixed: Mask


BUFFERED_MOTIONS = 65536
"""Number of motions kept as Python numbers before they are converted to arrays."""


class MotionBuilder:
    """Collects motions; `moves()` returns them as columns.

    rolls         (n_axes,) rotary axes that may roll over (see `turns`); None: none
    winding       how far each of these axes has been turned before, where that matters
    overturned    block of the first motion whose direction of rotation is in doubt (half a turn or more)
    brought_back  block of the first motion that brings such an axis back from beyond a full turn
    """

    def __init__(self, axes: tuple[str, ...], rotary: frozenset[str]) -> None:
        self.axes = axes
        self.rotary = np.array([axis in rotary for axis in axes], dtype=np.bool_)
        self.columns = [INDEX[axis] for axis in axes]
        self._styles: dict[MotionStyle, int] = {}
        self._reasons: dict[str, int] = {"": 0}
        self._frames: dict[tuple[tuple[float, ...], Rotation, float, bool, tuple[float, float], float], int] = {}
        self._calls: dict[CycleCall, int] = {}
        self.rolls: Mask | None = None
        self.winding: Winding | None = None
        self.clear()

    def clear(self) -> None:
        """Discard the motions collected so far; styles, reasons, frames and calls keep their indices."""
        self.count = 0
        self._buffer = Buffer()
        self._stretches: list[MotionColumns] = []
        self._arcs: dict[int, Arc] = {}
        self._circles: list[Circles] = []
        self._approaches: dict[int, list[float]] = {}
        self._called: dict[int, int] = {}
        self._counted: dict[int, int] = {}
        self._resting: dict[int, int] = {}
        self._measured: dict[int, int] = {}
        self._directed: list[tuple[int, int, int]] = []
        self._kept: list[int] = []
        self.overturned: int | None = None
        self.brought_back: int | None = None

    @property
    def endless(self) -> int:
        """The axes that may roll over, as a bit mask by letter."""
        return 0 if self.rolls is None else sum(1 << self.columns[place] for place in np.flatnonzero(self.rolls))

    # -- what is shared -----------------------------------------------------------------------------------------------

    def style(self, style: MotionStyle) -> int:
        """The index of `style`; a new style is added."""
        return self._styles.setdefault(style, len(self._styles))

    @property
    def styles(self) -> tuple[MotionStyle, ...]:
        """All styles, in the order of their indices."""
        return tuple(self._styles)

    def reason(self, text: str) -> int:
        """The index of the reason `text`; a new reason is added."""
        return self._reasons.setdefault(text, len(self._reasons))

    def frame(
        self,
        offset: Vector,
        rotation: Rotation,
        unit: float,
        diameter: bool,
        increments: tuple[float, float] = (1.0, 1.0),
        per_feed: float = 1.0,
    ) -> int:
        """The index of a frame, see `Frame`; a new frame is added. `offset` has one number per axis letter."""
        key = (tuple(offset[column] for column in self.columns), rotation, unit, diameter, increments, per_feed)
        return self._frames.setdefault(key, len(self._frames))

    # -- motions ------------------------------------------------------------------------------------------------------

    def add(
        self, block: int, programmed: int, style: int, feed: float, start: Vector, end: Vector, unplaced: int
    ) -> None:
        """Add one motion; `unplaced`: bit mask of the axes whose positions the program has not set."""
        buffer = self._buffer
        buffer.block.append(block)
        buffer.programmed.append(programmed)
        buffer.style.append(style)
        buffer.feed.append(feed)
        buffer.start.extend(start)
        buffer.end.extend(end)
        buffer.unplaced.append(unplaced)
        self.count += 1
        if len(buffer.block) >= BUFFERED_MOTIONS:
            self._flush()

    def arc(self, arc: Arc) -> None:
        """Set the circle of the motion that will be added next."""
        self._arcs[self.count] = arc

    def circles(self, circles: Circles) -> None:
        """Set the circles of the motions that will be added next."""
        if len(circles.row):
            self._circles.append(circles._replace(row=circles.row + self.count))

    def approach(self, command: Vector) -> None:
        """Set the commanded position at level R of the canned cycle that will be added next."""
        self._approaches[self.count] = [command[column] for column in self.columns]

    def called(self, call: CycleCall) -> None:
        """Set the call of the canned cycle that will be added next."""
        self._called[self.count] = self._calls.setdefault(call, len(self._calls))

    def counted(self, axes: int) -> None:
        """Mark `axes` (bits) as the only ones whose words in the motion added next are incremental."""
        self._counted[self.count] = axes

    def measures(self, axes: int) -> None:
        """Mark `axes` (bits) of the motion added next as having words computed from measured values."""
        if axes:
            self._measured[self.count] = axes

    def rests(self, axes: int) -> None:
        """Mark `axes` (bits) that the motion added next must leave at rest, although it names some of them."""
        if axes:
            self._resting[self.count] = axes

    def many_rest(self, axes: Ints) -> None:
        """Like `rests`, for the n motions that will be added next: bit masks (n,)."""
        rows = np.flatnonzero(axes)
        self._resting |= dict(zip((self.count + rows).tolist(), axes[rows].tolist(), strict=True))

    def says_the_way(self, axes: int, motions: int = 1, first: int | None = None) -> None:
        """Mark `axes` (bits) whose direction of rotation is not in doubt, as when a word states it.

        Applies to `motions` motions from index `first` on; None: from the motion that will be added next.
        """
        begin = self.count if first is None else first
        self._directed.append((begin, begin + motions, axes))

    def keeps_direction(self) -> None:
        """Mark the next motion: its rotary axes stay as programmed."""
        self._kept.append(self.count)

    def extend(self, stretch: MotionColumns) -> None:
        """Add a stretch of motions."""
        self._flush()
        self._stretches.append(stretch)
        self.count += len(stretch.block)

    @property
    def latest(self) -> MotionColumns | None:
        """The stretch added last; None if single motions followed it, or if nothing was added."""
        return self._stretches[-1] if self._stretches and not self._buffer.block else None

    def latest_arc(self) -> tuple[int, Arc] | None:
        """The last arc of the latest stretch, with its row in that stretch; None if it has none."""
        begin = self.count - (0 if self.latest is None else len(self.latest.block))
        if not self._circles or self._circles[-1].row[-1] < begin:
            return None
        row, centre, normal, sweep, fixed = self._circles[-1]
        x, y, z = centre[-1].tolist()
        return int(row[-1]) - begin, Arc((x, y, z), normal, float(sweep[-1]), bool(fixed[-1]))

    def _flush(self) -> None:
        if self._buffer.block:
            self._stretches.append(self._buffer.stretch())
            self._buffer = Buffer()

    # -- the result ---------------------------------------------------------------------------------------------------

    def moves(self) -> Moves:
        """All motions so far, as columns."""
        self._flush()
        parts = self._stretches or [Buffer().stretch()]
        block, mask, unplaced, style, feed = (
            _joined([getattr(part, name) for part in parts])
            for name in ("block", "programmed", "unplaced", "style", "feed")
        )
        start, end = _joined_ends(parts, self.columns)
        named = (np.arange(1 << N_LETTERS)[:, None] >> np.array(self.columns)) & 1 != 0
        styles: dict[str, Any] = self._style_columns(style)
        styles["rotary_as_programmed"][[row for row in self._kept if row < len(block)]] = True
        programmed = named.take(mask, axis=0, mode="clip")
        n, width = len(block), len(self.columns)
        counted = self._mask_column(self._counted, np.broadcast_to(styles["incremental"][:, None], (n, width)))
        angles = self._keep_whole(styles, programmed, counted, start, end, block)
        centre, normal, sweep = self._arc_columns(len(block))
        fixed = [row for row, arc in self._arcs.items() if arc.fixed]
        fixed += [row for each in self._circles for row in each.row[each.fixed].tolist()]
        return Moves(
            axes=self.axes,
            rotary=self.rotary,
            start=start,
            end=end,
            programmed=programmed,
            block=block.astype(np.int32),
            feed=feed,
            centre=centre,
            normal=normal,
            sweep=sweep,
            frames=tuple(
                Frame(np.array(offset, dtype=np.float64), np.array(rotation), unit, diameter, increments, per_feed)
                for offset, rotation, unit, diameter, increments, per_feed in self._frames
            ),
            reasons=tuple(self._reasons),
            approach=_sparse(self._approaches, neutral_column("approach", n, width)),
            placed=(~named).take(unplaced, axis=0, mode="clip"),
            fixed_centre=_sparse(dict.fromkeys(fixed, True), neutral_column("fixed_centre", n, width)),
            counted=counted,
            measured=self._mask_column(self._measured, neutral_column("measured", n, width)),
            resting=self._mask_column(self._resting, neutral_column("resting", n, width)),
            call=_sparse(self._called, neutral_column("call", n, width)),
            spelled=neutral_column("spelled", n, width),
            words_alone_turn=neutral_column("words_alone_turn", n, width),
            calls=tuple(self._calls),
            angles=angles,
            **styles,
        )

    def _style_columns(self, style: Ints) -> dict[str, NDArray[Any]]:
        """The columns of the fields of `MotionStyle`, one row per motion."""
        rows, columns = list(self._styles), dict[str, NDArray[Any]]()
        same = rows[style[0]] if len(style) and (style == style[0]).all() else None
        for index, name in enumerate(MotionStyle._fields):
            kind = DTYPES.get(name, np.bool_)
            if same is not None:
                columns[name] = np.full(len(style), same[index], kind)
            else:
                columns[name] = np.array([row[index] for row in rows], dtype=kind).take(style)
        return columns

    def _keep_whole(
        self,
        styles: dict[str, NDArray[Any]],
        programmed: Mask,
        counted: Mask,
        start: Array,
        end: Array,
        block: Ints,
    ) -> Array | None:
        """Mark motions in which an axis might roll over: they must not be split, nor their angles cross a half turn.

        Returns the range of the angles to which absolute words lead these axes, see `Moves.angles`.
        """
        if self.rolls is None:
            return None
        turning, free = np.flatnonzero(self.rolls), styles["rule"] != Rule.PASS
        start, end = start[:, turning], end[:, turning]
        directed = counted[:, turning]
        for first, stop, axes in self._directed:
            directed[first:stop] |= [bool(axes >> self.columns[column] & 1) for column in turning]
        plain, cuts = programmed[:, turning] & ~directed, styles["kind"] != MotionKind.RAPID
        offsets = np.array([offset for offset, *_ in self._frames] or [(0.0,) * len(self.columns)])[:, turning]
        offset = offsets if len(offsets) == 1 else offsets[styles["frame"]]
        rows = np.zeros(len(block), dtype=np.bool_)
        if found := half_turns(directed, start, end):
            over, doubtful = found
            rows = over & free
            styles["rotary_as_programmed"] = styles["rotary_as_programmed"] | doubtful
            self.overturned = _first(block, rows & cuts, self.overturned)
        if self.winding is not None:
            back = self.winding.back(turning, plain, start - offset, end - offset) & free & ~rows
            rows |= back
            self.brought_back = _first(block, back & cuts, self.brought_back)
        styles["whole"] = styles["whole"] | rows
        angles = np.full((len(self.columns), 2), np.nan)
        angles[turning] = extremes(plain, end - offset)
        return angles

    def _mask_column(self, masks: dict[int, int], neutral: Mask) -> Mask:
        """(n, n_axes) the bit masks of some motions as flags; the others keep those of `neutral`."""
        bits = np.array([1 << column for column in self.columns], dtype=np.int64)
        flags = (np.array(list(masks.values()), dtype=np.int64)[:, None] & bits) != 0
        return _sparse(dict(zip(masks, flags, strict=True)), neutral)

    def _arc_columns(self, count: int) -> tuple[Array, Array, Array]:
        rows, nowhere, none = list(self._arcs), np.broadcast_to(np.nan, (count, 3)), np.broadcast_to(np.nan, count)
        if not (rows or self._circles):
            return nowhere, nowhere, none
        centre, normal, sweep = nowhere.copy(), nowhere.copy(), none.copy()
        if rows:
            centre[rows], normal[rows], sweep[rows], _ = zip(*self._arcs.values(), strict=True)
        for each in self._circles:
            centre[each.row], normal[each.row], sweep[each.row] = each.centre, each.normal, each.sweep
        return centre, normal, sweep


def _first(block: Ints, rows: Mask, known: int | None) -> int | None:
    """The block of the first motion in `rows`, unless an earlier one is known already."""
    found = np.flatnonzero(rows)
    return int(block[found[0]]) if known is None and found.size else known


def _sparse(values: Mapping[int, Any], neutral: NDArray[Any]) -> NDArray[Any]:
    """The column `neutral`, with the `values` of some rows in their place."""
    if not values:
        return neutral
    column = neutral.copy()
    column[list(values)] = list(values.values())
    return column


def _joined_ends(parts: Sequence[MotionColumns], columns: list[int]) -> tuple[Array, Array]:
    """Start and end points of all stretches; views of one path if each motion starts where the previous one ended."""
    starts, ends = zip(*(part.ends(columns) for part in parts), strict=True)
    if len(parts) == 1:
        return starts[0], ends[0]
    path, at = np.concatenate([starts[0][:1], *ends]), 0
    for part, start in zip(parts, starts, strict=True):
        seen = start if part.path is None else start[:1]
        if path[at : at + len(seen)].tobytes() != seen.tobytes():
            return np.concatenate(starts), path[1:]
        at += len(start)
    return path[:-1], path[1:]


def _joined(columns: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Columns concatenated; a single column is returned unchanged."""
    return columns[0] if len(columns) == 1 else np.concatenate(columns)


@mutable
class MotionColumns:
    """Consecutive motions as columns; `programmed` and `unplaced` are bit masks by letter, `start` and `end` (n, 9).

    path  (n + 1, 9) the points of which `start` and `end` are views, if each motion starts where the previous one ends
    """

    block: Ints
    programmed: Ints
    style: Ints
    feed: Array
    start: Array
    end: Array
    unplaced: Ints
    path: Array | None = None

    def ends(self, columns: list[int]) -> tuple[Array, Array]:
        """Start and end points in the given letter columns; views of one path if the motions are contiguous."""
        if self.path is None:
            start, end = (each.take(columns, axis=1, mode="clip") for each in (self.start, self.end))
            return start, end
        path = self.path.take(columns, axis=1, mode="clip")
        return path[:-1], path[1:]


@mutable
class Buffer:
    """Single motions, as Python lists."""

    block: list[int] = field(default_factory=list)
    programmed: list[int] = field(default_factory=list)
    style: list[int] = field(default_factory=list)
    feed: list[float] = field(default_factory=list)
    start: list[float] = field(default_factory=list)
    end: list[float] = field(default_factory=list)
    unplaced: list[int] = field(default_factory=list)

    def stretch(self) -> MotionColumns:
        """The motions as columns."""
        return MotionColumns(
            np.array(self.block, dtype=np.int64),
            np.array(self.programmed, dtype=np.int64),
            np.array(self.style, dtype=np.int64),
            np.array(self.feed, dtype=np.float64),
            np.array(self.start, dtype=np.float64).reshape(-1, N_LETTERS),
            np.array(self.end, dtype=np.float64).reshape(-1, N_LETTERS),
            np.array(self.unplaced, dtype=np.int64),
        )
