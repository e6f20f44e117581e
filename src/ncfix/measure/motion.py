"""How the axes moved along a path that was measured on the way: speed, acceleration, reversals, as columns of the rows.

A ball-bar records a circle while the machine runs it. Rows of kind `length` about a centre with `feed_mm_min`, in the
order in which they were passed, say all that is asked: speed and acceleration of each linear axis, and how long ago it
turned round. What follows the speed is the drives' (lag, servo mismatch), and what fades after a reversal is friction.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ncfix.machine import Machine
from ncfix.measure.measurement import CENTRE, Array, Index, Measurement

FEWEST = 12
"""Rows of a circle."""
APART = 0.5
"""Of the radius: rows that are farther from the next ones are poses, no path."""
FLAT = 1e-3
"""An axis that moves less than this share of the others stands still."""
FADING_S = {"spike": 0.1, "settling": 0.4}
"""Seconds in which what friction does after a reversal fades, by the first word of the column."""


def with_motion(measurement: Measurement, machine: Machine) -> Measurement:
    """The measurement with columns of how the linear axes X Y Z moved, if its rows are circles run at a feed.

    speed_x_y  mm/s of X, the way its number grows, on circles in XY; zero on others
    accel_x_y  mm/s^2
    slave_x_y  speed_x_y where Y is faster, else zero
    spike_x, settling_x   the direction in which it moves, faded since it turned round
    dir_X      that direction, where the file does not say it
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


def _of_path(found: dict[str, Array], names: list[str], places: Array, feed: Array, rows: Index) -> None:
    """Fill in the columns of one set."""
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
