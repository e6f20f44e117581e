"""Long programs are checked while they are read: with the findings of a check as wholes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from ncfix.cli.following import FollowingSetup
from ncfix.diagnostics import ExitCode

HEAD = ["%", "(LONG)", "G21 G90 G94 G54 G17 F900.", "G0 X10. Y20. Z5."]


def lines() -> list[str]:
    """Cuts there and back; some leave the travel, more than are written out, and some nothing can be said of."""
    found = list(HEAD)
    for k in range(400):
        far = 5000 if k % 9 == 4 else 0
        found.append(f"G1 X{10 + abs(k % 140 - 70) + far:.3f} Y{20 + k % 9:.3f} Z{5 + k % 4}.")
        if k % 50 == 20:
            found.append("G53 G0 Z0.")
            found.append("G0 X1. Y1. Z5.")
    return [*found, "M30", "%", ""]


@pytest.fixture
def check(ncfix: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Any:
    """`check(part, text, *options)`: exit code, JSON and words, of a text read in parts of so many bytes."""
    path = tmp_path / "a.ngc"

    def call(part: int, text: bytes, *given: object) -> tuple[int, Any, str]:
        monkeypatch.setenv("NCFIX_PART_BYTES", str(part))
        path.write_bytes(text)
        result = ncfix("check", path, *given, "--json")
        return result.code, result.json(), result.err

    return call


@pytest.fixture
def only_in_parts(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Nothing may be checked as a whole."""
    monkeypatch.setattr(FollowingSetup, "checked", never)
    return monkeypatch


def never(*arguments: object) -> None:
    raise AssertionError("checked as a whole")


@pytest.mark.parametrize("machine", [None, "benchmarks/five_axis.toml", "perfect"])
def test_findings_are_the_same_in_any_parts(
    check: Any, root: Path, machine: str | None, shop: Any, request: Any
) -> None:
    named = shop.perfect if machine == "perfect" else machine and root / machine
    given = ("--dialect", "linuxcnc", "--assume-zero", *(("-m", named) if named else ()))
    text = "\n".join(lines()).encode()
    whole = check(1 << 20, text, *given)
    if named:
        assert whole[0] == ExitCode.FINDINGS
        assert "NCF405" in whole[2]
    request.getfixturevalue("only_in_parts")
    assert check(1000, text, *given) == whole


def test_a_stamp_and_what_comes_behind_the_end_are_found(check: Any, request: Any) -> None:
    text = "\n".join(lines()).encode()
    stamp = b"(ncfix 0.1.0 machine 12 strategy full tolerance 1 um)\n"
    for each in (text + b"G1 A1\n" * 90 + stamp, text.replace(b"(LONG)\n", b"(LONG)\n" + stamp)):
        whole = check(1 << 20, each, "--dialect", "linuxcnc")
        assert check(1000, each, "--dialect", "linuxcnc") == whole
    assert "NCF430" in whole[2]
    request.getfixturevalue("only_in_parts")
    assert check(1000, each, "--dialect", "linuxcnc") == whole


@pytest.mark.parametrize(
    ("old", "new"), [("Z8.\nM30", "Z8. C5.\nM30"), ("M30", "G1 X1,5\nM30"), ("M30", "G1 V7.\nM30")]
)
def test_what_a_later_part_brings_is_found_as_in_the_whole(check: Any, old: str, new: str) -> None:
    text = "\n".join(lines()).replace(old, new).encode()
    whole = check(1 << 20, text, "--dialect", "linuxcnc")
    assert check(1000, text, "--dialect", "linuxcnc") == whole


def test_programs_of_the_corpus(check: Any, shared: Callable[[str], Path]) -> None:
    """Whether they can go in parts or not."""
    files = [each for each in sorted(shared("corpus").rglob("*")) if each.is_file()]
    found = [each for each in files if 2000 < each.stat().st_size < 30_000]
    for path in found[:: max(len(found) // 25, 1)]:
        text = path.read_bytes()
        assert check(1000, text) == check(1 << 20, text), path
