"""The automatic scheme: which one-input tables, sums and products of pairs a machine's correction takes.

Any chain, any errors: the exact correction is taken apart on a grid (`separable`), the parts that matter are kept
(`scheme_parts`) and put into as few tables as possible (`scheme_layout`), whose functions are then followed along every
axis (`scheme_curves`). Rotary axes come first; the linear axes then correct what is left where that leads, so that the
tip is right whatever the rotary tables miss. What changes with the way an axis moves becomes tables for one way each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ncfix.machine import Machine, State
from ncfix.tables.exact import exact_correction, linear_axes
from ncfix.tables.grid import Array
from ncfix.tables.minimax import Remainder, least_worst
from ncfix.tables.neutral import Compensation
from ncfix.tables.scheme_curves import Evaluate, Sample, followed
from ncfix.tables.scheme_layout import Layout, absorbed
from ncfix.tables.scheme_nodes import Line
from ncfix.tables.scheme_parts import Face, Selection, needed
from ncfix.tables.scheme_rotary import rotary_correction
from ncfix.tables.scheme_tables import Corrections, Stage, by_way
from ncfix.tables.separable import Parts, taken_apart, taken_apart_along

NODES = 8
"""Positions of each axis at which the correction is taken apart; fewer if there are more than five axes."""
PROVEN = 10
"""Positions of each axis for the bound that is said: more of them prove more."""
FULL = 5
"""With more axes than these there are fewer positions of each."""
LEVER = 200.0
"""mm: an angle of a rotary axis is judged by what it does to the tip at that distance."""
ROTARY_SHARE = 8
"""Rotary axes get one table in so many at most, if tables are few: they do little for the tip."""
FEWER = (1, 3, 5, 8, 12, 16)
"""Tables that rotary axes are tried with: what follows other axes in them may leave more that takes three at once."""
ALIKE = 1.02
"""Bounds that differ by less are the same: then more tables for the rotary axes are better."""
SMALL = 0.1
"""Parts that are below this share of the target (rms) together are left out."""
AGAINST_REST = 0.15
"""So are parts that are below this share of what cannot be said anyway."""
MERGED = 0.25
"""Share of what may be left out that may be lost each time by writing a function as a multiple of others."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What a control can hold.

    own_free  sums of an axis over itself go into tables of another kind
    beside    tables more that it takes for each table that multiplies others, and for each that is multiplied
    """

    tables: int
    points: int
    own_free: bool = False
    beside: tuple[int, int] = (0, 0)


@dataclass(frozen=True, slots=True)
class Scheme:
    """Tables with one input each, sums and pairs; the second factor of a pair has no unit and is at most 1.

    What they leave at the tip:

    missed   the largest displacement that the tables lack at random poses, mm
    rest     rms of what sums and products of pairs cannot say, mm
    bound    what no sums and products of pairs could leave less than at the worst, mm
    dropped  rms of what was left out because it is small or for want of tables, mm
    """

    tables: Compensation
    missed: float
    rest: float
    dropped: float
    bound: float = 0.0


@dataclass(frozen=True, slots=True)
class Job:
    """A machine, where its tables are to hold, for which tool, how well (mm), and in which limits."""

    machine: Machine
    space: Array
    tool_length: float
    target: float
    limits: Limits


def automatic(job: Job, rotary: bool = True) -> Scheme:
    """The tables of a machine; `rotary`: correct the rotary axes, too, as far as they can put the orientation right."""
    columns = np.flatnonzero(job.machine.rotary).tolist() if rotary else []
    most = job.limits.tables
    done = Scheme(Compensation(()), 0.0, 0.0, 0.0)
    if columns:
        done, used = _rotary(job, columns)
        most -= used
    moved, _ = _staged(job, linear_axes(job.machine), moving(job, done.tables), 1.0, most)
    tables = Compensation((*done.tables.terms, *moved.tables.terms))
    bound = moved.bound
    if bound > SMALL * job.target:
        bound = max(bound, _bound(job, done, PROVEN))
    return Scheme(tables, moved.missed, moved.rest, moved.dropped, bound)


def _rotary(job: Job, columns: Sequence[int]) -> tuple[Scheme, int]:
    """The tables of the rotary axes, as many as leave the linear axes with least that no pair can say."""
    allowed = max(1, job.limits.tables // ROTARY_SHARE)
    tried: list[tuple[float, Scheme, int]] = []
    for most in sorted({min(each, allowed) for each in (*FEWER, allowed)}):
        done, used = _staged(job, columns, turning(job), LEVER, most)
        tried.append((max(_bound(job, done), SMALL * job.target), done, used))
        if used < most and [each[-1] for each in tried[-2:]] == [used, used]:
            break
    least = min(bound for bound, _, _ in tried)
    _, done, used = [each for each in tried if each[0] <= ALIKE * least][-1]
    return done, used


def _bound(job: Job, done: Scheme, count: int = NODES) -> float:
    """How little the linear axes can leave at the worst where the rotary axes are corrected so, mm."""
    turns = [line.modulo for line in lines_of(job)]
    nodes = coarse_nodes(job.space, turns, count)
    values = _values(nodes, by_way(moving(job, done.tables)), None)
    return least_worst(nodes, turns, values, SMALL * job.target).bound


def _values(nodes: Sequence[Array], evaluate: Evaluate, way: int | None) -> Array:
    """Corrections on a full grid, (*counts, n_outputs)."""
    q = np.stack(np.meshgrid(*nodes, indexing="ij"), axis=-1).reshape(-1, len(nodes))
    return evaluate(q, way).reshape(*map(len, nodes), -1)


def turning(job: Job) -> Corrections:
    """Corrections of the rotary axes, rad."""
    return lambda q, direction: rotary_correction(job.machine, q, State(job.tool_length, direction))


def moving(job: Job, done: Compensation) -> Corrections:
    """Corrections of the linear axes where the tables of the rotary axes have been at work, mm."""
    columns = linear_axes(job.machine)

    def corrections(q: Array, direction: Array) -> Array:
        ways = np.broadcast_to(direction, q.shape)
        turned = done.at(job.machine.axis_names, q, ways) * job.machine.rotary
        return exact_correction(job.machine, q, State(job.tool_length, ways), turned)[:, columns]

    return corrections


def _staged(job: Job, outputs: Sequence[int], correct: Corrections, scale: float, most: int) -> tuple[Scheme, int]:
    """The tables of some axes, and how many of the `most` they take."""
    lines = lines_of(job)
    nodes = coarse_nodes(job.space, [line.modulo for line in lines])
    selection, left = _parts(job, outputs, correct, scale, nodes)
    selection.drop_small(selection.tolerance / MERGED)
    allowed, used = most, most + 1
    while used > most:
        selection.fit_into(allowed)
        layouts = _followed(selection, left, lines, correct, scale)
        used = sum(needed(output, each, selection.free, selection.beside) for output, each in layouts.items())
        allowed -= used - most
    unscaled = {output: [one.scaled(1 / scale) for one in each] for output, each in layouts.items()}
    stage = Stage(lines, unscaled, correct, scale)
    tables, missed = stage.settled(max(job.target, AGAINST_REST * left.rms), job.limits.points, left.largest)
    return Scheme(tables, missed, left.rms, selection.lost, left.bound), used


def _followed(
    selection: Selection, left: Remainder, lines: Sequence[Line], correct: Corrections, scale: float
) -> dict[int, list[Layout]]:
    """The layouts with their functions over all positions of the axes; what they need may show there only."""
    known = {output: selection.layouts(output) for output in selection.outputs}
    fine = [line.fine for line in lines]
    evaluate = by_way(lambda q, direction: scale * correct(q, direction))
    found = followed(Sample.of(left.nodes), known, fine, evaluate, left.along)
    return {output: [absorbed(one, selection.tolerance) for one in each] for output, each in found.items()}


def _parts(
    job: Job, outputs: Sequence[int], correct: Corrections, scale: float, nodes: Sequence[Array]
) -> tuple[Selection, Remainder]:
    """The corrections of some axes, taken apart, and what no pair can say of them, left where it hurts least."""
    enough = np.inf if job.machine.rotary[list(outputs)].any() else SMALL * job.target
    evaluate = by_way(correct)
    found: dict[Face, Parts] = {}
    for way in (None, *ways_that_matter(job.machine)):
        values = scale * _values(nodes, evaluate, way)
        if way is None:
            left = least_worst(nodes, [line.modulo for line in lines_of(job)], values, enough)
            values = values - left.values
        for number, output in enumerate(outputs):
            face: Face = (output, way)
            one = values[..., number]
            found[face] = taken_apart(one) if way is None else taken_apart_along(one, way)
    free = frozenset(outputs) if job.limits.own_free else frozenset[int]()
    tolerance = MERGED * max(SMALL * job.target, AGAINST_REST * left.rms)
    return Selection(found, tolerance, free, beside=job.limits.beside), left


def ways_that_matter(machine: Machine) -> list[int]:
    """The axes on whose direction of motion the errors depend."""
    names = machine.axis_names
    found = {
        names.index(effect.input if effect.input in names else effect.joint)
        for effect in machine.effects
        if effect.active and effect.basis.needs_direction
    }
    return sorted(found)


def coarse_nodes(space: Array, turns: Sequence[bool], most: int = NODES) -> list[Array]:
    """Where corrections are taken apart: evenly over each axis, but not so evenly that a screw's period could hide.

    The ends of `space` (n_axes, 2), mm or rad, are among the nodes (n,) of each axis, since most is left there; of axes
    that repeat (`turns`) they are not.
    """
    count = min(most, int(most ** (FULL / len(space)) + 1e-9))
    shaken = np.arange(count) + 0.5 + 0.3 * (np.mod(np.arange(1, count + 1) * 0.618034, 1.0) - 0.5)
    stretched = (shaken - shaken[0]) / (shaken[-1] - shaken[0])
    return [
        low + (high - low) * (shaken / count if turn else stretched)
        for (low, high), turn in zip(space.tolist(), turns, strict=True)
    ]


def lines_of(job: Job) -> tuple[Line, ...]:
    """The positions that tables of each axis cover; those of an endless axis over a whole turn repeat."""
    found = []
    features = job.machine.feature_lengths().tolist()
    for axis, (low, high), feature in zip(job.machine.axes, job.space.tolist(), features, strict=True):
        turn = axis.endless and high - low > 2 * np.pi - 1e-9
        ends = (low / axis.unit, high / axis.unit)
        found.append(Line.over(axis.name, *ends, axis.unit, feature / axis.unit, turn))
    return tuple(found)
