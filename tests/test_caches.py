"""Where what can be made again is kept, and where no user's own cache can be."""

from __future__ import annotations

from pathlib import Path

import pytest

from ncfix.host import cache_folders
from ncfix.text import grammar


@pytest.fixture
def homeless(monkeypatch: pytest.MonkeyPatch) -> None:
    def home() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", home)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)


def test_beside_a_module_then_in_the_cache_of_the_user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert list(cache_folders("/some/where/module.py")) == [Path("/some/where/__pycache__"), tmp_path / "ncfix"]


@pytest.mark.usefixtures("homeless")
def test_without_a_home_beside_a_module_alone() -> None:
    assert list(cache_folders("/some/where/module.py")) == [Path("/some/where/__pycache__")]


@pytest.mark.usefixtures("homeless")
def test_without_a_home_grammars_are_read_all_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "__pycache__").touch()  # no folder can be made
    monkeypatch.setattr(grammar, "__file__", str(tmp_path / "grammar.py"))
    assert grammar.place_of_tables(grammar.find_grammar("linuxcnc.lark")) is None
