"""Data that cannot carry a diagnosis: said in plain words, and no name is given."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import chdtrc

from ncfix.arrays import Array
from ncfix.diagnosis.noise import ENOUGH_REPEATS, repeat_scatter, states
from ncfix.diagnosis.residual_data import ResidualData, misfit
from ncfix.diagnostics import Message, UsageError
from ncfix.machine import Machine
from ncfix.machine.plausible import much
from ncfix.measure.estimate import Problem
from ncfix.measure.measurement import Measurement
from ncfix.measure.selection import Selection

SPARE = 12
"""Values that must be left beside what is free."""
NEIGHBOURS = 60
"""Rows from which on neighbouring poses tell the noise."""
STRANGE = 3e3
"""Residuals, rms um, that no machine has, per mm of what is much of where an axis lies (an arm errs more)."""
MOST_VALUES = 1800
"""Values that are weighed together: work grows with their third power, memory with the second."""
STAYED = "`ncfix plan` proposes poses; a test of drift needs a column time_s or temperatures"
CONTRADICTION = 1e-6
MISSTATED = 2.0
"""Times by which repeats may scatter more or less than the noise that is stated."""
STEADY_UM = 0.05
"""Standard deviation of repeats below which lengths are in another unit. Of the best machining centres it is 0.1 um (a
unidirectional repeatability of ISO 230-2, four of them, of 0.4 um), and in inches it reads 25 times less than it is. So
of machines that come back within 0.15 to 2 um, evenly in the logarithm, eight of ten are caught, and none that is
right; of readings in metres all are."""


def bounded(measurements: Sequence[Measurement]) -> list[Measurement]:
    """No more rows than can be weighed together: of the largest files some drawn at random, repeats together (NCF660).

    Small files stay whole beside large ones. Evenly spaced rows might be all of one direction.
    """
    left, most = MOST_VALUES, {}
    sizes = [len(each) * len(each.measured) for each in measurements]
    for done, k in enumerate(sorted(range(len(sizes)), key=lambda k: sizes[k])):
        most[k] = min(sizes[k], left // (len(sizes) - done))
        left -= most[k]
    return [_drawn(each, most[k]) if most[k] < sizes[k] else each for k, each in enumerate(measurements)]


def _drawn(measurement: Measurement, most: int) -> Measurement:
    """About so many values of it."""
    state = np.asarray(states([measurement]))
    counts = np.bincount(state) * len(measurement.measured)
    order = np.random.default_rng(0).permutation(len(counts))
    chosen = np.zeros(len(counts), dtype=bool)
    chosen[order] = np.cumsum(counts[order]) - counts[order] < most
    rows = measurement.rows(chosen[state])
    text = f"{measurement.path}: of {len(measurement)} rows {len(rows)} were drawn, more cannot be weighed together"
    return replace(rows, remarks=(*measurement.remarks, Message("NCF660", text)))


def before(measurements: Sequence[Measurement], machine: Machine) -> None:
    """Refuse what can be told without computing: one pose, no noise. Raises `UsageError` NCF651, NCF652."""
    q = np.concatenate([each.positions(machine) for each in measurements])
    direct = any(each.kind in ("axis", "length") for each in measurements)
    if not direct and not any(each.stays for each in measurements) and float(np.ptp(q, axis=0).max(initial=0.0)) < 1e-3:
        raise UsageError.of("NCF651", f"all {len(q)} rows are of one pose", hint=STAYED)
    seen = Problem.of(measurements, machine, _nothing(machine))
    if not any(each.noise_known for each in seen.observations) and len(q) < NEIGHBOURS:
        text = f"neither repeats nor a noise_um line, and {len(q)} rows are too few to tell the noise from neighbours"
        raise UsageError.of("NCF652", text, hint="repeat ten poses a few times, or state the noise in the header")


def _nothing(machine: Machine) -> Selection:
    return Selection(machine.effects, (False,) * len(machine.effects))


def sensible(measurements: Sequence[Measurement], machine: Machine) -> None:
    """Refuse what no mistake explains. Raises `UsageError` NCF654."""
    now = misfit(measurements, machine)
    free = now.free
    if free > STRANGE * max(much(machine, f"EX0{axis.name}") for axis in machine.axes):
        text = f"{free:.0f} um rms are left after the set-up was fitted"
        raise UsageError.of("NCF654", text, hint="a measurement of another machine, or exchanged columns?")


def enough(data: ResidualData) -> None:
    """Refuse too few values for the unknowns. Raises `UsageError` NCF650."""
    free = int(np.linalg.matrix_rank(data.base))
    if len(data.y) < free + SPARE:
        text = f"{len(data.y)} values, and {free} unknowns of set-up and constants need {free + SPARE} or more"
        raise UsageError.of("NCF650", text, hint="measure more poses")


def agreeing(data: ResidualData, residual: Array, sigma: float) -> None:
    """Refuse files that differ where they measured the same. Raises `UsageError` NCF656."""
    if len(data.measurements) < 2:
        return
    apart, pairs = 0.0, 0
    q = np.round(data.q, 6)
    places: dict[tuple[bytes, float, str], list[tuple[int, float]]] = {}
    length = data.column("tool_length")
    for value, row, name in zip(residual / data.relative, data.row, data.names, strict=True):
        if row >= 0:
            key = (q[row].tobytes(), float(length[row]), name)
            places.setdefault(key, []).append((int(data.file[row]), float(value)))
    for found in places.values():
        by_file = {file: float(np.mean([v for f, v in found if f == file])) for file, _ in found}
        if len(by_file) > 1:
            values = list(by_file.values())
            apart += (values[0] - values[1]) ** 2 / (2 * sigma**2)
            pairs += 1
    if pairs > SPARE and float(chdtrc(pairs, apart)) < CONTRADICTION and apart > 4 * pairs:
        text = (
            f"{pairs} values were measured by two files and differ by {np.sqrt(2 * apart / pairs):.1f} times the noise"
        )
        raise UsageError.of("NCF656", text, hint="diagnose the files one by one")


def _misstated(data: ResidualData) -> list[Message]:
    """A noise that the files state and that repeats deny."""
    squares, freedom = repeat_scatter(data, data.row >= 0)
    if freedom < ENOUGH_REPEATS or not data.noise_stated:
        return []
    seen = float(np.sqrt(squares / freedom))
    if 1 / MISSTATED < seen / data.sigma < MISSTATED:
        return []
    return [Message("NCF659", f"the files state {data.sigma:.2g} um of noise, repeats scatter by {seen:.2g} um")]


def _steady(data: ResidualData) -> Iterator[Message]:
    """Files of lengths whose repeats agree as those of no machine do."""
    for each in data.problem.observations:
        seen = float(np.median(each.um * each.sigma))
        if each.noise_known and not (each.noise_stated or each.turns.any()) and 0 < seen < STEADY_UM:
            text = f"{each.measurement.path}: repeats scatter by {seen:.2g} um, no machine tool comes back so well"
            yield Message("NCF616", text, hint="are the values in metres or inches?")


def remarks(data: ResidualData, unheard_of: Sequence[str]) -> list[Message]:
    """What the user should know: directions that never change or are not said, names that do not exist."""
    found = []
    for axis in data.machine.axes:
        if silent := data.unstated(axis):
            text = f"{', '.join(silent)} does not say from where {axis.name} came, other files do"
            found.append(Message("NCF658", f"{text}: its backlash and play are not among the candidates"))
    stated = {name for each in data.measurements for name in each.columns if name.startswith("dir_")}
    fixed = [axis.name for axis in data.machine.axes if data.measured.moved(axis) and f"dir_{axis.name}" in stated]
    fixed = [name for name in fixed if np.ptp(data.column(f"dir_{name}")) == 0]
    if fixed:
        text = f"{', '.join(fixed)} came from one side only: backlash and play of {'it' if len(fixed) == 1 else 'them'}"
        found.append(Message("NCF653", f"{text} cannot show"))
    found += [*_misstated(data), *_steady(data)]
    found += [each for of in data.measurements for each in of.remarks if each.code == "NCF660"]
    found += [Message("NCF657", f"there is no effect {name!r} in the catalogue of this machine") for name in unheard_of]
    return found
