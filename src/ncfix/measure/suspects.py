"""Mistakes in measurement files: what would explain the readings far better than what the file says.

Columns exchanged or of the other sign, radians for degrees, an axis turned round, one set that was read the other way,
length standards of which one is wrong. Each is undone in turn, and everything is fitted anew: noise and missing effects
hardly ever look like one of these few, a mistake is explained by it nearly all.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, permutations, product

import numpy as np
from scipy.special import fdtr

from ncfix.diagnostics import Message, NcfixError
from ncfix.machine import Machine
from ncfix.measure.calibrate import Problem
from ncfix.measure.measurement import Array, Measurement
from ncfix.measure.solve import orthonormal, without

BETTER = 0.2
"""Squares left after undoing a mistake, of those before, from which on it is taken for one."""
ALIKE = 1.5
"""Of orders and signs that leave at most this times the least, the simplest is meant."""
CHANCE = 1e-3
"""How likely the best of all that are tried may be so good by chance."""
LIKELY = 0.5
"""The same where the file itself looks like a mistake: positions out of range or like radians, errors like um."""
NOISE = 0.3
"""The same where what is left is noise alone."""
LARGE = 2.5
"""Squares a value, in units of the noise, below which there is nothing to explain."""
WORTH = 0.95
"""Squares left by one more set of the other sign, of those before, up to which the next is looked for."""
GATHERED_MM = 1.0
"""Tips of a set that are nearer to each other were on a ball: errors and a ball's place are far smaller."""
GATHERED = 0.05
"""Of the spread of the tips as the file has them: what is left where a mistake was undone."""
ROWS = 5
"""Rows of a set from which on it can be said whether its tips stay where they are."""
ENOUGH = 600
"""Rows of a file that are looked at."""
MOST_SETS = 12
"""Sets that are tried each by itself."""
ODD = {"NCF614", "NCF615", "NCF616"}
TURN_RAD = 2 * np.pi + 0.01


@dataclass(frozen=True)
class Suspect:
    """A mistake that may have been made in a file, or in several alike: what it is, how to repair it, and the files
    without it.

    file    the first of them
    scaled  lengths of these values of the file (m,) may be longer by a common factor
    others  the other files without the same mistake
    """

    text: str
    hint: str
    file: int
    measurement: Measurement
    scaled: Array | None = None
    others: Mapping[int, Measurement] = field(default_factory=dict)


def suspected(problem: Problem) -> tuple[Message, ...]:
    """NCF617: the mistake that explains the readings, if one does far better than the files as they are."""
    data = [_thinned(each.measurement) for each in problem.observations]
    scattered = _scattered(data, problem.machine)
    if scattered:
        return scattered
    now = _left(data, problem)
    if now is None or (now[0] < LARGE * now[1] and problem.noise_known):
        return ()
    tried = []
    for each in _suspects(data, problem.machine):
        repaired = {each.file: each.measurement, **each.others}
        changed = [repaired.get(file, measurement) for file, measurement in enumerate(data)]
        left = _left(changed, problem, each)
        if left is not None:
            tried.append((left[0] / max(left[1], 1), each))
    exchanged = [*_exchanged(data, problem), *_negated(data, problem)]
    count = len(tried) + sum(each[2] for each in exchanged)
    tried += [(size / max(now[1], 1), each) for size, each, _ in exchanged]
    if not tried:
        return ()
    best, found = min(tried, key=lambda pair: pair[0])
    ratio = best / (now[0] / max(now[1], 1))
    odd = any(each.code in ODD for data in problem.observations for each in data.measurement.remarks)
    alone = problem.noise_known and best < LARGE
    enough = LIKELY if odd else NOISE if alone else BETTER
    if ratio > enough or count * fdtr(now[1], now[1], ratio) > CHANCE:
        return ()
    place = found.measurement.place(0)
    return (
        Message("NCF617", f"{found.text}: that explains {100 * (1 - ratio):.0f} % of what is left", place, found.hint),
    )


def _scattered(data: Sequence[Measurement], machine: Machine) -> tuple[Message, ...]:
    """NCF617: the tips of each set stay at one place, as on a ball, but only once the positions are repaired.

    This needs no reading: where errors hardly depend on these positions, no fit would tell.
    """
    for each in _suspects(data, machine):
        before = data[each.file]
        if before.kind != "tcp" or each.measurement is before:
            continue
        after = _spread(each.measurement, machine)
        if after < GATHERED_MM and after < GATHERED * _spread(before, machine):
            text = f"{each.text}: the tip stays at one place in each set then, as on a ball, and goes about as it is"
            return (Message("NCF617", text, before.place(0), each.hint),)
    return ()


def _spread(measurement: Measurement, machine: Machine) -> float:
    """How far the tips are from the middle of their set, the median over sets of the root mean square, mm."""
    tips = machine.tip(measurement.positions(machine), measurement.column("tool_length"))
    names = np.array(measurement.sets)
    every = [tips[names == name] for name in dict.fromkeys(measurement.sets)]
    large = [each - each.mean(axis=0) for each in every if len(each) >= ROWS]
    return float(np.median([np.sqrt((each**2).sum(axis=1).mean()) for each in large])) if large else np.inf


def _thinned(measurement: Measurement) -> Measurement:
    rows = np.unique(np.linspace(0, len(measurement) - 1, ENOUGH).astype(int))
    return measurement if len(rows) == len(measurement) else measurement.rows(rows)


def _left(data: Sequence[Measurement], problem: Problem, suspect: Suspect | None = None) -> tuple[float, int] | None:
    """The squares that are left and their degrees of freedom, all effects and set-ups fitted; None if that fails.

    Gross outliers would decide between suspects, so no value counts for more than four times the median.
    """
    try:
        seen = Problem.of(data, problem.machine, problem.selection)
        start, sigma = seen.start, seen.sigma
        rest = seen.residual(problem.selection.start, start) / sigma
        parts = [seen.design, seen.nuisance(start)]
        if suspect is not None and suspect.scaled is not None:
            before = sum(len(each.values) for each in seen.observations[: suspect.file])
            column = np.zeros((len(rest), 1))
            column[before : before + len(suspect.scaled), 0] = suspect.scaled
            parts.append(column)
    except (NcfixError, np.linalg.LinAlgError, ValueError):
        return None
    columns = orthonormal(np.concatenate(parts, axis=1) / sigma[:, None])
    left = without(columns, rest)
    size = np.abs(left)
    most = max(4 * float(np.median(size)) / 0.6745, 1e-12)
    return float((np.minimum(size, most) ** 2).sum()), len(left) - columns.shape[1]


def _suspects(data: Sequence[Measurement], machine: Machine) -> Iterator[Suspect]:
    alike: dict[str, list[Suspect]] = {}
    for file, measurement in enumerate(data):
        for make in (_units, _turned, _swapped):
            for each in make(file, measurement, machine):
                alike.setdefault(each.text, []).append(each)
                yield each
        yield from _series(file, measurement, len(data))
    for first, *others in alike.values():
        if others:
            yield replace(first, others={each.file: each.measurement for each in others})


def _units(file: int, measurement: Measurement, machine: Machine) -> Iterator[Suspect]:
    """Radians for degrees, of one rotary axis or of all."""
    there = [axis.name for axis in machine.axes if axis.rotary and np.ptp(measurement.column(axis.name)) > 0]
    small = [name for name in there if np.abs(measurement.column(name)).max() <= TURN_RAD]
    for names in [(name,) for name in small] + ([tuple(small)] if len(small) > 1 else []):
        columns = {name: np.rad2deg(measurement.columns[name]) for name in names}
        text = f"the positions of {' and '.join(names)} look like radians: degrees are asked for"
        yield Suspect(text, "multiply them by 180 / pi", file, measurement.with_columns(columns))


def _turned(file: int, measurement: Measurement, machine: Machine) -> Iterator[Suspect]:
    """An axis that is counted the other way."""
    for axis in machine.axes:
        name = axis.name
        columns = {each: -measurement.columns[each] for each in _of(measurement, name)}
        if any(np.ptp(values) > 0 for values in columns.values()):
            text = f"{name} is turned round: with its positions of the other sign the readings are explained"
            hint = f"see `direction` of {name} in the machine file, or the sign of its column"
            yield Suspect(text, hint, file, measurement.with_columns(columns))


def _of(measurement: Measurement, axis: str) -> list[str]:
    """The columns that hold positions of an axis."""
    low = axis.lower()
    names = (axis, f"m{low}", f"a{low}", f"b{low}")
    return [name for name in names if name in measurement.columns]


def _swapped(file: int, measurement: Measurement, machine: Machine) -> Iterator[Suspect]:
    """Positions of two axes that were exchanged."""
    for kind in (True, False):
        names = [axis.name for axis in machine.axes if axis.rotary == kind and _of(measurement, axis.name)]
        for first, second in combinations(names, 2):
            mine, other = _of(measurement, first), _of(measurement, second)
            if len(mine) != len(other):
                continue
            pairs = [*zip(mine, other, strict=True), *zip(other, mine, strict=True)]
            columns = {name: measurement.columns[source] for name, source in pairs}
            text = f"the columns {', '.join(mine)} and {', '.join(other)} look exchanged"
            yield Suspect(text, "exchange their names", file, measurement.with_columns(columns))


def _series(file: int, measurement: Measurement, files: int) -> Iterator[Suspect]:
    """One set, or a whole file beside others, that was read with the other sign or against a standard that is wrong."""
    sets = np.array(measurement.sets)
    names = list(dict.fromkeys(measurement.sets))
    parts: list[tuple[str, Array]] = [(f"set {name}", np.asarray(sets == name)) for name in names[:MOST_SETS]]
    if len(names) < 2:
        parts = []
    if files > 1:
        parts.append((f"file {measurement.path}", np.ones(len(sets), dtype=bool)))
    for title, rows in parts:
        if measurement.kind == "length":
            lengths = np.where(rows, measurement.columns["length"], 0.0)
            text = f"the lengths of {title} and the others cannot all be true: they are of another scale"
            hint = "which length standard is right? Leave the other out, or say `# setup: unknown`"
            yield Suspect(text, hint, file, measurement, scaled=lengths)
        elif measurement.kind in ("tcp", "tcp6", "axis"):
            columns = {name: np.where(rows, -1.0, 1.0) * measurement.columns[name] for name in measurement.measured}
            text = f"the readings of {title} have the other sign than the others"
            yield Suspect(text, "which way was the instrument set up there?", file, measurement.with_columns(columns))


@dataclass(frozen=True)
class _Readings:
    """What is left of other readings of the same positions: positions, effects and set-ups stay, so this is linear."""

    seen: Problem
    columns: Array
    known: Array

    @staticmethod
    def of(data: Sequence[Measurement], problem: Problem) -> _Readings:
        seen = Problem.of(data, problem.machine, problem.selection)
        columns = np.concatenate([seen.design, seen.nuisance(seen.start)], axis=1) / seen.sigma[:, None]
        known = seen.values - seen.residual(problem.selection.start, seen.start)
        return _Readings(seen, orthonormal(columns), known)

    def left(self, values: Array) -> float:
        """The squares, as `_left` counts them."""
        rest = np.abs(without(self.columns, (values - self.known) / self.seen.sigma))
        most = max(4 * float(np.median(rest)) / 0.6745, 1e-12)
        return float((np.minimum(rest, most) ** 2).sum())

    def part(self, file: int) -> slice:
        """Where the values of a file are."""
        first = sum(len(each.values) for each in self.seen.observations[:file])
        return slice(first, first + len(self.seen.observations[file].values))


def _exchanged(data: Sequence[Measurement], problem: Problem) -> Iterator[tuple[float, Suspect, int]]:
    """The measured columns of a set, a file, or all files in the order and with the signs that leave least; of how
    many. A set that was read with the other sign altogether is one of `_series`.
    """
    files = [file for file, measurement in enumerate(data) if measurement.kind == "tcp"]
    if not files:
        return
    readings = _Readings.of(data, problem)
    names = readings.seen.observations[files[0]].components
    size = len(names)
    ways = list(product(permutations(range(size)), product((1, -1), repeat=size)))[1:]
    parts = [("", file, [(file, np.ones(len(data[file]), dtype=bool))]) for file in files]
    if len(files) > 1:
        parts.append(("", files[0], [rows for _, _, (rows,) in parts]))
    for file in files:
        sets = list(dict.fromkeys(data[file].sets))
        mine = [(f"in set {name} ", file, [(file, np.array(data[file].sets) == name)]) for name in sets[:MOST_SETS]]
        parts += mine if len(sets) > 1 else []
    for where, first, together in parts:
        tried = {}
        for order, signs in ways:
            if where and order == tuple(range(size)) and sum(signs) == -size:
                continue
            values = readings.seen.values.copy()
            for file, rows in together:
                mine_values = values[readings.part(file)].reshape(-1, size)
                mine_values[rows] = mine_values[rows][:, order] * signs
                values[readings.part(file)] = mine_values.ravel()
            tried[order, signs] = readings.left(values)
        least = min(tried.values())
        close = [(way, squares) for way, squares in tried.items() if squares <= ALIKE * least]
        (order, signs), squares = min(close, key=lambda pair: (_changes(*pair[0]), pair[1]))
        look = _look(names, order, signs)
        yield squares, replace(look, text=where + look.text, file=first, measurement=data[first]), len(tried)


def _negated(data: Sequence[Measurement], problem: Problem) -> Iterator[tuple[float, Suspect, int]]:
    """Several sets that were read with the other sign: the one that helps most, then the next, as long as one does."""
    kinds = ("tcp", "tcp6", "axis")
    every = [
        (file, name)
        for file, measurement in enumerate(data)
        if measurement.kind in kinds
        for name in list(dict.fromkeys(measurement.sets))[:MOST_SETS]
    ]
    if len(every) < 3:
        return
    readings = _Readings.of(data, problem)
    signs: dict[tuple[int, str], Array] = {}
    for file, name in every:
        observation = readings.seen.observations[file]
        there = np.array([each == name for each in data[file].sets])
        sign = np.ones(len(readings.seen.values))
        sign[readings.part(file)] = np.where((observation.rows >= 0) & there[observation.rows], -1.0, 1.0)
        signs[file, name] = sign
    values, least = readings.seen.values, readings.left(readings.seen.values)
    turned: list[tuple[int, str]] = []
    tries = 0
    while len(turned) < len(every) // 2:
        tried = {each: readings.left(values * sign) for each, sign in signs.items() if each not in turned}
        tries += len(tried)
        best = min(tried, key=lambda each: tried[each])
        if tried[best] > WORTH * least:
            break
        values, least = values * signs[best], tried[best]
        turned.append(best)
    if len(turned) > 1:
        names = ", ".join(name for _, name in sorted(turned))
        text = f"the readings of sets {names} have the other sign than the others"
        file = min(turned)[0]
        yield least, Suspect(text, "which way was the instrument set up there?", file, data[file]), tries


def _changes(order: tuple[int, ...], signs: tuple[int, ...]) -> int:
    """How many columns are elsewhere or of another sign."""
    return sum(place != k or sign < 0 for k, (place, sign) in enumerate(zip(order, signs, strict=True)))


def _look(names: Sequence[str], order: tuple[int, ...], signs: tuple[int, ...]) -> Suspect:
    wanted = [f"{'-' if sign < 0 else ''}{names[k]}" for k, sign in zip(order, signs, strict=True)]
    turned = [names[k][-1] for k in range(len(names)) if signs[k] < 0]
    hint = "which way do the instrument's axes point?"
    text = f"the columns {', '.join(names)} look exchanged: {', '.join(wanted)} fit much better"
    if order == tuple(range(len(names))):
        which = " and ".join(turned)
        text = f"the sign of {' and '.join(names[k] for k in range(len(names)) if signs[k] < 0)} looks wrong: "
        text += f"{', '.join(wanted)} fit much better"
        hint = f"the instrument's {which} {'axis is' if len(turned) == 1 else 'axes are'} turned round"
    return Suspect(text, hint, 0, Measurement("tcp", (), {}))
