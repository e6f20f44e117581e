"""All mistakes that are considered, each with machine file and measurements corrected for it.

Mistakes of signs, units, columns, tables, tools and temperature change the prediction by a known column, so their
residual is known to first order without a new fit. Mistakes of positions and axes need a new fit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations, product

import numpy as np

from ncfix.arrays import Array, Ints
from ncfix.diagnosis.mistakes.foreign_tables import without_foreign_tables
from ncfix.diagnosis.mistakes.mistake import Mistake, undone_by_columns
from ncfix.diagnosis.mistakes.stale_tables import shifted_tables
from ncfix.diagnosis.mistakes.units import (
    DEVIATIONS,
    LENGTHS,
    units,
    units_of_one_file,
    units_of_tools,
    units_of_values,
)
from ncfix.diagnosis.residual_data import TIGHT_UM, Misfit, is_free, misfit, rows_of
from ncfix.machine import Effect, Machine
from ncfix.machine.axes import Axis
from ncfix.machine.plausible import much, times_a_machining_centre
from ncfix.measure.estimate import Problem
from ncfix.measure.least_squares import orthonormal, without
from ncfix.measure.measurement import Measurement, perhaps_right
from ncfix.values import frozen

DOUBTED, OFF = 0.3, 3.0
"""Displacements of an axis point, in units of a large location error of this machine (`plausible.much`): beyond the
first the point in the file may be wrong; beyond the second it must be, since no axis moves so far."""
NOWHERE_MM = 0.1
"""Smallest first step, mm, towards a wrong axis point; a smaller one means that the point is right."""
SIDE = 0.3
"""Share of the displacement of an axis point from which a component is listed as an alias."""
PIVOT, PIVOT_STEPS = "pivot", 3
"""Name of the mistake of a wrong axis point; number of Gauss-Newton steps to the right one."""
TOOL_STEP_MM, TOOL_LEAST_MM, MOST_TOOLS, MOST_SETS, TOOL_NUMBERS = 50.0, 1.0, 4, 12, 4
"""Step of the numerical derivative by tool length; smallest error of a length; largest numbers of tools and of sets
that are tried one by one; unknowns of a tool without a stated length: the length, and three of its tip."""
WARM_STEP_K, WARM_LEAST_K, STEEL = 20.0, 8.0, 11.5e-6
"""Step and smallest error of a workpiece temperature, K; thermal expansion of steel, 1/K."""


def at_first_sight(
    measurements: tuple[Measurement, ...], machine: Machine, now: Misfit, held_um: float
) -> Iterator[tuple[float, Mistake]]:
    """Mistakes that change the prediction by a known column, or the values; each with its residual to first order, um.

    held_um  prior standard deviation of the constants, um
    """
    rest, problem = FirstOrder.of(now, held_um), now.problem
    shown = [
        problem.um * (problem_design @ np.asarray(effect.coefficients)) for effect, problem_design in _designs(problem)
    ]
    for factor, parts, name, title, axis in _scalings(machine):
        change = sum((shown[k] for k in parts), np.zeros(len(problem.values)))
        effects = tuple(
            replace(e, coefficients=tuple(factor * c for c in e.coefficients)) if k in parts else e
            for k, e in enumerate(machine.effects)
        )
        undone = Mistake(name, title, axis, machine.replace(effects=effects), measurements)
        yield rest.left(rest.y + (1.0 - factor) * change), undone
    yield from _one_sided(measurements, machine, rest, shown)
    yield from _of_values(measurements, machine, rest)
    yield from _tools(measurements, machine, rest)
    yield from _warm(measurements, machine, rest)


def _designs(problem: Problem) -> list[tuple[Effect, Array]]:
    """Each effect of the file with its design (m, p), mm."""
    effects = problem.machine.effects
    every = np.concatenate([each.design(effects) for each in problem.observations])
    starts = np.cumsum([0, *(effect.basis.size for effect in effects)])
    return [
        (effect, every[:, start : start + effect.basis.size]) for effect, start in zip(effects, starts, strict=False)
    ]


def _scalings(machine: Machine) -> Iterator[tuple[float, tuple[int, ...], str, str, str]]:
    """Mistakes that scale effects of the file: (factor, indices of the effects, name, title, axis)."""
    effects = machine.effects
    if machine.is_perfect:
        return
    every = tuple(range(len(effects)))
    title = "table already active: the control compensates what the model predicts"
    yield 0.0, every, "table active", title, ""
    title = "wrong sign: the model holds corrections instead of errors"
    yield -1.0, every, "wrong sign", title, ""
    title = "wrong sign of the table in the control: errors are doubled"
    yield 2.0, every, "wrong sign", title, ""
    for joint in dict.fromkeys(effect.joint for effect in effects):
        own = tuple(k for k in every if effects[k].joint == joint)
        if len(own) < len(every):
            yield -1.0, own, f"sign of {joint}", f"wrong sign of all errors of {joint} in the machine file", joint
            title = f"table already active for {joint}: the control compensates its errors"
            yield 0.0, own, f"table active {joint}", title, joint
            title = f"wrong sign of the table of {joint} in the control: its errors are doubled"
            yield 2.0, own, f"wrong sign {joint}", title, joint
    for name in dict.fromkeys(effect.name for effect in effects):
        own = tuple(k for k in every if effects[k].name == name)
        joint = effects[own[0]].joint
        yield -1.0, own, f"sign of {name}", f"wrong sign of {name} in the machine file", joint
        curves = tuple(k for k in own if not is_free(effects[k]))
        if curves:
            title = f"table already active for {joint}: the control compensates {name}"
            yield 0.0, curves, f"table active {name}", title, joint
            if len(curves) < len(own):
                yield -1.0, curves, f"sign of {name}", f"wrong sign of the table of {name} in the machine file", joint


def _one_sided(
    measurements: tuple[Measurement, ...], machine: Machine, rest: FirstOrder, shown: Sequence[Array]
) -> Iterator[tuple[float, Mistake]]:
    """A table of an axis that is already active in the control, but in one direction of motion only."""
    if any(each.kind not in ("tcp", "tcp6") for each in measurements):
        return
    seen = rest.now.problem.observations
    directions = np.concatenate([np.broadcast_to(each.state.direction, each.q.shape) for each in seen])[rest.rows]
    for index, axis in enumerate(machine.axes):
        own = [k for k, e in enumerate(machine.effects) if not is_free(e) and {e.joint, e.signal} == {axis.name}]
        for side, said in ((1, "plus"), (-1, "minus")) if own else ():
            there = directions[:, index] == side
            if there.all() or not (directions[:, index] == -side).any():
                continue
            column = np.where(there, np.sum([shown[k] for k in own], axis=0), 0.0)
            sizes = [len(each.components) * len(each.measurement) for each in seen]
            parts = np.split(column / rest.now.problem.um, np.cumsum(sizes)[:-1])
            changed = tuple(
                each.with_columns(
                    {
                        name: each.column(name) + values
                        for name, values in zip(of.components, part.reshape(len(each), -1).T, strict=True)
                    }
                )
                for each, of, part in zip(measurements, seen, parts, strict=True)
            )
            title = f"table already active for {axis.name}, but only where it moves towards {said}"
            yield rest.left(rest.y + column), Mistake(f"table active {axis.name}", title, axis.name, machine, changed)


def _of_values(
    measurements: tuple[Measurement, ...], machine: Machine, rest: FirstOrder
) -> Iterator[tuple[float, Mistake]]:
    """Mistakes of measured values: sign, unit, exchanged columns."""
    names = list(dict.fromkeys(name for each in measurements for name in each.measured))
    offered = [
        undone_by_columns(
            "sign of values",
            "wrong sign of all measured values",
            machine,
            measurements,
            {name: (name, -1.0) for name in names},
        )
    ]
    if len(names) > 1:
        offered += [
            undone_by_columns(
                f"sign of {name}",
                f"wrong sign of the measured values {name}",
                machine,
                measurements,
                {name: (name, -1.0)},
            )
            for name in names
        ]
    everywhere = [name for name in names if name in LENGTHS and all(name in each.columns for each in measurements)]
    for first, second in combinations(everywhere, 2):
        columns = {first: (second, 1.0), second: (first, 1.0)}
        title = f"the columns {first} and {second} are exchanged"
        offered.append(undone_by_columns(f"swapped {first} {second}", title, machine, measurements, columns))
    if len(everywhere) == 3:
        for order in ((1, 2, 0), (2, 0, 1)):
            columns = {to: (everywhere[k], 1.0) for to, k in zip(everywhere, order, strict=True)}
            listed = ", ".join(everywhere[k] for k in order)
            title = f"the measured columns are in the order {listed}"
            offered.append(undone_by_columns("swapped columns", title, machine, measurements, columns))
    if all(each.kind in DEVIATIONS for each in measurements):
        for each in (*offered, *units_of_values(measurements, machine)):
            yield rest.left(rest.of_values(each.measurements)), each


@frozen(repr=False, slots=False)
class FirstOrder:
    """The misfit of a file to first order, with a free set-up and nearly fixed constants.

    y         (m,) values minus the prediction of the file, um
    basis     (m + k, r) orthonormal columns of the free parameters, with the rows of the prior below
    """

    now: Misfit
    y: Array
    basis: Array

    @staticmethod
    def of(now: Misfit, held_um: float) -> FirstOrder:
        """Linearize about the first guess of the set-up; `held_um`: prior standard deviation of the constants."""
        problem = now.problem
        scale = (problem.um / now.relative)[:, None]
        free, own = scale * problem.nuisance(problem.start), scale * problem.design
        size = np.sqrt((own**2).mean(axis=0))
        held_um *= times_a_machining_centre(problem.machine)
        prior = np.diag(now.noise / held_um * np.where(size > 0, size, 1.0))
        below = np.concatenate([np.zeros((len(prior), free.shape[1])), prior], axis=1)
        columns = np.concatenate([np.concatenate([free, own], axis=1), below])
        y = problem.um * problem.residual(problem.selection.start, problem.start)
        return FirstOrder(now, y, orthonormal(columns))

    def of_values(self, measurements: Sequence[Measurement]) -> Array:
        """(m,) the values of corrected measurements minus the prediction of the file, um."""
        problem = self.now.problem
        pairs = zip(measurements, problem.observations, strict=True)
        values = np.concatenate([
            np.concatenate([
                np.stack([each.column(name) for name in seen.components], axis=1).ravel(), seen.extra_values
            ])
            for each, seen in pairs
        ])  # fmt: skip
        return self.y + problem.um * (values - problem.values)

    def of_places(self, measurements: Sequence[Measurement]) -> Array:
        """(m,) values minus the prediction of the file for corrected positions or tools, um."""
        seen = Problem.of(measurements, self.now.problem.machine, self.now.problem.selection)
        return seen.um * seen.residual(seen.selection.start, seen.start)

    @property
    def rows(self) -> Ints:
        """(m,) index of the row of each value among the rows of all files; 0 for calibrated distances."""
        return np.maximum(rows_of(self.now.problem), 0)

    def amounts(self, columns: Array) -> Array:
        """(k,) factors of columns (m, k), um, which added to the values minimize the residual."""
        scaled = np.column_stack([self.y, columns]) / self.now.relative[:, None]
        below = np.zeros((len(self.basis) - len(scaled), scaled.shape[1]))
        rest = without(self.basis, np.concatenate([scaled, below]))
        return np.asarray(np.linalg.lstsq(rest[:, 1:], -rest[:, 0], rcond=None)[0], dtype=np.float64)

    def left(self, y: Array) -> float:
        """Root mean square residual of the values y (m,), um, without the largest."""
        scaled = np.concatenate([y / self.now.relative, np.zeros(len(self.basis) - len(y))])
        rest = np.abs(without(self.basis, scaled[:, None])[:, 0])
        kept = np.sort(rest[: len(y)])[: self.now.count]
        return float(np.sqrt(((kept**2).sum() + (rest[len(y) :] ** 2).sum()) / len(kept)))


def points_of_axes(measurements: tuple[Measurement, ...], machine: Machine, now: Misfit) -> list[Mistake]:
    """Mistakes of axis points: rotary axes whose point in the file is further off than axes move."""
    moved = [_pivot(measurements, machine, axis) for axis in machine.axes if axis.rotary]
    return [each for each in moved if each is not None]


def looking_like_constants(measurements: tuple[Measurement, ...], machine: Machine, now: Misfit) -> Iterator[Mistake]:
    """Mistakes that changed constants could imitate: axis points, and units in which probe and gauge show little."""
    yield from points_of_axes(measurements, machine, now)
    if any(each.kind in ("probe", "length") for each in measurements):
        yield from units(measurements, machine)


def not_of_first_order(measurements: tuple[Measurement, ...], machine: Machine, now: Misfit) -> Iterator[Mistake]:
    """Mistakes of positions, tools and axes, which need a new fit."""
    yield from points_of_axes(measurements, machine, now)
    if any(each.kind not in DEVIATIONS for each in measurements):
        yield from units_of_values(measurements, machine)
    yield from units_of_one_file(measurements, machine)
    yield from units(measurements, machine)
    yield from _exchanged_axes(measurements, machine)
    for axis in machine.axes:
        if axis.rotary:
            title = f"rotary sign: the machine file turns {axis.name} in the opposite sense"
            turned = _with(machine, replace(axis, direction=tuple(-x for x in axis.direction)))  # type: ignore[arg-type]
            yield Mistake(f"rotary sign {axis.name}", title, axis.name, turned, measurements)
        else:
            title = f"axis sign: the positions of {axis.name} count in the opposite direction"
            for right in perhaps_right(measurements):
                changed = tuple(each.times([axis.name], -1.0, right) for each in measurements)
                yield Mistake(f"axis sign {axis.name}", title, axis.name, machine, changed)
    yield from _unstated_tools(measurements, machine)
    yield from _other_machine(measurements, machine, now)
    for shifted, title in shifted_tables(measurements, machine):
        axes = sum(not axis.rotary for axis in machine.axes)
        yield Mistake("stale table", title, "", shifted, measurements, fitted=axes)


def _exchanged_axes(measurements: tuple[Measurement, ...], machine: Machine) -> Iterator[Mistake]:
    """Mistakes of exchanged position columns of two axes."""
    for kind in (False, True):
        names = [axis.name for axis in machine.axes if axis.rotary == kind]
        for (first, second), right in product(combinations(names, 2), perhaps_right(measurements)):
            changed = tuple(filter(None, (each.exchanged(first, second, right) for each in measurements)))
            if len(changed) == len(measurements):
                title = f"the positions of {first} and {second} are exchanged"
                yield Mistake(f"swapped {first} {second}", title, "", machine, changed)


def _tools(
    measurements: tuple[Measurement, ...], machine: Machine, rest: FirstOrder
) -> Iterator[tuple[float, Mistake]]:
    """Mistakes of tool lengths: wrong, in another unit, or exchanged between two tools."""
    if any("tool_length" not in each.columns for each in measurements):
        return
    lengths = sorted({float(x) for each in measurements for x in each.column("tool_length")})
    offered = []
    title = "tool length: the lengths of the two tools are exchanged"
    if len(lengths) == 2:
        swapped = _lengths(measurements, lambda length: sum(lengths) - length)
        offered.append(Mistake("tool length", title, "", machine, swapped))
    for each in (*offered, *units_of_tools(measurements, machine)) if lengths != [0.0] else ():
        yield rest.left(rest.of_places(each.measurements)), each
    lever = (rest.of_places(_lengths(measurements, lambda x: x + TOOL_STEP_MM)) - rest.y) / TOOL_STEP_MM
    own = np.concatenate([each.column("tool_length") for each in measurements])[rest.rows]
    for length in [None, *lengths] if 1 < len(lengths) <= MOST_TOOLS else [None]:
        column = lever * (length is None or own == length)
        off = float(rest.amounts(column[:, None])[0])
        if abs(off) > TOOL_LEAST_MM:
            which = "the tools" if length is None else f"the tool of {length:g} mm"
            title = f"tool length: {which} {'are' if length is None else 'is'} {off:+.1f} mm longer than stated"
            changed = _lengths(measurements, lambda x: np.where((length is None) | (x == length), x + off, x))  # noqa: B023
            yield (
                rest.left(rest.y + off * column),
                Mistake("tool length", title, "", machine, changed, fitted=1, likely=lengths == [0.0]),
            )


def _unstated_tools(measurements: tuple[Measurement, ...], machine: Machine) -> Iterator[Mistake]:
    """The mistake of missing tool lengths, if every set of rows has a tool of its own."""
    names = list(dict.fromkeys(name for each in measurements for name in each.sets))
    if any(each.column("tool_length").any() for each in measurements) or not 1 < len(names) <= MOST_SETS:
        return

    def of_sets(lengths: Sequence[float]) -> tuple[Measurement, ...]:
        own = dict(zip(names, lengths, strict=True))
        return tuple(each.with_columns({"tool_length": np.array([own[n] for n in each.sets])}) for each in measurements)

    apart = [1.0 + k for k in range(len(names))]
    rest = FirstOrder.of(misfit(of_sets(apart), machine), TIGHT_UM)
    ways = np.eye(len(names)) * TOOL_STEP_MM + apart
    levers = np.stack([rest.of_places(of_sets(way.tolist())) - rest.y for way in ways], axis=1) / TOOL_STEP_MM
    lengths = apart + rest.amounts(levers)
    title = "tool length: all are zero in the file, but the sets have tools of different lengths"
    found = of_sets([round(float(length), 3) for length in lengths])
    yield Mistake("tool length", title, "", machine, found, fitted=(len(names) - 1) * TOOL_NUMBERS, likely=True)


def _lengths(measurements: tuple[Measurement, ...], change: Callable[[Array], Array]) -> tuple[Measurement, ...]:
    return tuple(each.with_columns({"tool_length": change(each.column("tool_length"))}) for each in measurements)


def _warm(measurements: tuple[Measurement, ...], machine: Machine, rest: FirstOrder) -> Iterator[tuple[float, Mistake]]:
    """The mistake of a workpiece or artefact at a wrong temperature, so that all its coordinates are scaled."""
    if any(each.kind != "tcp" or not set(each.measured) & {"dx", "dy", "dz"} for each in measurements):
        return
    column = (rest.of_values(_grown(measurements, machine, WARM_STEP_K)) - rest.y) / WARM_STEP_K
    kelvin = float(rest.amounts(column[:, None])[0])
    if abs(kelvin) > WARM_LEAST_K:
        title = f"workpiece {abs(kelvin):.1f} K too {'warm' if kelvin > 0 else 'cold'}, if it is of steel"
        grown = _grown(measurements, machine, kelvin)
        yield (
            rest.left(rest.y + kelvin * column),
            Mistake("workpiece temperature", title, "", machine, grown, fitted=1),
        )


def _grown(measurements: tuple[Measurement, ...], machine: Machine, kelvin: float) -> tuple[Measurement, ...]:
    """The measurements less the thermal expansion of a workpiece of steel."""
    found = []
    for each in measurements:
        tip = machine.tip(each.positions(machine), each.column("tool_length"))
        names = [name for name in ("dx", "dy", "dz") if name in each.columns]
        found.append(
            each.with_columns(
                {name: each.columns[name] - STEEL * kelvin * tip[:, "xyz".index(name[1])] for name in names}
            )
        )
    return tuple(found)


def _pivot(measurements: tuple[Measurement, ...], machine: Machine, axis: Axis) -> Mistake | None:
    """The mistake of a wrong axis point, corrected by the data; None if the point is right."""
    located = [Effect(f"E{letter}0{axis.name}", (0.0,)) for letter in "XYZ"]
    moved, point = machine, np.asarray(axis.point)
    for _ in range(PIVOT_STEPS):
        shift = misfit(measurements, moved, located).coefficients
        way = np.asarray(axis.error_axes).T @ shift
        way -= np.asarray(axis.direction) * (way @ np.asarray(axis.direction))
        point = point + way
        if np.linalg.norm(point - np.asarray(axis.point)) < NOWHERE_MM:
            return None
        moved = _with(machine, replace(axis, point=tuple(float(x) for x in point)))  # type: ignore[arg-type]
    off = point - np.asarray(axis.point)
    far, large = float(np.linalg.norm(off)), much(machine, f"EX0{axis.name}")
    if far < DOUBTED * large:
        return None
    title = f"{PIVOT}: the point of {axis.name} in the machine file is wrong by {far:.2f} mm"
    carriers: tuple[str, ...] = ()
    if far < OFF * large and all(each.kind == "probe" for each in measurements):
        title += (
            "; if the control has the same point as the file, the axis itself has moved (calibrate); measurements of "
            "kind tcp under tool-centre-point control show which"
        )
        along = np.abs(np.asarray(axis.error_axes) @ off)
        carriers = tuple(
            f"constant E{letter}0{axis.name}" for letter, way in zip("XYZ", along, strict=True) if way > SIDE * far
        )
    return Mistake(f"{PIVOT} {axis.name}", title, axis.name, moved, measurements, fitted=2, aliases=carriers)


def _other_machine(measurements: tuple[Measurement, ...], machine: Machine, now: Misfit) -> Iterator[Mistake]:
    """The mistake of a file of another machine with the same axes: no curve holds, and its constants are refitted."""
    for fitted, count, gained in without_foreign_tables(measurements, machine, now):
        title = "another machine: no error of the file agrees; the file belongs to another machine or is out of date"
        yield Mistake("another machine", title, "", fitted, measurements, fitted=count, replaces=True, gained=gained)


def _with(machine: Machine, axis: Axis) -> Machine:
    return machine.replace(axes=tuple(axis if each.name == axis.name else each for each in machine.axes))
