"""Where outputs go: never onto an input, never onto each other, never unasked onto what is there."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from ncfix.cli.targets import Outputs, OutputTarget, targets
from ncfix.diagnostics import UsageError


@pytest.fixture
def parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a/part.ngc, b/part.ngc and c.ngc, which is the current one."""
    monkeypatch.chdir(tmp_path)
    for name in ("a/part.ngc", "b/part.ngc", "c.ngc"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(name.encode())
    return tmp_path


def paths(*sources: str, output: str | None = None, in_place: bool = False, force: bool = False) -> list[str]:
    return [target.path for target in targets(sources, Outputs(output, in_place, force))]


def code(*sources: str, output: str | None = None, in_place: bool = False, force: bool = False) -> str:
    with pytest.raises(UsageError) as caught:
        targets(sources, Outputs(output, in_place, force))
    return caught.value.code


def test_one_program_goes_to_the_file_named(parts: Path) -> None:
    assert paths("c.ngc", output="new.ngc") == ["new.ngc"]


@pytest.mark.parametrize("output", ["a/", "out/", "a"])
def test_a_folder_keeps_the_names(parts: Path, output: str) -> None:
    assert paths("c.ngc", output=output) == [os.path.join(output, "c.ngc")]


def test_many_programs_make_a_folder_of_the_output(parts: Path) -> None:
    assert paths("c.ngc", "a/part.ngc", output="out") == ["out/c.ngc", "out/part.ngc"]


def test_standard_streams(parts: Path) -> None:
    assert paths("-") == ["-"]
    assert paths("c.ngc", output="-") == ["-"]
    assert paths("-", output="new.ngc") == ["new.ngc"]


def test_in_place_keeps_the_name(parts: Path) -> None:
    (target,) = targets(["c.ngc"], Outputs(None, True))
    assert (target.path, target.backup) == ("c.ngc", "c.ngc.orig")


def test_no_output_is_an_error(parts: Path) -> None:
    assert code("c.ngc") == "NCF003"
    assert code("-", output="out/") == "NCF003"


def test_an_existing_output_needs_force(parts: Path) -> None:
    assert code("c.ngc", output="a/part.ngc") == "NCF004"
    assert paths("c.ngc", output="a/part.ngc", force=True) == ["a/part.ngc"]


@pytest.mark.parametrize("force", [False, True])
def test_an_input_is_never_an_output(parts: Path, force: bool) -> None:
    assert code("c.ngc", output="c.ngc", force=force) == "NCF005"
    assert code("c.ngc", "a/part.ngc", output="a", force=force) == "NCF005"
    assert code("c.ngc", output=".", force=force) == "NCF005"
    os.link("c.ngc", "second-name.ngc")
    assert code("c.ngc", output="second-name.ngc", force=force) == "NCF005"


@pytest.mark.parametrize("force", [False, True])
def test_a_symbolic_link_is_not_written_through(parts: Path, force: bool) -> None:
    os.symlink("a/part.ngc", "link.ngc")
    os.symlink("nowhere", "dangling.ngc")
    assert code("c.ngc", output="link.ngc", force=force) == "NCF005"
    assert code("c.ngc", output="dangling.ngc", force=force) == "NCF005"
    assert code("link.ngc", in_place=True, force=force) == "NCF005"


@pytest.mark.skipif(not os.path.exists("/dev/null"), reason="this system has no /dev/null")
def test_a_device_is_not_replaced(parts: Path) -> None:
    assert code("c.ngc", output="/dev/null", force=True) == "NCF005"


def test_outputs_of_one_name_clash(parts: Path) -> None:
    assert code("a/part.ngc", "b/part.ngc", output="out") == "NCF006"
    assert code("a/part.ngc", "c.ngc", output="-") == "NCF006"


@pytest.mark.parametrize("force", [False, True])
def test_in_place_never_loses_an_original(parts: Path, force: bool) -> None:
    Path("c.ngc.orig").touch()
    assert code("c.ngc", in_place=True, force=force) == "NCF008"
    assert code("-", in_place=True, force=force) == "NCF005"


def test_in_place_and_an_output_contradict_each_other(parts: Path) -> None:
    assert code("c.ngc", output="out.ngc", in_place=True) == "NCF011"


def test_a_file_is_no_folder(parts: Path) -> None:
    assert code("c.ngc", output="a/part.ngc/new.ngc") == "NCF007"
    assert code("c.ngc", "a/part.ngc", output="b/part.ngc") == "NCF007"


def test_nothing_is_made_while_targets_are_looked_for(parts: Path) -> None:
    paths("c.ngc", output="deep/in/there/")
    assert sorted(path.name for path in parts.iterdir()) == ["a", "b", "c.ngc"]


def test_a_target_writes_where_it_says(parts: Path) -> None:
    OutputTarget("c.ngc", "out/c.ngc").write(b"new")
    assert Path("out/c.ngc").read_bytes() == b"new"
    OutputTarget("c.ngc", "c.ngc", in_place=True).write(b"new")
    assert (Path("c.ngc").read_bytes(), Path("c.ngc.orig").read_bytes()) == (b"new", b"c.ngc")
