"""`ncfix trace`, `simulate` and `verify`: where the tool goes, and how wrong that is."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

import pytest

from ncfix.diagnostics import ExitCode


def rows(text: bytes) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text.decode())))


def test_trace_without_a_machine(shop: Any, ncfix: Any) -> None:
    found = rows(ncfix("trace", shop.program).out)
    assert [(row["line"], row["kind"]) for row in found] == [("3", "rapid"), ("4", "feed"), ("5", "feed")]
    assert [float(found[-1][axis]) for axis in "XYZ"] == [210.0, 60.0, -1.0]
    assert (found[-1]["feed"], found[-1]["feed_mode"], found[-1]["rule"]) == ("600.0", "per_minute", "correct")
    assert "tip_x" not in found[0]


def test_trace_on_a_machine_gives_the_tip(shop: Any, ncfix: Any) -> None:
    shop.program.write_bytes(b"G21 G90 G94 G54\nT3 M6\nG43 H3\nG0 X1 Y2 Z-3\nM2\n")
    options = ["--offset", "G54=100,50,-200", "--tool", "3=80", "--initial", "X=0,Y=0,Z=0"]
    found = rows(ncfix("trace", shop.program, "-m", shop.machine, *options).out)[-1]
    assert [float(found[axis]) for axis in "XYZ"] == [101.0, 52.0, -123.0]
    assert [float(found[f"tip_{axis}"]) for axis in "xyz"] == [101.0, 52.0, -203.0]


def test_trace_names_the_rotary_axes_of_the_program_in_degrees(shop: Any, ncfix: Any) -> None:
    shop.program.write_bytes(b"G21 G90 G94\nG0 X1 Y2 Z-3 B30 C-45\nM2\n")
    found = rows(ncfix("trace", shop.program).out)[-1]
    assert [float(found[axis]) for axis in "BC"] == [30.0, -45.0]


def test_trace_quotes_and_leaves_open(shop: Any, ncfix: Any) -> None:
    shop.program.write_bytes(b"G21 G90 G94\nG0 X1 Y2 Z-3\nG53 G0 Z0\nM2\n")
    found = rows(ncfix("trace", shop.program, "--assume-zero").out)
    assert found[0]["feed"] == ""
    assert found[1]["rule"] == "pass"
    assert "G53" in found[1]["reason"]


def test_trace_as_json_and_into_a_file(shop: Any, ncfix: Any) -> None:
    table = ncfix("trace", shop.program, "--json").json()
    assert table["columns"][:2] == ["line", "kind"]
    assert len(table["rows"]) == 3
    assert ncfix("trace", shop.program, "-o", shop.folder / "moves.csv").out == b""
    assert rows((shop.folder / "moves.csv").read_bytes())[0]["kind"] == "rapid"
    assert "NCF004" in ncfix("trace", shop.program, "-o", shop.folder / "moves.csv").err


def test_trace_as_json_beside_a_file(shop: Any, ncfix: Any) -> None:
    """The object goes to standard output and the table to the file, as each does alone."""
    both = ncfix("trace", shop.program, "--json", "-o", shop.folder / "moves.csv")
    assert both.out == ncfix("trace", shop.program, "--json").out
    assert (shop.folder / "moves.csv").read_bytes() == ncfix("trace", shop.program).out
    assert ncfix("trace", shop.program, "--json", "-o", "-").out == both.out


def test_simulate_says_how_wrong_it_will_be(shop: Any, ncfix: Any) -> None:
    result = ncfix("simulate", "-m", shop.machine, "--program", shop.program, "--assume-zero", "--json")
    assert result.code == ExitCode.DONE
    error = result.json()["error_um"]
    assert error["max"] == pytest.approx(21.0, abs=1e-6)
    # x runs from 10 to 110 over 100 mm, then to 210 over sqrt(100^2 + 50^2): rms of 0.1 um/mm times x along the way
    first, second = 100.0, (100.0**2 + 50.0**2) ** 0.5
    squares = ((110**3 - 10**3) / 300 * first + (210**3 - 110**3) / 300 * second) / (first + second)
    assert error["rms"] == pytest.approx(0.1 * squares**0.5, rel=5e-3)
    assert error["where"] == 5
    text = ncfix("simulate", "-m", shop.machine, "--program", shop.program, "--assume-zero").out.decode()
    assert text.startswith("tip error: max 21.00 um, rms ")


def test_simulate_writes_the_error_along_the_path(shop: Any, ncfix: Any) -> None:
    call = ["simulate", "-m", shop.machine, "--program", shop.program, "--assume-zero"]
    found = rows(ncfix(*call, "-o", "-").out)
    last = found[-1]
    assert (last["line"], float(last["fraction"])) == ("5", 1.0)
    assert [float(last[f"tip_{axis}"]) for axis in "xyz"] == [210.0, 60.0, -1.0]
    assert float(last["dx_um"]) == pytest.approx(21.0)
    assert float(last["error_um"]) == pytest.approx(21.0)
    assert ncfix(*call, "-o", shop.folder / "error.csv", "--json").json()["output"] == str(shop.folder / "error.csv")
    assert rows((shop.folder / "error.csv").read_bytes()) == found


def test_verify_sees_that_the_fixed_program_is_right(shop: Any, ncfix: Any) -> None:
    fixed = shop.folder / "out.ngc"
    ncfix("fix", shop.program, "-m", shop.machine, "-o", fixed, "--assume-zero")
    result = ncfix("verify", shop.program, fixed, "-m", shop.machine, "--assume-zero", "--json")
    assert result.code == ExitCode.DONE
    said = result.json()
    assert said["within"] is True
    assert said["error_before_um"]["max"] == pytest.approx(21.0, abs=1e-6)
    # the control's step is 1 um: two axes rounded to half of it
    assert said["error_after_um"]["max"] < 0.5 * 2**0.5 + 0.01
    assert said["left_out_um"]["max"] < 0.5 * 2**0.5 + 0.01


def test_verify_sees_that_the_original_is_wrong(shop: Any, ncfix: Any) -> None:
    result = ncfix("verify", shop.program, shop.program, "-m", shop.machine, "--assume-zero")
    assert result.code == ExitCode.FINDINGS
    before, after, *_, verdict = result.out.decode().splitlines()
    figures = after.removeprefix("tip error after:  ")
    assert before == f"tip error before: {figures} of the original"
    assert verdict.startswith("NOT within 1 um, plus 0.87 um for the control's digits: lines ")
    loose = ncfix("verify", shop.program, shop.program, "-m", shop.machine, "--assume-zero", "--tolerance-um", "22")
    assert loose.code == ExitCode.DONE


@pytest.mark.parametrize(
    ("change", "least_um"),
    [
        ((b"X210 Y60\r\n", b"X210 Y60.02\r\n"), 17.0),
        ((b"X210 Y60\r\n", b"X210 Y60\r\nX210.05\r\n"), 49.0),
        ((b"X210 Y60\r\n", b"X209.9 Y59.95\r\n"), 100.0),
        ((b"G1 X110.000 F600\r\n", b"G1 X110.000 Y10.03 F600\r\n"), 29.0),
    ],
    ids=["off", "too far", "too short", "bent"],
)
def test_verify_sees_what_was_changed_on_a_perfect_machine(shop: Any, ncfix: Any, change: Any, least_um: float) -> None:
    other = shop.folder / "other.ngc"
    other.write_bytes(shop.program.read_bytes().replace(*change))
    result = ncfix("verify", shop.program, other, "-m", shop.perfect, "--json")
    assert result.code == ExitCode.FINDINGS
    said = result.json()
    assert max(said["error_after_um"]["max"], said["left_out_um"]["max"]) > least_um


def test_verify_refuses_programs_that_are_not_the_same_cut(shop: Any, ncfix: Any) -> None:
    other = shop.folder / "other.ngc"
    other.write_bytes(shop.program.read_bytes().replace(b"X210 Y60\r\n", b""))
    result = ncfix("verify", shop.program, other, "-m", shop.perfect)
    assert result.code == ExitCode.FINDINGS
    assert "NCF420" in result.err


def test_a_pass_beside_is_not_taken_for_the_one_that_is_meant(shop: Any, ncfix: Any) -> None:
    """Passes 30 um apart, each cut 30 um off: right beside the next one, and still wrong."""
    lines = [f"G1 Y{10 + 0.03 * i:.2f}\nX{110 if i % 2 == 0 else 10}\n".encode() for i in range(10)]
    shop.program.write_bytes(b"G21 G90 G94 F600\nG0 X10 Y10 Z-1\n" + b"".join(lines) + b"M2\n")
    other = shop.folder / "other.ngc"
    moved = [f"G1 Y{10.03 + 0.03 * i:.2f}\nX{110 if i % 2 == 0 else 10}\n".encode() for i in range(10)]
    other.write_bytes(b"G21 G90 G94 F600\nG0 X10 Y10.03 Z-1\n" + b"".join(moved) + b"M2\n")
    said = ncfix("verify", shop.program, other, "-m", shop.perfect, "--json").json()
    assert said["error_after_um"]["max"] == pytest.approx(30.0, abs=0.5)
    assert said["error_after_um"]["rms"] > 25


def test_arcs_are_compared_as_arcs(shop: Any, ncfix: Any) -> None:
    shop.program.write_bytes(b"G21 G90 G94 G17\nG0 X100 Y100 Z-1\nG2 X120 Y100 I10 J0 F600\nM2\n")
    other = shop.folder / "other.ngc"
    other.write_bytes(b"G21 G90 G94 G17\nG0 X100 Y100 Z-1\nG2 X110 Y110 I10 J0 F600\nX120 Y100 I0 J-10\nM2\n")
    said = ncfix("verify", shop.program, other, "-m", shop.perfect, "--json").json()
    assert said["error_after_um"]["max"] < 1e-3


def test_verify_on_the_shipped_example_against_itself(examples: Path, ncfix: Any) -> None:
    program, setup = examples / "programs/blade.nc", examples / "programs/blade.setup.toml"
    said = ncfix("verify", program, program, "--setup", setup, "-m", examples / "machines/dmu50.toml", "--json").json()
    assert said["error_after_um"] == said["error_before_um"]
    assert said["lines_not_looked_at"] == []


def test_verify_reads_a_program_in_the_dialect_of_the_first(ncfix: Any, examples: Path, tmp_path: Path) -> None:
    """Nothing in a program that is written out flat need show its family; here a word has `=`, as others have not."""
    first, second = tmp_path / "a.mpf", tmp_path / "flat.txt"
    first.write_bytes(b"R1=10\nG90 G94 F500\nG0 X0 Y0 Z20\nG1 X=R1 Y5\nX20\nM30\n")
    second.write_bytes(b"G90 G94 F500\nG0 X0 Y0 Z20\nG1 X10 Y5\nX=20\nM30\n")
    call = ["verify", first, second, "-m", examples / "machines/three_axis.toml", "--assume-zero"]
    assert ncfix(*call, "--tolerance-um", "100").code == ExitCode.DONE


def test_verify_names_what_it_could_not_look_at(ncfix: Any, examples: Path, tmp_path: Path) -> None:
    program = tmp_path / "a.h"
    program.write_bytes(b"BEGIN PGM A MM\nL X+0 Y+0 Z+5 FMAX\nL X+10 F100\nL X+Q7\nL X+30 Y+5 F100\nEND PGM A MM\n")
    call = ["verify", program, program, "-m", examples / "machines/three_axis.toml", "--assume-zero"]
    result = ncfix(*call, "--tolerance-um", "100")
    assert "not examined: lines 4 to 5 of the original" in result.out.decode()
    assert ncfix(*call, "--json").json()["lines_not_looked_at"] == [4, 5]


def test_verify_passes_what_fix_wrote_on_a_machine_with_play(examples: Path, ncfix: Any, tmp_path: Path) -> None:
    program, setup = examples / "programs/blade.nc", examples / "programs/blade.setup.toml"
    common = ["-m", examples / "machines/wCBXFZYSt.toml", "--setup", setup]
    assert ncfix("fix", program, "-o", tmp_path, *common).code == ExitCode.DONE
    result = ncfix("verify", program, tmp_path / "blade.nc", *common)
    assert result.code == ExitCode.DONE, result.out


def test_two_ways_to_look_at_a_corrected_program_agree(examples: Path, ncfix: Any, tmp_path: Path) -> None:
    """`fix` compares at the same instant of the planned motions, `verify` curves that it reads from the two files.

    The nearest point is never farther away than the point that belongs to the instant; 5 %: samples are not the same.
    """
    program, setup = examples / "programs/blade.nc", examples / "programs/blade.setup.toml"
    common = ["-m", examples / "machines/dmu50.toml", "--setup", setup, "--json"]
    (entry,) = ncfix("fix", program, "-o", tmp_path, "--allow-refused", *common).json()["files"]
    said = ncfix("verify", program, tmp_path / "blade.nc", *common).json()
    assert 0 < said["error_after_um"]["max"] <= 1.05 * entry["error_after_um"]["max"]
    assert 0.9 < said["error_before_um"]["max"] / entry["error_before_um"]["max"] <= 1.01
    assert said["within"] is True


def test_verify_says_where_nothing_could_be_corrected(ncfix: Any, examples: Path, tmp_path: Path) -> None:
    """A cut whose Z the program has not said: Z gets no word, and the error that stays along it is explained."""
    program, out = tmp_path / "a.ngc", tmp_path / "b.ngc"
    program.write_text("G21 G90 G94\nG0 X50. Y100.\nG1 X150. F500\nG0 Z5.\nG1 Z-5.\nG1 X50.\nM2\n")
    options = ["-m", examples / "machines/wCBXFZYSt.toml", "--assume-zero"]
    fixed = ncfix("fix", program, "-o", out, *options, "--json").json()["files"][0]
    assert [(left["axis"], left["lines"]) for left in fixed["left_where_it_stands"]] == [("Z", [[2, 3]])]
    found = ncfix("verify", program, out, *options, "--json")
    assert found.json()["left_where_it_stands"] == [{"axis": "Z", "lines": [3]}]
    assert found.code == ExitCode.FINDINGS
    said = ncfix("verify", program, out, *options).out.decode()
    assert "Z cannot be corrected in line 3 of the original: the program has not given the position of Z" in said
