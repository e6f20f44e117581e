"""Blocks at which the control would stop, and exactly what is said about them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ncfix.diagnostics import ExitCode, SourceError, UsageError
from ncfix.text.codes import CODES
from program.tracing import follow

SOURCES = Path(__file__).parents[2] / "src" / "ncfix" / "program"

GOLDEN = {
    "G0 G1 X1": "part.ngc:1:4: NCF208: G0 and G1 exclude one another (both set the motion)\n    G0 G1 X1\n       ^",
    "G1 X1 F1 M3 M5": (
        "part.ngc:1:13: NCF208: M3 and M5 exclude one another (both set the spindle and state)\n"
        "    G1 X1 F1 M3 M5\n                ^"
    ),
    "G0 X1 I2": "part.ngc:1:7: NCF209: no code of the block uses the word I\n    G0 X1 I2\n          ^",
    "G0 X[1 / [#5 - #6]]": "part.ngc:1:4: NCF210: division by zero\n    G0 X[1 / [#5 - #6]]\n       ^",
    "G0 Y#<depth>": (
        "part.ngc:1:4: NCF211: parameter #<depth> is used and not defined\n    G0 Y#<depth>\n       ^\n"
        '  hint: if the control has it: variables."#<depth>" in the setup file'
    ),
    "F1 G2 X10 I6 J0": (
        "part.ngc:1: NCF220: the arc does not close: its radius is 6.0000 mm at the start and 4.0000 mm at the end"
        " (2.0000 apart, 0.0283 allowed)\n    F1 G2 X10 I6 J0\n"
        "  hint: check the centre words, and whether they count from the start of the arc or from the zero point"
    ),
    "X1": (
        "part.ngc:1: NCF221: the block has axis words, but no motion code is in force\n    X1\n  hint: G0 or G1 is "
        "missing"
    ),
    "G1 X1": "part.ngc:1: NCF225: a motion at feed rate, but no feed rate (F) is set\n    G1 X1",
    "G123 X1": (
        "part.ngc:1:1: NCF227: G123 is not a code of LinuxCNC\n    G123 X1\n    ^\n  hint: if the machine remaps it, "
        "ncfix cannot know what it does"
    ),
    "M77": "part.ngc:1:1: NCF229: M77 is not a code of LinuxCNC\n    M77\n    ^",
    "N1 G0 X1\nN2 o1 if [#<no>]": (
        "part.ngc:2:4: NCF211: parameter #<no> is used and not defined\n    N2 o1 if [#<no>]\n       ^\n"
        '  hint: if the control has it: variables."#<no>" in the setup file'
    ),
    "o<hole> call [1]": (
        "part.ngc:1:1: NCF231: there is no subprogram o<hole>\n    o<hole> call [1]\n    ^\n  hint: ncfix searches "
        "the rest of the file, the folder of the program and that of --subprograms DIR"
    ),
}


@pytest.mark.parametrize("text", GOLDEN)
def test_the_message_is_exact(text: str) -> None:
    with pytest.raises(SourceError) as caught:
        follow(text)
    assert str(caught.value) == GOLDEN[text]
    assert caught.value.exit_code == ExitCode.UNREADABLE


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("G80 X1", "NCF221"),
        ("G53 X1", "NCF221"),
        ("G1 F1 X1\nG53 G2 X2 I1", "NCF221"),
        ("G91 G53 G0 X1", "NCF221"),
        ("G28 G0 X1", "NCF221"),
        ("G4", "NCF221"),
        ("G5.3", "NCF221"),
        ("G33 Z1 K1", "NCF221"),
        ("G38.2 Z-1", "NCF225"),
        ("F1 G38.2 Z0", "NCF221"),
        ("M72", "NCF221"),
        ("G19 G41 D1", "NCF221"),
        ("G41 D1\nG42 D1", "NCF221"),
        ("G41 D1\nG18", "NCF221"),
        ("G18 G0 @1 ^2", "NCF223"),
        ("G0 X1 @1 ^2", "NCF223"),
        ("G0 @1", "NCF223"),
        ("G95 F1 G1 X1", "NCF225"),
        ("G93 G1 X1", "NCF225"),
        ("F0 G1 X1", "NCF225"),
        ("M3 M7 M48 M60 M62 P1", "NCF208"),
        ("G[120+3] X1", "NCF227"),
        ("G[1.23] X1", "NCF221"),
        ("H1", "NCF209"),
        ("G0 X1 P1", "NCF209"),
        ("M190", None),
    ],
)
def test_blocks_that_linuxcnc_refuses(text: str, code: str | None) -> None:
    if code is None:
        assert len(follow(text).moves) == 0
        return
    with pytest.raises(SourceError) as caught:
        follow(text)
    assert caught.value.code == code


def test_every_code_that_is_raised_is_explained() -> None:
    files = [path for path in SOURCES.rglob("*.py") if not path.stem.endswith("codes")]
    used = {code for path in files for code in re.findall(r'"(NCF\d{3})"', path.read_text(encoding="utf-8"))}
    assert used <= CODES.keys()
    explained = {code for code in CODES if code.startswith(("NCF2", "NCF38"))}
    assert explained <= used


def test_an_axis_name_that_is_no_letter() -> None:
    from ncfix.control.setup import Setup
    from ncfix.control.trace import trace
    from ncfix.text.reader import read

    with pytest.raises(UsageError) as caught:
        trace(read(b"M2\n", "part.ngc"), Setup(), ("X", "Q1"), frozenset())
    assert caught.value.code == "NCF207"
