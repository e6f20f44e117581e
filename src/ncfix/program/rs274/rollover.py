"""Rotary axes that may roll over: a parameter of the control lets an absolute word lead them the shorter way round.

Nobody sees it in the program. Up to half a turn both ways are one; beyond it a control with roll-over turns the other
way, and pieces of the longer way would lead the axis round against what the program did. So such a motion stays whole:
its end is right either way.
Source: Fanuc 30i parameter manual, No. 1008 (ROA, RAB); LinuxCNC takes words as they are, unless its axes are wrapped.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ncfix.diagnostics import Message
from ncfix.program.tree import Program

if TYPE_CHECKING:
    from ncfix.program.rs274.control import Control

ROLLED = "NCF247"
HALF_A_TURN = math.pi * (1 - 1e-9)
BESIDE = math.radians(0.5)
"""rad; no correction turns an axis by as much."""

TEXT = (
    "a rotary axis turns by half a turn or more here: a control with roll-over goes the other way, and such motions are"
    " corrected at their ends and not split"
)
HINT = "write such a turn in two blocks, if it is meant to go the longer way"


def watch(control: Control) -> None:
    """Have motions watched in which an axis might roll over: one that goes a full turn or more, as far as is known."""
    if control.rules.strict:
        return
    travel = [(-math.inf, math.inf)] * len(control.machine) if control.kinematics is None else control.kinematics.travel
    wide = np.array([high - low >= 2 * math.pi for low, high in travel])
    rolls: NDArray[np.bool_] = np.logical_and(wide, control.builder.rotary)
    control.builder.rolls = rolls if rolls.any() else None


def overturned(rolls: NDArray[np.bool_], start: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Motions (n,) from `start` to `end` (n, n_axes), rad, that turn such an axis by half a turn or more."""
    way = np.abs(end[:, rolls] - start[:, rolls])
    return np.asarray((way >= HALF_A_TURN).any(axis=1))


def doubtful(rolls: NDArray[np.bool_], start: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Motions (n,) about half a turn long, and those before them: a correction of the angle might turn them round."""
    way = np.abs(end[:, rolls] - start[:, rolls])
    near: NDArray[np.bool_] = np.any(np.abs(way - math.pi) < BESIDE, axis=1)
    return np.asarray(near | np.append(near[1:], False))


def say(control: Control, program: Program) -> None:
    """Say where the first of them is."""
    block = control.builder.overturned
    if block is None or any(message.code == ROLLED for message in control.messages.values()):
        return
    control.messages[TEXT] = Message(ROLLED, TEXT, program.place(block), HINT)
