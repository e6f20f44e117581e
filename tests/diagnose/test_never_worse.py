"""A machine that diagnose writes is not worse on held-out poses than the file as given; the truth is the benchmark's.

Where an axis lies is off in the file by more than axes move: measured by probing, it is the file's point that is put
right. A constant that is off by less is put right as a constant: readings held out of the fit are predicted better.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from tests.diagnose.resident import resident
from tests.hidden.candidate import Answer, ask
from tests.hidden.wrong import Case, build, line_place, point_300

from conftest import FULL

NOISE_UM = 0.7
"""What noise makes of deviations where a set-up was fitted to it."""


def gaps(kind: Callable[[Case], None], seed: int, folder: Path) -> tuple[Answer, float, float]:
    """The answer, and rms of the deviations on held-out poses that the given and the written file leave, um."""
    handed = build(kind, seed)
    for name, text in {**handed.files, "plan.csv": handed.plan}.items():
        (folder / name).write_text(text)
    program = resident()
    answer = ask(program, folder)
    given, written = folder / "machine.toml", answer.machine
    assert not answer.error
    assert written is not None
    before, after = (handed.gap(program.predict(each, folder / "plan.csv")) for each in (given, written))
    return answer, before, after


@pytest.mark.parametrize("seed", [1005, 1113] if FULL else [1005])
def test_a_point_that_is_off_in_the_file(seed: int, tmp_path: Path) -> None:
    answer, before, after = gaps(point_300, seed, tmp_path)
    first = answer.effects[0]
    assert first.name.startswith("pivot")
    assert answer.verdict == "ambiguous"
    assert sum(name.startswith("pivot") for name in first.aliases) == 1
    assert any(name.startswith("constant E") for name in first.aliases)
    assert "kind tcp" in first.title
    assert after < before + NOISE_UM


def test_an_axis_that_moved_as_axes_do(tmp_path: Path) -> None:
    answer, before, after = gaps(line_place, 1000, tmp_path)
    assert answer.effects[0].name == "constant EX0B"
    assert "correct the point" not in answer.raw["effects"][0]["remedy"], "deviations under the control tell"
    assert after < before / 10


def test_a_point_that_shows_as_little_as_axes_move(tmp_path: Path) -> None:
    """Only 0.03 mm of it show: no data of a probe tell whether the axis moved or the file's point is off."""
    answer, _, _ = gaps(point_300, 1003, tmp_path)
    assert answer.effects[0].name == "constant EX0C"
    assert "correct the point" in answer.raw["effects"][0]["remedy"]
    assert answer.raw["gap_um"]["holdout_after"] < answer.raw["gap_um"]["holdout_given"] / 2
