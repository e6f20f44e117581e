"""The drilled plates of the shared measurements; `python tests/diagnose/plates.py` prints their table for the docs."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from scipy.special import fdtrc

from ncfix.diagnosis.diagnosis import Diagnosis, diagnose
from ncfix.machine import Machine, loads
from ncfix.measure.measurement import Array, Measurement
from ncfix.measure.reader import reads

CHANCE = 1e-6
"""A pattern that is rarer by chance is clear."""
PLATES = {
    "D2130A1": "D2130A1.csv",
    "D1396A1": "D1396A1.csv",
    "D1597A, 2003": "D1597A_orig_meas_2003.csv",
    "D8131": "D8131_1.csv",
}
MILL = """
ncfix = 1
name = "drilling machine"
topology = "w F X Y Z t"
[axis.X]
type = "linear"
direction = [1, 0, 0]
range = [-400, 400]
[axis.Y]
type = "linear"
direction = [0, 1, 0]
range = [-400, 400]
[axis.Z]
type = "linear"
direction = [0, 0, 1]
range = [-100, 100]
[tool]
direction = [0, 0, 1]
point = [0, 0, 0]
"""


def mill() -> Machine:
    """A three-axis mill of which nothing is known."""
    return loads(MILL)


def plate(folder: Path, name: str) -> Measurement:
    return reads((folder / PLATES[name]).read_bytes(), mill(), PLATES[name])


def plain(data: Measurement) -> tuple[float, float, float]:
    """Least squares: rms of both components, um, with the set-up, with one scale besides, with scales and shear."""
    x, y = data.columns["X"], data.columns["Y"]
    one, zero = np.ones_like(x), np.zeros_like(x)
    rigid = [(one, zero), (zero, one), (-y, x)]
    models = (rigid, [*rigid, (x, y)], [*rigid, (x, y), (x, -y), (y, x)])
    return tuple(_left(model, data) for model in models)  # type: ignore[return-value]


def _left(model: list[tuple[Array, Array]], data: Measurement) -> float:
    columns = np.column_stack([np.concatenate(pair) for pair in model])
    values = 1e3 * np.concatenate([data.columns["dx"], data.columns["dy"]])
    rest = values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]
    return float(np.sqrt((rest**2).mean()))


def clear_patterns(data: Measurement) -> list[str]:
    """Bows, bends and twists of either component that are no chance (F test, p below 1e-6), beside set-up and scales.

    Each by itself, on plain least squares; nothing of ncfix is used.
    """
    x, y = data.columns["X"], data.columns["Y"]
    u, v = (2 * (each - each.min()) / np.ptp(each) - 1 for each in (x, y))
    one, zero = np.ones_like(x), np.zeros_like(x)
    free = [(one, zero), (zero, one), (x, zero), (y, zero), (zero, x), (zero, y)]
    values = 1e3 * np.concatenate([data.columns["dx"], data.columns["dy"]])
    base = np.linalg.qr(np.column_stack([np.concatenate(pair) for pair in free]))[0]
    rest, found = values - base @ (base.T @ values), []
    for text, shape in (("XX", u**2), ("XXX", u**3), ("YY", v**2), ("YYY", v**3), ("XY", u * v)):
        for component, pair in (("dx", (shape, zero)), ("dy", (zero, shape))):
            column = np.concatenate(pair)
            column = column - base @ (base.T @ column)
            gain = float(column @ rest) ** 2 / float(column @ column)
            left = len(values) - base.shape[1] - 1
            ratio = gain / ((float(rest @ rest) - gain) / left)
            if fdtrc(1, left, ratio) < CHANCE:
                found.append(f"{component} by {text} (F = {ratio:.0f})")
    return found


def row(name: str, data: Measurement, found: Diagnosis) -> str:
    """A line of the table; the gaps of a hole's two components together, over the root of two."""
    gap = [
        f"{value / np.sqrt(2):.1f}" for value in (found.gap.holdout_before, found.gap.holdout_after, found.gap.floor)
    ]
    squares = " / ".join(f"{value:.1f}" for value in plain(data))
    names = ", ".join(each.candidate.name for each in found.findings) or "none"
    rest = f"{found.unknown_um / np.sqrt(2):.1f}"
    return f"| {name} | {len(data)} | {squares} | {found.verdict} | {names} | {rest} | {' | '.join(gap)} |"


def main() -> None:
    folder = Path(os.environ["NCFIX_SHARED"]) / "measurements"
    for name in PLATES:
        data = plate(folder, name)
        print(row(name, data, diagnose([data], mill())), "; ".join(clear_patterns(data)))


if __name__ == "__main__":
    main()
