"""Long programs are compared while they are read: with the figures of a comparison as wholes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ncfix.cli.verify import ProgramPair
from ncfix.diagnostics import ExitCode

GIVEN = ("--offset", "G54=0,0,0,0,0", "--tool", "0=0", "--dialect", "linuxcnc")
HEAD = ["%", "(LONG)", "G21 G90 G94 G54 G17 F900.", "G0 X10. Y20. Z5. B0. C0."]
SAME = {"rel": 1e-6, "abs": 2e-3}
"""um: nearest points are within half a per cent where they are beyond the tolerance, and found from elsewhere."""


def lines() -> list[str]:
    """Cuts there and back with the rotary axes turning, a hundredth of them over 300 degrees, and rapids in between."""
    found = list(HEAD)
    for k in range(600):
        word = "G0" if k % 50 == 49 else "G1"
        turned = -20 + k % 43 if k % 97 else 300
        found.append(
            f"{word} X{10 + abs(k % 140 - 70):.3f} Y{20 + k % 9:.3f} Z{5 + k % 4}. B{k % 11}. C{turned}. F900."
        )
    return [*found, "M2", "%", ""]


@pytest.fixture
def verify(root: Path, ncfix: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Any:
    """`verify(part, original, fixed)`: the JSON, of texts read in parts of so many bytes."""
    machine = root / "benchmarks/five_axis.toml"

    def call(part: int, original: list[str], fixed: list[str]) -> dict[str, Any]:
        monkeypatch.setenv("NCFIX_PART_BYTES", str(part))
        paths = [tmp_path / "a.ngc", tmp_path / "b.ngc"]
        for path, each in zip(paths, (original, fixed), strict=True):
            path.write_text("\n".join(each))
        result = ncfix("verify", *paths, "-m", machine, *GIVEN, "--json")
        assert result.code in (ExitCode.DONE, ExitCode.FINDINGS), result.err
        found: dict[str, Any] = result.json()
        return found

    return call


@pytest.fixture
def corrected(root: Path, ncfix: Any, tmp_path: Path) -> list[str]:
    """What `fix` makes of the lines."""
    path, out = tmp_path / "original.ngc", tmp_path / "fixed.ngc"
    path.write_text("\n".join(lines()))
    assert ncfix("fix", path, "-o", out, "-m", root / "benchmarks/five_axis.toml", *GIVEN).code == ExitCode.DONE
    return out.read_text().splitlines()


@pytest.fixture
def only_in_parts(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Nothing may be compared as a whole."""
    monkeypatch.setattr(ProgramPair, "_as_wholes", never)
    return monkeypatch


def never(pair: ProgramPair) -> None:
    raise AssertionError("compared as a whole")


def same(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Whether two comparisons say the same."""
    for each in ("error_before_um", "error_after_um", "left_out_um"):
        for figure in ("max", "rms"):
            assert one[each][figure] == pytest.approx(other[each][figure], **SAME), (each, figure)
        assert one[each]["where"] == other[each]["where"]
    rest = ("within", "lines_beyond", "lines_not_reached", "lines_not_looked_at", "left_where_it_stands")
    return all(one[key] == other[key] for key in rest)


@pytest.mark.parametrize("part", [3000, 9000])
def test_what_fix_wrote_is_right_in_any_parts(verify: Any, corrected: list[str], part: int, request: Any) -> None:
    whole = verify(1 << 20, lines(), corrected)
    assert whole["within"]
    assert whole["error_before_um"]["max"] > 10
    request.getfixturevalue("only_in_parts")
    assert same(verify(part, lines(), corrected), whole)


def test_faults_are_found_in_any_parts(verify: Any, corrected: list[str], request: Any) -> None:
    wrong = list(corrected)
    for at in (7, len(corrected) // 2, len(corrected) - 5):
        wrong[at] += "\nG91 G1 Z0.0025\nZ-0.0025\nG90"
    whole = verify(1 << 20, lines(), wrong)
    assert len(whole["lines_beyond"]) >= 3
    request.getfixturevalue("only_in_parts")
    assert same(verify(3000, lines(), wrong), whole)


@pytest.mark.parametrize("change", ["left out", "exchanged", "said too early", "ends early"])
def test_faults_of_millimetres_are_found_in_any_parts(verify: Any, corrected: list[str], change: str) -> None:
    half, wrong = len(corrected) // 2, list(corrected)
    place = next(at for at in range(half, len(wrong)) if " Z8." in wrong[at])  # the path turns there
    if change == "left out":
        wrong[place : place + 2] = []
    if change == "exchanged":
        wrong[place : place + 2] = wrong[place : place + 2][::-1]
    if change == "said too early":
        wrong.insert(place - 1, wrong[place + 1])
    if change == "ends early":
        wrong[-6:-3] = []
    whole = verify(1 << 20, lines(), wrong)
    assert not whole["within"]
    assert same(verify(3000, lines(), wrong), whole)


def test_play_is_taken_up_in_any_parts(root: Path, ncfix: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A zigzag in which axes turn round in each corner, and a walk at random, on a machine with play."""
    original, fixed = tmp_path / "a.ngc", tmp_path / "b.ngc"
    text = [f"G1 X{20 + 60 * (k % 2)} Y{10 + 0.5 * k + 3 * (k % 3)} Z{-(k % 5)}" for k in range(60)]
    walk = np.cumsum(np.random.default_rng(1).choice([-0.6, 0.0, 0.9, 0.3, -0.55], (30, 3)), axis=0)
    text += [f"G1 X{x:.3f} Y{y:.3f} Z{z:.3f}" for x, y, z in walk % 60 + [20, 100, 0]]
    original.write_text("\n".join(["G21 G90 G94 G17 F900", "G0 X20 Y5 Z5", *text, "M2", ""]))
    given = ("-m", root / "examples/machines/wCBXFZYSt.toml", "--assume-zero", "--dialect", "linuxcnc")
    assert ncfix("fix", original, "-o", fixed, *given).code == ExitCode.DONE
    wholes = [ncfix("verify", original, each, *given, "--json").json() for each in (fixed, original)]
    assert wholes[0]["within"]
    assert not wholes[1]["within"]
    monkeypatch.setattr(ProgramPair, "_as_wholes", never)
    for part in (400, 900):
        monkeypatch.setenv("NCFIX_PART_BYTES", str(part))
        for each, whole in list(zip((fixed, original), wholes, strict=True))[: 1 if part == 400 else 2]:
            found = ncfix("verify", original, each, *given, "--json").json()
            assert same(found, whole)
            for figure in ("error_before_um", "error_after_um", "left_out_um"):
                # Newton's method ends within a nanometre of the nearest point, which is a share of 1e-6 of this
                assert found[figure]["rms"] == pytest.approx(whole[figure]["rms"], rel=1e-7)


def test_play_that_is_half_taken_up_is_so_in_any_parts(
    root: Path, ncfix: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """X turns round by less than its play of 1.5 um, and then rests for a long way."""
    original = tmp_path / "a.ngc"
    text = ["G1 X30", "X29.9996", *[f"Y{5 + 0.2 * k:.1f}" for k in range(1, 500)]]
    original.write_text("\n".join(["G21 G90 G94 G17 F900", "G0 X20 Y5 Z5", *text, "M2", ""]))
    given = ("-m", root / "examples/machines/wCBXFZYSt.toml", "--assume-zero", "--dialect", "linuxcnc", "--json")
    whole = ncfix("verify", original, original, *given).json()
    monkeypatch.setattr(ProgramPair, "_as_wholes", never)
    monkeypatch.setenv("NCFIX_PART_BYTES", "1000")
    found = ncfix("verify", original, original, *given).json()
    assert same(found, whole)
    for figure in ("error_before_um", "error_after_um", "left_out_um"):
        assert found[figure]["rms"] == pytest.approx(whole[figure]["rms"], rel=1e-7)


@pytest.mark.parametrize("part", [1 << 20, 3000])
def test_a_rapid_in_the_middle_of_a_cut_is_found_however_short_it_is(
    root: Path, ncfix: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, part: int
) -> None:
    """Straight cuts of 200 mm, looked at every few mm: one says `G0` for a way of 0.3 mm that nobody looks at."""
    original, fixed = tmp_path / "a.ngc", tmp_path / "b.ngc"
    cuts = [f"G1 Y{20 + 0.5 * k}\nG1 X{10 + 200 * (k % 2)}" for k in range(100)]
    original.write_text("\n".join(["G21 G90 G94 G54 G17 F900", "G0 X10 Y20 Z5 B0 C0", "G1 Z0", *cuts, "M2", ""]))
    given = ("-m", root / "benchmarks/five_axis.toml", *GIVEN)
    assert ncfix("fix", original, "-o", fixed, *given).code == ExitCode.DONE
    text = fixed.read_text().splitlines()
    monkeypatch.setenv("NCFIX_PART_BYTES", str(part))
    assert ncfix("verify", original, fixed, *given, "--json").json()["within"]
    place = [at for at, line in enumerate(text) if line.startswith("G1 X2")][30]
    for begin in (47.3, 132.49):
        wrong = list(text)
        wrong[place] = f"G1 X{begin}\nG0 X{begin + 0.3}\n{text[place]}"
        fixed.write_text("\n".join(wrong) + "\n")
        found = ncfix("verify", original, fixed, *given, "--json").json()
        assert found["left_out_um"]["max"] == pytest.approx(150, abs=1), "half of it, from where the cut ends"


def test_parts_and_programs_that_cut_nothing_are_compared_on_a_machine_with_play(
    root: Path, ncfix: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A part of rapids between two of cuts; then a program of rapids alone, which cuts something else."""
    original, fixed, rapids = (tmp_path / f"{name}.ngc" for name in "abc")
    given = ("-m", root / "examples/machines/wCBXFZYSt.toml", "--assume-zero", "--dialect", "linuxcnc")
    head = "G21 G90 G94 G17 F900\nG0 X20 Y5 Z5\n"
    cuts, moves = ("".join(f"{word} X{20 + 9 * (k % 2)} Y{10 + 0.5 * k}\n" for k in range(60)) for word in ("G1", "G0"))
    original.write_text(f"{head}{cuts}{4 * moves}{cuts}M2\n")
    rapids.write_text(f"{head}{moves}M2\n")
    assert ncfix("fix", original, "-o", fixed, *given).code == ExitCode.DONE
    whole = ncfix("verify", original, fixed, *given, "--json").json()
    assert whole["within"]
    for one, other in ((original, rapids), (rapids, original)):
        result = ncfix("verify", one, other, *given)
        assert (result.code, "NCF420" in result.err) == (ExitCode.FINDINGS, True)
    monkeypatch.setenv("NCFIX_PART_BYTES", "1000")
    assert same(ncfix("verify", original, fixed, *given, "--json").json(), whole)
