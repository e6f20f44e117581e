"""Measurements of which no machine can be made: they contradict themselves or each other, or are mistaken.

A stated standard is never an outlier: where two of them cannot both be true, nobody but their owner knows which one is
wrong. Outliers are few; where they are many, or all of one set, it is no longer said which part of the data is right.

Mistakes in files are columns exchanged or of the other sign, radians for degrees, an axis turned round, one set that
was read the other way, length standards of which one is wrong. One is suspected where undoing it explains the readings
far better than what the file says. A calibration that ran is none if it leaves what no machine with such an instrument
can leave.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, permutations, product

import numpy as np
from scipy.special import fdtr

from ncfix.diagnostics import Message, NcfixError
from ncfix.machine import Machine
from ncfix.machine.plausible import Doubt, functions, much
from ncfix.measure.estimate import HOPELESS, Calibration, Estimate, Problem, Residuals
from ncfix.measure.least_squares import orthonormal, without
from ncfix.measure.measurement import Array, Measurement
from ncfix.measure.selection import candidate_effects

BEYOND = 1000.0
"""Times the noise: missing effects leave some tens of it; this is a wrong unit, a wrong file or a wrong noise."""
MUCH_UM = 100.0
"""What is less may be an effect that is missing, however small the noise is that the file states."""
UM = 1e3
FAR = 4.0
"""Standard deviations that a stated length may be from what all others say."""
LACKING = 0.1
"""Of what is much: the standard deviation of each error that machines have and the model lacks."""
TOLD = 1e-6
"""Of a value: what of it is less than this is told by no other value."""
MANY, FEW = 0.05, 4
"""Share of the values that may be outliers; so many may be in any file."""
ALL = 0.5
"""Share of the rows of a set that may be outliers."""
FEWEST = 4
"""Rows that make a set of which something can be said, and a column that cannot be all the same."""
ODD = {"NCF614", "NCF615", "NCF616"}
"""Remarks on a file that are mistakes where the model does not describe the data: positions out of range or like
radians, errors like um."""
LACK = 5.0
"""Times the noise: a large lack of fit."""
REFUSED = ("NCF617", "NCF621", "NCF622", "NCF623")
"""Remarks with which no machine is written."""

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


def refusals(calibration: Calibration, odd: Sequence[Doubt]) -> tuple[Message, ...]:
    """Why no machine file may be written: data that contradict each other, a misfit, or a machine that cannot be."""
    found = misfit(calibration)
    impossible = tuple(doubt.message for doubt in odd if doubt.impossible)
    return (*_contradictions(calibration), *(() if found is None else (found,)), *impossible)


def _contradictions(calibration: Calibration) -> tuple[Message, ...]:
    """What was remarked that forbids to make a machine, and what is odd about data that do not fit."""
    codes = {*REFUSED, *(ODD if np.sqrt(calibration.chi_square) > LACK else ())}
    remarks = calibration.remarks
    return tuple(sorted((each for each in remarks if each.code in codes), key=lambda each: each.code in ODD))


def misfit(calibration: Calibration) -> Message | None:
    """NCF642 if the residuals are more than the machine may be corrected by, or many and `BEYOND` times the noise."""
    factor = float(np.sqrt(calibration.chi_square)) if calibration.problem.noise_known else 0.0
    most_um = UM * float(calibration.machine.max_correction[0])
    beyond = factor > BEYOND and calibration.after_um > MUCH_UM
    if not beyond and not calibration.after_um > most_um:
        return None
    times = f", {factor:.0f} times the noise" if factor > 1 else ""
    rms = f" ({calibration.after_um:.4g} um rms of {calibration.before_um:.4g} um before)"
    text = f"the calibrated model does not describe these measurements: what it leaves{rms} is "
    text += f"{factor:.0f} times the noise" if beyond else f"beyond max_correction, {most_um:g} um{times}"
    problem, estimate = calibration.problem, calibration.estimate
    rest = Residuals.of(problem, estimate)
    worst = int(np.argmax(np.abs(estimate.residual / problem.sigma) * (estimate.weight > 0)))
    hint = "look at that row, at units (mm, rad, degree), signs and columns, and whether it is this machine; "
    hint += "noise_um is in um"
    return Message("NCF642", f"{text}; most in {rest.component[worst]}", rest.place(worst), hint)


def conflicts(problem: Problem, estimate: Estimate) -> Iterator[Message]:
    """What of these data cannot all be true."""
    yield from _standards(problem, estimate)
    yield from _outlying(problem, estimate)


def untouched(measurement: Measurement) -> Message | None:
    """NCF623 if nothing was measured: all values of a column are the very same."""
    same = [name for name in measurement.measured if np.ptp(measurement.columns[name]) == 0]
    if len(measurement) < FEWEST or len(same) < len(measurement.measured) or not same:
        return None
    value = measurement.columns[same[0]][0]
    text = f"{', '.join(same)} {'is' if len(same) == 1 else 'are'} {value:g} in all rows: no instrument reads that"
    return Message("NCF623", text, measurement.place(0), "was the file filled in?")


def _standards(problem: Problem, estimate: Estimate) -> Iterator[Message]:
    """NCF621 if the others and the readings deny a stated length, by what is predicted of it without it.

    Real machines have all errors of ISO 230-1, a model some of them. What it lacks bends a distance more than it
    shows in the readings, since the balls move with it. So the errors that it lacks may be there, too, in the sizes
    that machines have, and readings that show one tell how much it bends a distance: a Gaussian prior on them.
    """
    stated = np.flatnonzero(problem.stated)
    if not stated.size:
        return
    root = np.sqrt(estimate.weight) / problem.sigma
    residual = estimate.residual * root
    free = np.concatenate([estimate.solution.orthogonal, estimate.solution.nuisance], axis=1)
    lacking = LACKING * _lacking(problem, estimate) * root[:, None]
    inner = np.linalg.inv(np.eye(lacking.shape[1]) + lacking.T @ lacking)
    sought = np.column_stack([residual, np.eye(len(residual))[:, stated]])
    solved_free = free - lacking @ (inner @ (lacking.T @ free))
    solved = sought - lacking @ (inner @ (lacking.T @ sought))
    solved -= solved_free @ np.linalg.solve(free.T @ solved_free, solved_free.T @ sought)
    pull, precision = solved[stated, 0], solved[stated, 1:]
    squares = float(residual @ solved[:, 0] - pull @ np.linalg.pinv(precision, rcond=TOLD) @ pull)
    freedom = max(int((estimate.weight > 0).sum()) - free.shape[1], 1)
    factor = max(1.0, float(np.sqrt(max(squares, 0.0) / (estimate.share * freedom))))
    told = np.maximum(np.diag(precision), TOLD)
    far = np.where(np.diag(precision) > TOLD, np.abs(pull) / (factor * np.sqrt(told)), 0.0)
    at = int(np.argmax(far))
    if far[at] <= FAR:
        return
    missed = 1e3 * pull[at] / told[at] * problem.sigma[stated[at]]
    text = (
        f"the stated distances cannot all be true: one is {missed:+.1f} um from what the others and the readings say, "
        f"{far[at]:.0f} standard deviations of that"
    )
    hint = "which standard is right? Leave the other out, or estimate what the model lacks: --effects"
    yield Message("NCF621", text, Residuals.of(problem, estimate).place(int(stated[at])), hint)


def _lacking(problem: Problem, estimate: Estimate) -> Array:
    """What errors do that machines have and that are not estimated, each as large as what is much of it: (m, k), mm."""
    machine, selection = problem.machine, problem.selection
    there = {(effect.name, effect.basis) for effect in selection.estimated}
    others = [effect for effect in candidate_effects(machine) if (effect.name, effect.basis) not in there]
    sizes = [much(machine, each.name) / np.abs(functions(machine, each)).max(axis=1) for each in others]
    held = np.setdiff1d(np.arange(problem.design.shape[1]), estimate.solution.kept)
    parts = [np.concatenate([each.design(others) for each in problem.observations]), problem.design[:, held]]
    errors: Array = np.concatenate(parts, axis=1) * np.concatenate([*sizes, problem.limits[held] / HOPELESS])
    return errors


def _outlying(problem: Problem, estimate: Estimate) -> Iterator[Message]:
    """Outliers that are too many to be outliers."""
    aside = estimate.weight == 0
    if not aside.any():
        return
    residuals = Residuals.of(problem, estimate)
    if aside.sum() > max(FEW, MANY * len(aside)):
        text = f"{int(aside.sum())} of {len(aside)} values are far from the model that the others make"
        first = int(np.flatnonzero(aside)[0])
        yield Message("NCF622", text, residuals.place(first), "which of them are right?")
        return
    for file, each in enumerate(problem.observations):
        sets = np.array(each.measurement.sets)
        bad = residuals.row[aside & (residuals.observation == file) & (residuals.row >= 0)]
        for name in dict.fromkeys(each.measurement.sets):
            rows = np.flatnonzero(sets == name)
            count = len(np.intersect1d(rows, bad))
            if len(rows) >= FEWEST and count > ALL * len(rows):
                text = f"{count} of {len(rows)} rows of set {name} are far from the model that the others make"
                yield Message("NCF622", text, each.measurement.place(int(rows[0])), "is that set right, or the others?")


# -- mistakes ----------------------------------------------------------------------------------------------------------


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
    """NCF617: the mistake that explains the readings, if one does far better than the files as they are.

    Each is undone in turn, and everything is fitted anew: noise and missing effects hardly ever look like one of these
    few, a mistake is explained by it nearly all.
    """
    data = [each.measurement for each in problem.observations]
    data = [each.rows(np.unique(np.linspace(0, len(each) - 1, ENOUGH).astype(int))) for each in data]
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
    count = len(tried) + sum(ways for _, _, ways in exchanged)
    tried += [(size / max(now[1], 1), each) for size, each, _ in exchanged]
    if not tried:
        return ()
    best, found = min(tried, key=lambda pair: pair[0])
    ratio = best / (now[0] / max(now[1], 1))
    odd = any(each.code in ODD for data in problem.observations for each in data.measurement.remarks)
    enough = LIKELY if odd else NOISE if problem.noise_known and best < LARGE else BETTER
    if ratio > enough or count * fdtr(now[1], now[1], ratio) > CHANCE:
        return ()
    text = f"{found.text}: that explains {100 * (1 - ratio):.0f} % of what is left"
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


def _left(data: Sequence[Measurement], problem: Problem, suspect: Suspect | None = None) -> tuple[float, int] | None:
    """The squares that are left and their degrees of freedom, all effects and set-ups fitted; None if that fails."""
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
    return _squares(without(basis, rest)), len(rest) - basis.shape[1]


def _squares(rest: Array) -> float:
    """Their sum; gross outliers would decide between suspects, so none counts for more than four times the median."""
    size = np.abs(rest)
    most = max(4 * float(np.median(size)) / 0.6745, 1e-12)
    return float((np.minimum(size, most) ** 2).sum())


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
            yield Suspect(text, OTHER_SIGN, file, measurement.with_columns(columns))


@dataclass(frozen=True)
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

    def left(self, values: Array) -> float:
        """The squares, as `_left` counts them."""
        return _squares(without(self.basis, (values - self.predicted) / self.problem.sigma))


def _exchanged(data: Sequence[Measurement], problem: Problem) -> Iterator[tuple[float, Suspect, int]]:
    """The measured columns of a set, a file, or all files in the order and with the signs that leave least; of how
    many. A set that was read with the other sign altogether is one of `_series`.
    """
    files = [file for file, measurement in enumerate(data) if measurement.kind == "tcp"]
    if not files:
        return
    readings = _Readings.of(data, problem)
    names = readings.problem.observations[files[0]].components
    files = [file for file in files if readings.problem.observations[file].components == names]
    size = len(names)
    ways = list(product(permutations(range(size)), product((1, -1), repeat=size)))[1:]
    parts = [("", [(file, np.ones(len(data[file]), dtype=bool))]) for file in files]
    if len(files) > 1:
        parts.append(("", [rows for _, (rows,) in parts]))
    for file in files:
        sets = list(dict.fromkeys(data[file].sets))
        rows_of = np.array(data[file].sets)
        parts += [(f"in set {name} ", [(file, rows_of == name)]) for name in sets[:MOST_SETS] if len(sets) > 1]
    for where, together in parts:
        tried = {}
        for order, signs in ways:
            if where and order == tuple(range(size)) and sum(signs) == -size:
                continue
            values = readings.problem.values.copy()
            for file, rows in together:
                part = values[_part(readings.problem, file)].reshape(-1, size)  # a view
                part[rows] = part[rows][:, order] * signs
            tried[order, signs] = readings.left(values)
        least = min(tried.values())
        changed = {
            way: sum(k != place or sign < 0 for k, (place, sign) in enumerate(zip(*way, strict=True)))
            for way, squares in tried.items()
            if squares <= ALIKE * least
        }
        way = min(changed, key=lambda way: (changed[way], tried[way]))
        first, look = together[0][0], _look(names, *way)
        yield tried[way], replace(look, text=where + look.text, file=first, measurement=data[first]), len(tried)


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
        observation = readings.problem.observations[file]
        there = np.array([each == name for each in data[file].sets])
        sign = np.ones(len(readings.problem.values))
        sign[_part(readings.problem, file)] = np.where((observation.rows >= 0) & there[observation.rows], -1.0, 1.0)
        signs[file, name] = sign
    values, least = readings.problem.values, readings.left(readings.problem.values)
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
        yield least, Suspect(text, OTHER_SIGN, file, data[file]), tries


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
