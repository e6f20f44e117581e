"""Candidates of the drives while axes move, on circles at a feed: servo mismatch, lag, reversal spikes, changeover.

A ball-bar records a circle while the machine runs it. Rows of kind `length` about a centre with `feed_mm_min`, in the
order of the path, give speed and acceleration of each linear axis, and the time since its reversal. Errors that follow
the speed are those of the drives (lag, servo mismatch); errors that fade after a reversal are friction. A machine file
describes positions at rest, so none of these is added to it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from ncfix.arrays import Array, Ints
from ncfix.diagnosis.catalogue.candidate import LETTERS, Candidate, MeasuredRange, along, zero
from ncfix.machine import Effect, Machine
from ncfix.machine.axes import Axis
from ncfix.machine.basis import Polynomial
from ncfix.measure.measurement import CENTRE, Measurement

# -- columns of how the axes moved -----------------------------------------------------------------------------------

FEWEST = 12
"""Smallest number of rows of a circle."""
APART = 0.5
"""Largest median distance of consecutive rows of a path, as a share of the radius; others are single poses."""
FLAT = 1e-3
"""An axis that moves by less than this share of the others stands still."""
FADING_S = {"spike": 0.1, "sticking": 0.2, "settling": 0.4}
"""Prefix of a column -> time constant, s, of the decay of friction errors after a reversal."""


def with_motion(measurement: Measurement, machine: Machine) -> Measurement:
    """The measurement with columns for the motion of X Y Z, if its rows are circles run at a feed.

    - speed_x_y: velocity of X, mm/s, on circles in XY; zero on others;
    - accel_x_y: acceleration of X, mm/s^2;
    - slave_x_y: speed_x_y where Y is faster, else zero;
    - spike_x, sticking_x, settling_x: direction of motion of X, decaying with the time since its reversal;
    - dir_X: direction of motion of X, unless the file states it.
    """
    if measurement.kind != "length" or not {*CENTRE, "feed_mm_min"} <= set(measurement.columns):
        return measurement
    names = [axis.name for axis in machine.axes if axis.name in "XYZ" and not axis.rotary]
    places = measurement.positions(machine)[:, [machine.axis_names.index(name) for name in names]]
    found = {key: np.zeros(len(places)) for name in names for key in _columns(name, names)}
    sets = np.array(measurement.sets)
    for each in dict.fromkeys(measurement.sets):
        rows = np.flatnonzero(sets == each)
        feed = measurement.column("feed_mm_min")[rows] / 60
        steps = np.linalg.norm(np.diff(places[rows], axis=0), axis=1)
        radius = float(np.median(measurement.column("radius")[rows]))
        if len(rows) < FEWEST or not feed.min() > 0 or np.median(steps) > APART * radius:
            return measurement
        _of_path(found, names, places[rows], feed, rows)
    stated = {name for name in measurement.columns if name.startswith("dir_")}
    return measurement.with_columns({key: values for key, values in found.items() if key not in stated})


def _columns(name: str, names: Sequence[str]) -> Iterator[str]:
    low = name.lower()
    yield from (f"{word}_{low}" for word in FADING_S)
    yield f"dir_{name}"
    yield from (
        f"{word}_{low}_{each.lower()}" for word in ("speed", "accel", "slave") for each in names if each != name
    )


def _of_path(found: dict[str, Array], names: list[str], places: Array, feed: Array, rows: Ints) -> None:
    """Fill in the columns `found` for the rows of one set.

    places  (n, axes) positions of the axes `names`, mm; feed (n,) mm/s; rows: indices of these rows
    """
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    time = np.concatenate([[0.0], np.cumsum(steps / (0.5 * (feed[1:] + feed[:-1])))])
    moving = np.flatnonzero(np.concatenate([[True], steps > 1e-6]))
    slopes = np.stack([np.interp(way, way[moving], np.gradient(x[moving], way[moving])) for x in places.T], axis=1)
    plane = [k for k in range(len(names)) if np.ptp(places[:, k]) > FLAT * np.ptp(places)]
    for k, name in enumerate(names):
        slope, low = slopes[:, k], name.lower()
        sign = np.sign(np.where(np.abs(slope) < 1e-9, 0.0, slope))
        bend = np.interp(way, way[moving], np.gradient(slope[moving], way[moving]))
        for other in plane if k in plane and len(plane) == 2 else ():
            if other != k:
                pair = f"{low}_{names[other].lower()}"
                found[f"speed_{pair}"][rows] = slope * feed
                found[f"accel_{pair}"][rows] = bend * feed**2
                found[f"slave_{pair}"][rows] = np.where(np.abs(slope) < np.abs(slopes[:, other]), slope * feed, 0.0)
        found[f"dir_{name}"][rows] = sign
        since, turned = np.full(len(places), np.inf), np.flatnonzero((sign[1:] * sign[:-1] < 0) | (sign[1:] == 0))
        for at in turned:  # between two rows: where the slope passes zero
            share = slope[at] / (slope[at] - slope[at + 1]) if slope[at] != slope[at + 1] else 1.0
            moment = time[at] + share * (time[at + 1] - time[at])
            since[at + 1 :] = time[at + 1 :] - moment
        for word, fading in FADING_S.items():
            found[f"{word}_{low}"][rows] = sign * np.exp(-since / fading)


# -- what they tell ----------------------------------------------------------------------------------------------------

SPEED, ACCELERATION = 50.0, 50.0
"""Scales of speed, mm/s, and acceleration, mm/s^2, in effects; the results do not depend on them."""
GROWING = 0.3
"""Standard deviation of the relative change of a spike from the middle to the end of the travel."""


def dynamic_candidates(measured: MeasuredRange) -> Iterator[Candidate]:
    """Candidates of the drives, if circles were run at a feed."""
    for axis in measured.linear:
        if f"spike_{axis.name.lower()}" in measured.columns:
            yield from _spikes(measured, axis)
    for first, second in combinations(measured.linear, 2):
        if f"speed_{first.name.lower()}_{second.name.lower()}" in measured.columns:
            yield from _pair(first, second)


def _spikes(measured: MeasuredRange, axis: Axis) -> Iterator[Candidate]:
    own = along(axis)
    if own is None:
        return
    name, low = f"E{LETTERS[own]}{axis.name}", axis.name.lower()
    effects = []
    for word in FADING_S:
        effects.append(Effect(name, (), Polynomial(degree=(1,)), input=f"{word}_{low}"))
        effects.append(Effect(name, (), Polynomial(degree=(1,)), input=f"{word}_{low}", **measured.factor(axis)))
    loadings = tuple(np.eye(len(effects))[:, 2 * k : 2 * k + 2] * [1.0, GROWING] for k in range(len(FADING_S)))
    title = f"reversal spikes of {axis.name}: it sticks for a moment where it reverses"
    remedy = "adjust the friction compensation (quadrant) of the drive; lubricate"
    needs = tuple(f"{word}_{low}" for word in FADING_S)
    yield Candidate(
        f"reversal spikes {axis.name}", title, axis.name, f"{axis.name} reversal", zero(effects), loadings, needs,
        remedy, dynamic=True,
    )  # fmt: skip


def _pair(first: Axis, second: Axis) -> Iterator[Candidate]:
    """Candidates of a pair of axes: equal lag shrinks circles with the feed; unequal lag makes them oval at 45 degrees;
    a larger lag of the slower axis makes steps at 45 degrees.
    """
    names = [f"E{LETTERS[own]}{axis.name}" for axis in (first, second) if (own := along(axis)) is not None]
    if len(names) < 2:
        return
    pair, family = f"{first.name}{second.name}", f"{first.name}{second.name} drives"
    # the body of a workpiece-side axis moves against its positive direction
    sense = [float(np.asarray(a.error_axes[along(a) or 0]) @ np.asarray(a.direction)) for a in (first, second)]
    for kind, word, size, signs, title, remedy in (
        ("servo mismatch", "speed", SPEED, (1.0, -1.0), "one lags more than the other: circles are oval at 45 degrees, "
         "in the opposite sense of travel at -45 degrees", "make the gains of both position loops alike"),
        ("lag", "accel", ACCELERATION, (1.0, 1.0), "both lag equally: circles become smaller with the feed",
         "raise gain or feedforward in both position loops"),
        ("master-slave changeover", "slave", SPEED, (1.0, 1.0), "the slower axis lags more: steps at 45 degrees, where "
         "the other one becomes the slower", "use a control that leads both axes equally"),
    ):  # fmt: skip
        low = first.name.lower(), second.name.lower()
        needs = (f"{word}_{low[0]}_{low[1]}", f"{word}_{low[1]}_{low[0]}")
        effects = zero(
            [
                Effect(name, (), Polynomial(degree=(1,)), scale=size, input=need)
                for name, need in zip(names, needs, strict=True)
            ]
        )
        loading = (np.array(signs) * np.array(sense))[:, None]
        yield Candidate(
            f"{kind} {pair}", f"{kind} of {first.name} and {second.name}: {title}", "", family, effects, (loading,),
            needs, remedy, dynamic=True,
        )  # fmt: skip
