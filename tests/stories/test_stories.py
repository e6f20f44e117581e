"""Stories end as they say, and show what their commands print."""

from __future__ import annotations

import re
import shutil
import tomllib
from pathlib import Path

import pytest

from stories.story import Step, alike, headlines, run, steps, written_anew

STORIES = ("worn_table", "laspas", "size_conflict", "robot")


def test_all_stories_are_told(root: Path) -> None:
    assert {path.parent.name for path in (root / "examples" / "stories").glob("*/README.md")} == set(STORIES)


def rms_um(script: list[tuple[Step, list[str]]], program: str) -> tuple[float, float]:
    """Before and after, as `verify` says it of a corrected program against the true machine."""
    [lines] = [printed for step, printed in script if "verify" in step.command and f" {program} " in step.command]
    before, after = (float(re.search(r"rms ([\d.]+) um", line)[1]) for line in lines[:2])
    return before, after


def added(folder: Path) -> str:
    """What the diagnosis added to the machine file."""
    return tomllib.loads((folder / "found.toml").read_text())["provenance"]["added"]


def the_worn_table_is_named_and_the_part_gets_better(folder: Path, script: list[tuple[Step, list[str]]]) -> None:
    assert added(folder) == "wobble C"
    (before, spring), (_, autumn) = (rms_um(script, name) for name in ("spring.nc", "autumn.nc"))
    assert spring < before
    assert autumn < 0.25 * spring  # 1.5 um of noise at 180 poses leave some tenths of the tilt's curve unknown


def the_reversal_of_z_is_named_and_its_step_goes(folder: Path, script: list[tuple[Step, list[str]]]) -> None:
    assert "backlash Z: backlash of Z: lost motion at reversal" in script[0][1]
    effects = tomllib.loads((folder / "found.toml").read_text())["effect"]
    [size] = [each["coefficients"][0] for each in effects if each.get("basis") == "backlash"]
    assert size == pytest.approx(0.015553, abs=4 * 0.00022)  # four times the sigma that calibrate states
    (_, model), (_, found) = (rms_um(script, name) for name in ("model.nc", "found.nc"))
    assert found < 0.1 * model


def joints_that_yield_are_named_and_other_poses_are_at_the_noise(
    folder: Path, script: list[tuple[Step, list[str]]]
) -> None:
    assert added(folder).startswith("compliance K, compliance L, encoder J")
    [last] = [line for line in script[-1][1] if line.startswith("verdict:")]
    assert last.startswith("verdict: nothing-missing")


ENDS = {
    "robot": joints_that_yield_are_named_and_other_poses_are_at_the_noise,
    "worn_table": the_worn_table_is_named_and_the_part_gets_better,
    "laspas": the_reversal_of_z_is_named_and_its_step_goes,
    "size_conflict": lambda folder, script: None,
}


@pytest.mark.parametrize("name", STORIES)
def test_what_is_shown_is_what_is_printed_and_it_ends_as_it_says(name: str, tmp_path: Path, root: Path) -> None:
    """Else: `python -m tests.stories` writes the READMEs anew. Of a diagnosis verdict and names are compared."""
    folder = tmp_path / name
    shutil.copytree(root / "examples" / "stories" / name, folder)
    script = [(step, run(step.command, folder)) for step in steps((folder / "README.md").read_text())]
    for step, printed in script:
        if step.command.startswith("ncfix diagnose"):
            assert headlines(printed) == headlines(step.shown)
        else:
            assert alike(step.shown, printed), f"{step.command}\n" + "\n".join(printed)
    ENDS[name](folder, script)


def test_steps_are_read() -> None:
    text = "a\n\n```console\n$ ncfix one -o x\nline\n\n$ ncfix two\n```\n\n```\n$ no\n```\n"
    assert list(steps(text)) == [Step("ncfix one -o x", ("line",)), Step("ncfix two", ())]


def test_headlines_of_a_diagnosis() -> None:
    text = [
        "verdict: found: words",
        "gap: 1 um",
        "",
        "wobble C: wobble of C",
        "  12 um rms, log odds 4",
        "where:",
        "  dx: a",
    ]
    assert headlines(text) == ["verdict: found", "wobble C: wobble of C"]


def test_words_must_agree_and_figures_nearly() -> None:
    assert alike(("gap 11.35 um (given)",), ["gap 11.40 um (given)"])
    assert not alike(("gap 11.35 um (given)",), ["gap 14.00 um (given)"])
    assert not alike(("wobble C",), ["wobble B"])
    assert alike(("a", "...", "z 1"), ["a", "b", "c", "z 1.1"])
    assert not alike(("a", "..."), ["b"])


def test_a_story_runs_ncfix_only(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="ncfix only"):
        run("rm -r .", tmp_path)


def test_a_readme_is_written_anew(tmp_path: Path) -> None:
    text = "before\n\n```console\n$ ncfix explain NCF001\nold\n```\n\nafter\n"
    new = written_anew(text, tmp_path)
    assert new.startswith("before\n\n```console\n$ ncfix explain NCF001\nNCF001")
    assert new.endswith("```\n\nafter\n")
    assert "old" not in new
