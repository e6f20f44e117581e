"""Certificates on the command line: written, compared with later, and beside what `fix` writes."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from cli import conftest
from cli.conftest import Ncfix, Result

ncfix = conftest.ncfix
ROOT = Path(__file__).parents[2]
PROGRAMS = ROOT / "examples" / "programs"


class Example(NamedTuple):
    """An example program with what belongs to it."""

    program: Path
    machine: Path
    setup: Path

    def arguments(self) -> tuple[object, ...]:
        return ("-m", self.machine, "--setup", self.setup)


@pytest.fixture
def example() -> Example:
    """Five axes under tool-centre-point control, in Klartext."""
    machine = ROOT / "examples" / "machines" / "dmu50.toml"
    return Example(PROGRAMS / "klartext_tcp.h", machine, PROGRAMS / "klartext.setup.toml")


@pytest.fixture
def fixed(example: Example, ncfix: Ncfix, tmp_path: Path) -> Path:
    """Its correction, with a certificate beside it."""
    output = tmp_path / "fixed.h"
    done = ncfix("fix", example.program, "-o", output, "--certificate", *example.arguments())
    assert done.code == 0
    assert "certificate         proved in part, 156 of 158 blocks" in done.err
    return output


def _certificate(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(path.read_text())
    return found


@pytest.mark.parametrize("numbers", ["none", "renumber"])
@pytest.mark.parametrize(
    ("program", "machine", "setup"),
    [
        ("klartext_tcp.h", "dmu50", "klartext.setup.toml"),
        ("siemens_traori.mpf", "wCAYFXZSt", "siemens.setup.toml"),
    ],
)
def test_blocks_that_are_numbered_anew(
    program: str, machine: str, setup: str, numbers: str, ncfix: Ncfix, tmp_path: Path
) -> None:
    given = ("-m", ROOT / "examples/machines" / f"{machine}.toml", "--setup", PROGRAMS / setup)
    options = ("--block-numbers", numbers, "--certificate", "--allow-refused")
    done = ncfix("fix", PROGRAMS / program, "-o", tmp_path / program, *options, *given)
    found = _certificate(tmp_path / f"{program}.certificate.json")
    assert found["faults"] == [], done.err
    assert found["proved_motions"]


def test_tools_may_have_numbers_and_names(example: Example, ncfix: Ncfix, tmp_path: Path) -> None:
    options = ("-o", tmp_path / "fixed.h", "--certificate", "--tool", "DRILL 8.5=85", *example.arguments())
    done = ncfix("fix", example.program, *options)
    assert done.code == 0, done.err
    assert len(_certificate(tmp_path / "fixed.h.certificate.json")["setup_sha256"]) == 64


def test_fix_writes_a_certificate(fixed: Path) -> None:
    found = _certificate(fixed.with_name("fixed.h.certificate.json"))
    assert found["verdict"] == "proved in part"
    assert (found["proved_motions"], found["motions"], found["faults"]) == (142, 144, [])
    assert [each["reason"] for each in found["not_proved"]] == ["the program has not yet given the position of an axis"]
    assert found["strategy"] == "rotary-then-linear"
    assert len(found["corrected"]["sha256"]) == 64


def test_a_certificate_holds_as_long_as_nothing_changes(
    example: Example,
    fixed: Path,
    ncfix: Ncfix,
    tmp_path: Path,
) -> None:
    earlier = fixed.with_name("fixed.h.certificate.json")

    def against(machine: Path = example.machine) -> Result:
        given = ("-m", machine, "--setup", example.setup, "--against", earlier)
        return ncfix("verify", example.program, fixed, *given)

    assert against().code == 0
    other = tmp_path / "other.toml"
    other.write_text(example.machine.read_text() + "\n# the same machine, another file\n")
    found = against(other)
    assert found.code == 1
    assert "NCF032: the machine file is not that of the certificate" in found.err
    fixed.write_text(fixed.read_text().replace("Z+3.5", "Z+3.6", 1))
    found = against()
    assert found.code == 1
    assert "the corrected program is not that of the certificate" in found.err
    assert "verdict: proved in part in the certificate, faulty now" in found.err


def test_a_fault_is_told_with_its_lines(example: Example, fixed: Path, ncfix: Ncfix, tmp_path: Path) -> None:
    lines = fixed.read_text().splitlines(keepends=True)
    del lines[40]
    fixed.write_text("".join(lines))
    output = tmp_path / "certificate.json"
    found = ncfix("verify", example.program, fixed, "--certificate", output, "--json", *example.arguments())
    assert found.code == 1
    assert found.json()["verdict"] == _certificate(output)["verdict"] == "faulty"
    assert {(each["text"], each["original_line"]) for each in found.json()["faults"]} == {("a line is missing", 39)}


@pytest.mark.parametrize("text", ["", "{", "[]", '{"schema": 1}', '{"schema": 2}', "\xff", "[" * 100_000])
def test_what_is_no_certificate_is_refused(text: str, example: Example, ncfix: Ncfix, tmp_path: Path) -> None:
    path = tmp_path / "certificate.json"
    path.write_bytes(text.encode("latin-1"))
    found = ncfix("verify", example.program, example.program, "--against", path, *example.arguments())
    assert found.code == 3
    assert "NCF034" in found.err


def test_a_certificate_needs_a_file(example: Example, ncfix: Ncfix) -> None:
    found = ncfix("fix", example.program, "-o", "-", "--certificate", *example.arguments())
    assert found.code == 2
    assert "NCF001" in found.err


def test_the_certificate_says_what_it_does_not_know(ncfix: Ncfix, tmp_path: Path) -> None:
    arguments = ("-m", ROOT / "examples" / "machines" / "wCAYFXZSt.toml", "--setup", PROGRAMS / "fanuc.setup.toml")
    program, output = tmp_path / "part.nc", tmp_path / "fixed.nc"
    program.write_bytes((PROGRAMS / "fanuc_tilted.nc").read_bytes().replace(b"G53.1", b"G53.6"))
    found = ncfix("fix", program, "-o", output, "--json", "--certificate", *arguments)
    (entry,) = found.json()["files"]
    assert entry["certificate"]["verdict"] == "proved in part"
    assert "G53.6 is not known to the second reader" in [each["reason"] for each in entry["certificate"]["not_proved"]]


@pytest.mark.parametrize("part", [1 << 20, 1024])
def test_a_fanuc_in_inches_is_proved_and_verified_by_its_own_digits(
    part: int, ncfix: Ncfix, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """0.001 mm are 0.0001 inch there, whether the program is taken as a whole or in parts."""
    monkeypatch.setenv("NCFIX_PART_BYTES", str(part))
    text = (ROOT / "examples/machines/three_axis.toml").read_text()
    machine, program, fixed = tmp_path / "m.toml", tmp_path / "part.nc", tmp_path / "fixed.nc"
    machine.write_text(re.sub(r"least_increment = .*", "least_increment = { linear = 0.001, rotary = 0.001 }", text))
    lines = [f"X{k % 7}.{k % 9}Y{k % 5}.Z{k % 3}." for k in range(300)]
    program.write_text("\n".join(["G20G90G94G17G54", "G0X0.Y0.Z3.", "G1Z0.F20.", *lines, "M30", ""]))
    given = ("-m", machine, "--dialect", "fanuc", "--assume-zero", "-j", "1")
    assert ncfix("fix", program, "-o", fixed, "--certificate", *given).code == 0
    blocks = [line for line in fixed.read_text().splitlines() if not line.startswith("(")]
    assert max(map(len, re.findall(r"\.(\d+)", "".join(blocks)))) == 4
    assert _certificate(tmp_path / "fixed.nc.certificate.json")["faults"] == []
    assert ncfix("verify", program, fixed, *given[:-2]).code == 0
