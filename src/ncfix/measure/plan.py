"""Measurement plans: which poses tell most (Soons, section 3.3; exchange after Fedorov).

From many candidates a first choice maximises the determinant of the information (D-optimal); poses are then exchanged
one at a time as long as the worst prediction variance over the working volume falls (G-optimal). What no candidate can
tell is left out beforehand. To separate two effects, the variances of their coefficients take the place of predictions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ncfix.diagnostics import UsageError
from ncfix.machine import Effect, Machine, State
from ncfix.measure.candidates import Room, candidates
from ncfix.measure.measurement import Array, Index, Measurement
from ncfix.measure.observation import Observation
from ncfix.measure.observe import observe
from ncfix.measure.selection import Selection, select
from ncfix.measure.solve import NUISANCE_RANK, solve

CANDIDATES = 600
PLACES = 150
"""Poses at which the predictions are judged."""
RIDGE = 1e-9
"""Information that counts as none, of that of a candidate."""
PASSES = 8
STARTS, SMALL = 20, 20_000
"""Random starts besides the first choice, where candidates times predictions are few."""
EXCHANGED = 1e-3
"""A relative gain below this is none."""


@dataclass(frozen=True)
class Planned:
    """A plan and how good it is.

    plan      the poses, in an order in which none follows a pattern in time
    worst_um  the largest standard deviation of the predicted tip error over the volume for a noise of 1 um, mean_um
    seen      labels of the coefficients that it determines; unseen: those that no candidate can
    """

    plan: Measurement
    worst_um: float
    mean_um: float
    seen: tuple[str, ...]
    unseen: tuple[str, ...]


@dataclass(frozen=True)
class Pool:
    """Candidates as rows of a design.

    blocks   (n, r, p) the rows of each candidate over all that is determined, set-up included, for a noise of one
    targets  (t, p) the combinations whose variance matters
    """

    blocks: Array
    targets: Array


def plan(
    machine: Machine,
    kind: str,
    count: int,
    room: Room | None = None,
    effects: str | None = None,
    separate: Sequence[str] = (),
    existing: Measurement | None = None,
    seed: int = 0,
) -> Planned:
    """The poses, of many, that determine the errors best.

    separate  effects whose coefficients are to be told apart, instead of predictions everywhere
    existing  poses that are measured already: the new ones complete them

    Raises `UsageError` NCF635, NCF636.
    """
    room = Room() if room is None else room
    if count < 1:
        raise UsageError.of("NCF636", "a plan has at least one pose", hint="--count N")
    wanted = ",".join(separate) if separate and not machine.effects and effects is None else effects
    selection = select(machine, wanted)
    offered = candidates(machine, kind, max(CANDIDATES, 3 * count), room, seed)
    if count >= len(offered):
        text = f"{count} poses of {len(offered)} that can be reached"
        raise UsageError.of("NCF636", text, hint="a smaller --count, or wider ranges")
    fixed = 0 if existing is None else len(existing)
    every = offered if existing is None else joined(existing, offered)
    pool, kept = _pool(observe(every, machine), machine, selection, room, separate, seed)
    chosen = choose(pool, count, fixed)
    order = np.random.default_rng(seed).permutation(chosen)
    variance = variances(pool, [*range(fixed), *chosen])
    labels = selection.labels
    return Planned(
        every.rows(order),
        float(np.sqrt(variance.max())),
        float(np.sqrt(variance.mean())),
        tuple(labels[k] for k in kept),
        tuple(label for k, label in enumerate(labels) if k not in set(kept.tolist())),
    )


def joined(first: Measurement, last: Measurement) -> Measurement:
    """Two measurements of one kind as one; columns that either lacks are zero there."""
    if first.kind != last.kind:
        text = f"the poses measured already are of kind {first.kind}, not {last.kind}"
        raise UsageError.of("NCF636", text, hint=f"--kind {first.kind}")
    names = [name for name in dict.fromkeys([*first.columns, *last.columns]) if name not in _values(first)]
    columns = {name: np.concatenate([first.column(name), last.column(name)]) for name in names}
    labels = {}
    for name in dict.fromkeys([*first.labels, *last.labels]):
        filling = {"set": "1"}.get(name, "")
        own = [each.labels.get(name, (filling,) * len(each)) for each in (first, last)]
        labels[name] = (*own[0], *own[1])
    return Measurement(first.kind, first.headers, columns, labels)


def _values(measurement: Measurement) -> tuple[str, ...]:
    """Measured columns that a plan does without."""
    return () if measurement.kind == "probe" else measurement.measured


def _pool(
    seen: Observation, machine: Machine, selection: Selection, room: Room, separate: Sequence[str], seed: int
) -> tuple[Pool, Index]:
    """The candidates' rows over what can be determined at all, and which coefficients these are."""
    rows = len(seen.measurement) * len(seen.components)
    noise = np.where(np.tile(seen.angular, len(seen.measurement)), 1e-5, 1e-3)[:, None]
    design = seen.design(selection.estimated)[:rows] / noise
    design[:, np.abs(design).max(axis=0, initial=0.0) < 1e-6] = 0.0
    nuisance = seen.unknown_design(seen.unknowns.start)[:rows] / noise
    kept = solve(design, nuisance, np.zeros(rows)).kept
    whole = np.concatenate([design[:, kept], _full_rank(nuisance)], axis=1)
    scale = np.linalg.norm(whole, axis=0) / np.sqrt(len(seen.measurement))
    targets = _targets(machine, selection, kept, room, separate, seed)
    wide = np.zeros((len(targets), whole.shape[1]))
    wide[:, : len(kept)] = targets
    return Pool((whole / scale).reshape(len(seen.measurement), len(seen.components), -1), wide / scale), kept


def _full_rank(nuisance: Array) -> Array:
    """As many combinations of the set-up's columns as are independent."""
    size = np.linalg.norm(nuisance, axis=0)
    scaled: Array = nuisance[:, size > 0] / size[size > 0]
    if not scaled.shape[1]:
        return scaled
    _, values, right = np.linalg.svd(scaled, full_matrices=False)
    combined: Array = scaled @ right[values > NUISANCE_RANK * values[0]].T
    return combined


def _targets(
    machine: Machine, selection: Selection, kept: Index, room: Room, separate: Sequence[str], seed: int
) -> Array:
    """What is to be known well: the tip error over the volume, um, or the coefficients of some effects."""
    if separate:
        columns = [k for k, effect in enumerate(_owners(selection)) if effect.name in separate]
        chosen = np.flatnonzero(np.isin(kept, columns))
        lost = ", ".join(selection.labels[k] for k in columns if k not in kept)
        if lost or not columns:
            text = f"no pose of this kind tells {lost or separate} from what else is unknown"
            raise UsageError.of("NCF636", text, hint="another kind of measurement, or more tool lengths")
        return np.eye(len(kept))[chosen]
    places = candidates(machine, "tcp", PLACES, room, seed + 1)
    inputs = {name: np.zeros(PLACES) for name in machine.inputs}
    state = State(places.column("tool_length"), places.state(machine).direction, inputs)
    tip = machine.design(places.positions(machine), state, selection.estimated)[:, :3]
    scaled: Array = 1e3 * tip[:, :, kept].reshape(-1, len(kept))
    return scaled


def _owners(selection: Selection) -> list[Effect]:
    """The effect of each coefficient."""
    return [effect for effect in selection.estimated for _ in range(effect.basis.size)]


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


def _exchanged(pool: Pool, chosen: list[int], fixed: int) -> tuple[list[int], float]:
    """Replace one pose after another by the candidate that lowers the worst variance most; that variance."""
    worst = float(variances(pool, [*range(fixed), *chosen]).max())
    for _ in range(PASSES):
        before = worst
        for place in range(len(chosen)):
            others = [*range(fixed), *chosen[:place], *chosen[place + 1 :]]
            best, value = _best_addition(pool, others)
            if value < worst * (1 - EXCHANGED):
                chosen[place], worst = best, value
        if worst > before * (1 - EXCHANGED):
            break
    return chosen, worst


def _best_addition(pool: Pool, others: list[int]) -> tuple[int, float]:
    """The candidate that, added to the others, leaves the smallest worst variance, and that variance."""
    inverse = np.linalg.inv(information(pool, others))
    projected = pool.targets @ inverse
    present = np.einsum("tp,tp->t", projected, pool.targets)
    small = np.einsum("nip,pq,njq->nij", pool.blocks, inverse, pool.blocks, optimize=True)
    small += np.eye(pool.blocks.shape[1])
    cross = np.einsum("tp,nip->nti", projected, pool.blocks, optimize=True)
    gain = np.einsum("nti,nij,ntj->nt", cross, np.linalg.inv(small), cross, optimize=True)
    worst = (present - gain).max(axis=1)
    worst[others] = np.inf
    best = int(worst.argmin())
    return best, float(worst[best])


def information(pool: Pool, rows: Sequence[int]) -> Array:
    """The information of some blocks, with next to nothing added so that it has an inverse."""
    p = pool.blocks.shape[2]
    stacked = pool.blocks[list(rows)].reshape(-1, p)
    total: Array = stacked.T @ stacked + RIDGE * np.eye(p) * max(float((pool.blocks**2).mean()), 1e-300)
    return total


def variances(pool: Pool, rows: Sequence[int]) -> Array:
    """The variance of each target if these blocks are measured, (t,)."""
    inverse = np.linalg.inv(information(pool, rows))
    variance: Array = np.einsum("tp,pq,tq->t", pool.targets, inverse, pool.targets, optimize=True)
    return variance
