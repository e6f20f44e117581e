"""The five-axis Fanuc programs that ship: corrected on their machine, within the figures of docs/dialects.md."""

from __future__ import annotations

from pathlib import Path

import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import follow
from ncfix.control.moves import MotionKind
from ncfix.control.setup_file import load as load_setup
from ncfix.machine import load
from ncfix.text.dialect import detect
from ncfix.text.reader import read

PROGRAMS = ("fanuc_tcp.nc", "fanuc_tilted.nc")


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_shipped_program_is_corrected(root: Path, name: str) -> None:
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    setup = load_setup(str(root / "examples/programs/fanuc.setup.toml"))
    source = (root / "examples/programs" / name).read_bytes()
    assert detect(source, name, machine.control or "").name == "fanuc"
    fixed = fix_program(read(source, name, "fanuc"), machine, setup, FixOptions())
    before, after = fixed.report.error_before_um["max"], fixed.report.error_after_um["max"]
    row = next(line for line in (root / "docs/dialects.md").read_text().splitlines() if f"`{name}`" in line)
    assert f"| {before:.1f} um | {after:.2f} um |" in row
    assert fixed.report.refused == ()


def test_in_the_tilted_plane_the_drill_stands_on_its_holes(root: Path) -> None:
    """Hole 1 is at X10 Y10 Z-12 of a plane tilted by 30 degrees about X, with its origin at X20 Y-30 of the part."""
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    setup = load_setup(str(root / "examples/programs/fanuc.setup.toml"))
    program = read((root / "examples/programs/fanuc_tilted.nc").read_bytes(), "fanuc_tilted.nc", "fanuc")
    moves = follow(program, machine, setup).trace.moves
    hole = moves.end[moves.kind == MotionKind.CYCLE][0]
    xyz = hole[[moves.axes.index(letter) for letter in "XYZ"]]
    assert xyz == pytest.approx([30.0, -30 + 10 * 3**0.5 / 2 + 6, 60 + 5 - 12 * 3**0.5 / 2])
    assert hole[moves.axes.index("A")] == pytest.approx(30 * 3.141592653589793 / 180)
