"""Mistakes in measurement files: one is suspected where undoing it explains the readings far better than the file does.

They are columns exchanged or of the other sign, radians for degrees, an axis turned round, a set that was read the
other way, length standards of which one is wrong. A mistake is judged where it is said to be: a set that was read
wrongly is a tenth of a file of ten, and what all the others leave, or do not leave, says nothing about it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from itertools import combinations, permutations, product

import numpy as np
from scipy.special import fdtr

from ncfix.arrays import Array, Mask
from ncfix.diagnostics import Message, NcfixError
from ncfix.machine import Machine
from ncfix.measure.estimate import Problem
from ncfix.measure.least_squares import orthonormal, without
from ncfix.measure.measurement import Measurement
from ncfix.values import frozen

ODD = {"NCF614", "NCF615", "NCF616"}
"""Remarks on a file that are mistakes where the model does not describe the data: positions out of range or like
radians, errors like um."""
BETTER = 0.2
"""Squares left after undoing a mistake, of those before, from which on it is taken for one."""
LIKELY = 0.5
"""The same where the file itself looks like a mistake (`ODD`)."""
NOISE = 0.3
"""The same where what is left is noise alone."""
ALIKE = 1.5
"""Of orders and signs that leave at most this times the least, the simplest is meant."""
CHANCE = 1e-3
"""How likely the best of all that are tried may be so good by chance."""
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
TURN_RAD = 2 * np.pi + 0.01
OTHER_SIGN = "which way was the instrument set up there?"


@frozen(slots=False)
class Suspect:
    """A mistake that may have been made in a file, or in several alike: what it is, how to repair it, and the files
    without it.

    file    the first of them
    scaled  lengths of these values of the file (m,) may be longer by a common factor
    others  the other files without the same mistake
    rows    file -> where in it the mistake is, if it is not everywhere
    """

    text: str
    hint: str
    file: int
    measurement: Measurement
    scaled: Array | None = None
    others: Mapping[int, Measurement] = field(default_factory=dict)
    rows: Mapping[int, Mask] = field(default_factory=dict)


def suspected(problem: Problem) -> tuple[Message, ...]:
    """NCF617: the mistake that explains the readings, if one does far better than the files as they are.

    Each is undone in turn, and everything is fitted anew: noise and missing effects hardly ever look like one of these
    few, a mistake is explained by it nearly all.
    """
    data = [each.measurement for each in problem.observations]
    data = [each.rows(np.unique(np.linspace(0, len(each) - 1, ENOUGH).astype(int))) for each in data]
    scattered = _scattered(data, problem.machine)
    if scattered:
        return scattered
    try:
        readings = _Readings.of(data, problem)
    except (NcfixError, np.linalg.LinAlgError, ValueError):
        return ()
    now = readings.left(readings.problem.values)
    parts = [now.mean(), *(now.mean(readings.where({file: rows})) for file, _, rows in _sets(data))]
    if problem.noise_known and max(parts) < LARGE:
        return ()
    tried = []
    for each in _suspects(data, problem.machine):
        repaired = {each.file: each.measurement, **each.others}
        changed = [repaired.get(file, measurement) for file, measurement in enumerate(data)]
        left = _left(changed, problem, each)
        if left is not None:
            tried.append((left, each))
    exchanged = [*_exchanged(data, readings), *_negated(data, readings)]
    count = len(tried) + sum(ways for _, _, ways in exchanged)
    tried += [(left, each) for left, each, _ in exchanged]
    if not tried:
        return ()
    left, found = min(tried, key=lambda pair: pair[0].mean())
    there = readings.where(found.rows)
    before, after = now.mean(there), left.mean(there)
    ratio, values = after / before, max(now.share * int(there.sum()), 1.0)
    odd = any(each.code in ODD for data in problem.observations for each in data.measurement.remarks)
    enough = LIKELY if odd else NOISE if problem.noise_known and after < LARGE else BETTER
    small = problem.noise_known and before < LARGE
    if small or ratio > enough or count * fdtr(values, values, ratio) > CHANCE:
        return ()
    text = f"{found.text}: that explains {100 * (1 - ratio):.0f} % of what is left{' there' if found.rows else ''}"
    return (Message("NCF617", text, found.measurement.place(0), found.hint),)


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


@frozen(slots=False)
class _Left:
    """What a fit leaves: squares (m,) in units of the noise, and the share of the values that are free.

    Gross outliers would decide between suspects, so none counts for more than four times the median.
    """

    squares: Array
    share: float

    @staticmethod
    def of(rest: Array, fitted: int) -> _Left:
        size = np.abs(rest)
        most = max(4 * float(np.median(size)) / 0.6745, 1e-12)
        return _Left(np.minimum(size, most) ** 2, max(len(rest) - fitted, 1) / len(rest))

    def mean(self, there: Mask | None = None) -> float:
        """Squares a free value, of all or of some."""
        return float((self.squares if there is None else self.squares[there]).mean()) / self.share


def _left(data: Sequence[Measurement], problem: Problem, suspect: Suspect | None = None) -> _Left | None:
    """What is left with all effects and set-ups fitted; None if that fails."""
    try:
        seen = Problem.of(data, problem.machine, problem.selection)
        rest = seen.residual(problem.selection.start, seen.start) / seen.sigma
        columns = seen.columns
        if suspect is not None and suspect.scaled is not None:
            scaled = np.zeros(len(rest))
            scaled[_part(seen, suspect.file)][: len(suspect.scaled)] = suspect.scaled
            columns = np.column_stack([columns, scaled / seen.sigma])
    except (NcfixError, np.linalg.LinAlgError, ValueError):
        return None
    basis = orthonormal(columns)
    return _Left.of(without(basis, rest), basis.shape[1])


def _sets(data: Sequence[Measurement]) -> Iterator[tuple[int, str, Mask]]:
    """The first sets of each file, and where they are."""
    for file, measurement in enumerate(data):
        names = np.array(measurement.sets)
        for name in list(dict.fromkeys(measurement.sets))[:MOST_SETS]:
            yield file, name, np.asarray(names == name)


def _part(problem: Problem, file: int) -> slice:
    """Where the values of a file are."""
    first = sum(len(each.values) for each in problem.observations[:file])
    return slice(first, first + len(problem.observations[file].values))


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
    parts = [(f"set {name}", rows) for _, name, rows in _sets([measurement])]
    if len(parts) < 2:
        parts = []
    if files > 1:
        parts.append((f"file {measurement.path}", np.ones(len(measurement), dtype=bool)))
    for title, rows in parts:
        if measurement.kind == "length":
            lengths = np.where(rows, measurement.columns["length"], 0.0)
            text = f"the lengths of {title} and the others cannot all be true: they are of another scale"
            hint = "which length standard is right? Leave the other out, or say `# setup: unknown`"
            yield Suspect(text, hint, file, measurement, scaled=lengths, rows={file: rows})
        elif measurement.kind in ("tcp", "tcp6", "axis"):
            columns = {name: np.where(rows, -1.0, 1.0) * measurement.columns[name] for name in measurement.measured}
            text = f"the readings of {title} have the other sign than the others"
            yield Suspect(text, OTHER_SIGN, file, measurement.with_columns(columns), rows={file: rows})


@frozen(slots=False)
class _Readings:
    """What is left of other readings of the same positions: positions, effects and set-ups stay, so this is linear."""

    problem: Problem
    basis: Array
    predicted: Array

    @staticmethod
    def of(data: Sequence[Measurement], problem: Problem) -> _Readings:
        seen = Problem.of(data, problem.machine, problem.selection)
        predicted = seen.values - seen.residual(problem.selection.start, seen.start)
        return _Readings(seen, orthonormal(seen.columns), predicted)

    def left(self, values: Array) -> _Left:
        """What these values leave."""
        return _Left.of(without(self.basis, (values - self.predicted) / self.problem.sigma), self.basis.shape[1])

    def where(self, rows: Mapping[int, Mask]) -> Mask:
        """The values (m,) of these rows of files; all for none."""
        there = [
            rows[file][each.rows] & (each.rows >= 0) if file in rows else np.full(len(each.values), not rows)
            for file, each in enumerate(self.problem.observations)
        ]
        return np.concatenate(there)


def _exchanged(data: Sequence[Measurement], readings: _Readings) -> Iterator[tuple[_Left, Suspect, int]]:
    """The measured columns of a set, a file, or all files in the order and with the signs that leave least; of how
    many. A set that was read with the other sign altogether is one of `_series`.
    """
    files = [file for file, measurement in enumerate(data) if measurement.kind == "tcp"]
    if not files:
        return
    names = readings.problem.observations[files[0]].components
    files = [file for file in files if readings.problem.observations[file].components == names]
    size = len(names)
    ways = list(product(permutations(range(size)), product((1, -1), repeat=size)))[1:]
    whole = {file: np.ones(len(data[file]), dtype=bool) for file in files}
    parts = [("", {file: rows}) for file, rows in whole.items()]
    if len(files) > 1:
        parts.append(("", whole))
    some = {file for file in files if len(set(data[file].sets)) > 1}
    parts += [(f"in set {name} ", {file: rows}) for file, name, rows in _sets(data) if file in some]
    for where, together in parts:
        tried: dict[tuple[tuple[int, ...], tuple[int, ...]], _Left] = {}
        for order, signs in ways:
            if where and order == tuple(range(size)) and sum(signs) == -size:
                continue
            values = readings.problem.values.copy()
            for file, rows in together.items():
                part = values[_part(readings.problem, file)].reshape(-1, size)  # a view
                part[rows] = part[rows][:, order] * signs
            tried[order, signs] = readings.left(values)
        least = min(left.mean() for left in tried.values())
        changed = {
            way: sum(k != place or sign < 0 for k, (place, sign) in enumerate(zip(*way, strict=True)))
            for way, left in tried.items()
            if left.mean() <= ALIKE * least
        }
        way = min(changed, key=lambda way: (changed[way], tried[way].mean()))
        first, look = min(together), _look(names, *way)
        found = replace(
            look,
            text=where + look.text,
            file=first,
            measurement=data[first],
            rows=together if where or len(data) > 1 else {},
        )
        yield tried[way], found, len(tried)


def _negated(data: Sequence[Measurement], readings: _Readings) -> Iterator[tuple[_Left, Suspect, int]]:
    """Several sets that were read with the other sign: the one that helps most, then the next, as long as one does."""
    kinds = ("tcp", "tcp6", "axis")
    every = {(file, name): rows for file, name, rows in _sets(data) if data[file].kind in kinds}
    if len(every) < 3:
        return
    signs = {each: np.where(readings.where({each[0]: rows}), -1.0, 1.0) for each, rows in every.items()}
    values = readings.problem.values
    left = readings.left(values)
    turned: list[tuple[int, str]] = []
    tries = 0
    while len(turned) < len(every) // 2:
        tried = {each: readings.left(values * sign) for each, sign in signs.items() if each not in turned}
        tries += len(tried)
        best = min(tried, key=lambda each: tried[each].mean())
        if tried[best].mean() > WORTH * left.mean():
            break
        values, left = values * signs[best], tried[best]
        turned.append(best)
    if len(turned) > 1:
        names = ", ".join(name for _, name in sorted(turned))
        text = f"the readings of sets {names} have the other sign than the others"
        file = min(turned)[0]
        rows: dict[int, Mask] = {}
        for each in turned:
            rows[each[0]] = rows.get(each[0], np.zeros(len(data[each[0]]), dtype=bool)) | every[each]
        yield left, Suspect(text, OTHER_SIGN, file, data[file], rows=rows), tries


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
