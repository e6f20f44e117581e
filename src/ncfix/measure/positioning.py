"""Figures of ISO 230-2 and 230-3 for error motions read directly, run by run and from both sides (kind `axis`)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ncfix.measure.checks import component_of
from ncfix.measure.measurement import Array, Measurement, groups

RUNS = 2
"""With fewer runs at any place there is no repeatability."""
K = 2.0
"""Standard deviations of a band."""


@dataclass(frozen=True, slots=True)
class Positioning:
    """One error motion in one set; um, or urad for angles. From both sides unless only one was measured.

    A  accuracy: the band of means and twice the standard deviations
    R  repeatability: the largest band at one place, both sides; NaN with less than two runs
    E  systematic deviation: the range of all means; M the range of the means of both sides
    B  largest reversal; mean_reversal: over all places; NaN if one side only was measured

    Values are errors of the body along the base axes: of a table axis, whose body goes towards minus as its number
    grows, the mean reversal has another sign than that of its deviations.
    """

    component: str
    name: str
    A: float
    R: float
    E: float
    M: float
    B: float
    mean_reversal: float


def figures(measurement: Measurement) -> Iterator[Positioning]:
    """The figures of each component and set of direct readings; nothing for other kinds."""
    if measurement.kind != "axis" or "value" not in measurement.columns:
        return
    pairs = zip(measurement.labels["axis"], measurement.labels["component"], strict=True)
    names = [component_of(axis, component) or component for axis, component in pairs]
    keys, index = groups([f"{name}\n{group}" for name, group in zip(names, measurement.sets, strict=True)])
    for k, key in enumerate(keys):
        rows = index == k
        component, name = key.split("\n")
        unit = 1e6 if component[1] in "ABC" else 1e3
        value = unit * measurement.columns["value"][rows]
        side = measurement.column("direction")[rows]
        yield _figures(component, name, measurement.columns["position"][rows], side, value)


def _figures(component: str, name: str, position: Array, side: Array, value: Array) -> Positioning:
    places = np.unique(position)
    sides = [each for each in (1.0, -1.0) if (side == each).any()] or [0.0]
    mean = np.full((len(sides), len(places)), np.nan)
    sigma = np.full_like(mean, np.nan)
    for i, each in enumerate(sides):
        for j, place in enumerate(places):
            found = value[(side == each) & (position == place)]
            mean[i, j] = found.mean() if len(found) else np.nan
            sigma[i, j] = found.std(ddof=1) if len(found) >= RUNS else np.nan
    reversal = mean[0] - mean[1] if len(sides) == 2 else np.full(len(places), np.nan)
    centre = mean.mean(axis=0)
    spread = np.nan_to_num(sigma)
    accuracy = float(np.nanmax(mean + K * spread) - np.nanmin(mean - K * spread))
    return Positioning(
        component,
        name,
        accuracy if np.isfinite(sigma).any() else float("nan"),
        _repeatability(sigma, reversal),
        float(np.nanmax(mean) - np.nanmin(mean)),
        float(np.nanmax(centre) - np.nanmin(centre)) if np.isfinite(centre).any() else float("nan"),
        float(np.nanmax(np.abs(reversal))) if np.isfinite(reversal).any() else float("nan"),
        float(np.nanmean(reversal)) if np.isfinite(reversal).any() else float("nan"),
    )


def _repeatability(sigma: Array, reversal: Array) -> float:
    """The largest of 4 s from one side and of 2 s + 2 s + |B| from both."""
    if not np.isfinite(sigma).any():
        return float("nan")
    bands = [*(2 * K * each for each in sigma)]
    if len(sigma) == 2:
        bands.append(K * sigma.sum(axis=0) + np.abs(reversal))
    return float(np.nanmax(np.concatenate(bands)))
