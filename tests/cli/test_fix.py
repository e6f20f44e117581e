"""`ncfix fix`: what is written, what is said, and what is never touched."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any
from unittest import mock

import pytest

from ncfix.batch.programs import SubprogramFiles
from ncfix.diagnostics import ExitCode

NEITHER_OFFSET_NOR_START = b"G21 G90 G94 G54\nG1 X10 F100\nM2\n"
STAMPED = b"(ncfix 0.1.0 machine 0123456789ab strategy full tolerance 1 um)\nG21 G90\nG0 X1 Y1 Z-1\nM2\n"


def fixed(shop: Any, ncfix: Any, *options: object) -> Any:
    return ncfix("fix", shop.program, "-m", shop.machine, "-o", shop.folder / "out.ngc", "--assume-zero", *options)


def numbers(text: bytes, letter: str) -> list[float]:
    return [float(value) for value in re.findall(rf"{letter}(-?[\d.]+)".encode(), text)]


def test_a_program_is_corrected_and_the_rest_of_its_bytes_are_kept(shop: Any, ncfix: Any) -> None:
    result = fixed(shop, ncfix)
    assert (result.code, result.out) == (ExitCode.DONE, b"")
    text = (shop.folder / "out.ngc").read_bytes()
    assert numbers(text, "X") == [9.999, 109.989, 209.979]
    without_stamp = re.sub(rb"\([^)]*ncfix[^)]*\)\r\n", b"", text)
    assert re.sub(rb"X[\d.]+", b"X", without_stamp) == re.sub(rb"X[\d.]+", b"X", shop.program.read_bytes())
    assert b"machine" in text


def test_what_was_done_is_said_with_figures_before_and_after(shop: Any, ncfix: Any) -> None:
    said = fixed(shop, ncfix).err
    assert f"{shop.program} -> {shop.folder / 'out.ngc'}" in said
    before = re.search(r"tip error before +max ([\d.]+) um", said)
    after = re.search(r"tip error after +max ([\d.]+) um", said)
    assert before
    assert after
    assert float(before[1]) == pytest.approx(21.0, abs=0.01)
    assert float(after[1]) < 1.0


def test_json_has_the_object_of_the_contract(shop: Any, ncfix: Any) -> None:
    (entry,) = fixed(shop, ncfix, "--json").json()["files"]
    assert entry["path"] == str(shop.program)
    assert entry["output"] == str(shop.folder / "out.ngc")
    assert (entry["blocks"], entry["moves"], entry["inserted_blocks"]) == (6, 3, 0)
    assert entry["max_correction_um"] == pytest.approx(21.0, abs=0.5)
    assert entry["error_before_um"]["max"] == pytest.approx(21.0, abs=0.01)
    assert entry["error_before_um"]["rms"] <= entry["error_before_um"]["max"]
    assert entry["error_after_um"]["max"] < 1.0
    assert isinstance(entry["error_after_um"]["where"], int)
    assert entry["refused"] == []
    assert {warning["code"] for warning in entry["warnings"]} <= {"NCF205", "NCF409"}


def test_the_dialect_is_in_json_and_said_on_demand(shop: Any, ncfix: Any) -> None:
    result = fixed(shop, ncfix, "--json", "-v")
    assert result.json()["files"][0]["dialect"] == "linuxcnc"
    assert "  dialect             linuxcnc\n" in result.err


def test_the_input_is_never_changed(shop: Any, ncfix: Any) -> None:
    before = shop.program.read_bytes(), shop.program.stat().st_mtime_ns
    fixed(shop, ncfix)
    assert (shop.program.read_bytes(), shop.program.stat().st_mtime_ns) == before


def test_an_existing_output_is_kept_without_force(shop: Any, ncfix: Any) -> None:
    (shop.folder / "out.ngc").write_bytes(b"precious")
    result = fixed(shop, ncfix)
    assert result.code == ExitCode.USAGE
    assert "NCF004" in result.err
    assert (shop.folder / "out.ngc").read_bytes() == b"precious"
    assert fixed(shop, ncfix, "--force").code == ExitCode.DONE


def test_no_other_input_is_written_over_either(shop: Any, ncfix: Any) -> None:
    before = shop.machine.read_bytes()
    for call in (
        ["fix", shop.program, "-m", shop.machine],
        ["trace", shop.program, "-m", shop.machine],
        ["simulate", "--program", shop.program, "-m", shop.machine],
    ):
        result = ncfix(*call, "-o", shop.machine, "--force", "--assume-zero")
        assert result.code == ExitCode.USAGE
        assert "NCF005" in result.err
    assert shop.machine.read_bytes() == before


def test_a_perfect_machine_gives_every_byte_back_without_any_setup(shop: Any, ncfix: Any) -> None:
    result = ncfix("fix", shop.program, "-m", shop.perfect, "-o", "-")
    assert (result.code, result.out) == (ExitCode.DONE, shop.program.read_bytes())


def test_standard_streams(shop: Any, ncfix: Any) -> None:
    result = ncfix("fix", "-", "-m", shop.machine, "--assume-zero", stdin=shop.program.read_bytes())
    assert numbers(result.out, "X")[-3:] == [9.999, 109.989, 209.979]
    assert "<stdin> -> <stdout>" in result.err


def test_the_program_and_the_json_object_do_not_share_a_stream(shop: Any, ncfix: Any) -> None:
    result = ncfix("fix", shop.program, "-m", shop.machine, "-o", "-", "--json")
    assert result.code == ExitCode.USAGE
    assert result.json()["errors"][0]["code"] == "NCF010"


def test_in_place_keeps_the_original(shop: Any, ncfix: Any) -> None:
    before = shop.program.read_bytes()
    call = ["fix", shop.program, "-m", shop.machine, "--in-place", "--assume-zero"]
    assert ncfix(*call).code == ExitCode.DONE
    assert Path(f"{shop.program}.orig").read_bytes() == before
    assert numbers(shop.program.read_bytes(), "X")[-1] == 209.979
    again = ncfix(*call, "--force")
    assert again.code == ExitCode.USAGE
    assert "NCF008" in again.err


def test_in_place_leaves_a_program_that_needs_nothing_alone(shop: Any, ncfix: Any) -> None:
    assert ncfix("fix", shop.program, "-m", shop.perfect, "--in-place").code == ExitCode.DONE
    assert sorted(path.name for path in shop.folder.iterdir()) == ["machine.toml", "part.ngc", "perfect.toml"]


def test_many_programs_and_the_worst_exit_code(shop: Any, ncfix: Any) -> None:
    bad = shop.folder / "bad.ngc"
    bad.write_bytes(b"G1 X1 Y..2\nM2\n")
    out = shop.folder / "out"
    result = ncfix("fix", bad, shop.program, "-m", shop.machine, "-o", out, "--assume-zero", "--json")
    assert result.code == ExitCode.UNREADABLE
    assert f"{bad}:1:" in result.err
    first, second = result.json()["files"]
    assert first["output"] is None
    assert first["errors"][0]["line"] == 1
    assert second["output"] == str(out / "part.ngc")
    assert sorted(path.name for path in out.iterdir()) == [".ncfix-journal.jsonl", "part.ngc"]


def test_a_refusal_writes_nothing_unless_allowed(shop: Any, ncfix: Any) -> None:
    shop.program.write_bytes(b"G21 G90 G94\nG0 X10 Y10 Z-1\nG1 X500 F600\nM2\n")
    shop.machine.write_text(shop.machine.read_text().replace("1e-4", "-1e-4"))
    result = fixed(shop, ncfix, "--json")
    assert result.code == ExitCode.REFUSED
    (entry,) = result.json()["files"]
    assert entry["output"] is None
    assert [(each["line"], each["code"]) for each in entry["refused"]] == [(3, "NCF404")]
    assert re.search(rf"{shop.program}:3: NCF404: .*\n    G1 X500 F600\n", result.err)
    assert not (shop.folder / "out.ngc").exists()
    assert "--flatten" not in result.err  # there is nothing to be written out
    allowed = fixed(shop, ncfix, "--allow-refused")
    assert "  tip error           not computed: no cutting motion was corrected\n" in allowed.err
    assert "  no figure for 1 motion at feed: 1 refused\n" in allowed.err
    assert allowed.code == ExitCode.DONE
    assert b"\nG1 X500 F600\n" in (shop.folder / "out.ngc").read_bytes()


def test_very_many_refusals_for_one_reason_are_told_as_one_and_all_in_json(shop: Any, ncfix: Any) -> None:
    lines = [f"G1 X{500 - 0.0001 * i:.4f}\n".encode() for i in range(100)]
    shop.program.write_bytes(b"G21 G90 G94 F600\nG0 X10 Y10 Z-1\n" + b"".join(lines) + b"M2\n")
    shop.machine.write_text(shop.machine.read_text().replace("1e-4", "-1e-4"))
    result = fixed(shop, ncfix, "--json")
    assert len(result.json()["files"][0]["refused"]) == 100
    (told,) = re.findall("NCF404: .*", result.err)
    assert told.endswith("(100 times, lines 3 to 102; the largest is shown)")


def test_a_stamped_program_is_refused_unless_forced(shop: Any, ncfix: Any) -> None:
    shop.program.write_bytes(STAMPED)
    result = fixed(shop, ncfix)
    assert result.code == ExitCode.REFUSED
    assert "NCF430" in result.err
    assert not (shop.folder / "out.ngc").exists()
    assert fixed(shop, ncfix, "--force").code == ExitCode.DONE


def test_its_own_output_is_stamped(shop: Any, ncfix: Any) -> None:
    fixed(shop, ncfix)
    again = ncfix("fix", shop.folder / "out.ngc", "-m", shop.machine, "-o", "-", "--assume-zero")
    assert again.code == ExitCode.REFUSED


def test_what_is_not_given_is_named_with_the_option_that_gives_it(shop: Any, ncfix: Any) -> None:
    shop.program.write_bytes(NEITHER_OFFSET_NOR_START)
    call = ["fix", shop.program, "-m", shop.machine, "-o", shop.folder / "out.ngc"]
    result = ncfix(*call)
    assert result.code == ExitCode.USAGE
    for said in ("work offset G54", "--offset G54=", "start position of", "--initial "):
        assert said in result.err
    given = ncfix(*call, "--offset", "G54=100,100,-50", "--initial", "X=0,Y=100,Z=-50")
    assert given.code == ExitCode.DONE
    assert numbers((shop.folder / "out.ngc").read_bytes(), "X")[-1] == 9.989


def test_zeros_that_are_assumed_are_named_in_warnings_and_in_the_stamp(shop: Any, ncfix: Any) -> None:
    shop.program.write_bytes(NEITHER_OFFSET_NOR_START)
    result = ncfix("fix", shop.program, "-m", shop.machine, "-o", "-", "--assume-zero")
    assert result.code == ExitCode.DONE
    assert "NCF205: work offset G54 is not given; ncfix uses zero" in result.err
    assert b"G54" in result.out.splitlines()[0]


def test_an_axis_that_the_machine_lacks(shop: Any, ncfix: Any) -> None:
    shop.program.write_bytes(b"G21 G90 G94\nG1 X1 Y1 Z-1 B30 F100\nM2\n")
    result = fixed(shop, ncfix)
    assert result.code in (ExitCode.USAGE, ExitCode.UNREADABLE)
    assert re.search(r"part\.ngc:2(:\d+)?: NCF\d+: .*\bB\b", result.err)


@pytest.mark.parametrize("value", ["0", "-1", "nan", "inf", "much"])
def test_a_tolerance_is_a_number_above_zero(shop: Any, ncfix: Any, value: str) -> None:
    result = fixed(shop, ncfix, "--tolerance-um", value)
    assert result.code == ExitCode.USAGE
    assert "above zero" in result.err


def test_an_unknown_strategy_and_an_unknown_dialect(shop: Any, ncfix: Any) -> None:
    assert "NCF411" in fixed(shop, ncfix, "--strategy", "best").err
    result = fixed(shop, ncfix, "--dialect", "linuxnc")
    assert result.code == ExitCode.USAGE
    assert "did you mean linuxcnc?" in result.err


@pytest.mark.parametrize("strategy", ["rotary-then-linear", "position", "full"])
def test_strategies(shop: Any, ncfix: Any, strategy: str) -> None:
    assert fixed(shop, ncfix, "--strategy", strategy).code == ExitCode.DONE
    assert strategy.encode() in (shop.folder / "out.ngc").read_bytes()


def test_subprograms_are_found_beside_the_program(shop: Any, ncfix: Any) -> None:
    shop.program.write_bytes(b"G21 G90 G94\nG0 X10 Y10 Z-1\no<side> call\nM2\n")
    (shop.folder / "side.ngc").write_bytes(b"o<side> sub\nG1 X100 F600\no<side> endsub\n")
    checked = ncfix("trace", shop.program)
    assert checked.code == ExitCode.DONE
    assert b"100.0,10.0,-1.0" in checked.out
    (shop.folder / "side.ngc").unlink()
    missing = ncfix("trace", shop.program)
    assert missing.code == ExitCode.UNREADABLE
    assert "side" in missing.err


@pytest.mark.parametrize("name", ["side.ngc", "SIDE.NGC", "side.CUT", "Side"])
@pytest.mark.parametrize("how", ["option", "setup"])
def test_subprograms_are_found_in_other_folders_whatever_the_case_of_their_names(
    shop: Any, ncfix: Any, tmp_path: Path, name: str, how: str
) -> None:
    program, library, setup = shop.folder / "part.cut", tmp_path / "library", tmp_path / "shop" / "setup.toml"
    program.write_bytes(b"G21 G90 G94\nG0 X10 Y10 Z-1\no<side> call\nM2\n")
    for folder in (library, setup.parent):
        folder.mkdir(exist_ok=True)
    (library / name).write_bytes(b"o<side> sub\nG1 X100 F600\no<side> endsub\n")
    setup.write_text('subprograms = ["../library"]\n')
    given = ("--subprograms", library) if how == "option" else ("--setup", setup)
    found = ncfix("trace", program, "--dialect", "linuxcnc", *given)
    assert found.code == ExitCode.DONE, found.err
    assert b"100.0,10.0,-1.0" in found.out


def test_a_name_that_two_files_have_in_other_cases_is_no_subprogram(shop: Any, ncfix: Any) -> None:
    shop.program.write_bytes(b"G21 G90 G94\nG0 X10 Y10 Z-1\no<side> call\nM2\n")
    for name in ("Side.ngc", "SIDE.ngc"):
        (shop.folder / name).write_bytes(b"o<side> sub\nG1 X100 F600\no<side> endsub\n")
    assert "NCF231" in ncfix("trace", shop.program).err


def test_a_folder_is_listed_once_for_all_the_subprograms_that_it_lacks(tmp_path: Path) -> None:
    """A builder's cycle may be called thousands of times, and the folder may have thousands of files."""
    (tmp_path / "Bore.NC").write_bytes(b"M17")
    find = SubprogramFiles((str(tmp_path),))
    with mock.patch("os.listdir", side_effect=os.listdir) as listed:
        assert [find(f"L{number}") for number in range(9)] == [None] * 9
        assert find("BORE") == b"M17"
    assert listed.call_count == 1
    (tmp_path / "Mill.NC").write_bytes(b"M30")
    os.utime(tmp_path, ns=(0, 10**18))
    assert find("MILL") == b"M30"


def test_a_folder_of_subprograms_that_is_not_there_is_named(shop: Any, ncfix: Any, tmp_path: Path) -> None:
    setup = tmp_path / "setup.toml"
    for text in ('subprograms = ["none"]', "subprograms = 5", 'subprograms = "none"'):
        setup.write_text(text)
        result = ncfix("trace", shop.program, "--setup", setup)
        assert "setup.toml:1" in result.err
        assert "NCF383: subprograms" in result.err
    assert ncfix("trace", shop.program, "--subprograms", tmp_path / "none").code == ExitCode.USAGE


def test_the_shipped_five_axis_example(examples: Path, ncfix: Any, tmp_path: Path) -> None:
    program, setup = examples / "programs/blade.nc", examples / "programs/blade.setup.toml"
    machine = examples / "machines/dmu50.toml"
    result = ncfix("fix", program, "--setup", setup, "-m", machine, "-o", tmp_path, "--json")
    assert result.code == ExitCode.DONE, result.err
    (entry,) = result.json()["files"]
    assert entry["error_before_um"]["max"] > 10
    assert entry["error_after_um"]["max"] <= 1.0
    verified = ncfix("verify", program, tmp_path / "blade.nc", "--setup", setup, "-m", machine, "--json")
    assert verified.code == ExitCode.DONE


def test_the_readme_shows_what_its_first_command_does(root: Path, ncfix: Any, tmp_path: Path) -> None:
    """The command is the one in ./try, the figures and the blocks are those in README.md."""
    script = (root / "try").read_text().replace("\\\n", " ")
    (command,) = re.findall(r"exec \.venv/bin/ncfix (fix .*)", script)
    arguments = [str(root / word) if word.startswith("examples/") else word for word in command.split()]
    arguments[arguments.index("out/")] = f"{tmp_path}/"
    result = ncfix(*arguments)
    assert result.code == ExitCode.DONE, result.err
    readme = (root / "README.md").read_text()
    figures = re.findall(r"^  (?:motion blocks|passed by rule|largest|tip error|rounding).*$", result.err, re.MULTILINE)
    assert len(figures) == 6
    assert "\n".join(figures) in readme
    original, corrected = (root / "examples/programs/blade.nc").read_text(), (tmp_path / "blade.nc").read_text()
    shown = [re.split(r"(?:->)? {6,}(?:-> +)?", line) for line in re.findall(r"^N\d+ .*$", readme, re.MULTILINE)]
    assert len(shown) == 3
    for before, after in shown:
        assert f"\n{before}\n" in original
        assert f"\n{after}\n" in corrected


def test_what_was_written_elsewhere_is_verified_with_the_subprograms_of_the_original(shop: Any, ncfix: Any) -> None:
    program, out = shop.folder / "main.nc", shop.folder / "out" / "main.nc"
    program.write_bytes(b"%\nO1\nG21G90G54G0X0.Y0.Z5.\nM98P77\nG0X20.Y0.Z5.\nM30\n%\n")
    (shop.folder / "O77.nc").write_bytes(b"%\nO77\nG1X10.Y5.F100.\nM99\n%\n")
    given = ("-m", shop.machine, "--assume-zero", "--dialect", "fanuc", "--no-point", "calculator")
    out.parent.mkdir()
    ncfix("fix", program, *given, "-o", out, "--allow-refused")
    result = ncfix("verify", program, out, *given, "--tolerance-um", "1000")
    assert result.code == ExitCode.DONE, result.err


def test_simulate_and_verify_say_that_what_they_take_for_meant_has_been_corrected(shop: Any, ncfix: Any) -> None:
    fixed, given = shop.folder / "fixed.ngc", ("-m", shop.machine, "--assume-zero")
    assert ncfix("fix", shop.program, "-o", fixed, *given).code == ExitCode.DONE
    line = 1 + next(k for k, text in enumerate(fixed.read_text().splitlines()) if "ncfix" in text.lower())
    for arguments in (("simulate", "--program", fixed), ("verify", fixed, shop.program)):
        assert f"{fixed}:{line}: NCF430" in ncfix(*arguments, *given).err
    for arguments in (("simulate", "--program", shop.program), ("verify", shop.program, fixed)):
        assert "NCF430" not in ncfix(*arguments, *given).err


@pytest.mark.parametrize("part", [1 << 20, 60])
def test_simulate_and_verify_say_what_they_took_for_granted(
    shop: Any, ncfix: Any, monkeypatch: pytest.MonkeyPatch, part: int
) -> None:
    """Offsets that are taken as zero, and a code that may move anything; read as a whole and in parts."""
    monkeypatch.setenv("NCFIX_PART_BYTES", str(part))
    cuts = "".join(f"G1 X{10 + k}\n" for k in range(60))
    shop.program.write_text(f"G21 G90 G94 F600\nG0 X10 Y10 Z1\n{cuts}G777\n{cuts}M2\n")
    given = ("-m", shop.machine, "--assume-zero", "--dialect", "iso")
    for arguments in (("simulate", "--program", shop.program), ("verify", shop.program, shop.program)):
        said = ncfix(*arguments, *given).err
        assert said.count("NCF205: work offset G54 is not given; ncfix uses zero") == 1
        assert said.count(f"{shop.program}:63:1: NCF228: G777 is not known") == 1
