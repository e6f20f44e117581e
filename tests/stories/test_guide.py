"""The guide (docs/guide): every command of a page prints what the page shows, and its excerpts are of real files."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from stories.story import GUIDE, alike, run, steps

PAGES = ("batch", "calibrate", "correct", "diagnose", "export", "machine", "post")
EXCERPT = re.compile(r"^```(?:nc|toml|csv)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_all_pages_are_run(root: Path) -> None:
    assert {path.stem for path in (root / "docs" / "guide").glob("[a-z]*.md")} == set(PAGES)


@pytest.mark.parametrize("name", PAGES)
def test_a_page_shows_what_its_commands_print(root: Path, tmp_path: Path, name: str) -> None:
    """Else: `python -m tests.stories NAME` writes the page anew. Every line of an excerpt is in some file then."""
    page = (root / "docs" / "guide" / f"{name}.md").read_text()
    folder = tmp_path / "guide"
    shutil.copytree(root / GUIDE, folder)
    for step in steps(page):
        printed = run(step.command, folder)
        assert alike(step.shown, printed), f"{step.command}\n" + "\n".join(printed)
    files = (path for path in folder.rglob("*") if path.suffix in {".nc", ".toml", ".csv"})
    lines = {line for path in files for line in path.read_text().splitlines()}
    for excerpt in EXCERPT.findall(page):
        assert set(excerpt.splitlines()) <= lines
