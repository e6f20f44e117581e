"""`ncfix fix --diff`: the diff makes the corrected program of the original, and nothing is written."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ncfix.diagnostics import ExitCode

HUNK = re.compile(rb"@@ -(\d+),(\d+) \+(\d+),(\d+) @@\n")


def patched(original: bytes, diff: bytes) -> bytes:
    """What `patch` makes of a text with a unified diff; every line of the diff has to fit."""
    old, new, at = original.splitlines(keepends=True), list[bytes](), 0
    for head, *counts, body in hunks(diff):
        begin, size, begin_new, size_new = (int(each) for each in counts)
        begin -= size > 0
        new += old[at:begin]
        assert len(new) == begin_new - (size_new > 0), head
        at, made = begin, len(new)
        for sign, line in body:
            if sign != b"+":
                assert old[at] == line, (head, at)
                at += 1
            if sign != b"-":
                new.append(line)
        assert (at - begin, len(new) - made) == (size, size_new), head
    return b"".join(new + old[at:])


def hunks(diff: bytes) -> Iterator[tuple[Any, ...]]:
    if not diff:
        return
    first, second, rest = diff.split(b"\n", 2)
    assert first.startswith(b"--- ")
    assert second.startswith(b"+++ ")
    _, *parts = HUNK.split(rest)
    while parts:
        begin, size, begin_new, size_new, text, *parts = parts
        whole = text.replace(b"\n\\ No newline at end of file\n", b"\0")
        lines = re.findall(rb"[^\n\0]*[\n\0]", whole)
        body = [(line[:1], line[1:].replace(b"\0", b"")) for line in lines]
        yield begin, begin, size, begin_new, size_new, body


@pytest.mark.parametrize(
    ("program", "machine", "more"),
    [
        ("guide/shop/bracket.nc", "guide/mill.toml", ()),
        ("guide/shop/grid.nc", "guide/mill.toml", ("--flatten",)),
        ("guide/shop/grid.nc", "guide/mill.toml", ("--allow-refused",)),
        ("programs/blade.nc", "machines/wCBXFZYSt.toml", ()),
        ("programs/klartext_tcp.h", "machines/wCBXFZYSt.toml", ()),
        ("programs/klartext_tcp.h", "machines/wCBXFZYSt.toml", ("--block-numbers", "renumber")),
        ("programs/siemens_traori.mpf", "guide/mill.toml", ("--tolerance-um", "0.1")),
    ],
)
def test_the_diff_makes_the_corrected_program(
    ncfix: Any, examples: Path, tmp_path: Path, program: str, machine: str, more: tuple[str, ...]
) -> None:
    path = examples / program
    setup = ("--setup", examples / "guide/setup.toml") if program.startswith("guide") else ("--assume-zero",)
    command = ("fix", path, "-m", examples / machine, *setup, *more)
    corrected = ncfix(*command, "-o", "-")
    assert corrected.code == ExitCode.DONE, corrected.err
    before = sorted(examples.rglob("*"))
    found = ncfix(*command, "--diff")
    assert found.code == ExitCode.FINDINGS, found.err
    assert patched(path.read_bytes(), found.out) == corrected.out
    assert sorted(examples.rglob("*")) == before


@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
@pytest.mark.parametrize("last", [True, False])
def test_line_ends_are_kept(ncfix: Any, shop: Any, end: bytes, last: bool) -> None:
    text = shop.program.read_bytes().replace(b"\r\n", end)
    shop.program.write_bytes(text if last else text.removesuffix(b"M2" + end).removesuffix(end))
    command = ("fix", shop.program, "-m", shop.machine, "--assume-zero")
    diff = ncfix(*command, "--diff").out
    assert patched(shop.program.read_bytes(), diff) == ncfix(*command, "-o", "-").out
    assert diff.endswith(b"\\ No newline at end of file\n") or last


def test_motions_with_their_reasons(ncfix: Any, shop: Any) -> None:
    command = ("fix", shop.program, "-m", shop.machine, "--assume-zero", "--diff-motions")
    result = ncfix(*command)
    assert result.code == ExitCode.FINDINGS
    _, head, *rows = result.out.decode().splitlines()
    assert head.split() == ["line", "axis", "from", "to", "change", "why"]
    assert rows[1].split() == ["4", "X", "110.0000", "109.9890", "-11.0", "um", "EXX", "11.0", "um"]
    (file,) = ncfix(*command, "--json").json()["files"]
    assert file["changed"]
    assert file["motions"][1] == {
        "line": 4,
        "axis": "X",
        "from": 110.0,
        "to": 109.989,
        "um": -11.0,
        "pieces": 1,
        "why": {"EXX": 11.0},
    }


def test_rotary_axes_are_in_degrees(ncfix: Any, examples: Path) -> None:
    machine = examples / "machines/wCBXFZYSt.toml"
    command = ("fix", examples / "programs/blade.nc", "-m", machine, "--assume-zero", "--strategy", "full")
    (file,) = ncfix(*command, "--diff-motions", "--json").json()["files"]
    turned = [each for each in file["motions"] if each["axis"] in "BC"]
    assert turned
    assert all(abs(each["to"] - each["from"] - each["mdeg"] / 1e3) < 1e-5 for each in turned)


def test_nothing_to_change(ncfix: Any, shop: Any) -> None:
    for how in ("--diff", "--diff-motions"):
        result = ncfix("fix", shop.program, "-m", shop.perfect, "--assume-zero", how)
        assert (result.code, result.out) == (ExitCode.DONE, b"")


def test_what_is_refused_or_wrong(ncfix: Any, examples: Path, shop: Any) -> None:
    guide = ("-m", examples / "guide/mill.toml", "--setup", examples / "guide/setup.toml", "--diff")
    result = ncfix("fix", examples / "guide/shop/grid.nc", *guide)
    assert (result.code, result.out) == (ExitCode.REFUSED, b"")
    assert "4 motions refused, so `ncfix fix` would write nothing" in result.err
    shop.program.write_bytes(b"G1 X1 Y..2\nM2\n")
    result = ncfix("fix", shop.program, "-m", shop.machine, "--assume-zero", "--diff", "--json")
    assert result.code == ExitCode.UNREADABLE
    assert result.json()["files"][0]["errors"]


def test_a_folder_and_a_project(ncfix: Any, shop: Any) -> None:
    for name in ("a.ngc", "b.ngc"):
        (shop.folder / "parts").mkdir(exist_ok=True)
        (shop.folder / "parts" / name).write_bytes(shop.program.read_bytes())
    project = 'machine = "machine.toml"\noutput = "out"\n[options]\nassume_zero = true\nresume = true\n'
    (shop.folder / "ncfix.toml").write_text(f'{project}[[programs]]\nmatch = "*/b*"\nmachine = "perfect.toml"\n')
    result = ncfix("fix", shop.folder / "parts", "--diff", "--json")
    assert result.code == ExitCode.FINDINGS
    assert [each["changed"] for each in result.json()["files"]] == [True, False]
    assert not (shop.folder / "out").exists()
