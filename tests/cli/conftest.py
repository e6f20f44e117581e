"""How the tests call the command line: in this process, or in one of its own."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from collections.abc import Callable
from typing import Any, NamedTuple

import pytest

from ncfix.cli.main import run


class Result(NamedTuple):
    """What a command line did."""

    code: int
    out: bytes
    err: str

    def json(self) -> dict[str, Any]:
        """Standard output as the one object that `--json` prints."""
        found: dict[str, Any] = json.loads(self.out)
        assert found["schema"] == 1
        return found


Ncfix = Callable[..., Result]


@pytest.fixture
def ncfix(capfdbinary: pytest.CaptureFixture[bytes], monkeypatch: pytest.MonkeyPatch) -> Ncfix:
    """`ncfix("fix", "part.ngc", stdin=b"...")` runs a command line in this process."""

    def call(*arguments: object, stdin: bytes = b"") -> Result:
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin)))
        capfdbinary.readouterr()
        code = run([str(argument) for argument in arguments])
        out, err = capfdbinary.readouterr()
        return Result(code, out, err.decode())

    return call


@pytest.fixture
def ncfix_process() -> Ncfix:
    """The same in a process of its own."""

    def call(*arguments: object, stdin: bytes = b"", **options: Any) -> Result:
        command = [sys.executable, "-m", "ncfix", *map(str, arguments)]
        done = subprocess.run(command, input=stdin, capture_output=True, check=False, **options)
        return Result(done.returncode, done.stdout, done.stderr.decode())

    return call
