"""Results say what made them, and the same input gives the same bytes: elsewhere, in another locale and time zone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from cli.conftest import Ncfix, Shop
from ncfix import __version__
from ncfix.machine import load

COMMANDS = (
    ("fix", "part.ngc", "-m", "machine.toml", "-o", "fixed/", "--assume-zero", "--json"),
    ("export", "linuxcnc", "-m", "machine.toml", "-o", "tables"),
    ("report", "machine.toml", "-o", "page.html"),
    ("plan", "-m", "machine.toml", "--effects", "EXX", "-n", "6", "-o", "plan.csv"),
)
HERE = {"TZ": "UTC", "LC_ALL": "C", "PYTHONHASHSEED": "1", "PYTHONUTF8": "0"}
THERE = {"TZ": "Asia/Kolkata", "LC_ALL": "C.UTF-8", "PYTHONHASHSEED": "4711", "COLUMNS": "40", "NO_COLOR": "1"}


def made(folder: Path, shop: Shop, environment: dict[str, str]) -> dict[str, bytes]:
    """What the commands write and print in this folder."""
    folder.mkdir()
    for path in (shop.program, shop.machine):
        (folder / path.name).write_bytes(path.read_bytes())
    script = (
        "import sys, json\nfrom ncfix.cli.main import run\nsys.exit(max(run(line) for line in json.loads(sys.argv[1])))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, json.dumps(COMMANDS)],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    files = {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    return {**files, "<stdout>": done.stdout, "<stderr>": done.stderr}


def test_the_same_input_gives_the_same_bytes(shop: Shop) -> None:
    here, there = made(shop.folder / "here", shop, HERE), made(shop.folder / "dort ü", shop, THERE)
    assert here.keys() == there.keys()
    assert [name for name in here if here[name] != there[name]] == []
    assert len(here) > len(COMMANDS)


def test_a_program_says_what_corrected_it(shop: Shop, ncfix: Ncfix) -> None:
    out = shop.folder / "fixed.ngc"
    assert ncfix("fix", shop.program, "-m", shop.machine, "-o", out, "--offset", "G54=0,0,0", "--tool", "0=0").code == 0
    first = out.read_text().splitlines()[0].lower()
    assert first.startswith(f"(ncfix {__version__} machine {load(shop.machine).hash} strategy rotary-then-linear")
    assert "tolerance 1 um" in first


def test_tables_say_what_made_them(shop: Shop, ncfix: Ncfix) -> None:
    folder = shop.folder / "tables"
    assert ncfix("export", "linuxcnc", "-m", shop.machine, "-o", folder).code == 0
    side = json.loads((folder / "ncfix-tables.json").read_text())
    assert (side["ncfix"], side["hash"]) == (__version__, load(shop.machine).hash)
    assert f"ncfix {__version__}" in (folder / "hand-over.md").read_text()


@pytest.mark.parametrize("name", ["machine", "perfect"])
def test_the_hash_is_that_of_what_matters(shop: Shop, ncfix: Ncfix, name: str) -> None:
    path: Path = getattr(shop, name)
    before = ncfix("machine", "check", path, "--json").json()["hash"]
    path.write_text(f"# a remark\n{path.read_text()}\n[provenance]\ndate = 2026-01-01\n")
    assert ncfix("machine", "check", path, "--json").json()["hash"] == before
