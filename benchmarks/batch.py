"""Time batches: one process, two, a Dask cluster of two workers; and the same batch again, of which nothing changed.

    python benchmarks/batch.py [--programs 2000] [--kills 20]      writes the tables into docs/performance.md

CPU seconds are those of the whole batch with its processes; those of the cluster's workers are their own. With --kills
workers of the cluster are killed at random moments of another run, each replaced by a new one.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import random
import re
import subprocess
import sys
import tempfile
import textwrap
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/performance.md"
BLOCKS = (20, 100, 300)
JOURNAL = ".ncfix-journal.jsonl"
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


def command_of(*more: str) -> list[str]:
    """The command of a batch."""
    machine = ROOT / "examples/machines/three_axis.toml"
    command = ["fix", "in", "-m", str(machine), "--assume-zero", "--resume", "-q", *more]
    return [sys.executable, "-m", "ncfix", *command]


def timed(folder: Path, *more: str) -> Timed:
    """A batch, in a process of its own."""
    before, began = os.times(), time.monotonic()
    subprocess.run(command_of(*more), cwd=folder, check=True)
    after = os.times()
    cpu = after.children_user + after.children_system - before.children_user - before.children_system
    return Timed(cpu, time.monotonic() - began)


class Cluster:
    """A scheduler and two workers of this computer, as processes of their own."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.file = folder, folder / "scheduler.json"
        self.scheduler = self._started("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-show")
        while not self.file.exists() or not self.file.read_text():
            time.sleep(0.1)
        self.workers = [self._worker() for _ in range(2)]
        from distributed import Client

        with Client(scheduler_file=str(self.file), set_as_default=False) as client:
            client.wait_for_workers(2, timeout=120)
            self.address = client.scheduler.address.replace("tcp://", "dask://")

    def _started(self, kind: str, *more: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", kind, "--scheduler-file", str(self.file), "--no-dashboard", *more]
        return subprocess.Popen(command, cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def _worker(self) -> subprocess.Popen[bytes]:
        return self._started("worker", "--nthreads", "1", "--no-nanny", "--host", "127.0.0.1")

    def replace(self, which: int) -> None:
        """Kill a worker, and start another one."""
        self.workers[which].kill()
        self.workers[which].wait()
        self.workers[which] = self._worker()

    def end(self) -> None:
        """Kill them all."""
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@contextmanager
def cluster(folder: Path) -> Iterator[Cluster]:
    """A cluster, and its end."""
    found = Cluster(folder)
    try:
        yield found
    finally:
        found.end()


def killed(folder: Path, count: int, kills: int) -> str:
    """Kill workers while a batch runs, and say what came of it; AssertionError if a program is lost or done twice."""
    chance, done = random.Random(2), 0
    out = folder / "killed"
    with cluster(folder) as found:
        command = command_of("--executor", found.address, "-o", "killed")
        running = subprocess.Popen(command, cwd=folder)
        for kill in range(kills):
            wanted = (kill + chance.random()) * 0.9 * count / kills
            while running.poll() is None and len(list(out.glob("*.ngc"))) < wanted:
                time.sleep(0.01)
            if running.poll() is not None:
                break
            found.replace(chance.randrange(2))
            done += 1
        code = running.wait()
    assert code == 0, code
    contents = [{path.name: path.read_bytes() for path in place.glob("*.ngc")} for place in (out, folder / "out1")]
    assert contents[0] == contents[1]
    assert len(contents[0]) == count
    records = [json.loads(line) for line in (out / JOURNAL).read_text().splitlines() if line]
    names = [record["name"] for record in records if "key" in record]
    assert len(names) == len(set(names)) == count
    rest = {path.name for path in out.iterdir()} - contents[0].keys() - {JOURNAL}
    assert not rest, rest
    return (
        f"{done} times a worker was killed in a batch of {count} programs on the cluster: all have the bytes of an "
        "undisturbed run, each is in the journal once, and no other file is left."
    )


def rows(folder: Path, count: int) -> Iterator[str]:
    """The rows of the table."""
    for jobs, name in ((1, "one process"), (2, "two processes")):
        found = timed(folder, "-j", str(jobs), "-o", f"out{jobs}")
        yield f"| {name} | {found.cpu:.1f} | {found.wall:.1f} | {count / found.wall:.0f} |"
    if find_spec("distributed"):
        with cluster(folder) as workers:
            found = timed(folder, "--executor", workers.address, "-o", "cluster")
        yield f"| a cluster of two workers | - | {found.wall:.1f} | {count / found.wall:.0f} |"
    found = timed(folder, "-j", "2", "-o", "out2")
    yield f"| two processes, again | {found.cpu:.2f} | {found.wall:.2f} | {count / found.wall:.0f} |"


def main() -> None:
    """Time, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--programs", type=int, default=2000)
    parser.add_argument("--kills", type=int, default=0)
    given = parser.parse_args()
    count = given.programs
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory(prefix="ncfix-batch-") as place:
        folder = Path(place)
        (folder / "in").mkdir()
        programs(folder / "in", count)
        found = list(rows(folder, count))
        (folder / "scheduler.json").unlink(missing_ok=True)
        proof = killed(folder, count, given.kills) if given.kills else ""
    head = f"{count} programs of {BLOCKS[0]} to {BLOCKS[-1]} blocks, {platform.machine()}, {os.cpu_count()} cores, "
    head += f"Python {platform.python_version()}, load {load:.0f} when it began."
    table = ["| | CPU s | wall s | programs/s |", "|---|---|---|---|", *found]
    below = textwrap.fill(proof, 120) + "\n\n" if proof else ""
    text = f"{MARKS[0]}\n{head}\n\n" + "\n".join(table) + f"\n\n{below}{MARKS[1]}"
    pattern = f"{re.escape(MARKS[0])}.*{re.escape(MARKS[1])}"
    PAGE.write_text(re.sub(pattern, lambda _: text, PAGE.read_text(), flags=re.DOTALL))


if __name__ == "__main__":
    main()
