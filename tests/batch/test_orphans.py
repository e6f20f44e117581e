"""Whatever ends ncfix, nothing of it goes on: no process, no open pipe, no half of an output; `--resume` does the rest.

`NCFIX_MOMENTS=25` kills each kind of run so many times, spread over all that it does; else once. `NCFIX_KILLS=40
NCFIX_PROGRAMS=500` kills one batch of so many programs again and again.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import NamedTuple

import pytest

MOMENTS = int(os.environ.get("NCFIX_MOMENTS", "1"))
KILLS = int(os.environ.get("NCFIX_KILLS", "3"))
PROGRAMS = int(os.environ.get("NCFIX_PROGRAMS", "12"))
PATIENCE_S = 20.0
"""Far more than the others take to notice, on a computer that does much else."""
MACHINE = """
ncfix = 1
topology = "w F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [0, 500] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [0, 400] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-300, 0] }
effect = [{ name = "EXX", basis = "polynomial", degree = [1], coefficients = [1e-4] }]
"""

pytestmark = pytest.mark.skipif(not os.path.exists("/proc/self/environ"), reason="/proc says which processes are left")


class Kind(NamedTuple):
    """How work is shared out: `programs` of so many `blocks` each, and what is in the environment."""

    programs: int
    blocks: int
    environment: dict[str, str]


KINDS = {
    "a batch": Kind(PROGRAMS, 300, {}),
    "one long program": Kind(1, 12000, {"NCFIX_PART_BYTES": "20000"}),
}


@cache
def ground(title: str) -> Path:
    """A folder with a machine and the programs of a kind of run."""
    folder, kind = Path(mkdtemp(prefix="ncfix-orphans-")), KINDS[title]
    (folder / "machine.toml").write_text(MACHINE)
    (folder / "in").mkdir()
    for number in range(kind.programs):
        steps = (f"G1 X{10 + (7 * at + number) % 400}.{at % 10} Y{10 + 13 * at % 300}" for at in range(kind.blocks))
        (folder / "in" / f"p{number}.ngc").write_text("\n".join(["G21 G90 G94 F600", "G0 Z-1", *steps, "M2", ""]))
    return folder


def started(title: str, out: Path, mark: str, *more: str) -> subprocess.Popen[bytes]:
    folder, kind = ground(title), KINDS[title]
    command = [sys.executable, "-m", "ncfix", "fix", "in", "-m", "machine.toml", "--assume-zero", "--no-figures"]
    environment = {**os.environ, **kind.environment, "NCFIX_MARK": mark}
    out.mkdir(exist_ok=True)
    return subprocess.Popen(
        [*command, "-o", str(out / "out"), "--jobs", "3", *more],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )


@cache
def whole(title: str) -> tuple[dict[str, bytes], float]:
    """The outputs of a run that nobody stops, and how long it takes, s."""
    before, out = time.monotonic(), ground(title) / "whole"
    running = started(title, out, uuid.uuid4().hex)
    said, _ = running.communicate(timeout=300 + PROGRAMS)
    assert running.returncode == 0, said.decode()
    return contents(out / "out"), time.monotonic() - before


def contents(folder: Path) -> dict[str, bytes]:
    """The files of a folder, but what a batch notes for itself."""
    files = (path for path in folder.rglob("*") if path.is_file() and not path.name.startswith("."))
    return {path.name: path.read_bytes() for path in files}


def alive(mark: str) -> Iterator[int]:
    """The processes that were started with a mark, zombies apart."""
    for process in Path("/proc").iterdir():
        if process.name.isdecimal():
            try:
                if mark.encode() in (process / "environ").read_bytes():
                    yield int(process.name)
            except OSError:
                pass


def gone(mark: str, until: float) -> None:
    """Wait until none is alive; none is afterwards."""
    while (left := list(alive(mark))) and time.monotonic() < until:
        time.sleep(0.05)
    for process in left:
        os.kill(process, signal.SIGKILL)
    assert not left


@pytest.mark.parametrize("moment", range(MOMENTS))
@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL], ids=lambda how: how.name)
@pytest.mark.parametrize("title", KINDS)
def test_nothing_is_left(title: str, how: signal.Signals, moment: int) -> None:
    expected, lasts = whole(title)
    mark = uuid.uuid4().hex
    out = ground(title) / mark
    running = started(title, out, mark)
    time.sleep(lasts * (0.2 + 0.8 * (moment + 0.5) / MOMENTS))
    os.kill(running.pid, how)
    begun = time.monotonic()
    try:
        running.communicate(timeout=PATIENCE_S)  # until the pipe is closed by all who have it
    finally:
        gone(mark, begun + PATIENCE_S)
    assert contents(out / "out").items() <= expected.items()
    again = started(title, out, mark, "--resume")
    said, _ = again.communicate(timeout=300 + PROGRAMS)
    assert again.returncode == 0, said.decode()
    assert contents(out / "out") == expected
    gone(mark, time.monotonic() + PATIENCE_S)


def test_a_batch_that_is_killed_again_and_again_becomes_what_it_would_have_been() -> None:
    """Its parent is killed at random moments of the whole run, and each time `--resume` goes on with what is left."""
    expected, lasts = whole("a batch")
    rng, mark, early = random.Random(KILLS), uuid.uuid4().hex, 0
    out = ground("a batch") / mark
    for kill in range(KILLS):
        running = started("a batch", out, mark, *(["--resume"] if kill else []))
        time.sleep(rng.uniform(0.2, max(1.0, 2.0 * lasts / KILLS)))
        early += running.poll() is None
        running.kill()
        begun = time.monotonic()
        try:
            running.communicate(timeout=PATIENCE_S)
        finally:
            gone(mark, begun + PATIENCE_S)
        assert contents(out / "out").items() <= expected.items()
    again = started("a batch", out, mark, "--resume")
    said, _ = again.communicate(timeout=300 + PROGRAMS)
    assert again.returncode == 0, said.decode()
    assert contents(out / "out") == expected
    assert early > 0
    print(f"{PROGRAMS} programs, {KILLS} kills, {early} of them before the end, {lasts:.0f} s undisturbed")
