"""How the tests call the command line: in this process, or in one of its own."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
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


@pytest.fixture(scope="session")
def examples(root: Path) -> Path:
    """The shipped examples."""
    return root / "examples"


THREE_AXIS = """
ncfix = 1
name = "three axes"
topology = "w F X Y Z t"
axis.X = {{ type = "linear", direction = [1, 0, 0], range = [0, 500] }}
axis.Y = {{ type = "linear", direction = [0, 1, 0], range = [0, 400] }}
axis.Z = {{ type = "linear", direction = [0, 0, 1], range = [-300, 0] }}
{effects}
"""

LONG_X = '[[effect]]\nname = "EXX"\nbasis = "polynomial"\ndegree = [1]\ncoefficients = [1e-4]\n'
"""X is 0.1 um per mm too long: a point at x is cut at 1.0001 x."""

PROGRAM = b"G21 G90 G94\r\n(corner)\r\nG0 X10 Y10 Z-1\r\nG1 X110.000 F600\r\nX210 Y60\r\nM2\r\n"


class Shop(NamedTuple):
    """A folder with a program, a machine with errors and one without."""

    folder: Path
    program: Path
    machine: Path
    perfect: Path


@pytest.fixture
def shop(tmp_path: Path) -> Shop:
    """part.ngc, machine.toml and perfect.toml."""
    paths = Shop(tmp_path, tmp_path / "part.ngc", tmp_path / "machine.toml", tmp_path / "perfect.toml")
    paths.program.write_bytes(PROGRAM)
    paths.machine.write_text(THREE_AXIS.format(effects=LONG_X))
    paths.perfect.write_text(THREE_AXIS.format(effects=""))
    return paths
