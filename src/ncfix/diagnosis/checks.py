"""Checks that refuse data which do not support a diagnosis, and remarks on doubtful data."""

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
"""Smallest number of values beyond the number of free parameters."""
NEIGHBOURS = 60
"""Number of rows from which the noise can be estimated from neighbouring poses."""
STRANGE = 3e3
"""Implausible residual, um rms per mm of a large location error of this machine (`plausible.much`)."""
MOST_VALUES = 1800
"""Largest number of values of a diagnosis: work grows with their third power, memory with the second."""
STAYED = "`ncfix plan` proposes poses; a test of drift needs a column time_s, or temperatures"
CONTRADICTION = 1e-6
"""Probability by chance below which files contradict each other."""
MISSTATED = 2.0
"""Largest ratio, either way, of the scatter of repeats to the stated noise."""
STEADY_UM = 0.05
"""Standard deviation of repeats, um, below which lengths are probably in another unit. The best machining centres have
0.1 um (unidirectional repeatability of ISO 230-2, four sigma, of 0.4 um); values in inches read 25 times too small. Of
machines with 0.15 to 2 um, evenly in the logarithm, this catches eight of ten files in inches, all in metres, and none
in mm."""


def bounded(measurements: Sequence[Measurement]) -> list[Measurement]:
    """The measurements with at most `MOST_VALUES` values: a random sample of the largest files (NCF660).

    Small files stay whole, and repeats of a pose stay together. Evenly spaced rows might all be of one direction.
    """
    remaining, allowed = MOST_VALUES, {}
    sizes = [len(each) * len(each.measured) for each in measurements]
    for number, k in enumerate(sorted(range(len(sizes)), key=lambda k: sizes[k])):
        allowed[k] = min(sizes[k], remaining // (len(sizes) - number))
        remaining -= allowed[k]
    return [_drawn(each, allowed[k]) if allowed[k] < sizes[k] else each for k, each in enumerate(measurements)]


def _drawn(measurement: Measurement, most: int) -> Measurement:
    """A random sample of about `most` values of a measurement, repeats together, with remark NCF660."""
    state = np.asarray(states([measurement]))
    counts = np.bincount(state) * len(measurement.measured)
    order = np.random.default_rng(0).permutation(len(counts))
    chosen = np.zeros(len(counts), dtype=bool)
    chosen[order] = np.cumsum(counts[order]) - counts[order] < most
    rows = measurement.rows(chosen[state])
    text = (
        f"{measurement.path}: {len(rows)} of {len(measurement)} rows were used, drawn at random; more cannot be "
        "evaluated together"
    )
    return replace(rows, remarks=(*measurement.remarks, Message("NCF660", text)))


def before(measurements: Sequence[Measurement], machine: Machine) -> None:
    """Refuse data of a single pose or of unknown noise, before any fit. Raises `UsageError` NCF651, NCF652."""
    q = np.concatenate([each.positions(machine) for each in measurements])
    direct = any(each.kind in ("axis", "length") for each in measurements)
    if not direct and not any(each.stays for each in measurements) and float(np.ptp(q, axis=0).max(initial=0.0)) < 1e-3:
        raise UsageError.of("NCF651", f"all {len(q)} rows have the same pose", hint=STAYED)
    seen = Problem.of(measurements, machine, _nothing(machine))
    if not any(each.noise_known for each in seen.observations) and len(q) < NEIGHBOURS:
        text = (
            f"there are no repeats and no noise_um line, and {len(q)} rows are too few to estimate the noise from "
            "neighbouring poses"
        )
        raise UsageError.of("NCF652", text, hint="repeat ten poses a few times, or state the noise in the header")


def _nothing(machine: Machine) -> Selection:
    return Selection(machine.effects, (False,) * len(machine.effects))


def sensible(measurements: Sequence[Measurement], machine: Machine) -> None:
    """Refuse residuals too large for any machine of this kind. Raises `UsageError` NCF654."""
    now = misfit(measurements, machine)
    free = now.free
    if free > STRANGE * max(much(machine, f"EX0{axis.name}") for axis in machine.axes):
        text = f"after fitting the set-up, {free:.0f} um rms remain"
        raise UsageError.of(
            "NCF654", text, hint="check whether it is another machine, and whether columns are exchanged"
        )


def enough(data: ResidualData) -> None:
    """Refuse too few values for the unknowns. Raises `UsageError` NCF650."""
    free = int(np.linalg.matrix_rank(data.base))
    if len(data.y) < free + SPARE:
        text = f"{len(data.y)} values are too few: {free} unknowns of set-up and constants need at least {free + SPARE}"
        raise UsageError.of("NCF650", text, hint="measure more poses")


def agreeing(data: ResidualData, residual: Array, sigma: float, since: int = 0) -> None:
    """Refuse files of one date that contradict each other at common poses. Raises `UsageError` NCF656.

    residual  (m,) um; sigma: noise of a usual value, um
    since     index of the first file of the later date: what changed is no contradiction
    """
    if len(data.measurements) < 2:
        return
    apart, pairs = 0.0, 0
    q = np.round(data.q, 6)
    places: dict[tuple[bytes, float, str, bool], list[tuple[int, float]]] = {}
    length = data.column("tool_length")
    for value, row, name in zip(residual / data.relative, data.row, data.names, strict=True):
        if row >= 0:
            key = (q[row].tobytes(), float(length[row]), name, data.file[row] < since)
            places.setdefault(key, []).append((int(data.file[row]), float(value)))
    for found in places.values():
        by_file = {file: float(np.mean([v for f, v in found if f == file])) for file, _ in found}
        if len(by_file) > 1:
            values = list(by_file.values())
            apart += (values[0] - values[1]) ** 2 / (2 * sigma**2)
            pairs += 1
    if pairs > SPARE and float(chdtrc(pairs, apart)) < CONTRADICTION and apart > 4 * pairs:
        text = (
            f"{pairs} values were measured in two files, and differ by {np.sqrt(2 * apart / pairs):.1f} times the noise"
        )
        raise UsageError.of("NCF656", text, hint="diagnose the files one by one")


def _misstated(data: ResidualData) -> list[Message]:
    """Remark NCF659 if the scatter of repeats contradicts the stated noise."""
    squares, freedom = repeat_scatter(data, data.row >= 0)
    if freedom < ENOUGH_REPEATS or not data.noise_stated:
        return []
    seen = float(np.sqrt(squares / freedom))
    if 1 / MISSTATED < seen / data.sigma < MISSTATED:
        return []
    return [Message("NCF659", f"the files state a noise of {data.sigma:.2g} um, but repeats scatter by {seen:.2g} um")]


def _steady(data: ResidualData) -> Iterator[Message]:
    """Remarks NCF616 on files of lengths whose repeats agree better than any machine can."""
    for each in data.problem.observations:
        seen = float(np.median(each.um * each.sigma))
        if each.noise_known and not (each.noise_stated or each.turns.any()) and 0 < seen < STEADY_UM:
            text = f"{each.measurement.path}: repeats scatter by {seen:.2g} um only; no machine tool repeats so well"
            yield Message("NCF616", text, hint="are the values in metres or inches?")


def remarks(data: ResidualData, unheard_of: Sequence[str]) -> list[Message]:
    """Remarks on the data: directions that never change or are not stated, doubtful noise, unknown names."""
    found = []
    for axis in data.machine.axes:
        if silent := data.unstated(axis):
            text = f"{', '.join(silent)} does not state the direction of approach of {axis.name}, but other files do"
            found.append(Message("NCF658", f"{text}; its backlash is not among the candidates"))
    stated = {name for each in data.measurements for name in each.columns if name.startswith("dir_")}
    fixed = [axis.name for axis in data.machine.axes if data.measured.moved(axis) and f"dir_{axis.name}" in stated]
    fixed = [name for name in fixed if np.ptp(data.column(f"dir_{name}")) == 0]
    if fixed:
        text = f"{', '.join(fixed)} approached from one side only: backlash of {'it' if len(fixed) == 1 else 'them'}"
        found.append(Message("NCF653", f"{text} cannot show"))
    found += [*_misstated(data), *_steady(data)]
    found += [each for of in data.measurements for each in of.remarks if each.code == "NCF660"]
    found += [Message("NCF657", f"there is no effect {name!r} in the catalogue of this machine") for name in unheard_of]
    return found
