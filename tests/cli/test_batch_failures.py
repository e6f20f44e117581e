"""A batch of which any system call that writes fails, or is the last one of the process: no output is ever torn, and
the next run with `--resume` makes what an undisturbed one makes."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any

import pytest

from cli.conftest import LONG_X, PROGRAM, THREE_AXIS
from ncfix import files
from ncfix.batch.journal import JOURNAL
from ncfix.cli.main import run
from ncfix.diagnostics import ExitCode

CALLS = frozenset({"write", "pwrite", "open", "close", "link", "replace", "unlink", "fsync", "mkdir", "chmod"})
"""The system calls by which files.py writes."""
KILLED = 9
PROGRAMS = 3
STEP = 1 if os.environ.get("NCFIX_MOMENTS") else 7
"""Every so many calls one fails."""


class Interfered:
    """`os` as files.py sees it; before its n-th call that writes something happens."""

    def __init__(self, n: int, happens: Callable[[], None]) -> None:
        self.left, self.happens = n, happens

    def __getattr__(self, name: str) -> Any:
        real = getattr(os, name)
        return self._counted(real) if name in CALLS else real

    def _counted(self, real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **options: Any) -> Any:
            self.left -= 1
            if self.left == 0:
                if real is os.close:
                    real(*arguments)
                self.happens()
            return real(*arguments, **options)

        return call


@pytest.fixture
def yard(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "machine.toml").write_text(THREE_AXIS.format(effects=LONG_X))
    (tmp_path / "in").mkdir()
    for number in range(PROGRAMS):
        text = PROGRAM.replace(b"X110.000", b"X%d.000" % (111 + number))
        (tmp_path / "in" / f"part{number}.ngc").write_bytes(text)
    monkeypatch.chdir(tmp_path)
    assert batch("whole") == ExitCode.DONE
    return tmp_path


def batch(out: str) -> int:
    return run(["fix", "in", "-m", "machine.toml", "--assume-zero", "--resume", "-q", "-j", "1", "-o", out])


def contents(folder: Path) -> dict[str, bytes]:
    found = folder.iterdir() if folder.exists() else ()
    return {path.name: path.read_bytes() for path in found if path.name != JOURNAL}


def changed(yard: Path, number: int) -> None:
    """Another program of the same name, so that an output has to be replaced."""
    path = yard / "in" / "part1.ngc"
    path.write_bytes(PROGRAM.replace(b"X110.000", b"X%d.000" % (200 + number % 50)))


@pytest.mark.parametrize("what", [errno.ENOSPC, errno.EIO], ids=errno.errorcode.get)
def test_a_call_that_fails(yard: Path, monkeypatch: pytest.MonkeyPatch, what: int) -> None:
    def fails() -> None:
        raise OSError(what, os.strerror(what))

    for n in count(1, STEP):
        interfered = Interfered(n, fails)
        with monkeypatch.context() as patched:
            patched.setattr(files, "os", interfered)
            code = batch(f"out{n}")
        assert_goes_on(yard, n)
        if interfered.left > 0:
            assert code == ExitCode.DONE
            assert n > 20, "too few calls were seen"
            break
        assert code in (ExitCode.USAGE, ExitCode.DONE)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the process is copied")
def test_a_call_that_is_the_last_one(yard: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for n in count(1, STEP):
        child = os.fork()
        if child == 0:
            try:
                monkeypatch.setattr(files, "os", Interfered(n, lambda: os._exit(KILLED)))
                code = batch(f"out{n}")
            except BaseException:
                code = 99
            os._exit(code)
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        assert_goes_on(yard, n)
        if code != KILLED:
            assert code == ExitCode.DONE
            assert n > 20, "too few calls were seen"
            break


def assert_goes_on(yard: Path, n: int) -> None:
    """What is there is whole, and the next nights end as if nothing had happened, programs changed or not."""
    out, whole = yard / f"out{n}", contents(yard / "whole")
    found = {name: text for name, text in contents(out).items() if not name.startswith(".ncfix-")}
    assert found.items() <= whole.items()
    assert batch(out.name) == ExitCode.DONE
    assert {name: text for name, text in contents(out).items() if name in whole} == whole
    changed(yard, n)
    assert batch(out.name) == ExitCode.DONE
    assert batch("whole") == ExitCode.DONE
    assert contents(out)["part1.ngc"] == contents(yard / "whole")["part1.ngc"] != whole["part1.ngc"]
