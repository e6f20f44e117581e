"""The five-axis SINUMERIK programs that ship: corrected on their machine, within the figures of docs/dialects.md."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import follow
from ncfix.control.moves import MotionKind
from ncfix.control.setup_file import load as load_setup
from ncfix.machine import load
from ncfix.text.dialect import detect
from ncfix.text.reader import read

PROGRAMS = ("siemens_traori.mpf", "siemens_swivel.mpf")


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_shipped_program_is_corrected(root: Path, name: str) -> None:
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    setup = load_setup(str(root / "examples/programs/siemens.setup.toml"))
    source = (root / "examples/programs" / name).read_bytes()
    assert detect(source, name).name == "siemens"
    fixed = fix_program(read(source, name, "siemens"), machine, setup, FixOptions())
    before, after = fixed.report.error_before_um["max"], fixed.report.error_after_um["max"]
    row = next(line for line in (root / "docs/dialects.md").read_text().splitlines() if f"`{name}`" in line)
    assert f"| {before:.1f} um | {after:.2f} um |" in row
    assert fixed.report.refused == ()
    assert "NCF255" not in {message.code for message in fixed.report.warnings}


def test_the_vectors_are_corrected_by_the_full_strategy(root: Path) -> None:
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    setup = load_setup(str(root / "examples/programs/siemens.setup.toml"))
    source = (root / "examples/programs/siemens_traori.mpf").read_bytes()
    program = read(source, "siemens_traori.mpf", "siemens")
    fixed = fix_program(program, machine, setup, FixOptions(strategy="full"))
    assert fixed.report.refused == ()
    again = read(fixed.text, "siemens_traori.mpf", "siemens")
    nominal, moved = (follow(each, machine, setup).trace.moves for each in (program, again))
    turned = np.degrees(np.abs(moved.end - nominal.end)[nominal.tcp][:, nominal.rotary])
    assert 1e-4 < turned.max() < 0.05


def test_in_the_tilted_plane_the_drill_stands_on_its_holes(root: Path) -> None:
    """Hole 1 is at X10 Y10 Z-12 of a plane tilted by 30 degrees about X, with its origin at X20 Y-30 Z5 of the part."""
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    setup = load_setup(str(root / "examples/programs/siemens.setup.toml"))
    program = read((root / "examples/programs/siemens_swivel.mpf").read_bytes(), "siemens_swivel.mpf", "siemens")
    moves = follow(program, machine, setup).trace.moves
    holes = np.flatnonzero(moves.kind == MotionKind.CYCLE)
    hole = moves.end[holes[0]][[moves.axes.index(letter) for letter in "XYZ"]]
    assert hole == pytest.approx([30.0, -30 + 10 * 3**0.5 / 2 + 6, 60 + 5 + 5 - 12 * 3**0.5 / 2])
