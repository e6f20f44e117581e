"""The automatic scheme: the one-input tables, sums and products of pairs for a machine's correction.

It works for any chain and any errors. The exact correction is decomposed on a grid and arranged in as few tables as
possible (`separable`). All parts that matter are chosen, or the most important ones if tables are few
(`PartSelection`). Their functions are then evaluated along every axis (`scheme_tables`). Rotary axes are first; the
linear axes then correct the rest at the resulting poses, so the tip is right whatever the rotary tables miss. Parts
that change with the direction of an axis become one table for each direction.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import field
from functools import cache

import numpy as np

from ncfix.arrays import Array
from ncfix.machine import Machine, State
from ncfix.tables.compensation import Compensation
from ncfix.tables.correction import exact_correction, linear_axes, rotary_correction
from ncfix.tables.grid import full_grid, on_full_grid
from ncfix.tables.lower_bounds import Remainder, least_worst
from ncfix.tables.scheme_tables import AxisPositions, Corrections, StagedTables, TableSample, by_way, checked, followed
from ncfix.tables.separable import (
    Part,
    Separation,
    TableLayout,
    absorbed,
    arranged,
    tables_of,
    taken_apart,
    taken_apart_along,
)
from ncfix.values import frozen, mutable

MANY_MORE = 12
"""Excess of tables above which parts are dropped by their size alone."""
TRIED = 12
"""Number of dropped parts, the largest, that are tried in place of others."""
OutputWay = tuple[int, int | None]
"""(output, way): the correction of an axis, and the axis with whose direction it changes sign, or None."""
Key = tuple[OutputWay, int]
"""A part: (output, way), and its index there, the largest first."""
NODES = 8
"""Number of positions of each axis at which the correction is decomposed; fewer for more than `FULL` axes."""
PROVEN = 10
"""Number of positions of each axis for the reported bound: more positions prove more."""
FULL = 5
"""Largest number of axes with the full number of positions each."""
LEVER = 200.0
"""Distance at which an angle of a rotary axis is compared with a length, mm."""
ROTARY_SHARE = 8
"""Rotary axes get at most one table in this many: they matter little for the tip."""
FEWER = (1, 3, 5, 8, 12, 16)
"""Numbers of tables that are tried for rotary axes: more may increase the rest that depends on three axes at once."""
SAME_BOUND = 1.02
"""Ratio within which bounds count as equal; then more tables for the rotary axes are better."""
SMALL = 0.1
"""Parts that together are below this share of the target, rms, are dropped."""
AGAINST_REST = 0.15
"""So are parts below this share of the rest that no tables can hold."""
MERGED = 0.25
"""Share of that allowance that may be lost by each replacement of a function by a multiple of others."""


@mutable
class PartSelection:
    """The chosen parts of the decomposed corrections ("faces": output and way), and the layouts of their tables.

    faces      the decomposition of each face
    tolerance  rms that may be lost when tables are merged
    free       axes whose correction by their own position needs no table of this kind
    chosen     the parts for which tables are made
    silent     faces of which even the constant is dropped
    beside     further tables for each table that multiplies others, and for each that is multiplied
    """

    faces: Mapping[OutputWay, Separation]
    tolerance: float
    free: frozenset[int] = frozenset()
    chosen: frozenset[Key] = frozenset()
    silent: frozenset[OutputWay] = frozenset()
    beside: tuple[int, int] = (0, 0)
    _known: dict[tuple[OutputWay, bool, tuple[int, ...]], tuple[TableLayout, TableLayout]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.chosen = frozenset((face, n) for face, parts in self.faces.items() for n in range(len(parts.parts)))

    def again(self) -> PartSelection:
        """An independent copy."""
        return copy(self)

    @property
    def outputs(self) -> list[int]:
        """Columns of the corrected axes."""
        return list(dict.fromkeys(output for output, _ in self.faces))

    def part(self, key: Key) -> Part:
        """The part with this key."""
        face, number = key
        return self.faces[face].parts[number]

    def layouts(self, output: int) -> list[TableLayout]:
        """The layouts of an axis, not absorbed, the one without direction first; without empty ones."""
        found = [self._layouts(face)[0] for face in self.faces if face[0] == output]
        return [layout for layout in found if layout.axes or layout.constant]

    def tables(self, output: int) -> int:
        """Number of tables that an axis takes."""
        layouts = [self._layouts(face)[1] for face in self.faces if face[0] == output]
        return needed(output, layouts, self.free, self.beside)

    @property
    def total(self) -> int:
        """Number of tables in all."""
        return sum(self.tables(output) for output in self.outputs)

    @property
    def lost(self) -> float:
        """Rms of the dropped parts."""
        gone = (part.size**2 for face in self.faces for n, part in self._numbered(face) if (face, n) not in self.chosen)
        return float((sum(gone) + sum(self.faces[face].constant ** 2 for face in self.silent)) ** 0.5)

    def drop_small(self, budget: float) -> None:
        """Drop the smallest parts as long as they are below `budget` (rms) together."""
        total = 0.0
        for key in sorted(self.chosen, key=lambda key: self.part(key).size):
            total += self.part(key).size ** 2
            if total > budget**2:
                return
            self.chosen -= {key}

    def fit_into(self, tables: int) -> None:
        """Choose the parts that correct most with at most `tables` tables.

        Two selections are made: by removing parts, cheapest first, and by adding parts, most valuable first. In the
        better one the largest dropped parts are then tried in place of others.
        """
        for key in sorted(self.chosen, key=lambda key: self.part(key).size):
            if self.total <= tables + MANY_MORE:
                break
            self.chosen -= {key}  # it will not come back
        whole = self.chosen
        self._thin(tables)
        best = self.chosen, self.silent, self.lost
        if best[0] == whole:
            return
        self._grow(whole, tables)
        best = min(best, (self.chosen, self.silent, self.lost), key=lambda found: found[2])
        for key in sorted(whole - best[0], key=lambda key: -self.part(key).size)[:TRIED]:
            self.chosen, self.silent = best[0] | {key}, best[1]
            self._thin(tables)
            best = min(best, (self.chosen, self.silent, self.lost), key=lambda found: found[2])
        self.chosen, self.silent, _ = best

    def _thin(self, tables: int) -> None:
        """Drop parts with the least loss per freed table until at most `tables` are taken."""
        while self.total > max(tables, 0):
            if not self.chosen:
                order = sorted(self.faces, key=lambda face: -abs(self.faces[face].constant))
                self.silent = frozenset(order[max(tables, 0) :])
                return
            self.chosen -= {min(sorted(self.chosen, key=str), key=self._price)}

    def _price(self, key: Key) -> tuple[bool, float]:
        """Loss per freed table by dropping a part; parts that free none sort last."""
        saved = self._change(key, self.chosen - {key})
        return saved >= 0, self.part(key).size ** 2 / max(-saved, 1)

    def _grow(self, whole: frozenset[Key], tables: int) -> None:
        """Start with no parts, and add those with the largest gain per table."""
        self.chosen = frozenset()
        self._thin(tables)
        room = tables - self.total
        while True:
            costs = {key: self._change(key, self.chosen | {key}) for key in sorted(whole - self.chosen, key=str)}
            allowed = [key for key, cost in costs.items() if cost <= room]
            if not allowed:
                return
            best = max(allowed, key=lambda key: self.part(key).size ** 2 / max(costs[key], 0.1))
            self.chosen |= {best}
            room -= costs[best]

    def _change(self, key: Key, chosen: frozenset[Key]) -> int:
        """Change of the number of tables of the axis of `key` with the selection `chosen`."""
        output, before = key[0][0], self.chosen
        now = self.tables(output)
        self.chosen = chosen
        then = self.tables(output)
        self.chosen = before
        return then - now

    def _layouts(self, face: OutputWay) -> tuple[TableLayout, TableLayout]:
        """The layout of an (output, way), and the same absorbed."""
        numbers = tuple(n for n, _ in self._numbered(face) if (face, n) in self.chosen)
        key = (face, face in self.silent, numbers)
        if key not in self._known:
            constant = 0.0 if face in self.silent else self.faces[face].constant
            parts = [self.part((face, n)) for n in numbers]
            layout = arranged(parts, constant, face[1], self.tolerance)
            self._known[key] = layout, absorbed(layout, self.tolerance)
        return self._known[key]

    def _numbered(self, face: OutputWay) -> Iterator[tuple[int, Part]]:
        return iter(enumerate(self.faces[face].parts))


def needed(output: int, layouts: Sequence[TableLayout], free: frozenset[int], beside: tuple[int, int] = (0, 0)) -> int:
    """Number of tables of the layouts of an axis, without the table over the axis itself if that is free."""
    ways = {layout.way for layout in layouts if output in layout.sums or layout.constant}
    return tables_of(layouts, beside) - int(output in free and ways == {None})


@frozen
class Limits:
    """Limits of a control.

    tables    largest number of tables; points: of nodes of a table
    own_free  sums of an axis over itself go into tables of another kind, which do not count
    beside    further tables for each table that multiplies others, and for each that is multiplied
    """

    tables: int
    points: int
    own_free: bool = False
    beside: tuple[int, int] = (0, 0)


@frozen
class Scheme:
    """Sums and pairwise products of one-input tables. The second factor of a product has no unit and is at most 1.

    missed   largest correction that the tables lack at random poses, mm at the tip
    rest     rms of the part that no sums and products of pairs can hold, mm
    bound    lower bound of the largest error of any sums and products of pairs, mm
    dropped  rms of the parts dropped because they are small or tables are few, mm
    """

    tables: Compensation
    missed: float
    rest: float
    dropped: float
    bound: float = 0.0


@frozen
class SchemeTask:
    """A machine, the space (n_axes, 2) and tool length (mm) for its tables, their target accuracy (mm), and limits."""

    machine: Machine
    space: Array
    tool_length: float
    target: float
    limits: Limits


def automatic(task: SchemeTask, rotary: bool = True) -> Scheme:
    """The tables of a machine; `rotary`: also correct the orientation by the rotary axes, as far as they can."""
    columns = np.flatnonzero(task.machine.rotary).tolist() if rotary else []
    most = task.limits.tables
    done = Scheme(Compensation(()), 0.0, 0.0, 0.0)
    if columns:
        done, used = _rotary(task, columns)
        most -= used
    moved, _ = Stage(task, linear_axes(task.machine), moving(task, done.tables), 1.0).tables(most)
    tables = Compensation((*done.tables.terms, *moved.tables.terms))
    bound = moved.bound
    if bound > SMALL * task.target:
        bound = max(bound, _bound(task, done, PROVEN))
    return Scheme(tables, moved.missed, moved.rest, moved.dropped, bound)


def _rotary(task: SchemeTask, columns: Sequence[int]) -> tuple[Scheme, int]:
    """The tables of the rotary axes and their number, chosen so that the linear axes can correct the rest best."""
    allowed = max(1, task.limits.tables // ROTARY_SHARE)
    tried: list[tuple[float, Scheme, int]] = []
    stage = Stage(task, columns, turning(task), LEVER)
    for most in sorted({min(each, allowed) for each in (*FEWER, allowed)}):
        done, used = stage.tables(most)
        tried.append((max(_bound(task, done), SMALL * task.target), done, used))
        if used < most and [each[-1] for each in tried[-2:]] == [used, used]:
            break
    least = min(bound for bound, _, _ in tried)
    _, done, used = [each for each in tried if each[0] <= SAME_BOUND * least][-1]
    return done, used


def _bound(task: SchemeTask, done: Scheme, count: int = NODES) -> float:
    """Lower bound, mm, of the largest error after correction of the linear axes, given the rotary tables `done`."""
    turns = [line.modulo for line in lines_of(task)]
    nodes = coarse_nodes(task.space, turns, count)
    evaluate = by_way(moving(task, done.tables))
    values = on_full_grid(lambda q: evaluate(q, None), nodes)
    return least_worst(nodes, turns, values, SMALL * task.target).bound


def turning(task: SchemeTask) -> Corrections:
    """The corrections of the rotary axes, rad."""
    return lambda q, direction: rotary_correction(task.machine, q, State(task.tool_length, direction))


def moving(task: SchemeTask, done: Compensation) -> Corrections:
    """The corrections of the linear axes, mm, with the rotary axes corrected by the tables `done`."""
    columns = linear_axes(task.machine)

    def corrections(q: Array, direction: Array) -> Array:
        ways = np.broadcast_to(direction, q.shape)
        turned = done.at(task.machine.axis_names, q, ways) * task.machine.rotary
        return exact_correction(task.machine, q, State(task.tool_length, ways), turned)[:, columns]

    return corrections


class Stage:
    """Axes that are corrected together; their decomposition is computed once for any number of tables."""

    def __init__(self, task: SchemeTask, outputs: Sequence[int], correct: Corrections, scale: float) -> None:
        """`correct`: the corrections of the outputs; `scale`: mm per unit of them."""
        self.task, self.scale = task, scale
        self.lines = lines_of(task)
        self.evaluate = by_way(lambda q, direction: scale * correct(q, direction))
        self.selection, self.left = _parts(task, outputs, correct, scale, coarse_nodes(task.space, self.turns))
        self.selection.drop_small(self.selection.tolerance / MERGED)
        self.sample = TableSample.of(self.left.nodes)
        self.along = cache(self._along)
        self.checked = checked(self.lines, correct)

    @property
    def turns(self) -> list[bool]:
        """For each axis, whether it repeats after a turn."""
        return [line.modulo for line in self.lines]

    def tables(self, most: int) -> tuple[Scheme, int]:
        """The scheme with at most `most` tables, and their number."""
        selection, left = self.selection.again(), self.left
        allowed, used = most, most + 1
        while used > most:
            selection.fit_into(allowed)
            layouts = self._followed(selection)
            used = sum(needed(output, each, selection.free, selection.beside) for output, each in layouts.items())
            allowed -= used - most
        unscaled = {output: [one.scaled(1 / self.scale) for one in each] for output, each in layouts.items()}
        stage = StagedTables(self.lines, unscaled, self.checked, self.scale)
        target = max(self.task.target, AGAINST_REST * left.rms)
        tables, missed = stage.settled(target, self.task.limits.points, left.largest)
        return Scheme(tables, missed, left.rms, selection.lost, left.bound), used

    def _followed(self, selection: PartSelection) -> dict[int, list[TableLayout]]:
        """The layouts with their functions at fine positions, absorbed again with these values."""
        known = {output: selection.layouts(output) for output in selection.outputs}
        found = followed(self.sample, known, self.along)
        return {output: [absorbed(one, selection.tolerance) for one in each] for output, each in found.items()}

    def _along(self, axis: int, way: int | None) -> Array:
        """The corrections along an axis, less the remainder that no pairs can hold; see `AlongAxis`."""
        positions, places = self.lines[axis].fine, self.sample.places
        values = self.evaluate(self.sample.poses(axis, positions), way).reshape(len(positions), len(places), -1)
        return values if way is not None else values - self.left.along(axis, positions, places)


def _parts(
    task: SchemeTask, outputs: Sequence[int], correct: Corrections, scale: float, nodes: Sequence[Array]
) -> tuple[PartSelection, Remainder]:
    """The decomposed corrections of some axes, and the remainder of least largest error that no pairs can hold."""
    enough = np.inf if task.machine.rotary[list(outputs)].any() else SMALL * task.target
    evaluate = by_way(correct)
    found: dict[OutputWay, Separation] = {}
    for way in (None, *ways_that_matter(task.machine)):
        values = scale * evaluate(full_grid(nodes), way).reshape(*map(len, nodes), -1)
        if way is None:
            left = least_worst(nodes, [line.modulo for line in lines_of(task)], values, enough)
            values = values - left.values
        for number, output in enumerate(outputs):
            face: OutputWay = (output, way)
            one = values[..., number]
            found[face] = taken_apart(one) if way is None else taken_apart_along(one, way)
    free = frozenset(outputs) if task.limits.own_free else frozenset[int]()
    tolerance = MERGED * max(SMALL * task.target, AGAINST_REST * left.rms)
    return PartSelection(found, tolerance, free, beside=task.limits.beside), left


def ways_that_matter(machine: Machine) -> list[int]:
    """Columns of the axes on whose direction of motion the errors depend."""
    names = machine.axis_names
    found = {
        names.index(effect.input if effect.input in names else effect.joint)
        for effect in machine.effects
        if effect.active and effect.basis.needs_direction
    }
    return sorted(found)


def coarse_nodes(space: Array, turns: Sequence[bool], most: int = NODES) -> list[Array]:
    """Nodes of each axis for the decomposition, (n,), slightly uneven so that the period of a screw cannot be missed.

    They include the ends of `space` (n_axes, 2), mm or rad, where errors are largest, except for axes that repeat
    (`turns`).
    """
    count = min(most, int(most ** (FULL / len(space)) + 1e-9))
    shaken = np.arange(count) + 0.5 + 0.3 * (np.mod(np.arange(1, count + 1) * 0.618034, 1.0) - 0.5)
    stretched = (shaken - shaken[0]) / (shaken[-1] - shaken[0])
    return [
        low + (high - low) * (shaken / count if turn else stretched)
        for (low, high), turn in zip(space.tolist(), turns, strict=True)
    ]


def lines_of(task: SchemeTask) -> tuple[AxisPositions, ...]:
    """The positions that tables of each axis cover. They repeat for an endless axis over a whole number of turns.

    Over a fraction of a turn they do not repeat: the control would use a period that is not a turn.
    """
    found = []
    features = task.machine.feature_lengths.tolist()
    for axis, (low, high), feature in zip(task.machine.axes, task.space.tolist(), features, strict=True):
        turns = (high - low) / (2 * np.pi)
        turn = axis.endless and turns > 0.5 and abs(turns - round(turns)) < 1e-9
        ends = (low / axis.unit, high / axis.unit)
        found.append(AxisPositions.over(axis.name, *ends, axis.unit, feature / axis.unit, turn))
    return tuple(found)
