"""Detection of mistakes in measurement files: one is suspected if undoing it explains the readings far better.

Mistakes are exchanged columns, wrong signs, radians for degrees, a reversed axis, a set read with the wrong sign, or a
wrong length standard. A mistake is judged by the values that it affects only: a wrong set may be a tenth of a file, and
the residuals of the other sets say nothing about it.
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
from ncfix.measure.measurement import Measurement, perhaps_right
from ncfix.values import frozen

ODD = {"NCF614", "NCF615", "NCF616"}
"""Codes of remarks on positions and errors that probably are mistakes if the model does not describe the data."""
BETTER = 0.2
"""Largest ratio of the squared residuals after and before undoing a mistake, for it to be suspected."""
LIKELY = 0.5
"""This ratio for a file that has a remark of `ODD`."""
NOISE = 0.3
"""This ratio if only noise is left after undoing the mistake."""
SIMILAR = 1.5
"""Among column orders and signs with residuals within this factor of the smallest, the simplest is chosen."""
CHANCE = 1e-3
"""Largest probability by chance of the best mistake among all tried."""
LARGE = 2.5
"""Mean squared residual, in units of the noise, below which there is nothing to explain."""
WORTH = 0.95
"""Largest ratio of the squared residuals by reversing one more set, for that set to be reversed."""
GATHERED_MM = 1.0
"""Largest spread of the tips of a set that were at a ball, mm: errors are far smaller."""
GATHERED = 0.05
"""Largest ratio of the spread of the tips after and before undoing a mistake of positions."""
ROWS = 5
"""Smallest number of rows of a set whose spread counts."""
ENOUGH = 600
"""Largest number of rows of a file that are used."""
MOST_SETS = 12
"""Largest number of sets of a file that are tried one by one."""
TURN_RAD = 2 * np.pi + 0.01
"""Largest position, in radians, of an axis that may have been given in radians."""
OTHER_SIGN = "check the direction of the instrument in this set-up"


@frozen(slots=False)
class Suspect:
    """A possible mistake in one file or several.

    text, hint   the mistake, and how to repair it
    file         index of the first file concerned
    measurement  that file without the mistake
    scaled       (m,) values of the file that may be wrong by a common factor, zero elsewhere; None: no scale error
    others       index -> other files with the same mistake, without it
    rows         index of file -> mask of the rows with the mistake; empty: all
    """

    text: str
    hint: str
    file: int
    measurement: Measurement
    scaled: Array | None = None
    others: Mapping[int, Measurement] = field(default_factory=dict)
    rows: Mapping[int, Mask] = field(default_factory=dict)


def suspected(problem: Problem) -> tuple[Message, ...]:
    """NCF617: the mistake that explains the readings far better than the unchanged files, if there is one.

    Each mistake is undone in turn and everything fitted anew. Undoing a real mistake explains nearly the whole misfit;
    noise and missing effects hardly ever look like one of these mistakes.
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
    text = f"{found.text}: this explains {100 * (1 - ratio):.0f} % of the residual{' there' if found.rows else ''}"
    return (Message("NCF617", text, found.measurement.place(0), found.hint),)


def _scattered(data: Sequence[Measurement], machine: Machine) -> tuple[Message, ...]:
    """NCF617: a mistake of positions without which the tips of each set stay at one place, as at a ball.

    This test does not use the readings, and so also works if errors hardly depend on these positions.
    """
    for each in _suspects(data, machine):
        before = data[each.file]
        if before.kind != "tcp" or each.measurement is before:
            continue
        after = _spread(each.measurement, machine)
        if after < GATHERED_MM and after < GATHERED * _spread(before, machine):
            text = (
                f"{each.text}: then the tip stays at one point in each set, as on a ball; with the file as it is, it "
                "moves about"
            )
            return (Message("NCF617", text, before.place(0), each.hint),)
    return ()


def _spread(measurement: Measurement, machine: Machine) -> float:
    """Median over sets of the rms distance of the tips from their centre, mm."""
    tips = machine.tip(measurement.positions(machine), measurement.column("tool_length"))
    names = np.array(measurement.sets)
    every = [tips[names == name] for name in dict.fromkeys(measurement.sets)]
    large = [each - each.mean(axis=0) for each in every if len(each) >= ROWS]
    return float(np.median([np.sqrt((each**2).sum(axis=1).mean()) for each in large])) if large else np.inf


@frozen(slots=False)
class _Left:
    """Residuals of a fit: squares (m,) in units of the noise, and the degrees of freedom as a share of m.

    Residuals are limited to four robust standard deviations, so that gross outliers do not decide between suspects.
    """

    squares: Array
    share: float

    @staticmethod
    def of(rest: Array, fitted: int) -> _Left:
        size = np.abs(rest)
        most = max(4 * float(np.median(size)) / 0.6745, 1e-12)
        return _Left(np.minimum(size, most) ** 2, max(len(rest) - fitted, 1) / len(rest))

    def mean(self, there: Mask | None = None) -> float:
        """Mean squared residual per degree of freedom, of all values or of those in a mask."""
        return float((self.squares if there is None else self.squares[there]).mean()) / self.share


def _left(data: Sequence[Measurement], problem: Problem, suspect: Suspect | None = None) -> _Left | None:
    """Residuals with all effects and set-ups fitted; None if the fit fails."""
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
    """The first `MOST_SETS` sets of each file: (index of file, name, mask of its rows)."""
    for file, measurement in enumerate(data):
        names = np.array(measurement.sets)
        for name in list(dict.fromkeys(measurement.sets))[:MOST_SETS]:
            yield file, name, np.asarray(names == name)


def _part(problem: Problem, file: int) -> slice:
    """The slice of the values of a file."""
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
    """Suspects: positions in radians, of one rotary axis or of all."""
    there = [axis.name for axis in machine.axes if axis.rotary and np.ptp(measurement.column(axis.name)) > 0]
    small = [name for name in there if np.abs(measurement.column(name)).max() <= TURN_RAD]
    for names in [(name,) for name in small] + ([tuple(small)] if len(small) > 1 else []):
        text = f"the positions of {' and '.join(names)} look like radians; they must be in degrees"
        yield Suspect(text, "multiply them by 180 / pi", file, measurement.times(names, 180 / np.pi))


def _turned(file: int, measurement: Measurement, machine: Machine) -> Iterator[Suspect]:
    """The suspects that the positions of one axis have the wrong sign."""
    for axis, right in product(machine.axes, perhaps_right([measurement])):
        name = axis.name
        if any(np.ptp(measurement.columns[each]) > 0 for each in measurement.columns_of(name)):
            text = f"{name} has the opposite sign: with its positions of the other sign, the readings are explained"
            hint = f"check `direction` of {name} in the machine file, and the sign of its column"
            yield Suspect(text, hint, file, measurement.times([name], -1.0, right))


def _swapped(file: int, measurement: Measurement, machine: Machine) -> Iterator[Suspect]:
    """Suspects: exchanged position columns of two axes."""
    for kind in (True, False):
        names = [axis.name for axis in machine.axes if axis.rotary == kind]
        for (first, second), right in product(combinations(names, 2), perhaps_right([measurement])):
            if (changed := measurement.exchanged(first, second, right)) is not None:
                mine, other = (", ".join(measurement.columns_of(name, right)) for name in (first, second))
                text = f"the columns {mine} and {other} seem to be exchanged"
                yield Suspect(text, "exchange their names", file, changed)


def _series(file: int, measurement: Measurement, files: int) -> Iterator[Suspect]:
    """Suspects: a set, or a file beside others, with readings of the wrong sign or of a wrong length standard."""
    parts = [(f"set {name}", rows) for _, name, rows in _sets([measurement])]
    if len(parts) < 2:
        parts = []
    if files > 1:
        parts.append((f"file {measurement.path}", np.ones(len(measurement), dtype=bool)))
    for title, rows in parts:
        if measurement.kind == "length":
            lengths = np.where(rows, measurement.columns["length"], 0.0)
            text = f"the lengths of {title} differ from the others by a scale factor"
            hint = "leave out the wrong length standard, or write `# setup: unknown` in the header"
            yield Suspect(text, hint, file, measurement, scaled=lengths, rows={file: rows})
        elif measurement.kind in ("tcp", "tcp6", "axis"):
            columns = {name: np.where(rows, -1.0, 1.0) * measurement.columns[name] for name in measurement.measured}
            text = f"the readings of {title} have the opposite sign to the others"
            yield Suspect(text, OTHER_SIGN, file, measurement.with_columns(columns), rows={file: rows})


@frozen(slots=False)
class _Readings:
    """Residuals of modified readings at the same positions, which need no new design: a linear operation."""

    problem: Problem
    basis: Array
    predicted: Array

    @staticmethod
    def of(data: Sequence[Measurement], problem: Problem) -> _Readings:
        seen = Problem.of(data, problem.machine, problem.selection)
        predicted = seen.values - seen.residual(problem.selection.start, seen.start)
        return _Readings(seen, orthonormal(seen.columns), predicted)

    def left(self, values: Array) -> _Left:
        """Residuals of these values."""
        return _Left.of(without(self.basis, (values - self.predicted) / self.problem.sigma), self.basis.shape[1])

    def where(self, rows: Mapping[int, Mask]) -> Mask:
        """Mask (m,) of the values of these rows; all values if `rows` is empty."""
        there = [
            rows[file][each.rows] & (each.rows >= 0) if file in rows else np.full(len(each.values), not rows)
            for file, each in enumerate(self.problem.observations)
        ]
        return np.concatenate(there)


def _exchanged(data: Sequence[Measurement], readings: _Readings) -> Iterator[tuple[_Left, Suspect, int]]:
    """For each set, each file, and all files together: the best order and signs of the measured columns, as a suspect,
    with its residuals and the number tried. A set with all signs reversed belongs to `_series`.
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
            if left.mean() <= SIMILAR * least
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
    """A suspect: several sets with the wrong sign, which are found one after another.

    With it come its residuals and the number of sets that were tried.
    """
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
        text = f"the readings of the sets {names} have the opposite sign to the others"
        file = min(turned)[0]
        rows: dict[int, Mask] = {}
        for each in turned:
            rows[each[0]] = rows.get(each[0], np.zeros(len(data[each[0]]), dtype=bool)) | every[each]
        yield left, Suspect(text, OTHER_SIGN, file, data[file], rows=rows), tries


def _look(names: Sequence[str], order: tuple[int, ...], signs: tuple[int, ...]) -> Suspect:
    wanted = [f"{'-' if sign < 0 else ''}{names[k]}" for k, sign in zip(order, signs, strict=True)]
    turned = [names[k][-1] for k in range(len(names)) if signs[k] < 0]
    hint = "check the directions of the instrument's axes"
    text = f"the columns {', '.join(names)} seem to be exchanged: {', '.join(wanted)} fit much better"
    if order == tuple(range(len(names))):
        which = " and ".join(turned)
        text = f"the sign of {' and '.join(names[k] for k in range(len(names)) if signs[k] < 0)} seems to be wrong: "
        text += f"{', '.join(wanted)} fit much better"
        hint = f"the instrument's {which} {'axis is' if len(turned) == 1 else 'axes are'} in the opposite direction"
    return Suspect(text, hint, 0, Measurement("tcp", (), {}))
