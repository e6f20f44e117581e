"""Shifts that a program makes itself are followed as `fix` does, and have to stay as they are."""

from __future__ import annotations

import random

import pytest

from certificate.planting import machine
from conftest import FULL
from ncfix.certificate.coordinates import Given
from ncfix.certificate.findings import BlockProof
from ncfix.certificate.proof import prove
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.control.setup import Setup
from ncfix.text.dialect import get
from ncfix.text.reader import read

PLACES = {name: {"X": 30.0, "Y": -20.0, "Z": 60.0} for name in ("G54", "G55")}
START = {"X": 0.0, "Y": 0.0, "Z": 200.0}
SHIFTS = {
    "linuxcnc": ("G92", "G92", "G92.1"),
    "iso": ("G92", "G92", "G92.1"),
    "fanuc": ("G52", "G52"),
    "haas": ("G52", "G92"),
    "mitsubishi": ("G52", "G92"),
    "siemens": ("TRANS", "ATRANS", "TRANS"),
}


def words(rng: random.Random, fewest: int = 1) -> str:
    axes = sorted(rng.sample("XYZ", rng.randint(fewest, 3)))
    return " ".join(f"{axis}{rng.randint(-20, 80) + rng.choice((0.25, 0.5)):.3f}" for axis in axes)


def shifted(rng: random.Random, dialect: str) -> bytes:
    """A program with shifts between its motions."""
    lines = ["G71 G90 G17 G40 G94" if dialect == "siemens" else "G21 G90 G17 G40 G49 G80 G94", "G54"]
    lines += ["G0 X0. Y0. Z50."]
    for _ in range(rng.randint(5, 15)):
        code = rng.choice(SHIFTS[dialect])
        alone = code == "G92.1" or (code == "TRANS" and rng.random() < 0.4)
        tool = " T1 S900" if dialect in ("iso", "linuxcnc") and rng.random() < 0.3 else ""
        lines.append(code if alone else f"{code} {words(rng)}{tool}")
        lines += [f"{rng.choice(('G0', 'G1'))} {words(rng)} F500." for _ in range(rng.randint(1, 4))]
        lines += [rng.choice(("G54", "G55"))] if rng.random() < 0.2 else []
    body = "\n".join([*lines, "M30", ""])
    return (f"%\nO0001\n{body}%\n" if dialect in ("fanuc", "haas", "mitsubishi") else body).encode()


def proof_of(text: bytes, dialect: str, change: tuple[bytes, bytes] = (b"", b"")) -> tuple[BlockProof, bytes]:
    """The proof of a correction in which something was changed, and the correction."""
    setup = Setup(work_offsets=PLACES, initial=START, assume_zero=True)
    options = FixOptions(allow_refused=True, figures=False)
    three = machine("three")
    fixed = fix_program(read(text, "part", get(dialect)), three, setup, options).text
    return prove(text, fixed.replace(*change, 1), three, Given(PLACES, initial=START, assume_zero=True), dialect), fixed


@pytest.mark.parametrize("dialect", SHIFTS)
def test_programs_with_shifts_are_proved(dialect: str) -> None:
    rng, proved, motions = random.Random(dialect), 0, 0
    for _ in range(8 if FULL else 3):
        text = shifted(rng, dialect)
        proof, fixed = proof_of(text, dialect)
        assert proof.faults == [], (proof.faults[0], text.decode(), fixed.decode())
        proved, motions = proved + proof.proved_motions, motions + proof.motions
    least = {"siemens": 0.85, "fanuc": 0.85, "haas": 0.2, "mitsubishi": 0.2}.get(
        dialect, 0.4
    )  # G52 behind G92 is not followed
    assert proved >= least * motions, (proved, motions)


@pytest.mark.parametrize(
    ("dialect", "line", "other"), [("iso", b"G92 X10.", b"G92 X11."), ("siemens", b"TRANS X10", b"TRANS X10.5")]
)
def test_a_shift_that_was_changed_is_a_fault(dialect: str, line: bytes, other: bytes) -> None:
    text = b"G90 G17\nG0 X0. Y0. Z50.\n%s\nG1 X50. Y20. F500.\nM30\n" % line
    good, _ = proof_of(text, dialect)
    assert (good.faults, good.unproved) == ([], 0)
    bad, _ = proof_of(text, dialect, (line, other))
    assert any(fault.text == "the numbers of a line that moves nothing have changed" for fault in bad.faults)
