"""Rotary axes: the feed of blocks that turn only rotary axes, and axes that may roll over.

The feed of a block that moves only rotary axes is degrees per minute, until a correction also moves a linear axis.
Many controls take F as the speed of the linear axes as soon as one of them moves, and let rotary axes keep pace. A
correction of some micrometres at 500 mm/min takes milliseconds, and so would the rotation. A corrected rotation
therefore gets its own time: if the control's rule is known, an F with which the small linear motion lasts as long;
otherwise in inverse time (G93), which means the same everywhere. The feed in force is restated after it.

An axis rolls over if a parameter of the control lets an absolute word turn it the shorter way. The program does not
show it. Up to half a turn both ways are the same; beyond it, a control with roll-over turns the other way, and pieces
of the longer way would turn the axis against the program's intention. So such a motion stays whole: its end is right
either way. An axis that the control counts from 0 to 360 degrees has another position than one that counts on, once
increments have moved it out of that range. If absolute words do not take the shorter way, the next one turns the two
in different directions, and its motion stays whole, too.
Source: Fanuc 30i parameter manual, No. 1008 (ROA, RAB); LinuxCNC takes words as they are, unless its axes are wrapped.
Siemens, "SINUMERIK 840D sl, axes and spindles", R2: modulo axes, MD30455 (bit 2: G90 as AC or as DC).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ncfix.arrays import Array, Index, Mask
from ncfix.control.moves import FeedMode, MotionKind, Moves
from ncfix.values import mutable

UNTIMED = (
    "rotary axes turn alone, and the duration is not known: their feed rate is not a plain number, or was not "
    "programmed since inch or mm came into force"
)


def turns_alone(moves: Moves) -> Mask:
    """(n,) feed motions in which rotary axes move and no linear axis does: those whose `turn_alone` is not 0."""
    alone: Mask = moves.kind == MotionKind.FEED
    for column in np.flatnonzero(~moves.rotary):
        alone &= moves.end[:, column] - moves.start[:, column] == 0
    rows = np.flatnonzero(alone)
    alone[rows] = (moves.end[rows] != moves.start[rows])[:, moves.rotary].any(axis=1)
    return alone


def turn_alone(moves: Moves, row: int) -> float:
    """The angle, degrees, of a feed motion that turns only rotary axes; 0 for other motions."""
    if moves.kind[row] != MotionKind.FEED:
        return 0.0
    way = moves.end[row] - moves.start[row]
    if (way[~moves.rotary] != 0).any():
        return 0.0
    return float(np.rad2deg(np.linalg.norm(way[moves.rotary])))


def written_feed(moves: Moves, row: int) -> float:
    """The number of the F word in force in a motion; NaN if unknown."""
    unit = 1.0 if moves.feed_mode[row] == FeedMode.INVERSE_TIME else moves.frames[moves.frame[row]].per_feed
    return float(moves.feed[row] / unit)


def minutes(moves: Moves, row: int) -> float:
    """Duration of a feed motion that turns only rotary axes, min; infinite if unknown, NaN for other motions."""
    turn, mode = turn_alone(moves, row), moves.feed_mode[row]
    if not turn or mode == FeedMode.INVERSE_TIME:
        return float("nan")
    feed = written_feed(moves, row)
    return turn / feed if mode == FeedMode.PER_MINUTE and feed > 0 else float("inf")


ROLLS = "NCF247"
HALF_A_TURN = math.pi * (1 - 1e-9)
MAX_CORRECTION_RAD = math.radians(0.5)
"""Limit, rad, that no correction of a rotary axis reaches."""
ZERO_ANGLE_RAD = 1e-9
"""Largest angle, rad, that counts as zero."""

ROLLED = {
    "a rotary axis turns by half a turn or more: a control with roll-over turns in the other direction, so ncfix "
    "corrects the ends of such motions and does not split them": (
        "if the axis must turn in the longer direction, write the turn in two blocks"
    ),
    "a rotary axis was moved beyond 360 degrees or below zero, and turns back here: a control that counts from 0 to "
    "360 degrees may turn in the other direction, so ncfix corrects the ends of such motions and does not split them": (
        "program the direction: ACP, ACN or DC"
    ),
}
"""Messages on axes that turn half a turn or more, and on axes that come back from beyond a full turn, with hints."""


def may_roll(travel: Sequence[tuple[float, float]] | None, rotary: Mask) -> Mask | None:
    """(n_axes,) rotary axes that may roll over: their travel is unknown, or a full turn or more. None: no axis."""
    wide = [travel is None or high - low >= 2 * math.pi for low, high in travel or [(0.0, 0.0)] * len(rotary)]
    rolls: Mask = np.logical_and(wide, rotary)
    return rolls if rolls.any() else None


def half_turns(directed: Mask, start: Array, end: Array) -> tuple[Mask, Mask] | None:
    """Motions (n,) that turn an axis by half a turn or more, and those that turn it about half a turn; None: neither.

    A correction of an angle might reverse the latter; the motions before them are included.

    directed    (n, k) axes whose words determine the direction of rotation: increments, and words that name it
    start, end  (n, k) rad, of the axes that may roll over
    """
    way = np.abs(end - start)
    if not (way >= math.pi - MAX_CORRECTION_RAD).any():
        return None
    over: Mask = np.any((way >= HALF_A_TURN) & ~directed, axis=1)
    near: Mask = np.any(np.abs(way - math.pi) < MAX_CORRECTION_RAD, axis=1)
    return over, near | np.append(near[1:], False)


@mutable
class Winding:
    """Axes whose current angle was set by anything but a plain absolute word; kept from part to part.

    wound  (n_axes,) whether each axis is in that state
    """

    wound: Mask

    def back(self, turning: Index, plain: Mask, start: Array, end: Array) -> Mask:
        """Motions (n,) whose plain words bring an axis back from an angle below 0 or beyond 360 degrees.

        turning     (k,) the axes that may roll over
        plain       (n, k) whether the axis has an absolute word that does not state the direction
        start, end  (n, k) rad, in program coordinates
        """
        found = np.zeros(len(plain), dtype=bool)
        for column, axis in enumerate(turning.tolist()):
            there, angle = plain[:, column], start[:, column]
            if there.all() and not self.wound[axis]:
                continue
            rows = np.flatnonzero(there | (end[:, column] != angle))
            if not rows.size:
                continue
            wound = ~there[rows]
            before = np.append(self.wound[axis], wound[:-1])
            outside = (angle[rows] < -ZERO_ANGLE_RAD) | (angle[rows] >= 2 * math.pi - ZERO_ANGLE_RAD)
            found[rows] |= ~wound & before & outside
            self.wound[axis] = wound[-1]
        return found


def extremes(plain: Mask, end: Array) -> Array:
    """The smallest and the largest angle (k, 2), rad, of plain words for each axis; 0 is always included.

    plain  (n, k) axes with such words
    end    (n, k) rad, in program coordinates
    """
    named = end if plain.all() else np.where(plain, end, 0.0)
    if not np.isfinite(named).all():
        named = np.where(np.isfinite(named), named, 0.0)
    return np.stack((named.min(axis=0, initial=0.0), named.max(axis=0, initial=0.0)), axis=1)
