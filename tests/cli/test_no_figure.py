"""What nobody could look at has no figure: `fix` and `verify` say of how many motions, and call nothing of it right."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from ncfix.diagnostics import ExitCode

MACHINE_FEEDS = {
    "a.nc": "%\nO1\nG21 G90 G17 G54\nG0 X0. Y0. Z5.\nG1 X30. F500.\nG53 G1 X50. Y20.\nG0 X0. Y0. Z5.\nM30\n%\n",
    "a.mpf": "G54 G17 G90 G71\nT1 D1\nG0 X0 Y0 Z5\nG1 X30 F500\nSUPA G1 X50 Y20\nG0 X0 Y0 Z5\nM30\n",
    "a.h": "BEGIN PGM A MM\nTOOL CALL 1 Z\nL X+0 Y+0 Z+5 R0 FMAX\nL X+30 F500\nL X+50 Y+20 F500 M91\n"
    "L X+0 Y+0 Z+5 FMAX\nEND PGM A MM\n",
}
DIALECTS = {"a.nc": "fanuc", "a.mpf": "siemens", "a.h": "heidenhain"}
PROBING = "%\nO1\nG21 G90 G17 G54\nG0 X0. Y0. Z5.\nG1 X30. F500.\nG31 Z-5. F100.\nG0 X0. Y0. Z5.\nM30\n%\n"
NOTHING = "%\nO1\nG21 G90 G17 G54\nG53 G0 Z0.\nG53 G0 X0. Y0.\nM30\n%\n"
RAPIDS = "%\nO1\nG21 G90 G17 G54\nG0 X0. Y0. Z5.\nG0 X30. Y40.\nM30\n%\n"


@pytest.fixture
def common(examples: Path) -> list[object]:
    return ["-m", examples / "machines/three_axis.toml", "--assume-zero"]


def fixed(ncfix: Any, folder: Path, name: str, text: str, *given: object) -> tuple[Path, Path, Any]:
    """The original, what it became, and what was said."""
    program, output = folder / name, folder / f"out_{name}"
    program.write_text(text)
    result = ncfix("fix", program, *given, "--dialect", DIALECTS[name], "-o", output, "--force", "--json")
    assert result.code == ExitCode.DONE
    return program, output, result


@pytest.mark.parametrize("name", MACHINE_FEEDS)
def test_a_feed_in_machine_coordinates_is_counted_and_not_called_within(
    name: str, ncfix: Any, tmp_path: Path, common: list[object]
) -> None:
    program, output, result = fixed(ncfix, tmp_path, name, MACHINE_FEEDS[name], *common)
    (entry,) = result.json()["files"]
    assert entry["no_figure"] == {"machine coordinates": 1}
    assert entry["passed_by_rule"] == {"machine coordinates": 1}
    assert "no figure for 1 motion at feed: 1 machine coordinates" in result.err
    verify = ("verify", program, output, *common, "--dialect", DIALECTS[name])
    said, told = ncfix(*verify, "--json"), ncfix(*verify)
    assert said.code == told.code == ExitCode.FINDINGS
    assert said.json()["within"] is False
    assert said.json()["lines_beyond"] == said.json()["lines_not_reached"] == []
    assert said.json()["no_figure"] == {"machine coordinates": 1}
    assert "NOT known to be within" in told.out.decode()


def test_probing_cuts_nothing_and_is_counted(ncfix: Any, tmp_path: Path, common: list[object]) -> None:
    program, output, result = fixed(ncfix, tmp_path, "a.nc", PROBING, *common)
    assert result.json()["files"][0]["no_figure"] == {"probing": 1}
    said = ncfix("verify", program, output, *common, "--dialect", "fanuc", "--json")
    assert said.code == ExitCode.DONE
    assert said.json()["no_figure"] == {"probing": 1}
    assert said.json()["lines_not_looked_at"] == []


@pytest.mark.parametrize(
    ("text", "words"), [(NOTHING, "nothing corrected"), (RAPIDS, "no cutting motion was corrected")]
)
def test_no_zero_stands_for_nothing_looked_at(
    text: str, words: str, ncfix: Any, tmp_path: Path, common: list[object]
) -> None:
    program, output, result = fixed(ncfix, tmp_path, "a.nc", text, *common)
    (entry,) = result.json()["files"]
    assert (entry["max_correction_um"] is None) == (text == NOTHING)
    assert entry["error_before_um"] == {"max": None, "rms": None}
    assert entry["error_after_um"] == {"max": None, "rms": None, "where": None}
    assert words in result.err
    assert "0.00 um, rms" not in result.err
    told = ncfix("verify", program, output, *common, "--dialect", "fanuc")
    assert told.code == ExitCode.DONE
    assert "no motion cuts: there is nothing to compare" in told.out.decode()
    assert "0.00 um" not in told.out.decode()


@pytest.mark.parametrize("part_bytes", ["40", "10000000"])
def test_parts_count_as_the_whole(
    part_bytes: str, ncfix: Any, tmp_path: Path, common: list[object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NCFIX_PART_BYTES", part_bytes)
    text = MACHINE_FEEDS["a.nc"].replace(
        "M30", "".join(f"G1 X{n}. Y{n}.\nG53 G1 Z{n}.\nG0 Z5.\n" for n in range(9)) + "M30"
    )
    _, _, result = fixed(ncfix, tmp_path, "a.nc", text, *common)
    (entry,) = result.json()["files"]
    assert entry["no_figure"] == {"machine coordinates": 10}
    assert entry["passed"] == sum(entry["passed_by_rule"].values())
