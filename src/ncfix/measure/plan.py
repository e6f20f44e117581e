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
from ncfix.machine import Machine
from ncfix.machine.effects import library
from ncfix.measure.candidates import Room, candidates, has_r_test, r_test
from ncfix.measure.exchange import Pool, choose, information, variances
from ncfix.measure.measurement import Array, Index, Measurement
from ncfix.measure.observation import Observation
from ncfix.measure.observe import observe
from ncfix.measure.selection import Selection, form, select
from ncfix.measure.solve import NUISANCE_RANK, solve

CANDIDATES = 800
POOR = 10.0
"""um per um of noise from which on a plan says next to nothing of some combination of coefficients."""
SHARED = 0.3
"""Of the largest share in that combination: what has less is not named."""
PLACES = 1000
"""Poses at which the predictions are judged."""


@dataclass(frozen=True)
class Planned:
    """A plan and how good it is.

    plan      the poses, in an order in which none follows a pattern in time
    worst_um  the largest standard deviation of the predicted tip error over the volume for a noise of 1 um, mean_um
    seen      labels of the coefficients that it determines; unseen: those that no candidate can
    open      labels of those that make up what is known least, where that is POOR or worse
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
    _can_be_set(machine, selection, room, existing)
    many = max(CANDIDATES, 3 * count)
    ball = kind == "tcp" and has_r_test(machine)
    offered = r_test(machine, many, room, seed) if ball else candidates(machine, kind, many, room, seed)
    if count >= len(offered):
        text = f"{count} poses of {len(offered)} that can be reached"
        raise UsageError.of("NCF636", text, hint="a smaller --count, or wider ranges")
    fixed = 0 if existing is None else len(existing)
    every = offered if existing is None else joined(existing, offered)
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


def _least_known(pool: Pool, rows: Sequence[int], count: int) -> Index:
    """Which of the first `count` columns make up the combination that the worst predicted target suffers from."""
    inverse = np.linalg.inv(information(pool, rows))
    worst = pool.targets[variances(pool, rows).argmax()]
    variance, ways = np.linalg.eigh(inverse)
    combination = np.abs(ways[:count, int(((ways.T @ worst) ** 2 * variance).argmax())])
    return np.flatnonzero(combination > SHARED * combination.max())


def _can_be_set(machine: Machine, selection: Selection, room: Room, existing: Measurement | None) -> None:
    """Refuse effects of which a plan cannot know the state: those with a memory, and inputs that nobody sets."""
    late = [effect for effect in selection.estimated if effect.time_constant_s]
    if late:
        text = f"{late[0].name} follows {late[0].input} after a time: where to stand at which hour is not planned"
        hint = "leave it out of --effects; read the sensor over a warm-up and a cool-down instead"
        raise UsageError.of("NCF636", text, hint=hint)
    known = {*machine.axis_names, *room.inputs, "tool_length"}
    needed = [name for effect in selection.estimated for name in (effect.signal, effect.times) if name]
    unset = [name for name in dict.fromkeys(needed) if name not in known]
    if unset:
        text = f"what is sought depends on {', '.join(unset)}, and a plan cannot know what that will be"
        raise UsageError.of("NCF636", text, hint=f"--input {unset[0]}=LOW,HIGH if it can be set, or leave it out")
    missing = [] if existing is None else [name for name in room.inputs if name not in existing.columns]
    if missing:
        text = f"the poses measured already do not say {missing[0]}"
        raise UsageError.of("NCF636", text, hint=f"give them a column {missing[0]}")


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


def pool_of(
    seen: Observation, machine: Machine, selection: Selection, room: Room, separate: Sequence[str], seed: int
) -> tuple[Pool, Index]:
    """The candidates' rows over what can be determined at all, and which coefficients these are.

    In units of the noise: 1 um of a length, 10 urad of an angle.
    """
    rows = len(seen.measurement) * len(seen.components)
    noise = np.where(seen.turns, 1e-5, 1e-3)[:, None]
    design = seen.design(selection.estimated)[:rows] / noise
    design[:, np.abs(design).max(axis=0, initial=0.0) < 1e-6] = 0.0
    nuisance = seen.unknown_design(seen.unknowns.start)[:rows] / noise
    kept = solve(design, nuisance, np.zeros(rows)).kept
    if not len(kept):
        text = "no pose of this kind tells anything of what is sought from what else is unknown"
        raise UsageError.of("NCF636", text, hint="another --kind, other --effects, or wider ranges")
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
        columns = [k for name in separate for k in _columns(machine, selection, name)]
        chosen = np.flatnonzero(np.isin(kept, columns))
        lost = ", ".join(selection.labels[k] for k in columns if k not in kept)
        if lost or not columns:
            text = f"no pose of this kind tells {lost or separate} from what else is unknown"
            raise UsageError.of("NCF636", text, hint="another kind of measurement, or more tool lengths")
        return np.eye(len(kept))[chosen]
    places = candidates(machine, "tcp", PLACES, room, seed + 1)
    tip = machine.design(places.positions(machine), places.state(machine), selection.estimated)[:, :3]
    scaled: Array = 1e3 * tip[:, :, kept].reshape(-1, len(kept))
    return scaled


def _columns(machine: Machine, selection: Selection, name: str) -> list[int]:
    """The coefficients of an effect by its name: of a physical effect exactly those that it is made of."""
    physical = library(machine).get(name)
    forms = {form(effect) for effect in physical.effects} if physical else set()
    owners = [effect for effect in selection.estimated for _ in range(effect.basis.size)]
    found = [k for k, effect in enumerate(owners) if effect.name == name or form(effect) in forms]
    if not found:
        text = f"{name} is none of the effects that are estimated"
        raise UsageError.of("NCF636", text, hint="name it in --effects too")
    return found
