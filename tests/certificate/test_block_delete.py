"""Programs with block delete are proved in each position of its switches."""

from __future__ import annotations

import random

import pytest

from certificate.planting import GIVEN, LANGUAGES, SETUP, Writer, machine
from ncfix.certificate.coordinates import Given
from ncfix.certificate.findings import BlockProof
from ncfix.certificate.proof import prove
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.diagnostics import NcfixError
from ncfix.text.dialect import get
from ncfix.text.reader import read


def marked(language: str, rng: random.Random) -> bytes:
    """A program of which every sixth line may be skipped, by one switch or two."""
    lines = Writer(language, rng, rng.random() < 0.6, False, {}, []).program(20).decode().splitlines()
    marks = ["/", "/2 "] if language in ("iso", "fanuc", "siemens") and rng.random() < 0.5 else ["/"]
    head = next(row for row, line in enumerate(lines) if "200" in line) + 2
    for row in range(head, len(lines) - 1):
        if rng.random() < 1 / 6:
            lines[row] = rng.choice(marks) + lines[row]
    return ("\n".join(lines) + "\n").encode()


def corrected(text: bytes, language: str) -> bytes:
    options = FixOptions(figures=False, allow_refused=True)
    return fix_program(read(text, "part", get(language)), machine("three"), SETUP, options).text


def proof_of(text: bytes, fixed: bytes, language: str, given: Given = GIVEN) -> BlockProof:
    return prove(text, fixed, machine("three"), given, language)


@pytest.mark.parametrize("language", LANGUAGES)
def test_good_programs_are_proved_in_all_positions(language: str) -> None:
    rng, proved, motions = random.Random(language), 0, 0
    for _ in range(6):
        text = marked(language, rng)
        try:
            fixed = corrected(text, language)
        except NcfixError:  # an arc that does not close where a line before it is skipped
            continue
        proof = proof_of(text, fixed, language)
        assert proof.faults == [], (proof.faults, text.decode(), fixed.decode())
        assert proof.proved + proof.unproved == proof.blocks
        proved, motions = proved + proof.proved_motions, motions + proof.motions
    assert proved > 0.7 * motions > 0, (proved, motions)  # the others: `fix` leaves what differs by position


PROGRAM = (
    b"G71 G90 G17 G40 G94\nG54\nT1 D1 M6\nG0 X0 Y0 Z50\nG1 X10 F500\n"
    b"/G1 X-300 Y285 Z5\n/2 G1 X-80 Y3 Z9\nG1 X5 Y5 Z5\nM30\n"
)


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ((b"\nG1 X4.974 Y4", b"\nG1 X4.974 Y5"), 8),
        ((b"/2 G1 X", b"/ G1 X"), 7),
        ((b"/G1 X", b"G1 X"), 6),
        ((b"/2 G1 X-80.0", b"/2 G1 X-80.1"), 7),
    ],
)
def test_faults_in_blocks_that_may_be_skipped_are_found(change: tuple[bytes, bytes], where: int) -> None:
    fixed = corrected(PROGRAM, "siemens")
    assert proof_of(PROGRAM, fixed, "siemens").faults == []
    assert change[0] in fixed, fixed
    proof = proof_of(PROGRAM, fixed.replace(*change, 1), "siemens")
    assert where in {fault.original for fault in proof.faults}


def test_a_piece_without_the_mark_of_its_block_is_a_fault() -> None:
    fixed = corrected(PROGRAM, "siemens")
    piece = next(line for line in fixed.splitlines() if line.startswith(b"/") and b"G1" not in line)
    faults = proof_of(PROGRAM, fixed.replace(piece, piece.lstrip(b"/"), 1), "siemens").faults
    assert any("mark of block delete" in fault.text for fault in faults)


def test_the_mark_may_stand_behind_the_number_of_the_block() -> None:
    text = b"G21 G90 G17\nN10 G0 X0. Y0. Z50.\nN20 /G1 X40. F500.\nN30 G91 G1 X5.\nM30\n"
    both = proof_of(text, text, "fanuc", Given(assume_zero=True))
    off, on = (proof_of(text, text, "fanuc", Given(assume_zero=True, skip=skip)) for skip in (False, True))
    assert 4 in both.left.keys() | both.faulty  # 45 or 5
    assert (off.motions, on.motions) == (3, 2)
