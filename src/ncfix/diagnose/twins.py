"""Names that act in the same way in these data: what the one shows, the other can show, and the other way about.

A spindle that grows and a frame that drifts along a tool that never turns differ in the course that is assumed of them,
a bed and a ram that sag in the power of their curve. Odds between such names are odds of what is assumed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ncfix.diagnose.evidence import SIZES, Court, Member
from ncfix.measure.measurement import Array
from ncfix.measure.solve import orthonormal, without

SAME = 0.8
"""Share of what either may show, its squares beside what is free, that the other must be able to show."""
TOLD = 6.0
"""Squared noise units of what the first shows that the second cannot, from which on data tell them apart."""


def acts_alike(court: Court, members: Sequence[Member], own: Member, other: str) -> bool:
    """Whether a name has a form that can do what `own`, one of the members, does in these data."""
    share = court.share(members)
    first = _white(court, own.group, share)
    shown = first @ court.numbers(members, share)[list(members).index(own)]
    return any(alike(first, shown, _white(court, form, share)) for form in court.forms[other])


def _white(court: Court, group: int, share: float) -> Array:
    """The columns of a form in units of noise and background, (n, p)."""
    white: Array = court.columns[:, court.part(group)] / np.sqrt(court.background.variance(share))[:, None]
    return white


def alike(first: Array, shown: Array, second: Array) -> bool:
    """Whether the second columns can show what is shown, and either what the other may show."""
    return _left(shown, second) < TOLD and min(_held(first, second), _held(second, first)) > SAME


def _left(shown: Array, by: Array) -> float:
    """Squares of what is shown that columns of the largest size considered cannot show, and of the numbers behind them.

    Without the latter a combination that hardly shows could stand for anything.
    """
    sized = SIZES[-1] * by
    seen = sized.T @ shown
    return float(shown @ shown - seen @ np.linalg.solve(np.eye(sized.shape[1]) + sized.T @ sized, seen))


def _held(columns: Array, by: Array) -> float:
    """Share of the squares of some columns that others can show."""
    return 1.0 - float((without(orthonormal(by), columns) ** 2).sum() / (columns**2).sum())
