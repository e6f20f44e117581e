"""`ncfix doctor`, and the manual page and completion scripts that the package brings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from ncfix import core
from ncfix.cli import doctor
from ncfix.cli.main import VERBS
from ncfix.cli.manual import ENVIRONMENT, page, shared_files
from ncfix.diagnostics import ExitCode


@pytest.fixture(autouse=True)
def plain_core(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NCFIX_CORE", "plain")
    core.use(None)


def test_what_is_as_it_should_be(ncfix: Any) -> None:
    result = ncfix("doctor", "--json")
    found = {each["what"]: each for each in result.json()["findings"]}
    assert {"ncfix", "Python", "computer", "numpy", "rich", "plugin iso", "cache", "core"} <= set(found)
    assert "NCFIX_CORE=plain" in found["environment"]["found"]
    assert [each for each in found.values() if each["wrong"]] == []
    assert result.code == ExitCode.DONE
    assert core.status() in ncfix("doctor").out.decode()


def test_a_form_of_the_core_that_there_is_not(ncfix: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NCFIX_CORE", "fast")
    core.use(None)
    result = ncfix("plugins")
    assert result.code == ExitCode.USAGE
    assert "NCF001: NCFIX_CORE is 'fast'; it may be 'plain' or 'compiled'\n  hint: unset NCFIX_CORE" in result.err


def test_packages_that_are_missing_or_too_old_are_wrong_and_those_of_extras_are_not() -> None:
    lines = ["lark>=1.2", "numpy!=2.0,>=1.26", "pluggy", "cython<4,>=3.2; extra == 'dev'", 'ruff>=0.9 ; extra == "dev"']
    found = {each.what: each for each in doctor.packages(lines, {"lark": "1.3", "numpy": "1.2"}.get)}
    assert {name: each.wrong for name, each in found.items() if each.wrong} == {
        "numpy": "ncfix needs 1.26 or later",
        "pluggy": "pip install 'pluggy'",
    }
    assert {*found} == {"lark", "numpy", "pluggy", *doctor.EXTRAS}


def test_a_disk_that_is_full(ncfix: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from ncfix import files

    def full(path: str, *_: Any) -> None:
        raise files.unwritable(path, OSError(28, "No space left on device"))

    monkeypatch.setattr(files, "write_whole", full)
    result = ncfix("doctor")
    assert (result.code, "WRONG: make room" in result.out.decode()) == (ExitCode.FINDINGS, True)


def test_a_folder_that_cannot_be_written_to(ncfix: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def locked(*_: Any, **more: Any) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.TemporaryDirectory", locked)
    assert "not writable: Permission denied" in ncfix("doctor").out.decode()


def test_the_package_brings_the_manual_page_and_the_scripts_of_now(root: Path) -> None:
    """Else: `make share`."""
    share = root / "share"
    kept = {str(path.relative_to(share)): path.read_text() for path in share.rglob("*") if path.is_file()}
    assert kept == dict(shared_files())


def test_the_manual_page_has_all_verbs_and_no_line_that_is_lost(ncfix: Any) -> None:
    text = page()
    assert ncfix("manual").out.decode() == text
    for verb in VERBS:
        assert f".SS ncfix {verb}" in text
    commands = {line.split()[0] for line in text.splitlines() if line.startswith((".", "'"))}
    assert commands == {".TH", ".SH", ".SS", ".PP", ".TP", ".B"}


def test_the_environment_of_the_manual_page_is_documented(root: Path) -> None:
    said = (root / "docs/formats.md").read_text() + (root / "docs/performance.md").read_text()
    for names, _ in ENVIRONMENT:
        assert all(name in said for name in names.split(", "))
