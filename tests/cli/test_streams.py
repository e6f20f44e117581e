"""Standard streams that are closed or full: said in plain words where that can be, and never a fault of ncfix."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from cli.conftest import Shop

FULL = pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
FIX = "fix part.ngc -m machine.toml -o - --assume-zero --no-figures"


@pytest.mark.parametrize(
    ("line", "code", "said"),
    [
        ("machine check - <&-", 3, "<stdin>: NCF002: cannot be read: it is closed"),
        ("fix - -m machine.toml -o - <&-", 3, "<stdin>: NCF002: cannot be read: it is closed"),
        ("check - - -m machine.toml --assume-zero <part.ngc", 2, "NCF022: standard input is given for two inputs"),
        ("effects >&-", 2, "<stdout>: NCF007: is closed"),
        (f"{FIX} >&-", 2, "<stdout>: NCF007: is closed"),
        pytest.param("effects >/dev/full", 2, "NCF007: cannot be written: No space left", marks=FULL),
        pytest.param("--help >/dev/full", 2, "NCF007: cannot be written: No space left", marks=FULL),
        pytest.param(f"{FIX} 2>/dev/full", 0, "", marks=FULL),
        (f"{FIX} 2>&-", 0, ""),
        ("explain 2>&- | head -1", 0, ""),
    ],
)
def test_a_stream_that_cannot_be_used(shop: Shop, line: str, code: int, said: str) -> None:
    command = f'"{sys.executable}" -m ncfix {line}'
    environment = {**os.environ, "LC_ALL": "C"}
    done = subprocess.run(
        command, shell=True, cwd=shop.folder, capture_output=True, check=False, text=True, env=environment
    )
    assert (done.returncode, "NCF000" in done.stderr, "Traceback" in done.stderr) == (code, False, False)
    assert said in done.stderr
    if code == 0:
        assert done.stdout
