"""What users get wrong: each mistake has its exit code, its message code and its place, and nothing is written."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from differential import product

HEAD = b"G21 G90 G17 G94 G54\nG0 X10 Y5 Z20\n"
GOOD = HEAD + b"G1 X20 F100\nM2\n"


@dataclass(frozen=True, slots=True)
class Bad:
    """A program, and what must be said of it: exit code, beginning of the message code, line (None: the whole file)."""

    source: bytes
    code: int
    prefix: str
    line: int | None
    options: tuple[str, ...] = ("--assume-zero",)


ONLY_G54 = ("--offset", "G54=0,0,0")
PROGRAMS = {
    "an axis that the machine lacks": Bad(HEAD + b"G1 X20 A30 F100\nM2\n", product.USAGE, "NCF2", 3),
    "a binary file": Bad(bytes(range(256)) * 4, product.UNREADABLE, "NCF101", None),
    "UTF-16": Bad("G0 X1\nM2\n".encode("utf-16"), product.UNREADABLE, "NCF101", None),
    "an empty file": Bad(b"", product.UNREADABLE, "NCF102", None),
    "a 300-character line": Bad(HEAD + b"(" + b"x" * 298 + b")\nM2\n", product.UNREADABLE, "NCF105", 3),
    "nested comments": Bad(HEAD + b"(one (two) three)\nM2\n", product.UNREADABLE, "NCF112", 3),
    "an open comment": Bad(HEAD + b"G1 X1 (one\nM2\n", product.UNREADABLE, "NCF111", 3),
    "an exponent": Bad(HEAD + b"G1 X1e-5 F100\nM2\n", product.UNREADABLE, "NCF116", 3),
    "a word twice": Bad(HEAD + b"G1 X1 Y2 X3 F100\nM2\n", product.UNREADABLE, "NCF117", 3),
    "a number of twenty digits": Bad(HEAD + b"G1 X99999999999999999999 F100\nM2\n", product.UNREADABLE, "NCF248", 3),
    "a centre a thousand kilometres away": Bad(HEAD + b"G2 X30 I2000000000 F9\nM2\n", product.UNREADABLE, "NCF", 3),
    "two points": Bad(HEAD + b"G1 X1.2.3 F100\nM2\n", product.UNREADABLE, "NCF1", 3),
    "two signs": Bad(HEAD + b"G1 X--5 F100\nM2\n", product.UNREADABLE, "NCF1", 3),
    "a point alone": Bad(HEAD + b"G1 X. F100\nM2\n", product.UNREADABLE, "NCF1", 3),
    "a decimal comma": Bad(HEAD + b"G1 X1,5 F100\nM2\n", product.UNREADABLE, "NCF1", 3),
    "a word without a value": Bad(HEAD + b"G1 X Y5 F100\nM2\n", product.UNREADABLE, "NCF1", 3),
    "an open bracket": Bad(HEAD + b"G1 X[1+2 F100\nM2\n", product.UNREADABLE, "NCF1", 3),
    "an arc that does not close": Bad(HEAD + b"G2 X20 Y15.2 I10 J0 F100\nM2\n", product.UNREADABLE, "NCF2", 3),
    "an arc without a centre": Bad(HEAD + b"G2 X20 Y15 F100\nM2\n", product.UNREADABLE, "NCF2", 3),
    "a radius too small": Bad(HEAD + b"G2 X20 Y15 R2 F100\nM2\n", product.UNREADABLE, "NCF2", 3),
    "axis words without a motion": Bad(HEAD + b"G80\nX5\nM2\n", product.UNREADABLE, "NCF2", 4),
    "a subprogram that never ends": Bad(HEAD + b"o<a> sub\nG1 X3\nM2\n", product.UNREADABLE, "NCF", 3),
    "a loop without an end": Bad(HEAD + b"o1 while [1]\nG1 X3 F9\no1 endwhile\nM2\n", product.UNREADABLE, "NCF2", None),
    "a call of nothing": Bad(HEAD + b"o<nothing> call\nM2\n", product.UNREADABLE, "NCF2", 3),
    "a missing work offset": Bad(HEAD + b"G55 G1 X20 F100\nM2\n", product.USAGE, "NCF2", 3, ONLY_G54),
    "a missing tool length": Bad(HEAD + b"T7 M6\nG43 Z5\nM2\n", product.USAGE, "NCF2", 4, ONLY_G54),
}  # fmt: skip


def _tried(source: bytes, machine: Path, folder: Path, *options: object) -> product.Outcome:
    before = {path.name for path in folder.iterdir()}
    outcome = product.fix_text(source, machine, folder, *options)
    assert {path.name for path in folder.iterdir()} <= before | {"program.ngc", "fixed-program.ngc"}
    return outcome


@pytest.mark.parametrize("name", PROGRAMS)
def test_bad_programs(name: str, machine_file: Callable[[str], Path], tmp_path: Path) -> None:
    bad = PROGRAMS[name]
    outcome = _tried(bad.source, machine_file("three"), tmp_path, *bad.options)
    assert (outcome.code, outcome.text) == (bad.code, None), outcome.errors
    assert any(code.startswith(bad.prefix) for code in outcome.codes), outcome.errors
    assert bad.line is None or bad.line in outcome.places, outcome.errors
    assert "hint:" in outcome.errors


def test_what_is_missing_is_named_with_the_option_that_gives_it(
    machine_file: Callable[[str], Path], tmp_path: Path
) -> None:
    offset = _tried(HEAD + b"G55 G1 X20 F100\nM2\n", machine_file("three"), tmp_path, "--offset", "G54=0,0,0")
    assert "G55" in offset.errors
    assert "--offset" in offset.errors
    tool = _tried(HEAD + b"T7 M6\nG43 Z5\nM2\n", machine_file("three"), tmp_path, "--offset", "G54=0,0,0")
    assert "7" in tool.errors
    assert "--tool" in tool.errors


def test_what_is_assumed_is_named(machine_file: Callable[[str], Path], tmp_path: Path) -> None:
    outcome = _tried(GOOD, machine_file("three"), tmp_path, "--assume-zero")
    assert outcome.code == product.DONE
    assert outcome.text is not None
    assert any("G54" in warning["text"] for warning in outcome.entry["warnings"]), outcome.entry
    assert b"G54" in outcome.text.replace(GOOD, b"").split(b"G21")[0] or b"zero" in outcome.text


def test_an_inch_program_without_its_unit_word_is_not_guessed(
    machine_file: Callable[[str], Path], tmp_path: Path
) -> None:
    source = GOOD.replace(b"G21 ", b"")
    outcome = _tried(source, machine_file("three"), tmp_path, "--assume-zero")
    told = outcome.errors + str(outcome.entry)
    assert "unit" in told or "G20" in told or "inch" in told, told


def test_a_change_of_unit_is_told(machine_file: Callable[[str], Path], tmp_path: Path) -> None:
    source = HEAD + b"G20 G1 X1 F10\nM2\n"
    outcome = _tried(source, machine_file("three"), tmp_path, "--assume-zero")
    told = outcome.errors + str(outcome.entry.get("warnings"))
    assert "unit" in told or "inch" in told, told


MACHINES = {
    "a misspelled key": ("least_increment", "least_incremnt", "least_increment"),
    "a misspelled axis": ("[axis.Y]", "[axis.V]", "axis"),
    "an unknown effect": ('"EXX"', '"EXQ"', "EXQ"),
    "a wrong type": ("period = 610.0", 'period = "610"', "period"),
    "too few coefficients": ("[0.011, -0.008]", "[0.011]", "coefficients"),
    "an empty range": ("[-20000, 20000]", "[1, 1]", "range"),
    "not a number": ("coefficients = [25e-6]", "coefficients = [nan]", "coefficients"),
    "no TOML": ('name = "judge', "name = judge", "not TOML"),
}


@pytest.mark.parametrize("name", MACHINES)
def test_bad_machine_files(name: str, machine_file: Callable[[str], Path], tmp_path: Path) -> None:
    old, new, word = MACHINES[name]
    text = "least_increment = { linear = 0.001 }\n" + machine_file("three").read_text()
    assert old in text
    path = tmp_path / "machine.toml"
    path.write_text(text.replace(old, new))
    outcome = _tried(GOOD, path, tmp_path, "--assume-zero")
    assert (outcome.code, outcome.text) == (product.UNREADABLE, None), outcome.errors
    assert all(code.startswith("NCF3") for code in outcome.codes), outcome.errors
    assert outcome.codes
    assert "machine.toml" in outcome.errors
    assert word in outcome.errors


def test_an_output_that_exists_stays(machine_file: Callable[[str], Path], tmp_path: Path) -> None:
    program, target = tmp_path / "program.ngc", tmp_path / "out.ngc"
    program.write_bytes(GOOD)
    target.write_bytes(b"precious")
    arguments = ("fix", program, "-m", machine_file("three"), "-o", target, "--assume-zero")
    code, _, errors = product.command(*arguments)
    assert code == product.USAGE
    assert "NCF004" in errors
    assert "out.ngc" in errors
    assert target.read_bytes() == b"precious"
    assert product.command(*arguments, "--force")[0] == product.DONE
    assert target.read_bytes() != b"precious"


@pytest.mark.parametrize("before", [None, b"what was there before"])
@pytest.mark.parametrize("written", [0, 1, 17])
def test_a_full_disk_leaves_nothing_half_written(
    machine_file: Callable[[str], Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    before: bytes | None,
    written: int,
) -> None:
    program, target = tmp_path / "program.ngc", tmp_path / "out.ngc"
    program.write_bytes(GOOD)
    if before is not None:
        target.write_bytes(before)
    real, left = os.write, [written]

    def full(handle: int, data: bytes) -> int:
        part = bytes(data)[: left[0]]
        if not part:
            raise OSError(errno.ENOSPC, "No space left on device")
        left[0] -= len(part)
        return real(handle, part)

    monkeypatch.setattr(os, "write", full)
    code, _, errors = product.command(
        "fix", program, "-m", machine_file("three"), "-o", target, "--assume-zero", "--force"
    )
    monkeypatch.undo()
    assert code == product.USAGE
    assert "NCF007" in errors
    expected = {"program.ngc"} | ({"out.ngc"} if before is not None else set())
    assert {path.name for path in tmp_path.iterdir()} == expected
    assert before is None or target.read_bytes() == before


def test_a_program_cut_in_a_block_is_no_fault(machine_file: Callable[[str], Path], tmp_path: Path) -> None:
    for cut in range(1, len(GOOD)):
        outcome = product.fix_text(GOOD[:cut], machine_file("three"), tmp_path, "--assume-zero")
        assert outcome.code in (product.DONE, product.UNREADABLE, product.REFUSED), (GOOD[:cut], outcome.errors)
