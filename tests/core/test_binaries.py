"""A binary is used only if it was made of the sources that are there."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from shutil import copyfile

import pytest

from ncfix import core


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The sources of the core, and something that passes for a binary of them."""
    for path in (*core.FOLDER.glob("*.py"), *core.FOLDER.glob("*.pxd")):
        copyfile(path, tmp_path / path.name)
    monkeypatch.setattr(core, "FOLDER", tmp_path)
    monkeypatch.delenv(core.WISH, raising=False)
    (tmp_path / f"scan{EXTENSION_SUFFIXES[0]}").touch()
    (tmp_path / "compiled.txt").write_text(core.digest(tmp_path) + "\n")
    core.fault.cache_clear()
    core.use(None)
    yield tmp_path
    core.fault.cache_clear()


def test_a_binary_of_these_sources_is_used(folder: Path) -> None:
    for path in folder.glob("*.p*"):  # as after a checkout on Windows
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert core.engaged()
    assert core.status() == "compiled"


@pytest.mark.parametrize("name", ["words.py", "words.pxd", "compiled.txt"])
@pytest.mark.parametrize("edit", [True, False])
def test_a_binary_of_other_sources_is_not(name: str, edit: bool, folder: Path) -> None:
    path = folder / name
    if edit:
        path.write_text(path.read_text() + "# other")
    else:
        path.unlink()
    assert not core.engaged()
    assert core.status().startswith("compiled from other sources than these, and not used")
    with pytest.raises(core.UnusableCoreError):
        core.use("compiled")


def test_without_a_binary_all_is_as_before(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / f"scan{EXTENSION_SUFFIXES[0]}").unlink()
    assert not core.engaged()
    monkeypatch.setenv(core.WISH, "compiled")
    core.use(None)
    with pytest.raises(core.UnusableCoreError, match="NCFIX_CORE=compiled, but the core is not compiled"):
        core.engaged()
