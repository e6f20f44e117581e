"""Batches on a real Dask cluster of this computer: a scheduler and two workers, which are killed meanwhile."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cli.conftest import LONG_X, THREE_AXIS, ncfix
from conftest import FULL, PATIENCE_S, require_module, until
from ncfix.batch import cluster as clusters
from ncfix.batch.journal import JOURNAL, Journal
from ncfix.batch.work import executor_of, results_in_order
from ncfix.diagnostics import ExitCode, UsageError

__all__ = ["ncfix"]
KILLS = 20 if FULL else 2
COUNT = 8 + 2 * KILLS


@pytest.fixture(autouse=True)
def _distributed() -> None:
    require_module("distributed")


class Cluster:
    """A scheduler and workers as processes of their own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.file = folder / "scheduler.json"
        host = ("--host", "127.0.0.1")
        self.scheduler = self._started("scheduler", *host, "--port", "0", "--no-dashboard", "--no-show")
        until(lambda: self.file.exists() and bool(self.file.read_text()))
        self.workers = [self.worker() for _ in range(2)]

    @property
    def address(self) -> str:
        place: str = json.loads(self.file.read_text())["address"]
        return place.replace("tcp://", "dask://")

    def worker(self) -> subprocess.Popen[bytes]:
        more = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1")
        return self._started("worker", *more)

    def _started(self, kind: str, *more: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", kind, "--scheduler-file", str(self.file), *more]
        return subprocess.Popen(command, cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def end(self) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    (tmp_path / "dask").mkdir()
    found = Cluster(tmp_path / "dask")
    client = None
    try:
        client = clusters.ClusterExecutor.__new__(clusters.ClusterExecutor)
        client.address = found.address
        connected = client._connected(found.address.removeprefix("dask://"))
        connected.wait_for_workers(2, timeout=PATIENCE_S)
        connected.close()
        yield found
    finally:
        found.end()


@pytest.fixture
def parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "machine.toml").write_text(THREE_AXIS.format(effects=LONG_X))
    (tmp_path / "in").mkdir()
    for number in range(COUNT):
        steps = (f"G1 X{10 + (7 * at + number) % 400}.{at % 10} Y{10 + 13 * at % 300}" for at in range(300))
        text = "\n".join(["G21 G90 G94 F600", "G0 Z-1", *steps, "M2", ""])
        (tmp_path / "in" / f"p{number:02}.ngc").write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


COMMAND = ("fix", "in", "-m", "machine.toml", "--assume-zero", "--resume", "-o")


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != JOURNAL}


def started(*more: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "ncfix", *COMMAND, *more]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True)


def test_results_come_in_order_and_what_the_work_raises_is_raised(cluster: Cluster) -> None:
    executor = executor_of(cluster.address)
    assert list(results_in_order(abs, [-3, 2, -1], executor, 2, lambda task: task)) == [3, 2, 1]
    with pytest.raises(ValueError, match="x"):
        list(results_in_order(int, ["1", "x"], executor, 2, lambda task: -1))


def test_workers_are_killed_and_then_the_scheduler(ncfix: Any, parts: Path, cluster: Cluster) -> None:
    ncfix(*COMMAND, "whole")
    running = started("out", "--executor", cluster.address)
    for kill in range(KILLS):
        until(lambda: len(list(Path("out").glob("*.ngc"))) >= 2 + 2 * kill)  # noqa: B023  # at once
        cluster.workers[kill % 2].kill()
        if kill < KILLS - 1:
            cluster.workers[kill % 2].wait()
            cluster.workers[kill % 2] = cluster.worker()
    _, said = running.communicate(timeout=PATIENCE_S)
    assert running.returncode == ExitCode.DONE, said
    assert "distributed" not in said
    assert contents(parts / "out") == contents(parts / "whole")
    assert len(Journal("out").records) == COUNT

    running = started("second", "--executor", cluster.address)
    until(lambda: len(list(Path("second").glob("*.ngc"))) >= 2)
    os.kill(cluster.scheduler.pid, signal.SIGKILL)
    _, said = running.communicate(timeout=2 * PATIENCE_S)
    assert running.returncode == ExitCode.USAGE, said
    assert "NCF029" in said
    assert "distributed" not in said
    result = ncfix(*COMMAND, "second", "--json")
    assert result.code == ExitCode.DONE
    assert contents(parts / "second") == contents(parts / "whole")
    assert any(each.get("resumed") for each in result.json()["files"])


def test_a_cluster_that_is_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clusters, "CONNECT_S", 1)
    with pytest.raises(UsageError, match="there is no scheduler") as caught:
        executor_of("dask://127.0.0.1:9")(2)
    assert caught.value.code == "NCF029"


def test_without_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clusters, "find_spec", lambda name: None)
    with pytest.raises(UsageError, match=r"pip install 'ncfix\[cluster\]'"):
        executor_of("dask://127.0.0.1:9")
