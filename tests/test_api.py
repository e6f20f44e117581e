"""`import ncfix`: the page that shows it runs, nothing heavy is imported early, no file is touched unasked."""

from __future__ import annotations

import inspect
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import ncfix
from ncfix.control.setup import Setup
from ncfix.diagnostics import RefusedError, UsageError

SETUP = Setup(assume_zero=True, no_point="calculator")


@pytest.fixture
def shop(tmp_path: Path, root: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copy(root / "examples/machines/three_axis.toml", tmp_path / "machine.toml")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_page_runs(shop: Path, root: Path) -> None:
    blocks = re.findall(r"```python\n(.*?)```", (root / "docs/api.md").read_text(), re.DOTALL)
    assert len(blocks) >= 8
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, "docs/api.md", "exec"), names)
    written = {path.name for path in shop.iterdir()}
    assert written == {"machine.toml", "part.fixed.nc", "tables", "machine.html"}


def test_the_page_names_every_function(root: Path) -> None:
    page = (root / "docs/api.md").read_text()
    assert len(ncfix.FUNCTIONS) == 11
    for name in ncfix.FUNCTIONS:
        assert f"| `{name}(" in page
        assert inspect.getdoc(getattr(ncfix, name))


def test_nothing_heavy_is_imported() -> None:
    code = (
        "import sys, ncfix; print(sorted(m for m in ('numpy', 'scipy', 'lark', 'click', 'pluggy') if m in sys.modules))"
    )
    made = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert made.stdout.strip() == "[]"


def test_an_attribute_that_is_not_there() -> None:
    with pytest.raises(AttributeError, match="no attribute 'fixx'"):
        ncfix.fixx  # noqa: B018


def test_what_is_refused_is_not_written(shop: Path) -> None:
    text = "G21 G90 G54\nG0 X0. Y0. Z5.\nG33 Z-5. K1.\nM30\n"
    program = ncfix.read_program(text=text, dialect="iso")
    fixed = ncfix.fix(program, "machine.toml", setup=SETUP)
    assert [each.line for each in fixed.report.refused] == [3]
    with pytest.raises(RefusedError):
        ncfix.fix(program, "machine.toml", setup=SETUP, output="out.nc")
    assert not (shop / "out.nc").exists()
    ncfix.fix(program, "machine.toml", setup=SETUP, output="out.nc", allow_refused=True)
    with pytest.raises(UsageError, match="NCF004"):
        ncfix.fix(program, "machine.toml", setup=SETUP, output="out.nc", allow_refused=True)


def test_subprograms_beside_a_program_and_of_a_text(shop: Path) -> None:
    main = "O1\nG21 G90 G54\nG0 X0. Y0. Z5.\nM98 P100\nM30\n"
    Path("100.nc").write_text("O100\nG1 X5. F100.\nM99\n")
    Path("main.nc").write_text(main)
    assert ncfix.simulate("main.nc", "machine.toml", setup=SETUP).line is not None
    with pytest.raises(Exception, match="100"):
        ncfix.simulate(ncfix.read_program(text=main), "machine.toml", setup=SETUP)
    found = ncfix.simulate(ncfix.read_program(Path("main.nc")), Path("machine.toml"), setup=SETUP)
    assert os.listdir(shop)
    assert found.max_um is not None


def test_a_path_or_a_text_and_not_both() -> None:
    for given in ({}, {"source": "part.nc", "text": "M30\n"}):
        for function in (ncfix.read_program, ncfix.load_machine):
            with pytest.raises(TypeError, match="a path or a text is needed, and not both"):
                function(**given)


def test_a_machine_that_cannot_be_makes_nothing_unless_forced(shop: Path) -> None:
    effect = '\n[[effect]]\nname = "EYX"\nbasis = "constant"\ncoefficients = [80.0]\n'
    text = (shop / "machine.toml").read_text() + effect
    (shop / "odd.toml").write_text(text)
    program = ncfix.read_program(text="G21 G90 G94\nG0 X1 Y1 Z1\nG1 X5 F100\nM2\n", dialect="linuxcnc")
    for make in (
        lambda force: ncfix.fix(program, "odd.toml", setup=SETUP, force=force),
        lambda force: ncfix.export("linuxcnc", "odd.toml", output="out", force=force),
    ):
        with pytest.raises(RefusedError, match="NCF324") as caught:
            make(False)
        assert {each.place.path for each in caught.value.messages if each.place} == {"odd.toml"}
    assert not (shop / "out").exists()


def test_tables_are_written_all_or_none(shop: Path) -> None:
    made = ncfix.export("isg", "machine.toml", tool_length=120.0)
    last = sorted(made.files)[-1]
    (shop / "out").mkdir()
    (shop / "out" / last).write_text("mine")
    with pytest.raises(UsageError, match="NCF004"):
        ncfix.export("isg", "machine.toml", tool_length=120.0, output="out")
    assert [path.name for path in (shop / "out").iterdir()] == [last]
    assert (shop / "out" / last).read_text() == "mine"
