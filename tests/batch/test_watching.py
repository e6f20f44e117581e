"""Which programs of a folder are complete."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from ncfix.batch.watching import WatchedFolder, moments


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def watched(tmp_path: Path, clock: Clock) -> WatchedFolder:
    (tmp_path / "out").mkdir()
    return WatchedFolder(str(tmp_path), str(tmp_path / "out"), 2.0, clock)


def names(paths: list[str]) -> list[str]:
    return [os.path.basename(path) for path in paths]


def test_a_program_is_taken_when_it_has_not_changed_for_a_while(
    watched: WatchedFolder, clock: Clock, tmp_path: Path
) -> None:
    assert watched.complete() == []
    (tmp_path / "a.nc").write_text("G1 X1\n")
    assert watched.complete() == []
    clock.now = 1.9
    (tmp_path / "a.nc").write_text("G1 X1\nG1 X2\n")
    (tmp_path / "out" / "b.nc").write_text("an output\n")
    assert watched.complete() == []
    clock.now = 3.8
    assert watched.complete() == []
    clock.now = 3.9
    assert names(watched.complete()) == ["a.nc"]
    clock.now = 10.0
    assert watched.complete() == []


def test_it_is_taken_again_when_it_has_changed(watched: WatchedFolder, clock: Clock, tmp_path: Path) -> None:
    path = tmp_path / "a.nc"
    for text in ("G1 X1\n", "G1 X22\n"):
        path.write_text(text)
        watched.complete()
        clock.now += 2.0
        assert names(watched.complete()) == ["a.nc"]
    path.unlink()
    assert watched.complete() == []
    path.write_text("G1 X22\n")
    watched.complete()
    clock.now += 2.0
    assert names(watched.complete()) == ["a.nc"]
    watched.again()
    watched.complete()
    clock.now += 2.0
    assert names(watched.complete()) == ["a.nc"]


@pytest.mark.parametrize("poll_s", [0.01, None])
def test_there_is_always_a_next_moment(tmp_path: Path, poll_s: float | None) -> None:
    found = moments(str(tmp_path), [], 0.05, poll_s)
    for _ in range(3):
        next(found)
    found.close()
