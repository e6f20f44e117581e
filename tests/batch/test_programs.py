"""Which files of a shop's folders are programs."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from ncfix.batch.programs import program_files
from ncfix.diagnostics import SourceError, UsageError


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("b.nc", "a/C.NGC", "a/deep/d.mpf", "a/notes.txt", "b.nc.orig", ".hidden/e.nc", ".f.nc", "out/g.nc"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"")
    (tmp_path / "link.nc").symlink_to(tmp_path / "b.nc")
    return tmp_path


def test_a_folder_stands_for_the_programs_below_it(folder: Path) -> None:
    found = program_files([str(folder)], apart=str(folder / "out"))
    assert [each.name for each in found] == ["b.nc", "a/C.NGC", "a/deep/d.mpf"]
    assert [Path(each.path) for each in found] == [folder / each.name for each in found]


def test_outputs_of_another_name_are_programs_too(folder: Path) -> None:
    assert "out/g.nc" in {each.name for each in program_files([str(folder)])}


def test_files_are_taken_whatever_they_are_called(folder: Path) -> None:
    (found,) = program_files([str(folder / "a" / "notes.txt")])
    assert found.name == "notes.txt"


def test_a_folder_without_programs_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError) as caught:
        program_files([str(tmp_path)])
    assert caught.value.code == "NCF014"
    assert ".nc" in str(caught.value)


def test_a_folder_that_cannot_be_read_is_not_passed_over(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scan = os.scandir

    def locked(path: str) -> object:
        if str(path).endswith("deep"):
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return scan(path)

    monkeypatch.setattr(os, "scandir", locked)
    with pytest.raises(SourceError, match=r"deep: NCF002: cannot be read: Permission denied"):
        program_files([str(folder)])
