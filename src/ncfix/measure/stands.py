"""How an instrument stands and where its targets are, before any error is known: the first guess of kind `points`.

Every reading is x = Q (R p + t) + s: R and t the nominal pose of the body, p the target's place on it, Q and s how the
instrument stands. For a turn Q that is given, places and shifts follow from linear equations; from there Gauss-Newton
steps lead to the nearest turn that explains the readings. An instrument may stand any way round, so the steps start
from all 24 turns that take coordinate axes to coordinate axes; no turn is more than 63 degrees from all of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np

from ncfix.machine import se3
from ncfix.measure.geometry import best_rotation
from ncfix.measure.measurement import Array, Index
from ncfix.measure.observation import LEVER, Mask

STEPS = 40
"""Gauss-Newton steps from one start; a good one takes some ten."""
STRIDE = 0.5
"""rad: how far one step may turn an instrument, since the equations are linear for small turns only."""
ENOUGH = 400
"""Readings of a set that the search for its turn looks at."""
CLEARLY = 0.5
"""A later start replaces an earlier one if it leaves less than this of its rms."""
CHEAP = 1e5
"""A shift of the instrument is this much likelier than one of the targets, where the readings leave the choice."""
FIRM = 1e-2
"""A target whose place the header has moves this much less than one whose place nobody said, for the same reason."""
OPEN = 1e-9
"""Combinations that the readings show this much less than the best are left as they are."""


@dataclass(frozen=True)
class Sights:
    """What belongs to each of n readings: base_from_body (n, 4, 4), and the numbers of the target and of the set.

    known  (t,) of which targets the header says nearly where they are
    """

    poses: Array
    target: Index
    sets: Index
    known: Mask

    def base(self, places: Array) -> Array:
        """Where the targets are in the base frame, places (t, 3) -> (n, 3)."""
        turned: Array = np.einsum("nij,nj->ni", self.poses[:, :3, :3], places[self.target])
        return turned + self.poses[:, :3, 3]

    def seen(self, places: Array, turns: Array, shifts: Array) -> Array:
        """What instruments with these turns (s, 3, 3) and shifts (s, 3) read, (n, 3)."""
        found: Array = np.einsum("nij,nj->ni", turns[self.sets], self.base(places)) + shifts[self.sets]
        return found

    def design(self, places: Array, turns: Array) -> Array:
        """Derivatives of the readings by places, shifts and small further turns, (3 n, 3 t + 6 s)."""
        n, t, s = len(self.poses), len(places), len(turns)
        turned = turns[self.sets]
        arms = -se3.skew(np.einsum("nij,nj->ni", turned, self.base(places)))
        carried = turned @ self.poses[:, :3, :3]
        columns, each = np.zeros((n, 3, 3 * (t + 2 * s))), np.arange(n)
        for k in range(3):
            columns[each, :, 3 * self.target + k] = carried[:, :, k]
            columns[each, k, 3 * (t + self.sets) + k] = 1.0
            columns[each, :, 3 * (t + s + self.sets) + k] = arms[:, :, k]
        result: Array = columns.reshape(3 * n, -1)
        return result

    def left_open(self, places: Array, turns: Array) -> Array:
        """Changes of places, shifts and turns that no reading shows, places that are known apart: rows (k, 3 t + 6 s).

        In each of them the target that moves most moves by `LEVER`.
        """
        free = np.concatenate([np.repeat(~self.known, 3), np.ones(6 * len(turns), dtype=bool)])
        design = self.design(places, turns)[:, free]
        size = np.linalg.norm(design, axis=0)
        size[size == 0] = 1.0
        _, values, right = np.linalg.svd(design / size, full_matrices=False)
        changes = np.zeros(((values < OPEN * values[0]).sum(), len(free)))
        changes[:, free] = right[values < OPEN * values[0]] / size
        most = np.abs(changes[:, : places.size]).max(axis=1, initial=0.0)
        moving = most > OPEN * np.abs(changes).max(axis=1, initial=0.0)
        found: Array = changes[moving] * (LEVER / most[moving])[:, None]
        return found

    def of_set(self, number: int) -> tuple[Sights, Index]:
        """Some readings of one set, as if there were no other, and which these are."""
        rows = np.flatnonzero(self.sets == number)
        rows = rows[np.unique(np.linspace(0, len(rows) - 1, ENOUGH).astype(int))]
        return Sights(self.poses[rows], self.target[rows], np.zeros(len(rows), int), self.known), rows

    def step(self, places: Array, turns: Array, gap: Array, turning: bool = True) -> Array:
        """The least change of places, shifts and, if `turning`, turns that explains a gap (n, 3) in the readings."""
        scale = np.repeat([CHEAP, 1.0], 3 * len(turns))
        scale = np.concatenate([np.repeat(np.where(self.known, FIRM, 1.0), 3), scale])
        columns = len(scale) if turning else len(scale) - 3 * len(turns)
        design = self.design(places, turns)[:, :columns] * scale[:columns]
        change: Array = scale[:columns] * np.linalg.lstsq(design, gap.ravel(), rcond=OPEN)[0]
        return change


@dataclass(frozen=True)
class Standing:
    """Places (t, 3) of the targets, turns (s, 3, 3) and shifts (s, 3) of the instrument, and the rms they leave."""

    places: Array
    turns: Array
    shifts: Array
    rms: float

    @property
    def stands(self) -> Array:
        """instrument_from_base per set, (s, 4, 4)."""
        return se3.rigid(self.turns, self.shifts)


def first_guess(sights: Sights, readings: Array, places: Array, along_base: bool) -> Standing:
    """The stand of the instrument per set and the places of the targets, from the motions of a perfect machine.

    `places` (t, 3) is where the targets are nearly, mm, of those that are known; what the readings leave open stays as
    it is there. `along_base`: the instrument's axes are nearly those of the base.
    """
    numbers = range(int(sights.sets.max()) + 1)
    if along_base:
        return _fitted(sights, readings, places, np.stack([np.eye(3) for _ in numbers]))
    turns = np.concatenate([_turn(*_some(sights, readings, k), places) for k in numbers])
    return _settled(sights, readings, _fitted(sights, readings, places, turns))


def _some(sights: Sights, readings: Array, number: int) -> tuple[Sights, Array]:
    part, rows = sights.of_set(number)
    return part, readings[rows]


def _turn(sights: Sights, readings: Array, places: Array) -> Array:
    """The turn of the instrument in one set, (1, 3, 3): of all starts the one that leads nearest to the readings."""
    best: Standing | None = None
    for start in _starts(sights, readings, places):
        found = _settled(sights, readings, _fitted(sights, readings, places, start[None]))
        if best is None or found.rms < CLEARLY * best.rms:
            best = found
    assert best is not None
    return best.turns


def _starts(sights: Sights, readings: Array, places: Array) -> Iterator[Array]:
    rows = sights.known[sights.target]
    if rows.any():
        base = sights.base(places)[rows]
        yield best_rotation(readings[rows] - readings[rows].mean(0), base - base.mean(0))
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            turn = np.eye(3)[list(order)] * np.array(signs)
            if np.linalg.det(turn) > 0:
                yield turn


def _fitted(sights: Sights, readings: Array, places: Array, turns: Array) -> Standing:
    """Places and shifts for turns that are given."""
    shifts = np.zeros((len(turns), 3))
    step = sights.step(places, turns, readings - sights.seen(places, turns, shifts), turning=False)
    return _standing(sights, readings, places + step[: places.size].reshape(-1, 3), turns, step[places.size :])


def _settled(sights: Sights, readings: Array, standing: Standing) -> Standing:
    """The nearest standing whose rms no small change makes less."""
    for _ in range(STEPS):
        gap = readings - sights.seen(standing.places, standing.turns, standing.shifts)
        step = sights.step(standing.places, standing.turns, gap)
        change = step[standing.places.size + standing.shifts.size :].reshape(-1, 3)
        change *= min(1.0, STRIDE / max(float(np.abs(change).max()), 1e-300))
        moved = _fitted(sights, readings, standing.places, se3.rotation(change) @ standing.turns)
        if moved.rms > standing.rms * (1 - 1e-6):
            return standing
        standing = moved
    return standing


def _standing(sights: Sights, readings: Array, places: Array, turns: Array, shifts: Array) -> Standing:
    shifts = shifts.reshape(-1, 3)
    gap = readings - sights.seen(places, turns, shifts)
    return Standing(places, turns, shifts, float(np.sqrt(np.mean(gap**2))))
