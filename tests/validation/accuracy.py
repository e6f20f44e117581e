"""What docs/accuracy.md says, worked out: `make accuracy` writes it.

    python tests/validation/accuracy.py [--draws N] [-o FILE]

Round trip: for each shipped machine and each kind of measurement the coefficients that this kind can tell are drawn at
random, measured with 1 um of noise, and estimated by the full exact calibration that starts from zero.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))

from measure.poses import NAMES, machine, perfect, plan  # noqa: E402
from ncfix.diagnostics import NcfixError  # noqa: E402
from ncfix.machine import Machine  # noqa: E402
from ncfix.measure.calibrate import calibrate  # noqa: E402
from ncfix.measure.selection import Selection  # noqa: E402
from ncfix.measure.synthetic import Faults, simulate  # noqa: E402

KINDS = {
    "tcp": "R-test, `tcp`",
    "tcp6": "pose, `tcp6`",
    "probe": "probed balls, `probe`",
    "bar": "ball-bar, `length`",
    "gauge": "length gauge, `length`",
    "tool": "tracker on the spindle, `points`",
    "table": "tracker on the table, `points`",
    "axis": "direct, `axis`",
}
ROWS = 250
LARGE = 0.05
"""mm: coefficients above this are those of powers that cancel."""
TEMPLATE = Path(__file__).with_name("accuracy_seeds.md")


def selection(known: Machine, kind: str) -> Selection:
    """The effects all of whose coefficients this kind of measurement can tell."""
    data = simulate(plan(known, kind, ROWS), known, Faults(noise_um=0.01))
    first = calibrate([data], perfect(known), loss="none")
    told, free, at = np.isfinite(first.sigma), [], 0
    for effect in known.effects:
        free.append(bool(told[at : at + effect.basis.size].all()))
        at += effect.basis.size
    return Selection(known.effects, tuple(free))


def drawn(chosen: Selection, known: Machine, random: np.random.Generator) -> Machine:
    """The machine with other curves: each effect times a normal number, and every coefficient changed by 20 %.

    Powers of high degree that cancel each other are only multiplied: changed one by one they would be metres.
    """
    values = []
    for effect in chosen.estimated:
        factor = random.standard_normal()
        large = max((abs(value) for value in effect.coefficients), default=0.0) > LARGE
        each = 1 + (0.0 if large else 0.2) * random.standard_normal(effect.basis.size)
        values += (factor * each * np.asarray(effect.coefficients)).tolist()
    return chosen.machine(known, values)


def round_trip(name: str, kind: str, draws: int) -> tuple[int, int, float, float, float, float] | None:
    """Coefficients, draws, share within 3 sigma, rms of the standardised errors, mean and spread of chi-square."""
    known = machine(name)
    try:
        chosen = selection(known, kind)
    except (NcfixError, ValueError):
        return None
    random, errors, squares = np.random.default_rng(1), [], []
    for draw in range(draws):
        real = drawn(chosen, known, random)
        start = chosen.machine(real, np.zeros(len(chosen.start)).tolist())
        data = simulate(plan(known, kind, ROWS), real, Faults(noise_um=1.0), seed=draw)
        found = calibrate([data], start, Selection(start.effects, chosen.free), loss="none")
        truth = np.concatenate([e.coefficients for e, free in zip(real.effects, chosen.free, strict=True) if free])
        covariance = replace(found, scale=1.0).sigma
        errors.append((found.estimate.coefficients - truth) / covariance)
        squares.append(found.chi_square)
    every = np.concatenate(errors)
    every = every[np.isfinite(every)]
    if not every.size:
        return None
    within = float((np.abs(every) < 3).mean())
    rms = float(np.sqrt((every**2).mean()))
    return len(chosen.start), draws, within, rms, float(np.mean(squares)), float(np.std(squares))


def table(draws: int) -> str:
    """The round trips as a table."""
    lines = [
        "| machine | measurement | coefficients | within 3 sigma | rms error / sigma | reduced chi-square |",
        "|---|---|---|---|---|---|",
    ]
    for name in NAMES:
        for kind, title in KINDS.items():
            found = round_trip(name, kind, draws)
            if found is None:
                lines.append(f"| {name} | {title} | - | sees none of this machine's errors | | |")
                continue
            size, _, within, rms, square, spread = found
            lines.append(
                f"| {name} | {title} | {size} | {100 * within:.2f} % | {rms:.3f} | {square:.3f} +- {spread:.3f} |"
            )
            print(lines[-1], file=sys.stderr, flush=True)
    return "\n".join(lines)


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--draws", type=int, default=200)
    parser.add_argument("-o", "--output", default=str(ROOT / "docs" / "accuracy.md"))
    options = parser.parse_args()
    text = TEMPLATE.read_text()
    page = text.replace("<!-- round trip -->", table(options.draws)).replace("<!-- draws -->", str(options.draws))
    Path(options.output).write_text(page)


if __name__ == "__main__":
    main()
