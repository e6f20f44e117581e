"""Is there something that has no name? The names that were found stand against rivals without one.

A rival may come on top of the names, or take the place of some or all of them: with each of the likeliest rivals there
from the beginning the names are looked for anew. The whole that explains the data best, what it chose from counted
against it, is taken. A name may be wrong in its shape by a tenth and more (`MISSHAPEN`): what a smooth change of its
size along the axes and the time explains is no reason for a rival.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ncfix.diagnose.background import SHARES
from ncfix.diagnose.evidence import Court, Member
from ncfix.diagnose.rivals import functions, scaled
from ncfix.diagnose.selection import LEAST, Selected, judged, likelihood, select
from ncfix.measure.measurement import Array

MISSHAPEN = 0.15
"""How much the shape of an effect may differ from that of the catalogue, as a share of its size."""
SLOWLY = 1.0
"""Over which length of the axes, of half their travel."""
STARTS = 2
"""Rivals from which names are looked for anew."""


def completed(court: Court, selected: Selected) -> Selected:
    """The names as they are, or with a rival beside them, or others beside a rival."""
    if not court.rivals:
        return selected
    offered = [selected, *_beside(court, selected), *_instead(court, selected)]
    score = [_weight(court, each) + LEAST * (not each.unnamed) for each in offered]
    return offered[int(np.argmax(score))]


def _beside(court: Court, selected: Selected) -> list[Selected]:
    """The likeliest rival on top of the names."""
    members = list(selected.members.values())
    evidence = court.heard(members, among=court.unnamed, beside=allowance(court, members))
    odds = {name: evidence.of(court.forms[name]) for name in court.rivals}
    best = max(odds, key=lambda name: odds[name])
    if not members or odds[best] < LEAST:
        return []
    both = {**selected.members, best: evidence.best(court.forms[best])}
    return [judged(court, both, selected.first, selected.null, selected.steps)]


def _instead(court: Court, selected: Selected) -> list[Selected]:
    """Names beside a rival that was there before them."""
    evidence = court.heard([], among=court.unnamed)
    odds = {name: evidence.of(court.forms[name]) for name in court.rivals}
    likely = sorted((name for name in odds if odds[name] > LEAST), key=lambda name: -odds[name])
    return [select(court, selected.null, [name]) for name in likely[:STARTS]]


def _weight(court: Court, selected: Selected) -> float:
    """Log likelihood of a whole, its names in the shapes of the catalogue or misshapen."""
    named = [selected.members[name] for name in selected.named]
    plain = likelihood(court, selected.members)
    misshapen = likelihood(court, selected.members, allowance(court, named)) if named else plain
    return float(np.logaddexp(plain, misshapen) - np.log(2))


def allowance(court: Court, named: Sequence[Member]) -> Array | None:
    """What the named effects together would show if their shapes differed a little, in the coordinates, (n, k)."""
    if not named:
        return None
    share = SHARES[int(court.heard(named, among=range(0)).null.argmax())]
    whole = np.sum(court.shown(named, share), axis=0)
    view = court.background.view
    time = view.column("time_s")
    signals = [*scaled(view).T, *([2 * (time - time.mean()) / np.ptp(time)] if np.ptp(time) > 0 else [])]
    kernel = sum(np.exp(-0.5 * (u[:, None] - u) ** 2 / SLOWLY**2) for u in signals) / len(signals)
    slow = functions(np.asarray(kernel))[np.maximum(view.row, 0)]
    return court.background.seen(MISSHAPEN * whole[:, None] * slow)
