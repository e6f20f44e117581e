"""What to measure next, so that names which these data leave alike come apart (T-optimal, Atkinson and Fedorov 1975).

The rival is refitted to old and new rows together, and the poses are those where it still errs most: exchanged one at a
time, all in place from the start, since the first pose with a new stylus tells nothing by itself. Where the least of
all rivals still imitates the effect, no measurement of this kind tells them apart, and that is said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ncfix.diagnose.evidence import Court
from ncfix.diagnose.groups import Group
from ncfix.measure.candidates import Room, candidates
from ncfix.measure.kinds import STATES
from ncfix.measure.measurement import Array, Measurement
from ncfix.measure.observation import Observation
from ncfix.measure.observe import observe

COUNT = 12
OFFERED = 160
PASSES = 2
STARTS = 60
TRIED = 50
LONGER = 1.8
"""A second tool, where only one was used, is so much longer."""
TOLD = 6.0
"""Squared noise units from which on a rival is told apart."""
BETTER = 1.2
WEAK = 1e-6
"""Prior on what is free, so that unseen combinations do no harm."""


@dataclass(frozen=True, repr=False)
class Proposal:
    """Poses to be measured.

    plan     rows of kind tcp without values; None if no pose helps
    before   how well the worst rival can be told from the effect, squared noise units; after with the new poses
    reason   why the data so far do not tell them apart
    rivals   the names that are told apart
    """

    plan: Measurement | None
    before: float
    after: float
    reason: str
    rivals: tuple[str, ...]


@dataclass(frozen=True, repr=False)
class Contest:
    """One rival against the effect: information of the old rows, and the blocks of every pose on offer.

    matrix, vector, square  inner products of what may be refitted, of that with the signal, of the signal
    columns (n, r, k), signal (n, r)  of the poses on offer
    """

    matrix: Array
    vector: Array
    square: float
    columns: Array
    signal: Array

    def told(self, rows: Sequence[int]) -> float:
        """What of the signal the refitted rival cannot imitate with these poses too, squared noise units."""
        own = self.columns[list(rows)].reshape(-1, self.columns.shape[2])
        seen = self.signal[list(rows)].ravel()
        matrix, vector = self.matrix + own.T @ own, self.vector + own.T @ seen
        return self.square + float(seen @ seen) - float(vector @ np.linalg.solve(matrix, vector))


def propose(
    court: Court, chosen: Group, numbers: Array, rivals: Sequence[tuple[Group, float]], sigma: float
) -> Proposal:
    """The poses that tell `chosen`, with these numbers, from the rivals, each with its size in um."""
    offered = _offered(court)
    new = observe(offered, court.background.view.machine)
    contests = [_contest(court, new, chosen, numbers, rival, size, sigma) for rival, size in rivals]
    names = tuple(dict.fromkeys(rival.owner.name for rival, _ in rivals))
    every = list(range(len(offered)))
    useful = [each for each in contests if each.told(every) > TOLD]
    index, after = _exchanged(useful, len(offered)) if useful else (every, min(each.told(every) for each in contests))
    before = min(each.told([]) for each in useful or contests)
    plan = offered.rows(index) if useful and after > BETTER * before else None
    return Proposal(plan, before, after, _reason(court, chosen, [rival for rival, _ in rivals]), names)


def _offered(court: Court) -> Measurement:
    """Poses within what was measured, with the tools that there are and one more if there is one only."""
    view = court.background.view
    lengths = sorted(set(np.round(view.column("tool_length"), 4).tolist()))
    if len(lengths) == 1:
        lengths = [lengths[0], round(LONGER * lengths[0], 1) if lengths[0] > 0 else 100.0]
    room = Room(ranges=view.reach.spans, tool_lengths=lengths)
    plan = candidates(view.machine, "tcp", OFFERED, room)
    inputs = {name for each in view.measurements for name in each.columns if STATES.fullmatch(name)}
    held = {name: np.full(len(plan), view.column(name)[-1]) for name in inputs if name not in plan.columns}
    if "load_kg" in held:
        held["load_kg"] = np.full(len(plan), view.column("load_kg")[0])
    sets = tuple(f"tool {length:g}" for length in plan.column("tool_length"))
    return replace(plan, columns={**plan.columns, **held}, labels={"set": sets})


def _contest(
    court: Court, new: Observation, chosen: Group, numbers: Array, rival: Group, size: float, sigma: float
) -> Contest:
    """Columns: set-up of the old rows, of the new ones, constants of the machine, the rival in units of its size."""
    view = court.background.view
    constants = view.problem.design.shape[1]
    used = view.base.shape[1] - constants
    setup = 1e3 * new.unknown_design(new.unknowns.start)
    fresh, weight = setup.shape[1], 1 / (sigma * view.relative)
    old = np.concatenate(
        [view.base[:, :used], np.zeros((len(view.y), fresh)), view.base[:, used:], size * rival.columns], axis=1
    )
    shown = [1e3 * new.design(group.owner.effects) @ group.loading for group in (chosen, rival)]
    kinematic = 1e3 * new.design(view.problem.selection.estimated)
    rows = np.concatenate([np.zeros((len(setup), used)), setup, kinematic, size * shown[1]], axis=1)
    free = used + fresh + constants
    scale = np.ones(old.shape[1])
    scale[:free] = np.sqrt((old[:, :free] ** 2).mean(axis=0) + (rows[:, :free] ** 2).mean(axis=0))
    scale = np.where(scale > 0, scale, 1.0)
    prior = np.concatenate([np.full(free, WEAK), np.ones(old.shape[1] - free)])
    old, rows = old / scale * weight[:, None], rows / scale / sigma
    signal = (chosen.columns @ numbers) * weight
    count = len(new.measurement)
    return Contest(
        old.T @ old + np.diag(prior), old.T @ signal, float(signal @ signal),
        rows.reshape(count, -1, rows.shape[1]), (shown[0] @ numbers / sigma).reshape(count, -1),
    )  # fmt: skip


def _exchanged(contests: Sequence[Contest], count: int) -> tuple[list[int], float]:
    """Start with many random dozens, keep the best, and exchange one pose after another as long as that helps."""
    random = np.random.default_rng(0)

    def worst(rows: list[int]) -> float:
        return min(each.told(rows) for each in contests)

    starts = [random.permutation(count)[:COUNT].tolist() for _ in range(STARTS)]
    chosen = max(starts, key=worst)
    value = worst(chosen)
    for _ in range(PASSES):
        before = value
        for place in range(COUNT):
            for other in random.permutation(count)[:TRIED].tolist():
                if other in chosen:
                    continue
                tried = [*chosen[:place], other, *chosen[place + 1 :]]
                better = worst(tried)
                if better > value:
                    chosen, value = tried, better
        if value < 1.02 * before:
            break
    return chosen, value


def _reason(court: Court, chosen: Group, rivals: Sequence[Group]) -> str:
    """Why the data so far leave them alike."""
    view = court.background.view
    turning = {any(effect.rotational for effect in group.owner.effects[:1]) for group in (chosen, *rivals)}
    if len(set(np.round(view.column("tool_length"), 3).tolist())) == 1 and len(turning) == 2:
        return "one tool length: a shift and a tilt look alike where the lever is always the same"
    own = chosen.owner.axis
    if own and f"dir_{own}" not in view.reach.columns:
        return f"{own} came from one side only, so nothing shows what depends on its direction"
    return "at these poses they show nearly the same pattern"


def as_objects(plan: Measurement) -> list[dict[str, float]]:
    """The rows as objects: axis letters in mm and degree, direction of approach, tool length, load."""
    names = [name for name in plan.columns if not name.startswith("temp_") and name != "time_s"]
    return [{name: float(plan.columns[name][row]) for name in names} for row in range(len(plan))]
