"""Every message code is explained, and every explained code is used."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from ncfix.cli.listings import all_codes
from ncfix.diagnostics import ExitCode


def used_codes(root: Path) -> set[str]:
    """The codes that stand in the sources, the tables of codes left out."""
    sources = [path for folder in ("src", "plugins") for path in (root / folder).rglob("*.py")]
    texts = [path.read_text() for path in sources if not path.name.endswith("codes.py")]
    return {code for text in texts for code in re.findall(r"[\"'](NCF\d{3})[\"']", text)}


def test_every_code_is_explained(root: Path) -> None:
    assert used_codes(root) - all_codes().keys() == set()


def test_every_explained_code_is_used(root: Path) -> None:
    assert all_codes().keys() - used_codes(root) == set()


def test_no_code_has_two_meanings(root: Path) -> None:
    sources = [path for folder in ("src", "plugins") for path in (root / folder).rglob("*codes.py")]
    found = [code for path in sources for code in re.findall(r'"(NCF\d{3})": Code\(', path.read_text())]
    assert sorted(found) == sorted(set(found))
    assert set(all_codes()) - set(found) == set()


@pytest.mark.parametrize(("code", "entry"), all_codes().items())
def test_an_explanation_says_something(code: str, entry: Any) -> None:
    assert re.fullmatch(r"NCF[0-6]\d\d", code)
    assert 5 <= len(entry.title) <= 90
    assert len(entry.text) >= 20


def test_explain_prints_title_text_and_hint(ncfix: Any) -> None:
    entry = all_codes()["NCF004"]
    out = ncfix("explain", "ncf004").out.decode()
    assert out.startswith(f"NCF004: {entry.title}\n")
    assert entry.text in out
    assert entry.hint in out
    listed = ncfix("explain", "NCF004", "--json").json()["codes"]
    assert listed == [{"code": "NCF004", "title": entry.title, "text": entry.text, "hint": entry.hint}]


def test_explain_lists_all_codes(ncfix: Any) -> None:
    assert [entry["code"] for entry in ncfix("explain", "--json").json()["codes"]] == list(all_codes())
    assert len(ncfix("explain").out.splitlines()) == len(all_codes()) + 1


def test_an_unknown_code_is_wrong_use(ncfix: Any) -> None:
    result = ncfix("explain", "NCF99")
    assert result.code == ExitCode.USAGE
    assert "NCF009" in result.err
