"""The compiled core and the same source interpreted do the same, bit by bit."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from compensate import test_stream_others
from compensate.test_stream import program
from conftest import require_core
from core.twins import CALLS, DifferentFormsError, both_forms
from machine import chains
from ncfix import core
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.control.setup import Setup
from ncfix.diagnostics import NcfixError
from ncfix.machine import Machine, State, load
from ncfix.text.reader import read
from program.arcs import full_of_arcs
from program.klartext import test_parts
from program.test_many_blocks import klartext, rs274

OPTIONS = FixOptions(tolerance_um=5.0, allow_refused=True)
SETUP = Setup(assume_zero=True, no_point="calculator")
SOME = 10
"""Of the corpus so many programs of each control, or a few more."""


@pytest.fixture(autouse=True)
def _compared() -> Iterator[None]:
    require_core()
    with both_forms():
        yield


def fixed(source: bytes, machine: Machine, dialect: str, options: FixOptions = OPTIONS) -> bytes:
    try:
        return fix_program(read(source, "p.ngc", dialect), machine, SETUP, options).text
    except NcfixError:
        return b""


@pytest.mark.parametrize(
    ("name", "strategy"),
    [
        ("benchmarks/five_axis", "rotary-then-linear"),
        ("examples/machines/dmu50", "position"),
        ("examples/machines/wCBXFZYSt", "full"),
    ],
)
def test_programs(name: str, strategy: str, root: Path) -> None:
    options = FixOptions(tolerance_um=5.0, allow_refused=True, strategy=strategy)
    assert fixed(program(5, 60, 0.05), load(root / f"{name}.toml"), "linuxcnc", options)
    assert CALLS["scan.Scanner.scan"]
    assert CALLS["motions.followed"]


@pytest.mark.parametrize("seed", range(2))
def test_machines(seed: int) -> None:
    rng = np.random.default_rng(seed)
    machine = chains.random_errors(rng, chains.random_chain(rng, 4), 1e-4)
    q = rng.uniform(-1, 1, (70, len(machine.axes))) * np.where(machine.rotary, 2.0, 300.0)
    machine.actual_tip(q, State(50.0))
    machine.actual(q, State(50.0))
    assert any(name.startswith(("chain.", "points.")) for name in CALLS)


@pytest.mark.parametrize(
    ("source", "dialect"),
    [
        (test_stream_others.program(5, 60, 0.05, siemens=True), "siemens"),
        (test_stream_others.program(6, 60, 0.05, siemens=False), "fanuc"),
        (test_parts.program(5, 60, 0.05), "heidenhain"),
    ],
    ids=["siemens", "fanuc", "heidenhain"],
)
def test_programs_of_other_controls(source: bytes, dialect: str, root: Path) -> None:
    assert fixed(source, load(root / "benchmarks/five_axis.toml"), dialect)
    assert CALLS["chain.tips"]
    assert CALLS["words.WordPrinter.write"]


@pytest.mark.parametrize("dialect", ["linuxcnc", "siemens"])
def test_arcs(dialect: str, root: Path) -> None:
    head = ["G90 G94 F1000", "G71" if dialect == "siemens" else "G21", "G0 X0. Y0. Z0. B0. C0."]
    lines = [*head, *full_of_arcs(3, 60, sinumerik=dialect == "siemens"), "M2\n"]
    assert fixed("\n".join(lines).encode(), load(root / "benchmarks/five_axis.toml"), dialect)
    assert CALLS["words.WordPrinter.write_centres"]


@pytest.mark.parametrize("folder", ["linuxcnc", "fanuc", "heidenhain"])
def test_the_corpus(folder: str, shared: Callable[[str], Path], root: Path) -> None:
    """The programs of the other controls there are too short for the core."""
    machine = load(root / "examples/machines/dmu50.toml")
    sources = [path.read_bytes() for path in sorted(shared("corpus").glob(f"{folder}/*"))]
    sources = [source for source in sources if len(source) < 8000]
    written = [fixed(source, machine, folder) for source in sources[:: max(len(sources) // SOME, 1)]]
    assert sum(map(bool, written)) > 2
    assert CALLS


@pytest.mark.parametrize(("family", "dialect"), [(rs274, "linuxcnc"), (klartext, "heidenhain")])
def test_generated_blocks_and_mutations(family: Callable[..., str], dialect: str, root: Path) -> None:
    chance = random.Random(dialect)
    lines = [family(random.Random(chance.randrange(150)), chance) for _ in range(600)]
    head = b"0 BEGIN PGM P MM\n" if dialect == "heidenhain" else b""
    text = head + "\n".join(lines).encode("latin-1")
    read(text, "p", dialect)
    for _ in range(30):
        at = chance.randrange(len(text))
        text = text[:at] + bytes([chance.choice(b"0123456789.+-XYZ();\n \x00\xff")]) + text[at + chance.randrange(3) :]
        part = chance.randrange(len(text) - 2000)
        try:
            read(head + text[part : part + 2000], "p", dialect)
        except NcfixError:
            continue
    assert CALLS["scan.Scanner.scan"]


@pytest.mark.parametrize(
    ("module", "name", "value"), [("scan", "ZERO", 49), ("words", "ZERO", 49), ("chain", "FORTH", 9)]
)
def test_a_planted_difference_is_caught(
    module: str, name: str, value: int, root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(core.interpreted(module), name, value)
    with pytest.raises(DifferentFormsError):
        fixed(program(5, 10, 0.0), load(root / "benchmarks/five_axis.toml"), "linuxcnc")
