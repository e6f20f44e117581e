"""Programs of all kinds and languages, some of them damaged, come out the same in every way in which they are written.

`NCFIX_MUTATED=100000` tries so many (hours), `NCFIX_SEED` others.
"""

from __future__ import annotations

import os
import random
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from unittest import mock

import pytest

from compensate.streaming import OPTIONS, streamed
from conftest import require_core, some
from goldens.programs import Program, generated
from ncfix import core
from ncfix.compensate.driver import fix_program
from ncfix.control.setup import Setup
from ncfix.control.setup_file import load as load_setup
from ncfix.control.trace import NotInPartsError
from ncfix.diagnostics import NcfixError
from ncfix.machine import Machine, load
from ncfix.text.dialect import Dialect
from ncfix.text.language import language_of
from ncfix.text.reader import read
from ncfix.writer.language import WrittenLanguage

COUNT = int(os.environ.get("NCFIX_MUTATED") or some(40))
SEED = os.environ.get("NCFIX_SEED", "0")
SIZE = 1000
"""Bytes of a part."""
CHARACTERS = b"0123456789.-+ XYZBCIJKRFGMN()[]#;\r\t~Q"
WORDS = (b" X1.", b" Y-.5", b" Z[1+2]", b" R5", b" I1 J1", b" (a)", b"; b", b" F100", b" G0", b" G2", b" M5", b" C90")


@pytest.fixture(autouse=True)
def _as_it_was() -> Iterator[None]:
    yield
    core.use(None)


@cache
def programs() -> dict[str, list[Program]]:
    """Those of the archive that are short, by language."""
    found: dict[str, list[Program]] = {}
    for program in generated():
        if len(program.text) < 3000:
            found.setdefault(program.dialect, []).append(program)
    return found


def damaged(text: bytes, rng: random.Random) -> bytes:
    """A program with a few accidents: a character, a word, or a line that is doubled, lost, or put elsewhere."""
    lines = text.split(b"\n")
    for _ in range(rng.choice((0, 0, 1, 1, 2, 3))):
        row, accident = rng.randrange(len(lines)), rng.randrange(5)
        place = rng.randrange(len(lines[row]) + 1)
        if accident == 0:
            lines[row] += rng.choice(WORDS)
        elif accident == 1:
            lines.insert(rng.randrange(len(lines) + 1), lines[row])
        elif accident == 2 and len(lines) > 1:
            del lines[row]
        else:
            character = bytes([rng.choice(CHARACTERS)])
            lines[row] = lines[row][:place] + character + lines[row][place + (accident == 3) :]
    return b"\n".join(lines)


@cache
def machine_of(name: str, root: Path) -> Machine:
    """One of the machines that the programs of the archive are for."""
    shipped = root / "examples" / "machines" / f"{name}.toml"
    return load(shipped if shipped.exists() else root / "tests" / "goldens" / "machines" / f"{name}.toml")


def outcome(make: Callable[[], bytes]) -> bytes | str:
    """The corrected text, or that there is none: two ways may come upon another reason first."""
    try:
        return make()
    except NcfixError:
        return "refused"


def test_every_way_writes_the_same(root: Path) -> None:
    require_core()
    setup = replace(load_setup(str(root / "tests" / "goldens" / "setup.toml")), assume_zero=True, no_point="calculator")
    counted = Counter[str]()
    for number in range(COUNT):
        rng = random.Random(f"{SEED} {number}")
        program = rng.choice(programs()[rng.choice(sorted(programs()))])
        text, machine = damaged(program.text, rng), machine_of(rng.choice(program.machines), root)
        found = in_all_ways(text, program.dialect, machine, setup)
        one_by_one = found.pop("one by one")
        counted[program.dialect] += one_by_one not in ("refused", text)
        different = [way for way, each in found.items() if each not in (one_by_one, None)]
        counted["in parts"] += found["in parts"] is not None
        assert not different, f"seed {SEED}, program {number}, {program.name}: {different}\n{text.decode('latin-1')}"
    assert counted["in parts"] > COUNT / 10, counted
    assert sum(counted[dialect] for dialect in programs()) > COUNT / 4, counted


def in_all_ways(text: bytes, dialect: str, machine: Machine, setup: Setup) -> dict[str, bytes | str | None]:
    """What becomes of a program in each way; None where it cannot go in parts."""

    def fixed() -> bytes:
        return fix_program(read(text, "p.nc", dialect), machine, setup, OPTIONS).text

    found: dict[str, bytes | str | None] = {}
    for form in ("plain", "compiled"):
        core.use(form)
        found[form] = outcome(fixed)
    try:
        found["in parts"] = outcome(lambda: streamed(text, machine, dialect, SIZE, setup=setup)[0])
    except NotInPartsError:
        found["in parts"] = None

    def without_bulk(dialect: Dialect, kind: type[WrittenLanguage]) -> WrittenLanguage:
        return replace(language_of(dialect, kind), bulk=None)

    core.use("plain")
    with mock.patch("ncfix.writer.emit.language_of", without_bulk):
        found["one by one"] = outcome(fixed)
    return found


BESIDE_UNKNOWN = """BEGIN PGM U MM
TOOL CALL 1 Z S1000
L X+10 Y+5 Z+250 R0 FMAX
L B+0 C+0 FMAX
CYCL DEF 10.0 ROTATION
CYCL DEF 10.1 ROT+8.895
L X0+17.883 Y-3.112 Z+60 R0 FMAX
L X+17.883 Y-3.1Z12 RL F500
L X+10.318
L X-13.655 F700
L Y-6.731 F700
END PGM U MM
"""
"""A contour behind a block that is not understood: nobody knows where the rotary axes stand."""
CENTRE_BEHIND_CT = """G17 G40 G90 G94 G710
T1 D1 M6
G54
G0 X0 Y0 Z40 A0 C0 F1000
G1 X4 Y5
CT X10 Y7.27 Z2
X17 Y-4.5
G18 I1 J1
G1 X1
M30
"""
"""Centre words alone, where the arc before it was CT and is written as another."""


@pytest.mark.parametrize(
    ("text", "dialect", "machine"), [(BESIDE_UNKNOWN, "heidenhain", "head"), (CENTRE_BEHIND_CT, "siemens", "table")]
)
def test_what_was_a_fault_of_ncfix(text: str, dialect: str, machine: str, root: Path) -> None:
    setup = replace(load_setup(str(root / "tests" / "goldens" / "setup.toml")), assume_zero=True)
    found = fix_program(read(text.encode(), "p.nc", dialect), machine_of(machine, root), setup, OPTIONS)
    assert found.changed
    assert found.report.refused
