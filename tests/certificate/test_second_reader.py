"""The second reader reads lines of one shape at once as it reads them one by one, and follows them alike."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from certificate.planting import GIVEN, cases
from ncfix.certificate.certificate import Subject
from ncfix.certificate.coordinates import Given
from ncfix.certificate.expected import Expected, ProofTask
from ncfix.certificate.proof import prove
from ncfix.certificate.reading import READERS, Family
from ncfix.certificate.text import Lines, Text
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.control.setup import Setup
from ncfix.machine import load
from ncfix.text.dialect import get
from ncfix.text.reader import read

PIECES = {
    Family.WORDS: "N10|G1|G0|g01|X1.5|X-.25|Y+3|Y 4.|Z#1|Z[1+2]|A-90.|C5|I1.|R2|F100|M3|T1|H2|"
    "(a)|(a 5)|;x|%|/|X1.2.3|O5|*|E2|{x}",
    Family.SINUMERIK: "N10|G1|g0|X1.5|X=2|X=IC(3)|Y-.5|Z=R1|A3=1|F500|M30|T1|D1|;a|;a 2|TRAORI|"
    "CYCLE81(1,2)|I4|CR=5|AX1|/|R5",
    Family.KLARTEXT: "12|L|C|CC|X+1.5|X-,5|IY+2|Z3|A+Q5|B-4|FMAX|F500|FQ1|R0|RL|R5|R10|M3|M128|DR+|;a|;a 5|"
    "PA+30|/|BEGIN PGM 5 MM|5.",
}
BLANKS = ("", " ", " ", " ", "  ", "\t")


@pytest.mark.parametrize("family", Family)
def test_lines_of_a_shape_are_read_as_one_by_one(family: Family) -> None:
    rng, texts = random.Random(7), []
    for _ in range(30_000):
        pieces = rng.choices(PIECES[family].split("|"), k=rng.randint(0, 5))
        if family is Family.KLARTEXT and rng.random() < 0.7:
            pieces = [*rng.choice((["12", "L"], ["L"])), *pieces]
        texts.append("".join(rng.choice(BLANKS) + piece for piece in pieces) + rng.choice(BLANKS))
    found = Lines(family, "\n".join(texts).encode(), np.arange(1, len(texts) + 1))
    assert len(found) == len(texts)
    for line, text in zip(found, texts, strict=True):
        alone = READERS[family](line.number, text)
        assert replace(line, plain=False) == alone, text
        assert not line.plain or alone.doubled() == ""
    assert sum(line.plain for line in found) > 1000


@pytest.mark.parametrize(
    ("text", "path"),
    [
        ("X50RND=5", "X 50 RND 5"),
        ("N10G1X-5.5CHF=.2", "X -5.5 CHF .2"),
        ("X1=4 A3=.5 B=3", "X1 4 A3 .5 B 3"),
        ("R5=3 _X1=2 $X=1", ""),
    ],
)
def test_words_of_sinumerik_need_no_blanks(text: str, path: str) -> None:
    found = READERS[Family.SINUMERIK](1, text)
    assert " ".join(f"{word.name} {word.number}" for word in found.path) == path


def test_lines_of_a_shape_are_followed_as_one_by_one() -> None:
    for case in cases(25, 3):
        family = Family.of(case.original, case.language)
        for source in (case.original, case.corrected):
            text = Text.of(source, family)
            one_by_one = replace(text, lines=list(text.lines), read=None)
            slow = replace(one_by_one, lines=[replace(line, plain=False) for line in text.lines])
            assert any(line.plain for line in text.lines)
            ways = (text, one_by_one, slow)
            steps = [[*Expected(ProofTask(each, each, case.machine, GIVEN)).ours.values()] for each in ways]
            assert repr(steps[0]) == repr(steps[2])
            assert repr(steps[0]) == repr(steps[1])  # NaN is NaN


def test_a_long_turn_of_a_table_in_a_short_motion_is_proved() -> None:
    text = b"G21 G90 G94 G17\nG0 X275.4098 Y0. Z-15.9096 B1.2211 C5.\nG1 X276.3466 B1.1 C350. F2400.\nX260. C20.\nM2\n"
    mill = load(str(Path(__file__).parents[2] / "benchmarks" / "five_axis.toml"))
    done = fix_program(read(text, "part.nc", get("linuxcnc")), mill, Setup(assume_zero=True), FixOptions())
    proof = prove(text, done.text, mill, Given(assume_zero=True), "linuxcnc")
    assert done.text.count(b"\n") > text.count(b"\n") + 8
    assert (proof.faults, proof.unproved) == ([], 0)
    lines = done.text.splitlines(keepends=True)
    assert prove(text, b"".join(lines[:8] + lines[9:]), mill, Given(assume_zero=True), "linuxcnc").faults


def test_a_corrected_program_without_its_stamp_is_a_fault(root: Path) -> None:
    """It would be corrected once more: numbers of axes are as good as any other change."""
    mill, text = (
        load(root / "examples" / "guide" / "mill.toml"),
        b"G21 G90 G94\nG0 X0 Y0 Z50 A0 C0\nG1 X100 Y20 Z5 F500\nM2\n",
    )
    done = fix_program(read(text, "p", "linuxcnc"), mill, Setup(assume_zero=True), FixOptions())
    bare = b"".join(line for line in done.text.splitlines(keepends=True) if b"NCFIX" not in line.upper())
    given = Given(assume_zero=True)
    assert bare != text
    assert not prove(text, done.text, mill, given, "linuxcnc").faults
    assert [fault.text for fault in prove(text, bare, mill, given, "linuxcnc").faults] == [
        "the program has changed but has no stamp"
    ]


def test_a_dialect_of_a_plugin_is_read_as_the_one_that_it_varies(root: Path) -> None:
    mill, given = load(root / "examples" / "guide" / "mill.toml"), Given(assume_zero=True)
    text = b"G71 G90 G94 G0 X0 Y0 Z50 A0 C0\nG1 X=100 Y=20 Z5 F500\nM30\n"
    done = fix_program(read(text, "p", "siemens"), mill, Setup(assume_zero=True), FixOptions())
    files = (("p", text), ("q", done.text), ("m", b""))
    verdicts = [Subject(*files, mill, given, "brand", of, 1.0).certificate()["verdict"] for of in ("siemens", "fanuc")]
    assert verdicts == ["proved", "proved in part"]
