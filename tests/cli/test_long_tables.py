"""Long programs are traced and simulated while they are read: with the tables, figures and words of whole ones."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from conftest import FULL, some
from ncfix.cli.programs import Motions
from ncfix.cli.simulate import Errors
from ncfix.diagnostics import ExitCode

LINES = 800 if FULL else 240
PARTS = (1000, 10_000 if FULL else 4000)
WHOLE = 1 << 30
HEAD = ["%", "(LONG)", "G21 G90 G94 G54 G17 F900.", "G0 X10. Y20. Z5. B0. C0."]
GIVEN = ("--dialect", "linuxcnc", "--assume-zero")
FIVE, PLAY = "benchmarks/five_axis.toml", "examples/machines/wCBXFZYSt.toml"


def text() -> bytes:
    """Cuts there and back with axes turning round, arcs, holes, rapids, places in machine coordinates, and dwells."""
    found = list(HEAD)
    for k in range(LINES):
        found.append(f"G1 X{10 + abs(k % 140 - 70):.3f} Y{20 + k % 9:.3f} Z{5 + k % 4}. B{k % 11}. C{-20 + k % 43}.")
        if k % 40 == 13:
            found += [f"G2 I{3 + k % 5}. J1.", "G4 P0.1"]
        if k % 60 == 20:
            found += ["G53 G0 Z0.", "G0 X1. Y1. Z5.", "G98 G81 X8. Y9. Z-4. R2. F200.", "G80", "G0 Z6."]
    return "\n".join([*found, "M30", "%", ""]).encode()


@pytest.fixture
def program(tmp_path: Path) -> Path:
    path = tmp_path / "a.ngc"
    path.write_bytes(text())
    return path


@pytest.fixture
def in_parts_of(ncfix: Any, monkeypatch: pytest.MonkeyPatch, root: Path) -> Any:
    """`in_parts_of(size, *command line)`: what it does where a part has so many bytes."""
    monkeypatch.chdir(root)

    def call(size: int, *arguments: object, **given: Any) -> Any:
        monkeypatch.setenv("NCFIX_PART_BYTES", str(size))
        return ncfix(*arguments, **given)

    return call


@pytest.fixture
def only_in_parts(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """From when it is called on, nothing may be taken as a whole."""

    def call() -> None:
        for way in (Motions, Errors):
            monkeypatch.setattr(way, "whole", never)

    return call


def never(*arguments: object) -> None:
    raise AssertionError("taken as a whole")


VERBS = [
    ("trace",),
    ("trace", "-m", FIVE),
    ("trace", "-m", PLAY, "--json"),
    ("simulate", "-m", FIVE, "-o", "-", "--program"),
    ("simulate", "-m", PLAY, "-o", "-", "--program"),
    ("simulate", "-m", PLAY, "--json", "--program"),
    ("simulate", "-m", FIVE, "--program"),
]


@pytest.mark.parametrize("verb", VERBS, ids=" ".join)
def test_the_same_in_any_parts(in_parts_of: Any, program: Path, only_in_parts: Any, verb: tuple[str, ...]) -> None:
    whole = in_parts_of(WHOLE, *verb, program, *GIVEN)
    assert whole.code == ExitCode.DONE
    only_in_parts()
    for size in PARTS:
        assert in_parts_of(size, *verb, program, *GIVEN) == whole


@pytest.mark.parametrize("verb", [VERBS[1], VERBS[4]], ids=" ".join)
def test_the_same_from_a_pipe(in_parts_of: Any, program: Path, only_in_parts: Any, verb: tuple[str, ...]) -> None:
    whole = in_parts_of(WHOLE, *verb, program, *GIVEN)
    only_in_parts()
    found = in_parts_of(1000, *verb, "-", *GIVEN, stdin=text())
    assert (found.code, found.out) == (whole.code, whole.out)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="a system without named pipes")
@pytest.mark.parametrize("end", [b"", b"O100 sub\nO100 endsub\n"])
def test_what_comes_through_a_named_pipe_can_be_taken_as_a_whole(
    in_parts_of: Any, program: Path, tmp_path: Path, end: bytes
) -> None:
    pipe = tmp_path / "pipe.ngc"
    os.mkfifo(pipe)
    program.write_bytes(text().replace(b"M30\n%\n", b"M30\n" + end + b"%\n"))
    writer = threading.Thread(target=lambda: pipe.write_bytes(program.read_bytes()))
    writer.start()
    found = in_parts_of(1000, "trace", pipe, *GIVEN)
    writer.join()
    assert found.out == in_parts_of(WHOLE, "trace", program, *GIVEN).out
    assert found.out


@pytest.mark.parametrize("verb", [VERBS[0], VERBS[1], VERBS[3]], ids=" ".join)
@pytest.mark.parametrize(
    ("old", "new"),
    [(b"M30", b"G1 X1,5\nM30"), (b"M30", b"G1 V7.\nM30"), (b"%\n", b"%\nG1 X1 (more)\n"), (b"M30", b"M30\nG1 X1,5")],
)
def test_what_the_last_part_brings(
    in_parts_of: Any, program: Path, verb: tuple[str, ...], old: bytes, new: bytes
) -> None:
    program.write_bytes(new.join(text().rsplit(old, 1)))
    whole = in_parts_of(WHOLE, *verb, program, *GIVEN)
    assert in_parts_of(1000, *verb, program, *GIVEN) == whole


def test_a_table_is_there_when_it_is_whole(in_parts_of: Any, program: Path, tmp_path: Path) -> None:
    whole = in_parts_of(WHOLE, *VERBS[1], program, *GIVEN).out
    out = tmp_path / "motions.csv"
    assert in_parts_of(1000, *VERBS[1], program, *GIVEN, "-o", out).code == ExitCode.DONE
    assert out.read_bytes() == whole
    program.write_bytes(text().replace(b"M30", b"G1 X1,5"))
    assert in_parts_of(1000, *VERBS[1], program, *GIVEN, "-o", out, "--force").code == ExitCode.UNREADABLE
    assert in_parts_of(1000, *VERBS[1], program, *GIVEN).out == b""
    assert out.read_bytes() == whole
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a.ngc", "motions.csv"]


def test_both_forms_of_a_table_in_parts(in_parts_of: Any, program: Path, only_in_parts: Any, tmp_path: Path) -> None:
    csv, json = (in_parts_of(WHOLE, *verb, program, *GIVEN).out for verb in (("trace",), ("trace", "--json")))
    only_in_parts()
    out = tmp_path / "motions.csv"
    assert in_parts_of(1000, "trace", program, *GIVEN, "--json", "-o", out).out == json
    assert out.read_bytes() == csv


def test_the_dialect_is_told_by_the_same_text_in_any_parts(in_parts_of: Any, tmp_path: Path) -> None:
    """It shows behind the first parts only: G47 is a cycle of Haas, and where it ends is not known."""
    program = tmp_path / "a.nc"
    cuts = [f"G1 X{k % 70}. Y{k % 9}. F900." for k in range(300)]
    program.write_text(
        "\n".join(["%", "G21 G90 G0 X0. Y0. Z5.", *cuts, "G47 P0 (HAAS) X1. Y2. Z-1. F15. E10.", *cuts, "M30"])
    )
    whole = in_parts_of(WHOLE, "trace", program, "--assume-zero")
    assert whole.code == ExitCode.DONE
    assert in_parts_of(1000, "trace", program, "--assume-zero") == whole


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="a system without a folder in which nobody can write")
@pytest.mark.parametrize("size", [1000, WHOLE])
def test_where_nothing_can_be_written_that_is_said(in_parts_of: Any, program: Path, size: int) -> None:
    found = in_parts_of(size, *VERBS[1], program, *GIVEN, "-o", "/proc/motions.csv")
    assert found.code == ExitCode.USAGE
    assert "/proc/motions.csv: NCF007" in found.err


def test_programs_of_the_corpus(in_parts_of: Any, shared: Callable[[str], Path]) -> None:
    """Whether they can go in parts or not."""
    files = [each for each in sorted(shared("corpus").rglob("*")) if each.is_file()]
    found = [each for each in files if 2000 < each.stat().st_size < 30_000]
    for path in found[:: max(len(found) // some(20), 1)]:
        for verb in (VERBS[0], VERBS[4]):
            assert in_parts_of(1000, *verb, path, "--assume-zero") == in_parts_of(WHOLE, *verb, path, "--assume-zero")
