"""Time batches: one process, two, a Dask cluster of two workers; and the same batch again, of which nothing changed.

    python benchmarks/batch.py [--programs 2000]      writes the table into docs/performance.md

CPU seconds are those of the whole batch with its processes; those of the cluster's workers are their own.
"""

from __future__ import annotations

import argparse
import os
import platform
import random
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/performance.md"
BLOCKS = (20, 100, 300)
MARKS = "<!-- batches: written by `make batch` -->\n", "<!-- end of batches -->"


class Timed(NamedTuple):
    """CPU and wall time, s."""

    cpu: float
    wall: float


def programs(folder: Path, count: int) -> None:
    """Programs of some ten to some hundred blocks, always the same."""
    chance = random.Random(1)
    for number in range(count):
        blocks = chance.choice(BLOCKS)
        steps = (f"G1 X{10 + (7 * at + number) % 200}.{at % 10} Y{10 + 13 * at % 200}" for at in range(blocks))
        text = "\n".join(["G21 G90 G94 G17 F600", "G0 Z-1", *steps, "M2", ""])
        (folder / f"p{number:05}.ngc").write_text(text)


def timed(folder: Path, *more: str) -> Timed:
    """A batch, in a process of its own."""
    machine = ROOT / "examples/machines/three_axis.toml"
    command = ["fix", "in", "-m", str(machine), "--assume-zero", "--resume", "-q", *more]
    before, began = os.times(), time.monotonic()
    subprocess.run([sys.executable, "-m", "ncfix", *command], cwd=folder, check=True)
    after = os.times()
    cpu = after.children_user + after.children_system - before.children_user - before.children_system
    return Timed(cpu, time.monotonic() - began)


@contextmanager
def cluster(folder: Path) -> Iterator[str]:
    """A scheduler and two workers; the address."""
    file = folder / "scheduler.json"

    def started(kind: str, *more: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", kind, "--scheduler-file", str(file), "--no-dashboard", *more]
        return subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    running = [started("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-show")]
    try:
        while not file.exists() or not file.read_text():
            time.sleep(0.1)
        running += [started("worker", "--nthreads", "1", "--no-nanny", "--host", "127.0.0.1") for _ in range(2)]
        from distributed import Client

        with Client(scheduler_file=str(file), set_as_default=False) as client:
            client.wait_for_workers(2, timeout=120)
            address = client.scheduler.address
        yield address.replace("tcp://", "dask://")
    finally:
        for process in reversed(running):
            process.kill()
            process.wait()


def rows(folder: Path, count: int) -> Iterator[str]:
    """The rows of the table."""
    for jobs, name in ((1, "one process"), (2, "two processes")):
        found = timed(folder, "-j", str(jobs), "-o", f"out{jobs}")
        yield f"| {name} | {found.cpu:.1f} | {found.wall:.1f} | {count / found.wall:.0f} |"
    if find_spec("distributed"):
        with cluster(folder) as address:
            found = timed(folder, "--executor", address, "-o", "cluster")
        yield f"| a cluster of two workers | - | {found.wall:.1f} | {count / found.wall:.0f} |"
    found = timed(folder, "-j", "2", "-o", "out2")
    yield f"| two processes, again | {found.cpu:.2f} | {found.wall:.2f} | {count / found.wall:.0f} |"


def main() -> None:
    """Time, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--programs", type=int, default=2000)
    count = parser.parse_args().programs
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory(prefix="ncfix-batch-") as place:
        folder = Path(place)
        (folder / "in").mkdir()
        programs(folder / "in", count)
        found = list(rows(folder, count))
    head = f"{count} programs of {BLOCKS[0]} to {BLOCKS[-1]} blocks, {platform.machine()}, {os.cpu_count()} cores, "
    head += f"Python {platform.python_version()}, load {load:.0f} when it began."
    table = ["| | CPU s | wall s | programs/s |", "|---|---|---|---|", *found]
    text = f"{MARKS[0]}\n{head}\n\n" + "\n".join(table) + f"\n\n{MARKS[1]}"
    pattern = f"{re.escape(MARKS[0])}.*{re.escape(MARKS[1])}"
    PAGE.write_text(re.sub(pattern, lambda _: text, PAGE.read_text(), flags=re.DOTALL))


if __name__ == "__main__":
    main()
