"""Ten million errors of the five-axis machine with 40 effects: poses per second.

    OMP_NUM_THREADS=1 python benchmarks/pose_errors.py [--poses 10000000] [--block 500000] [--json]

Three things of the engine, each for the same random poses: where the tip really is (`actual_tip`, the exact
composition), the whole error with its rotation (`error`), and for comparison the perfect machine (`tip`). The
time is that of the processor; drawing the poses is not in it. With columns of numpy, and with the compiled core.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from ncfix import core
from ncfix.machine import Machine, State, load

MACHINE = Path(__file__).with_name("five_axis.toml")
STATE = State(120.0)
Evaluated = Callable[[np.ndarray], np.ndarray]


def blocks(machine: Machine, poses: int, block: int) -> Iterator[np.ndarray]:
    """Random poses all over the travels, block by block."""
    random = np.random.default_rng(0)
    low, high = np.where(np.isfinite(machine.ranges.T), machine.ranges.T, [[-np.pi], [np.pi]])
    for start in range(0, poses, block):
        yield random.uniform(low, high, (min(block, poses - start), len(machine.axes)))


def measured(machine: Machine, evaluate: Evaluated, poses: int, block: int) -> float:
    """Poses per second of processor time, once the machine is compiled."""
    evaluate(next(blocks(machine, 1000, 1000)))
    spent = 0.0
    for q in blocks(machine, poses, block):
        start = time.process_time()
        evaluate(q)
        spent += time.process_time() - start
    return poses / spent


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--poses", type=int, default=10_000_000)
    parser.add_argument("--block", type=int, default=500_000)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    machine = load(MACHINE)
    ways: dict[str, Evaluated] = {
        "tip": lambda q: machine.tip(q, 120.0),
        "actual_tip": lambda q: machine.actual_tip(q, STATE),
        "error": lambda q: machine.error(q, STATE),
    }
    found = {}
    for name in ("plain", "compiled"):
        core.use(name)
        found[name] = {key: measured(machine, way, options.poses, options.block) for key, way in ways.items()}
    if options.json:
        print(json.dumps({"poses": options.poses, "effects": len(machine.effects), "poses_per_second": found}))
        return
    print(f"{options.poses:,} poses, {len(machine.axes)} axes, {len(machine.effects)} effects")
    for name, rates in found.items():
        for key, rate in rates.items():
            print(f"{name:>8} {key:>11} {rate / 1e6:8.2f} million poses/s {options.poses / rate:8.1f} s")


if __name__ == "__main__":
    main()
