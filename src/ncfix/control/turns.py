"""Blocks that turn rotary axes alone: their feed is degrees per minute, until a correction moves a linear axis too.

Many controls take F as the speed of the linear axes as soon as one of them moves, and let rotary axes keep pace. A
correction of some micrometres at 500 mm/min is done in milliseconds, and so would be the turn. A corrected turn is
therefore given its own time: where the control's rule is known, by the F that makes the little linear motion last as
long; else in inverse time (G93), which means the same everywhere. What was in force is stated anew after it.

In inverse time LinuxCNC moves linear axes no slower than `LEAST_PACE`. A turn that this would hurry gets the F of its
little linear motion too, in feed per minute (G94), and G93 again behind it.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ncfix.control.moves import FeedMode, Kind, Moves

if TYPE_CHECKING:
    from ncfix.writer.target import Target

FloatArray = NDArray[np.float64]

UNTIMED = "rotary axes turn alone, and the time that takes is not known: their feed is no plain number"
LEAST_PACE = 0.1
"""Units per minute; what LinuxCNC makes of slower motions in inverse time (`inverse_time_rate_straight`)."""
FEED_GROUPS = ("XYZ", "UVW", "ABC")
"""The axes whose way F is the speed of: the first group that moves (LinuxCNC, "Machining Center Overview", feed)."""
DIGITS = 6
"""Significant digits of an F word of ours."""


def turns_alone(moves: Moves) -> NDArray[np.bool_]:
    """(n,) motions at feed in which no linear axis moves: whether `turn_alone` can be other than 0."""
    alone: NDArray[np.bool_] = moves.kind == Kind.FEED
    for column in np.flatnonzero(~moves.rotary):
        alone &= moves.end[:, column] - moves.start[:, column] == 0
    return alone


def turn_alone(moves: Moves, row: int) -> float:
    """The angle of a motion at feed that turns rotary axes alone, in degrees; 0 for others."""
    if moves.kind[row] != Kind.FEED:
        return 0.0
    way = moves.end[row] - moves.start[row]
    if (way[~moves.rotary] != 0).any():
        return 0.0
    return float(np.rad2deg(np.linalg.norm(way[moves.rotary])))


def at_their_pace(target: Target) -> Target:
    """The target; a turn in inverse time that LinuxCNC would hurry as one whose time is kept by a feed per minute."""
    path = np.vstack((target.start, np.round(target.ends * 10.0**target.decimals) / 10.0**target.decimals))
    linear = [letter not in FEED_GROUPS[-1] for letter in target.letters]
    steps = np.linalg.norm(np.diff(path, axis=0)[:, linear], axis=1)
    ways = np.array([way(target.letters, *pair, target.diameter) for pair in pairwise(path)])
    if np.all((steps == 0) | (ways * target.feed / target.shares >= LEAST_PACE)):
        return target
    known = target.feed > 0
    return replace(
        target, inverse_time=False, turn_minutes=1.0 / target.feed if known else float("inf"), back_to_inverse_time=True
    )


def minutes(moves: Moves, row: int, own_feed: bool) -> float:
    """The time of a motion at feed that turns rotary axes alone, in minutes; NaN for others, infinite if not known.

    An F that stood before a change between inch and mm keeps its degrees, but no longer shows them: with two units in
    a program, only an F of the motion's own block is known (`own_feed`).
    """
    turn, mode = turn_alone(moves, row), moves.feed_mode[row]
    if not turn or mode == FeedMode.INVERSE_TIME:
        return float("nan")
    if not own_feed and len({frame.unit for frame in moves.frames}) > 1:
        return float("inf")
    feed = moves.feed[row] / moves.frames[moves.frame[row]].unit
    return float(turn / feed) if mode == FeedMode.PER_MINUTE and feed > 0 else float("inf")


def is_dragged(target: Target) -> bool:
    """Whether a turn of rotary axes alone gets a linear motion, which would take its feed over."""
    if np.isnan(target.turn_minutes):
        return False
    linear = np.array([letter not in FEED_GROUPS[-1] for letter in target.letters])
    steps = np.diff(np.vstack((target.start, target.ends)), axis=0)
    half = 0.5 * 10.0 ** -target.decimals.astype(float)
    return bool(np.any(np.abs(steps[:, linear]) >= half[linear]))


def way(letters: tuple[str, ...], begin: FloatArray, end: FloatArray, diameter: bool) -> float:
    """The way that F is the speed of, in program units: of linear axes, of rotary axes where none of those moves.

    begin, end  (n_axes,) program numbers; `diameter`: those of X are twice the way
    """
    step = end - begin
    if diameter and "X" in letters:
        step[letters.index("X")] /= 2
    lengths = (np.linalg.norm(step[[letter in group for letter in letters]]) for group in FEED_GROUPS)
    return float(next((length for length in lengths if length > 0), 0.0))


def number(value: float) -> str:
    """The number after F."""
    return f"{value:.{max(3, DIGITS - 1 - int(np.floor(np.log10(value))))}f}"
