"""Turns of rotary axes: the feed of blocks that turn them alone, and axes that may roll over.

The feed of a block that turns rotary axes alone is degrees per minute, until a correction moves a linear axis too.

Many controls take F as the speed of the linear axes as soon as one of them moves, and let rotary axes keep pace. A
correction of some micrometres at 500 mm/min is done in milliseconds, and so would be the turn. A corrected turn is
therefore given its own time: where the control's rule is known, by the F that makes the little linear motion last as
long; else in inverse time (G93), which means the same everywhere. What was in force is stated anew after it.

In inverse time LinuxCNC moves linear axes no slower than `LEAST_PACE`. A turn that this would hurry gets the F of its
little linear motion too, in feed per minute (G94), and G93 again behind it.

Axes roll over where a parameter of the control lets an absolute word lead them the shorter way round. Nobody sees it in
the program. Up to half a turn both ways are one; beyond it a control with roll-over turns the other
way, and pieces of the longer way would lead the axis round against what the program did. So such a motion stays whole:
its end is right either way. An axis that counts from 0 to 360 degrees and that increments have led out of them stands
at another number than one that goes on counting: where words do not go the shorter way, a plain word behind that leads
the two different ways, however short, and stays whole, too.
Source: Fanuc 30i parameter manual, No. 1008 (ROA, RAB); LinuxCNC takes words as they are, unless its axes are wrapped.
Siemens, "SINUMERIK 840D sl, axes and spindles", R2: modulo axes, MD30455 (bit 2: G90 as AC or as DC).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ncfix.control.moves import FeedMode, MotionKind, Moves
from ncfix.diagnostics import Message
from ncfix.text.tree import Program

if TYPE_CHECKING:
    from ncfix.control.control import ProgramControl
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
    alone: NDArray[np.bool_] = moves.kind == MotionKind.FEED
    for column in np.flatnonzero(~moves.rotary):
        alone &= moves.end[:, column] - moves.start[:, column] == 0
    return alone


def turn_alone(moves: Moves, row: int) -> float:
    """The angle of a motion at feed that turns rotary axes alone, in degrees; 0 for others."""
    if moves.kind[row] != MotionKind.FEED:
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


Mask = NDArray[np.bool_]

ROLLED = "NCF247"
HALF_A_TURN = math.pi * (1 - 1e-9)
BESIDE = math.radians(0.5)
"""rad; no correction turns an axis by as much."""
BESIDE_ZERO = 1e-9
"""rad; nearer to zero an angle is zero."""

TEXT = (
    "a rotary axis turns by half a turn or more here: a control with roll-over goes the other way, and such motions are"
    " corrected at their ends and not split"
)
BACK = (
    "increments have led a rotary axis beyond a full turn, and here it comes back: a control that counts from 0 to 360"
    " degrees may go another way, and such motions are corrected at their ends and not split"
)
HINT = "write such a turn in two blocks, if it is meant to go the longer way"
WORDS = "say which way it is meant to go: ACP, ACN or DC"


def watch(control: ProgramControl) -> None:
    """Have motions watched in which an axis might roll over: one that goes a full turn or more, as far as is known."""
    travel = [(-math.inf, math.inf)] * len(control.machine) if control.kinematics is None else control.kinematics.travel
    wide = np.array([high - low >= 2 * math.pi for low, high in travel])
    rolls: Mask = np.logical_and(wide, control.builder.rotary)
    control.builder.rolls = rolls if rolls.any() else None


def overturned(rolls: Mask, said: Mask, start: NDArray[np.float64], end: NDArray[np.float64]) -> Mask:
    """Motions (n,) from `start` to `end` (n, n_axes), rad, that turn such an axis by half a turn or more.

    said  (n, n_axes) axes whose words say which way they turn: increments, and those that name the sense
    """
    way = np.where(said[:, rolls], 0.0, np.abs(end[:, rolls] - start[:, rolls]))
    return np.asarray((way >= HALF_A_TURN).any(axis=1))


@dataclass(slots=True)
class Winding:
    """Which axes stand where a word that was no plain angle has led them; motions may come in parts.

    wound  (n_axes,)
    """

    wound: Mask

    def back(self, rolls: Mask, plain: Mask, start: NDArray[np.float64], end: NDArray[np.float64]) -> Mask:
        """Motions (n,) whose plain words bring such an axis back from beyond 0 and 360 degrees.

        plain       (n, n_axes) axes with words that are absolute angles and do not say which way to go
        start, end  (n, n_axes) rad, in the numbers of the program
        """
        found = np.zeros(len(plain), dtype=bool)
        for column in np.flatnonzero(rolls).tolist():
            there, angle = plain[:, column], start[:, column]
            rows = np.flatnonzero(there | (end[:, column] != angle))
            if not rows.size:
                continue
            wound = ~there[rows]
            before = np.append(self.wound[column], wound[:-1])
            outside = (angle[rows] < -BESIDE_ZERO) | (angle[rows] >= 2 * math.pi - BESIDE_ZERO)
            found[rows] |= ~wound & before & outside
            self.wound[column] = wound[-1]
        return found


def doubtful(rolls: Mask, start: NDArray[np.float64], end: NDArray[np.float64]) -> Mask:
    """Motions (n,) about half a turn long, and those before them: a correction of the angle might turn them round."""
    way = np.abs(end[:, rolls] - start[:, rolls])
    near: Mask = np.any(np.abs(way - math.pi) < BESIDE, axis=1)
    return np.asarray(near | np.append(near[1:], False))


def extremes(rolls: Mask, plain: Mask, end: NDArray[np.float64]) -> NDArray[np.float64]:
    """The smallest and the largest angle (n_axes, 2), rad, to which plain words lead axes that may roll over.

    plain  (n, n_axes) axes with such words
    end    (n, n_axes) rad, in the numbers of the program
    """
    named = plain & rolls & np.isfinite(end)
    low = np.min(end, axis=0, where=named, initial=0.0)
    high = np.max(end, axis=0, where=named, initial=0.0)
    return np.where(rolls[:, None], np.column_stack((low, high)), np.nan)


def say(control: ProgramControl, program: Program) -> None:
    """Say where the first of them is, of each kind."""
    for block, text, hint in ((control.builder.overturned, TEXT, HINT), (control.builder.brought_back, BACK, WORDS)):
        if block is not None and text not in control.rolled:
            control.rolled[text] = Message(ROLLED, text, program.place(block), hint)


def remarks(control: ProgramControl) -> tuple[Message, ...]:
    """All that there is to say of the program, in the same order whether it was followed in parts or as a whole."""
    rolled = (control.rolled[text] for text in (TEXT, BACK) if text in control.rolled)
    return (*control.knowledge.assumed.values(), *control.messages.values(), *rolled)
