"""Measurement plans: the poses that determine the errors best (Soons, section 3.3; exchange algorithm of Fedorov).

From many candidates a first choice maximises the determinant of the information (D-optimal). Poses are then exchanged
one at a time as long as the largest prediction variance over the working volume falls (G-optimal). Coefficients that no
candidate determines are left out first. To separate two effects, the variances of their coefficients replace the
prediction variances.

`skeleton` writes the skeleton of an NC program that moves to the poses. Probing itself is a cycle of the control.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ncfix.arguments import POSES, SEED
from ncfix.arrays import Array, Ints
from ncfix.diagnostics import UsageError
from ncfix.machine import Machine
from ncfix.machine.effects import library
from ncfix.measure.candidates import APPROACH, Room, candidates, offered
from ncfix.measure.instruments import observe
from ncfix.measure.least_squares import NUISANCE_RANK, solve
from ncfix.measure.measurement import Measurement, number
from ncfix.measure.observation import Observation
from ncfix.measure.selection import Selection, form, select
from ncfix.values import frozen

CANDIDATES = 800
"""Smallest number of candidate poses."""
POOR = 10.0
"""Largest standard deviation of a prediction, um per um of noise, from which a plan hardly determines a combination."""
SHARED = 0.3
"""Smallest share of a coefficient in that combination, relative to the largest, from which it is named."""
PLACES = 1000
"""Number of poses at which predictions are evaluated."""
ACTIVE = 250
"""Number of predictions, the worst ones, that an exchange considers; all are checked after each pass."""
RIDGE = 1e-9
"""Information added on the diagonal, relative to that of a candidate, to keep the matrix regular."""
PASSES = 8
"""Largest number of passes of the exchange."""
FIRST, CHUNK = 32, 32
"""Number of worst targets that bound the effect of an addition; number of candidates then evaluated at once."""
STARTS, SMALL = 20, 20_000
"""Number of random starts besides the first choice, if candidates times predictions are fewer than `SMALL`."""
ALONE = 1e-5
"""Smallest eigenvalue of a pose's remaining share at which it is removed by an update, not by a new inversion."""
RIDDEN = 1e-2
"""Largest share of the ridge in the least determined combination at which updates are accurate enough."""
EXCHANGED = 1e-3
"""Smallest relative gain of an exchange."""
WORTHWHILE = 5e-3
"""Smallest relative gain of a pass; one that gains less is the last."""
READ = dict(zip("XYZ", ("mx", "my", "mz"), strict=True))


@frozen(eq=False, slots=False)
class Planned:
    """A plan and its quality.

    plan      the poses in random order, so that no error is confounded with time
    worst_um  largest standard deviation of the predicted tip error over the volume, um, for a noise of 1 um
    mean_um   root mean square of that standard deviation, um
    seen      labels of the coefficients that the plan determines; unseen: of those that no candidate determines
    open      labels of the coefficients in the least determined combination, if that is `POOR` or worse
    """

    plan: Measurement
    worst_um: float
    mean_um: float
    seen: tuple[str, ...]
    unseen: tuple[str, ...]
    open: tuple[str, ...] = ()


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
    """The `count` poses, among many candidates, that determine the errors best.

    separate  names of effects to be told apart; then the variances of their coefficients count, not predictions
    existing  poses already measured, which the new ones complete

    Raises `UsageError` NCF025, NCF635, NCF636.
    """
    room = Room() if room is None else room
    room.check(machine)
    SEED.check("seed", seed)
    if not POSES.has(count):
        raise UsageError.of("NCF636", "a plan has at least one pose", hint="--count N")
    wanted = ",".join(separate) if separate and not machine.effects and effects is None else effects
    selection = select(machine, wanted)
    _can_be_set(machine, selection, room, existing)
    many = max(CANDIDATES, 3 * count)
    poses = offered(machine, kind, many, room, seed)
    if count >= len(poses):
        text = f"{count} poses are asked for, but only {len(poses)} can be reached"
        raise UsageError.of("NCF636", text, hint="give a smaller --count, or wider ranges")
    fixed = 0 if existing is None else len(existing)
    every = poses if existing is None else appended(existing, poses)
    pool, kept = pool_of(observe(every, machine), machine, selection, room, separate, seed)
    chosen = choose(pool, count, fixed)
    order = np.random.default_rng(seed).permutation(chosen)
    variance = variances(pool, [*range(fixed), *chosen])
    labels = selection.labels
    poor = not separate and np.sqrt(variance.max()) >= POOR
    return Planned(
        every.rows(order),
        float(np.sqrt(variance.max())),
        float(np.sqrt(variance.mean())),
        tuple(labels[k] for k in kept),
        tuple(label for k, label in enumerate(labels) if k not in set(kept.tolist())),
        tuple(labels[kept[k]] for k in _least_known(pool, [*range(fixed), *chosen], len(kept))) if poor else (),
    )


def _least_known(pool: Pool, rows: Sequence[int], count: int) -> Ints:
    """Indices, among the first `count` columns, of the combination that contributes most to the largest variance."""
    inverse = np.linalg.inv(information(pool, rows))
    worst = pool.targets[variances(pool, rows).argmax()]
    variance, ways = np.linalg.eigh(inverse)
    combination = np.abs(ways[:count, int(((ways.T @ worst) ** 2 * variance).argmax())])
    return np.flatnonzero(combination > SHARED * combination.max())


def _can_be_set(machine: Machine, selection: Selection, room: Room, existing: Measurement | None) -> None:
    """Refuse effects that depend on a state which a plan cannot set: NCF636 for time lags and unknown inputs."""
    late = [effect for effect in selection.estimated if effect.time_constant_s]
    if late:
        text = f"{late[0].name} follows {late[0].input} with a time constant; measurements over time cannot be planned"
        hint = "leave it out of --effects; measure it over a warm-up and a cool-down instead"
        raise UsageError.of("NCF636", text, hint=hint)
    known = {*machine.axis_names, *room.inputs, "tool_length"}
    needed = [name for effect in selection.estimated for name in (effect.signal, effect.times) if name]
    unset = [name for name in dict.fromkeys(needed) if name not in known]
    if unset:
        text = f"the effects depend on {', '.join(unset)}, whose values during the measurement are not known"
        raise UsageError.of(
            "NCF636", text, hint=f"give --input {unset[0]}=LOW,HIGH if it can be set, or leave the effect out"
        )
    missing = [] if existing is None else [name for name in room.inputs if name not in existing.columns]
    if missing:
        text = f"the existing measurement has no column {missing[0]}"
        raise UsageError.of("NCF636", text, hint=f"add a column {missing[0]} to it")


def appended(first: Measurement, last: Measurement) -> Measurement:
    """Two measurements of one kind joined; a missing column is filled with zeros."""
    if first.kind != last.kind:
        text = f"the existing measurement is of kind {first.kind}, not {last.kind}"
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
    """Measured columns that are not part of a plan."""
    return () if measurement.kind == "probe" else measurement.measured


def pool_of(
    seen: Observation, machine: Machine, selection: Selection, room: Room, separate: Sequence[str], seed: int
) -> tuple[Pool, Ints]:
    """The pool of candidates over the determinable coefficients, and the indices of these.

    In units of the noise: 1 um of a length, 10 urad of an angle.
    """
    rows = len(seen.measurement) * len(seen.components)
    noise = np.where(seen.turns, 1e-5, 1e-3)[:, None]
    design = seen.design(selection.estimated)[:rows] / noise
    design[:, np.abs(design).max(axis=0, initial=0.0) < 1e-6] = 0.0
    nuisance = seen.unknown_design(seen.unknowns.start)[:rows] / noise
    kept = solve(design, nuisance, np.zeros(rows)).kept
    if not len(kept):
        text = "no pose of this kind distinguishes any of the effects from the other unknowns"
        raise UsageError.of("NCF636", text, hint="give another --kind, other --effects, or wider ranges")
    whole = np.concatenate([design[:, kept], _full_rank(nuisance)], axis=1)
    scale = np.linalg.norm(whole, axis=0) / np.sqrt(len(seen.measurement))
    targets = _targets(machine, selection, kept, room, separate, seed)
    wide = np.zeros((len(targets), whole.shape[1]))
    wide[:, : len(kept)] = targets
    return Pool((whole / scale).reshape(len(seen.measurement), len(seen.components), -1), wide / scale), kept


def _full_rank(nuisance: Array) -> Array:
    """Independent combinations of the columns of the set-up, (m, rank)."""
    size = np.linalg.norm(nuisance, axis=0)
    scaled: Array = nuisance[:, size > 0] / size[size > 0]
    if not scaled.shape[1]:
        return scaled
    _, values, right = np.linalg.svd(scaled, full_matrices=False)
    return scaled @ right[values > NUISANCE_RANK * values[0]].T


def _targets(
    machine: Machine, selection: Selection, kept: Ints, room: Room, separate: Sequence[str], seed: int
) -> Array:
    """The combinations (t, p) to be determined well: the tip error over the volume, um, or some coefficients."""
    if separate:
        columns = [k for name in separate for k in _columns(machine, selection, name)]
        chosen = np.flatnonzero(np.isin(kept, columns))
        lost = ", ".join(selection.labels[k] for k in columns if k not in kept)
        if lost or not columns:
            text = f"no pose of this kind distinguishes {lost or separate} from the other unknowns"
            raise UsageError.of("NCF636", text, hint="use another kind of measurement, or more tool lengths")
        return np.eye(len(kept))[chosen]
    places = candidates(machine, "tcp", PLACES, room, seed + 1)
    tip = machine.design(places.positions(machine), places.state(machine), selection.estimated)[:, :3]
    return 1e3 * tip[:, :, kept].reshape(-1, len(kept))


def _columns(machine: Machine, selection: Selection, name: str) -> list[int]:
    """Indices of the coefficients of an effect; `name` is an ISO 230-1 name or that of a physical effect."""
    physical = library(machine).get(name)
    forms = {form(effect) for effect in physical.effects} if physical else set()
    owners = [effect for effect in selection.estimated for _ in range(effect.basis.size)]
    found = [k for k, effect in enumerate(owners) if effect.name == name or form(effect) in forms]
    if not found:
        text = f"{name} is not among the effects that are estimated"
        raise UsageError.of("NCF636", text, hint="also name it in --effects")
    return found


# -- exchange ----------------------------------------------------------------------------------------------------------


@frozen(slots=False)
class Pool:
    """Candidates as rows of a design.

    blocks   (n, r, p) r rows of each candidate over p determinable parameters, set-up included, for a noise of one
    targets  (t, p) combinations whose variance is minimised
    """

    blocks: Array
    targets: Array

    @cached_property
    def power(self) -> float:
        """Mean square of the elements of `blocks`, the scale of the ridge."""
        return max(float((self.blocks**2).mean()), 1e-300)


def choose(pool: Pool, count: int, fixed: int = 0) -> Ints:
    """Indices of `count` candidates to measure; the first `fixed` blocks are measured already."""
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
    """Improve a set of poses by exchanges until the largest variance no longer falls; the set and that variance."""
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
    """One pass of exchanges over all poses."""
    chosen = list(start)
    worst = float(variances(pool, [*range(fixed), *chosen]).max())
    measured = Measured.of(pool, [*range(fixed), *chosen])
    for place in range(len(chosen)):
        others = [*range(fixed), *chosen[:place], *chosen[place + 1 :]]
        better, value = best_addition(pool, others, measured.without(pool, chosen[place]))
        if value < worst * (1 - EXCHANGED):
            chosen[place], worst = better, value
            measured = Measured.of(pool, [*range(fixed), *chosen])
    return chosen


@frozen(slots=False)
class Measured:
    """Products with the inverse of the information M of some measured blocks.

    inverse  (p, p) M^-1
    spread   (n, r, p) B M^-1 for the rows B of every candidate
    own      (n, r, r) B M^-1 B' for every candidate
    """

    inverse: Array
    spread: Array
    own: Array

    @classmethod
    def of(cls, pool: Pool, rows: Sequence[int]) -> Measured:
        """The products for the blocks with indices `rows`."""
        n, r, p = pool.blocks.shape
        inverse = np.asarray(np.linalg.inv(information(pool, rows)), dtype=np.float64)
        spread = (pool.blocks.reshape(n * r, p) @ inverse).reshape(n, r, p)
        return cls(inverse, spread, spread @ np.swapaxes(pool.blocks, 1, 2))

    def without(self, pool: Pool, row: int) -> Measured | None:
        """The products without one of the blocks, by the Woodbury formula; None if that would be inaccurate.

        It is inaccurate if the other blocks hardly determine what this one does. `spread` is not updated.
        """
        block = pool.blocks[row]
        rest = np.eye(len(block)) - self.own[row]
        if np.trace(self.inverse) * RIDGE * pool.power > RIDDEN or np.linalg.eigvalsh(rest)[0] < ALONE:
            return None
        n, r, p = self.spread.shape
        cross = (self.spread.reshape(n * r, p) @ block.T).reshape(n, r, -1)
        inner = np.linalg.inv(rest)
        lost = self.spread[row].T
        inverse: Array = self.inverse + lost @ inner @ lost.T
        return Measured(inverse, self.spread, self.own + (cross @ inner) @ np.swapaxes(cross, 1, 2))


def best_addition(pool: Pool, others: list[int], measured: Measured | None = None) -> tuple[int, float]:
    """The candidate that, added to the others, gives the smallest maximum of the variances; and that maximum.

    measured  products for the others, if they are known

    With the rows B of a candidate and the information M without it, the variance of a target t falls by
    |L^-1 B M^-1 t|^2, where L L' = 1 + B M^-1 B'. The maximum over the `FIRST` worst targets is a lower bound of that
    over all targets; the latter is computed, `CHUNK` candidates at a time, only for candidates that may be best.
    """
    measured = measured or Measured.of(pool, others)
    projected = measured.inverse @ pool.targets.T
    present = np.einsum("tp,pt->t", pool.targets, projected)
    order = np.argsort(-present, kind="stable")
    first, rest = order[:FIRST], order[FIRST:]
    white = _whitening(measured.own)
    bound = _left(pool.blocks, white, projected[:, first], present[first])
    bound[others] = np.inf
    best, worst = int(bound.argmin()), np.inf
    likely = np.argsort(bound, kind="stable")
    for start in range(0, len(likely), CHUNK):
        chunk = likely[start : start + CHUNK]
        if bound[chunk[0]] >= worst:
            break
        left = bound[chunk]
        if len(rest):
            left = np.maximum(left, _left(pool.blocks[chunk], white[chunk], projected[:, rest], present[rest]))
        if left.min() < worst:
            best, worst = int(chunk[left.argmin()]), float(left.min())
    return best, worst


def _left(blocks: Array, white: Array, projected: Array, present: Array) -> Array:
    """For each added block (n, r, p), the largest remaining variance of some targets, (n,).

    white (n, r, r) L^-1; projected (p, t) M^-1 t; present (t,) variances without the block
    """
    n, r, p = blocks.shape
    cross = white @ (blocks.reshape(n * r, p) @ projected).reshape(n, r, -1)
    gain = np.square(cross, out=cross).sum(axis=1)
    return (present - gain).max(axis=1)


def _whitening(small: Array) -> Array:
    """W (n, r, r) with W (1 + `small`) W' = 1; eigenvalues that rounding made negative count as zero."""
    try:
        result: Array = np.linalg.inv(np.linalg.cholesky(np.eye(small.shape[1]) + small))
    except np.linalg.LinAlgError:
        values, ways = np.linalg.eigh(small)
        result = np.swapaxes(ways, 1, 2) / np.sqrt(1 + np.maximum(values, 0.0))[:, :, None]
    return result


def information(pool: Pool, rows: Sequence[int]) -> Array:
    """The information matrix (p, p) of the blocks `rows`, with a small ridge that makes it regular."""
    p = pool.blocks.shape[2]
    stacked = pool.blocks[list(rows)].reshape(-1, p)
    return stacked.T @ stacked + RIDGE * np.eye(p) * pool.power


def variances(pool: Pool, rows: Sequence[int]) -> Array:
    """The variance of each target if these blocks are measured, (t,)."""
    inverse = np.linalg.inv(information(pool, rows))
    return np.einsum("tp,pq,tq->t", pool.targets, inverse, pool.targets, optimize=True)


# -- program -----------------------------------------------------------------------------------------------------------


def skeleton(plan: Measurement, machine: Machine) -> str:
    """G-code in machine coordinates with one stop per pose; each axis approaches from the side that the plan states."""
    lines = [
        "%",
        f"(MEASUREMENT PLAN, KIND {plan.kind.upper()}, {len(plan)} POSES)",
        "(A SKELETON: CHECK FOR COLLISIONS, ADD SAFE HEIGHTS AND THE PROBING CYCLE)",
        *(f"({text.upper()})" for key, text in plan.headers if key == "note"),
        "G21 G90 G94",
    ]
    for row in range(len(plan)):
        lines += _stop(plan, machine, row)
    return "\n".join([*lines, "M30", "%", ""])


def _stop(plan: Measurement, machine: Machine, row: int) -> list[str]:
    """The blocks that approach one pose and stop there."""
    words, back = [], []
    for axis in machine.axes:
        column = READ[axis.name] if axis.name in READ and READ[axis.name] in plan.columns else axis.name
        value = float(plan.column(column)[row])
        side = float(np.sign(plan.column(f"dir_{axis.name}")[row]))
        step = APPROACH["rotary" if axis.rotary else "linear"]
        words.append(f"{axis.name}{number(value)}")
        back.append(f"{axis.name}{number(value - side * step)}")
    what = " ".join(f"{name.upper()} {values[row]}" for name, values in plan.labels.items())
    tool = f" TOOL LENGTH {number(float(plan.columns['tool_length'][row]))}" if "tool_length" in plan.columns else ""
    head = [f"N{10 * (row + 1)} (POSE {row + 1} {what}{tool})"]
    if back != words:
        head.append(f"G53 G0 {' '.join(back)}")
    return [*head, f"G53 G0 {' '.join(words)}", "G4 P2", "(PROBE HERE)", "M0"]
