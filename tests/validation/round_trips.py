"""Round trips: errors drawn at random, measured with noise, estimated from zero; for all machines and instruments.

For each machine and kind of measurement there are ten sets of poses, each with as many draws: the coefficients that
these poses can tell are drawn at random, 250 rows are simulated with 1 um of noise and an unknown set-up, and the full
calibration on the exact model starts from zero. No two draws share poses and noise.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from measure.poses import NAMES, machine, perfect, plan
from ncfix.diagnostics import NcfixError
from ncfix.machine import Machine
from ncfix.measure.calibrate import calibrate
from ncfix.measure.instruments import Faults, simulate
from ncfix.measure.measurement import Measurement
from ncfix.measure.selection import Selection

MACHINES = (*NAMES, "angle_head")
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
SETS = 10
"""Sets of poses for each machine and kind; the draws are shared out among them."""
LARGE = 0.05
"""mm: coefficients above this are those of powers that cancel."""


@dataclass(frozen=True)
class Outcome:
    """What the draws of one machine and kind gave.

    sizes   coefficients that were estimated, for each set of poses
    errors  all estimates minus truth, in standard deviations as stated
    squares reduced chi-square of each draw
    """

    sizes: tuple[int, ...]
    errors: np.ndarray
    squares: np.ndarray

    @property
    def within(self) -> float:
        """The share of estimates within three standard deviations."""
        return float((np.abs(self.errors) < 3).mean())

    def row(self, name: str, title: str) -> str:
        """A row of the table."""
        low, high = min(self.sizes), max(self.sizes)
        size = f"{low}" if low == high else f"{low} to {high}"
        rms, mean, spread = np.sqrt((self.errors**2).mean()), self.squares.mean(), self.squares.std()
        figures = f"{100 * self.within:.2f} % | {rms:.3f} | {mean:.3f} +- {spread:.3f}"
        return f"| {name} | {title} | {size} | {len(self.errors)} | {figures} |"


def seed_of(*numbers: int) -> int:
    """A seed that no other numbers share."""
    return int(np.random.SeedSequence(numbers).generate_state(1)[0])


def selection(known: Machine, poses: Measurement) -> Selection:
    """The effects all of whose coefficients these poses can tell."""
    first = calibrate([simulate(poses, known, Faults(noise_um=0.01))], perfect(known), loss="none")
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


def one_draw(
    known: Machine, poses: Measurement, chosen: Selection, random: np.random.Generator
) -> tuple[np.ndarray, float]:
    """The standardised errors of one draw, and its reduced chi-square."""
    real = drawn(chosen, known, random)
    start = chosen.machine(real, np.zeros(len(chosen.start)).tolist())
    data = simulate(poses, real, Faults(noise_um=1.0), seed=int(random.integers(2**31)))
    found = calibrate([data], start, Selection(start.effects, chosen.free), loss="none")
    truth = np.concatenate([e.coefficients for e, free in zip(real.effects, chosen.free, strict=True) if free])
    # the stated noise is the true one: sigmas are not widened where a draw's residuals happen to be large
    return (found.estimate.coefficients - truth) / (found.sigma / found.scale), found.chi_square


def round_trip(name: str, kind: str, draws: int) -> Outcome | None:
    """The outcome for a machine and kind; None if this kind sees none of the machine's errors."""
    known, errors, squares, sizes = machine(name), [], [], []
    key = MACHINES.index(name), list(KINDS).index(kind)
    for number in range(min(SETS, draws)):
        random = np.random.default_rng(seed_of(*key, number))
        try:
            poses = plan(known, kind, ROWS, seed=number)
            chosen = selection(known, poses)
        except (NcfixError, ValueError):
            return None
        if not len(chosen.start):
            return None
        sizes.append(len(chosen.start))
        for _ in range(draws // min(SETS, draws)):
            error, square = one_draw(known, poses, chosen, random)
            errors.append(error)
            squares.append(square)
    return Outcome(tuple(sizes), np.concatenate(errors), np.array(squares))


def table(draws: int) -> str:
    """The round trips of all machines and kinds as a table, with the sum of all of them."""
    lines = [
        "| machine | measurement | coefficients | estimates | within 3 sigma | rms / sigma | reduced chi-square |",
        "|---|---|---|---|---|---|---|",
    ]
    every = []
    for name in MACHINES:
        for kind, title in KINDS.items():
            found = round_trip(name, kind, draws)
            if found is None:
                lines.append(f"| {name} | {title} | - | | | | |")
                continue
            every.append(found)
            lines.append(found.row(name, title))
            print(lines[-1], file=sys.stderr, flush=True)
    joined = Outcome(
        tuple(size for each in every for size in each.sizes),
        np.concatenate([each.errors for each in every]),
        np.concatenate([each.squares for each in every]),
    )
    return "\n".join([*lines, joined.row("all", "all")])
