"""`--jobs`: a number, or as many processes as pay."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from ncfix.cli import fix
from ncfix.cli.fix import AUTO, ON_ONE, PAYS_BYTES, PAYS_PROGRAMS, workers_for
from ncfix.cli.shop.batch import Batch
from ncfix.cli.targets import STREAM, OutputTarget
from ncfix.diagnostics import ExitCode

PROCESSORS = 12


@pytest.fixture(autouse=True)
def computer(monkeypatch: pytest.MonkeyPatch) -> None:
    """One with a dozen processors."""
    monkeypatch.setattr(fix, "processors", lambda: PROCESSORS)


def programs(folder: Path, count: int, size: int) -> list[OutputTarget]:
    """Programs of so many bytes, which take no room."""
    paths = [folder / f"{number}.nc" for number in range(count)]
    for path in paths:
        with path.open("wb") as file:
            file.truncate(size)
    return [OutputTarget(str(path), f"{path}.out") for path in paths]


@pytest.mark.parametrize(
    ("count", "size", "expected"),
    [
        (1, 1000, 1),
        (1, 2 * PAYS_BYTES - 1, 1),
        (1, 2 * PAYS_BYTES, 2),
        (1, 1000 * PAYS_BYTES, ON_ONE),
        (PAYS_PROGRAMS, 1000, 1),
        (2 * PAYS_PROGRAMS + 1, 1000, 2),
        (2, 3 * PAYS_BYTES, 2),
        (100 * PAYS_PROGRAMS, 1000, PROCESSORS),
    ],
)
def test_as_many_as_pay(count: int, size: int, expected: int, tmp_path: Path) -> None:
    assert workers_for(AUTO, programs(tmp_path, count, size), "processes") == expected


def test_what_is_asked_for_is_taken(tmp_path: Path) -> None:
    assert workers_for(3, programs(tmp_path, 1, 10), "processes") == 3


@pytest.mark.parametrize("source", [STREAM, "/no/such/program.nc"])
def test_what_cannot_be_measured_gets_one(source: str) -> None:
    assert workers_for(AUTO, [OutputTarget(source, "out.nc")], "processes") == 1


@pytest.mark.parametrize("word", ["0", "-1", "many", "1.5"])
def test_not_a_number_of_processes(word: str, ncfix: Any, shop: Any) -> None:
    result = ncfix("fix", shop.program, "-m", shop.machine, "-o", "-", "-j", word)
    assert result.code == ExitCode.USAGE
    assert "--jobs" in result.err


def test_without_jobs_a_long_program_is_shared_out(ncfix: Any, shop: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    run = Batch.run

    def noted(batch: Batch, jobs: int, make: Any) -> Any:
        asked.append(jobs)
        return run(batch, jobs, make)

    monkeypatch.setattr(Batch, "run", noted)
    monkeypatch.setattr(fix, "PAYS_BYTES", shop.program.stat().st_size // 5)
    call = ("fix", shop.program, "-m", shop.machine, "-o", "-", "--assume-zero")
    outputs = {ncfix(*call, *chosen).out for chosen in ([], ["--jobs", "auto"], ["-j", "1"])}
    assert asked == [5, 5, 1]
    assert len(outputs) == 1
    assert outputs != {b""}
