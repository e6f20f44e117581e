"""Rotary axes that may roll over: a parameter of the control lets an absolute word lead them the shorter way round.

Nobody sees it in the program. Up to half a turn both ways are one; beyond it a control with roll-over turns the other
way, and pieces of the longer way would lead the axis round against what the program did. So such a motion stays whole:
its end is right either way. An axis that counts from 0 to 360 degrees and that increments have led out of them stands
at another number than one that goes on counting: where words do not go the shorter way, a plain word behind that leads
the two different ways, however short, and stays whole, too.
Source: Fanuc 30i parameter manual, No. 1008 (ROA, RAB); LinuxCNC takes words as they are, unless its axes are wrapped.
Siemens, "SINUMERIK 840D sl, axes and spindles", R2: modulo axes, MD30455 (bit 2: G90 as AC or as DC).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ncfix.diagnostics import Message
from ncfix.text.tree import Program

if TYPE_CHECKING:
    from ncfix.control.control import Control

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


def watch(control: Control) -> None:
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


def say(control: Control, program: Program) -> None:
    """Say where the first of them is, of each kind."""
    for block, text, hint in ((control.builder.overturned, TEXT, HINT), (control.builder.brought_back, BACK, WORDS)):
        if block is not None and text not in control.rolled:
            control.rolled[text] = Message(ROLLED, text, program.place(block), hint)


def remarks(control: Control) -> tuple[Message, ...]:
    """All that there is to say of the program, in the same order whether it was followed in parts or as a whole."""
    rolled = (control.rolled[text] for text in (TEXT, BACK) if text in control.rolled)
    return (*control.knowledge.assumed.values(), *control.messages.values(), *rolled)
