"""The recipes of docs/guide/post.md: a test plays the post, writes a program, and makes the recipe's call."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import missing
from ncfix.cli.main import run

PROGRAM = "shop/bracket.nc"


@pytest.fixture
def recipes(root: Path) -> dict[str, str]:
    """The code of each recipe, by the name of the CAM system."""
    page = (root / "docs/guide/post.md").read_text().split("## Recipes", 1)[1]
    return dict(re.findall(r"^### (.+?)\n.*?^```\w+\n(.*?)^```$", page, re.MULTILINE | re.DOTALL))


@pytest.fixture
def yard(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The example of the guide with a project, before anything is posted."""
    folder = tmp_path / "mill"
    shutil.copytree(root / "examples/guide", folder)
    (folder / PROGRAM).rename(folder / "to-be-posted")
    monkeypatch.chdir(folder)
    assert run(["init", "-m", "mill.toml", "--setup", "setup.toml", "-o", "corrected"]) == 0
    return folder


def post(folder: Path) -> str:
    """What a CAM system does: write the program; its path."""
    shutil.copy(folder / "to-be-posted", folder / PROGRAM)
    return str(folder / PROGRAM)


def called(command: list[str], folder: Path, **more: str) -> int:
    """Run a command as a post does, ncfix being on the path."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(command, cwd=folder, env={**os.environ, "PATH": path, **more}, check=False)
    return done.returncode


def batch_file(text: str, folder: Path, *arguments: str, **variables: str) -> int:
    """Run the few commands of a Windows batch file that the recipes use."""
    for number, argument in enumerate(arguments, 1):
        text = text.replace(f"%~{number}", argument)
    text = text.replace("%*", " ".join(f'"{argument}"' for argument in arguments))
    for name, value in variables.items():
        text = text.replace(f"%{name}%", value)
    code = 0
    for line in text.splitlines():
        if line.startswith("if errorlevel 1 exit /b"):
            if code:
                return code
        else:
            code = called(["sh", "-c", line.removeprefix("call ")], folder)
    return code


def assert_corrected(folder: Path) -> None:
    assert " MACHINE " in (folder / "corrected" / PROGRAM).read_text().splitlines()[2]


def spoil(folder: Path) -> None:
    """Make the next program one that cannot be read."""
    (folder / "to-be-posted").write_text("O1\nG1 X1 Y..2\nM30\n")


def test_fusion(recipes: dict[str, str], yard: Path) -> None:
    call = re.search(r'execute\("(\w+)", (.+), true, ""\)', recipes["Fusion"])
    assert call
    path = post(yard)
    text = "".join(
        path if part.strip() == "getOutputPath()" else part.strip()[1:-1].replace('\\"', '"')
        for part in call[2].split(" + ")
    )
    command = [call[1], *shlex.split(text)]
    assert called(command, yard.parent) == 0
    assert_corrected(yard)
    spoil(yard)
    post(yard)
    assert called(command, yard.parent) == 3


def test_nx(recipes: dict[str, str], yard: Path) -> None:
    if not shutil.which("tclsh"):
        missing("tclsh (Debian: tcl) is not installed", "NCFIX_REQUIRE_TOOLS")
    script = yard / "post.tcl"
    nx = "proc MOM_close_output_file {name} {}\nproc MOM_abort {text} { puts $text; exit 9 }\n"
    script.write_text(f"{nx}{recipes['NX']}set ptp_file_name {{{post(yard)}}}\nPB_CMD_ncfix\n")
    assert called(["tclsh", str(script)], yard) == 0
    assert_corrected(yard)
    spoil(yard)
    post(yard)
    assert called(["tclsh", str(script)], yard) == 9


def test_mastercam(recipes: dict[str, str], yard: Path) -> None:
    assert batch_file(recipes["Mastercam"], yard, post(yard)) == 0
    assert_corrected(yard)
    spoil(yard)
    assert batch_file(recipes["Mastercam"], yard, post(yard)) == 3


def test_hypermill(recipes: dict[str, str], yard: Path) -> None:
    settings = {"POSTPROCESSOR": f"cp to-be-posted {PROGRAM}; true", "NC_FILE": PROGRAM}
    assert batch_file(recipes["hyperMILL"], yard, "part.pof", **settings) == 0
    assert_corrected(yard)
    spoil(yard)
    assert batch_file(recipes["hyperMILL"], yard, "part.pof", **settings) == 3
    settings["POSTPROCESSOR"] = "false"
    assert batch_file(recipes["hyperMILL"], yard, "part.pof", **settings) == 1


def test_solidcam(recipes: dict[str, str], yard: Path) -> None:
    assert batch_file(recipes["SolidCAM"], yard, post(yard)) == 0
    assert_corrected(yard)
    assert '"output": "corrected/shop/bracket.nc"' in (yard / f"{PROGRAM}.json").read_text()
    spoil(yard)
    assert batch_file(recipes["SolidCAM"], yard, post(yard)) == 3


def test_a_pipe(recipes: dict[str, str], yard: Path) -> None:
    (yard / "post").write_text("#!/bin/sh\ncat to-be-posted\n")
    (yard / "post").chmod(0o755)
    assert called(["sh", "-c", f"PATH=.:$PATH; {recipes['Any other']}"], yard) == 0
    assert " MACHINE " in (yard / "part.nc").read_text().splitlines()[2]
    spoil(yard)
    assert called(["sh", "-c", f"PATH=.:$PATH; {recipes['Any other']}"], yard) == 3
    assert not (yard / "part.nc").exists()


def test_a_program_is_posted_again(recipes: dict[str, str], yard: Path) -> None:
    for x in ("-60.", "-61."):
        text = (yard / "to-be-posted").read_text()
        (yard / "to-be-posted").write_text(text.replace("X-60.", f"X{x}"))
        assert batch_file(recipes["Mastercam"], yard, post(yard)) == 0
    assert "X-60.99" in (yard / "corrected" / PROGRAM).read_text()
