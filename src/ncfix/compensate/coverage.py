"""Motions that cut and have no figure: how many there are, and why.

Figures are of feeds, arcs and holes. One that is not in them, because it passes by rule, is refused, or begins or ends
where nobody knows, is counted here by the reason, so that no figure speaks for what was not looked at.
"""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

import numpy as np

from ncfix.compensate.plan.arrays import Index, Mask
from ncfix.control.moves import Kind, Moves, Rule
from ncfix.control.passing import PASS_RULES, Pass

REFUSED = "refused"
LEFT = "an axis is left where it stands"
UNKNOWN = "where it begins or ends is not known"
MEASURED = "it leads to where the machine has measured itself"
BY_RULE = "passed by rule"
"""Of motions of which nobody says by which."""


class Why(NamedTuple):
    """Why motions have no figure; `cuts`: they may cut, and not be right."""

    reason: str
    cuts: bool


def rule_of(moves: Moves, row: int) -> Why:
    """The rule by which a motion passes."""
    rule = Pass.NONE if moves.passing is None else Pass(int(moves.passing[row]))
    return Why(BY_RULE, True) if rule is Pass.NONE else Why(PASS_RULES[rule].name, PASS_RULES[rule].cuts)


def at_feed(moves: Moves) -> Mask:
    """(n,) feeds, arcs and holes, also those that pass."""
    found: Mask = (moves.kind != Kind.RAPID) & (moves.kind != Kind.DWELL)
    return found


def at_measured_places(moves: Moves) -> Mask:
    """(n,) motions of which a word is computed from what the machine has measured, with its error in it."""
    found: Mask = np.zeros(len(moves), dtype=bool) if moves.measured is None else np.any(moves.measured, axis=1)
    return found


def without_figure(moves: Moves, kept: Mask, left: Mask | None, own: Mask | None = None) -> Counter[str]:
    """Motions without a figure before and after a correction, by reason, of those that are `own` (n,) if given.

    kept  (n,) left as they were
    left  (n, n_axes) axes that were left where they stand, along which figures say nothing; None: none
    """
    fed = at_feed(moves) if own is None else at_feed(moves) & own
    beside = np.zeros(len(moves), dtype=bool) if left is None else left[:, ~moves.rotary].any(axis=1)
    passed, measured = moves.rule == Rule.PASS, at_measured_places(moves)
    found = Counter(rule_of(moves, row).reason for row in np.flatnonzero(fed & passed).tolist())
    found[REFUSED] += int(np.count_nonzero(fed & kept & ~passed))
    found[MEASURED] += int(np.count_nonzero(fed & ~kept & ~passed & measured))
    found[LEFT] += int(np.count_nonzero(fed & ~kept & ~passed & ~measured & beside))
    return +found


def not_looked_at(moves: Moves) -> dict[Why, Index]:
    """The feeds, arcs and holes that a look along the path leaves out."""
    ends, starts = (np.isfinite(places).all(axis=1) for places in (moves.end, moves.start))
    lost = np.where(moves.kind == Kind.CYCLE, ~ends, ~(ends & starts))
    found: dict[Why, list[int]] = {}
    measured = at_measured_places(moves)
    for row in np.flatnonzero(at_feed(moves) & (lost | measured | (moves.rule == Rule.PASS))).tolist():
        if moves.rule[row] == Rule.PASS:
            why = rule_of(moves, row)
        else:
            why = Why(UNKNOWN, True) if lost[row] else Why(MEASURED, False)
        found.setdefault(why, []).append(row)
    return {why: np.array(rows, dtype=np.intp) for why, rows in found.items()}
