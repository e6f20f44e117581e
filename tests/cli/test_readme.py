"""README's first command does what the page shows: the lines that are printed, and the blocks before and after."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from ncfix.cli.main import cli


@pytest.fixture(scope="module")
def corrected(root: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, list[str]]:
    """What `./try` prints, with its own name for the output, and the lines of the corrected program."""
    script = re.sub(r"\\\n\s*", "", (root / "try").read_text())
    found = re.search(r"exec \.venv/bin/ncfix (fix examples/.*)", script)
    assert found
    output = tmp_path_factory.mktemp("try")
    arguments = [
        str(root / each) if each.startswith("examples/") else f"{output}/" if each == "out/" else each
        for each in shlex.split(found[1])
    ]
    result = CliRunner().invoke(cli, arguments)
    assert result.exit_code == 0, result.output
    printed = result.output.replace(f"{output}/", "out/").replace(f"{root}/", "")
    return printed, (output / "blade.nc").read_text("latin-1").splitlines()


def test_what_is_printed(root: Path, corrected: tuple[str, list[str]]) -> None:
    assert f"```\n{corrected[0].strip()}\n```" in (root / "README.md").read_text()


def test_the_blocks_before_and_after(root: Path, corrected: tuple[str, list[str]]) -> None:
    shown = re.findall(r"^(N\d+ .*?) {3,}(?:-> +)?(N\d+ .*)$", (root / "README.md").read_text(), re.MULTILINE)
    assert len(shown) == 3
    given = (root / "examples/programs/blade.nc").read_text("latin-1").splitlines()
    for before, after in shown:
        assert before in given
        assert after in corrected[1]
