"""`ncfix export` and `ncfix emulate`: folders, refusals, figures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import ncfix as module
from ncfix.control.setup import Setup
from ncfix.diagnostics import ExitCode

FILES = ["comp.ini", "hand-over.html", "hand-over.md", "joint_0_X.comp", "ncfix-tables.json"]


@pytest.fixture
def tables(shop: Any, ncfix: Any) -> Path:
    """Tables for LinuxCNC of the machine that is too long in X."""
    folder: Path = shop.folder / "tables"
    assert ncfix("export", "linuxcnc", "-m", shop.machine, "-o", folder).code == ExitCode.DONE
    return folder


def test_export_says_what_the_files_leave(shop: Any, ncfix: Any) -> None:
    found = ncfix("export", "linuxcnc", "-m", shop.machine, "-o", shop.folder / "t", "--json").json()
    assert found["control"] == "linuxcnc"
    assert found["class"] == "L-POS"
    assert found["files"] == FILES == sorted(path.name for path in (shop.folder / "t").iterdir())
    assert found["residual_um"]["before"]["max"] == pytest.approx(50, abs=0.1)  # 0.1 um/mm over 500 mm, 20000 poses
    assert found["residual_um"]["after"]["max"] < 0.002  # six decimals of a millimetre, and 32-bit floats
    assert set(found["residual_um"]["after"]["at"]) == {"X", "Y", "Z"}
    assert found["limits"] == {"tables": 2, "points": 4, "largest": 2}
    assert {each["id"] for each in found["assumptions"]} == {"LCNC-1", "LCNC-2"}


def test_emulate_reads_the_same_from_the_files(shop: Any, ncfix: Any, tables: Path) -> None:
    exported = json.loads((tables / "ncfix-tables.json").read_bytes())
    result = ncfix("emulate", "linuxcnc", tables, "-m", shop.machine, "--json")
    assert result.code == ExitCode.DONE
    assert result.json()["residual_um"] == exported["residual_um"]


def test_an_edited_file_is_run_as_it_is_and_named(shop: Any, ncfix: Any, tables: Path) -> None:
    (tables / "joint_0_X.comp").write_text("0 0.01 0.01\n500 0.01 0.01\n")
    result = ncfix("emulate", "linuxcnc", tables, "-m", shop.machine, "--json")
    assert result.code == ExitCode.FINDINGS
    assert "NCF488" in result.err
    assert result.json()["residual_um"]["after"]["max"] == pytest.approx(60, abs=0.1)  # 50 um too long, 10 more


def test_a_broken_file_is_not_run(shop: Any, ncfix: Any, tables: Path) -> None:
    (tables / "joint_0_X.comp").write_text("# X\n0 0 0\n")
    result = ncfix("emulate", "linuxcnc", tables, "-m", shop.machine)
    assert result.code == ExitCode.UNREADABLE
    assert "joint_0_X.comp:1: NCF491" in result.err


def test_tables_of_another_machine_are_refused(shop: Any, ncfix: Any, tables: Path) -> None:
    result = ncfix("emulate", "linuxcnc", tables, "-m", shop.perfect)
    assert result.code == ExitCode.REFUSED
    assert "NCF487" in result.err
    left = ncfix("emulate", "linuxcnc", tables, "-m", shop.perfect, "--other-machine", "--json").json()
    assert left["residual_um"]["after"]["max"] > 40


def test_tables_of_another_control_are_refused(shop: Any, ncfix: Any, tables: Path) -> None:
    result = ncfix("emulate", "isg", tables, "-m", shop.machine, "--other-machine")
    assert (result.code, "NCF487" in result.err) == (ExitCode.REFUSED, True)


@pytest.mark.parametrize("content", [b"", b"[]", b'{"ncfix-tables": 2}', b'{"ncfix-tables": 1}'])
def test_a_side_file_that_is_none(shop: Any, ncfix: Any, tables: Path, content: bytes) -> None:
    (tables / "ncfix-tables.json").write_bytes(content)
    result = ncfix("emulate", "linuxcnc", tables, "-m", shop.machine)
    assert (result.code, "NCF486" in result.err) == (ExitCode.UNREADABLE, True)


@pytest.mark.parametrize("gone", ["ncfix-tables.json", "joint_0_X.comp"])
def test_a_file_that_is_missing(shop: Any, ncfix: Any, tables: Path, gone: str) -> None:
    (tables / gone).unlink()
    result = ncfix("emulate", "linuxcnc", tables, "-m", shop.machine)
    assert (result.code, gone in result.err) == (ExitCode.UNREADABLE, True)


def test_nothing_is_replaced_unasked(shop: Any, ncfix: Any, tables: Path) -> None:
    before = (tables / "comp.ini").read_bytes()
    again = ("export", "linuxcnc", "-m", shop.machine, "-o", tables, "--set", "type=0")
    result = ncfix(*again)
    assert (result.code, "NCF004" in result.err) == (ExitCode.USAGE, True)
    assert (tables / "comp.ini").read_bytes() == before
    assert ncfix(*again, "--force").code == ExitCode.DONE
    assert (tables / "comp.ini").read_bytes() != before


@pytest.mark.parametrize(
    ("options", "code"),
    [
        (["--set", "sign=1"], "NCF485"),
        (["--set", "type=7"], "NCF485"),
        (["--set", "points=900"], "NCF485"),
        (["--set", "coordinates=XY"], "NCF485"),
        (["--set", "type"], "NCF001"),
        (["--range", "X=1"], "NCF483"),
        (["--range", "U=1:2"], "NCF483"),
        (["--range", "X=0:501"], "NCF483"),
        (["--target-um", "0"], "NCF001"),
    ],
)
def test_wrong_use(shop: Any, ncfix: Any, options: list[str], code: str) -> None:
    result = ncfix("export", "linuxcnc", "-m", shop.machine, "-o", shop.folder / "t", *options)
    assert (result.code, code in result.err) == (ExitCode.USAGE, True), result.err
    assert not (shop.folder / "t").exists()


def test_a_range_may_be_written_with_a_comma_or_a_colon(shop: Any, ncfix: Any) -> None:
    found = []
    for form in ("X=100,200", "X=100:200"):
        folder = shop.folder / form[5]
        assert ncfix("export", "linuxcnc", "-m", shop.machine, "-o", folder, "--range", form).code == 0
        found.append((folder / "joint_0_X.comp").read_bytes())
    assert found[0] == found[1]


def test_corrections_beyond_what_the_machine_allows(shop: Any, ncfix: Any) -> None:
    """2 um per mm: a correction of 1 mm at the end, where half a millimetre is allowed."""
    shop.machine.write_text(shop.machine.read_text().replace("1e-4", "2e-3"))
    result = ncfix("export", "isg", "-m", shop.machine, "-o", shop.folder / "t", "--force")
    assert (result.code, "NCF489" in result.err) == (ExitCode.REFUSED, True)
    assert not (shop.folder / "t").exists()


def test_the_sheet_says_what_matters(tables: Path) -> None:
    text = (tables / "hand-over.md").read_text()
    for part in (
        "What to do",
        "How to switch the tables off",
        "Range covered",
        "Class (ISO/TR 16907): L-POS",
        "LCNC-1",
    ):
        assert part in text
    page = (tables / "hand-over.html").read_text()
    assert (
        page.count("<li>")
        == page.count("</li>")
        == sum(line[:2] == "- " or line[1:3] == ". " for line in text.splitlines())
    )


def test_isg_end_to_end(shop: Any, ncfix: Any) -> None:
    folder = shop.folder / "isg"
    result = ncfix("export", "isg", "-m", shop.machine, "-o", folder, "--json").json()
    assert result["limits"]["points"] == 8
    assert result["residual_um"]["after"]["max"] < 0.01  # 1e-6 mm in the file, bilinear is exact here
    assert ncfix("emulate", "isg", folder, "-m", shop.machine).code == ExitCode.DONE


GRIDS = {"fanuc": ("sign=error",), "heidenhain-kinematics": ("sign=error", "angle_unit=deg"), "gcode": ()}


@pytest.mark.parametrize("control", GRIDS)
def test_one_figure_for_tables_and_rewritten_programs(shop: Any, ncfix: Any, control: str) -> None:
    """The corner of the shop's program on a machine that is 0.1 um per mm too long in X: 21 um at X210."""
    folder = shop.folder / control
    options = [word for each in GRIDS[control] for word in ("--set", each)]
    assert ncfix("export", control, "-m", shop.machine, "-o", folder, *options).code == ExitCode.DONE
    found = ncfix("emulate", control, folder, "-m", shop.machine, "--program", shop.program, "--assume-zero", "--json")
    error = found.json()["program"]
    assert error["error_before_um"]["max"] == pytest.approx(21, abs=0.1)
    assert error["error_after_um"]["max"] < 1.0


def test_export_writes_the_rewritten_program(shop: Any, ncfix: Any) -> None:
    arguments = ("-m", shop.machine, "-o", shop.folder / "g", "--program", shop.program, "--assume-zero")
    result = ncfix("export", "gcode", *arguments)
    assert result.code == ExitCode.DONE
    assert f"{shop.program} after: max" in result.out.decode()
    assert (shop.folder / "g" / shop.program.name).read_bytes() != shop.program.read_bytes()


def test_tables_on_top_of_a_corrected_program_are_refused(shop: Any, ncfix: Any, tables: Path) -> None:
    fixed = shop.folder / "fixed.nc"
    assert ncfix("fix", shop.program, "-m", shop.machine, "-o", fixed, "--assume-zero").code == ExitCode.DONE
    arguments = ("emulate", "linuxcnc", tables, "-m", shop.machine, "--program", fixed, "--assume-zero")
    result = ncfix(*arguments)
    assert result.code == ExitCode.REFUSED
    assert "NCF493" in result.err
    assert "corrected twice" in result.err


SCALED = '[[effect]]\nname = "EXX"\nbasis = "polynomial"\ndegree = [1, 2]\nscale = 400\ncoefficients = [0.03, 0.02]\n'


def test_so_are_those_that_lost_their_stamp(shop: Any, ncfix: Any) -> None:
    """Round numbers that were corrected are crooked, and the errors of the machine make them round again."""
    shop.machine.write_text(shop.perfect.read_text() + SCALED)
    tables, fixed = shop.folder / "tables", shop.folder / "fixed.nc"
    assert ncfix("export", "linuxcnc", "-m", shop.machine, "-o", tables).code == ExitCode.DONE
    lines = "\n".join(f"X{4 * n + n % 7} Y{n % 11}" for n in range(100))
    shop.program.write_text(f"G21 G90\nG1 F500 X0 Y0 Z0\n{lines}\nM2\n")
    assert ncfix("fix", shop.program, "-m", shop.machine, "-o", fixed, "--assume-zero").code == ExitCode.DONE
    unstamped = "".join(line for line in fixed.read_text().splitlines(keepends=True) if "ncfix" not in line)
    fixed.write_text(unstamped)
    arguments = ("emulate", "linuxcnc", tables, "-m", shop.machine, "--assume-zero", "--program")
    result = ncfix(*arguments, fixed)
    assert result.code == ExitCode.REFUSED
    assert "NCF438" in result.err
    assert "run this one without tables" in result.err
    assert ncfix(*arguments, shop.program).code == ExitCode.DONE


def test_a_machine_without_errors_leaves_programs_as_they_are(shop: Any, ncfix: Any) -> None:
    arguments = ("-m", shop.perfect, "-o", shop.folder / "g", "--program", shop.program)
    found = ncfix("export", "gcode", *arguments, "--json").json()["program"]
    assert found["error_before_um"]["max"] == found["error_after_um"]["max"] == 0
    assert (shop.folder / "g" / shop.program.name).read_bytes() == shop.program.read_bytes()


@pytest.mark.parametrize("control", ["isg", "gcode"])
def test_import_says_of_a_program_what_the_verb_says(shop: Any, ncfix: Any, control: str) -> None:
    folders = shop.folder / "verb", shop.folder / "import"
    arguments = ("-m", shop.machine, "--program", shop.program, "--assume-zero", "--json")
    said = ncfix("export", control, *arguments, "-o", folders[0]).json()["program"]
    given: dict[str, Any] = {"program": shop.program, "setup": Setup(assume_zero=True)}
    made = module.export(control, shop.machine, output=folders[1], **given)
    assert made.program is not None
    assert json.loads(json.dumps(made.program.as_dict())) == said
    written, same = ({path.name: path.read_bytes() for path in folder.iterdir()} for folder in folders)
    assert written == same == made.files
    assert (shop.program.name in written) == (control == "gcode")
    assert ncfix("emulate", control, folders[1], *arguments).json()["program"] == said
    assert module.emulate(control, folders[1], shop.machine, **given).program == made.program


def test_a_program_that_cuts_nothing_has_no_figures(shop: Any, ncfix: Any, tables: Path) -> None:
    shop.program.write_text("G21 G90\nM2\n")
    result = ncfix("emulate", "linuxcnc", tables, "-m", shop.machine, "--program", shop.program)
    assert result.code == ExitCode.DONE
    assert "make this program worse" not in result.err


TILTED = '[[effect]]\nname = "EBX"\nbasis = "polynomial"\ndegree = [1]\nscale = 100\ncoefficients = [20e-6]\n'


def test_a_program_with_other_tools_than_the_tables_hold_for_is_remarked_on(shop: Any, ncfix: Any) -> None:
    shop.machine.write_text(shop.perfect.read_text() + TILTED)
    folder = shop.folder / "t"
    arguments = ("-m", shop.machine, "-o", folder, "--tool-length", "100")
    assert ncfix("export", "isg", *arguments).code == ExitCode.DONE
    found = ncfix("emulate", "isg", folder, "-m", shop.machine, "--program", shop.program, "--assume-zero", "--json")
    remarks = found.json()["program"]["remarks"]
    assert remarks == ["The tables hold for a tool of 100 mm; this program also runs with 0 mm."]


def test_tables_for_no_tool_are_remarked_on_if_the_error_depends_on_it(shop: Any, ncfix: Any) -> None:
    shop.machine.write_text(shop.perfect.read_text() + TILTED)
    found = ncfix("export", "isg", "-m", shop.machine, "-o", shop.folder / "t", "--json").json()
    assert any("--tool-length was not given" in note for note in found["notes"])
    found = ncfix("export", "isg", "-m", shop.perfect, "-o", shop.folder / "p", "--json").json()
    assert not any("--tool-length" in note for note in found["notes"])


def test_tables_do_not_take_the_place_of_inputs(shop: Any, ncfix: Any, tables: Path) -> None:
    machine = tables / "joint_0_X.comp"
    machine.write_bytes(Path(shop.machine).read_bytes())
    result = ncfix("export", "linuxcnc", "-m", machine, "-o", tables, "--force")
    assert (result.code, "NCF005" in result.err) == (ExitCode.USAGE, True)
    assert machine.read_bytes() == Path(shop.machine).read_bytes()


def test_tables_hold_for_the_temperature_that_is_given(shop: Any, ncfix: Any) -> None:
    """No table follows a temperature: export asks for it, and emulate says what is left at another one."""
    warm = 'times = "temp_x"\ntimes_center = 20\ntimes_scale = 1\n'
    grows = f'[[effect]]\nname = "EXX"\nbasis = "polynomial"\ndegree = [1]\n{warm}coefficients = [1e-5]\n'
    shop.machine.write_text(shop.machine.read_text() + grows)
    at = ("-m", shop.machine, "--input", "temp_x=22")
    assert "NCF340" in ncfix("export", "linuxcnc", "-m", shop.machine, "-o", shop.folder / "none").err
    made = ncfix("export", "linuxcnc", *at, "-o", shop.folder / "t", "--json").json()
    assert made["residual_um"]["before"]["max"] == pytest.approx(60, abs=0.1)  # 50 um, and 2 K of 10 um/m on 500 mm
    assert made["residual_um"]["after"]["max"] < 0.002
    assert any("temp_x = 22" in note for note in made["notes"])
    assert ncfix("emulate", "linuxcnc", shop.folder / "t", *at).code == ExitCode.DONE
    other = ("emulate", "linuxcnc", shop.folder / "t", "-m", shop.machine, "--input", "temp_x=24", "--json")
    assert "NCF487" in ncfix(*other).err
    left = ncfix(*other, "--other-machine").json()["residual_um"]["after"]["max"]
    assert left == pytest.approx(10, abs=0.1)
