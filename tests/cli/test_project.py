"""The project file: what it says are defaults, the environment wins over it, and options over both."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cli.conftest import LONG_X, PROGRAM, THREE_AXIS
from ncfix.batch.journal import JOURNAL
from ncfix.diagnostics import ExitCode

TWICE = LONG_X.replace("1e-4", "2e-4")


@pytest.fixture
def yard(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with two machines, a project, and programs in folders below."""
    (tmp_path / "mill.toml").write_text(THREE_AXIS.format(effects=LONG_X))
    (tmp_path / "other.toml").write_text(THREE_AXIS.format(effects=TWICE))
    (tmp_path / "ncfix.toml").write_text('machine = "mill.toml"\noutput = "done"\n[options]\nassume_zero = true\n')
    for name in ("jobs/a/part.ngc", "jobs/b/part.ngc", "jobs/plate.ngc"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(PROGRAM)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def outputs(folder: Path) -> dict[str, str]:
    """Which machine each output is for, by the X of a block."""
    found = {str(path.relative_to(folder)): path.read_text() for path in folder.rglob("*.ngc")}
    return {
        name: "mill" if "X109.989" in text else "other" if "X109.978" in text else "?" for name, text in found.items()
    }


def test_a_post_names_the_program_only(ncfix: Any, yard: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(yard.parent)
    result = ncfix("fix", yard / "jobs/a/part.ngc")
    assert result.code == ExitCode.DONE, result.err
    assert "ncfix.toml: options that the command line does not give come from this file\n" in result.err
    assert outputs(yard / "done") == {"jobs/a/part.ngc": "mill"}
    assert "ncfix.toml" not in ncfix("fix", yard / "jobs/plate.ngc", "-q").err


def test_programs_of_the_same_name_keep_apart(ncfix: Any, yard: Path) -> None:
    assert ncfix("fix", "jobs").code == ExitCode.DONE
    assert set(outputs(yard / "done")) == {"jobs/a/part.ngc", "jobs/b/part.ngc", "jobs/plate.ngc"}
    assert (yard / "done" / JOURNAL).exists()


def test_an_option_wins_over_the_environment_and_that_over_the_file(
    ncfix: Any, yard: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NCFIX_OUTPUT", "second/")
    monkeypatch.setenv("NCFIX_MACHINE", "other.toml")
    assert ncfix("fix", "jobs/plate.ngc").code == ExitCode.DONE
    assert outputs(yard / "second") == {"plate.ngc": "other"}
    assert ncfix("fix", "jobs/plate.ngc", "-m", "mill.toml", "-o", "third/").code == ExitCode.DONE
    assert outputs(yard / "third") == {"plate.ngc": "mill"}
    assert not (yard / "done").exists()


def test_tables_of_a_program_need_no_options_and_are_no_corrected_programs(ncfix: Any, yard: Path) -> None:
    traced = ncfix("trace", "jobs/plate.ngc")
    assert traced.code == ExitCode.DONE, traced.err
    assert b",tip_x," in traced.out
    assert "ncfix.toml" in traced.err
    simulated = ncfix("simulate", "--program", "jobs/plate.ngc")
    assert simulated.code == ExitCode.DONE, simulated.err
    assert simulated.out.startswith(b"tip error: max ")
    assert not (yard / "done").exists()
    assert ncfix("simulate", "--program", "jobs/plate.ngc", "--no-project").code == ExitCode.USAGE
    assert ncfix("simulate", "--plan", "poses.csv").code == ExitCode.USAGE


def test_without_the_file(ncfix: Any, yard: Path) -> None:
    result = ncfix("fix", "jobs/plate.ngc", "--no-project")
    assert result.code == ExitCode.USAGE
    assert "--machine" in result.err


@pytest.mark.parametrize("how", ["option", "environment"])
def test_a_file_that_is_named(
    ncfix: Any, yard: Path, tmp_path: Path, how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = yard / "settings"
    place.mkdir()
    (place / "shop.toml").write_text('machine = "../other.toml"\noutput = "out"\n[options]\nassume_zero = true\n')
    if how == "environment":
        monkeypatch.setenv("NCFIX_PROJECT", str(place / "shop.toml"))
    named = ["--project", "settings/shop.toml"] if how == "option" else []
    assert ncfix("fix", "jobs/plate.ngc", *named).code == ExitCode.DONE
    assert outputs(place / "out") == {"plate.ngc": "other"}


def test_settings_by_pattern(ncfix: Any, yard: Path) -> None:
    with (yard / "ncfix.toml").open("a") as handle:
        handle.write('[[programs]]\nmatch = ["*/b/*", "jobs/PLATE*"]\nmachine = "other.toml"\n')
        handle.write('[[programs]]\nmatch = "*"\noutput = "rest"\n')
    result = ncfix("fix", "jobs", "--json")
    assert result.code == ExitCode.DONE
    assert outputs(yard / "done") == {"jobs/b/part.ngc": "other", "jobs/plate.ngc": "other"}
    assert outputs(yard / "rest") == {"jobs/a/part.ngc": "mill"}
    assert "3 programs: 3 written, 0 not" in result.err
    assert len(result.json()["files"]) == 3
    assert len(ncfix("check", "jobs", "--json").json()["files"]) == 3


def test_outputs_of_all_groups_are_no_programs_the_next_night(ncfix: Any, yard: Path) -> None:
    (yard / "ncfix.toml").write_text(
        'machine = "mill.toml"\noutput = "done"\n[options]\nassume_zero = true\nresume = true\n'
        '[[programs]]\nmatch = "jobs/b/*"\nmachine = "other.toml"\noutput = "rest"\n'
    )
    assert ncfix("fix", ".").code == ExitCode.DONE
    result = ncfix("fix", ".", "--json")
    assert result.code == ExitCode.DONE, result.err
    assert [each["resumed"] for each in result.json()["files"]] == [True] * 3
    assert result.err.count("options that the command line does not give") == 1
    assert len(ncfix("check", ".", "--json").json()["files"]) == 3
    assert len(ncfix("check", "rest", "--json").json()["files"]) == 1


def test_the_nearest_file_counts(ncfix: Any, yard: Path) -> None:
    (yard / "jobs/b/ncfix.toml").write_text(
        'machine = "../../other.toml"\noutput = "."\n[options]\nassume_zero = true\n'
    )
    assert ncfix("fix", "jobs/b/part.ngc").code == ExitCode.USAGE
    (yard / "jobs/b/ncfix.toml").write_text(
        'machine = "../../other.toml"\noutput = "x"\n[options]\nassume_zero = true\n'
    )
    assert ncfix("fix", "jobs").code == ExitCode.DONE
    assert outputs(yard / "done") == {"jobs/a/part.ngc": "mill", "jobs/plate.ngc": "mill"}
    assert outputs(yard / "jobs/b/x") == {"part.ngc": "other"}


def test_a_program_that_is_posted_again_is_corrected_again(ncfix: Any, yard: Path) -> None:
    (yard / "ncfix.toml").write_text(
        'machine = "mill.toml"\noutput = "done"\n[options]\nassume_zero = true\nresume = true\n'
    )
    for x in (b"110.000", b"120.000"):
        (yard / "jobs/plate.ngc").write_bytes(PROGRAM.replace(b"110.000", x))
        assert ncfix("fix", "jobs/plate.ngc").code == ExitCode.DONE
    assert b"X119.988" in (yard / "done/jobs/plate.ngc").read_bytes()


def test_standard_input_and_output(ncfix: Any, yard: Path) -> None:
    result = ncfix("fix", "-", stdin=PROGRAM)
    assert result.code == ExitCode.DONE
    assert b"X109.989" in result.out


def test_verify_and_check_know_the_machine(ncfix: Any, yard: Path) -> None:
    ncfix("fix", "jobs/plate.ngc")
    assert ncfix("verify", "jobs/plate.ngc", "done/jobs/plate.ngc").code == ExitCode.DONE
    assert "NCF409" in ncfix("check", "jobs/plate.ngc").err
    assert "NCF409" not in ncfix("check", "jobs/plate.ngc", "--no-project").err


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("machin = 'mill.toml'", "machin: there is no such key"),
        ("\n\nmachine = 3", "ncfix.toml:3"),
        ("machine = 'a", "not TOML"),
        ("[options]\ntolerance = 2", "did you mean tolerance_um?"),
        ("[options]\nflatten = 2", "neither true nor false"),
        ("[options]\ntolerance_um = 'x'", "ncfix.toml:2:1: NCF028: tolerance_um: 'x' is not a number above zero"),
        ("[options]\ntolerance_um = [1, 2]", "tolerance_um: 2 values"),
        ("[options]\ntolerance_um = { a = 1 }", "neither a text nor a number"),
        ("[options]\ntolerance_um = 2020-01-01", "neither a text nor a number"),
        ("[options]\nstrategy = true", "neither a text nor a number"),
        ("[options]\njobs = 2.5", "NCF028: jobs: "),
        ("[options]\noffset = 3", "NCF028: offset: '3' has no ="),
        ("[options]\nforce = true", "NCF028: force: can be given on the command line"),
        ("[options]\nin_place = true", "hint: --in-place"),
        ("[options]\nexecutor = 'dask://elsewhere:8786'", "NCF028: executor: can be given on the command line"),
        ("setup = ''", "NCF028: setup: the text is empty"),
        ('output = "a\\u0000b"', "contains a NUL character"),
        ("\n[[programs]]\nmatch = '*'\ntool_table = ''", "ncfix.toml:4:1"),
        ("[options]\ntool = '1=1'\n[[programs]]\nmatch='*'\n[programs.options]\ntool = '1'", "ncfix.toml:6:1"),
        ("programs = 3", "list of tables"),
        ("[[programs]]\nmachine = 'x'", "needs match"),
        ("options = 3", "must be a table"),
    ],
)
def test_what_is_wrong_is_named(ncfix: Any, yard: Path, text: str, said: str) -> None:
    (yard / "ncfix.toml").write_text(text)
    result = ncfix("fix", "jobs/plate.ngc", "-m", "mill.toml", "-o", "x.ngc")
    assert result.code in (ExitCode.UNREADABLE, ExitCode.USAGE)
    assert said in result.err
    assert not (yard / "x.ngc").exists()
    assert (yard / "jobs/plate.ngc").read_bytes() == PROGRAM
    assert "NCF000" not in result.err


def test_init_writes_what_fix_needs(ncfix: Any, yard: Path) -> None:
    (yard / "other.toml").unlink()
    (yard / "setup.toml").write_text("assume_zero = true\n\n[tools]\n1 = { length = 100.0 }\n")
    result = ncfix("init")
    assert result.code == ExitCode.USAGE
    assert "NCF004" in result.err
    (yard / "ncfix.toml").unlink()
    result = ncfix("init", ".")
    assert result.code == ExitCode.DONE, result.err
    assert 'machine = "mill.toml"\nsetup = "setup.toml"\noutput = "corrected"\n' in (yard / "ncfix.toml").read_text()
    assert ncfix("fix", "jobs/plate.ngc").code == ExitCode.DONE
    assert outputs(yard / "corrected") == {"jobs/plate.ngc": "mill"}


@pytest.mark.parametrize("output", ["", "-"])
def test_init_takes_a_folder_for_outputs_only(ncfix: Any, yard: Path, output: str) -> None:
    (yard / "ncfix.toml").unlink()
    result = ncfix("init", yard, "-m", "mill.toml", "-o", output)
    assert (result.code, "NCF003" in result.err) == (ExitCode.USAGE, True)
    assert not (yard / "ncfix.toml").exists()


def test_init_asks_nobody_where_nobody_is(ncfix: Any, tmp_path: Path) -> None:
    result = ncfix("init", tmp_path)
    assert result.code == ExitCode.USAGE
    assert "--machine" in result.err
    assert list(tmp_path.iterdir()) == []
