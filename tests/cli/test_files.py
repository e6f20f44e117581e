"""Outputs are whole or not there, whatever the disk does."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path

import pytest

from ncfix import files
from ncfix.diagnostics import ExitCode, SourceError, UsageError

OLD = b"the old program\n"
NEW = b"the new program\n" * 1000
CALLS = ("open", "write", "fsync", "close", "link", "replace", "chmod", "stat")
"""The system calls by which files.py writes."""


class Failing:
    """`os` as files.py sees it, whose n-th call fails with "no space left"; cleaning up still works."""

    def __init__(self, n: int) -> None:
        self.left = n
        self.failed = False

    def __getattr__(self, name: str) -> object:
        real = getattr(os, name)
        return self.counted(real) if name in CALLS else real

    def counted(self, real: Callable[..., object]) -> Callable[..., object]:
        def call(*arguments: object, **options: object) -> object:
            self.left -= 1
            if self.left == 0:
                self.failed = True
                if real is os.close:
                    real(*arguments)
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return real(*arguments, **options)

        return call


def fail_at_every_call(
    monkeypatch: pytest.MonkeyPatch, prepare: Callable[[], None], act: Callable[[], None]
) -> Iterator[int]:
    """Run `act` with the first, second, ... system call failing until it gets through; yields after each failure."""
    for n in count(1):
        prepare()
        failing = Failing(n)
        monkeypatch.setattr(files, "os", failing)
        if not failing_run(act, failing):
            assert n > 5, "too few system calls were seen"
            return
        yield n


def failing_run(act: Callable[[], None], failing: Failing) -> bool:
    """Whether the injected failure happened; it must come out as the coded error."""
    try:
        act()
    except UsageError as error:
        caught = error
    else:
        assert not failing.failed, "the failure was swallowed"
        return False
    assert failing.failed
    assert caught.code == "NCF007"
    assert "No space left" in str(caught)
    return True


def test_a_full_disk_leaves_no_torn_output(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    target = tmp_path / "out.ngc"
    for _ in fail_at_every_call(
        monkeypatch, lambda: target.unlink(missing_ok=True), lambda: files.write_whole(str(target), NEW)
    ):
        assert not target.exists() or target.read_bytes() == NEW
        assert {path.name for path in tmp_path.iterdir()} <= {"out.ngc"}
    assert target.read_bytes() == NEW


def test_a_file_without_a_name_is_given_one_and_not_copied(tmp_path: Path) -> None:
    target, usual = tmp_path / "out.ngc", tmp_path / "usual.ngc"
    usual.touch()
    with files.unnamed(str(tmp_path)) as kept:
        kept.write(NEW)
        files.write_whole(str(target), files.WholeFile(kept))
        assert os.fstat(kept.fileno()).st_ino == target.stat().st_ino
        assert target.stat().st_mode == usual.stat().st_mode
    assert target.read_bytes() == NEW
    assert {path.name for path in tmp_path.iterdir()} == {"out.ngc", "usual.ngc"}


@pytest.mark.parametrize("folder", [None, "other"])
def test_a_file_that_cannot_be_given_a_name_is_copied(
    folder: str | None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """One of another disk, or on a system that knows nothing of the kind; owner and mode are those of the old file."""
    target = tmp_path / "out.ngc"
    target.write_bytes(OLD)
    target.chmod(0o640)
    monkeypatch.setattr(files, "_named", lambda *_: False)
    with files.unnamed(folder) as kept:
        kept.write(NEW)
        files.write_whole(str(target), files.WholeFile(kept), replace=True)
    assert target.read_bytes() == NEW
    assert stat.S_IMODE(target.stat().st_mode) == 0o640


def test_a_full_disk_leaves_no_torn_copy_of_a_file_without_a_name(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    target = tmp_path / "out.ngc"
    monkeypatch.setattr(files, "_named", lambda *_: False)
    with files.unnamed(str(tmp_path)) as kept:
        kept.write(NEW)
        write = lambda: files.write_whole(str(target), files.WholeFile(kept), replace=True)  # noqa: E731
        for _ in fail_at_every_call(monkeypatch, lambda: target.write_bytes(OLD) and None, write):
            assert target.read_bytes() in (OLD, NEW)
            assert [path.name for path in tmp_path.iterdir()] == ["out.ngc"]
    assert target.read_bytes() == NEW


def test_a_full_disk_leaves_the_replaced_output_old_or_new(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    target = tmp_path / "out.ngc"
    replace = lambda: files.write_whole(str(target), NEW, replace=True)  # noqa: E731
    for _ in fail_at_every_call(monkeypatch, lambda: target.write_bytes(OLD) and None, replace):
        assert target.read_bytes() in (OLD, NEW)
        assert [path.name for path in tmp_path.iterdir()] == ["out.ngc"]
    assert target.read_bytes() == NEW


def test_a_full_disk_never_loses_the_original_in_place(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    program, backup = tmp_path / "part.ngc", tmp_path / "part.ngc.orig"

    def prepare() -> None:
        backup.unlink(missing_ok=True)
        program.write_bytes(OLD)

    act = lambda: files.replace_keeping(str(program), str(backup), NEW)  # noqa: E731
    for _ in fail_at_every_call(monkeypatch, prepare, act):
        if program.read_bytes() == NEW:
            assert backup.read_bytes() == OLD
        else:
            assert program.read_bytes() == OLD
            assert not backup.exists()
        assert not list(tmp_path.glob(".*"))
    assert (program.read_bytes(), backup.read_bytes()) == (NEW, OLD)


def test_without_hard_links_the_original_is_copied(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def no_links(*_: object, **__: object) -> None:
        raise OSError(errno.EPERM, os.strerror(errno.EPERM))

    monkeypatch.setattr(os, "link", no_links)
    program = tmp_path / "part.ngc"
    program.write_bytes(OLD)
    files.replace_keeping(str(program), f"{program}.orig", NEW)
    assert program.read_bytes() == NEW
    assert (tmp_path / "part.ngc.orig").read_bytes() == OLD
    assert len(list(tmp_path.iterdir())) == 2


def test_an_existing_file_is_not_replaced_unasked(tmp_path: Path) -> None:
    target = tmp_path / "out.ngc"
    target.write_bytes(OLD)
    with pytest.raises(UsageError) as caught:
        files.write_whole(str(target), NEW)
    assert caught.value.code == "NCF004"
    assert str(target) in str(caught.value)
    assert target.read_bytes() == OLD
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("mode", [0o640, 0o755, 0o600])
def test_the_mode_of_what_is_replaced_is_kept(tmp_path: Path, mode: int) -> None:
    target = tmp_path / "out.ngc"
    target.write_bytes(OLD)
    target.chmod(mode)
    files.write_whole(str(target), NEW, replace=True)
    assert stat.S_IMODE(target.stat().st_mode) == mode
    files.replace_keeping(str(target), f"{target}.orig", OLD)
    assert stat.S_IMODE(target.stat().st_mode) == mode


def test_a_new_file_has_the_mode_that_the_user_gives_new_files(tmp_path: Path) -> None:
    (tmp_path / "plain").write_bytes(b"")
    files.write_whole(str(tmp_path / "out.ngc"), NEW)
    assert (tmp_path / "out.ngc").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_a_missing_folder_is_made(tmp_path: Path) -> None:
    files.write_whole(str(tmp_path / "a" / "b" / "out.ngc"), NEW)
    assert (tmp_path / "a" / "b" / "out.ngc").read_bytes() == NEW


@pytest.mark.parametrize("name", ["missing.ngc", "."])
def test_what_cannot_be_read_is_named(tmp_path: Path, name: str) -> None:
    with pytest.raises(SourceError) as caught:
        files.read_bytes(str(tmp_path / name))
    assert caught.value.code == "NCF002"
    assert caught.value.exit_code == ExitCode.UNREADABLE
    assert str(tmp_path) in str(caught.value)
