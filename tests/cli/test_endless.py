"""Inputs without end, or that never begin: refused in plain words, whichever verb is to read them."""

from __future__ import annotations

import errno
import io
import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import IO, Any

import pytest

from conftest import FULL
from ncfix import inputs
from ncfix.cli.console import owned
from ncfix.cli.main import run
from ncfix.cli.streams import Source
from ncfix.diagnostics import ExitCode, SourceError

VERBS = {
    "machine check": "machine check INPUT",
    "machine show": "machine show INPUT",
    "fix": "fix INPUT -m machine.toml -o out.ngc",
    "fix, machine": "fix part.ngc -m INPUT -o out.ngc",
    "fix, setup": "fix part.ngc -m machine.toml -o out.ngc --setup INPUT",
    "fix, tool table": "fix part.ngc -m machine.toml -o out.ngc --tool-table INPUT",
    "check": "check INPUT",
    "trace": "trace INPUT",
    "verify": "verify part.ngc INPUT -m machine.toml --assume-zero",
    "simulate": "simulate -m machine.toml --program INPUT",
    "simulate, plan": "simulate -m machine.toml --plan INPUT",
    "plan": "plan -m INPUT -o out.csv",
    "plan, existing": "plan -m machine.toml --existing INPUT -o out.csv",
    "calibrate": "calibrate INPUT -m machine.toml -o out.toml",
    "diagnose": "diagnose INPUT -m machine.toml",
    "report": "report INPUT -o out.html",
    "derive": "derive -m INPUT",
    "derive, chain": "derive --chain INPUT",
    "export": "export linuxcnc -m INPUT -o out",
    "effects": "effects -m INPUT",
}
DEVICES = [path for path in ("/dev/zero", "/dev/urandom", "/dev/full") if os.path.exists(path)]


class Endless(io.RawIOBase):
    """A pipe into which somebody writes for ever."""

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        buffer[:] = b"G1 X1\n" * (len(buffer) // 6) + b" " * (len(buffer) % 6)
        return len(buffer)


@pytest.fixture
def here(shop: Any, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The shop as the current folder; who does not come is waited for only shortly."""
    monkeypatch.chdir(shop.folder)
    monkeypatch.setattr(inputs, "WAIT_S", 0.1)
    return Path(shop.folder)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("verb", VERBS)
def test_a_device(verb: str, device: str, here: Path, ncfix: Any) -> None:
    result = ncfix(*VERBS[verb].replace("INPUT", device).split())
    assert (result.code, "it is a device" in result.err) == (ExitCode.UNREADABLE, True)
    assert {path.name for path in here.iterdir()} == {"part.ngc", "machine.toml", "perfect.toml"}


@pytest.mark.parametrize("verb", VERBS)
def test_a_pipe_into_which_nobody_writes(verb: str, here: Path, ncfix: Any) -> None:
    os.mkfifo("pipe")
    result = ncfix(*VERBS[verb].replace("INPUT", "pipe").split())
    assert (result.code, "a pipe without a writer" in result.err) == (ExitCode.UNREADABLE, True)


READERS = ("check INPUT --assume-zero", "trace INPUT --assume-zero", "machine check INPUT")
PIPES = ("-", "/dev/stdin", "/dev/fd/0", "pipe", "<(cat FILE)")


@pytest.mark.parametrize(
    ("verb", "source"),
    [(verb, pipe) for verb in READERS for pipe in PIPES if FULL or verb == READERS[0] or pipe == "pipe"],
)
def test_pipes_are_read_as_files_are(verb: str, source: str, here: Path) -> None:
    file = "machine.toml" if verb.startswith("machine") else "part.ngc"
    line = f'"{sys.executable}" -m ncfix {verb.replace("INPUT", source)}'
    feed = f"mkfifo pipe; (sleep 0.2; cat {file} >pipe) & " if source == "pipe" else f"cat {file} | "
    found = subprocess.run(
        ["bash", "-c", feed + line.replace("FILE", file)], capture_output=True, cwd=here, timeout=60, check=False
    )
    assert found.returncode == ExitCode.DONE, found.stderr.decode()


@pytest.mark.parametrize("source", ["-", "/dev/stdin"])
def test_a_device_as_standard_input(source: str, here: Path) -> None:
    for line in (f"machine check {source}", f"check {source}", f"fix {source} -m machine.toml -o -"):
        command = [sys.executable, "-m", "ncfix", *line.split()]
        with open("/dev/zero", "rb") as zero:
            found = subprocess.run(command, stdin=zero, capture_output=True, cwd=here, timeout=60, check=False)
        assert (found.returncode, b"it is a device" in found.stderr) == (ExitCode.UNREADABLE, True)


def test_nothing_is_an_empty_file(here: Path, ncfix: Any) -> None:
    call = ["check", "part.ngc", "-m", "machine.toml", "--assume-zero"]
    assert ncfix(*call, "--setup", os.devnull) == ncfix(*call)


def test_what_has_no_end_is_read_so_far(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="more than 4 MB") as caught:
        inputs.content(io.BufferedReader(Endless()), 4 << 20)
    assert caught.value.errno == errno.EFBIG
    huge = tmp_path / "huge"
    with huge.open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(OSError, match="more than 1024 MB"):
        inputs.content_of(str(huge))


def test_a_program_without_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is kept while it is read, and not until the disk is full."""
    monkeypatch.setattr(inputs.check_size, "__defaults__", (4 << 20,))
    kept: IO[bytes]
    with (tmp_path / "kept").open("w+b") as kept, pytest.raises(SourceError, match="more than 4 MB"):
        Source("-", io.BufferedReader(Endless()), kept).everything()
    assert (tmp_path / "kept").stat().st_size < 8 << 20


def test_a_writer_that_comes_late_is_waited_for(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)

    def write() -> None:
        time.sleep(0.3)
        pipe.write_bytes(b"text")

    writer = threading.Thread(target=write)
    writer.start()
    assert inputs.content_of(str(pipe)) == b"text"
    writer.join()


NESTED = {
    "lists": lambda deep: "[" * deep + "]" * deep,
    "objects": lambda deep: '{"a":' * deep + "1" + "}" * deep,
    "in turn": lambda deep: '[{"a":' * deep + "1" + "}]" * deep,
    "never closed": lambda deep: "[" * deep,
}


@pytest.mark.parametrize("deep", [70, 500, 5000, 100_000])
@pytest.mark.parametrize("how", NESTED)
def test_a_report_of_what_is_nested_deeply(how: str, deep: int, here: Path, ncfix: Any) -> None:
    Path("result.json").write_text(f'{{"schema": 1, "files": {NESTED[how](deep)}}}')
    result = ncfix("report", "result.json", "-o", "out.html")
    assert (result.code, "NCF019" in result.err) == (ExitCode.UNREADABLE, True)


@pytest.mark.parametrize("value", [None, True, 1, "x", [], {}, [[]], [{}], [None], [1, [{"a": [3]}]], {"a": {"b": 1}}])
@pytest.mark.parametrize("key", ["files", "rows", "columns", "coefficients", "errors", "machine", "", "x\x1b[31m"])
def test_a_report_of_any_json(key: str, value: Any, here: Path) -> None:
    """Odd results are shown, or refused in words, and are no fault of ncfix."""
    Path("result.json").write_text(json.dumps({"schema": 1, key: value}))
    assert run(["report", "result.json", "-o", "out.html", "--force"]) != ExitCode.FAULT


def test_want_of_memory_is_no_fault() -> None:
    (message,) = owned(MemoryError()).messages
    assert (message.code, "fault" in message.text) == ("NCF024", False)
