"""Which of many rows of a design to take: an exchange of one candidate after another (after Fedorov).

From a first choice that maximises the determinant of the information (D-optimal) candidates are exchanged as long as
the worst variance of what is to be predicted falls (G-optimal).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ncfix.measure.measurement import Array, Index

ACTIVE = 250
"""Predictions, the worst ones, that an exchange looks at; the rest is looked at again after each pass."""
RIDGE = 1e-9
"""Information that counts as none, of that of a candidate."""
PASSES = 8
FIRST, CHUNK = 32, 32
"""Targets that an addition looks at first; candidates that it looks at more closely at a time."""
STARTS, SMALL = 20, 20_000
"""Random starts besides the first choice, where candidates times predictions are few."""
EXCHANGED = 1e-3
"""A relative gain below this is none."""
WORTHWHILE = 5e-3
"""A pass that gains less is the last one."""


@dataclass(frozen=True)
class Pool:
    """Candidates as rows of a design.

    blocks   (n, r, p) the rows of each candidate over all that is determined, set-up included, for a noise of one
    targets  (t, p) the combinations whose variance matters
    """

    blocks: Array
    targets: Array


def choose(pool: Pool, count: int, fixed: int = 0) -> Index:
    """Indices of the candidates to be measured; the first `fixed` blocks are measured anyway."""
    inverse = np.linalg.inv(information(pool, range(fixed)))
    free = np.ones(len(pool.blocks), dtype=bool)
    free[:fixed] = False
    chosen: list[int] = []
    for _ in range(count):
        spread = pool.blocks @ inverse
        small = np.einsum("nip,njp->nij", spread, pool.blocks) + np.eye(pool.blocks.shape[1])
        gain = np.where(free, np.linalg.slogdet(small)[1], -np.inf)
        best = int(gain.argmax())
        chosen.append(best)
        free[best] = False
        inverse = inverse - spread[best].T @ np.linalg.solve(small[best], spread[best])
    random = np.random.default_rng(0)
    others = np.arange(fixed, len(pool.blocks))
    size = len(pool.targets) * len(pool.blocks)
    starts = [chosen] + [random.permutation(others)[:count].tolist() for _ in range(STARTS if size < SMALL else 0)]
    found = [_exchanged(pool, start, fixed) for start in starts]
    chosen, _ = min(found, key=lambda each: each[1])
    return np.array(chosen, dtype=np.int64)


def _exchanged(pool: Pool, start: list[int], fixed: int) -> tuple[list[int], float]:
    """Replace one pose after another by the candidate that lowers the worst variance most; that variance."""
    variance = variances(pool, [*range(fixed), *start])
    best, worst = list(start), float(variance.max())
    looked_at = np.zeros(len(variance), dtype=bool)
    for _ in range(PASSES):
        looked_at[np.argsort(variance)[-ACTIVE:]] = True
        chosen = _passed(Pool(pool.blocks, pool.targets[looked_at]), best, fixed)
        variance = variances(pool, [*range(fixed), *chosen])
        before = worst
        if variance.max() < worst:
            best, worst = chosen, float(variance.max())
        if worst > before * (1 - WORTHWHILE) and looked_at[variance.argmax()]:
            break
    return best, worst


def _passed(pool: Pool, start: list[int], fixed: int) -> list[int]:
    """One pass over all poses."""
    chosen = list(start)
    worst = float(variances(pool, [*range(fixed), *chosen]).max())
    for place in range(len(chosen)):
        others = [*range(fixed), *chosen[:place], *chosen[place + 1 :]]
        better, value = best_addition(pool, others)
        if value < worst * (1 - EXCHANGED):
            chosen[place], worst = better, value
    return chosen


def best_addition(pool: Pool, others: list[int]) -> tuple[int, float]:
    """The candidate that, added to the others, leaves the smallest worst variance, and that variance.

    With the rows B of a candidate and the information M without it, a target t gains |L^-1 B M^-1 t|^2, where
    L L' = 1 + B M^-1 B'. What a candidate leaves of the FIRST targets that are worst without it bounds what it leaves
    of all from below: the others are worked out for the candidates that may still be best, CHUNK at a time.
    """
    n, r, p = pool.blocks.shape
    inverse = np.linalg.inv(information(pool, others))
    projected = inverse @ pool.targets.T
    present = np.einsum("tp,pt->t", pool.targets, projected)
    order = np.argsort(-present, kind="stable")
    first, rest = order[:FIRST], order[FIRST:]
    small = (pool.blocks.reshape(n * r, p) @ inverse).reshape(n, r, p) @ np.swapaxes(pool.blocks, 1, 2)
    white = _whitening(small)
    bound = _left(pool.blocks, white, projected[:, first], present[first])
    bound[others] = np.inf
    best, worst = int(bound.argmin()), np.inf
    for chunk in np.split(np.argsort(bound, kind="stable"), range(CHUNK, n, CHUNK)):
        if bound[chunk[0]] >= worst:
            break
        left = bound[chunk]
        if len(rest):
            left = np.maximum(left, _left(pool.blocks[chunk], white[chunk], projected[:, rest], present[rest]))
        if left.min() < worst:
            best, worst = int(chunk[left.argmin()]), float(left.min())
    return best, worst


def _left(blocks: Array, white: Array, projected: Array, present: Array) -> Array:
    """The largest variance of some targets (p, t) once each of the blocks (n, r, p) is there, (n,)."""
    n, r, p = blocks.shape
    cross = white @ (blocks.reshape(n * r, p) @ projected).reshape(n, r, -1)
    gain = np.square(cross, out=cross).sum(axis=1)
    result: Array = (present - gain).max(axis=1)
    return result


def _whitening(small: Array) -> Array:
    """L^-1, where L L' = 1 + `small`; where poses leave much open, rounding spoils that `small` is not negative."""
    try:
        found: Array = np.linalg.inv(np.linalg.cholesky(small + np.eye(small.shape[1])))
    except np.linalg.LinAlgError:
        values, ways = np.linalg.eigh(small)
        found = np.swapaxes(ways, 1, 2) / np.sqrt(1 + np.maximum(values, 0.0))[:, :, None]
    return found


def information(pool: Pool, rows: Sequence[int]) -> Array:
    """The information matrix (p, p) of some blocks, with next to nothing added so that it has an inverse."""
    p = pool.blocks.shape[2]
    stacked = pool.blocks[list(rows)].reshape(-1, p)
    total: Array = stacked.T @ stacked + RIDGE * np.eye(p) * max(float((pool.blocks**2).mean()), 1e-300)
    return total


def variances(pool: Pool, rows: Sequence[int]) -> Array:
    """The variance of each target if these blocks are measured, (t,)."""
    inverse = np.linalg.inv(information(pool, rows))
    variance: Array = np.einsum("tp,pq,tq->t", pool.targets, inverse, pool.targets, optimize=True)
    return variance
