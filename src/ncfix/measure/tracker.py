"""Kind `points`: targets on spindle head or table, read by an instrument that stands on the foundation (laser tracker).

A reading is x = Q (B p) + s, with p the position of the target on its body, B the actual pose of the body in the base
frame, and Q, s the rotation and position of the instrument. p, Q and s are unknown. Three or more targets show all six
errors of a body.

Positions of targets are those in the base frame with all axes at zero. For a target that the tool carries this is with
the tool of its first row; a longer tool moves it away from the spindle. A target on the spindle head does not move.

`register` finds Q, s and p for a perfect machine with the nominal poses of the body. For a given rotation, positions
and shifts follow from linear equations; Gauss-Newton steps then lead to the nearest rotation that explains the
readings. Since an instrument may stand in any orientation, the steps start from the 24 rotations that permute the
coordinate axes; every rotation is within 63 degrees of one of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from itertools import permutations, product

import numpy as np

from ncfix.arrays import Array, Ints, Mask
from ncfix.diagnostics import Message
from ncfix.machine import Effect, Machine, State, se3
from ncfix.measure.least_squares import gauss_newton
from ncfix.measure.measurement import Measurement, groups
from ncfix.measure.observation import (
    LEVER,
    TOOL,
    WORKPIECE,
    Observation,
    Unknowns,
    best_rotation,
    branch,
    vector_columns,
)
from ncfix.values import frozen

STEPS = 40
"""Largest number of Gauss-Newton steps from one start; a good start needs about ten."""
STRIDE = 0.5
"""Largest rotation of the instrument by one step, rad, since the equations are linear for small angles only."""
ENOUGH = 120
"""Number of readings of a set that are used to find its rotation."""
TOLD = 0.02
"""Smallest relative singular value at which linear equations determine the rotation."""
FOUND_SHARE = 3e-3
"""Residual, as a share of the scatter of the readings, at which the search for a rotation ends."""
ROUGHLY = 1e-3
"""Smallest relative decrease of the rms by a step during the search."""
CLEARLY = 0.5
"""A later start replaces an earlier one if its rms is below this share of the earlier rms."""
CHEAP = 1e5
"""Scale of a shift of the instrument relative to that of targets, if the readings do not determine which has moved."""
FIRM = 1e-2
"""Scale of a target with a stated position relative to that of other targets, likewise."""
OPEN = 1e-9
"""Relative singular value below which a combination is undetermined and left unchanged."""
READ = ("x", "y", "z")
STOOD = 0.02
"""Standard deviation of the rotation of the instrument against the base in simulations, rad."""


class Targets(Observation):
    """Observation of kind `points`: rows of target, x y z."""

    def __init__(self, measurement: Measurement, machine: Machine) -> None:
        super().__init__(measurement, machine)
        self.side = measurement.header("carried_by")
        self.body, self.axes = branch(machine, self.side)
        self.own = self.q[:, self.axes]
        direction = np.asarray(self.state.direction)[:, self.axes]
        self.lengths = measurement.column("tool_length")
        self.own_state = State(self.lengths, direction, {**self._other_axes(), **self.state.inputs})
        self.names, self.index = groups(measurement.labels["target"])
        self.first_tip = self.body.tool.tip(self.lengths[np.unique(self.index, return_index=True)[1]])
        self.poses = self._base_from_body(self.body.nominal(self.own, self.lengths))
        stated = self._stated()
        known = np.array([name in stated for name in self.names])
        self.sights = Sights(self.poses, self.index, self.set_index, known)
        self.instrument_from_base, self.places = self._first_guess(stated)

    def _other_axes(self) -> dict[str, Array]:
        """Positions of the axes of the other branch, mm or degree, as inputs of errors of this branch."""
        others = [k for k in range(len(self.machine.axes)) if k not in self.axes]
        return {self.machine.axes[k].name: self.q[:, k] / self.machine.axes[k].unit for k in others}

    @property
    def components(self) -> tuple[str, ...]:
        """See `Observation`: x y z of the instrument."""
        return READ

    @cached_property
    def unknowns(self) -> Unknowns:
        """Positions of the targets on their body; position and small rotation of the instrument per set."""
        return Unknowns.joined(
            [
                Unknowns.vectors("place of target ", self.names, self.places, spread=1.0),
                Unknowns.vectors(
                    "place of the instrument in set ", self.set_names, self.instrument_from_base[:, :3, 3], spread=50.0
                ),
                Unknowns.vectors("turn of the instrument in set ", self.set_names, spread=STOOD),
            ]
        )

    def predict(self, machine: Machine, unknowns: Array) -> Array:
        """See `Observation`."""
        places, shifts, turns = self._parts(unknowns)
        body, _ = branch(machine, self.side)
        poses = self._base_from_body(body.actual(self.own, self.own_state))
        turned = se3.rotation(turns) @ self.instrument_from_base[:, :3, :3]
        return replace(self.sights, poses=poses).seen(places, turned, shifts).ravel()

    def design(self, effects: Sequence[Effect]) -> Array:
        """See `Observation`; errors of the other branch have no effect."""
        joints = {axis.name for axis in self.body.axes} | (set() if self.side == WORKPIECE else {"S"})
        parts = [np.zeros((3 * len(self.measurement), 0))]
        for effect in effects:
            seen = effect.joint in joints
            size = effect.basis.size
            parts.append(self._columns(effect) if seen else np.zeros((3 * len(self.measurement), size)))
        return np.concatenate(parts, axis=1)

    def unknown_design(self, unknowns: Array) -> Array:
        """See `Observation`."""
        places, _, turns = self._parts(unknowns)
        return self.sights.design(places, se3.rotation(turns) @ self.instrument_from_base[:, :3, :3])

    def doubts(self, machine: Machine) -> Iterator[Message]:
        """See `Observation`: angles act by levers, which no reading shows where only linear axes move."""
        start, perfect = self.unknowns.start, machine.replace(effects=())

        def shown(unknowns: Array) -> Array:
            return self.predict(machine, unknowns) - self.predict(perfect, unknowns)

        changes = self.sights.left_open(self.places, self.instrument_from_base[:, :3, :3])
        levers = [shown(start + change) - shown(start) for change in changes]
        size = max((float(np.linalg.norm(each / self.sigma)) for each in levers), default=0.0)
        if size > 1:
            most = 1e3 * max(float(np.abs(each).max()) for each in levers)
            text = (
                f"the readings do not determine where the targets are on the body that carries them; if they are "
                f"{LEVER:g} mm elsewhere, the estimated angles move them by up to {most:.1f} um more or less"
            )
            yield Message(
                "NCF643",
                text,
                self.measurement.place(0),
                "give the position of one target in the header: `# target: NAME x y z`",
            )

    def _parts(self, unknowns: Array) -> tuple[Array, Array, Array]:
        t, s = len(self.names), len(self.set_names)
        parts = np.split(unknowns.reshape(-1, 3), [t, t + s])
        return parts[0], parts[1], parts[2]

    def _base_from_body(self, poses: Array) -> Array:
        """base_from_body (n, 4, 4) for nominal or actual poses (n, 4, 4) of the branch; identity at axis zero."""
        tips = self.first_tip[self.index] if self.side == TOOL else self.body.tool.tip(self.lengths)
        shifted: Array = poses @ se3.shift(-tips)
        return se3.inverse(shifted) if self.side == WORKPIECE else shifted

    def _columns(self, effect: Effect) -> Array:
        """Derivatives (m, k) of the readings by the coefficients of one effect, at the first guess of the set-up."""
        error = self.body.design(self.own, self.own_state, [effect])
        places = self.places[self.index]
        at = self.body.nominal(self.own, self.lengths)[:, :3, 3]
        if self.side == WORKPIECE:
            moved = error[:, :3] + np.einsum("nij,njk->nik", -se3.skew(places - at), error[:, 3:])
            base = -np.einsum("nij,njk->nik", self.poses[:, :3, :3], moved)
        else:
            points = np.einsum("nij,nj->ni", self.poses[:, :3, :3], places) + self.poses[:, :3, 3]
            base = error[:, :3] + np.einsum("nij,njk->nik", -se3.skew(points - at), error[:, 3:])
        seen = np.einsum("nij,njk->nik", self.instrument_from_base[self.set_index][:, :3, :3], base)
        return seen.reshape(-1, seen.shape[-1])

    def _stated(self) -> dict[str, list[float]]:
        """Approximate positions of targets, name -> x y z, mm, by the header."""
        lines = [text.split() for text in self.measurement.all_headers("target")]
        return {name: [float(each) for each in numbers] for name, *numbers in lines}

    def _first_guess(self, stated: dict[str, list[float]]) -> tuple[Array, Array]:
        """instrument_from_base per set (s, 4, 4) and target positions (t, 3), from header and `register`."""
        likely = self.first_tip if self.side == TOOL else np.zeros_like(self.first_tip)
        places = np.array([stated.get(name, place) for name, place in zip(self.names, likely.tolist(), strict=True)])
        if not all(name in self.measurement.columns for name in READ):
            return np.broadcast_to(np.eye(4), (len(self.set_names), 4, 4)).copy(), places
        along_base = self.measurement.header("frame") == "base"
        found = register(self.sights, self.measurement.stacked(*READ), places, along_base)
        return found.instrument_from_base, found.places


# -- registration ------------------------------------------------------------------------------------------------------


@frozen(slots=False)
class Sights:
    """The geometry of n readings.

    poses   (n, 4, 4) base_from_body
    target  (n,) index of the target; sets (n,): index of the set
    known   (t,) mask of the targets with a position in the header
    """

    poses: Array
    target: Ints
    sets: Ints
    known: Mask

    def base(self, places: Array) -> Array:
        """Position of the target of each reading in the base frame, (n, 3), for target positions (t, 3)."""
        turned: Array = np.einsum("nij,nj->ni", self.poses[:, :3, :3], places[self.target])
        return turned + self.poses[:, :3, 3]

    def seen(self, places: Array, turns: Array, shifts: Array) -> Array:
        """Readings (n, 3) of instruments with rotations `turns` (s, 3, 3) and shifts (s, 3)."""
        return np.einsum("nij,nj->ni", turns[self.sets], self.base(places)) + shifts[self.sets]

    def design(self, places: Array, turns: Array) -> Array:
        """Derivatives of the readings by positions, shifts and small further rotations, (3 n, 3 t + 6 s)."""
        n, t, s = len(self.poses), len(places), len(turns)
        turned = turns[self.sets]
        parts = [
            vector_columns(self.target, t, turned @ self.poses[:, :3, :3]),
            vector_columns(self.sets, s, np.broadcast_to(np.eye(3), (n, 3, 3))),
            vector_columns(self.sets, s, -se3.skew(np.einsum("nij,nj->ni", turned, self.base(places)))),
        ]
        return np.concatenate(parts, axis=2).reshape(3 * n, -1)

    def left_open(self, places: Array, turns: Array) -> Array:
        """Changes of positions, shifts and rotations that no reading shows, (k, 3 t + 6 s); known positions are fixed.

        Each is scaled so that the largest motion of a target is `LEVER`.
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
        return changes[moving] * (LEVER / most[moving])[:, None]

    def of_set(self, number: int) -> tuple[Sights, Ints]:
        """At most `ENOUGH` readings of one set, as the only set, and their indices."""
        rows = np.flatnonzero(self.sets == number)
        rows = rows[np.unique(np.linspace(0, len(rows) - 1, ENOUGH).astype(int))]
        return Sights(self.poses[rows], self.target[rows], np.zeros(len(rows), int), self.known), rows

    def step(self, places: Array, turns: Array, gap: Array, turning: bool = True) -> Array:
        """The least change of positions, shifts and, if `turning`, rotations that explains `gap` (n, 3) best."""
        scale = np.repeat([CHEAP, 1.0], 3 * len(turns))
        scale = np.concatenate([np.repeat(np.where(self.known, FIRM, 1.0), 3), scale])
        columns = len(scale) if turning else len(scale) - 3 * len(turns)
        design = self.design(places, turns)[:, :columns] * scale[:columns]
        return scale[:columns] * np.linalg.lstsq(design, gap.ravel(), rcond=OPEN)[0]


@frozen(slots=False)
class Registration:
    """Positions (t, 3) of the targets, rotations (s, 3, 3) and shifts (s, 3) of the instrument, and the rms, mm."""

    places: Array
    turns: Array
    shifts: Array
    rms: float

    @property
    def instrument_from_base(self) -> Array:
        """Pose of the base in the instrument's frame, per set, (s, 4, 4)."""
        return se3.rigid(self.turns, self.shifts)


def register(sights: Sights, readings: Array, places: Array, along_base: bool) -> Registration:
    """Registration of the instrument in each set and of the targets, for a perfect machine.

    readings    (n, 3) mm
    places      (t, 3) approximate target positions, mm; undetermined combinations keep these values
    along_base  the instrument's axes are nearly parallel to those of the base
    """
    arrays = sights.poses, sights.target, sights.sets, sights.known, readings, places
    return _registered(_Same(b"".join(each.tobytes() for each in arrays), sights, readings, places, along_base))


@frozen(eq=False, slots=False)
class _Same:
    """Cache key of `register`, compared by the bytes of its arrays: the same file is registered again and again."""

    numbers: bytes
    sights: Sights
    readings: Array
    places: Array
    along_base: bool

    def __eq__(self, other: object) -> bool:
        """Whether both have the same arguments."""
        return isinstance(other, _Same) and (self.numbers, self.along_base) == (other.numbers, other.along_base)

    def __hash__(self) -> int:
        """Hash of the bytes of the arrays."""
        return hash(self.numbers)


@lru_cache(maxsize=8)
def _registered(asked: _Same) -> Registration:
    sights, readings, places = asked.sights, asked.readings, asked.places
    count = int(sights.sets.max()) + 1
    if asked.along_base:
        return _fitted(sights, readings, places, np.stack([np.eye(3)] * count))
    turns = []
    for number in range(count):
        part, rows = sights.of_set(number)
        turns.append(_turn(part, readings[rows], places))
    return _refined(sights, readings, _fitted(sights, readings, places, np.concatenate(turns)))


def _turn(sights: Sights, readings: Array, places: Array) -> Array:
    """The rotation of the instrument in one set, (1, 3, 3), from the start with the smallest rms."""
    straight = _linear_turn(sights, readings)
    if straight is not None:
        found = _refined(sights, readings, _fitted(sights, readings, places, straight[None]), ROUGHLY)
        return found.turns
    best: Registration | None = None
    near = float(np.sqrt(np.mean((readings - readings.mean(axis=0)) ** 2))) * FOUND_SHARE
    for start in _starts(sights, readings, places):
        found = _refined(sights, readings, _fitted(sights, readings, places, start[None]), ROUGHLY)
        if best is None or found.rms < CLEARLY * best.rms:
            best = found
        if best.rms < near:
            break
    assert best is not None
    return best.turns


def _linear_turn(sights: Sights, readings: Array) -> Array | None:
    """The rotation (3, 3) by linear equations if the readings determine it; else None.

    The equations W x = R p + t + r, with W the inverse rotation, x a reading, p a target position and r a shift, are
    linear in all elements of W, p and r.
    """
    n, targets = len(readings), int(sights.target.max()) + 1
    middle, spread = readings.mean(axis=0), max(float(np.ptp(readings)), 1e-9)
    design = np.zeros((n, 3, 12 + 3 * targets))
    for k in range(3):
        design[:, k, 3 * k : 3 * k + 3] = (readings - middle) / spread
        design[:, k, 9 + k] = -1.0
    design[:, :, 12:] = -vector_columns(sights.target, targets, sights.poses[:, :3, :3])
    flat = design.reshape(3 * n, -1)
    values = np.linalg.svd(flat[:, :12] - _by(flat[:, 12:], flat[:, :12]), compute_uv=False)
    if len(values) < 12 or values[-1] < TOLD * np.sqrt(n):
        return None
    back = np.linalg.lstsq(flat, sights.poses[:, :3, 3].ravel(), rcond=None)[0][:9].reshape(3, 3)
    left, _, right = np.linalg.svd(back.T)
    return left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right


def _by(columns: Array, wanted: Array) -> Array:
    """The part of `wanted` (m, k) in the span of `columns`."""
    return columns @ np.linalg.lstsq(columns, wanted, rcond=None)[0]


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


def _fitted(sights: Sights, readings: Array, places: Array, turns: Array) -> Registration:
    """The registration with fitted positions and shifts for given rotations."""
    shifts = np.zeros((len(turns), 3))
    step = sights.step(places, turns, readings - sights.seen(places, turns, shifts), turning=False)
    places, shifts = places + step[: places.size].reshape(-1, 3), step[places.size :].reshape(-1, 3)
    gap = readings - sights.seen(places, turns, shifts)
    return Registration(places, turns, shifts, float(np.sqrt(np.mean(gap**2))))


def _refined(sights: Sights, readings: Array, start: Registration, less: float = 1e-6) -> Registration:
    """The registration improved by Gauss-Newton steps until the rms falls by less than the share `less`."""

    def step(at: Registration) -> tuple[Registration, float]:
        gap = readings - sights.seen(at.places, at.turns, at.shifts)
        change = sights.step(at.places, at.turns, gap)[at.places.size + at.shifts.size :].reshape(-1, 3)
        change *= min(1.0, STRIDE / max(float(np.abs(change).max()), 1e-300))
        moved = _fitted(sights, readings, at.places, se3.rotation(change) @ at.turns)
        return (at, 0.0) if moved.rms > at.rms * (1 - less) else (moved, np.inf)

    return gauss_newton(step, start, STEPS, 1.0)[0]
