"""Where an axis turns round, the side of its play that it is on is not known to the micrometre of its way.

A corrected program takes up the play of an axis where the program turns it round, by a step of some micrometres. Seen
from its text alone, the axis turns round where its rounded numbers do, and during the step it is on neither side. So
close to a turn both sides are possible.
"""

from __future__ import annotations

import numpy as np

from ncfix.compensate.direction import Signs, matters
from ncfix.compensate.findings import Array, Index, Mask
from ncfix.compensate.intent import Intent
from ncfix.machine import State

NEAR = 0.01
"""mm or rad; so close to its turn an axis may be on either side of its play."""
WINDOW = 24
"""Samples on both sides of a turn that are looked at."""


def uncertain(intent: Intent, rows: Index, fraction: Array) -> Mask:
    """(k, n_axes) at samples in order: the axis has just turned round, or is about to."""
    q = intent.joints_at(rows, fraction)
    found = np.zeros(q.shape, dtype=bool)
    if not matters(intent.machine) or len(rows) < 2:
        return found
    ways = intent.direction(rows, fraction)
    for axis in range(q.shape[1]):
        turns = np.flatnonzero(np.diff(ways[:, axis]) != 0)
        around = np.clip(turns[:, None] + np.arange(1 - WINDOW, WINDOW + 1), 0, len(rows) - 1)
        near = np.abs(q[around, axis] - q[turns, axis, None]) <= NEAR
        found[around[near], axis] = True
    return found


def other_side(intent: Intent, rows: Index, fraction: Array, turned: Mask) -> Array:
    """The tip of the real machine with axes `turned` (k, n_axes) on the other side of their play, (k, 3) mm."""
    ways = np.asarray(intent.direction(rows, fraction))
    flipped: Signs = np.where(turned, -ways, ways).astype(np.int8)
    state = intent.states(rows, fraction)
    return np.asarray(
        intent.machine.actual_tip(intent.joints_at(rows, fraction), State(state.tool_length, flipped, state.inputs))
    )
